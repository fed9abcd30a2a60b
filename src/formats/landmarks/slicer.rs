use glam::DVec3;
use serde::Deserialize;
use serde_json::value::RawValue;

use super::{Axes, LandmarkFile, Mark};
use crate::formats::error::Fault;
use crate::formats::text::shown;

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Markup<'a> {
    #[serde(borrow)]
    coordinate_system: Option<&'a RawValue>,
    #[serde(borrow, default)]
    control_points: Vec<&'a RawValue>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct ControlPoint {
    label: Option<String>,
    position: Option<[Option<f64>; 3]>,
    position_status: Option<String>,
}

/// The control points of all lists in 3D Slicer's markups.
pub(super) fn read(markups: &RawValue) -> Result<LandmarkFile, Fault> {
    let markups: Vec<&RawValue> = serde_json::from_str(markups.get())
        .map_err(|_| Fault::at("markups", "must be a list of 3D Slicer's markups"))?;
    let mut file = LandmarkFile::default();
    for (at, markup) in markups.into_iter().enumerate() {
        let place = format!("markups[{at}]");
        let markup: Markup =
            serde_json::from_str(markup.get()).map_err(|error| Fault::at(&place, error.to_string()))?;
        let axes = axes(markup.coordinate_system, &place)?;
        if file.axes.replace(axes).is_some_and(|before| before != axes) {
            return Err(Fault::at(
                place,
                "has another coordinateSystem than the list before: save them in one",
            ));
        }
        for point in markup.control_points {
            control_point(point, &place, &mut file)?;
        }
    }
    Ok(file)
}

fn axes(stated: Option<&RawValue>, place: &str) -> Result<Axes, Fault> {
    // Early versions wrote numbers.
    match stated.map(|stated| stated.get().trim_matches('"')) {
        None | Some("LPS" | "1") => Ok(Axes::Lps),
        Some("RAS" | "0") => Ok(Axes::Ras),
        Some(other) => {
            let problem =
                format!("has the coordinateSystem `{}`: save it in LPS or RAS", shown(other.as_bytes()));
            Err(Fault::at(place, problem))
        }
    }
}

fn control_point(raw: &RawValue, place: &str, file: &mut LandmarkFile) -> Result<(), Fault> {
    let number = file.names.len();
    let wrong = |problem: String| Fault::at(format_args!("{place}, control point {number}"), problem);
    let point: ControlPoint = serde_json::from_str(raw.get()).map_err(|error| wrong(error.to_string()))?;
    // Points to be placed yet have a position that means nothing.
    let defined = point.position_status.is_none_or(|status| status == "defined");
    let mark = match point.position.filter(|_| defined) {
        None | Some([None, None, None]) => None,
        Some([Some(x), Some(y), Some(z)]) => Some(Mark::Point(DVec3::new(x, y, z))),
        Some(_) => return Err(wrong("has not all of x, y and z".to_owned())),
    };
    let label = point.label.filter(|label| !label.is_empty());
    file.push(label.unwrap_or_else(|| number.to_string()), mark);
    Ok(())
}

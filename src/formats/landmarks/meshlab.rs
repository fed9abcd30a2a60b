use glam::DVec3;
use quick_xml::XmlVersion;
use quick_xml::events::{BytesStart, Event};

use super::{LandmarkFile, Mark};
use crate::formats::error::Fault;
use crate::formats::text::{finite, shown};

/// The elements `point` of MeshLab's picked points.
pub(super) fn read(bytes: &[u8]) -> Result<LandmarkFile, Fault> {
    let wrong = |problem: String| Fault::at("its XML", problem);
    let text = std::str::from_utf8(bytes).map_err(|error| wrong(format!("is not UTF-8: {error}")))?;
    let mut reader = quick_xml::Reader::from_str(text);
    let mut file = LandmarkFile::default();
    let mut open = 0usize;
    loop {
        let event = reader.read_event().map_err(|error| wrong(error.to_string()))?;
        match &event {
            Event::Start(_) => open += 1,
            Event::End(_) => open = open.saturating_sub(1),
            Event::Eof => break,
            _ => {}
        }
        match &event {
            Event::Start(element) | Event::Empty(element) if is_point(element) => point(element, &mut file)?,
            _ => {}
        }
    }
    match open {
        0 => Ok(file),
        _ => Err(wrong("ends within an element: the file is cut short".to_owned())),
    }
}

fn is_point(element: &BytesStart) -> bool {
    element.local_name().as_ref() == "point"
}

fn point(element: &BytesStart, file: &mut LandmarkFile) -> Result<(), Fault> {
    let number = file.names.len();
    let place = format!("point {number}");
    let mut name = None;
    let mut active = true;
    let mut position = [None; 3];
    // Names that are there twice would be sought in all those before: a way to take a long time.
    for attribute in element.attributes().with_checks(false) {
        let attribute = attribute.map_err(|error| Fault::at(&place, error.to_string()))?;
        let value = attribute.normalized_value(XmlVersion::Implicit1_0);
        let value = value.map_err(|error| Fault::at(&place, error.to_string()))?;
        match attribute.key.as_ref() {
            "name" => name = Some(value.into_owned()),
            "active" => active = value.trim() != "0",
            "x" => position[0] = Some(coordinate(&place, "x", &value)?),
            "y" => position[1] = Some(coordinate(&place, "y", &value)?),
            "z" => position[2] = Some(coordinate(&place, "z", &value)?),
            _ => {}
        }
    }
    let mark = match position {
        _ if !active => None,
        [Some(x), Some(y), Some(z)] => Some(Mark::Point(DVec3::new(x, y, z))),
        _ => return Err(Fault::at(place, "has not all of x, y and z; one that is missing has active=\"0\"")),
    };
    file.push(name.unwrap_or_else(|| number.to_string()), mark);
    Ok(())
}

fn coordinate(place: &str, axis: &str, value: &str) -> Result<f64, Fault> {
    finite(value.trim().as_bytes()).ok_or_else(|| {
        let problem = format!("has the {axis} `{}`: it must be a finite number", shown(value.as_bytes()));
        Fault::at(place, problem)
    })
}

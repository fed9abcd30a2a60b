use glam::DVec3;
use serde::Deserialize;

use super::{Centre, Channel, Source, Sphere};
use crate::formats::error::Fault;

const FORMS: &str = "expected a list of weights, or an object with one of `weights`, `spheres` and `colour`";

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Document {
    weights: Option<Vec<f64>>,
    spheres: Option<Vec<Entry>>,
    outside: Option<f64>,
    colour: Option<Colour>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Entry {
    landmark: Option<String>,
    centre: Option<[f64; 3]>,
    radius: f64,
    weight: Option<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Colour {
    channel: Channel,
    threshold: Option<f64>,
    #[serde(default)]
    inverted: bool,
}

/// A list of weights, or an object that says of what kind the mask is.
pub(super) fn read(bytes: &[u8]) -> Result<Source, Fault> {
    let malformed = |error: serde_json::Error| Fault::at("the mask's JSON", format!("{error}; {FORMS}"));
    if bytes.trim_ascii_start().starts_with(b"[") {
        return listed(serde_json::from_slice(bytes).map_err(malformed)?);
    }
    let document: Document = serde_json::from_slice(bytes).map_err(malformed)?;
    match document {
        Document { weights: Some(weights), spheres: None, outside: None, colour: None } => listed(weights),
        Document { weights: None, spheres: Some(entries), outside, colour: None } => {
            let spheres = entries.into_iter().enumerate().map(sphere).collect::<Result<_, _>>()?;
            Ok(Source::Regions { spheres, outside: share("outside", outside.unwrap_or(1.0))? })
        }
        Document { weights: None, spheres: None, outside: None, colour: Some(colour) } => {
            let threshold = colour.threshold.map(|threshold| share("colour, threshold", threshold));
            let Colour { channel, inverted, .. } = colour;
            Ok(Source::Colours { channel, threshold: threshold.transpose()?, inverted })
        }
        _ => Err(Fault::at("the mask", FORMS)),
    }
}

fn listed(weights: Vec<f64>) -> Result<Source, Fault> {
    let weight = |(i, weight)| share(&format!("weights, entry {i}"), weight);
    weights.into_iter().enumerate().map(weight).collect::<Result<_, _>>().map(Source::Weights)
}

fn sphere((k, entry): (usize, Entry)) -> Result<Sphere, Fault> {
    let place = |field: &str| format!("spheres, entry {k}{field}");
    let Entry { landmark, centre, radius, weight } = entry;
    let centre = match (landmark, centre.map(DVec3::from)) {
        (Some(name), None) => Centre::Landmark(name),
        (None, Some(point)) => Centre::Point(point),
        _ => return Err(Fault::at(place(""), "needs either a `landmark` or a `centre`")),
    };
    if radius <= 0.0 {
        return Err(Fault::at(place(", radius"), format!("is {radius}: it must be above 0")));
    }
    Ok(Sphere { centre, radius, weight: share(&place(", weight"), weight.unwrap_or(0.0))? })
}

/// A number from 0 to 1.
fn share(place: &str, value: f64) -> Result<f32, Fault> {
    if (0.0..=1.0).contains(&value) {
        return Ok(value as f32);
    }
    Err(Fault::at(place, format!("is {value}: it must be from 0 to 1")))
}

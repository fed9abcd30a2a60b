use std::path::Path;

use serde_json::{Value, json};

use crate::formats::error::FormatError;
use crate::formats::numbering::{self, Numbering};
use crate::formats::output::write_whole;
use crate::mesh::LandmarkSet;

/// The landmarks as JSON that [`read_landmarks`](super::read_landmarks) reads back: a plain list where they are named by
/// their indices.
pub fn landmarks_json(set: &LandmarkSet) -> Value {
    let numbering = set.scheme.as_deref().and_then(Numbering::named);
    // A list of a known scheme must have all of its landmarks.
    let whole = numbering.is_none_or(|numbering| numbering.count() == set.names.len());
    let plain = numbering::counts_up(&set.names) && whole;
    let points = set.points.iter().map(|point| point.map(|p| p.to_array()));
    let mut document = if plain {
        json!({ "points": points.collect::<Vec<_>>() })
    } else {
        let named = set.names.iter().zip(points);
        let named: Vec<_> =
            named.map(|(name, position)| json!({ "name": name, "position": position })).collect();
        json!({ "landmarks": named })
    };
    if let Some(scheme) = &set.scheme {
        document["scheme"] = json!(scheme);
    }
    document
}

/// Writes [`landmarks_json`] to a file.
///
/// # Errors
/// [`FormatError`] where the file cannot be written.
pub fn write_landmarks(path: impl AsRef<Path>, set: &LandmarkSet) -> Result<(), FormatError> {
    write_whole(path.as_ref(), landmarks_json(set).to_string().as_bytes())
}

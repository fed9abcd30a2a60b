//! glTF 2.0 and its binary container GLB: the triangles of the default scene, in the scene's space.
//!
//! Skins are taken in their bind pose and morph targets at weight zero, which is how a scan is stored.

mod accessor;
mod buffer;
mod container;
mod document;
mod image;
mod rewriter;
mod scene;
mod surface;
#[cfg(test)]
mod tests;

use serde_json::Value;

use super::error::Fault;
use super::geometry::Geometry;
use super::glb;
use super::input::Siblings;
use super::weld::weld;
use buffer::Buffers;
use container::Container;
use document::Document;
pub(super) use rewriter::{embed, rewrite};

/// The `extras` of the default scene of a glTF or GLB, if it is one and has any.
pub fn scene_extras(bytes: &[u8]) -> Option<Value> {
    let container = Container::split(bytes).ok()?;
    let mut document: Value = serde_json::from_slice(container.json).ok()?;
    let scene = document.get("scene").and_then(Value::as_u64).unwrap_or(0);
    document.get_mut("scenes")?.get_mut(usize::try_from(scene).ok()?)?.get_mut("extras").map(Value::take)
}

/// Reads all triangles, strips and fans of the scene, each node's transform applied, and closes their seams. Colours,
/// texture coordinates and base colour pictures come along.
pub(super) fn read(bytes: &[u8], siblings: &Siblings) -> Result<Geometry, Fault> {
    let container = Container::split(bytes)?;
    let document = Document::parse(container.json)?;
    let buffers = Buffers::new(&document, container.binary, siblings, bytes.len());
    let geometry = scene::gather(&buffers)?.geometry;
    // What this program wrote has no seams, and its vertex order is what it is kept for.
    let own = document.asset()?.generator.is_some_and(|name| name.starts_with(glb::PROGRAM));
    Ok(if own { geometry } else { weld(geometry) })
}

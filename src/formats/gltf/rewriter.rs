//! A glTF or GLB with other positions: the floats of its POSITION and NORMAL accessors and the bounds that these state
//! are replaced, all else stays byte for byte.

use std::collections::{BTreeMap, HashMap};
use std::ops::Range;

use glam::{DMat3, DVec3};
use serde::Deserialize;
use serde_json::json;
use serde_json::value::RawValue;

use super::accessor::{self, Vectors};
use super::buffer::{Buffers, embedding};
use super::container::Container;
use super::document::Document;
use super::scene::{self, Place, Scene};
use crate::formats::area_normals::AreaNormals;
use crate::formats::error::Fault;
use crate::formats::geometry::{GONE, Geometry, Numbers};
use crate::formats::input::Siblings;
use crate::formats::splices::{Splices, range_in};

/// The bytes of a glTF that was read before and is whole in itself, its vertices at other positions `[N, 3]` of the mesh,
/// whose vertices those of the file have become by `numbers`. A vertex of the file that is not in the mesh stays.
pub(in crate::formats) fn rewrite(
    bytes: &[u8],
    numbers: &Numbers,
    positions: &[DVec3],
) -> Result<Vec<u8>, Fault> {
    let container = Container::split(bytes)?;
    let document = Document::parse(container.json)?;
    let siblings = Siblings::none();
    let buffers = Buffers::new(&document, container.binary, &siblings, bytes.len());
    let Scene { geometry, places } = scene::gather(&buffers)?;
    let mut rewriter =
        Rewriter { buffers: &buffers, numbers, positions, changed: BTreeMap::new(), text: Vec::new() };
    let mut written = Vec::new();
    for place in &places {
        written.extend(rewriter.place(place)?);
        for &normals in &place.normals {
            rewriter.normals(normals, place, &geometry);
        }
    }
    rewriter.check(&written)?;
    let Rewriter { changed, text, .. } = rewriter;
    assembled(bytes, &container, &document, changed, text)
}

/// A glTF with the buffers in it that were in files beside it.
pub(in crate::formats) fn embed(bytes: &[u8], siblings: &Siblings) -> Result<Vec<u8>, Fault> {
    let container = Container::split(bytes)?;
    let document = Document::parse(container.json)?;
    let buffers = Buffers::new(&document, container.binary, siblings, bytes.len());
    let mut beside = BTreeMap::new();
    for index in 0..document.buffer_count() {
        if document.buffer(index)?.uri.is_some_and(|uri| !uri.starts_with("data:")) {
            beside.insert(index, buffers.bytes(index)?.to_vec());
        }
    }
    assembled(bytes, &container, &document, beside, Vec::new())
}

struct Rewriter<'r, 'a> {
    buffers: &'r Buffers<'a>,
    numbers: &'r Numbers,
    positions: &'r [DVec3],
    /// The buffers that change.
    changed: BTreeMap<usize, Vec<u8>>,
    /// What replaces parts of the JSON.
    text: Vec<(&'a RawValue, String)>,
}

/// Bytes that were written, and where: buffer, offset.
type Written = (usize, usize, [u8; 12]);

impl Rewriter<'_, '_> {
    /// The mesh's vertex that vertex `vertex` of the file has become.
    fn vertex(&self, vertex: u32) -> Option<usize> {
        let number = match self.numbers {
            Numbers::Changed(numbers) => {
                numbers.get(vertex as usize).copied().filter(|&number| number != GONE)?
            }
            Numbers::Kept | Numbers::None => vertex,
        };
        Some(number as usize).filter(|&number| number < self.positions.len())
    }

    /// Puts the positions where the file has them, and their bounds.
    fn place(&mut self, place: &Place) -> Result<Vec<Written>, Fault> {
        let vectors = Vectors::of(self.buffers, place.accessor)?;
        let back = place.transform.inverse();
        if !back.is_finite() {
            let problem = "is placed by a node that flattens it, from which there is no way back";
            return Err(Fault::at(format_args!("accessors[{}]", place.accessor), problem));
        }
        let mut written = Vec::new();
        let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
        for (range, at) in vectors.ranges().zip(place.first..) {
            let stored = match self.vertex(at) {
                Some(vertex) => {
                    let stored = single(back.transform_point3(self.positions[vertex]))?;
                    written.push((vectors.buffer, range.start, packed(stored)));
                    stored
                }
                None => self.stored(&vectors, range)?,
            };
            low = std::array::from_fn(|axis| low[axis].min(stored[axis]));
            high = std::array::from_fn(|axis| high[axis].max(stored[axis]));
        }
        written.iter().try_for_each(|written| self.write(written))?;
        self.bounds(place.accessor, low, high);
        Ok(written)
    }

    fn stored(&self, vectors: &Vectors, range: Range<usize>) -> Result<[f32; 3], Fault> {
        let bytes = &self.buffers.bytes(vectors.buffer)?[range];
        Ok(std::array::from_fn(|axis| {
            let at = 4 * axis;
            f32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])
        }))
    }

    fn write(&mut self, &(buffer, start, bytes): &Written) -> Result<(), Fault> {
        if !self.changed.contains_key(&buffer) {
            self.changed.insert(buffer, self.buffers.bytes(buffer)?.to_vec());
        }
        if let Some(buffer) = self.changed.get_mut(&buffer) {
            buffer[start..start + bytes.len()].copy_from_slice(&bytes);
        }
        Ok(())
    }

    /// States an accessor's bounds anew where it states some.
    fn bounds(&mut self, accessor: usize, low: [f32; 3], high: [f32; 3]) {
        let entry = self.buffers.document().accessor_text(accessor);
        let stated: Option<Bounds> = entry.and_then(|entry| serde_json::from_str(entry.get()).ok());
        let Some(Bounds { min, max }) = stated else { return };
        for (stated, bound) in [(min, low), (max, high)] {
            if let Some(stated) = stated {
                self.text.push((stated, json!(bound.map(f64::from)).to_string()));
            }
        }
    }

    /// Takes normals anew. Vertices of the file that were one but for their texture coordinates, and had one normal,
    /// have one again. Normals that cannot be read or written are left alone, as they were when the mesh was read.
    fn normals(&mut self, accessor: usize, place: &Place, geometry: &Geometry) {
        let Ok(old) = accessor::positions(self.buffers, accessor) else { return };
        let Ok(vectors) = Vectors::of(self.buffers, accessor) else { return };
        if old.len() != place.count as usize {
            return;
        }
        let mut shared: HashMap<(usize, [u64; 3]), usize> = HashMap::new();
        let normal_of: Vec<Option<usize>> = (place.first..)
            .zip(&old)
            .map(|(at, old)| {
                let next = shared.len();
                let key = (self.vertex(at)?, old.to_array().map(f64::to_bits));
                Some(*shared.entry(key).or_insert(next))
            })
            .collect();
        let mut normals = AreaNormals::new(self.positions, shared.len());
        for corners in geometry.polygons.iter() {
            let [Some(a), Some(b), Some(c)] = [0, 1, 2].map(|k| self.vertex(corners[k])) else { continue };
            let normal = |k: usize| *normal_of.get(corners[k].checked_sub(place.first)? as usize)?;
            normals.add([a, b, c].map(|vertex| vertex as u32), [0, 1, 2].map(normal));
        }
        let normals = normals.finish();
        // The inverse of how normals are taken to the scene.
        let back = DMat3::from_mat4(place.transform).transpose();
        for (range, normal) in vectors.ranges().zip(&normal_of) {
            let normal = normal.and_then(|at| normals[at]).and_then(|normal| (back * normal).try_normalize());
            if let Some(Ok(stored)) = normal.map(single) {
                // The buffer can be read, for its vectors were.
                let _ = self.write(&(vectors.buffer, range.start, packed(stored)));
            }
        }
    }

    /// Whether all positions stand where they were written: parts of the scene may share bytes.
    fn check(&self, written: &[Written]) -> Result<(), Fault> {
        let stands = |&(buffer, start, bytes): &Written| {
            self.changed.get(&buffer).is_some_and(|buffer| buffer[start..].starts_with(&bytes))
        };
        if written.iter().all(stands) {
            return Ok(());
        }
        let problem = "shares vertices between parts of the scene, which results do not: \
                       save the mesh without instances";
        Err(Fault::at("the default scene", problem))
    }
}

#[derive(Deserialize)]
struct Bounds<'a> {
    #[serde(borrow)]
    min: Option<&'a RawValue>,
    #[serde(borrow)]
    max: Option<&'a RawValue>,
}

#[derive(Deserialize)]
struct Uri<'a> {
    #[serde(borrow)]
    uri: Option<&'a RawValue>,
}

fn single(vector: DVec3) -> Result<[f32; 3], Fault> {
    let stored = vector.as_vec3();
    let problem = || format!("{vector} is not of 32-bit floats: place the mesh nearer to its origin");
    if stored.is_finite() { Ok(stored.to_array()) } else { Err(Fault::DoesNotFit(problem())) }
}

fn packed(vector: [f32; 3]) -> [u8; 12] {
    let mut bytes = [0; 12];
    for (at, coordinate) in vector.into_iter().enumerate() {
        bytes[4 * at..4 * at + 4].copy_from_slice(&coordinate.to_le_bytes());
    }
    bytes
}

/// The file with other buffers and other parts of its JSON.
fn assembled<'a>(
    bytes: &[u8],
    container: &Container,
    document: &Document<'a>,
    mut buffers: BTreeMap<usize, Vec<u8>>,
    mut text: Vec<(&'a RawValue, String)>,
) -> Result<Vec<u8>, Fault> {
    let in_chunk = container.binary.filter(|_| document.buffer(0).is_ok_and(|buffer| buffer.uri.is_none()));
    let binary = in_chunk.and_then(|chunk| Some((range_in(chunk, bytes)?.start, buffers.remove(&0)?)));
    for (index, buffer) in &buffers {
        let entry = document.buffer_text(*index);
        let entry: Option<Uri> = entry.and_then(|entry| serde_json::from_str(entry.get()).ok());
        if let Some(Uri { uri: Some(raw) }) = entry {
            let like = document.buffer(*index)?.uri.unwrap_or_default();
            text.push((raw, json!(embedding(buffer, &like)).to_string()));
        }
    }
    let mut text: Vec<(Range<usize>, String)> = text
        .into_iter()
        .filter_map(|(raw, with)| Some((range_in(raw.get().as_bytes(), container.json)?, with)))
        .collect();
    text.sort_by_key(|(range, _)| range.start);
    text.dedup_by_key(|(range, _)| range.start);
    let mut json = Splices::new(container.json);
    text.iter().for_each(|(range, with)| json.replace(range.clone(), with.as_bytes()));
    let mut out = bytes.to_vec();
    if let Some((start, buffer)) = binary {
        out[start..start + buffer.len()].copy_from_slice(&buffer);
    }
    put_json(out, range_in(container.json, bytes), json.finish())
}

/// Puts other JSON where it is in a file, and its length in the headers if the file is a GLB.
fn put_json(file: Vec<u8>, at: Option<Range<usize>>, mut json: Vec<u8>) -> Result<Vec<u8>, Fault> {
    let Some(at) = at else { return Ok(file) };
    let is_glb = file.starts_with(b"glTF");
    if is_glb {
        json.truncate(json.trim_ascii_end().len());
        json.resize(json.len().next_multiple_of(4), b' ');
    }
    let mut out = [&file[..at.start], &json, &file[at.end..]].concat();
    if is_glb {
        let too_large =
            |_| Fault::DoesNotFit(format!("the file would have {} bytes; GLB reaches to 2^32", out.len()));
        let length = u32::try_from(out.len()).map_err(too_large)?;
        out[8..12].copy_from_slice(&length.to_le_bytes());
        out[12..16].copy_from_slice(&(json.len() as u32).to_le_bytes());
    }
    Ok(out)
}

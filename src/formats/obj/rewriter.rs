//! An OBJ with other positions: the numbers of its `v` and `vn` lines are replaced, all else stays byte for byte.

use glam::DVec3;

use super::counted_from_0;
use crate::formats::area_normals::AreaNormals;
use crate::formats::splices::Splices;
use crate::formats::text::{Lines, without_mark, words};

/// The bytes of an OBJ that was read before, its vertices at other positions `[N, 3]`.
///
/// Normals are taken anew where each `vn` belongs to one vertex; where several share one, all stay as they are.
pub(in crate::formats) fn rewrite(bytes: &[u8], positions: &[DVec3]) -> Vec<u8> {
    let text = without_mark(bytes);
    let normals = normals(text, positions);
    let mut out = Splices::new(bytes);
    let mut vertices = positions.iter();
    let mut normals = normals.iter();
    for line in Lines::continued(text) {
        let mut words = words(line.text);
        let vector = match words.next() {
            Some(b"v") => vertices.next().copied(),
            Some(b"vn") => normals.next().copied().flatten(),
            _ => None,
        };
        for (word, coordinate) in words.zip(vector.iter().flat_map(|vector| vector.to_array())) {
            out.replace_part(word, coordinate.to_string().as_bytes());
        }
    }
    out.finish()
}

/// The normal of each `vn` in its order, as far as they can be told.
fn normals(text: &[u8], positions: &[DVec3]) -> Vec<Option<DVec3>> {
    let count = Lines::continued(text).filter(|line| words(line.text).next() == Some(b"vn")).count();
    if count == 0 {
        return Vec::new();
    }
    let mut normals = AreaNormals::new(positions, count);
    let mut owners: Vec<Option<u32>> = vec![None; count];
    for face in faces(text) {
        for &Corner { vertex, normal } in &face {
            let owner = normal.and_then(|normal| owners.get_mut(normal));
            if owner.is_some_and(|owner| *owner.get_or_insert(vertex) != vertex) {
                return Vec::new();
            }
        }
        for k in 2..face.len() {
            let corners = [face[0], face[k - 1], face[k]];
            normals.add(
                corners.map(|corner| corner.vertex),
                corners.map(|corner| corner.normal.filter(|&normal| normal < count)),
            );
        }
    }
    normals.finish()
}

/// What a face's corner names, counted from 0.
#[derive(Clone, Copy)]
struct Corner {
    vertex: u32,
    normal: Option<usize>,
}

impl Corner {
    /// What `word` names where so many vertices and normals came before.
    fn named(word: &[u8], vertices: usize, normals: usize) -> Option<Self> {
        let mut names = word.split(|&b| b == b'/');
        let vertex = counted_from_0(names.next()?, vertices)?;
        let normal = names.nth(1).and_then(|name| counted_from_0(name, normals));
        Some(Self { vertex, normal: normal.map(|normal| normal as usize) })
    }
}

/// The corners of each face.
fn faces(text: &[u8]) -> impl Iterator<Item = Vec<Corner>> {
    let (mut vertices, mut normals) = (0, 0);
    Lines::continued(text).filter_map(move |line| {
        let mut words = words(line.text);
        match words.next()? {
            b"v" => vertices += 1,
            b"vn" => normals += 1,
            b"f" => {
                let corners = words.take_while(|word| !word.starts_with(b"#"));
                return Some(corners.filter_map(|word| Corner::named(word, vertices, normals)).collect());
            }
            _ => {}
        }
        None
    })
}

//! Wavefront OBJ: the statements `v`, `vt`, `f`, `usemtl` and `mtllib`; all groups and objects are one mesh.

mod material;
mod rewriter;
mod surface;
#[cfg(test)]
mod tests;
mod writer;

pub(super) use rewriter::rewrite;
pub use writer::{Obj, obj_bytes, write_obj};

use glam::DVec3;

use super::error::Fault;
use super::geometry::Geometry;
use super::input::Siblings;
use super::polygons::Polygons;
use super::stream::Stream;
use super::text::{finite, integer, shown, words};
use crate::mesh::{FilePoints, Points};
use surface::Surface;

/// Reads all vertices in their order and all faces. Normals and texture coordinates, which faces name by indices of
/// their own, split no vertex.
pub(super) fn read(stream: &mut Stream, siblings: &Siblings) -> Result<Geometry, Fault> {
    let mut reader = Reader::default();
    stream.skip_mark();
    while let Some(line) = stream.continued_line() {
        let mut words = words(line.text);
        match words.next() {
            Some(b"v") => reader.vertex(line.number, words)?,
            Some(b"f") => reader.face(line.number, words)?,
            Some(b"vt") => reader.surface.coordinate(line.number, words),
            Some(b"usemtl") => reader.surface.material(rest(line.text)),
            Some(b"mtllib") => reader.surface.library(rest(line.text)),
            _ => {}
        }
    }
    reader.finish(siblings)
}

/// What follows a statement's keyword: a name, blanks in it included.
fn rest(line: &[u8]) -> &[u8] {
    let line = line.trim_ascii();
    let keyword = line.iter().position(u8::is_ascii_whitespace).unwrap_or(line.len());
    line[keyword..].trim_ascii()
}

#[derive(Default)]
struct Reader {
    positions: FilePoints,
    polygons: Polygons,
    surface: Surface,
    /// The largest index that a face names, and its line: faces may come before their vertices.
    largest: Option<(u32, usize)>,
}

impl Reader {
    fn vertex<'a>(&mut self, line: usize, mut words: impl Iterator<Item = &'a [u8]>) -> Result<(), Fault> {
        let mut position = [0.0; 3];
        for (coordinate, axis) in position.iter_mut().zip(["x", "y", "z"]) {
            let word = words.next().unwrap_or_default();
            *coordinate = finite(word).ok_or_else(|| not_a_coordinate(line, axis, word))?;
        }
        self.positions.push(DVec3::from(position));
        self.surface.colour(words);
        Ok(())
    }

    fn face<'a>(&mut self, line: usize, words: impl Iterator<Item = &'a [u8]>) -> Result<(), Fault> {
        for word in words.take_while(|word| !word.starts_with(b"#")) {
            let mut names = word.split(|&b| b == b'/');
            let index = self.index(line, names.next().unwrap_or_default(), word)?;
            if self.largest.is_none_or(|(largest, _)| index > largest) {
                self.largest = Some((index, line));
            }
            self.surface.corner(self.polygons.corners().len(), line, names.next().unwrap_or_default());
            self.polygons.corner(index);
        }
        if self.polygons.close() {
            self.surface.polygon(self.polygons.len());
        } else {
            self.surface.drop_corners(self.polygons.closed());
        }
        Ok(())
    }

    /// The vertex, counted from 0, that the `name` in the corner `7`, `7/1`, `7//3`, `7/1/3` or `-1` names.
    fn index(&self, line: usize, name: &[u8], corner: &[u8]) -> Result<u32, Fault> {
        counted_from_0(name, self.positions.count())
            .ok_or_else(|| not_a_vertex(line, corner, self.positions.count()))
    }

    fn finish(self, siblings: &Siblings) -> Result<Geometry, Fault> {
        let vertices = self.positions.count();
        if let Some((index, line)) = self.largest
            && index as usize >= vertices
        {
            let problem = format!(
                "the face names vertex {}, but the file has {vertices} (`v`): it is cut short or damaged",
                u64::from(index) + 1
            );
            return Err(Fault::at(format_args!("line {line}"), problem));
        }
        let mut geometry =
            Geometry { positions: self.positions, polygons: self.polygons, ..Geometry::default() };
        self.surface.finish(&mut geometry, siblings);
        Ok(geometry)
    }
}

/// The index that a name means: counted from 1, or back from -1, the last of the `so_far` that came before.
fn counted_from_0(name: &[u8], so_far: usize) -> Option<u32> {
    let index = match integer(name)? {
        index @ 1.. => index - 1,
        0 => return None,
        index => (so_far as i64).checked_add(index)?,
    };
    u32::try_from(index).ok()
}

fn not_a_coordinate(line: usize, axis: &str, word: &[u8]) -> Fault {
    let problem = match word {
        b"" => format!("the vertex has no {axis}: write `v x y z`"),
        _ => format!("the vertex's {axis} is `{}`: it must be a finite number", shown(word)),
    };
    Fault::at(format_args!("line {line}"), problem)
}

fn not_a_vertex(line: usize, word: &[u8], so_far: usize) -> Fault {
    let problem = format!(
        "the face's corner `{}` names no vertex: they count from 1, or back from -1; {so_far} came before this line",
        shown(word)
    );
    Fault::at(format_args!("line {line}"), problem)
}

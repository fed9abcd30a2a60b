//! Landmark files, in any of the shapes that people keep named points in.

mod json;
mod meshlab;
mod parts;
mod resolve;
mod slicer;
#[cfg(test)]
mod tests;
mod vertex_list;
mod writer;

use std::collections::HashSet;
use std::path::Path;

use glam::DVec3;

pub use writer::{landmarks_json, write_landmarks};

use super::error::{Fault, FormatError};
use super::input::read_file;
use super::numbering::Numbering;
use super::text::{shown, without_mark};
use crate::mesh::LandmarkSet;

/// The landmarks of a file, some of them perhaps by vertices or triangles of a mesh that is not known yet.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LandmarkFile {
    scheme: Option<String>,
    names: Vec<String>,
    marks: Vec<Option<Mark>>,
    /// Names are indices, because the file gives none.
    listed: bool,
    /// Each point may be a triangle and two barycentric weights, as Wrap writes them.
    maybe_on_triangles: bool,
    axes: Option<Axes>,
}

/// Where a landmark is.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Mark {
    Point(DVec3),
    /// A vertex, counted from 0 in the mesh's file, and the line that names it.
    Vertex {
        index: u64,
        line: usize,
    },
}

/// What x and y point to in a patient; z points up.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Axes {
    /// Left and back.
    Lps,
    /// Right and front.
    Ras,
}

impl LandmarkFile {
    /// The ends of landmark files' names, of which the first is written.
    pub const EXTENSIONS: [&str; 5] = ["json", "ljson", "pp", "txt", "mrk.json"];

    /// Reads the landmarks of one scan, in the file's order. The format is told from the content:
    /// - JSON: `[point, ...]`, named by their indices "0", "1", ...; `{"name": point, ...}`; `{"points": ...}` or
    ///   `{"landmarks": ...}` with either of these, or with a list of `{"name": "...", "position": point}`, and beside
    ///   it perhaps `"scheme": "..."`. A point is `[x, y, z]` in the scan's own space and units, or `null` where it is
    ///   missing.
    /// - JSON by Wrap, `[[triangle, u, v], ...]` or `{"name": [triangle, u, v], ...}`: u of the triangle's first corner,
    ///   v of its second, the rest of its third. Polygons count as many triangles as they are cut into.
    /// - Menpo's LJSON, version 1, 2 or 3. Where its labels are those of iBUG's parts of the face, the landmarks are the
    ///   68 of Multi-PIE, in whatever order the parts come.
    /// - 3D Slicer's markups (`.mrk.json`): control points by their labels.
    /// - MeshLab's picked points (`.pp`): inactive ones are missing.
    /// - Text: one vertex a line, counted from 0 in the mesh's file, or `null`; `#` begins a comment.
    ///
    /// # Errors
    /// [`FormatError`] names the landmark that is malformed or not finite, a name that is given twice, or how the
    /// number of points differs from the stated scheme's.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, FormatError> {
        let path = path.as_ref();
        Self::parse(&read_file(path)?).map_err(|error| error.in_file(path))
    }

    /// Reads landmarks as [`read`](Self::read) does, from the bytes of a file.
    ///
    /// # Errors
    /// As [`read`](Self::read), without a file.
    pub fn parse(bytes: &[u8]) -> Result<Self, FormatError> {
        let bytes = without_mark(bytes);
        let mut file = match bytes.trim_ascii_start() {
            [b'{' | b'[', ..] => json::read(bytes),
            [b'<', ..] => meshlab::read(bytes),
            _ => vertex_list::read(bytes),
        }?;
        file.check()?;
        file.number()?;
        Ok(file)
    }

    /// The same landmarks by the names of `scheme`, unless the file states a scheme itself.
    ///
    /// # Errors
    /// [`FormatError`] where they are not those of the scheme.
    pub fn or_scheme(mut self, scheme: &str) -> Result<Self, FormatError> {
        if self.scheme.is_none() {
            self.scheme = Some(scheme.to_owned());
            self.number()?;
        }
        Ok(self)
    }

    /// The naming scheme, for instance `multipie68`, if one is stated.
    pub fn scheme(&self) -> Option<&str> {
        self.scheme.as_deref()
    }

    /// The names of the landmarks that are not missing.
    pub fn present(&self) -> impl Iterator<Item = &str> {
        self.names.iter().zip(&self.marks).filter(|(_, mark)| mark.is_some()).map(|(name, _)| name.as_str())
    }

    fn push(&mut self, name: String, mark: Option<Mark>) {
        self.names.push(name);
        self.marks.push(mark);
    }

    fn check(&self) -> Result<(), Fault> {
        if self.present().next().is_none() {
            let problem = format!("are {} and none has a position", self.names.len());
            return Err(Fault::at("the landmarks", problem));
        }
        let mut seen = HashSet::new();
        match self.names.iter().find(|&name| !seen.insert(name)) {
            Some(twice) => {
                let place = format!("landmark `{}`", shown(twice.as_bytes()));
                Err(Fault::at(place, "is given twice: each must have a name of its own"))
            }
            None => Ok(()),
        }
    }

    /// Calls the landmarks as the stated scheme does, if it is known.
    fn number(&mut self) -> Result<(), Fault> {
        let Some(numbering) = self.scheme.as_deref().and_then(Numbering::named) else { return Ok(()) };
        let names = std::mem::take(&mut self.names);
        let named = numbering.apply(names, self.listed);
        self.names = named.map_err(|problem| Fault::at("the landmarks", problem))?;
        self.scheme = Some(numbering.scheme.to_owned());
        Ok(())
    }
}

/// Reads the landmarks of one scan as [`LandmarkFile::read`] does, where they need no mesh.
///
/// # Errors
/// As [`LandmarkFile::read`], and where landmarks are vertices of a mesh.
pub fn read_landmarks(path: impl AsRef<Path>) -> Result<LandmarkSet, FormatError> {
    let path = path.as_ref();
    let file = LandmarkFile::read(path)?;
    file.positions().map_err(|error| error.in_file(path))
}

/// Reads landmarks as [`read_landmarks`] does, from the bytes of a file.
///
/// # Errors
/// As [`read_landmarks`], without a file.
pub fn parse_landmarks(bytes: &[u8]) -> Result<LandmarkSet, FormatError> {
    LandmarkFile::parse(bytes)?.positions()
}

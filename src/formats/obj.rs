//! Wavefront OBJ: the statements `v` and `f`; all groups and objects are one mesh.

use std::io::Write;
use std::path::Path;

use glam::DVec3;

use super::error::{Fault, FormatError};
use super::geometry::{Fan, Geometry};
use super::output::write_whole;
use super::text::{Lines, finite, integer, shown, without_mark, words};
use crate::mesh::TriangleMesh;

/// Reads all vertices in their order, and all faces cut into fans. Normals and texture coordinates, which faces name by
/// indices of their own, split no vertex.
pub(super) fn read(bytes: &[u8]) -> Result<Geometry, Fault> {
    let mut reader = Reader::default();
    for line in Lines::continued(without_mark(bytes)) {
        let mut words = words(line.text);
        match words.next() {
            Some(b"v") => reader.vertex(line.number, words)?,
            Some(b"f") => reader.face(line.number, words)?,
            _ => {}
        }
    }
    reader.finish()
}

#[derive(Default)]
struct Reader {
    geometry: Geometry,
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
        self.geometry.positions.push(DVec3::from(position));
        Ok(())
    }

    fn face<'a>(&mut self, line: usize, words: impl Iterator<Item = &'a [u8]>) -> Result<(), Fault> {
        let mut fan = Fan::default();
        for word in words.take_while(|word| !word.starts_with(b"#")) {
            let index = self.index(line, word)?;
            if self.largest.is_none_or(|(largest, _)| index > largest) {
                self.largest = Some((index, line));
            }
            self.geometry.triangles.extend(fan.corner(index));
        }
        Ok(())
    }

    /// The vertex, counted from 0, that `7`, `7/1`, `7//3`, `7/1/3` or `-1` names.
    fn index(&self, line: usize, word: &[u8]) -> Result<u32, Fault> {
        let name = word.split(|&b| b == b'/').next().unwrap_or_default();
        let so_far = self.geometry.positions.len() as i64;
        let index = match integer(name) {
            Some(index) if index > 0 => Some(index - 1),
            Some(index) if index < 0 => so_far.checked_add(index).filter(|&index| index >= 0),
            _ => None,
        };
        index.and_then(|index| u32::try_from(index).ok()).ok_or_else(|| not_a_vertex(line, word, so_far))
    }

    fn finish(self) -> Result<Geometry, Fault> {
        let vertices = self.geometry.positions.len();
        match self.largest {
            Some((index, line)) if index as usize >= vertices => {
                let problem = format!(
                    "the face names vertex {}, but the file has {vertices} (`v`): it is cut short or damaged",
                    u64::from(index) + 1
                );
                Err(Fault::at(format_args!("line {line}"), problem))
            }
            _ => Ok(self.geometry),
        }
    }
}

fn not_a_coordinate(line: usize, axis: &str, word: &[u8]) -> Fault {
    let problem = match word {
        b"" => format!("the vertex has no {axis}: write `v x y z`"),
        _ => format!("the vertex's {axis} is `{}`: it must be a finite number", shown(word)),
    };
    Fault::at(format_args!("line {line}"), problem)
}

fn not_a_vertex(line: usize, word: &[u8], so_far: i64) -> Fault {
    let problem = format!(
        "the face's corner `{}` names no vertex: they count from 1, or back from -1; {so_far} came before this line",
        shown(word)
    );
    Fault::at(format_args!("line {line}"), problem)
}

/// The mesh as OBJ, vertices in their order, every coordinate with as many digits as it needs to be read back exactly.
pub fn obj_bytes(mesh: &TriangleMesh) -> Vec<u8> {
    let mut out = Vec::new();
    let written = write_statements(mesh, &mut out);
    debug_assert!(written.is_ok(), "memory takes every write");
    out
}

fn write_statements(mesh: &TriangleMesh, out: &mut Vec<u8>) -> std::io::Result<()> {
    for p in mesh.positions() {
        writeln!(out, "v {} {} {}", p.x, p.y, p.z)?;
    }
    for corners in mesh.triangles() {
        let [a, b, c] = corners.map(|index| u64::from(index) + 1);
        writeln!(out, "f {a} {b} {c}")?;
    }
    Ok(())
}

/// Writes [`obj_bytes`] to a file.
///
/// # Errors
/// [`FormatError`] where the file cannot be written.
pub fn write_obj(path: impl AsRef<Path>, mesh: &TriangleMesh) -> Result<(), FormatError> {
    write_whole(path.as_ref(), &obj_bytes(mesh))
}

#[cfg(test)]
mod tests {
    use super::super::mutation::damage;
    use super::super::{MeshFormat, parse_mesh};
    use super::*;

    fn mesh(text: &[u8]) -> TriangleMesh {
        parse_mesh(text, MeshFormat::Obj).unwrap()
    }

    fn complaint(text: &[u8]) -> String {
        parse_mesh(text, MeshFormat::Obj).unwrap_err().to_string()
    }

    const CORNERS: &str = "v 0 0 0\nv 1 0 0 1.0\nv 1 1 0 0.5 0.5 0.5 # colour\nv 0 1 0\n";

    fn with_faces(faces: &str) -> Vec<u8> {
        format!("{CORNERS}{faces}").into_bytes()
    }

    #[test]
    fn corners_are_named_in_every_way() {
        for faces in [
            "f 1 2 3 4",
            "f 1/1 2/2 3/3 4/4 # quad",
            "vn 0 0 1\nf 1//1 2//1 3//1 4//1",
            "f -4/-4/-4 -3 -2 -1",
            "f 1 2\\\n 3 \\\r\n4",
            "o caf\u{e9}\ng a b\ns off\nusemtl m\nl 1 2\np 1\nf 1 2\nf\t1 2 3 4\r\n",
        ] {
            assert_eq!(mesh(&with_faces(faces)).triangles(), [[0, 1, 2], [0, 2, 3]], "{faces}");
        }
    }

    #[test]
    fn vertices_keep_their_number_and_order() {
        let mesh = mesh(b"f 3 2 1\nv 9 9 9\nv 1.5 -2e1 .25\nv 0 1 0\nv 7 7 7");
        assert_eq!(mesh.triangles(), [[2, 1, 0]]);
        assert_eq!(mesh.positions()[1], DVec3::new(1.5, -20.0, 0.25));
        assert_eq!(mesh.positions().len(), 4);
    }

    #[test]
    fn complaints_name_the_line() {
        assert!(complaint(b"v 0 0 0\nv 1 nan 0").contains("line 2: the vertex's y is `nan`"));
        assert!(complaint(b"v 0 0").contains("line 1: the vertex has no z"));
        assert!(complaint(b"v 0 0 1e999").contains("line 1"));
        for face in ["f 1 2 0", "f 1 2 -5", "f 1 2 x", "f 1 2 /3", "f 1 2 1.5", "f 1 2 99999999999"] {
            assert!(complaint(&with_faces(face)).contains("line 5: the face's corner"), "{face}");
        }
        let beyond = complaint(&with_faces("f 1 2 3\nf 1 2 4294967296\nf 1 2 9"));
        assert!(beyond.contains("line 6: the face names vertex 4294967296, but the file has 4"), "{beyond}");
    }

    #[test]
    fn what_holds_no_mesh_is_refused() {
        for text in ["", "\0\u{1}garbage", CORNERS, "v 1 1 1\nv 1 1 1\nv 1 1 1\nf 1 2 3"] {
            assert!(parse_mesh(text.as_bytes(), MeshFormat::Obj).is_err(), "{text}");
        }
    }

    #[test]
    fn what_is_written_is_read_back() {
        let text = "v 0.1 -3e-7 123456789.123\nv 1 0 0\nv 0 1e20 0\nv 5 5 5\nf 2 1 3";
        let original = mesh(text.as_bytes());
        assert_eq!(mesh(&obj_bytes(&original)), original);
    }

    #[test]
    fn damage_panics_nowhere() {
        let file = with_faces("vt 0 0\nf 1/1 2/1 -2 4\\\n3\n# end\nf -1//1 1 2\n");
        damage(&file, 30_000, |bytes| drop(parse_mesh(bytes, MeshFormat::Obj)));
    }
}

use glam::DVec3;

use crate::formats::{MeshFile, MeshFormat, parse_mesh};

const CORNERS: [[f32; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];

/// The square of [`CORNERS`] and a triangle of no area.
const FACES: [[usize; 3]; 3] = [[0, 1, 2], [1, 1, 2], [0, 2, 3]];

fn ascii() -> String {
    let vertex = |i: &usize| format!("   vertex {} {} {}\n", CORNERS[*i][0], CORNERS[*i][1], CORNERS[*i][2]);
    let facet = |corners: &[usize; 3]| {
        let vertices: String = corners.iter().map(vertex).collect();
        format!(" facet normal 0 0 1\n  outer loop\n{vertices}  endloop\n endfacet\n")
    };
    format!("solid a square\n{}endsolid a square\n", FACES.iter().map(facet).collect::<String>())
}

fn binary(header: &[u8]) -> Vec<u8> {
    let mut out = header.to_vec();
    out.resize(80, b' ');
    out.extend((FACES.len() as u32).to_le_bytes());
    for corners in FACES {
        let numbers = [[0.0, 0.0, 1.0f32]].into_iter().chain(corners.map(|i| CORNERS[i]));
        out.extend(numbers.flatten().flat_map(f32::to_le_bytes));
        out.extend([0x12, 0x34]);
    }
    out
}

fn read(bytes: &[u8]) -> MeshFile {
    MeshFile::parse(bytes, MeshFormat::Stl).unwrap()
}

fn complaint(bytes: &[u8]) -> String {
    parse_mesh(bytes, MeshFormat::Stl).unwrap_err().to_string()
}

#[test]
fn corners_in_the_same_place_are_one_vertex() {
    for bytes in [ascii().into_bytes(), binary(b"made by hand"), binary(b"solid, and yet binary")] {
        let file = read(&bytes);
        assert_eq!(file.mesh.triangles(), [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(file.mesh.positions(), CORNERS.map(|corner| DVec3::from(corner.map(f64::from))));
        assert_eq!(file.polygons().len(), 2);
    }
    let twice = ascii() + "\r\n" + &ascii().replace("1 1 0", "1 1 5");
    assert_eq!(read(twice.as_bytes()).mesh.triangles().len(), 4);
}

#[test]
fn complaints_name_line_or_triangle() {
    let with = |from: &str, to: &str| complaint(ascii().replacen(from, to, 1).as_bytes());
    assert!(with("vertex 1 0 0", "vertex 1 nan 0").contains("line 5: the vertex holds `nan`"));
    assert!(with("vertex 1 0 0", "vertex 1").contains("line 5: the vertex holds ``"));
    assert!(with("   vertex 1 0 0\n", "").contains("line 7: the triangle has not three corners"));
    assert!(with("outer loop", "inner loop").contains("line 3: `  inner loop` is no statement"));
    assert!(with("endsolid", "solid").contains("no line `endsolid`"));
    let mut infinite = binary(b"");
    infinite[84 + 50 + 12..][..4].copy_from_slice(&f32::INFINITY.to_le_bytes());
    assert!(
        complaint(&infinite).contains("triangle 1: has a corner at [inf, 0, 0]"),
        "{}",
        complaint(&infinite)
    );
    let mut huge = binary(b"");
    huge[80..84].fill(255);
    assert!(complaint(&huge).contains("declares 4294967295 triangles, which take 214748364834 bytes"));
    assert!(complaint(b"").contains("begins with 84 bytes, here are 0"));
    assert!(complaint(b"solid nothing\nendsolid").contains("0 triangles"));
}

#[test]
fn a_file_cut_anywhere_is_refused() {
    let text = ascii();
    for end in 0..text.rfind("endsolid").unwrap() {
        assert!(parse_mesh(&text.as_bytes()[..end], MeshFormat::Stl).is_err(), "{end}");
    }
    let bytes = binary(b"solid");
    for end in 0..bytes.len() {
        assert!(parse_mesh(&bytes[..end], MeshFormat::Stl).is_err(), "{end}");
    }
}

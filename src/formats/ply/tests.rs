use glam::{DVec2, DVec3};

use super::ply_bytes;
use crate::formats::{MeshFile, MeshFormat, Texture, TextureImage, parse_mesh};
use crate::mesh::TriangleMesh;

fn mesh(bytes: &[u8]) -> TriangleMesh {
    parse_mesh(bytes, MeshFormat::Ply).unwrap_or_else(|error| panic!("{error}"))
}

fn complaint(bytes: &[u8]) -> String {
    parse_mesh(bytes, MeshFormat::Ply).unwrap_err().to_string()
}

/// A square as a quad, with properties and elements that are to be skipped, in each type of the format.
const HEADER: &str = "\
comment made by hand
obj_info nothing
element camera 1
property list uchar double intrinsics
property char kind
element vertex 4
property short nx
property float x
property list ushort float weights
property double y
property uchar red
property int z
element face 2
property uint group
property list uint16 int vertex_indices
property int8 flag
element edge 99
property int vertex1
end_header
";

fn ascii() -> Vec<u8> {
    let rows = "2 1.5 2.5 7\n0 0 0 0 255 0\n0 1 1 0.5 0 255 0\n\n-5 1 2 0.5 0.5 1e0 255 0\n0 0 0 1 255 0\n\
                0 4 0 1 2 3 -1\n0 2 0 1 0\n";
    format!("ply\nformat ascii 1.0\n{HEADER}{rows}").into_bytes()
}

/// The same rows as [`ascii`], each number's bytes turned by `order`.
fn binary(format: &str, order: fn(Vec<u8>) -> Vec<u8>) -> Vec<u8> {
    let mut out = format!("ply\nformat {format} 1.0\n{HEADER}").into_bytes();
    let mut add = |bytes: &[u8]| out.extend(order(bytes.to_vec()));
    add(&[2]);
    add(&1.5f64.to_le_bytes());
    add(&2.5f64.to_le_bytes());
    add(&[7]);
    for (x, y, weights) in [(0.0f32, 0.0f64, 0u16), (1.0, 0.0, 1), (1.0, 1.0, 2), (0.0, 1.0, 0)] {
        add(&(-5i16).to_le_bytes());
        add(&x.to_le_bytes());
        add(&weights.to_le_bytes());
        (0..weights).for_each(|_| add(&0.5f32.to_le_bytes()));
        add(&y.to_le_bytes());
        add(&[255]);
        add(&0i32.to_le_bytes());
    }
    for corners in [&[0i32, 1, 2, 3][..], &[0, 1]] {
        add(&9u32.to_le_bytes());
        add(&(corners.len() as u16).to_le_bytes());
        corners.iter().for_each(|index| add(&index.to_le_bytes()));
        add(&[0]);
    }
    out
}

fn little() -> Vec<u8> {
    binary("binary_little_endian", |bytes| bytes)
}

fn big() -> Vec<u8> {
    binary("binary_big_endian", |mut bytes| {
        bytes.reverse();
        bytes
    })
}

fn square() -> TriangleMesh {
    let positions = vec![DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::Y];
    TriangleMesh::new(positions, vec![[0, 1, 2], [0, 2, 3]]).unwrap()
}

#[test]
fn all_encodings_give_the_same_mesh() {
    for bytes in [ascii(), little(), big()] {
        assert_eq!(mesh(&bytes), square());
    }
    let text = String::from_utf8(ascii()).unwrap();
    assert_eq!(mesh(text.replace('\n', "\r\n").as_bytes()), square());
    assert_eq!(mesh(text.replace('\n', "\r").as_bytes()), square());
}

#[test]
fn every_integer_type_counts_and_indexes() {
    for count in ["char", "uchar", "short", "ushort", "int", "uint"] {
        for item in ["int8", "uint8", "int16", "uint16", "int32", "uint32"] {
            let header = format!(
                "ply\nformat binary_big_endian 1.0\nelement vertex 3\nproperty char x\nproperty uint16 y\n\
                 property uchar z\nelement face 1\nproperty list {count} {item} vertex_index\nend_header\n"
            );
            let size = |name: &str| match name {
                "char" | "uchar" | "int8" | "uint8" => 1,
                "short" | "ushort" | "int16" | "uint16" => 2,
                _ => 4,
            };
            let mut bytes = header.into_bytes();
            bytes.extend([0, 0, 0, 0, 0xFF, 0, 0, 0, 0, 0xFF, 0xFF, 0]);
            for (name, value) in [(count, 3u32), (item, 2), (item, 1), (item, 0)] {
                bytes.extend(&value.to_be_bytes()[4 - size(name)..]);
            }
            let mesh = mesh(&bytes);
            assert_eq!(mesh.triangles(), [[2, 1, 0]], "{count} {item}");
            assert_eq!(mesh.positions()[1..], [DVec3::new(-1.0, 0.0, 0.0), DVec3::new(0.0, 65535.0, 0.0)]);
        }
    }
}

#[test]
fn faces_may_come_before_vertices() {
    let text =
        b"ply\nformat ascii 1.0\nelement face 1\nproperty list uchar int vertex_indices\nelement vertex 3\n\
        property float x\nproperty float y\nproperty float z\nend_header\n3 0 1 2\n0 0 0\n1 0 0\n0 1 0";
    assert_eq!(mesh(text).triangles(), [[0, 1, 2]]);
}

#[test]
fn complaints_name_row_and_line() {
    let with = |from: &str, to: &str| {
        complaint(String::from_utf8(ascii()).unwrap().replacen(from, to, 1).as_bytes())
    };
    assert!(with("0 1 1 0.5 0", "0 nan 1 0.5 0").contains("vertex 1 (line 24): holds `nan`"));
    assert!(with("0 1 1 0.5 0", "0 1 1 0.5 0 7").contains("vertex 1 (line 24): has more numbers"));
    assert!(with("0 1 1 0.5 0 255 0", "0 1 1 0.5 0 255").contains("vertex 1 (line 24): has fewer"));
    assert!(with("4 0 1 2 3", "4 0 1 2 4").contains("face 0 (line 28): names vertex 4, but the file has 4"));
    assert!(with("4 0 1 2 3", "4 0 1 2 -1").contains("names vertex -1"));
    assert!(with("4 0 1 2 3", "4 0 1 2 3.5").contains("holds `3.5`"));
    assert!(with("4 0 1 2 3", "-4 0 1 2 3").contains("-4 items"));
    assert!(with("element face 2", "element face 3").contains("face 2 (line 29): is not there"));
    assert!(with("uint16 int vertex", "uint16 float vertex").contains("vertex_indices"));
    assert!(with("list uint16 int", "list float int").contains("line 17"));
    assert!(with("property int z", "property int w").contains("no property `z`"));
    assert!(with("property int z", "property long z").contains("`long`"));
    assert!(with("element face", "element tristrips").contains("camera, vertex, tristrips"));
    assert!(with("element edge", "element face").contains("twice"));
    assert!(with("end_header", "end_of_it").contains("`end_of_it`"));
    assert!(with("format ascii", "format utf8").contains("line 2"));
    assert!(with("element face 2", "element face -2").contains("no count"));
    let mut infinite = little();
    let x = infinite.windows(4).position(|bytes| bytes == 1.0f32.to_le_bytes()).unwrap();
    infinite[x..x + 4].copy_from_slice(&f32::NEG_INFINITY.to_le_bytes());
    assert!(complaint(&infinite).contains("vertex 1: is at [-inf, 0, 0]"), "{}", complaint(&infinite));
}

#[test]
fn declared_counts_take_no_memory() {
    for (bytes, element) in [(ascii(), "vertex"), (ascii(), "face"), (little(), "vertex"), (big(), "camera")]
    {
        let (from, to) = (format!("element {element} "), format!("element {element} 99999999999999999"));
        let start = bytes.windows(from.len()).position(|window| window == from.as_bytes()).unwrap();
        let huge = [&bytes[..start], to.as_bytes(), &bytes[start + from.len()..]].concat();
        assert!(complaint(&huge).contains("rows of at least"), "{}", complaint(&huge));
    }
    let empty_rows = b"ply\nformat ascii 1.0\nelement vertex 9\nelement face 99999999999999999\nend_header\n";
    assert!(complaint(empty_rows).contains("no property `x`"));
    let other = String::from_utf8(ascii())
        .unwrap()
        .replace("element camera", "element void 99999999999\nelement camera");
    assert_eq!(mesh(other.as_bytes()), square());
}

#[test]
fn a_file_cut_anywhere_is_refused_or_whole() {
    for (bytes, rest) in [(ascii(), "0 2 0 1 0\n".len()), (little(), 0), (big(), 0)] {
        for end in 0..bytes.len() - rest {
            assert!(parse_mesh(&bytes[..end], MeshFormat::Ply).is_err(), "{end}");
        }
    }
}

#[test]
fn what_is_written_is_read_back() {
    let positions = vec![DVec3::new(0.1, -1e300, 1e-300), DVec3::X, DVec3::Y, DVec3::splat(9.0)];
    let original = TriangleMesh::new(positions, vec![[2, 1, 0], [0, 1, 2]]).unwrap();
    assert_eq!(mesh(&ply_bytes(&original)), original);
}

#[test]
fn colours_and_coordinates_of_vertices_are_read() {
    let text = "ply\nformat ascii 1.0\ncomment TextureFile lost.png\nelement vertex 3\nproperty float x\n\
                property float y\nproperty float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n\
                property float s\nproperty float t\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n\
                0 0 0 1 2 3 0 1\n1 0 0 4 5 6 .5 .25\n0 1 0 7 8 9 1 0\n3 2 1 0\n";
    let file = MeshFile::parse(text.as_bytes(), MeshFormat::Ply).unwrap();
    assert_eq!(file.colours.unwrap(), [[1, 2, 3, 255], [4, 5, 6, 255], [7, 8, 9, 255]]);
    let texture = file.texture.unwrap();
    assert_eq!(
        (texture.corners.as_slice(), texture.coordinate(1)),
        (&[2, 1, 0][..], Some(DVec2::new(0.5, 0.25)))
    );
    assert!(
        file.warnings[0].contains("`comment TextureFile` names the file `lost.png`"),
        "{:?}",
        file.warnings
    );
    let floats = text.replace("uchar red", "float red").replace("uchar green", "double green");
    let file =
        MeshFile::parse(floats.replace("uchar blue", "float blue").as_bytes(), MeshFormat::Ply).unwrap();
    assert_eq!(file.colours.unwrap()[0], [255; 4]);
    let opaque = text.replace("property float s", "property uchar alpha");
    let file = MeshFile::parse(opaque.as_bytes(), MeshFormat::Ply).unwrap();
    assert_eq!(file.colours.unwrap()[2], [7, 8, 9, 1]);
    assert!(file.texture.is_none());
}

#[test]
fn coordinates_of_faces_and_their_pictures_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let text = "ply\nformat ascii 1.0\ncomment TextureFile a b.png\ncomment TextureFile lost.png\nelement vertex 4\n\
                property float x\nproperty float y\nproperty float z\nelement face 4\n\
                property list uchar int vertex_indices\nproperty list uchar float texcoord\nproperty int texnumber\n\
                end_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n\
                3 0 1 2 6 0 0 1 0 1 1 0\n2 0 1 4 0 0 1 1 0\n3 0 2 3 0 1\n3 0 2 3 2 .5 .5 7\n";
    std::fs::write(folder.path().join("scan.ply"), text).unwrap();
    std::fs::write(folder.path().join("a b.png"), "").unwrap();
    let file = MeshFile::read(folder.path().join("scan.ply")).unwrap();
    let texture = file.texture.unwrap();
    let none = Texture::NONE;
    assert_eq!(texture.corners, [0, 1, 2, none, none, none, 3, none, none]);
    assert_eq!(texture.coordinates, [DVec2::ZERO, DVec2::X, DVec2::ONE, DVec2::splat(0.5)]);
    assert_eq!(texture.polygon_images, [0, none, none]);
    assert_eq!(texture.images, [TextureImage::File(folder.path().join("a b.png"))]);
    assert_eq!(file.warnings.len(), 1);
}

use glam::DVec3;

use super::MaskFile;
use crate::formats::{MeshFile, MeshFormat};
use crate::mesh::LandmarkSet;

/// A unit square with the landmark `corner` at (1, 1), the colours red, green, blue and white, and its own place as
/// texture coordinates.
const SQUARE: &str = "v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 1 1 0 0 0 1\nv 0 1 0 1 1 1\n\
    vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n";

fn weights_on(mesh: &str, mask: &[u8]) -> Result<Vec<f32>, String> {
    let mesh = MeshFile::parse(mesh.as_bytes(), MeshFormat::Obj).unwrap();
    let landmarks = LandmarkSet {
        scheme: None,
        names: vec!["corner".into()],
        points: vec![Some(DVec3::new(1.0, 1.0, 0.0))],
    };
    let mask = MaskFile::parse(mask).map_err(|error| error.to_string())?;
    mask.on(&mesh, &landmarks).map_err(|error| error.to_string())
}

fn weights(mask: &str) -> Result<Vec<f32>, String> {
    weights_on(SQUARE, mask.as_bytes())
}

fn png(width: u32, height: u32, colour: png::ColorType, pixels: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(colour);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.write_header().unwrap().write_image_data(pixels).unwrap();
    bytes
}

#[test]
fn weights_by_vertex() {
    for text in ["[0, 0.25, 1, 1.0]", r#" {"weights": [0, 0.25, 1, 1]}"#] {
        assert_eq!(weights(text).unwrap(), [0.0, 0.25, 1.0, 1.0]);
    }
    let complaint = weights("[1, 0, 1]").unwrap_err();
    assert!(complaint.contains("are 3, but the mesh's file has 4 vertices"), "{complaint}");
    let complaint = weights("[1, 0, 1, 1.5]").unwrap_err();
    assert!(complaint.contains("entry 3: is 1.5: it must be from 0 to 1"), "{complaint}");
    assert!(weights("[0, 0, 0, 0]").unwrap_err().contains("leaves nothing"));
}

#[test]
fn stl_has_no_vertex_numbers() {
    let stl = "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid\n";
    let mesh = MeshFile::parse(stl.as_bytes(), MeshFormat::Stl).unwrap();
    let mask = MaskFile::parse(b"[1, 1, 0]").unwrap();
    let complaint = mask.on(&mesh, &LandmarkSet::default()).unwrap_err().to_string();
    assert!(complaint.contains("does not number"), "{complaint}");
}

#[test]
fn spheres_take_the_least() {
    let text = r#"{"spheres": [{"landmark": "corner", "radius": 1, "weight": 0.5},
        {"centre": [0, 1.2, 0], "radius": 0.3}]}"#;
    assert_eq!(weights(text).unwrap(), [1.0, 0.5, 0.5, 0.0]);
    let text = r#"{"spheres": [{"centre": [0, 0, 0], "radius": 0.1, "weight": 1}], "outside": 0}"#;
    assert_eq!(weights(text).unwrap(), [1.0, 0.0, 0.0, 0.0]);
}

#[test]
fn colours_by_channel_and_threshold() {
    assert_eq!(weights(r#"{"colour": {"channel": "green"}}"#).unwrap(), [0.0, 1.0, 0.0, 1.0]);
    let grey = weights(r#"{"colour": {"channel": "grey", "threshold": 0.5, "inverted": true}}"#);
    assert_eq!(grey.unwrap(), [1.0, 1.0, 1.0, 0.0]);
    let plain = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    let complaint = weights_on(plain, br#"{"colour": {"channel": "red"}}"#).unwrap_err();
    assert!(complaint.contains("no vertex colours"), "{complaint}");
}

#[test]
fn what_is_painted_lies_as_the_texture_does() {
    // OBJ's coordinates count from the lower left: the first row is at y = 1.
    let grey = png(2, 2, png::ColorType::Grayscale, &[0, 51, 255, 102]);
    assert_eq!(weights_on(SQUARE, &grey).unwrap(), [1.0, 0.4, 0.2, 0.0]);
    let colour = png(1, 2, png::ColorType::Rgba, &[0, 0, 0, 255, 255, 255, 255, 0]);
    assert_eq!(weights_on(SQUARE, &colour).unwrap(), [1.0, 1.0, 0.0, 0.0]);
    let plain = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    assert!(weights_on(plain, &grey).unwrap_err().contains("no texture coordinates"));
}

#[test]
fn pictures_that_are_cut_short_or_vast_are_refused() {
    let grey = png(2, 2, png::ColorType::Grayscale, &[9; 4]);
    for end in 8..grey.len() - 12 {
        assert!(MaskFile::parse(&grey[..end]).is_err(), "{end}");
    }
    let mut vast = Vec::new();
    let mut encoder = png::Encoder::new(&mut vast, 100_000, 100_000);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.write_header().unwrap().write_chunk(png::chunk::IDAT, &[0; 9]).unwrap();
    let complaint = MaskFile::parse(&vast).unwrap_err().to_string();
    assert!(complaint.contains("100000 x 100000"), "{complaint}");
}

#[test]
fn what_is_no_mask_is_refused_with_what_to_do() {
    for (text, needle) in [
        ("{}", "expected a list of weights"),
        ("nonsense", "expected a list of weights"),
        (r#"{"weights": [1], "outside": 1}"#, "expected a list of weights"),
        (r#"{"wieghts": [1]}"#, "unknown field `wieghts`"),
        (r#"{"spheres": [{"radius": 1}]}"#, "entry 0: needs either a `landmark` or a `centre`"),
        (r#"{"spheres": [{"centre": [0, 0, 0], "radius": 0}]}"#, "radius: is 0"),
        (r#"{"spheres": [{"landmark": "ear", "radius": 1}]}"#, "`ear` is not among"),
        (r#"{"colour": {"channel": "mauve"}}"#, "unknown variant `mauve`"),
    ] {
        let complaint = weights(text).unwrap_err();
        assert!(complaint.contains(needle), "{text}: {complaint}");
    }
}

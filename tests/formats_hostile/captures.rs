//! Damaged copies of the files of captures: the cameras of every program, and the pictures themselves.

use std::path::Path;

use onemesh::formats::{Capture, Encoding};

use crate::damage::{SHARE_OF_FILES, feed};

const TRANSFORMS: &str = r#"{"camera_model":"OPENCV","fl_x":20,"fl_y":20,"cx":8,"cy":4,"w":16,"h":8,"k1":0.1,"p2":0.01,
    "frames":[{"file_path":"images/a.jpg","transform_matrix":[[1,0,0,0],[0,1,0,0],[0,0,1,4],[0,0,0,1]]}]}"#;
const COLMAP_CAMERAS: &str = "1 OPENCV 16 8 20 20 8 4 0.1 0.02 0.003 0.004\n";
const COLMAP_IMAGES: &str = "1 0 1 0 0 0 0 4 1 a.jpg\n1 2 -1\n";
const METASHAPE: &str = r#"<?xml version="1.0"?><document version="2.0.0"><chunk>
 <sensors><sensor id="0" type="frame"><resolution width="16" height="8"/>
  <calibration type="frame"><resolution width="16" height="8"/><f>20</f><cx>1</cx><k1>0.1</k1></calibration></sensor></sensors>
 <cameras><camera id="0" sensor_id="0" label="a.jpg"><transform>1 0 0 0 0 -1 0 0 0 0 -1 4 0 0 0 1</transform></camera>
 </cameras></chunk></document>"#;
const JPEG: &[u8] = include_bytes!("../../src/formats/pixels/grey.jpg");

fn colmap_cameras() -> Vec<u8> {
    let mut bytes = 1u64.to_le_bytes().to_vec();
    bytes.extend([1u32.to_le_bytes(), 1u32.to_le_bytes()].concat());
    bytes.extend([16u64.to_le_bytes(), 8u64.to_le_bytes()].concat());
    bytes.extend([20.0f64, 20.0, 8.0, 4.0].iter().flat_map(|p| p.to_le_bytes()));
    bytes
}

fn colmap_images() -> Vec<u8> {
    let mut bytes = 1u64.to_le_bytes().to_vec();
    bytes.extend(1u32.to_le_bytes());
    bytes.extend([0.0f64, 1.0, 0.0, 0.0, 0.0, 0.0, 4.0].iter().flat_map(|n| n.to_le_bytes()));
    bytes.extend(1u32.to_le_bytes());
    bytes.extend(b"a.jpg\0");
    bytes.extend(1u64.to_le_bytes());
    bytes.extend([7; 24]);
    bytes
}

/// Damages the file `at`, the others as they are; the whole capture must have one view with a picture.
fn check(reader: &str, files: &[(&str, &[u8])], at: usize) {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    for (name, bytes) in files.iter().chain(&[("images/a.jpg", JPEG)]) {
        std::fs::create_dir_all(path(name).parent().unwrap()).unwrap();
        std::fs::write(path(name), bytes).unwrap();
    }
    let read = |folder: &Path| -> Option<Vec<[f32; 4]>> {
        let capture = Capture::open(folder).ok()?;
        let view = capture.views.first()?;
        Some(view.photograph(8, Encoding::Srgb).ok()?.pixels.values)
    };
    assert_eq!(read(folder.path()).unwrap().len(), 32, "{reader}");
    let (name, whole) = files[at];
    feed(reader, &[whole.to_vec()], SHARE_OF_FILES, |bytes| {
        std::fs::write(path(name), bytes).unwrap();
        let values = read(folder.path()).unwrap_or_default();
        assert!(values.as_flattened().iter().all(|value| value.is_finite()), "{reader}");
    });
}

#[test]
fn damage_to_transforms() {
    check("transforms.json", &[("transforms.json", TRANSFORMS.as_bytes())], 0);
}

#[test]
fn damage_to_colmap_s_models() {
    let text = [
        ("sparse/0/cameras.txt", COLMAP_CAMERAS.as_bytes()),
        ("sparse/0/images.txt", COLMAP_IMAGES.as_bytes()),
    ];
    let (cameras, images) = (colmap_cameras(), colmap_images());
    let binary = [("sparse/0/cameras.bin", &cameras[..]), ("sparse/0/images.bin", &images[..])];
    for at in [0, 1] {
        check(text[at].0, &text, at);
        check(binary[at].0, &binary, at);
    }
}

#[test]
fn damage_to_metashape_s_cameras() {
    check("cameras.xml", &[("cameras.xml", METASHAPE.as_bytes())], 0);
}

#[test]
fn damage_to_pictures() {
    let transforms = ("transforms.json", TRANSFORMS.as_bytes());
    check("a.jpg", &[transforms, ("images/a.jpg", JPEG)], 1);
    let mut png = Vec::new();
    let mut encoder = png::Encoder::new(&mut png, 16, 8);
    encoder.set_color(png::ColorType::Rgba);
    encoder.write_header().unwrap().write_image_data(&[200; 16 * 8 * 4]).unwrap();
    check("masks/a.png", &[transforms, ("masks/a.png", &png)], 1);
}

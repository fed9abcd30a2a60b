use std::fs;
use std::path::Path;

use glam::{DVec2, DVec3};

use super::*;
use crate::camera::Distortion;

/// A camera at (0, 0, 4) that looks at the origin, x to the right.
const AHEAD: &str = "[[1,0,0,0],[0,1,0,0],[0,0,1,4],[0,0,0,1]]";

fn folder(files: &[(&str, &[u8])]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in files {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, bytes).unwrap();
    }
    folder
}

fn complaint(folder: &Path) -> String {
    Capture::open(folder).unwrap_err().to_string()
}

/// Whether the camera sees the origin in the middle, +x to its right and +y upwards.
fn looks_at_the_origin(view: &CaptureView, [x, y]: [f64; 2], step: f64) {
    let at = |point| view.camera.project(point).unwrap();
    assert!(at(DVec3::ZERO).distance(DVec2::new(x, y)) < 1e-6, "{:?}", at(DVec3::ZERO));
    assert!((at(DVec3::X) - at(DVec3::ZERO)).distance(DVec2::new(step, 0.0)) < 1e-6);
    assert!((at(DVec3::Y) - at(DVec3::ZERO)).distance(DVec2::new(0.0, -step)) < 1e-6);
}

#[test]
fn nerfstudio_s_transforms_with_a_camera_for_all_and_one_of_its_own() {
    let json = format!(
        r#"{{"camera_model":"OPENCV","fl_x":200,"fl_y":200,"cx":100,"cy":80,"w":200,"h":160,"k1":0.1,"p2":0.01,
        "frames":[{{"file_path":"images/a.png","transform_matrix":{AHEAD}}},
        {{"file_path":"./images/b","fl_x":400,"fl_y":400,"k1":0,"p2":0,"mask_path":"other/b.png","transform_matrix":{AHEAD}}}]}}"#
    );
    let folder = folder(&[
        ("transforms.json", json.as_bytes()),
        ("images/a.png", b""),
        ("images/b.jpg", b""),
        ("masks/a.png", b""),
        ("other/b.png", b""),
    ]);
    let capture = Capture::open(folder.path()).unwrap();
    let [a, b] = capture.views.as_slice() else { panic!("{capture:?}") };
    assert_eq!(a.image, folder.path().join("images/a.png"));
    assert_eq!(a.mask.as_deref(), Some(folder.path().join("masks/a.png").as_path()));
    let expected =
        Distortion::Brown { radial: [0.1, 0.0, 0.0, 0.0], denominator: [0.0; 3], tangential: [0.0, 0.01] };
    assert_eq!(a.camera.distortion, expected);
    assert_eq!(b.image, folder.path().join("images/b.jpg"));
    assert_eq!(b.mask.as_deref(), Some(folder.path().join("other/b.png").as_path()));
    assert_eq!(b.camera.distortion, Distortion::None);
    looks_at_the_origin(b, [100.0, 80.0], 100.0);
}

#[test]
fn the_synthetic_scenes_have_an_angle_alone() {
    let json = format!(
        r#"{{"camera_angle_x":1.0,"frames":[{{"file_path":"./train/r_0","transform_matrix":{AHEAD}}}]}}"#
    );
    let folder = folder(&[("transforms_train.json", json.as_bytes()), ("train/r_0.png", b"")]);
    let view = &Capture::open(folder.path()).unwrap().views[0];
    assert_eq!(view.camera.intrinsics.size, [0, 0]);
    assert!((view.camera.intrinsics.focal.x - 0.5 / 0.5f64.tan()).abs() < 1e-12);
}

/// Rotation by half a turn about x: OpenCV's axes at (0, 0, 4), looking at the origin.
const CAMERAS: &str =
    "# comment\n1 PINHOLE 200 160 200 200 100 80\n2 OPENCV 200 160 200 210 100 80 0.1 0.02 0.003 0.004\n";
const IMAGES: &str = "# comment\n1 0 1 0 0 0 0 4 1 a.png\n\n2 0 1 0 0 0 0 4 2 sub/b.png\n1 2 -1 3 4 -1\n";

#[test]
fn colmap_s_text_and_binary_models_are_the_same() {
    let mut cameras = 2u64.to_le_bytes().to_vec();
    let mut images = 2u64.to_le_bytes().to_vec();
    let lenses: [(u32, u32, &[f64]); 2] =
        [(1, 1, &[200.0, 200.0, 100.0, 80.0]), (2, 4, &[200.0, 210.0, 100.0, 80.0, 0.1, 0.02, 0.003, 0.004])];
    for (id, model, parameters) in lenses {
        cameras.extend([id.to_le_bytes(), model.to_le_bytes()].concat());
        cameras.extend([200u64.to_le_bytes(), 160u64.to_le_bytes()].concat());
        cameras.extend(parameters.iter().flat_map(|p| p.to_le_bytes()));
    }
    for (id, name, points) in [(1u32, "a.png", 0u64), (2, "sub/b.png", 2)] {
        images.extend(id.to_le_bytes());
        images.extend([0.0f64, 1.0, 0.0, 0.0, 0.0, 0.0, 4.0].iter().flat_map(|n| n.to_le_bytes()));
        images.extend(id.to_le_bytes());
        images.extend(name.bytes().chain([0]));
        images.extend(points.to_le_bytes());
        images.extend(vec![7; 24 * points as usize]);
    }
    let pictures: [(&str, &[u8]); 3] =
        [("images/a.png", b""), ("images/sub/b.png", b""), ("masks/b.png.png", b"")];
    let text = [("sparse/0/cameras.txt", CAMERAS.as_bytes()), ("sparse/0/images.txt", IMAGES.as_bytes())];
    let binary = [("sparse/cameras.bin", cameras.as_slice()), ("sparse/images.bin", images.as_slice())];
    let text = folder(&[&text[..], &pictures].concat());
    let binary = folder(&[&binary[..], &pictures].concat());
    let [from_text, from_binary] = [&text, &binary].map(|folder| Capture::open(folder.path()).unwrap());
    for (a, b) in from_text.views.iter().zip(&from_binary.views) {
        assert_eq!((&a.name, a.camera), (&b.name, b.camera));
    }
    assert_eq!(from_text.views.len(), 2);
    looks_at_the_origin(&from_text.views[0], [100.0, 80.0], 50.0);
    assert_eq!(from_text.views[0].mask, None);
    assert_eq!(from_text.views[1].mask, Some(text.path().join("masks/b.png.png")));

    for cut in [4, 20, images.len() - 1] {
        fs::write(binary.path().join("sparse/images.bin"), &images[..cut]).unwrap();
        assert!(complaint(binary.path()).contains("cut short"));
    }
    // A claim of very many.
    fs::write(binary.path().join("sparse/images.bin"), u64::MAX.to_le_bytes()).unwrap();
    assert!(complaint(binary.path()).contains("cut short"));
}

#[test]
fn metashape_s_cameras_with_their_component() {
    let xml = r#"<?xml version="1.0" encoding="UTF-8"?>
<document version="2.0.0"><chunk label="Chunk 1" enabled="true">
 <sensors><sensor id="0" label="x" type="frame"><resolution width="200" height="160"/>
  <calibration type="frame" class="adjusted"><resolution width="200" height="160"/>
   <f>200</f><cx>5</cx><cy>-3</cy><b1>2</b1><k1>0</k1><p1>0.01</p1></calibration></sensor></sensors>
 <components><component id="0"><transform><scale>2</scale></transform></component></components>
 <cameras>
  <camera id="0" sensor_id="0" component_id="0" label="a"><transform>1 0 0 0 0 -1 0 0 0 0 -1 2 0 0 0 1</transform></camera>
  <camera id="1" sensor_id="0" label="lost"/>
  <camera id="2" sensor_id="0" label="off" enabled="false"><transform>1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1</transform></camera>
 </cameras></chunk></document>"#;
    let folder = folder(&[("cameras.xml", xml.as_bytes()), ("a.jpg", b"")]);
    let capture = Capture::open(folder.path()).unwrap();
    let [a] = capture.views.as_slice() else { panic!("{capture:?}") };
    assert_eq!(capture.warnings.len(), 2);
    // The component doubles the distance of the camera's centre.
    assert!(a.camera.pose.centre().distance(DVec3::new(0.0, 0.0, 4.0)) < 1e-12);
    assert_eq!(a.camera.intrinsics.focal, DVec2::new(202.0, 200.0));
    assert_eq!(a.camera.intrinsics.centre, DVec2::new(105.0, 77.0));
    let Distortion::Brown { tangential, .. } = a.camera.distortion else { panic!() };
    assert_eq!(tangential, [0.0, 0.01]);
}

#[test]
fn faults_name_the_file_what_was_found_and_what_to_do() {
    let empty = folder(&[("notes.txt", b"")]);
    assert!(complaint(empty.path()).contains("transforms.json"));

    let transforms = |frame: &str, more: &str| {
        let json = format!(r#"{{{more}"frames":[{frame}]}}"#);
        complaint(folder(&[("transforms.json", json.as_bytes()), ("a.png", b"")]).path())
    };
    let angle = r#""camera_angle_x":1.0,"#;
    let frame = |matrix: &str| format!(r#"{{"file_path":"a.png","transform_matrix":{matrix}}}"#);
    assert!(transforms("", angle).contains("at least one picture"));
    assert!(transforms(&frame(AHEAD), "").contains("no focal length"));
    let mirrored = frame("[[1,0,0,0],[0,1,0,0],[0,0,-1,4],[0,0,0,1]]");
    assert!(transforms(&mirrored, angle).contains("frames[0].transform_matrix: mirrors"));
    let singular = frame("[[1,0,0,0],[0,0,0,0],[0,0,1,4],[0,0,0,1]]");
    assert!(transforms(&singular, angle).contains("singular"));
    assert!(transforms(&frame("[[1,0,0,0]]"), angle).contains("four rows"));
    assert!(transforms(&frame(AHEAD), r#""w":0,"h":5,"fl_x":3,"#).contains("0 x 5"));
    assert!(transforms(&frame(AHEAD), r#""w":9,"h":5,"fl_x":-3,"#).contains("positive"));
    assert!(transforms(&frame(AHEAD), r#""fl_x":3,"#).contains("no w and h"));
    let missing = format!(r#"{{"file_path":"b.png","transform_matrix":{AHEAD}}}"#);
    assert!(transforms(&missing, angle).contains("picture `b.png`: is not there"));
    let outside = format!(r#"{{"file_path":"../a.png","transform_matrix":{AHEAD}}}"#);
    assert!(transforms(&outside, angle).contains("outside"));

    let colmap = |cameras: &str, images: &str| {
        let files =
            [("cameras.txt", cameras.as_bytes()), ("images.txt", images.as_bytes()), ("a.png", &b""[..])];
        complaint(folder(&files).path())
    };
    assert!(colmap("1 FOV 200 160 1 2 3 4 5", IMAGES).contains("undistort"));
    assert!(colmap("1 PINHOLE 200 160 1 2 3", IMAGES).contains("has 3 parameters; PINHOLE has 4"));
    assert!(colmap(CAMERAS, "1 0 0 0 0 0 0 4 1 a.png").contains("quaternion"));
    assert!(colmap(CAMERAS, "1 1 0 0 0 0 0 4 9 a.png").contains("camera 9"));
    assert!(colmap(CAMERAS, "1 1 0 0 0 0 nan 4 1 a.png").contains("`nan`"));

    let xml = complaint(folder(&[("c.xml", b"<a><b></a>")]).path());
    assert!(xml.contains("c.xml: its XML"), "{xml}");
}

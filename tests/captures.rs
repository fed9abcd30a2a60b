//! Captures as folders: written and read again, and what is told of those that cannot be used.

use std::fs;
use std::path::Path;

use glam::{DVec2, DVec3};
use onemesh::camera::{Camera, Distortion, Intrinsics, Pose};
use onemesh::formats::{Capture, CaptureView, Encoding, Photograph, Pixels, write_capture};
use onemesh::pipeline::{InvertPreset, InvertSettings, Shown, Views};

/// Photographs of a ball of radius one at the origin, `size` pixels wide, with its normals as colours.
fn ball(views: usize, size: u32) -> Vec<Photograph> {
    let of = |at: usize| {
        let angle = at as f64 * std::f64::consts::TAU / views as f64;
        let pose =
            Pose::looking(DVec3::new(4.0 * angle.sin(), 0.5, 4.0 * angle.cos()), DVec3::ZERO, DVec3::Y);
        let intrinsics = Intrinsics::with_angle([size; 2], 0.8);
        let camera = Camera { pose, distortion: Distortion::None, intrinsics };
        let value = |i: u32| {
            let pixel = DVec2::new(f64::from(i % size) + 0.5, f64::from(i / size) + 0.5);
            let (from, along) = (pose.centre(), camera.ray(pixel).unwrap());
            let nearest = -from.dot(along);
            let inside = 1.0 - (from + along * nearest).length_squared();
            if inside < 0.0 {
                return [0.0; 4];
            }
            let normal = from + along * (nearest - inside.sqrt());
            let [x, y, z] = normal.to_array().map(|n| 0.5 + 0.5 * n as f32);
            [x, y, z, 1.0]
        };
        Photograph {
            name: format!("{at:03}"),
            pose,
            intrinsics,
            pixels: Pixels { size: [size; 2], values: (0..size * size).map(value).collect() },
            has_silhouette: true,
            unseen: None,
        }
    };
    (0..views).map(of).collect()
}

fn written(photographs: &[Photograph]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    write_capture(folder.path(), photographs, Encoding::Linear).unwrap();
    folder
}

fn views(folder: &Path) -> Result<Views, String> {
    let settings = InvertSettings::preset(InvertPreset::Default, 642).unwrap();
    let capture = Capture::open(folder).map_err(|error| error.to_string())?;
    Views::of_capture(&capture, &settings, &()).map_err(|error| error.to_string())
}

#[test]
fn what_is_written_is_read_again() {
    let photographs = ball(3, 40);
    let folder = written(&photographs);
    let read = views(folder.path()).unwrap();
    assert_eq!(read.shown, Shown::WorldNormal);
    for (read, written) in read.photographs.iter().zip(&photographs) {
        assert!(read.pose.centre().distance(written.pose.centre()) < 1e-9);
        assert!((read.intrinsics.focal - written.intrinsics.focal).length() < 1e-9);
        for (a, b) in read.pixels.values.iter().zip(&written.pixels.values) {
            assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 0.003), "{a:?} {b:?}");
        }
    }
}

#[test]
fn a_lens_is_undone() {
    let photograph = &ball(1, 60)[0];
    let folder = written(std::slice::from_ref(photograph));
    let view = &Capture::open(folder.path()).unwrap().views[0];
    let straight = view.photograph(60, Encoding::Linear).unwrap();
    let radial = [-0.25, 0.05, 0.0, 0.0];
    let lens = Distortion::Brown { radial, denominator: [0.0; 3], tangential: [0.0; 2] };
    let bent = CaptureView { camera: Camera { distortion: lens, ..view.camera }, ..view.clone() };
    let undone = bent.photograph(60, Encoding::Linear).unwrap();
    assert_eq!(undone.unseen, None, "a lens that draws together shows all of a narrower picture");
    let area = |photograph: &Photograph| photograph.pixels.values.iter().map(|p| p[3]).sum::<f32>();
    // What was seen at r (1 - 0.25 r^2) comes back to r: the ball grows.
    assert!(area(&undone) > 1.02 * area(&straight), "{} {}", area(&undone), area(&straight));
}

#[test]
fn bad_captures_are_told_by_file_finding_and_remedy() {
    let photographs = ball(3, 40);
    let complaint = |spoil: &dyn Fn(&Path)| {
        let folder = written(&photographs);
        spoil(folder.path());
        views(folder.path()).unwrap_err()
    };
    let picture = |folder: &Path| folder.join("images/001.png");

    let missing = complaint(&|folder| fs::remove_file(picture(folder)).unwrap());
    assert!(missing.contains("transforms.json") && missing.contains("images/001.png"), "{missing}");
    let unreadable = complaint(&|folder| fs::write(picture(folder), "no picture").unwrap());
    assert!(
        unreadable.contains("001.png") && unreadable.contains("neither a PNG nor a JPEG"),
        "{unreadable}"
    );
    let cut = complaint(&|folder| {
        let bytes = fs::read(picture(folder)).unwrap();
        fs::write(picture(folder), &bytes[..bytes.len() / 2]).unwrap();
    });
    assert!(cut.contains("001.png: the PNG"), "{cut}");

    let small = written(&ball(3, 20));
    let other = complaint(&|folder| {
        fs::copy(picture(small.path()), picture(folder)).map(drop).unwrap();
    });
    assert!(other.contains("20 x 20") && other.contains("40 x 40"), "{other}");

    let nothing = |name: &'static str| {
        let mut empty = photographs.clone();
        empty[1].pixels.values.fill([0.0; 4]);
        let empty = written(&empty);
        complaint(&move |folder| {
            fs::create_dir_all(folder.join("masks")).unwrap();
            fs::copy(picture(empty.path()), folder.join(name)).map(drop).unwrap();
        })
    };
    for name in ["images/001.png", "masks/001.png"] {
        let told = nothing(name);
        assert!(told.contains("shows nothing of the object") && told.contains(name), "{told}");
    }

    let one = views(written(&photographs[..1]).path()).unwrap_err();
    assert!(one.contains("two at least"), "{one}");
}

#[test]
fn of_very_many_views_those_are_read_that_stand_apart() {
    let folder = written(&ball(2, 16));
    let path = folder.path().join("transforms.json");
    let transforms: serde_json::Value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
    let frames = transforms["frames"].as_array().unwrap();
    let many: Vec<_> = (0..10_000).map(|i| frames[i % 2].clone()).collect();
    fs::write(&path, serde_json::json!({ "camera_model": "PINHOLE", "frames": many }).to_string()).unwrap();
    let read = views(folder.path()).unwrap();
    assert_eq!(read.photographs.len(), 200);
    assert!(read.warnings[0].contains("of 10000 views the 200"), "{:?}", read.warnings);
    assert!(read.photographs[0].pose.centre().distance(read.photographs[1].pose.centre()) > 1.0);
}

use glam::DVec3;

use super::*;
use crate::demo::Figure;
use crate::formats::Pixels;
use crate::pipeline::{CaptureSettings, capture};
use crate::render::{AdapterChoice, open};

fn renderer() -> Box<dyn Renderer> {
    open(&AdapterChoice::Reference).unwrap()
}

fn pictures(mesh: &TriangleMesh, views: usize, size: u32, shown: Shown) -> Vec<Photograph> {
    let settings = CaptureSettings { views, size, shown, samples: 2 };
    capture(mesh, &settings, &mut *renderer(), &()).unwrap()
}

fn hare() -> TriangleMesh {
    Figure::hare().mesh(40)
}

/// Few iterations on a small sphere.
fn quick() -> InvertSettings {
    let mut settings = InvertSettings::preset(InvertPreset::Default, 642).unwrap();
    settings.levels[0].size = 64;
    settings.levels[0].iterations = 60;
    settings.hull_cells = 32;
    settings
}

fn inverted(photographs: Vec<Photograph>, settings: &InvertSettings) -> Result<Inversion, InvertError> {
    invert(&Views::new(photographs, settings.what)?, settings, &mut *renderer(), &())
}

#[test]
fn a_shape_is_found_again_wherever_it_stands_and_however_large_it_is() {
    for shown in [Shown::Silhouette, Shown::WorldNormal, Shown::CameraNormal, Shown::Shaded] {
        let moved = hare().positions().iter().map(|p| *p * 170.0 + DVec3::new(900.0, -40.0, 3.0)).collect();
        let mesh = hare().with_positions(moved).unwrap();
        let found = inverted(pictures(&mesh, 8, 64, shown), &quick()).unwrap();
        assert_eq!(found.report.shown, shown);
        assert!(found.report.overlap > 0.93, "{shown:?}: {}", found.report.overlap);
        assert!(found.report.warnings.is_empty(), "{:?}", found.report.warnings);
        let off = found.mesh.centroid().distance(mesh.centroid());
        assert!(off < 40.0, "{shown:?}: the middle is {off} off");
        if shown == Shown::Shaded {
            assert!(found.report.mae < 0.05 && found.report.light.is_some(), "{}", found.report.mae);
        }
    }
}

#[test]
fn the_same_pictures_give_the_same_bytes() {
    let photographs = pictures(&hare(), 5, 48, Shown::WorldNormal);
    let [a, b] = [(); 2].map(|()| inverted(photographs.clone(), &quick()).unwrap().mesh);
    assert_eq!(a, b);
}

#[test]
fn a_view_that_is_wrong_is_named_and_left_out() {
    let mut photographs = pictures(&hare(), 12, 64, Shown::Silhouette);
    // The picture of another camera.
    photographs[4].pixels = photographs[9].pixels.clone();
    let found = inverted(photographs, &quick()).unwrap();
    let wrong: Vec<&str> =
        found.report.views.iter().filter(|view| view.disagrees).map(|view| view.name.as_str()).collect();
    assert_eq!(wrong, ["004"]);
    assert!(found.report.warnings[0].contains("`004` disagrees"), "{:?}", found.report.warnings);
}

#[test]
fn cameras_that_are_read_the_wrong_way_are_told_how() {
    use glam::DMat3;
    let flips = [([1.0, -1.0, -1.0], "y and z axes"), ([-1.0, -1.0, 1.0], "upside down")];
    for (signs, said) in flips {
        let mut photographs = pictures(&hare(), 9, 64, Shown::Silhouette);
        for photograph in &mut photographs {
            let turn = DMat3::from_diagonal(DVec3::from(signs));
            photograph.pose.rotation = turn * photograph.pose.rotation;
            photograph.pose.translation = turn * photograph.pose.translation;
        }
        let told = match inverted(photographs, &quick()) {
            Ok(found) => found.report.warnings.join("; "),
            Err(error) => error.to_string(),
        };
        assert!(told.contains(said), "{told}");
    }
}

#[test]
fn what_no_shape_comes_of_is_told() {
    let photographs = pictures(&hare(), 4, 32, Shown::Silhouette);
    let complaint = |photographs| inverted(photographs, &quick()).unwrap_err().to_string();
    assert!(complaint(photographs[..1].to_vec()).contains("there are 1 views"));

    let mut bare = photographs.clone();
    let full = Pixels { size: [32, 32], values: vec![[0.3, 0.5, 0.2, 1.0]; 32 * 32] };
    bare[2].pixels = full.clone();
    bare[2].has_silhouette = false;
    assert!(complaint(bare).contains("view `002` has no silhouette"));

    let mut unmasked = photographs.clone();
    unmasked.iter_mut().for_each(|photograph| photograph.pixels = full.clone());
    assert!(complaint(unmasked).contains("fill their pictures"));

    let mut inside = photographs;
    inside[1].pose.translation = inside[1].pose.rotation * DVec3::new(0.0, 0.2, 0.0);
    let told = complaint(inside);
    assert!(told.contains("inside the object") || told.contains("agree on"), "{told}");
}

#[test]
fn normals_and_outlines_without_opacity_are_detected() {
    for shown in [Shown::Silhouette, Shown::WorldNormal, Shown::CameraNormal] {
        let mut photographs = pictures(&hare(), 6, 64, shown);
        for photograph in &mut photographs {
            photograph.has_silhouette = false;
            photograph.pixels.values.iter_mut().for_each(|pixel| pixel[3] = 1.0);
        }
        let views = Views::new(photographs, What::Detect).unwrap();
        assert_eq!(views.shown, shown);
        assert!(views.photographs.iter().all(|p| p.pixels.values.iter().any(|pixel| pixel[3] == 0.0)));
    }
}

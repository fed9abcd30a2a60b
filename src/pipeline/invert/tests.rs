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
    settings.levels.truncate(1);
    settings.levels[0].size = 64;
    settings.levels[0].iterations = 100;
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
fn a_finer_sphere_and_larger_pictures_come_closer() {
    let mesh = hare();
    let photographs = pictures(&mesh, 8, 96, Shown::WorldNormal);
    let mut settings = InvertSettings::preset(InvertPreset::Default, 2562).unwrap();
    settings.levels[0].level = 3;
    for (level, (size, iterations)) in settings.levels.iter_mut().zip([(48, 100), (96, 100)]) {
        (level.size, level.iterations) = (size, iterations);
    }
    let chamfer = |found: &Inversion| crate::evaluate::surface_figures(&mesh, &found.mesh, false).chamfer;
    let fine = inverted(photographs.clone(), &settings).unwrap();
    assert_eq!((fine.mesh.positions().len(), fine.sphere.len()), (2562, 2562));
    settings.levels.truncate(1);
    settings.vertices = 642;
    let (coarse, fine) = (chamfer(&inverted(photographs, &settings).unwrap()), chamfer(&fine));
    assert!(fine < coarse, "{fine} is no better than {coarse}");
}

#[test]
fn colours_of_vertices_are_found() {
    let shaded = pictures(&hare(), 8, 64, Shown::Shaded);
    let normals = pictures(&hare(), 8, 64, Shown::WorldNormal);
    // What faces up is red.
    let mut painted = shaded;
    for (photograph, normals) in painted.iter_mut().zip(&normals) {
        for (pixel, normal) in photograph.pixels.values.iter_mut().zip(&normals.pixels.values) {
            if normal[3] > 0.0 && normal[1] > 0.5 * normal[3] {
                (pixel[1], pixel[2]) = (0.3 * pixel[1], 0.3 * pixel[2]);
            }
        }
    }
    let light = crate::pipeline::studio_light().0.to_vec();
    let mut settings = InvertSettings { albedo: Albedo::Vertex, what: What::Shaded, light, ..quick() };
    settings.levels[0].iterations = 300;
    let found = inverted(painted, &settings).unwrap();
    let topology = crate::mesh::Topology::new(found.mesh.positions().len(), found.mesh.triangles());
    let positions: Vec<Vec3A> = found.mesh.positions().iter().map(|p| p.as_vec3a()).collect();
    let vertices = Normals::new(&topology, &positions).vertices;
    let redness = |up: fn(f32) -> bool| {
        let own = found.albedo.iter().flatten().zip(&vertices).filter(|(_, normal)| up(normal.y));
        let (red, green) = own.fold((0.0, 0.0), |sum, (colour, _)| (sum.0 + colour[0], sum.1 + colour[1]));
        red / green
    };
    let (above, below) = (redness(|y| y > 0.3), redness(|y| y < -0.3));
    assert!(above > 1.5 * below, "{above} above, {below} below");
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

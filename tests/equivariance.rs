//! A scan moved is a result moved: under translation and scale, under the rotations that take the template sphere to
//! itself, and, where landmarks tell how a scan is turned, under any rotation.

use glam::{DQuat, DVec3};
use onemesh::demo::{SculptedHead, Sculptor};
use onemesh::evaluate::surface_figures;
use onemesh::mesh::{LandmarkSet, TriangleMesh};
use onemesh::pipeline::{FitSettings, Preset, Settings, Subject, fit_scan, register};

/// One level of the default preset: 642 vertices.
fn settings() -> Settings {
    let mut settings = Settings::preset(Preset::Default, 642).unwrap();
    settings.groupwise.iterations = 2;
    settings.groupwise.samples = 5000;
    settings
}

fn heads<const N: usize>() -> [SculptedHead; N] {
    let upright = onemesh::demo::Settings { triangles: 8000, posed: false, ..Default::default() };
    let sculptor = Sculptor::new(3).with(upright);
    std::array::from_fn(|index| sculptor.head(index, 1.5))
}

fn moved(mesh: &TriangleMesh, motion: impl Fn(DVec3) -> DVec3) -> TriangleMesh {
    mesh.with_positions(mesh.positions().iter().map(|&p| motion(p)).collect()).unwrap()
}

fn fit(mesh: &TriangleMesh, settings: &FitSettings) -> Vec<DVec3> {
    fit_scan("head", mesh, settings, &()).unwrap().0
}

/// The largest distance between two results, in units of the scan's radius.
fn apart(one: &[DVec3], other: &[DVec3], radius: f64) -> f64 {
    one.iter().zip(other).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max) / radius
}

fn radius(mesh: &TriangleMesh) -> f64 {
    mesh.radius_about(mesh.centroid())
}

#[test]
fn a_fit_moves_and_grows_with_its_scan() {
    let [head] = heads();
    let settings = settings().fit;
    let motion = |p: DVec3| 37.5 * p + DVec3::new(-810.0, 4.0, 1300.0);
    let wanted: Vec<DVec3> = fit(&head.mesh, &settings).into_iter().map(motion).collect();
    let mesh = moved(&head.mesh, motion);
    let error = apart(&fit(&mesh, &settings), &wanted, radius(&mesh));
    assert!(error < 1e-6, "{error}");
}

#[test]
fn a_fit_turns_with_its_scan_where_the_sphere_does() {
    let [head] = heads();
    // Rounding grows from iteration to iteration, so there are few of them.
    let mut settings = settings().fit;
    settings.levels[0].iterations = 20;
    let fitted = fit(&head.mesh, &settings);
    let sphere = onemesh::pipeline::Sphere::of_level(3);
    // A third of a turn about a corner of the cube, half a turn about an axis.
    let turns = [DQuat::from_xyzw(0.5, 0.5, 0.5, 0.5), DQuat::from_xyzw(0.0, 1.0, 0.0, 0.0)];
    for turn in turns {
        let mesh = moved(&head.mesh, |p| turn * p);
        let turned = fit(&mesh, &settings);
        // The vertex that each vertex of the sphere is turned to.
        let place = |i: usize| {
            let at = (turn * sphere.rest[i].as_dvec3()).as_vec3a();
            let distance = |j: &usize| sphere.rest[*j].distance_squared(at);
            (0..turned.len()).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap()
        };
        let same: Vec<DVec3> = (0..turned.len()).map(|i| turned[place(i)]).collect();
        let wanted: Vec<DVec3> = fitted.iter().map(|&p| turn * p).collect();
        let error = apart(&same, &wanted, radius(&mesh));
        assert!(error < 1e-3, "{turn}: {error}");
    }
}

#[test]
fn a_fit_is_as_close_however_its_scan_is_turned() {
    let [head] = heads();
    let settings = settings().fit;
    let triangles = &onemesh::pipeline::Sphere::of_level(3).connectivity.topology.triangles;
    let figures = |turn: DQuat| {
        let mesh = moved(&head.mesh, |p| turn * p);
        let result = TriangleMesh::new(fit(&mesh, &settings), triangles.clone()).unwrap();
        surface_figures(&mesh, &result, true)
    };
    let upright = figures(DQuat::IDENTITY);
    for angle in [0.5, 1.7, 3.0] {
        let turned = figures(DQuat::from_axis_angle(DVec3::new(0.48, 0.6, 0.64), angle));
        for (name, a, b) in
            [("chamfer", upright.chamfer, turned.chamfer), ("normal", upright.normal, turned.normal)]
        {
            assert!(a.max(b) < 1.5 * a.min(b), "{name} at {angle}: {a} upright, {b} turned");
        }
    }
}

fn subject(head: &SculptedHead, motion: impl Fn(DVec3) -> DVec3) -> Subject {
    let points = head.landmarks.points.iter().map(|p| p.map(&motion)).collect();
    Subject {
        name: head.name.clone(),
        mesh: moved(&head.mesh, &motion),
        landmarks: LandmarkSet { points, ..head.landmarks.clone() },
        mask: None,
    }
}

/// The largest distance of a registered member from where it should be when all members are put where `motions` say.
fn registration_error(motions: [&dyn Fn(DVec3) -> DVec3; 2]) -> f64 {
    let heads = heads::<2>();
    let still: Vec<Subject> = heads.iter().map(|head| subject(head, |p| p)).collect();
    let moving: Vec<Subject> =
        heads.iter().zip(motions).map(|(head, motion)| subject(head, motion)).collect();
    let members = |subjects: &[Subject]| register(subjects, &settings(), &()).unwrap().members;
    let (still, results) = (members(&still), members(&moving));
    let error = |i: usize| {
        let wanted: Vec<DVec3> = still[i].iter().map(|&p| motions[i](p)).collect();
        apart(&results[i], &wanted, radius(&moving[i].mesh))
    };
    error(0).max(error(1))
}

#[test]
fn a_registration_moves_and_grows_with_each_scan() {
    let error = registration_error([&|p| 0.01 * p + 4.0 * DVec3::Y, &|p| 10.0 * p - 250.0 * DVec3::X]);
    assert!(error < 1e-6, "{error}");
}

#[test]
fn a_registration_turns_with_each_scan() {
    let turn = DQuat::from_axis_angle(DVec3::new(0.48, 0.6, 0.64), 2.0);
    let error = registration_error([&|p| p, &|p| turn * p]);
    assert!(error < 2e-2, "{error}");
}

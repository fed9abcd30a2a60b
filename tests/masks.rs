//! What is masked does not pull, and a mask of ones changes nothing.

use glam::DVec3;
use onemesh::demo::{SculptedHead, Sculptor};
use onemesh::mesh::TriangleMesh;
use onemesh::pipeline::{MaskError, Preset, RegisterError, Registration, Settings, Subject, register};

fn heads() -> Vec<Subject> {
    let settings = onemesh::demo::Settings { triangles: 12_000, posed: false, ..Default::default() };
    let subject = |head: SculptedHead| Subject {
        name: head.name,
        mesh: head.mesh,
        landmarks: head.landmarks,
        mask: None,
    };
    Sculptor::new(5).with(settings).collection(2, &[1.0]).into_iter().map(subject).collect()
}

fn registered(subjects: &[Subject]) -> Registration {
    register(subjects, &Settings::preset(Preset::Default, 2562).unwrap(), &()).unwrap()
}

fn radius(mesh: &TriangleMesh) -> f64 {
    mesh.radius_about(mesh.centroid())
}

/// The first head with a spike behind its crown, which vertices are in it, and where it stood.
fn spiked(mesh: &TriangleMesh) -> (TriangleMesh, Vec<bool>, DVec3) {
    let (centre, radius) = (mesh.centroid(), radius(mesh));
    let direction = DVec3::new(0.0, 0.8, -0.6);
    let along = |p: &DVec3| (*p - centre).normalize().dot(direction);
    let inside: Vec<bool> = mesh.positions().iter().map(|p| along(p) > 0.94).collect();
    let pulled = mesh.positions().iter().map(|p| {
        let height = ((along(p) - 0.95) / 0.05).max(0.0);
        *p + direction * (0.8 * radius * height)
    });
    let top = mesh.positions().iter().copied().max_by(|a, b| along(a).total_cmp(&along(b))).unwrap();
    (mesh.with_positions(pulled.collect()).unwrap(), inside, top)
}

/// How far the farthest vertex of a result lies outside of `top`, along the way from the head's centre to it.
fn height(result: &[DVec3], top: DVec3, centre: DVec3) -> f64 {
    let direction = (top - centre).normalize();
    let near = |p: &&DVec3| (**p - centre).normalize().dot(direction) > 0.97;
    result.iter().filter(near).map(|p| (*p - top).dot(direction)).fold(f64::MIN, f64::max)
}

#[test]
fn a_masked_spike_does_not_pull() {
    let mut subjects = heads();
    let (centre, radius) = (subjects[0].mesh.centroid(), radius(&subjects[0].mesh));
    let (mesh, inside, top) = spiked(&subjects[0].mesh);
    subjects[0].mesh = mesh;
    let pulled = height(&registered(&subjects).members[0], top, centre) / radius;
    assert!(pulled > 0.3, "the spike pulls where nothing masks it: {pulled}");
    subjects[0].mask = Some(inside.iter().map(|&inside| if inside { 0.0 } else { 1.0 }).collect());
    let result = registered(&subjects);
    let masked = height(&result.members[0], top, centre) / radius;
    assert!(masked.abs() < 0.1, "{masked}");
    let direction = (top - centre).normalize();
    let at_the_spike = |i: &usize| (result.members[0][*i] - centre).normalize().dot(direction) > 0.99;
    let known = (0..2562).filter(at_the_spike).map(|i| result.confidence[0][i]).fold(0.0, f32::max);
    assert!(known < 0.1, "{known}");
}

#[test]
fn a_mask_of_ones_changes_nothing() {
    let mut subjects = heads();
    let without = registered(&subjects);
    for subject in &mut subjects {
        subject.mask = Some(vec![1.0; subject.mesh.positions().len()]);
    }
    let with = registered(&subjects);
    assert_eq!(with.members, without.members);
    assert_eq!(with.confidence, without.confidence);
}

#[test]
fn what_is_no_mask_is_refused() {
    let refusal = |mask: &dyn Fn(usize) -> Vec<f32>| {
        let mut subjects = heads();
        subjects[1].mask = Some(mask(subjects[1].mesh.positions().len()));
        match register(&subjects, &Settings::preset(Preset::Default, 642).unwrap(), &()) {
            Err(RegisterError::Mask { name, error }) if name == subjects[1].name => error,
            other => panic!("{:?}", other.map(|_| ())),
        }
    };
    let vertices = heads()[1].mesh.positions().len();
    assert_eq!(refusal(&|n| vec![1.0; n - 1]), MaskError::Length { weights: vertices - 1, vertices });
    let mut wrong = |n| -> Vec<f32> { (0..n).map(|i| if i == 7 { 1.5 } else { 1.0 }).collect() };
    assert_eq!(refusal(&mut wrong), MaskError::Weight { vertex: 7, weight: 1.5 });
    assert_eq!(refusal(&|n| vec![0.0; n]), MaskError::Nothing);
}

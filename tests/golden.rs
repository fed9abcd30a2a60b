//! Small fits and registrations of sculpted heads reach what they reached before.

use onemesh::demo::{SculptedHead, Sculptor};
use onemesh::evaluate::{
    CorrespondenceCase, CorrespondenceOptions, SurfaceFigures, correspondence_figures, surface_figures,
};
use onemesh::mesh::TriangleMesh;
use onemesh::pipeline::{Preset, Settings, Sphere, Subject, fit_scan, register};

/// How much worse than the golden figure a result may be, since rounding differs from processor to processor.
const SLACK: f64 = 1.25;

fn heads(count: usize) -> Vec<SculptedHead> {
    let settings = onemesh::demo::Settings { triangles: 15_000, ..Default::default() };
    Sculptor::new(11).with(settings).collection(count, &[1.5])
}

fn holds(name: &str, found: f64, golden: f64) {
    println!("{name}: {found:.2e}");
    assert!(found <= SLACK * golden, "{name}: {found:.2e}, once {golden:.2e}");
}

/// Figures of fits to so many heads whose template has 2562 vertices.
fn fitted(preset: Preset, count: usize) -> Vec<SurfaceFigures> {
    let settings = Settings::for_fit(preset, 2562).unwrap().fit;
    let figures = |head: SculptedHead| {
        let (positions, _) = fit_scan("head", &head.mesh, &settings, &()).unwrap();
        let mesh = Sphere::of_level(4).connectivity.topology.mesh(positions).unwrap();
        surface_figures(&head.mesh, &mesh, true)
    };
    heads(count).into_iter().map(figures).collect()
}

/// What heads have in common: of one alone it hangs by a hair whether a fold is entered.
fn geometric_mean(figures: &[SurfaceFigures], figure: impl Fn(&SurfaceFigures) -> f64) -> f64 {
    (figures.iter().map(|own| figure(own).ln()).sum::<f64>() / figures.len() as f64).exp()
}

fn mean(figures: &[SurfaceFigures], figure: impl Fn(&SurfaceFigures) -> f64) -> f64 {
    figures.iter().map(figure).sum::<f64>() / figures.len() as f64
}

#[test]
fn fit_by_default() {
    let figures = fitted(Preset::Default, 4);
    holds("chamfer", geometric_mean(&figures, |own| own.chamfer), 5.6e-6);
    holds("normal", geometric_mean(&figures, |own| own.normal), 0.0356);
    holds("flipped", mean(&figures, |own| own.flipped), 0.002);
    holds("sliver", mean(&figures, |own| own.sliver), 0.001);
}

#[test]
fn fit_by_the_paper() {
    let figures = fitted(Preset::Paper, 1);
    holds("chamfer", geometric_mean(&figures, |own| own.chamfer), 1.43e-5);
    holds("normal", geometric_mean(&figures, |own| own.normal), 0.053);
}

#[test]
fn registration() {
    let heads = heads(3);
    let subject = |head: &SculptedHead| Subject {
        name: head.name.clone(),
        mesh: head.mesh.clone(),
        landmarks: head.landmarks.clone(),
        mask: None,
    };
    let subjects: Vec<Subject> = heads.iter().map(subject).collect();
    let result = register(&subjects, &Settings::preset(Preset::Default, 2562).unwrap(), &()).unwrap();
    let mesh = |positions: &Vec<_>| TriangleMesh::new(positions.clone(), result.template.triangles.clone());
    let meshes: Vec<TriangleMesh> = result.members.iter().map(|member| mesh(member).unwrap()).collect();
    let cases: Vec<CorrespondenceCase> = (heads.iter().zip(&meshes))
        .map(|(head, mesh)| CorrespondenceCase { scan: &head.mesh, mesh, truth: &head.truth })
        .collect();
    let options = CorrespondenceOptions::default();
    let distances = correspondence_figures(&cases, options).unwrap().distances.unwrap();
    holds("face_mm", distances.face_mm, 0.22);
    holds("mean_mm", distances.mean_mm, 1.54);
    holds("p95_mm", distances.p95_mm, 3.84);
}

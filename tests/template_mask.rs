//! What a template's mask leaves out takes nothing of the scan.

use glam::DVec3;
use onemesh::demo::{Sculptor, Settings as Clay};
use onemesh::formats::{MeshFile, MeshFormat, obj_bytes};
use onemesh::mesh::TriangleMesh;
use onemesh::pipeline::{
    FrozenCollection, MaskError, Preset, RegisterError, Registration, Settings, Subject, Template,
    register_to,
};

/// A head as a template, and the same head with a lump on its cheek, twice as thick as a nose.
fn heads() -> (Template, Subject, Vec<bool>) {
    let clay = Clay { triangles: 6000, posed: false, ..Clay::default() };
    let head = Sculptor::new(7).with(clay).collection(1, &[1.0]).remove(0);
    let file = MeshFile::parse(&obj_bytes(&head.mesh), MeshFormat::Obj).unwrap();
    let cheek = (head.landmarks.get("3").unwrap() + head.landmarks.get("48").unwrap()) / 2.0;
    let radius = 0.2 * head.mesh.radius_about(head.mesh.centroid());
    let lump = |p: &DVec3| *p + DVec3::Z * (radius * (1.0 - p.distance(cheek) / radius).max(0.0));
    let lumpy: Vec<DVec3> = head.mesh.positions().iter().map(lump).collect();
    let inside = head.mesh.positions().iter().map(|p| p.distance(cheek) < radius).collect();
    let mesh = TriangleMesh::new(lumpy, head.mesh.triangles().to_vec()).unwrap();
    let subject = Subject { name: "lumpy".to_owned(), mesh, landmarks: head.landmarks.clone(), mask: None };
    (Template::of_file(&file, &head.landmarks), subject, inside)
}

fn settings() -> Settings {
    Settings::preset(Preset::Default, 642).unwrap()
}

fn registered(template: &Template, subject: &Subject) -> Registration {
    register_to(template, std::slice::from_ref(subject), &settings(), &()).unwrap()
}

/// How far the result stands out of the template at most, where the lump is.
fn height(result: &Registration, template: &Template, inside: &[bool]) -> f64 {
    let out = result.members[0].iter().zip(&template.positions).zip(inside);
    out.filter(|(_, inside)| **inside).map(|((result, own), _)| result.z - own.z).fold(0.0, f64::max)
}

#[test]
fn a_masked_part_follows_its_surroundings() {
    let (mut template, subject, inside) = heads();
    let whole = registered(&template, &subject);
    let lump = height(&whole, &template, &inside);
    template.mask = Some(vec![1.0; inside.len()]);
    assert!(registered(&template, &subject).members == whole.members, "a mask of ones changes nothing");
    template.mask = Some(inside.iter().map(|&inside| if inside { 0.0 } else { 1.0 }).collect());
    let masked = registered(&template, &subject);
    let left = height(&masked, &template, &inside);
    assert!(left < 0.3 * lump, "{left} of {lump}");
    for (&inside, &known) in inside.iter().zip(&masked.confidence[0]) {
        assert!(!inside || known == 0.0, "what is masked is not known");
    }

    // It goes with the template where this is kept for further scans.
    let frozen = FrozenCollection { template: Template { frozen: true, ..template }, settings: settings() };
    let read = FrozenCollection::parse(&frozen.glb_bytes().unwrap()).unwrap().unwrap();
    assert_eq!(read.template.mask, frozen.template.mask);
}

#[test]
fn a_mask_of_another_mesh_is_refused() {
    let (mut template, subject, inside) = heads();
    template.mask = Some(vec![1.0; 3]);
    let refused = register_to(&template, &[subject], &settings(), &()).map(|_| ());
    let length = MaskError::Length { weights: 3, vertices: inside.len() };
    assert_eq!(refused, Err(RegisterError::TemplateMask(length)));
}

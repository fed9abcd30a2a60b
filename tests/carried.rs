//! Parts of a template without landmarks follow the face.

use glam::DVec3;
use onemesh::demo::{Sculptor, Settings as Clay};
use onemesh::formats::{MeshFile, MeshFormat, obj_bytes};
use onemesh::mesh::{Icosphere, LandmarkSet, TriangleMesh};
use onemesh::numeric::Similarity;
use onemesh::pipeline::{
    Preset, Registration, ScanReport, Settings, Subject, Template, precheck, register_to,
};

/// The middle of an eye's rim: the right eye's landmarks begin at 36, the left one's at 42.
fn eye(landmarks: &LandmarkSet, first: usize) -> DVec3 {
    (first..first + 6).map(|at| landmarks.get(&at.to_string()).unwrap()).sum::<DVec3>() / 6.0
}

fn template(positions: Vec<DVec3>, triangles: Vec<[u32; 3]>, landmarks: &LandmarkSet) -> Template {
    let mesh = TriangleMesh::new(positions, triangles).unwrap();
    let file = MeshFile::parse(&obj_bytes(&mesh), MeshFormat::Obj).unwrap();
    Template::of_file(&file, landmarks)
}

#[test]
fn eyeballs_keep_their_shape_and_stay_behind_the_eyes() {
    let clay = Clay { triangles: 3000, ..Clay::default() };
    let heads = Sculptor::new(7).with(clay).collection(2, &[1.0]);
    let (own, other) = (&heads[0], &heads[1]);
    let size = eye(&own.landmarks, 36).distance(eye(&own.landmarks, 42));
    let (radius, depth) = (0.15 * size, 0.25 * size);
    let centres = [36, 42].map(|first| eye(&own.landmarks, first) - DVec3::Z * depth);

    // The balls come first, so that every number of the head's changes; a vertex of no triangle comes last.
    let ball = Icosphere::new(2);
    let count = ball.positions.len();
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for centre in centres {
        let first = positions.len() as u32;
        positions.extend(ball.positions.iter().map(|p| *p * radius + centre));
        triangles.extend(ball.triangles.iter().map(|corners| corners.map(|corner| corner + first)));
    }
    positions.extend(own.mesh.positions());
    triangles
        .extend(own.mesh.triangles().iter().map(|corners| corners.map(|corner| corner + 2 * count as u32)));
    positions.push(centres[0]);
    let with_balls = template(positions.clone(), triangles, &own.landmarks);
    let mut bare = template(own.mesh.positions().to_vec(), own.mesh.triangles().to_vec(), &own.landmarks);

    // The closest points of landmarks are found about the mesh's centre, which the balls move by a hair.
    bare.landmarks = with_balls.landmarks.clone();
    bare.landmarks.values_mut().for_each(|at| at.triangle.0 -= 2 * ball.triangles.len() as u32);

    let subject = Subject {
        name: other.name.clone(),
        mesh: other.mesh.clone(),
        landmarks: other.landmarks.clone(),
        mask: None,
    };
    let mut settings = Settings::preset(Preset::Default, 642).unwrap();
    settings.set("transfer.iterations", "8").unwrap();
    let registered = register_to(&with_balls, std::slice::from_ref(&subject), &settings, &()).unwrap();
    let alone = register_to(&bare, std::slice::from_ref(&subject), &settings, &()).unwrap();
    let result = &registered.members[0];
    assert_eq!(result.len(), positions.len());
    assert_eq!(registered.template.triangles, with_balls.triangles);
    assert!(result[2 * count..positions.len() - 1] == alone.members[0], "balls pull at nothing");

    // Nor do they count for how well the result lies on a scan that has none.
    let check = precheck(std::slice::from_ref(&subject)).remove(0);
    let report = |registered: &Registration, template: &Template| {
        let mesh = TriangleMesh::new(registered.members[0].clone(), template.triangles.clone()).unwrap();
        ScanReport::of(&subject, &check, &mesh, &registered.confidence[0], template)
    };
    let [with, without] = [report(&registered, &with_balls), report(&alone, &bare)];
    assert_eq!(with.fidelity.mesh_to_scan, without.fidelity.mesh_to_scan);
    assert_eq!((with.fidelity.flipped, with.coverage), (without.fidelity.flipped, without.coverage));
    assert_eq!(with.fidelity.residuals.len(), positions.len());

    // What a mask leaves out of the scan counts neither: half of the head is gone, and the rest is lain on as before.
    let half = subject.mesh.centroid().x;
    let mask = subject.mesh.positions().iter().map(|p| if p.x < half { 0.0 } else { 1.0 }).collect();
    let masked = Subject { mask: Some(mask), ..subject.clone() };
    let mesh = TriangleMesh::new(alone.members[0].clone(), bare.triangles.clone()).unwrap();
    let report = ScanReport::of(&masked, &check, &mesh, &alone.confidence[0], &bare).fidelity;
    assert!((report.overlap.mesh_over_scan - 0.5).abs() < 0.1, "{:?}", report.overlap);
    assert!(report.mesh_to_scan.unwrap().p99 < 2.0 * without.fidelity.mesh_to_scan.unwrap().p99);

    let names: Vec<String> = (0..68).map(|at| at.to_string()).collect();
    let points = |set: &LandmarkSet| names.iter().map(|name| set.get(name).unwrap()).collect::<Vec<_>>();
    let laid = Similarity::between(&points(&own.landmarks), &points(&other.landmarks), &[1.0; 68]);
    for (at, first) in [36, 42].into_iter().enumerate() {
        let range = at * count..(at + 1) * count;
        let (rest, now) = (&positions[range.clone()], &result[range]);
        let fitted = Similarity::between(rest, now, &vec![1.0; count]);
        let worst =
            rest.iter().zip(now).map(|(rest, now)| fitted.apply(*rest).distance(*now)).fold(0.0, f64::max);
        assert!(worst < 1e-9 * size, "{worst}");
        assert!((0.8..1.25).contains(&(fitted.scale / laid.scale)), "{fitted:?}");
        let behind = eye(&other.landmarks, first) + laid.scale * (laid.rotation * (-DVec3::Z * depth));
        let off = fitted.apply(centres[at]).distance(behind) / (laid.scale * radius);
        println!("ball {at}: {off:.3} of its radius off, scale {:.3}", fitted.scale / laid.scale);
        assert!(off < 0.5, "{off}");
    }
}

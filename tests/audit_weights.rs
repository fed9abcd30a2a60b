//! A landmark that the audit finds misplaced spoils less where the audit's weights are asked for.

use glam::DVec3;
use onemesh::demo::{Sculptor, Settings as Clay};
use onemesh::pipeline::{Preset, Settings, Subject, register};

fn subjects() -> Vec<Subject> {
    let clay = Clay { triangles: 12_000, posed: false, ..Clay::default() };
    let heads = Sculptor::new(3).with(clay).collection(3, &[1.0]);
    let subject = |head: onemesh::demo::SculptedHead| Subject {
        name: head.name,
        mesh: head.mesh,
        landmarks: head.landmarks,
        mask: None,
    };
    heads.into_iter().map(subject).collect()
}

fn registered(subjects: &[Subject], audit: &str, from_head: &str) -> Vec<DVec3> {
    let mut settings = Settings::preset(Preset::Default, 642).unwrap();
    settings.set("audit_weights", audit).unwrap();
    settings.set("from_head", from_head).unwrap();
    register(subjects, &settings, &()).unwrap().members.swap_remove(1)
}

fn farthest(one: &[DVec3], other: &[DVec3]) -> f64 {
    one.iter().zip(other).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max)
}

/// The left corner of the lips of one scan in the middle of the cheek.
#[test]
fn a_mislabelled_landmark_is_left_out_on_request() {
    let clean = subjects();
    let mut spoiled = clean.clone();
    let at = |name: &str| clean[1].landmarks.get(name).unwrap();
    let own = spoiled[1].landmarks.names.iter().position(|name| name == "54").unwrap();
    spoiled[1].landmarks.points[own] = Some(at("54").lerp(at("13"), 0.7));
    for from_head in ["true", "false"] {
        let truth = registered(&clean, "false", from_head);
        let without = farthest(&registered(&spoiled, "false", from_head), &truth);
        let with = farthest(&registered(&spoiled, "true", from_head), &truth);
        assert!(with < 0.5 * without, "from_head={from_head}: {with} with, {without} without");
    }
}

//! The GLB files that are written, before Khronos' own validator.
//!
//! It needs node and `npm ci --prefix tests/gltf_validator`; without them the tests say that they skip it, or fail
//! where `ONEMESH_REQUIRE_GLTF_VALIDATOR` is set.

use std::io::Write;
use std::path::Path;
use std::process::Command;

use glam::{DVec2, DVec3};
use onemesh::formats::{Glb, landmarks_json, parse_landmarks, write_glb};
use onemesh::mesh::TriangleMesh;

/// Fails with the validator's words where it finds an error or a warning in a file that `glb` is written to.
fn validate(name: &str, glb: &Glb) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(format!("{name}.glb"));
    write_glb(&path, glb).unwrap();
    let scripts = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/gltf_validator");
    if !scripts.join("node_modules/gltf-validator").exists() {
        return skip("the package is not there: npm ci --prefix tests/gltf_validator");
    }
    let Ok(output) = Command::new("node").arg(scripts.join("validate.mjs")).arg(&path).output() else {
        return skip("node cannot be run");
    };
    let said =
        String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    assert!(said.contains(" 0 errors, 0 warnings"), "{said}");
}

fn skip(reason: &str) {
    assert!(std::env::var_os("ONEMESH_REQUIRE_GLTF_VALIDATOR").is_none(), "gltf-validator: {reason}");
    // Written past the test harness, which hides what passing tests print.
    let line = format!("SKIPPED: gltf-validator: {reason}\n");
    std::io::stderr().write_all(line.as_bytes()).expect("standard error is open");
}

/// A tetrahedron with corners `size` from a corner at `origin`.
fn tetrahedron(origin: DVec3, size: f64) -> TriangleMesh {
    let corners = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z].map(|p| p * size + origin);
    TriangleMesh::new(corners.to_vec(), vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]).unwrap()
}

#[test]
fn a_mesh_alone_is_valid() {
    validate("plain", &Glb::new(&tetrahedron(DVec3::splat(-0.3), 0.1)));
}

#[test]
fn a_mesh_far_from_its_origin_is_valid() {
    validate("far", &Glb::new(&tetrahedron(DVec3::new(4_531_234.567, -0.1, 1e9), 0.1)));
}

#[test]
fn a_result_with_everything_is_valid() {
    let mesh = tetrahedron(DVec3::new(1.0, 2.0, 3.0), 1.0 / 3.0);
    let landmarks =
        parse_landmarks(br#"{"scheme": "multipie68", "30": [1.1, 2.0, 3.0], "8": null}"#).unwrap();
    let normals = [DVec3::ONE, DVec3::ZERO, DVec3::new(1e-9, 3.0, -2.0), DVec3::NEG_X * 1e-200];
    let coordinates = [DVec2::ZERO, DVec2::X, DVec2::Y, DVec2::splat(0.1)];
    let (residual, density) = ([0.1, 0.25, 1e-12, 3.0], [-1.0, 0.0, 0.3, 1e30]);
    let glb = Glb {
        name: "amy \"1\" \u{e9}",
        normals: Some(&normals),
        texture_coordinates: Some(&coordinates),
        scalars: vec![("_RESIDUAL", &residual), ("_DENSITY_2", &density)],
        extras: serde_json::json!({ "landmarks": landmarks_json(&landmarks), "verdict": "pass" }),
        ..Glb::new(&mesh)
    };
    validate("whole", &glb);
}

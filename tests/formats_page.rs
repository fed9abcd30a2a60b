//! The examples of `docs/formats.md`, each read as the page says.

use std::fs;
use std::path::Path;

use glam::DVec3;
use onemesh::formats::{Collection, LandmarkFile, MeshFile};
use onemesh::mesh::LandmarkSet;

/// The names and contents of the page's fenced blocks that have a name.
fn examples() -> Vec<(String, String)> {
    let page = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/formats.md")).unwrap();
    let mut examples = Vec::new();
    let mut lines = page.lines();
    while let Some(line) = lines.next() {
        let Some(info) = line.strip_prefix("```") else { continue };
        let content: String =
            lines.by_ref().take_while(|line| *line != "```").map(|line| line.to_owned() + "\n").collect();
        if let Some((_, name)) = info.split_once(' ') {
            examples.push((name.to_owned(), content));
        }
    }
    examples
}

/// A folder with all examples as files.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, content) in examples() {
        fs::write(folder.path().join(name), content).unwrap();
    }
    folder
}

#[test]
fn every_mesh_is_the_same_square() {
    let folder = folder();
    let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]].map(DVec3::from);
    for name in ["quad.obj", "square.ply", "square.stl", "square.gltf"] {
        let file = MeshFile::read(folder.path().join(name)).unwrap();
        assert_eq!(file.mesh.positions(), corners, "{name}");
        assert_eq!(file.mesh.triangles(), [[0, 1, 2], [0, 2, 3]], "{name}");
        let coloured = ["quad.obj", "square.ply"].contains(&name);
        let colours = [[255, 0, 0, 255], [0, 255, 0, 255], [0, 0, 255, 255], [255; 4]];
        assert_eq!(file.colours, coloured.then_some(colours.to_vec()), "{name}");
    }
    let lost = MeshFile::read(folder.path().join("quad.obj")).unwrap();
    assert!(lost.warnings[0].contains("skin.png") && lost.texture.unwrap().images.is_empty());
    fs::write(folder.path().join("skin.png"), "").unwrap();
    let found = MeshFile::read(folder.path().join("quad.obj")).unwrap();
    assert!(found.warnings.is_empty() && found.texture.unwrap().image(0).is_some());
}

fn landmarks(folder: &Path, name: &str) -> LandmarkSet {
    let mesh = MeshFile::read(folder.join("square.ply")).unwrap();
    LandmarkFile::read(folder.join(name))
        .and_then(|file| file.on(&mesh))
        .unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn every_landmark_file_is_read() {
    let folder = folder();
    let middle = Some(DVec3::new(0.5, 0.5, 0.0));
    for (name, landmark, position, others) in [
        ("list.json", "0", middle, 1),
        ("named.json", "30", middle, 1),
        ("tips.json", "30", middle, 0),
        ("vertices.txt", "0", Some(DVec3::new(1.0, 1.0, 0.0)), 1),
        ("picked.pp", "nose tip", middle, 0),
        ("one.ljson", "0", middle, 1),
        ("two.ljson", "0", middle, 0),
        ("three.ljson", "0", middle, 1),
        ("markups.mrk.json", "nose tip", middle, 0),
        // The second triangle's corners are (0, 0), (1, 1) and (0, 1).
        ("wrap.json", "nose tip", Some(DVec3::new(0.25, 0.5, 0.0)), 1),
    ] {
        let set = landmarks(folder.path(), name);
        assert_eq!(set.get(landmark), position, "{name}");
        assert_eq!(set.present().count(), others + 1, "{name}");
    }
}

#[test]
fn the_collection_is_registered_by_what_its_scans_share() {
    let folder = folder();
    let collection = Collection::open(folder.path().join("collection.json")).unwrap();
    assert_eq!((collection.common_landmarks(), collection.scheme()), (vec!["30"], Some("multipie68")));
    for member in collection.members() {
        assert_eq!(member.read().unwrap().mesh.triangles().len(), 2);
    }
}

#[test]
fn no_example_is_left_out() {
    let text =
        fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/formats_page.rs")).unwrap();
    let named = |name: &str| text.contains(&format!("\"{name}\""));
    for (name, _) in examples() {
        assert!(named(&name) || name == "quad.mtl", "{name} is read by no test");
    }
}

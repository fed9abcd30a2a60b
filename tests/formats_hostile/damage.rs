//! Damaged copies of files of every format. The suite has a share of them; `ONEMESH_FUZZ=100000` sets how many copies
//! each reader gets: `ONEMESH_FUZZ=100000 cargo test --release --test formats_hostile damage -- --nocapture`.

use std::time::{Duration, Instant};

use onemesh::formats::{Collection, LandmarkFile, MeshFile, MeshFormat};

use crate::allocator::most_held;
use crate::mutation::damage;
use crate::seeds;

/// Copies where nothing else is asked for; fewer where each is a file.
const SHARE: u64 = 10_000;
pub const SHARE_OF_FILES: u64 = 1_000;
/// What a reader may take for a damaged copy of a small file.
const MEMORY: usize = 8 << 20;
const TIME: Duration = Duration::from_secs(5);

/// Gives a reader damaged copies of all its files, as many to each as together make the number asked for.
pub fn feed(reader: &str, files: &[Vec<u8>], share: u64, read: impl Fn(&[u8])) {
    let asked =
        std::env::var("ONEMESH_FUZZ").ok().map(|count| count.parse().expect("ONEMESH_FUZZ is a count"));
    let rounds = asked.unwrap_or(share).div_ceil(files.len() as u64);
    let (mut inputs, mut slowest, mut largest) = (0u64, Duration::ZERO, 0);
    for file in files {
        damage(file, rounds, |bytes| {
            let start = Instant::now();
            let held = most_held(|| read(bytes));
            let took = start.elapsed();
            assert!(held <= MEMORY, "{reader} takes {held} bytes for {:?}", String::from_utf8_lossy(bytes));
            assert!(took <= TIME, "{reader} takes {took:?} for {:?}", String::from_utf8_lossy(bytes));
            (inputs, slowest, largest) = (inputs + 1, slowest.max(took), largest.max(held));
        });
    }
    assert!(largest > 0, "memory is counted");
    println!("{reader}: {inputs} inputs, slowest {slowest:.1?}, most memory {largest} bytes");
}

fn feed_mesh(reader: &str, format: MeshFormat, files: &[Vec<u8>]) {
    // A file that does not break must be read whole, or its copies would try nothing.
    for file in files {
        let whole = MeshFile::parse(file, format).unwrap_or_else(|error| panic!("{reader}: {error}"));
        assert_eq!(whole.mesh.triangles().len(), 2, "{reader}");
    }
    feed(reader, files, SHARE, |bytes| drop(MeshFile::parse(bytes, format)));
}

fn feed_landmarks(reader: &str, file: &str) {
    let mesh = MeshFile::parse(seeds::OBJ.as_bytes(), MeshFormat::Obj).unwrap();
    LandmarkFile::parse(file.as_bytes()).and_then(|file| file.on(&mesh)).unwrap();
    feed(reader, &[file.as_bytes().to_vec()], SHARE, |bytes| {
        drop(LandmarkFile::parse(bytes).and_then(|file| file.on(&mesh)));
    });
}

#[test]
fn damage_to_obj() {
    feed_mesh("obj", MeshFormat::Obj, &[seeds::OBJ.into()]);
}

#[test]
fn damage_to_mtl() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scan.obj");
    std::fs::write(&path, seeds::OBJ).unwrap();
    std::fs::write(folder.path().join("skin.png"), "").unwrap();
    let read = |bytes: &[u8]| {
        std::fs::write(folder.path().join("skin.mtl"), bytes).unwrap();
        MeshFile::read(&path).unwrap().texture.unwrap().images.len()
    };
    assert_eq!(read(seeds::MTL.as_bytes()), 1);
    feed("mtl", &[seeds::MTL.into()], SHARE_OF_FILES, |bytes| {
        read(bytes);
    });
}

#[test]
fn damage_to_ply() {
    feed_mesh("ply, ascii", MeshFormat::Ply, &[seeds::ascii_ply()]);
    feed_mesh("ply, little-endian", MeshFormat::Ply, &[seeds::binary_ply("little")]);
    feed_mesh("ply, big-endian", MeshFormat::Ply, &[seeds::binary_ply("big")]);
}

#[test]
fn damage_to_stl() {
    feed_mesh("stl, ascii", MeshFormat::Stl, &[seeds::ascii_stl()]);
    feed_mesh("stl, binary", MeshFormat::Stl, &[seeds::binary_stl()]);
}

#[test]
fn damage_to_gltf() {
    feed_mesh("gltf", MeshFormat::Gltf, &[seeds::gltf(false), seeds::gltf(true)]);
    feed_mesh("glb", MeshFormat::Gltf, &[seeds::glb()]);
}

#[test]
fn damage_to_landmarks() {
    feed_landmarks(
        "landmarks, json",
        r#"{"scheme": "own", "landmarks": [[1, 2, 3.5], null, {"name": "a", "position": [0, 1e3, -2]}]}"#,
    );
    feed_landmarks(
        "landmarks, wrap",
        r#"{"a": [1, 0.25, 0.5], "b": null, "c": [0, 1.0, 0.0], "d": [1, 0.5, 0.5]}"#,
    );
    feed_landmarks(
        "landmarks, ljson",
        r#"{"version": 1, "groups": [{"label": "a", "connectivity": [[0, 1]], "landmarks": [{"point": [1, 2, 3]}, {"point": [null, null, null]}]}]}"#,
    );
    feed_landmarks(
        "landmarks, slicer",
        r#"{"markups": [{"type": "Fiducial", "coordinateSystem": "RAS", "controlPoints": [{"label": "a", "position": [1, 2, 3], "positionStatus": "defined"}]}]}"#,
    );
    feed_landmarks(
        "landmarks, meshlab",
        "<!DOCTYPE PickedPoints>\n<PickedPoints><User name=\"me\"/>\n<point x=\"1\" y=\"2\" z=\"3\" active=\"1\" name=\"a &amp; b\"/></PickedPoints>",
    );
    feed_landmarks("landmarks, text", "0\n3 # tip\nnull\n 2\r\n1\n");
}

#[test]
fn damage_to_manifests() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.obj"), seeds::OBJ).unwrap();
    std::fs::write(folder.path().join("a.json"), "[[1, 2, 3]]").unwrap();
    let manifest = r#"{"scheme": "own", "scans": [{"name": "a", "mesh": "a.obj", "landmarks": "a.json"}]}"#;
    let path = folder.path().join("manifest.json");
    let open = |bytes: &[u8]| {
        std::fs::write(&path, bytes).unwrap();
        Collection::open(&path)
    };
    assert_eq!(open(manifest.as_bytes()).unwrap().members().len(), 1);
    feed("manifest", &[manifest.into()], SHARE_OF_FILES, |bytes| drop(open(bytes)));
}

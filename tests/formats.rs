//! Readers on real scans, where they are there, and on large meshes.
//!
//! Scans are looked for in `ONEMESH_TEST_DATA`, or in `../shared/data`: the tests say where they skip one.

use std::fs;
use std::io::Write;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use glam::DVec3;
use onemesh::formats::{
    Collection, Glb, MeshFile, MeshFormat, Region, Scheme, TextureImage, glb_bytes, obj_bytes, parse_mesh,
    ply_bytes, read_landmarks, read_mesh,
};
use onemesh::mesh::TriangleMesh;

/// A file or folder of the test data, or nothing and a line that says so.
fn data(name: &str) -> Option<PathBuf> {
    let beside = || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared/data");
    let path = std::env::var_os("ONEMESH_TEST_DATA").map_or_else(beside, PathBuf::from).join(name);
    if path.exists() {
        return Some(path);
    }
    // Written past the test harness, which hides what passing tests print.
    let line = format!("SKIPPED: no test data: {}\n", path.display());
    std::io::stderr().write_all(line.as_bytes()).expect("standard error is open");
    None
}

#[test]
fn a_scanned_head_and_its_landmarks_are_read() {
    let Some(folder) = data("ict/101") else { return };
    let mesh = read_mesh(folder.join("scan.ply")).unwrap();
    assert_eq!((mesh.positions().len(), mesh.triangles().len()), (60045, 119997));
    let landmarks = read_landmarks(folder.join("landmarks.json")).unwrap();
    assert_eq!((landmarks.scheme.as_deref(), landmarks.names.len()), (Some("multipie68"), 68));
    // The head looks along +z with +y up: its right is at -x, its mouth beneath its eyes.
    let centre = |region| Scheme::named("multipie68").unwrap().centre(region, &landmarks).unwrap();
    assert!(centre(Region::RightEye).x < centre(Region::LeftEye).x);
    assert!(centre(Region::OuterLips).y < centre(Region::LeftEye).y);
    let tip = landmarks.get(&Scheme::named("ibug68").unwrap().nose_tip()).unwrap();
    assert!(tip.z > landmarks.present().map(|(_, point)| point.z).fold(f64::MIN, f64::max) - 1e-9);
    let nearest = mesh.positions().iter().map(|p| p.distance(tip)).fold(f64::MAX, f64::min);
    assert!(nearest < 0.5, "the nose tip lies {nearest} from the surface");
}

#[test]
fn a_folder_of_scans_is_a_collection() {
    let Some(folder) = data("ict") else { return };
    let collection = Collection::open(folder).unwrap();
    assert!(collection.members().len() > 1);
    assert_eq!(collection.common_landmarks().len(), 68);
    let scan = collection.members()[0].read().unwrap();
    assert_eq!(scan.inputs.len(), 2);
}

#[test]
fn a_textured_obj_and_its_ljson_are_read() {
    let Some(folder) = data("menpo") else { return };
    let mesh = read_mesh(folder.join("james.obj")).unwrap();
    assert_eq!((mesh.positions().len(), mesh.triangles().len()), (6393, 12228));
    assert_eq!(read_landmarks(folder.join("james.ljson")).unwrap().present().count(), 68);
    let file = MeshFile::read(folder.join("james.obj")).unwrap();
    assert_eq!(file.warnings, [""; 0]);
    let texture = file.texture.as_ref().unwrap();
    assert_eq!(texture.images, [TextureImage::File(folder.join("james.jpg"))]);
    assert!((0..file.polygons().len()).all(|polygon| texture.image(polygon).is_some()));
    assert!((0..file.polygons().corners().len()).all(|corner| texture.coordinate(corner).is_some()));
    let coloured = MeshFile::read(folder.join("template.ply")).unwrap();
    assert_eq!(coloured.colours.unwrap().len(), coloured.mesh.positions().len());
}

#[test]
fn all_formats_agree_on_a_scan() {
    let Some(path) = data("ict/101/scan.ply") else { return };
    let mesh = read_mesh(path).unwrap();
    assert_eq!(parse_mesh(&ply_bytes(&mesh), MeshFormat::Ply).unwrap(), mesh);
    assert_eq!(parse_mesh(&obj_bytes(&mesh), MeshFormat::Obj).unwrap(), mesh);
    assert_eq!(parse_mesh(&glb_bytes(&Glb::new(&mesh)).unwrap(), MeshFormat::Gltf).unwrap(), mesh);
}

/// A wavy sheet of `2 * side * side` triangles.
fn sheet(side: u32) -> TriangleMesh {
    let at = |i: u32| {
        let (x, y) = (f64::from(i % (side + 1)), f64::from(i / (side + 1)));
        // As scans are: 32-bit coordinates, with all their digits.
        DVec3::new(x * 0.1, y * 0.1, (x * 0.37).sin() * (y * 0.21).cos()).as_vec3().as_dvec3()
    };
    let positions = (0..(side + 1) * (side + 1)).map(at).collect();
    let corner = |i: u32| i / side * (side + 1) + i % side;
    let cells = (0..side * side).map(corner);
    let triangles = cells.flat_map(|a| [[a, a + 1, a + side + 2], [a, a + side + 2, a + side + 1]]).collect();
    TriangleMesh::new(positions, triangles).unwrap()
}

/// As ascii STL.
fn stl(mesh: &TriangleMesh) -> Vec<u8> {
    let vertex = |&i: &u32| {
        let [x, y, z] = mesh.positions()[i as usize].to_array();
        format!("vertex {x} {y} {z}\n")
    };
    let facet = |corners: &[u32; 3]| {
        let vertices: String = corners.iter().map(vertex).collect();
        format!("facet normal 0 0 1\nouter loop\n{vertices}endloop\nendfacet\n")
    };
    let facets: String = mesh.triangles().iter().map(facet).collect();
    format!("solid sheet\n{facets}endsolid sheet\n").into_bytes()
}

#[test]
fn a_file_that_is_read_a_piece_at_a_time_is_the_same_whole_or_cut_short() {
    let mesh = sheet(100);
    let files = [
        (MeshFormat::Ply, ply_bytes(&mesh)),
        (MeshFormat::Obj, obj_bytes(&mesh)),
        (MeshFormat::Stl, stl(&mesh)),
        (MeshFormat::Gltf, glb_bytes(&Glb::new(&mesh)).unwrap()),
    ];
    for (format, bytes) in files {
        // Several pieces, one of which may end within a number.
        assert!(bytes.len() > 300_000);
        for end in (bytes.len() - 12..=bytes.len()).chain([262_143, 262_144, 262_145]) {
            let whole = MeshFile::parse(&bytes[..end], format).map_err(|error| error.to_string());
            let pieces = MeshFile::look_into(&bytes[..end], end as u64, None)
                .map(MeshFile::from)
                .map_err(|error| error.to_string());
            assert_eq!(pieces, whole, "{format:?} up to {end}");
        }
    }
}

/// The sheet with three vertices for each triangle, which glTF readers must weld.
fn torn(mesh: &TriangleMesh) -> TriangleMesh {
    let positions = mesh.triangles().iter().flatten().map(|&i| mesh.positions()[i as usize]).collect();
    let triangles = (0..mesh.triangles().len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    TriangleMesh::new(positions, triangles).unwrap()
}

/// A GLB as another program writes it, so that its seams are closed.
fn foreign_glb(mesh: &TriangleMesh) -> Vec<u8> {
    let mut bytes = glb_bytes(&Glb::new(mesh)).unwrap();
    let own = bytes.windows(7).position(|window| window == b"onemesh").unwrap();
    bytes[own..own + 7].copy_from_slice(b"another");
    bytes
}

#[test]
#[ignore = "measures time: cargo test --release --test formats -- --ignored --nocapture"]
fn large_meshes_are_read_fast() {
    let mesh = sheet(245);
    let torn = foreign_glb(&torn(&mesh));
    let ascii = ascii_ply(&mesh);
    let cases = [
        ("a.ply", ply_bytes(&mesh), 60),
        ("ascii.ply", ascii, 150),
        ("a.glb", foreign_glb(&mesh), 60),
        ("torn.glb", torn, 150),
        ("a.obj", obj_bytes(&mesh), 150),
    ];
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes, limit) in cases {
        let path = folder.path().join(name);
        fs::write(&path, bytes).unwrap();
        let time = || {
            let start = Instant::now();
            assert_eq!(read_mesh(&path).unwrap().triangles().len(), 120_050);
            start.elapsed()
        };
        let mut times: Vec<Duration> = (0..9).map(|_| time()).collect();
        times.sort();
        println!("{name}: {:?} (median of 9; at most {limit} ms)", times[4]);
        assert!(times[4] < Duration::from_millis(limit), "{name}: {times:?}");
    }
}

fn ascii_ply(mesh: &TriangleMesh) -> Vec<u8> {
    let (vertices, faces) = (mesh.positions().len(), mesh.triangles().len());
    let mut out = format!(
        "ply\nformat ascii 1.0\nelement vertex {vertices}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {faces}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    .into_bytes();
    for p in mesh.positions() {
        writeln!(out, "{} {} {}", p.x, p.y, p.z).unwrap();
    }
    for [a, b, c] in mesh.triangles() {
        writeln!(out, "3 {a} {b} {c}").unwrap();
    }
    out
}

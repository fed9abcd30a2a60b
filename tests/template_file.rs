//! A user's template written again with other positions: everything else in its file stays.

use std::fs;
use std::path::Path;

use glam::{DQuat, DVec3};
use onemesh::formats::{MeshFile, MeshFormat, MeshSource, Obj, Ply, Polygons};
use serde_json::{Value, json};

/// A roof of two quads and a triangle: its ridge is along y.
const ROOF: [[f64; 3]; 7] = [
    [-1.0, 0.0, 0.0],
    [0.0, 0.0, 1.0],
    [1.0, 0.0, 0.0],
    [-1.0, 2.0, 0.0],
    [0.0, 2.0, 1.0],
    [1.0, 2.0, 0.0],
    [9.0, 9.0, 9.0],
];

/// The roof elsewhere, each vertex moved on its own.
fn moved() -> Vec<DVec3> {
    let turn = DQuat::from_rotation_z(0.7) * DQuat::from_rotation_x(-0.3);
    let wobble = |i: usize| DVec3::new(0.01, -0.02, 0.03) * i as f64;
    ROOF.iter()
        .enumerate()
        .map(|(i, p)| turn * DVec3::from(*p) * 0.37 + DVec3::splat(0.1) + wobble(i))
        .collect()
}

fn roof() -> Vec<DVec3> {
    ROOF.map(DVec3::from).to_vec()
}

fn source(folder: &Path, name: &str, bytes: &[u8]) -> MeshSource {
    fs::write(folder.join(name), bytes).unwrap();
    MeshSource::read(folder.join(name)).unwrap_or_else(|error| panic!("{error}"))
}

/// Everything but positions is as it was, and positions are those that were given.
fn assert_same_but_for(read: &MeshFile, before: &MeshFile, positions: &[DVec3], tolerance: f64) {
    assert_eq!(read.polygons(), before.polygons());
    assert_eq!((&read.texture, &read.colours), (&before.texture, &before.colours));
    assert_eq!(read.mesh.positions().len(), positions.len());
    for (read, given) in read.mesh.positions().iter().zip(positions) {
        assert!(read.distance(*given) <= tolerance, "{read} {given}");
    }
}

/// Area-weighted unit normals of the vertices, by brute force over the polygons' fans.
fn normals(file: &MeshFile, positions: &[DVec3]) -> Vec<DVec3> {
    let mut normals = vec![DVec3::ZERO; positions.len()];
    for polygon in file.polygons().iter() {
        for k in 2..polygon.len() {
            let corners = [polygon[0], polygon[k - 1], polygon[k]].map(|i| i as usize);
            let [a, b, c] = corners.map(|i| positions[i]);
            corners.iter().for_each(|&i| normals[i] += (b - a).cross(c - a));
        }
    }
    normals.into_iter().map(|n| n.normalize_or(DVec3::Z)).collect()
}

fn spelled(p: DVec3) -> String {
    format!("{} {} {}", p.x, p.y, p.z)
}

fn obj(positions: &[DVec3], normals: &[String; 7]) -> Vec<u8> {
    let p: Vec<String> = positions.iter().map(|p| spelled(*p)).collect();
    let n = normals;
    let mut text = b"\xEF\xBB\xBF# caf\xE9\r\nmtllib own.mtl\r\no roof\r\n".to_vec();
    text.extend(
        format!("v {} 0.1 0.2 0.3\nv\t{}   0.4 0.5 0.6 # ridge\nv \\\n {} 1 1 1\n", p[0], p[1], p[2]).bytes(),
    );
    text.extend(format!("vt 0 0\nvt 1 0 0\nvt 1 1\nvt 0.25 .75\nvn {}\nvn {}\n", n[0], n[1]).bytes());
    text.extend(b"g west\nusemtl tiles\ns 1\nf 1/1/1 2/2/2 -1/3/3\n# more\n");
    text.extend(
        format!("v {} 0 0 0\nv {} 0 0 0\nv {} 0 0 0\nvn {}\nvn {}\n", p[3], p[4], p[5], n[2], n[3]).bytes(),
    );
    text.extend(format!("vn {}\nvn {}\nvn {}\n", n[4], n[5], n[6]).bytes());
    text.extend(b"f 1/1/1 4/2/4 5/3/5 2/4/2\ng east\nusemtl slate\nf 2/1/2 5/2/5 6/3/6 3/4/3\nl 1 2\n");
    text.extend(format!("v {} 0 0 0\r\nvp 1 2 3", p[6]).bytes());
    text
}

#[test]
fn an_obj_keeps_all_but_its_numbers() {
    let folder = tempfile::tempdir().unwrap();
    let old_normals: [String; 7] = std::array::from_fn(|at| format!("0 0 {}", at + 1));
    let before = source(folder.path(), "roof.obj", &obj(&roof(), &old_normals));
    assert_eq!((before.extension(), before.inputs.len()), ("obj", 1));
    let rewritten = before.with_positions(&moved()).unwrap();
    let expected = normals(&before.file, &moved());
    let mut expected: [String; 7] = std::array::from_fn(|at| spelled(expected[at]));
    // No face names it.
    expected[6].clone_from(&old_normals[6]);
    let expected = obj(&moved(), &expected);
    assert_eq!(String::from_utf8_lossy(&rewritten), String::from_utf8_lossy(&expected));
    let read = MeshFile::parse(&rewritten, MeshFormat::Obj).unwrap();
    assert_same_but_for(&read, &before.file, &moved(), 0.0);
    assert_eq!(read.polygons().iter().map(<[u32]>::len).collect::<Vec<_>>(), [3, 4, 4]);
}

#[test]
fn materials_and_pictures_come_along() {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("maps")).unwrap();
    fs::write(folder.path().join("maps/skin.png"), b"no picture is looked at").unwrap();
    fs::write(folder.path().join("own.mtl"), b"newmtl skin\nmap_Kd maps/skin.png\n").unwrap();
    let text = "mtllib own.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl skin\nf 1/1 2/1 3/1\n";
    let source = source(folder.path(), "flat.obj", text.as_bytes());
    let names: Vec<_> = source.companions().into_iter().collect();
    let expected = ["maps/skin.png", "own.mtl"].map(|name| (name.into(), folder.path().join(name)));
    assert_eq!(names, expected);
}

#[test]
fn normals_that_vertices_share_stay() {
    let folder = tempfile::tempdir().unwrap();
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nf 1//1 2//1 3//1\n";
    let before = source(folder.path(), "flat.obj", text.as_bytes());
    let rewritten = before.with_positions(&[DVec3::ZERO, DVec3::Y, DVec3::Z]).unwrap();
    assert_eq!(rewritten, b"v 0 0 0\nv 0 1 0\nv 0 0 1\nvn 0 0 1\nf 1//1 2//1 3//1\n");
}

/// How a PLY is written in a test.
#[derive(Clone, Copy, PartialEq, Debug)]
enum Encoding {
    Ascii,
    Little,
    Big,
}

/// Rows of a PLY in an encoding.
struct Rows(Encoding, Vec<u8>);

impl Rows {
    fn put(&mut self, text: String, little: &[u8]) {
        match self.0 {
            Encoding::Ascii => self.1.extend(format!("{text} ").bytes()),
            Encoding::Little => self.1.extend(little),
            Encoding::Big => self.1.extend(little.iter().rev()),
        }
    }

    fn float(&mut self, value: f64, double: bool) {
        let single = value as f32;
        if double {
            self.put(value.to_string(), &value.to_le_bytes());
        } else {
            self.put(single.to_string(), &single.to_le_bytes());
        }
    }

    fn byte(&mut self, value: u8) {
        self.put(value.to_string(), &[value]);
    }

    fn end(&mut self) {
        if self.0 == Encoding::Ascii {
            self.1.extend(b" \r\n");
        }
    }
}

/// Faces, then vertices with a list and properties of other kinds among them, then an element of no meaning.
fn ply(encoding: Encoding, double: bool, positions: &[DVec3], normals: &[DVec3]) -> Vec<u8> {
    let name = match encoding {
        Encoding::Ascii => "ascii",
        Encoding::Little => "binary_little_endian",
        Encoding::Big => "binary_big_endian",
    };
    let float = if double { "double" } else { "float" };
    let header = format!(
        "ply\nformat {name} 1.0\ncomment by hand\nobj_info 7\nelement nothing 3\nelement face 3\n\
         property list uchar uchar vertex_index\nproperty list uchar float texcoord\nelement vertex 7\n\
         property uchar red\nproperty {float} z\nproperty uchar green\nproperty uchar blue\nproperty {float} x\n\
         property list uchar {float} bones\nproperty {float} y\nproperty float nx\nproperty float ny\n\
         property float nz\nproperty float quality\nelement after 1\nproperty uchar x\nend_header\n"
    );
    let mut rows = Rows(encoding, header.into_bytes());
    for face in [&[0u8, 1, 2][..], &[0, 3, 4, 1], &[1, 4, 5, 2]] {
        rows.byte(face.len() as u8);
        face.iter().for_each(|&corner| rows.byte(corner));
        rows.byte(2 * face.len() as u8);
        face.iter()
            .for_each(|&corner| [0.25, f64::from(corner)].into_iter().for_each(|uv| rows.float(uv, false)));
        rows.end();
    }
    for (at, (p, n)) in positions.iter().zip(normals).enumerate() {
        rows.byte(at as u8);
        rows.float(p.z, double);
        rows.byte(7);
        rows.byte(9);
        rows.float(p.x, double);
        rows.byte(at as u8 % 3);
        (0..at % 3).for_each(|bone| rows.float(bone as f64, double));
        rows.float(p.y, double);
        n.to_array().into_iter().for_each(|n| rows.float(n, false));
        rows.float(at as f64 / 7.0, false);
        rows.end();
    }
    rows.byte(8);
    rows.end();
    rows.1
}

#[test]
fn a_ply_keeps_all_but_its_numbers() {
    let folder = tempfile::tempdir().unwrap();
    for encoding in [Encoding::Ascii, Encoding::Little, Encoding::Big] {
        for double in [false, true] {
            let old = ply(encoding, double, &roof(), &[DVec3::X; 7]);
            let before = source(folder.path(), "roof.ply", &old);
            let rewritten = before.with_positions(&moved()).unwrap();
            let mut expected = normals(&before.file, &moved());
            // No face names it.
            expected[6] = DVec3::X;
            assert_eq!(rewritten, ply(encoding, double, &moved(), &expected), "{encoding:?} {double}");
            let read = MeshFile::parse(&rewritten, MeshFormat::Ply).unwrap();
            assert_same_but_for(&read, &before.file, &moved(), if double { 0.0 } else { 1e-6 });
        }
    }
}

/// A roof whose ridge is cut by a seam of texture coordinates; the normals there are one on vertices 1 and 2, and differ
/// on 4 and 5. Positions and normals lie interleaved.
fn gltf() -> (Value, Vec<u8>) {
    let corners = [[-1.0f32, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 1.0], [-1.0, 2.0, 0.0], [0.0, 2.0, 1.0]];
    let corners = corners.iter().chain(&[[0.0, 2.0, 1.0], [1.0, 0.0, 0.0], [1.0, 2.0, 0.0], [5.0, 5.0, 5.0]]);
    let normals = [[0.0f32, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]];
    let normals = normals.iter().chain(&[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 1.0, 0.0], [0.0, 1.0, 0.0]]);
    let mut bytes: Vec<u8> = Vec::new();
    for (at, (corner, normal)) in corners.zip(normals).enumerate() {
        corner
            .iter()
            .chain(normal)
            .chain(&[at as f32 / 9.0, 0.5])
            .for_each(|x| bytes.extend(x.to_le_bytes()));
    }
    let triangles = [[0u16, 1, 3], [1, 4, 3], [2, 6, 5], [6, 7, 5]];
    triangles.as_flattened().iter().for_each(|i| bytes.extend(i.to_le_bytes()));
    let view = |offset: usize, length: usize| json!({ "buffer": 0, "byteOffset": offset, "byteLength": length, "byteStride": 32 });
    let vector = |offset: usize, kind: &str| json!({ "bufferView": 0, "byteOffset": offset, "componentType": 5126, "count": 9, "type": kind });
    let mut positions = vector(0, "VEC3");
    positions["min"] = json!([-1.0, 0.0, 0.0]);
    positions["max"] = json!([5.0, 5.0, 5.0]);
    let document = json!({
        "asset": { "version": "2.0", "generator": "by hand" },
        "scene": 0,
        "scenes": [{ "nodes": [0], "extras": { "max": [1, 2] } }],
        "nodes": [
            { "children": [1], "translation": [0.5, -2.0, 3.0], "rotation": [0.0, 0.6, 0.0, 0.8] },
            { "mesh": 0, "scale": [2.0, 2.0, -4.0] },
        ],
        "materials": [{ "name": "tiles" }],
        "meshes": [{ "primitives": [
            { "attributes": { "POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2 }, "indices": 3, "material": 0 },
        ] }],
        "accessors": [
            positions, vector(12, "VEC3"), vector(24, "VEC2"),
            { "bufferView": 1, "componentType": 5123, "count": 12, "type": "SCALAR", "min": [0], "max": [7] },
        ],
        "bufferViews": [view(0, 288), { "buffer": 0, "byteOffset": 288, "byteLength": 24 }],
        "buffers": [{ "byteLength": bytes.len() }],
    });
    (document, bytes)
}

fn glb(document: &Value, binary: &[u8]) -> Vec<u8> {
    let mut json = document.to_string().into_bytes();
    json.resize(json.len().next_multiple_of(4) + 8, b' ');
    let mut out = b"glTF\x02\0\0\0\0\0\0\0".to_vec();
    for (kind, data) in [(b"JSON", &json[..]), (b"BIN\0", binary), (b"OWN!", b"more")] {
        out.extend((data.len() as u32).to_le_bytes());
        out.extend(kind);
        out.extend(data);
    }
    let length = (out.len() as u32).to_le_bytes();
    out[8..12].copy_from_slice(&length);
    out
}

/// The JSON and what follows it.
fn split(glb: &[u8]) -> (Value, &[u8]) {
    assert_eq!(u32::from_le_bytes(*glb[8..].first_chunk().unwrap()) as usize, glb.len());
    let length = u32::from_le_bytes(*glb[12..].first_chunk().unwrap()) as usize;
    (serde_json::from_slice(&glb[20..20 + length]).unwrap(), &glb[20 + length..])
}

fn float_at(bytes: &[u8], at: usize) -> f64 {
    f64::from(f32::from_le_bytes(*bytes[at..].first_chunk().unwrap()))
}

/// New positions for the six vertices of the mesh that a roof in a scene is.
fn six(file: &MeshFile) -> Vec<DVec3> {
    assert_eq!(file.mesh.positions().len(), 6, "seams are closed");
    moved()[..6].to_vec()
}

#[test]
fn a_glb_keeps_all_but_its_numbers() {
    let folder = tempfile::tempdir().unwrap();
    let (document, binary) = gltf();
    let before = source(folder.path(), "roof.glb", &glb(&document, &binary));
    let positions = six(&before.file);
    let rewritten = before.with_positions(&positions).unwrap();
    let read = MeshFile::parse(&rewritten, MeshFormat::Gltf).unwrap();
    assert_same_but_for(&read, &before.file, &positions, 1e-6);

    let (mut json, chunks) = split(&rewritten);
    let bytes = &chunks[8..8 + binary.len()];
    for (axis, (min, max)) in
        (0..3).map(|axis| (axis, [f64::min, f64::max])).map(|(axis, f)| (axis, (f[0], f[1])))
    {
        let stored = || (0..9).map(|i| float_at(bytes, 32 * i + 4 * axis));
        assert_eq!(json["accessors"][0]["min"][axis], stored().fold(f64::INFINITY, min));
        assert_eq!(json["accessors"][0]["max"][axis], stored().fold(f64::NEG_INFINITY, max));
    }
    for bound in ["min", "max"] {
        json["accessors"][0][bound] = document["accessors"][0][bound].clone();
    }
    assert_eq!(json, document);
    for at in (0..binary.len()).filter(|&at| at >= 288 || at % 32 >= 24 || at / 32 == 8) {
        assert_eq!(bytes[at], binary[at], "byte {at}: coordinates, indices, and what no triangle names");
    }
    assert!(chunks.ends_with(b"OWN!more"));

    // What is one vertex and had one normal has one; the crease stays a crease.
    let normal = |i: usize| DVec3::from([0, 1, 2].map(|axis| float_at(bytes, 32 * i + 12 + 4 * axis)));
    assert_eq!(normal(1), normal(2));
    assert!(normal(4).distance(normal(5)) > 0.1 && (normal(4).length() - 1.0).abs() < 1e-6);
    // In the scene it stands upright on its triangles, by the transform's inverse transpose.
    let turn = DQuat::from_xyzw(0.0, 0.6, 0.0, 0.8);
    let in_scene = (turn * (normal(4) / DVec3::new(2.0, 2.0, -4.0))).normalize();
    let [a, b, c] = before.file.mesh.triangles()[1].map(|i| positions[i as usize]);
    let expected = (b - a).cross(c - a).normalize();
    assert!(in_scene.distance(expected) < 1e-5, "{in_scene} {expected}");
}

#[test]
fn a_gltf_with_a_file_beside_it_is_made_whole() {
    let folder = tempfile::tempdir().unwrap();
    let (mut document, binary) = gltf();
    fs::write(folder.path().join("roof.bin"), &binary).unwrap();
    document["buffers"][0]["uri"] = json!("roof.bin");
    let before = source(folder.path(), "roof.gltf", document.to_string().as_bytes());
    assert_eq!((before.extension(), before.inputs.len()), ("gltf", 2));
    let positions = six(&before.file);
    let rewritten = before.with_positions(&positions).unwrap();
    let read = MeshFile::parse(&rewritten, MeshFormat::Gltf).unwrap();
    assert_same_but_for(&read, &before.file, &positions, 1e-6);
    assert!(String::from_utf8(rewritten).unwrap().contains("data:application/octet-stream;base64,"));
}

#[test]
fn what_cannot_be_kept_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let (mut document, binary) = gltf();
    let complaint = |document: &Value| {
        let before = source(folder.path(), "roof.glb", &glb(document, &binary));
        before.with_positions(before.file.mesh.positions()).map(|_| ()).unwrap_err().to_string()
    };
    document["nodes"][1]["children"] = json!([2]);
    document["nodes"].as_array_mut().unwrap().push(json!({ "mesh": 0, "translation": [50.0, 0.0, 0.0] }));
    let said = complaint(&document);
    assert!(said.contains("shares vertices"), "{said}");

    let whole = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    let before = source(folder.path(), "a.obj", whole.as_bytes());
    let said = before.with_positions(&[DVec3::ZERO; 2]).unwrap_err().to_string();
    assert!(said.contains("2 positions") && said.contains("3 vertices"), "{said}");
    assert!(before.with_positions(&[DVec3::NAN; 3]).is_err());
    let integers = "ply\nformat ascii 1.0\nelement vertex 3\nproperty int x\nproperty int y\nproperty int z\n\
                    element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    let before = source(folder.path(), "a.ply", integers.as_bytes());
    let said = before.with_positions(&[DVec3::ZERO; 3]).unwrap_err().to_string();
    assert!(said.contains("`x` is no float"), "{said}");
    let singles =
        integers.replace("int x", "float x").replace("int y", "float y").replace("int z", "float z");
    let before = source(folder.path(), "a.ply", singles.as_bytes());
    let said = before.with_positions(&[DVec3::splat(1e300); 3]).unwrap_err().to_string();
    assert!(said.contains("no 32-bit float"), "{said}");
    let stl = "solid\nfacet\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendfacet\nendsolid\n";
    let before = source(folder.path(), "a.stl", stl.as_bytes());
    let said = before.with_positions(before.file.mesh.positions()).unwrap_err().to_string();
    assert!(said.contains("have results as GLB"), "{said}");
}

#[test]
fn exports_have_polygons_coordinates_and_figures() {
    let folder = tempfile::tempdir().unwrap();
    let names: [String; 7] = std::array::from_fn(|_| "0 0 1".to_owned());
    let MeshSource { file, .. } = source(folder.path(), "roof.obj", &obj(&roof(), &names));
    let written =
        Obj { positions: &moved(), polygons: &file.polygons(), texture: file.texture.as_ref() }.bytes();
    let read = MeshFile::parse(&written, MeshFormat::Obj).unwrap();
    assert_eq!((&read.polygons(), read.mesh.positions()), (&file.polygons(), &moved()[..]));
    let (read, texture) = (read.texture.unwrap(), file.texture.clone().unwrap());
    assert_eq!((read.coordinates, read.corners), (texture.coordinates, texture.corners));

    let (figures, uv) = ([0.5; 7], [glam::DVec2::new(0.25, 0.125); 7]);
    let ply = Ply {
        positions: &moved(),
        polygons: &file.polygons(),
        texture_coordinates: Some(&uv),
        scalars: vec![("residual", &figures)],
    };
    let written = ply.bytes();
    assert!(String::from_utf8_lossy(&written).contains("property float residual\n"));
    let half = 0.5f32.to_le_bytes();
    let header = written.windows(11).position(|window| window == b"end_header\n").unwrap() + 11;
    assert_eq!(written[header + 32..header + 36], half, "three doubles and two floats come before");
    let read = MeshFile::parse(&written, MeshFormat::Ply).unwrap();
    assert_eq!((&read.polygons(), read.mesh.positions()), (&file.polygons(), &moved()[..]));
    assert_eq!(read.vertex_texture_coordinates().unwrap()[3], uv[3]);

    let many = Polygons::of_triangles(&[[0, 1, 2], [2, 1, 3]]);
    assert_eq!(many.iter().collect::<Vec<_>>(), [[0, 1, 2], [2, 1, 3]]);
}

//! Memory that readers take for hostile files: a small multiple of the file's size, whatever the file claims.

use onemesh::formats::{MeshFormat, parse_landmarks, parse_mesh};

use crate::allocator::most_held;

/// The most bytes held at once while `read` runs, for each byte of `file`.
fn bytes_per_byte(file: &[u8], read: impl FnOnce(&[u8])) -> f64 {
    most_held(|| read(file)) as f64 / file.len() as f64
}

const LARGE: usize = 1 << 20;
const LIMIT: f64 = 32.0;

#[track_caller]
fn check_mesh(format: MeshFormat, file: &[u8]) {
    let ratio = bytes_per_byte(file, |file| drop(parse_mesh(file, format)));
    assert!(ratio < LIMIT, "{ratio} bytes for each byte of the file");
}

#[test]
fn obj_stays_small() {
    for line in [
        "f 1 1 1 1 1 1 1 1 1 1\n",
        "v 0 0 0\n",
        "v 0 0 0 1 1 1\n",
        "vt 0\n",
        "f\n",
        "f 1 1 1\n",
        "f 1/1 1 1\n",
        "usemtl a\nf 1 1 1\n",
        "\\\n",
    ] {
        check_mesh(MeshFormat::Obj, format!("v 0 0 0\n{}", line.repeat(LARGE / line.len())).as_bytes());
    }
    check_mesh(MeshFormat::Obj, format!("v 0 0 0\nf {}", "1 ".repeat(LARGE / 2)).as_bytes());
}

#[test]
fn ply_stays_small() {
    let header = |format: &str, vertices: usize, faces: usize| {
        format!(
            "ply\nformat {format} 1.0\nelement vertex {vertices}\nproperty char x\nproperty char y\n\
             property char z\nelement face {faces}\nproperty list uchar uchar vertex_index\nend_header\n"
        )
    };
    let body = vec![0u8; LARGE];
    for (vertices, faces) in [(LARGE / 3, 0), (1, LARGE - 3), (usize::MAX >> 1, 1), (1, usize::MAX >> 1)] {
        check_mesh(
            MeshFormat::Ply,
            &[header("binary_big_endian", vertices, faces).as_bytes(), &body].concat(),
        );
    }
    let polygons = [&[0, 0, 0][..], &vec![255u8; LARGE]].concat();
    check_mesh(
        MeshFormat::Ply,
        &[header("binary_little_endian", 256, LARGE / 256).as_bytes(), &polygons].concat(),
    );
    let text = header("ascii", LARGE / 8, LARGE) + &"0 0 0\n".repeat(LARGE / 6);
    check_mesh(MeshFormat::Ply, text.as_bytes());
    check_mesh(MeshFormat::Ply, format!("ply\n{}", "element a 1\n".repeat(LARGE / 12)).as_bytes());
    check_mesh(
        MeshFormat::Ply,
        format!("ply\nelement a 1\n{}", "property int a\n".repeat(LARGE / 15)).as_bytes(),
    );
    check_mesh(MeshFormat::Ply, format!("ply\ncomment {}", "a ".repeat(LARGE / 2)).as_bytes());
}

#[test]
fn stl_stays_small() {
    let facet = [&[0u8; 12][..], &[1; 38]].concat().repeat(LARGE / 50);
    for claimed in [LARGE as u32 / 50, u32::MAX] {
        check_mesh(MeshFormat::Stl, &[&[0; 80], &claimed.to_le_bytes()[..], &facet].concat());
    }
    for line in ["facet\nvertex 0 0 0\nvertex 0 0 1\nvertex 0 1 0\n", "solid\nendsolid\n", "facet\n"] {
        check_mesh(MeshFormat::Stl, format!("solid\n{}endsolid", line.repeat(LARGE / line.len())).as_bytes());
    }
}

#[test]
fn gltf_stays_small() {
    let document = |rest: &str| format!(r#"{{"asset":{{"version":"2.0"}},{rest}}}"#);
    let list = |entry: &str| vec![entry; LARGE / (entry.len() + 1)].join(",");
    for key in [
        "nodes",
        "meshes",
        "accessors",
        "bufferViews",
        "buffers",
        "scenes",
        "materials",
        "textures",
        "images",
    ] {
        check_mesh(MeshFormat::Gltf, document(&format!(r#""{key}":[{}]"#, list("{}"))).as_bytes());
    }
    check_mesh(
        MeshFormat::Gltf,
        document(&format!(r#""extensionsRequired":[{}]"#, list("\"KHR_xmp\""))).as_bytes(),
    );
    let primitives = list(r#"{"attributes":{}}"#);
    check_mesh(
        MeshFormat::Gltf,
        document(&format!(r#""meshes":[{{"primitives":[{primitives}]}}]"#)).as_bytes(),
    );
    let chain: Vec<_> = (1..LARGE / 20).map(|child| format!(r#"{{"children":[{child}]}}"#)).collect();
    check_mesh(MeshFormat::Gltf, document(&format!(r#""nodes":[{},{{}}]"#, chain.join(","))).as_bytes());
    let shared = format!(
        r#""meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}],"nodes":[{}],
           "accessors":[{{"componentType":5126,"count":65000,"type":"VEC3","bufferView":0}}],
           "bufferViews":[{{"buffer":0,"byteLength":780000}}],
           "buffers":[{{"byteLength":780000,"uri":"data:;base64,{}"}}]"#,
        list(r#"{"mesh":0,"translation":[1,2,3]}"#),
        "A".repeat(1_040_000)
    );
    check_mesh(MeshFormat::Gltf, document(&shared).as_bytes());
    check_mesh(MeshFormat::Gltf, document(&pictures()).as_bytes());
}

/// A thousand pictures, each in the same bytes.
fn pictures() -> String {
    const COUNT: usize = 1000;
    let entries = |entry: fn(usize) -> String| (0..COUNT).map(entry).collect::<Vec<_>>().join(",");
    format!(
        r#""meshes":[{{"primitives":[{}]}}],"materials":[{}],"textures":[{}],"images":[{}],
           "accessors":[{{"componentType":5126,"count":3,"type":"VEC3","bufferView":0}},
                        {{"componentType":5126,"count":3,"type":"VEC2","bufferView":0}}],
           "bufferViews":[{{"buffer":0,"byteLength":780000}}],
           "buffers":[{{"byteLength":780000,"uri":"data:;base64,{}"}}]"#,
        entries(|i| format!(r#"{{"attributes":{{"POSITION":0,"TEXCOORD_0":1}},"material":{i}}}"#)),
        entries(|i| format!(r#"{{"pbrMetallicRoughness":{{"baseColorTexture":{{"index":{i}}}}}}}"#)),
        entries(|i| format!(r#"{{"source":{i}}}"#)),
        entries(|_| r#"{"bufferView":0}"#.to_owned()),
        "A".repeat(1_040_000)
    )
}

#[track_caller]
fn check_landmarks(file: &str) {
    let ratio = bytes_per_byte(file.as_bytes(), |file| drop(parse_landmarks(file)));
    let start: String = file.chars().take(60).collect();
    assert!(ratio < LIMIT, "{ratio} bytes for each byte of `{start}...`");
}

#[test]
fn landmarks_stay_small() {
    for entry in ["null", "[1,2,3]", "{\"name\":\"a\"}", "[]", "[1,0,0]"] {
        let list = vec![entry; LARGE / (entry.len() + 1)].join(",");
        check_landmarks(&format!("[{list}]"));
        check_landmarks(&format!("{{\"points\":[{list}]}}"));
        check_landmarks(&format!("{{\"groups\":[{{\"landmarks\":[{list}]}}]}}"));
        check_landmarks(&format!("{{\"markups\":[{{\"controlPoints\":[{list}]}}]}}"));
    }
    for element in ["<point x='1' y='1' z='1'/>", "<a>", "<point ", "<!-- -->", "&amp;"] {
        check_landmarks(&format!("<PickedPoints>{}", element.repeat(LARGE / element.len())));
    }
    for line in ["1\n", "123456789012\n", "# a comment\n", "\n"] {
        check_landmarks(&line.repeat(LARGE / line.len()));
    }
}

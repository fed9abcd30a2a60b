mod texture;

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use glam::DVec3;
use serde_json::{Value, json};

use crate::formats::{MeshFormat, parse_mesh, read_mesh};
use crate::mesh::TriangleMesh;

fn mesh(bytes: &[u8]) -> TriangleMesh {
    parse_mesh(bytes, MeshFormat::Gltf).unwrap_or_else(|error| panic!("{error}"))
}

fn complaint(bytes: &[u8]) -> String {
    parse_mesh(bytes, MeshFormat::Gltf).unwrap_err().to_string()
}

fn said_of(document: &Value) -> String {
    complaint(document.to_string().as_bytes())
}

/// The square (0,0) (1,0) (1,1) (0,1): four positions, then the six indices of its triangles as 16-bit integers.
fn square_bytes() -> Vec<u8> {
    let positions = [[0.0f32, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    let mut bytes: Vec<u8> = positions.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
    bytes.extend([0u16, 1, 2, 0, 2, 3].iter().flat_map(|i| i.to_le_bytes()));
    bytes
}

fn data_uri(bytes: &[u8]) -> String {
    format!("data:application/octet-stream;base64,{}", BASE64_STANDARD.encode(bytes))
}

fn square() -> Value {
    json!({
        "asset": { "version": "2.0" },
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0, "NORMAL": 77 }, "indices": 1 }] }],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3" },
            { "bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR" },
        ],
        "bufferViews": [
            { "buffer": 0, "byteLength": 48 },
            { "buffer": 0, "byteOffset": 48, "byteLength": 12 },
        ],
        "buffers": [{ "byteLength": 60, "uri": data_uri(&square_bytes()) }],
    })
}

fn with(path: &str, value: Value) -> Value {
    let mut document = square();
    match document.pointer_mut(path) {
        Some(place) => *place = value,
        None => {
            let (parent, key) = path.rsplit_once('/').unwrap();
            document.pointer_mut(parent).unwrap()[key] = value;
        }
    }
    document
}

fn read(document: &Value) -> TriangleMesh {
    mesh(document.to_string().as_bytes())
}

fn glb(document: &Value, binary: &[u8]) -> Vec<u8> {
    let mut json = document.to_string().into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut out = b"glTF\x02\0\0\0".to_vec();
    out.extend((28 + json.len() as u32 + binary.len() as u32).to_le_bytes());
    for (kind, data) in [(b"JSON", &json[..]), (b"BIN\0", binary)] {
        out.extend((data.len() as u32).to_le_bytes());
        out.extend(kind);
        out.extend(data);
    }
    out
}

fn square_glb() -> Vec<u8> {
    glb(&with("/buffers/0", json!({ "byteLength": 60 })), &square_bytes())
}

#[test]
fn embedded_binary_and_external_buffers_are_read() {
    let embedded = read(&square());
    assert_eq!(embedded.triangles(), [[0, 1, 2], [0, 2, 3]]);
    assert_eq!(embedded.positions()[2], DVec3::new(1.0, 1.0, 0.0));
    assert_eq!(mesh(&square_glb()), embedded);

    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("the data")).unwrap();
    std::fs::write(folder.path().join("the data/s.bin"), square_bytes()).unwrap();
    let path = folder.path().join("scan.gltf");
    let external = |uri: &str| {
        std::fs::write(&path, with("/buffers/0/uri", json!(uri)).to_string()).unwrap();
        read_mesh(&path)
    };
    assert_eq!(external("the%20data/s.bin").unwrap(), embedded);
    for outside in
        ["../s.bin", "/etc/passwd", "file:///etc/passwd", "https://a.b/c", "%2e%2e/s.bin", "a/../../b", ""]
    {
        let error = external(outside).unwrap_err().to_string();
        assert!(error.contains("scan.gltf: buffers[0]: names"), "{error}");
    }
    assert!(external("lost.bin").unwrap_err().to_string().contains("lost.bin: cannot be read"));
    assert!(said_of(&with("/buffers/0/uri", json!("s.bin"))).contains("not here"));
}

#[test]
fn node_transforms_are_applied_down_the_tree() {
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let nodes = json!([
        { "children": [1], "translation": [10.0, 0.0, 0.0], "rotation": [0.0, 0.0, half, half] },
        { "children": [2], "scale": [2.0, 2.0, 2.0] },
        { "mesh": 0, "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 5, 1] },
    ]);
    let placed = read(&with("/nodes", nodes));
    // (x, y, z + 5) doubled, then turned a quarter about z.
    let expected = DVec3::new(10.0 - 2.0, 2.0, 10.0);
    assert!(placed.positions()[2].distance(expected) < 1e-12, "{}", placed.positions()[2]);
}

#[test]
fn a_mirroring_node_keeps_the_outside_outside() {
    let mirrored = read(&with("/nodes/0/scale", json!([-1.0, 1.0, 1.0])));
    assert_eq!(mirrored.triangles(), [[0, 2, 1], [0, 3, 2]]);
    assert_eq!(mirrored.positions()[1], DVec3::NEG_X);
}

#[test]
fn a_skinned_mesh_stays_where_its_joints_are() {
    let skinned = json!([{ "mesh": 0, "skin": 0, "translation": [5, 0, 0] }]);
    assert_eq!(read(&with("/nodes", skinned)), read(&square()));
}

#[test]
fn strips_fans_and_plain_lists_make_the_same_square() {
    let with_mode = |mode: u32, indices: &[u16]| {
        let mut bytes = square_bytes();
        bytes.truncate(48);
        bytes.extend(indices.iter().flat_map(|i| i.to_le_bytes()));
        let mut document = with("/meshes/0/primitives/0/mode", json!(mode));
        document["accessors"][1]["count"] = json!(indices.len());
        document["bufferViews"][1]["byteLength"] = json!(indices.len() * 2);
        document["buffers"][0] = json!({ "byteLength": bytes.len(), "uri": data_uri(&bytes) });
        read(&document).triangles().to_vec()
    };
    assert_eq!(with_mode(4, &[0, 1, 2, 0, 2, 3]), [[0, 1, 2], [0, 2, 3]]);
    assert_eq!(with_mode(5, &[0, 1, 3, 2]), [[0, 1, 3], [1, 2, 3]]);
    assert_eq!(with_mode(5, &[0, 1, 3, 3, 2]).len(), 1);
    assert_eq!(with_mode(6, &[0, 1, 2, 3]), [[1, 2, 0], [2, 3, 0]]);
    let mut unindexed = with("/meshes/0/primitives/0/mode", json!(6));
    unindexed["meshes"][0]["primitives"][0].as_object_mut().unwrap().remove("indices");
    assert_eq!(read(&unindexed).triangles(), [[1, 2, 0], [2, 3, 0]]);
}

#[test]
fn primitives_that_share_their_vertices_keep_sharing_them() {
    let part = |offset: usize| json!({ "bufferView": 1, "byteOffset": offset, "componentType": 5123, "count": 3, "type": "SCALAR" });
    let mut document = square();
    document["accessors"] = json!([document["accessors"][0], part(0), part(6)]);
    let primitive = |indices: usize| json!({ "attributes": { "POSITION": 0 }, "indices": indices });
    document["meshes"] = json!([{ "primitives": [primitive(1), primitive(2)] }]);
    assert_eq!(read(&document), read(&square()));
}

#[test]
fn seams_close_but_not_in_own_files() {
    // The square's diagonal is cut: its two triangles have three vertices each.
    let corners = [[0.0f32, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let bytes: Vec<u8> = corners.iter().flat_map(|&[x, y]| [x, y, 0.0]).flat_map(f32::to_le_bytes).collect();
    let mut document = with("/buffers/0", json!({ "byteLength": 72, "uri": data_uri(&bytes) }));
    document["bufferViews"] = json!([{ "buffer": 0, "byteLength": 72 }]);
    document["accessors"] = json!([{ "bufferView": 0, "componentType": 5126, "count": 6, "type": "VEC3" }]);
    document["meshes"] = json!([{ "primitives": [{ "attributes": { "POSITION": 0 } }] }]);
    assert_eq!(read(&document), read(&square()));
    document["asset"]["generator"] = json!("onemesh 1.2.3");
    assert_eq!(read(&document).positions().len(), 6);
}

#[test]
fn strides_and_quantized_positions_are_read() {
    let corners: [[u8; 4]; 4] = [[0, 0, 0, 9], [255, 0, 0, 9], [255, 255, 0, 9], [0, 255, 0, 9]];
    let mut bytes = corners.concat();
    bytes.extend([0, 1, 2, 0, 2, 3]);
    let mut document = with("/buffers/0", json!({ "byteLength": 22, "uri": data_uri(&bytes) }));
    document["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
    document["bufferViews"] = json!([
        { "buffer": 0, "byteLength": 16, "byteStride": 4 },
        { "buffer": 0, "byteOffset": 16, "byteLength": 6 },
    ]);
    document["accessors"] = json!([
        { "bufferView": 0, "componentType": 5121, "normalized": true, "count": 4, "type": "VEC3" },
        { "bufferView": 1, "componentType": 5121, "count": 6, "type": "SCALAR" },
    ]);
    assert_eq!(read(&document), read(&square()));
}

#[test]
fn sparse_values_replace_dense_ones_or_zeros() {
    let mut bytes = square_bytes();
    bytes.extend([0, 1, 2, 3]);
    let sparse = |count: usize, values: usize| {
        json!({
            "count": count,
            "indices": { "bufferView": 2, "byteOffset": 4 - count, "componentType": 5121 },
            "values": { "bufferView": 0, "byteOffset": values },
        })
    };
    let mut document = with("/buffers/0", json!({ "byteLength": 64, "uri": data_uri(&bytes) }));
    document["bufferViews"] = json!([document["bufferViews"][0], document["bufferViews"][1], { "buffer": 0, "byteOffset": 60, "byteLength": 4 }]);
    document["accessors"][0]["sparse"] = sparse(1, 4);
    assert_eq!(read(&document).positions()[3], DVec3::Z);
    document["accessors"][0].as_object_mut().unwrap().remove("bufferView");
    document["accessors"][0]["sparse"] = sparse(4, 0);
    assert_eq!(read(&document), read(&square()));
    document["accessors"][0]["count"] = json!(3);
    assert!(said_of(&document).contains("accessors[0].sparse: replaces value 3"));
}

#[test]
fn without_scenes_or_nodes_the_meshes_count() {
    let mut document = square();
    document.as_object_mut().unwrap().remove("scenes");
    document["nodes"] = json!([{ "mesh": 0 }, { "children": [0], "translation": [0, 0, 3] }]);
    assert_eq!(read(&document).positions()[0], DVec3::new(0.0, 0.0, 3.0));
    document.as_object_mut().unwrap().remove("nodes");
    assert_eq!(read(&document), read(&square()));
}

#[test]
fn nodes_must_form_a_tree() {
    for nodes in [
        json!([{ "mesh": 0, "children": [0] }]),
        json!([{ "children": [1] }, { "mesh": 0, "children": [0] }]),
        json!([{ "children": [1, 1] }, { "mesh": 0 }]),
    ] {
        assert!(said_of(&with("/nodes", nodes)).contains("is reached twice"));
    }
    assert!(
        said_of(&with("/nodes/0/children", json!([7]))).contains("nodes[7]: is named, but the file has 1")
    );
    let mut all_cyclic = with("/nodes/0/children", json!([0]));
    all_cyclic.as_object_mut().unwrap().remove("scenes");
    assert!(said_of(&all_cyclic).contains("no triangle"));
}

#[test]
fn a_chain_of_nodes_deeper_than_the_stack_is_read() {
    let depth = 100_000;
    let mut nodes: Vec<_> = (1..depth).map(|child| json!({ "children": [child] })).collect();
    nodes.push(json!({ "mesh": 0 }));
    assert_eq!(read(&with("/nodes", json!(nodes))), read(&square()));
}

#[test]
fn complaints_name_the_entry() {
    let said = |path: &str, value: Value| said_of(&with(path, value));
    assert!(said("/accessors/0/count", json!(5)).contains("accessors[0]: has 5 values"));
    assert!(said("/accessors/0/count", json!(-1)).contains("accessors[0]: invalid value"));
    assert!(said("/accessors/0/byteOffset", json!(u64::MAX)).contains("accessors[0]: has 4 values"));
    assert!(said("/accessors/0/type", json!("VEC2")).contains("accessors[0]: is of type VEC2"));
    assert!(said("/accessors/1/componentType", json!(5126)).contains("accessors[1]: indices"));
    assert!(said("/accessors/1/componentType", json!(7)).contains("componentType 7"));
    assert!(said("/accessors/1/count", json!(5)).contains("meshes[0].primitives[0]: has 5 indices"));
    assert!(said("/bufferViews/0/byteStride", json!(2)).contains("sets them 2 apart"));
    assert!(
        said("/bufferViews/1/byteOffset", json!(49)).contains("bufferViews[1]: takes 12 bytes from byte 49")
    );
    assert!(said("/bufferViews/1/byteOffset", json!(42)).contains("names vertex"));
    assert!(said("/bufferViews/0/extensions", json!({ "EXT_meshopt_compression": {} })).contains("meshopt"));
    assert!(said("/buffers/0/byteLength", json!(61)).contains("buffers[0]: is to have 61 bytes, but 60"));
    assert!(said("/buffers/0/uri", json!("data:;base64,!!")).contains("base64"));
    assert!(said("/buffers/0/uri", json!("data:text/plain,abc")).contains("not base64"));
    assert!(said("/buffers/0", json!({ "byteLength": 60 })).contains("neither a uri"));
    assert!(said("/meshes/0/primitives/0/attributes", json!({})).contains("has no POSITION"));
    assert!(said("/meshes/0/primitives/0/mode", json!(0)).contains("1 primitives of points or lines"));
    let vast = json!([1e200, 1e200, 1e200]);
    let nested = json!([{ "scale": vast, "children": [1] }, { "scale": vast, "mesh": 0 }]);
    assert!(said("/nodes", nested).contains("nodes[1]: has a transform that is not finite"));
    assert!(said("/nodes/0/mesh", json!(3)).contains("meshes[3]"));
    assert!(said("/asset/version", json!("1.0")).contains("asset.version: is `1.0`"));
    assert!(said("/asset", json!(null)).contains("asset"));
    assert!(
        said("/extensionsRequired", json!(["KHR_draco_mesh_compression"]))
            .contains("KHR_draco_mesh_compression")
    );
    let mut lost = square();
    lost["accessors"][0].as_object_mut().unwrap().remove("bufferView");
    assert!(said_of(&lost).contains("has no bufferView"));
    let mut bytes = square_bytes();
    bytes[12..16].copy_from_slice(&f32::NAN.to_le_bytes());
    let not_a_number = with("/buffers/0/uri", json!(data_uri(&bytes)));
    assert!(said_of(&not_a_number).contains("accessors[0]: position 1 is [NaN, 0, 0]"));
}

#[test]
fn repetition_without_end_is_refused() {
    let nodes: Vec<_> = (0..40_000).map(|i| json!({ "mesh": 0, "translation": [i, 0, 0] })).collect();
    let roots: Vec<_> = (0..nodes.len()).collect();
    let mut instances = with("/nodes", json!(nodes));
    instances["scenes"][0]["nodes"] = json!(roots);
    // Each node pays for a copy with bytes of its own.
    assert_eq!(read(&instances).triangles().len(), 80_000);
    let primitive = json!({ "attributes": { "POSITION": 0 }, "indices": 1 });
    instances["meshes"][0]["primitives"] = json!(vec![primitive; 40_000]);
    let error = said_of(&instances);
    assert!(error.contains("vertices and indices") || error.contains("too often"), "{error}");
    let long = json!({ "name": "x".repeat(1_000_000), "primitives": [] });
    instances["meshes"] = json!([long]);
    assert!(said_of(&instances).contains("meshes[0]: is named too often"));
    let zeros = json!({
        "count": 0,
        "indices": { "bufferView": 1, "componentType": 5123 },
        "values": { "bufferView": 0 },
    });
    let huge = json!({ "componentType": 5126, "count": 1u64 << 40, "type": "VEC3", "sparse": zeros });
    assert!(said_of(&with("/accessors/0", huge)).contains("too many for"));
}

#[test]
fn containers_are_checked() {
    let whole = square_glb();
    for end in 0..whole.len() {
        assert!(parse_mesh(&whole[..end], MeshFormat::Gltf).is_err(), "{end}");
    }
    let mut followed = whole.clone();
    followed.extend(b"trailing");
    assert_eq!(mesh(&followed), mesh(&whole));
    let mut old = whole.clone();
    old[4] = 1;
    assert!(complaint(&old).contains("version 1"));
    assert!(complaint(b"glTF\x02\0\0\0\x0c\0\0\0").contains("JSON chunk"));
    assert!(complaint(b"glTF\x02\0\0\0\x02\0\0\0").contains("length"));
    for garbage in ["", "[]", "null", "{}", "{\"asset\":3}", "\0\0\0\0", &"[".repeat(100_000)] {
        assert!(parse_mesh(garbage.as_bytes(), MeshFormat::Gltf).is_err());
    }
}

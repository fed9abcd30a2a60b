use std::fs;
use std::path::Path;

use super::{Collection, CollectionError};
use crate::formats::{Sha256, write_glb};

const OBJ: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
const POINTS: &str = r#"{"a": [0, 0, 0], "b": [1, 0, 0], "c": null}"#;

/// A folder with these files.
fn folder(files: &[(&str, &str)]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, content) in files {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, content).unwrap();
    }
    folder
}

fn names(collection: &Collection) -> Vec<&str> {
    collection.members().iter().map(|member| member.name.as_str()).collect()
}

fn refusal(files: &[(&str, &str)]) -> CollectionError {
    Collection::open(folder(files).path()).unwrap_err()
}

#[test]
fn both_ways_to_lay_a_folder_out_are_read() {
    let folder = folder(&[
        ("zoe/scan.obj", OBJ),
        ("zoe/face.obj", "not read"),
        ("zoe/landmarks.json", POINTS),
        ("amy.ann.obj", OBJ),
        ("amy.ann.landmarks.json", r#"{"b": [1, 0, 0], "a": [0, 0, 0]}"#),
        ("only/head.OBJ", OBJ),
        ("only/landmarks.json", POINTS),
        ("notes/readme.txt", "no mesh here"),
        (".cache/scan.obj", "hidden"),
        ("LICENSE.txt", "no mesh"),
    ]);
    let collection = Collection::open(folder.path()).unwrap();
    assert_eq!(names(&collection), ["amy.ann", "only", "zoe"]);
    assert_eq!(collection.common_landmarks(), ["b", "a"]);
    assert_eq!(collection.scheme(), None);
    let scan = collection.members()[2].read().unwrap();
    assert_eq!(scan.mesh.triangles(), [[0, 1, 2]]);
    let digests: Vec<_> = scan.inputs.iter().map(|input| (input.path.clone(), input.sha256)).collect();
    let file = |name: &str, content: &str| (folder.path().join(name), Sha256::of(content.as_bytes()));
    assert_eq!(digests, [file("zoe/scan.obj", OBJ), file("zoe/landmarks.json", POINTS)]);
}

#[test]
fn a_manifest_is_read_from_its_own_folder() {
    let manifest = r#"{"scans": [
        {"name": "two", "mesh": "meshes/t.obj", "landmarks": "marks/t.json"},
        {"name": "one", "mesh": "meshes/o.obj", "landmarks": "marks/t.json"}]}"#;
    let folder = folder(&[
        ("all.json", manifest),
        ("meshes/t.obj", OBJ),
        ("meshes/o.obj", OBJ),
        ("marks/t.json", POINTS),
    ]);
    let collection = Collection::open(folder.path().join("all.json")).unwrap();
    assert_eq!(names(&collection), ["one", "two"]);
    assert!(collection.members()[1].mesh.ends_with("meshes/t.obj"));
}

#[test]
fn inputs_name_what_a_gltf_names() {
    let mesh = crate::formats::parse_mesh(OBJ.as_bytes(), crate::formats::MeshFormat::Obj).unwrap();
    let folder = folder(&[("x.landmarks.json", POINTS)]);
    write_glb(folder.path().join("x.glb"), &crate::formats::Glb::new(&mesh)).unwrap();
    let glb = fs::read(folder.path().join("x.glb")).unwrap();
    let json_end = 20 + u32::from_le_bytes(glb[12..16].try_into().unwrap()) as usize;
    let json = String::from_utf8(glb[20..json_end].to_vec()).unwrap();
    fs::write(folder.path().join("x.bin"), &glb[json_end + 8..]).unwrap();
    fs::write(
        folder.path().join("x.gltf"),
        json.replace(r#"{"byteLength""#, r#"{"uri":"x.bin","byteLength""#),
    )
    .unwrap();
    fs::remove_file(folder.path().join("x.glb")).unwrap();
    let scan = Collection::open(folder.path()).unwrap().members()[0].read();
    let inputs = scan.unwrap().inputs;
    let files: Vec<_> =
        inputs.iter().map(|input| input.path.file_name().unwrap().to_str().unwrap()).collect();
    assert_eq!(files, ["x.gltf", "x.bin", "x.landmarks.json"]);
}

#[test]
fn complaints_name_scan_and_file() {
    assert!(matches!(refusal(&[]), CollectionError::Empty { .. }));
    assert!(matches!(refusal(&[("notes.txt", "")]), CollectionError::Empty { .. }));
    let missing = refusal(&[("a.obj", OBJ)]);
    assert!(matches!(&missing, CollectionError::MissingLandmarks { name, expected }
        if name == "a" && expected.ends_with("a.landmarks.json")));
    let missing = refusal(&[("a/scan.obj", OBJ)]).to_string();
    assert!(missing.contains("scan `a` has no landmarks") && missing.contains("landmarks.json"), "{missing}");
    let several = refusal(&[("a/x.obj", OBJ), ("a/y.obj", OBJ), ("a/landmarks.json", POINTS)]);
    assert!(several.to_string().contains("several meshes (x.obj, y.obj)"), "{several}");
    let several = refusal(&[("a/scan.ply", ""), ("a/scan.obj", OBJ), ("a/z.obj", OBJ)]);
    assert!(several.to_string().contains("(scan.obj, scan.ply)"), "{several}");
    let twice = refusal(&[
        ("a.obj", OBJ),
        ("a.landmarks.json", POINTS),
        ("a/scan.obj", OBJ),
        ("a/landmarks.json", POINTS),
    ]);
    assert!(matches!(twice, CollectionError::DuplicateName { name, .. } if name == "a"));
    let malformed = refusal(&[("a.obj", OBJ), ("a.landmarks.json", r#"{"tip": [1, 2]}"#)]).to_string();
    assert!(
        malformed.contains("scan `a`") && malformed.contains("a.landmarks.json: landmark `tip`"),
        "{malformed}"
    );
    assert!(matches!(Collection::open(Path::new("no such folder")), Err(CollectionError::Unreadable { .. })));
}

#[test]
fn a_mesh_that_cannot_be_read_is_found_when_it_is_read() {
    let folder = folder(&[("a.obj", "f 1 2 3"), ("a.landmarks.json", POINTS)]);
    let error = Collection::open(folder.path()).unwrap().members()[0].read().unwrap_err().to_string();
    assert!(error.contains("scan `a`") && error.contains("a.obj: line 1"), "{error}");
}

#[test]
fn landmarks_must_meet() {
    let marks = |a: &'static str, b: &'static str| {
        refusal(&[("a.obj", OBJ), ("a.landmarks.json", a), ("b.obj", OBJ), ("b.landmarks.json", b)])
            .to_string()
    };
    let apart = marks(POINTS, r#"{"c": [1, 2, 3], "d": [1, 2, 3]}"#);
    assert!(apart.contains("`b` has `c`, `d`, none of which all scans before it have (`a`, `b`)"), "{apart}");
    let schemes = marks(r#"{"scheme": "own", "a": [0, 0, 0]}"#, r#"{"scheme": "ibug68", "1": [0, 0, 0]}"#);
    assert!(schemes.contains("`own`") && schemes.contains("`multipie68`"), "{schemes}");
    let alias = folder(&[
        ("a.obj", OBJ),
        ("a.landmarks.json", r#"{"scheme": "multipie68", "1": [0, 0, 0]}"#),
        ("b.obj", OBJ),
        ("b.landmarks.json", r#"{"scheme": "ibug68", "1": [0, 0, 0]}"#),
    ]);
    assert_eq!(Collection::open(alias.path()).unwrap().scheme(), Some("multipie68"));
}

#[test]
fn manifests_are_checked() {
    let open = |manifest: &str| {
        let folder = folder(&[("m.json", manifest), ("a.obj", OBJ), ("a.json", POINTS)]);
        Collection::open(folder.path().join("m.json"))
    };
    let scan = |name: &str| format!(r#"{{"name": "{name}", "mesh": "a.obj", "landmarks": "a.json"}}"#);
    assert!(open(&format!(r#"{{"scans": [{}]}}"#, scan("a"))).is_ok());
    assert!(
        matches!(open("{}"), Err(CollectionError::Manifest { problem, .. }) if problem.contains("scans"))
    );
    let missing = open(r#"{"scans": [{"name": "a", "mesh": "a.obj"}]}"#).unwrap_err().to_string();
    assert!(missing.contains("missing field `landmarks`"), "{missing}");
    assert!(matches!(open(r#"{"scans": []}"#), Err(CollectionError::Empty { .. })));
    let lost = open(r#"{"scans": [{"name": "a", "mesh": "b.obj", "landmarks": "a.json"}]}"#);
    assert!(matches!(lost, Err(CollectionError::MissingMesh { .. })));
    for name in ["", "..", "../a", "a\\\\b", "a:b", ".a", "a\\u0000"] {
        let result = open(&format!(r#"{{"scans": [{}]}}"#, scan(name)));
        assert!(matches!(result, Err(CollectionError::BadName { .. })), "{name}");
    }
    let twice = open(&format!(r#"{{"scans": [{}, {}]}}"#, scan("a"), scan("a")));
    assert!(matches!(twice, Err(CollectionError::DuplicateName { .. })));
}

#[test]
fn landmarks_of_every_kind_are_found() {
    let picked = r#"<PickedPoints><point name="a" x="0" y="0" z="0"/></PickedPoints>"#;
    let markups = r#"{"markups": [{"controlPoints": [{"label": "a", "position": [0, 0, 0]}]}]}"#;
    let folder = folder(&[
        ("amy.obj", OBJ),
        ("amy.landmarks.pp", picked),
        ("bob/scan.obj", OBJ),
        ("bob/landmarks.mrk.json", markups),
        ("cleo.stl", "solid\nfacet\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendfacet\nendsolid\n"),
        ("cleo.landmarks.ljson", r#"{"landmarks": {"a": [0, 0, 0]}}"#),
    ]);
    let collection = Collection::open(folder.path()).unwrap();
    assert_eq!(names(&collection), ["amy", "bob", "cleo"]);
    assert_eq!(collection.common_landmarks(), ["a"]);
    let several =
        refusal(&[("a.obj", OBJ), ("a.landmarks.json", POINTS), ("a.landmarks.txt", "0")]).to_string();
    assert!(
        several.contains("`a` has several files of landmarks (a.landmarks.json, a.landmarks.txt)"),
        "{several}"
    );
}

#[test]
fn vertex_landmarks_are_resolved_with_the_mesh() {
    let folder = folder(&[
        ("a.obj", OBJ),
        ("a.landmarks.txt", "2\n1\n"),
        ("b.obj", OBJ),
        ("b.landmarks.txt", "0\n7\n"),
    ]);
    let collection = Collection::open(folder.path()).unwrap();
    let scan = collection.members()[0].read().unwrap();
    assert_eq!(scan.landmarks.get("0"), Some(glam::DVec3::Y));
    let error = collection.members()[1].read().unwrap_err().to_string();
    assert!(
        error.contains("scan `b`") && error.contains("b.landmarks.txt: line 2: names vertex 7"),
        "{error}"
    );
}

#[test]
fn a_manifest_states_schemes() {
    let list = |count: usize| format!("[{}]", vec!["[0, 0, 0]"; count].join(","));
    let manifest = r#"{"scheme": "ibug68", "scans": [
        {"name": "a", "mesh": "a.obj", "landmarks": "68.json"},
        {"name": "b", "mesh": "a.obj", "landmarks": "51.json", "scheme": "ibug51"}]}"#;
    let folder =
        folder(&[("m.json", manifest), ("a.obj", OBJ), ("68.json", &list(68)), ("51.json", &list(51))]);
    let collection = Collection::open(folder.path().join("m.json")).unwrap();
    assert_eq!((collection.common_landmarks().len(), collection.scheme()), (51, Some("multipie68")));
    std::fs::write(folder.path().join("51.json"), list(50)).unwrap();
    let error = Collection::open(folder.path().join("m.json")).unwrap_err().to_string();
    assert!(error.contains("51.json: the landmarks: are 50, but multipie51 has 51"), "{error}");
}

#[test]
fn a_mask_is_found_beside_its_scan() {
    let manifest = r#"{"scans": [{"name": "one", "mesh": "amy.obj", "landmarks": "amy.landmarks.json",
        "mask": "masks/one.json"}]}"#;
    let files = [
        ("amy.obj", OBJ),
        ("amy.landmarks.json", POINTS),
        ("amy.mask.json", "[1, 0.5, 0]"),
        ("zoe/scan.obj", OBJ),
        ("zoe/landmarks.json", POINTS),
        ("zoe/mask.json", r#"{"spheres": [{"landmark": "b", "radius": 0.1}]}"#),
        ("bob.obj", OBJ),
        ("bob.landmarks.json", POINTS),
        ("masks/one.json", "[0, 0, 1]"),
        ("masks/all.json", manifest),
    ];
    let folder = folder(&files);
    let masks = |path: &Path| -> Vec<_> {
        let collection = Collection::open(path).unwrap();
        collection.members().iter().map(|member| member.read().unwrap().mask).collect()
    };
    assert_eq!(masks(folder.path()), [Some(vec![1.0, 0.5, 0.0]), None, Some(vec![1.0, 0.0, 1.0])]);
    let scan = Collection::open(folder.path()).unwrap().members()[0].read().unwrap();
    assert_eq!(scan.inputs[2].path, folder.path().join("amy.mask.json"));
    fs::write(folder.path().join("all.json"), manifest).unwrap();
    assert_eq!(masks(&folder.path().join("all.json")), [Some(vec![0.0, 0.0, 1.0])]);
    fs::remove_file(folder.path().join("masks/one.json")).unwrap();
    let missing = Collection::open(folder.path().join("all.json")).unwrap_err().to_string();
    assert!(missing.contains("one.json does not exist"), "{missing}");
    fs::write(folder.path().join("amy.mask.json"), "[1]").unwrap();
    let wrong = Collection::open(folder.path()).unwrap().members()[0].read().unwrap_err().to_string();
    assert!(wrong.contains("`amy`") && wrong.contains("amy.mask.json") && wrong.contains("are 1"), "{wrong}");
    fs::write(folder.path().join("amy.mask.png"), "").unwrap();
    let several = Collection::open(folder.path()).unwrap_err().to_string();
    assert!(several.contains("amy.mask.json, amy.mask.png"), "{several}");
}

//! Memory that readers take for hostile files: a small multiple of the file's size, whatever the file claims.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use onemesh::formats::{MeshFormat, parse_landmarks, parse_mesh};

/// Counts the bytes that this thread holds, and the most that it held.
struct Counting;

thread_local! {
    static HELD: Cell<isize> = const { Cell::new(0) };
    static MOST: Cell<isize> = const { Cell::new(0) };
}

fn count(bytes: isize) {
    let held = HELD.get() + bytes;
    HELD.set(held);
    MOST.set(MOST.get().max(held));
}

// SAFETY: every call is handed on to the system's allocator; counting allocates nothing.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count(layout.size() as isize);
        // SAFETY: as this function's own contract.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        count(-(layout.size() as isize));
        // SAFETY: as this function's own contract.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// The most bytes held at once while `read` runs, for each byte of `file`.
fn bytes_per_byte(file: &[u8], read: impl FnOnce(&[u8])) -> f64 {
    let before = HELD.get();
    MOST.set(before);
    read(file);
    (MOST.get() - before) as f64 / file.len() as f64
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
    for line in ["f 1 1 1 1 1 1 1 1 1 1\n", "v 0 0 0\n", "f\n", "f 1 1 1\n", "\\\n"] {
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
fn gltf_stays_small() {
    let document = |rest: &str| format!(r#"{{"asset":{{"version":"2.0"}},{rest}}}"#);
    let list = |entry: &str| vec![entry; LARGE / (entry.len() + 1)].join(",");
    for key in ["nodes", "meshes", "accessors", "bufferViews", "buffers", "scenes"] {
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
}

#[test]
fn landmarks_stay_small() {
    for entry in ["null", "[1,2,3]", "{\"name\":\"a\"}", "[]"] {
        let list = vec![entry; LARGE / (entry.len() + 1)].join(",");
        for file in [format!("[{list}]"), format!("{{\"points\":[{list}]}}")] {
            let ratio = bytes_per_byte(file.as_bytes(), |file| drop(parse_landmarks(file)));
            assert!(ratio < LIMIT, "{ratio} bytes for each byte of `{entry}`");
        }
    }
}

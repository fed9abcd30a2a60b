use std::io::{Cursor, Write};

use super::*;
use crate::job::blobs::Blobs;
use crate::job::{DataFolder, Database};

/// A tetrahedron, in centimetres of a head.
const OBJ: &str = "v 0 0 0\nv 20 0 0\nv 0 20 0\nv 0 0 20\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
const LANDMARKS: &str = r#"{"a": [0, 0, 0], "b": [20, 0, 0], "c": [0, 20, 0]}"#;

struct Store {
    folder: DataFolder,
    blobs: Blobs,
    scans: Scans,
    _kept: tempfile::TempDir,
}

async fn store(limits: ScanLimits) -> Store {
    let kept = tempfile::tempdir().unwrap();
    let folder = DataFolder::open(kept.path()).unwrap();
    let database = Database::open(&folder.database()).await.unwrap();
    let blobs = Blobs::open(folder.path()).unwrap();
    let scans = Scans::new(database, blobs.clone(), folder.uploads(), limits, None, 2);
    Store { folder, blobs, scans, _kept: kept }
}

impl Store {
    async fn upload(&self, kind: MeshKind, mesh: impl Into<bytes::Bytes>) -> Result<(Scan, bool), ScanError> {
        let mesh = self.blobs.put_bytes(mesh).await.unwrap();
        let new = NewScan { name: None, kind, mesh, landmarks: None, mask: None, texture: None };
        self.scans.add(new).await
    }
}

fn zipped(files: &[(&str, &[u8])]) -> Vec<u8> {
    let mut writer = zip::ZipWriter::new(Cursor::new(Vec::new()));
    for (name, bytes) in files {
        writer.start_file(*name, zip::write::SimpleFileOptions::default()).unwrap();
        writer.write_all(bytes).unwrap();
    }
    writer.finish().unwrap().into_inner()
}

#[tokio::test]
async fn the_same_bytes_are_the_same_scan() {
    let store = store(ScanLimits::default()).await;
    let (first, new) = store.upload(MeshKind::Obj, OBJ).await.unwrap();
    assert!(new && first.report["triangles"] == 4);
    let (second, new) = store.upload(MeshKind::Obj, OBJ).await.unwrap();
    assert!(!new && first == second);
    assert_eq!(store.scans.list(10, None).await.unwrap(), std::slice::from_ref(&first));
    store.scans.delete(&first.id).await.unwrap();
    assert!(matches!(store.scans.get(&first.id).await, Err(ScanError::NotFound(_))));
}

#[tokio::test]
async fn landmarks_are_looked_at_when_they_come() {
    let store = store(ScanLimits::default()).await;
    let (scan, _) = store.upload(MeshKind::Obj, OBJ).await.unwrap();
    let wrong = store.blobs.put_bytes("[[0, 0]]").await.unwrap();
    let refused = store.scans.set(&scan.id, Part::Landmarks, wrong).await.unwrap_err();
    assert!(matches!(refused, ScanError::Fault(fault) if fault.part() == Part::Landmarks));
    assert_eq!(store.scans.get(&scan.id).await.unwrap(), scan);
    let right = store.blobs.put_bytes(LANDMARKS).await.unwrap();
    let scan = store.scans.set(&scan.id, Part::Landmarks, right).await.unwrap();
    assert_eq!(scan.report["landmarks"]["present"], 3);
    let files = ScanFiles::fetch(&store.blobs, &scan.parts).await.unwrap();
    let read = files.read(store.scans.limits(), &store.folder.uploads()).unwrap();
    assert_eq!(read.into_subject("x".into()).landmarks.present().count(), 3);
}

#[tokio::test]
async fn a_zip_holds_one_mesh_and_what_it_names() {
    let store = store(ScanLimits::default()).await;
    let obj = format!("mtllib a.mtl\n{OBJ}");
    let zip = zipped(&[
        ("in/a.obj", obj.as_bytes()),
        ("in/a.mtl", b"newmtl a\nmap_Kd gone.png\n"),
        ("__MACOSX/in/._a.obj", b"v"),
        ("read me.txt", b"hello"),
    ]);
    let (scan, _) = store.upload(MeshKind::Zip, zip).await.unwrap();
    assert_eq!(scan.report["vertices"], 4);
    let scratch = store.folder.uploads().display().to_string();
    assert!(!scan.report.to_string().contains(&scratch), "{}", scan.report);
    assert_eq!(std::fs::read_dir(store.folder.uploads()).unwrap().count(), 0, "something stays unpacked");
    let two = zipped(&[("a.obj", OBJ.as_bytes()), ("b.obj", OBJ.as_bytes())]);
    assert!(store.upload(MeshKind::Zip, two).await.unwrap_err().to_string().contains("2 meshes"));
}

#[tokio::test]
async fn a_zip_does_not_leave_its_folder_and_does_not_grow() {
    let store = store(ScanLimits { unpacked_bytes: 1000, ..ScanLimits::default() }).await;
    let out = zipped(&[("../../escaped.obj", OBJ.as_bytes())]);
    assert!(store.upload(MeshKind::Zip, out).await.unwrap_err().to_string().contains("0 meshes"));
    assert!(!store.folder.path().join("escaped.obj").exists());
    let bomb = zipped(&[("a.obj", &vec![b'\n'; 100_000])]);
    assert!(bomb.len() < 1000);
    let refused = store.upload(MeshKind::Zip, bomb).await.unwrap_err();
    assert!(matches!(refused, ScanError::Fault(ScanFault::TooLarge { .. })), "{refused}");
    assert!(store.upload(MeshKind::Zip, "PK\x03\x04 and no more").await.is_err());
}

#[tokio::test]
async fn limits_hold() {
    let store = store(ScanLimits { triangles: 3, ..ScanLimits::default() }).await;
    let refused = store.upload(MeshKind::Obj, OBJ).await.unwrap_err().to_string();
    assert!(refused.contains("has 4 triangles; at most 3"), "{refused}");
}

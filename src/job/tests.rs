//! Registrations from their submission to their end, in a data folder of their own.

use std::sync::Arc;
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use super::blobs::Blobs;
use super::event::EventKind;
use super::jobs::{Jobs, Page};
use super::registration::{
    NewMember, NewRegistration, Priority, Registration, ResultFile, Status, TemplateChoice,
};
use super::scan::{MeshKind, NewScan, ScanId, ScanLimits, Scans};
use super::template::Templates;
use super::{DataFolder, Database, JobError, JobSettings};
use crate::demo::{SculptedHead, Sculptor, Settings as Sculpture};
use crate::formats::{Sha256, landmarks_json, ply_bytes};
use crate::pipeline::{Outputs, Package, Settings, Subject, precheck, register, register_to};

/// A service's parts beneath its HTTP.
struct Service {
    folder: tempfile::TempDir,
    database: Database,
    blobs: Blobs,
    scans: Scans,
    jobs: Jobs,
}

impl Service {
    async fn start(settings: JobSettings) -> Self {
        Self::start_in(tempfile::tempdir().unwrap(), settings).await
    }

    async fn start_in(folder: tempfile::TempDir, settings: JobSettings) -> Self {
        let data = Arc::new(DataFolder::open(folder.path()).unwrap());
        let database = Database::open(&data.database()).await.unwrap();
        let blobs = Blobs::open(data.path()).unwrap();
        let limits = ScanLimits::default();
        let scans = Scans::new(database.clone(), blobs.clone(), data.uploads(), limits, None, 1);
        let templates = Templates::new(database.clone(), blobs.clone(), data.uploads(), limits);
        let stores = (scans.clone(), templates);
        let jobs = Jobs::start(data, database.clone(), blobs.clone(), stores, settings).await.unwrap();
        Self { folder, database, blobs, scans, jobs }
    }

    /// Ends it and gives its folder.
    async fn end(self) -> tempfile::TempDir {
        self.jobs.close().await;
        self.database.close().await;
        self.folder
    }

    async fn upload(&self, head: &SculptedHead) -> ScanId {
        self.upload_bytes(&head.name, ply_bytes(&head.mesh), landmarks_json(&head.landmarks).to_string())
            .await
    }

    async fn upload_bytes(&self, name: &str, mesh: Vec<u8>, landmarks: String) -> ScanId {
        let mesh = self.blobs.put_bytes(mesh).await.unwrap();
        let landmarks = Some(self.blobs.put_bytes(landmarks).await.unwrap());
        let name = Some(name.to_owned());
        let new = NewScan { name, kind: MeshKind::Ply, mesh, landmarks, mask: None, texture: None };
        self.scans.add(new).await.unwrap().0.id
    }

    async fn upload_all(&self, heads: &[SculptedHead]) -> Vec<NewMember> {
        let mut members = Vec::new();
        for head in heads {
            members.push(NewMember { scan: self.upload(head).await, name: None });
        }
        members
    }

    async fn ended(&self, registration: &Registration) -> Registration {
        let mut feed = self.jobs.events_after(&registration.id, 0).await.unwrap();
        let all = async { while feed.next().await.unwrap().is_some() {} };
        tokio::time::timeout(Duration::from_secs(120), all).await.expect("the registration ends");
        self.jobs.get(&registration.id).await.unwrap()
    }

    async fn file(&self, registration: &Registration, file: ResultFile) -> Vec<u8> {
        let kept = self.jobs.result(&registration.id, &file).await.unwrap();
        self.blobs.read(kept.digest).await.unwrap().to_vec()
    }

    async fn count(&self, query: &'static str) -> i64 {
        sqlx::query_scalar(query).fetch_one(self.database.reader()).await.unwrap()
    }
}

fn heads(count: usize) -> Vec<SculptedHead> {
    let small = Sculpture { triangles: 3000, ..Sculpture::default() };
    Sculptor::new(7).with(small).collection(count, &[1.0])
}

/// Parameters that make a registration take a second.
fn quick() -> Vec<(&'static str, Value)> {
    vec![
        ("fit.levels.0.iterations", json!(20)),
        ("register.levels.0.iterations", json!(20)),
        ("groupwise.phases", json!(2)),
        ("groupwise.iterations", json!(2)),
        ("transfer.phases", json!(2)),
        ("transfer.iterations", json!(2)),
    ]
}

fn asked(scans: Vec<NewMember>) -> NewRegistration {
    let parameters = quick().into_iter().map(|(name, value)| (name.to_owned(), value)).collect();
    NewRegistration { scans, parameters, vertices: Some(642), ..NewRegistration::default() }
}

fn settings() -> JobSettings {
    JobSettings { threads: 2, keep_free: 0, ..JobSettings::default() }
}

/// The same by the command line's way, into a folder.
fn in_a_row(heads: &[SculptedHead], settings: &Settings, folder: &std::path::Path) {
    let subjects: Vec<Subject> = heads
        .iter()
        .map(|head| Subject {
            name: head.name.clone(),
            mesh: crate::formats::parse_mesh(&ply_bytes(&head.mesh), crate::formats::MeshFormat::Ply)
                .unwrap(),
            landmarks: crate::formats::parse_landmarks(
                landmarks_json(&head.landmarks).to_string().as_bytes(),
            )
            .unwrap(),
            mask: None,
        })
        .collect();
    let registration = register(&subjects, settings, &()).unwrap();
    let inputs: Vec<Vec<crate::formats::InputFile>> = heads
        .iter()
        .map(|head| {
            let file = |name: &str, bytes: &[u8]| crate::formats::InputFile {
                path: std::path::Path::new(&head.name).join(name),
                size: bytes.len() as u64,
                sha256: Sha256::of(bytes),
            };
            let landmarks = landmarks_json(&head.landmarks).to_string();
            vec![file("scan.ply", &ply_bytes(&head.mesh)), file("landmarks.json", landmarks.as_bytes())]
        })
        .collect();
    let package = Package {
        subjects: &subjects,
        inputs: &inputs,
        prechecks: &precheck(&subjects),
        root: std::path::Path::new(""),
        settings,
        registration: &registration,
        outputs: Outputs::GLB,
        failed: &[],
        reading: 0.0,
    };
    package.write(folder).unwrap();
}

fn without_seconds(report: &[u8]) -> Value {
    let mut report: Value = serde_json::from_slice(report).unwrap();
    report.as_object_mut().unwrap().remove("seconds").unwrap();
    report
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_registration_gives_what_the_command_line_gives() {
    let service = Service::start(settings()).await;
    let heads = heads(3);
    let members = service.upload_all(&heads).await;
    for from_head in [true, false] {
        let mut new = asked(members.clone());
        new.parameters.insert("from_head".to_owned(), json!(from_head));
        let submitted = service.jobs.submit(new).await.unwrap();
        assert!(submitted.settings["from_head"] == json!(from_head));
        let ended = service.ended(&submitted).await;
        assert_eq!((ended.status, ended.progress, &ended.problem), (Status::Succeeded, 1.0, &None));
        let names: Vec<&str> = ended.children.iter().map(|child| child.name.as_str()).collect();
        assert_eq!(names, ["head-00", "head-01", "head-02"]);
        let alone = tempfile::tempdir().unwrap();
        let settings = serde_json::from_value(ended.settings.clone()).unwrap();
        in_a_row(&heads, &settings, alone.path());
        let alone = |name: &str| std::fs::read(alone.path().join(name)).unwrap();
        for child in &ended.children {
            assert!(child.status == Status::Succeeded && child.verdict.is_some(), "{child:?}");
            let mesh = service.file(&ended, ResultFile::Mesh(child.scan.clone())).await;
            assert!(mesh == alone(&format!("{}.glb", child.name)), "{}", child.name);
        }
        for file in [ResultFile::Manifest, ResultFile::Template, ResultFile::Sheet] {
            assert!(service.file(&ended, file.clone()).await == alone(&file.path()), "{file:?}");
        }
        let report = service.file(&ended, ResultFile::Report).await;
        assert_eq!(without_seconds(&report), without_seconds(&alone("report.json")));
        let landmarks: Value =
            serde_json::from_slice(&service.file(&ended, ResultFile::Landmarks).await).unwrap();
        assert!(landmarks["scans"]["head-01"]["30"].is_array() && landmarks["audit"]["scans"].is_array());
        assert_eq!(service.jobs.set(&ended.id).await.unwrap().len(), 8);
    }
    // Intermediate results are gone, and every step ran once.
    assert_eq!(service.count("SELECT count(*) FROM step WHERE output IS NOT NULL").await, 0);
    assert_eq!(service.count("SELECT max(runs) FROM step").await, 1);
    let named = service
        .count("SELECT count(*) FROM (SELECT * FROM uploaded_blob UNION SELECT * FROM registered_blob)");
    let named = named.await;
    let kept: Vec<_> = futures_util::StreamExt::collect(service.blobs.list()).await;
    assert_eq!(kept.len() as i64, named);
}

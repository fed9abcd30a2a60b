//! Registrations from their submission to their end, in a data folder of their own.

use std::sync::Arc;
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use super::blobs::Blobs;
use super::event::EventKind;
use super::graph::{self, Changed, Claim, Done};
use super::jobs::{Jobs, Page};
use super::registration::{NewMember, NewRegistration, Registering, Registration, TemplateChoice};
use super::result_file::ResultFile;
use super::scan::{MeshKind, NewScan, ScanId, ScanLimits, Scans};
use super::stage::JobStage;
use super::state::{Priority, Status};
use super::template::Templates;
use super::work::{Decided, Judgement};
use super::{DataFolder, Database, JobError, JobSettings, queue};
use crate::demo::{SculptedHead, Sculptor, Settings as Sculpture};
use crate::formats::{Sha256, landmarks_json, ply_bytes};
use crate::pipeline::{Outputs, Package, Settings, Subject, Verdict, precheck, register, register_to};

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

    /// Has nothing run by itself any more, and forgets how long what ran until now has taken.
    async fn take_over(&self) {
        self.jobs.close().await;
        queue::recover(&self.jobs.engine).await.unwrap();
        sqlx::query("UPDATE job SET turn = 0").execute(self.database.writer()).await.unwrap();
    }

    /// Takes on the next step, by hand.
    async fn claim(&self) -> Claim {
        let mut tx = self.database.begin_write().await.unwrap();
        let claim = graph::claim(&mut tx, &mut Changed::default(), false).await.unwrap().unwrap();
        tx.commit().await.unwrap();
        claim
    }

    /// Ends a step as if it had done its work in so many seconds, each scan being inspected and packaged alone.
    async fn finish(&self, claim: &Claim, seconds: f64) {
        let decided = match claim.stage() {
            JobStage::Plan => {
                let course = [JobStage::Inspect, JobStage::Plan, JobStage::Package, JobStage::Set];
                Decided::Course(course.to_vec(), Vec::new())
            }
            JobStage::Package => Decided::Judgement(Judgement { verdict: Verdict::Pass, residual: None }),
            _ => Decided::Nothing,
        };
        let done = Done { output: None, files: Vec::new(), decided, seconds };
        let mut changed = Changed::default();
        let mut tx = self.database.begin_write().await.unwrap();
        assert!(graph::finish(&mut tx, claim, done, &mut changed).await.unwrap());
        self.jobs.engine.commit(tx, changed).await.unwrap();
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
    let named =
        service.count("SELECT count(*) FROM (SELECT * FROM uploaded_blob UNION SELECT * FROM job_blob)");
    let named = named.await;
    let kept: Vec<_> = futures_util::StreamExt::collect(service.blobs.list()).await;
    assert_eq!(kept.len() as i64, named);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn events_tell_the_whole_history_and_go_on_where_one_left() {
    let service = Service::start(settings()).await;
    let members = service.upload_all(&heads(2)).await;
    let submitted = service.jobs.submit(asked(members)).await.unwrap();
    let mut live = service.jobs.events_after(&submitted.id, 0).await.unwrap();
    let mut seen = Vec::new();
    while let Some(event) = live.next().await.unwrap() {
        seen.push(event);
    }
    assert!(seen.iter().map(|event| event.sequence).eq(1..=seen.len() as u64));
    let statuses = seen.iter().filter_map(|event| match event.kind {
        EventKind::Status { status } => Some(status),
        _ => None,
    });
    let statuses: Vec<Status> = statuses.collect();
    assert_eq!(statuses, [Status::Queued, Status::Running, Status::Succeeded]);
    let stages = seen.iter().filter_map(|event| match &event.kind {
        EventKind::Stage { stage } => Some(stage.as_str()),
        _ => None,
    });
    let stages: Vec<&str> = stages.collect();
    let rounds = ["mean", "round"].repeat(3);
    assert_eq!(stages, [&["inspect", "plan", "lay"], &rounds[..], &["package", "set"]].concat());
    assert_eq!(seen.iter().filter(|event| matches!(event.kind, EventKind::Child { .. })).count(), 2);
    for after in [0, 3, seen.len() as u64, 1000] {
        let mut feed = service.jobs.events_after(&submitted.id, after).await.unwrap();
        let mut again = Vec::new();
        while let Some(event) = feed.next().await.unwrap() {
            again.push(event);
        }
        assert_eq!(again, seen.get(after as usize..).unwrap_or_default());
    }
    assert_eq!(service.jobs.get(&submitted.id).await.unwrap().last_event, seen.len() as u64);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_broken_scan_fails_alone() {
    let service = Service::start(settings()).await;
    let heads = heads(4);
    let mut members = service.upload_all(&heads[..2]).await;
    let strange = json!({ "one": [0.0, 0.0, 0.0], "two": [1.0, 0.0, 0.0], "three": [0.0, 1.0, 0.0] });
    let strange = service.upload_bytes("strange", ply_bytes(&heads[2].mesh), strange.to_string()).await;
    let damaged = service.upload(&heads[3]).await;
    let mesh = service.scans.get(&damaged).await.unwrap().parts.mesh;
    std::fs::write(service.blobs.path(mesh), "nothing of a mesh").unwrap();
    for scan in [&strange, &damaged] {
        members.push(NewMember { scan: scan.clone(), name: None });
    }
    let ended = service.ended(&service.jobs.submit(asked(members)).await.unwrap()).await;
    assert_eq!(ended.status, Status::PartiallySucceeded);
    let child = |scan: &ScanId| ended.children.iter().find(|child| child.scan == *scan).unwrap();
    let problem = |scan: &ScanId| child(scan).problem.clone().unwrap();
    assert_eq!(problem(&strange).code, "too_few_landmarks");
    assert_eq!(problem(&damaged).code, "storage");
    assert!(problem(&damaged).detail.contains("damaged"), "{:?}", problem(&damaged));
    let succeeded = ended.children.iter().filter(|child| child.status == Status::Succeeded);
    assert_eq!(succeeded.count(), 2);
    let report: Value = serde_json::from_slice(&service.file(&ended, ResultFile::Report).await).unwrap();
    assert_eq!(report["failed"].as_array().unwrap().len(), 2);
    assert_eq!(report["scans"].as_array().unwrap().len(), 2);
    let missing = service.jobs.result(&ended.id, &ResultFile::Mesh(strange)).await;
    assert!(matches!(missing, Err(JobError::NotFound(_))));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_scan_that_ends_the_program_again_and_again_fails_alone() {
    let service = Service::start(JobSettings { threads: 1, ..settings() }).await;
    let members = service.upload_all(&heads(3)).await;
    let submitted = service.jobs.submit(asked(members)).await.unwrap();
    let folder = service.end().await;
    // As if the program had ended the tenth time while it inspected the second scan.
    let database = Database::open(&folder.path().join("onemesh.db")).await.unwrap();
    let poison = "UPDATE step SET state = 'running', crashes = 9, runs = 10 WHERE stage = 0 AND place = 1";
    sqlx::query(poison).execute(database.writer()).await.unwrap();
    database.close().await;
    let service = Service::start_in(folder, settings()).await;
    let ended = service.ended(&submitted).await;
    assert_eq!(ended.status, Status::PartiallySucceeded);
    assert_eq!(ended.children[1].problem.as_ref().unwrap().code, "crashed");
    assert!(ended.children[1].problem.as_ref().unwrap().detail.contains("10 times"));
    assert_eq!([0, 2].map(|at| ended.children[at].status), [Status::Succeeded; 2]);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn what_is_canceled_stops_within_a_second() {
    let service = Service::start(settings()).await;
    let members = service.upload_all(&heads(2)).await;
    let mut long = asked(members.clone());
    long.parameters.insert("from_head".to_owned(), json!(false));
    long.parameters.insert("fit.levels.0.iterations".to_owned(), json!(20_000));
    let submitted = service.jobs.submit(long).await.unwrap();
    let mut feed = service.jobs.events_after(&submitted.id, 0).await.unwrap();
    let fits = |kind: &EventKind| matches!(kind, EventKind::Progress { stage, .. } if stage == "fit");
    while !fits(&feed.next().await.unwrap().unwrap().kind) {}
    let running = service.jobs.get(&submitted.id).await.unwrap();
    assert!(running.status == Status::Running && running.progress > 0.0 && running.progress < 1.0);
    let asked_at = Instant::now();
    let canceled = service.jobs.cancel(&submitted.id).await.unwrap();
    assert_eq!((canceled.status, canceled.children[0].status), (Status::Canceled, Status::Canceled));
    while service.jobs.figures().await.unwrap().steps_running > 0 {
        assert!(asked_at.elapsed() < Duration::from_secs(1), "it still runs");
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
    while feed.next().await.unwrap().is_some() {}
    // The next one has the threads, and what was under way is gone.
    let next = service.jobs.submit(asked(members)).await.unwrap();
    assert_eq!(service.ended(&next).await.status, Status::Succeeded);
    assert_eq!(service.jobs.cancel(&next.id).await.unwrap().status, Status::Succeeded);
    service.jobs.delete(&next.id).await.unwrap();
    service.jobs.delete(&submitted.id).await.unwrap();
    assert!(matches!(service.jobs.get(&next.id).await, Err(JobError::NotFound(_))));
    let kept: Vec<_> = futures_util::StreamExt::collect(service.blobs.list()).await;
    assert_eq!(kept.len(), 4, "two scans with their landmarks");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_small_registration_is_not_starved_by_a_large_one_and_priority_goes_first() {
    let service = Service::start(JobSettings { threads: 1, ..settings() }).await;
    let heads = heads(13);
    let members = service.upload_all(&heads).await;
    let large = service.jobs.submit(asked(members[..12].to_vec())).await.unwrap();
    let small = service.jobs.submit(asked(members[12..].to_vec())).await.unwrap();
    let low = NewRegistration { priority: Priority::Low, ..asked(members[12..].to_vec()) };
    let low = service.jobs.submit(low).await.unwrap();
    assert_eq!(service.ended(&small).await.status, Status::Succeeded);
    let [large_then, low_then] = [&large, &low].map(|one| service.jobs.get(&one.id));
    let (large_then, low_then) = (large_then.await.unwrap(), low_then.await.unwrap());
    assert!(large_then.status == Status::Running && large_then.progress < 0.6, "{}", large_then.progress);
    assert_eq!((low_then.status, low_then.queue_position), (Status::Queued, Some(0)));
    assert_eq!(service.ended(&large).await.status, Status::Succeeded);
    assert_ne!(service.jobs.get(&low.id).await.unwrap().status, Status::Succeeded);
    assert_eq!(service.ended(&low).await.status, Status::Succeeded);
    let latest = service.jobs.list(Page::<Registering> { limit: 2, ..Page::default() }).await.unwrap();
    assert_eq!(latest.iter().map(|one| &one.id).collect::<Vec<_>>(), [&low.id, &small.id]);
    let before = Page { limit: 9, before: Some(small.id.clone()), ..Page::default() };
    assert_eq!(service.jobs.list(before).await.unwrap().len(), 1);
}

#[tokio::test]
async fn registrations_share_the_time_whatever_their_steps_take() {
    let service = Service::start(JobSettings { threads: 1, ..settings() }).await;
    let members = service.upload_all(&heads(13)).await;
    let large = service.jobs.submit(asked(members[..12].to_vec())).await.unwrap();
    let small = service.jobs.submit(asked(members[12..].to_vec())).await.unwrap();
    service.take_over().await;
    let (mut of_large, mut of_small) = (0.0, 0.0);
    while service.jobs.get(&small.id).await.unwrap().status != Status::Succeeded {
        let claim = service.claim().await;
        let (spent, seconds) =
            if claim.id == small.id.as_str() { (&mut of_small, 1.0) } else { (&mut of_large, 3.0) };
        *spent += seconds;
        service.finish(&claim, seconds).await;
        assert!(f64::abs(of_large - of_small) <= 3.0, "{of_large} s to {of_small} s");
    }
    assert_eq!(service.jobs.get(&large.id).await.unwrap().status, Status::Running);
    // One that is asked for while a step runs begins where the others stand.
    let held = service.claim().await;
    let late = service.jobs.submit(asked(members[12..].to_vec())).await.unwrap();
    service.finish(&held, 0.1).await;
    let next = service.claim().await;
    assert_eq!(next.id, late.id.as_str());
    service.finish(&next, 3.0).await;
    while service.jobs.get(&large.id).await.unwrap().status != Status::Succeeded {
        let claim = service.claim().await;
        service.finish(&claim, 3.0).await;
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn work_goes_on_where_it_was_left_and_makes_damaged_results_again() {
    let service = Service::start(JobSettings { threads: 1, ..settings() }).await;
    let members = service.upload_all(&heads(3)).await;
    let undisturbed = service.ended(&service.jobs.submit(asked(members.clone())).await.unwrap()).await;
    let expected = service.file(&undisturbed, ResultFile::Manifest).await;
    let submitted = service.jobs.submit(asked(members)).await.unwrap();
    let mut feed = service.jobs.events_after(&submitted.id, 0).await.unwrap();
    let laid = |kind: &EventKind| matches!(kind, EventKind::Stage { stage } if stage == "round");
    while !laid(&feed.next().await.unwrap().unwrap().kind) {}
    drop(feed);
    let folder = service.end().await;
    let database = Database::open(&folder.path().join("onemesh.db")).await.unwrap();
    let outputs = "SELECT DISTINCT output FROM step WHERE output IS NOT NULL";
    let outputs: Vec<String> = sqlx::query_scalar(outputs).fetch_all(database.reader()).await.unwrap();
    database.close().await;
    assert!(outputs.len() >= 5, "{}", outputs.len());
    for output in outputs {
        let file = folder.path().join("blobs").join(&output[..2]).join(&output);
        let mut bytes = std::fs::read(&file).unwrap();
        bytes[0] ^= 1;
        std::fs::write(&file, bytes).unwrap();
    }
    let service = Service::start_in(folder, settings()).await;
    let ended = service.ended(&submitted).await;
    assert_eq!((ended.status, &ended.problem), (Status::Succeeded, &None));
    assert!(service.file(&ended, ResultFile::Manifest).await == expected);
    assert_eq!(service.count("SELECT max(crashes) FROM step").await, 0);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn later_scans_are_registered_to_what_is_frozen() {
    let service = Service::start(settings()).await;
    let heads = heads(3);
    let members = service.upload_all(&heads).await;
    let first = service.jobs.submit(asked(members[..2].to_vec())).await.unwrap();
    let early = service.jobs.add_scans(&first.id, members[2..].to_vec(), None, None).await;
    assert!(matches!(early, Err(JobError::Conflict(_))), "{early:?}");
    let first = service.ended(&first).await;
    let add = || service.jobs.add_scans(&first.id, members[2..].to_vec(), None, Some("key".into()));
    let later = add().await.unwrap();
    assert_eq!(add().await.unwrap().id, later.id, "asked for again with the same key it is the same");
    assert_eq!(later.template, TemplateChoice::Of(first.id.clone()));
    let later = service.ended(&later).await;
    assert_eq!((later.status, &later.settings), (Status::Succeeded, &first.settings));
    let frozen = service.file(&first, ResultFile::Template).await;
    let frozen = crate::pipeline::FrozenCollection::parse(&frozen).unwrap().unwrap();
    let head = &heads[2];
    let subject = Subject {
        name: head.name.clone(),
        mesh: crate::formats::parse_mesh(&ply_bytes(&head.mesh), crate::formats::MeshFormat::Ply).unwrap(),
        landmarks: head.landmarks.clone(),
        mask: None,
    };
    let expected = register_to(&frozen.template, &[subject], &frozen.settings, &()).unwrap();
    let mesh = service.file(&later, ResultFile::Mesh(members[2].scan.clone())).await;
    let mesh = crate::formats::parse_mesh(&mesh, crate::formats::MeshFormat::Gltf).unwrap();
    let farthest = mesh.positions().iter().zip(&expected.members[0]).map(|(a, b)| a.distance(*b));
    assert!(farthest.fold(0.0, f64::max) < 1e-4);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_full_disk_pauses_the_work_until_there_is_room() {
    let service = Service::start(JobSettings { keep_free: u64::MAX, ..settings() }).await;
    let members = service.upload_all(&heads(1)).await;
    while service.jobs.paused().is_none() {
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    let refused = service.jobs.submit(asked(members.clone())).await;
    assert!(matches!(&refused, Err(JobError::Unavailable(why)) if why.contains("free")), "{refused:?}");
    let folder = service.end().await;
    let service = Service::start_in(folder, settings()).await;
    let submitted = service.jobs.submit(asked(members)).await.unwrap();
    assert_eq!(service.ended(&submitted).await.status, Status::Succeeded);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn what_is_asked_for_wrongly_is_refused_by_its_field() {
    let service = Service::start(JobSettings { jobs_per_owner: 0, scans: 2, ..settings() }).await;
    let members = service.upload_all(&heads(3)).await;
    let bare = service.blobs.put_bytes(ply_bytes(&heads(1)[0].mesh)).await.unwrap();
    let bare = NewScan {
        name: Some("bare".into()),
        kind: MeshKind::Ply,
        mesh: bare,
        landmarks: None,
        mask: None,
        texture: None,
    };
    let bare = service.scans.add(bare).await.unwrap().0.id;
    let refused = async |change: &dyn Fn(&mut NewRegistration)| {
        let mut new = asked(members[..2].to_vec());
        change(&mut new);
        match service.jobs.submit(new).await {
            Err(JobError::Invalid { field, problem }) => format!("{field}: {problem}"),
            other => format!("{other:?}"),
        }
    };
    type Change<'a> = dyn Fn(&mut NewRegistration) + 'a;
    let cases: [(&str, &Change); 9] = [
        ("scans: are 0", &|new| new.scans.clear()),
        ("scans: are 3", &|new| new.scans = members.clone()),
        ("scans[0]: scan", &|new| new.scans[0].scan = bare.clone()),
        ("scans[1]: \"a/b\"", &|new| new.scans[1].name = Some("a/b".into())),
        ("scans: two are called", &|new| new.scans[1].name = Some("head-00".into())),
        ("scans: scan", &|new| new.scans[1] = NewMember { name: Some("x".into()), ..new.scans[0].clone() }),
        ("parameters.groupwise.nothing", &|new| {
            new.parameters.insert("groupwise.nothing".into(), json!(1));
        }),
        ("landmark_weights.30", &|new| {
            new.landmark_weights.insert("30".into(), -1.0);
        }),
        ("vertices", &|new| new.vertices = Some(7)),
    ];
    for (expected, change) in cases {
        let said = refused(change).await;
        assert!(said.starts_with(expected), "{said}");
    }
    let too_many = service.jobs.submit(asked(members[..1].to_vec())).await;
    assert!(matches!(too_many, Err(JobError::TooMany(_))));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_same_key_asks_once_and_what_is_over_goes() {
    let service = Service::start(JobSettings { keep: Some(Duration::ZERO), ..settings() }).await;
    let members = service.upload_all(&heads(1)).await;
    let keyed = NewRegistration { dedupe_key: Some("k".into()), ..asked(members) };
    let (first, second) = tokio::join!(service.jobs.submit(keyed.clone()), service.jobs.submit(keyed));
    let first = first.unwrap();
    assert_eq!(first.id, second.unwrap().id);
    assert!(service.ended(&first).await.expires_at.is_some());
    tokio::time::sleep(Duration::from_millis(5)).await;
    service.jobs.expire().await.unwrap();
    assert!(matches!(service.jobs.get(&first.id).await, Err(JobError::NotFound(_))));
    let kept: Vec<_> = futures_util::StreamExt::collect(service.blobs.list()).await;
    assert_eq!(kept.len(), 2, "the scan and its landmarks");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn what_takes_too_long_is_stopped_and_says_so() {
    let service = Service::start(JobSettings { step_time: Duration::from_millis(300), ..settings() }).await;
    let members = service.upload_all(&heads(1)).await;
    let mut long = asked(members.clone());
    long.parameters.insert("from_head".to_owned(), json!(false));
    long.parameters.insert("fit.levels.0.iterations".to_owned(), json!(20_000));
    let ended = service.ended(&service.jobs.submit(long).await.unwrap()).await;
    assert_eq!(ended.status, Status::Failed);
    assert_eq!(ended.children[0].problem.as_ref().unwrap().code, "too_slow");
    assert_eq!(ended.problem.as_ref().unwrap().code, "no_scan_left");
    let folder = service.end().await;
    let service = Service::start_in(folder, JobSettings { job_time: Duration::ZERO, ..settings() }).await;
    let ended = service.ended(&service.jobs.submit(asked(members)).await.unwrap()).await;
    assert_eq!((ended.status, ended.problem.unwrap().code.as_str()), (Status::Failed, "too_slow"));
}

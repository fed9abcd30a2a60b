use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::{Context, ensure};
use onemesh::demo::SculptedHead;
use onemesh::formats::{landmarks_json, ply_bytes};
use onemesh::http::App;
use onemesh::job::blobs::Blobs;
use onemesh::job::registration::{NewMember, NewRegistration, RegistrationId};
use onemesh::job::scan::{MeshKind, NewScan, ScanLimits, Scans};
use onemesh::job::state::Status;
use onemesh::job::template::Templates;
use onemesh::job::{DataFolder, Database, JobSettings, Jobs};
use serde_json::json;

use super::clock::row;
use super::{memory, sculpt};

/// Registrations between two looks at the memory.
const ROUND: usize = 50;

/// The service without its HTTP.
pub struct Bed {
    blobs: Blobs,
    scans: Scans,
    /// What is worked on.
    pub jobs: Jobs,
}

/// A sculpted collection through the service's jobs, from the first upload to the end.
pub fn collection(count: usize, triangles: usize) -> anyhow::Result<()> {
    let heads = sculpt(count, triangles);
    in_service(async |bed: &Bed| {
        memory::forget_peak();
        let start = Instant::now();
        let members = bed.upload(&heads).await?;
        bed.register(NewRegistration { scans: members, ..NewRegistration::default() }).await?;
        let peak =
            memory::peak().map_or("memory unknown".to_owned(), |peak| format!("{peak:.0} MiB at most"));
        let name =
            format!("{count} scans as jobs of the service, upload to results, 10242 vertices ({peak})");
        row(&name, &[start.elapsed()]);
        for (stage, (steps, seconds)) in bed.jobs.figures().await?.stages {
            row(&format!("- of it {stage}, {steps} steps"), &[Duration::from_secs_f64(seconds)]);
        }
        Ok(())
    })
}

/// So many small registrations one after another; the memory in between, which is to stay.
pub fn soak(registrations: usize) -> anyhow::Result<()> {
    let heads = sculpt(2, 4000);
    in_service(async |bed: &Bed| {
        let members = bed.upload(&heads).await?;
        let mut done = 0;
        while done < registrations {
            let start = Instant::now();
            let some = ROUND.min(registrations - done);
            for _ in 0..some {
                let parameters = [("groupwise.phases", 2), ("groupwise.iterations", 2)];
                let parameters = parameters.map(|(name, value)| (name.to_owned(), json!(value))).into();
                let scans = members.clone();
                let small =
                    NewRegistration { scans, vertices: Some(642), parameters, ..NewRegistration::default() };
                bed.register(small).await?;
            }
            done += some;
            let resident =
                memory::resident().map_or("memory unknown".to_owned(), |now| format!("{now:.0} MiB"));
            row(
                &format!("after {done} small registrations: {resident}; each"),
                &[start.elapsed() / some as u32],
            );
        }
        Ok(())
    })
}

fn in_service(work: impl AsyncFnOnce(&Bed) -> anyhow::Result<()>) -> anyhow::Result<()> {
    let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build()?;
    runtime.block_on(async {
        let folder = tempfile::tempdir()?;
        let bed = Bed::start(folder.path()).await?;
        let outcome = work(&bed).await;
        bed.jobs.close().await;
        outcome
    })
}

impl Bed {
    /// That of a server.
    pub fn of(app: &App) -> Self {
        Self { blobs: app.blobs.clone(), scans: app.scans.clone(), jobs: app.jobs.clone() }
    }

    async fn start(folder: &Path) -> anyhow::Result<Self> {
        let folder = Arc::new(DataFolder::open(folder)?);
        let database = Database::open(&folder.database()).await?;
        let blobs = Blobs::open(folder.path())?;
        let limits = ScanLimits::default();
        let scans = Scans::new(database.clone(), blobs.clone(), folder.uploads(), limits, None, 2);
        let templates = Templates::new(database.clone(), blobs.clone(), folder.uploads(), limits);
        let settings = JobSettings { keep_free: 0, ..JobSettings::default() };
        let stores = (scans.clone(), templates);
        let jobs = Jobs::start(folder, database, blobs.clone(), stores, settings).await?;
        Ok(Self { blobs, scans, jobs })
    }

    /// Uploads scans with their landmarks.
    pub async fn upload(&self, heads: &[SculptedHead]) -> anyhow::Result<Vec<NewMember>> {
        let mut members = Vec::new();
        for head in heads {
            let mesh = self.blobs.put_bytes(ply_bytes(&head.mesh)).await?;
            let landmarks = landmarks_json(&head.landmarks).to_string();
            let landmarks = Some(self.blobs.put_bytes(landmarks).await?);
            let name = Some(head.name.clone());
            let new = NewScan { name, kind: MeshKind::Ply, mesh, landmarks, mask: None, texture: None };
            members.push(NewMember { scan: self.scans.add(new).await?.0.id, name: None });
        }
        Ok(members)
    }

    /// Registers, and deletes what came of it.
    async fn register(&self, new: NewRegistration) -> anyhow::Result<()> {
        let id = self.jobs.submit(new).await?.id;
        self.ended(&id).await?;
        self.jobs.delete(&id).await.context("its results")
    }

    /// Waits for a registration's end.
    pub async fn ended(&self, id: &RegistrationId) -> anyhow::Result<()> {
        let mut events = self.jobs.events_after(id, 0).await?;
        while events.next().await?.is_some() {}
        let ended = self.jobs.get(id).await?;
        ensure!(ended.status == Status::Succeeded, "it ended as {}", ended.status.name());
        Ok(())
    }
}

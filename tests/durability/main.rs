//! The server is killed in the middle of its work, again and again: what was acknowledged stays, the work goes on from the
//! steps that were done, and the results are those of a server that nobody disturbed.

#[path = "../common/client.rs"]
mod client;
#[path = "../common/server.rs"]
mod server;

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::time::{Duration, Instant};

use onemesh::demo::{Sculptor, Settings};
use onemesh::formats::{Sha256, landmarks_json, ply_bytes};
use serde_json::{Value, json};
use server::Server;

/// How it is disturbed, and how much there is to do.
struct Trial {
    scans: usize,
    triangles: usize,
    kills: usize,
    parameters: Value,
    vertices: usize,
}

#[test]
fn killed_three_times_a_registration_gives_the_same() {
    let parameters = json!({ "groupwise.phases": 6, "groupwise.iterations": 3 });
    Trial { scans: 3, triangles: 3000, kills: 3, parameters, vertices: 642 }.hold();
}

/// Minutes: `cargo test --release --test durability -- --ignored`.
#[test]
#[ignore = "takes minutes"]
fn killed_twenty_times_twelve_scans_give_the_same() {
    Trial { scans: 12, triangles: 60_000, kills: 20, parameters: json!({}), vertices: 10_242 }.hold();
}

impl Trial {
    fn hold(self) {
        let calm = tempfile::tempdir().unwrap();
        let server = Server::start(calm.path());
        let start = Instant::now();
        let path = self.begin(&server);
        let patience = Duration::from_secs(600);
        let expected = Results::of(&server, &server.ended(&path, patience));
        let needed = start.elapsed();
        server.kill();

        let folder = tempfile::tempdir().unwrap();
        let mut server = Server::start(folder.path());
        let uploads = self.upload(&server);
        let path = self.submit(&server, &uploads);
        for kill in 0..self.kills {
            // Anywhere between the first step and about the last, spread by a fixed rule.
            let share = (kill as f64 * 0.618_034).fract();
            std::thread::sleep(needed.mul_f64(0.05 + 3.0 * share / self.kills as f64));
            server.kill();
            server = Server::start(folder.path());
        }
        for scan in &uploads {
            server.json("GET", &format!("/v1/scans/{scan}"), "", &[]);
        }
        let ended = server.ended(&path, patience);
        assert_eq!(ended["status"], "succeeded", "{ended}");
        let results = Results::of(&server, &ended);
        assert_eq!(results.files.keys().collect::<Vec<_>>(), expected.files.keys().collect::<Vec<_>>());
        for (name, bytes) in &expected.files {
            assert!(results.files[name] == *bytes, "{name} differs");
        }
        server.kill();
        // At a start what is left over goes.
        Server::start(folder.path()).kill();
        check_store(folder.path(), self.kills);
    }

    fn begin(&self, server: &Server) -> String {
        let scans = self.upload(server);
        self.submit(server, &scans)
    }

    fn upload(&self, server: &Server) -> Vec<String> {
        let settings = Settings { triangles: self.triangles, ..Settings::default() };
        let heads = Sculptor::new(7).with(settings).collection(self.scans, &[1.0]);
        let upload = |head: &onemesh::demo::SculptedHead| {
            let path = format!("/v1/scans?name={}", head.name);
            let scan = server.json("POST", &path, "model/ply", &ply_bytes(&head.mesh));
            let id = scan["id"].as_str().unwrap().to_owned();
            let landmarks = landmarks_json(&head.landmarks).to_string();
            let path = format!("/v1/scans/{id}/landmarks");
            server.json("PUT", &path, "application/json", landmarks.as_bytes());
            id
        };
        heads.iter().map(upload).collect()
    }

    fn submit(&self, server: &Server, scans: &[String]) -> String {
        let scans: Vec<Value> = scans.iter().map(|id| json!({ "id": id })).collect();
        let asked = json!({ "scans": scans, "vertices": self.vertices, "parameters": self.parameters });
        let asked = asked.to_string();
        let registration = server.json("POST", "/v1/registrations", "application/json", asked.as_bytes());
        format!("/v1/registrations/{}", registration["id"].as_str().unwrap())
    }
}

/// Every file of a registration; the report without its seconds.
struct Results {
    files: BTreeMap<String, Vec<u8>>,
}

impl Results {
    fn of(server: &Server, registration: &Value) -> Self {
        let path = format!("/v1/registrations/{}", registration["id"].as_str().unwrap());
        let mut files = BTreeMap::new();
        let mut take = |file: String| {
            let (status, bytes) = server.send("GET", &format!("{path}/{file}"), "", &[]).unwrap();
            assert_eq!(status, 200, "{file}");
            files.insert(file, bytes);
        };
        for child in registration["children"].as_array().unwrap() {
            take(format!("meshes/{}.glb", child["scan"].as_str().unwrap()));
        }
        for file in ["manifest.json", "report.json", "landmarks.json", "template.frozen.glb", "sheet.png"] {
            take(file.to_owned());
        }
        let mut report: Value = serde_json::from_slice(&files["report.json"]).unwrap();
        report.as_object_mut().unwrap().remove("seconds").unwrap();
        files.insert("report.json".to_owned(), report.to_string().into_bytes());
        Self { files }
    }
}

/// No step ran again but those that were interrupted, and no file is there that no record names, or the other way round.
fn check_store(folder: &Path, kills: usize) {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    runtime.block_on(async {
        let database = onemesh::job::Database::open(&folder.join("onemesh.db")).await.unwrap();
        let steps: Vec<(i64, i64, String)> = sqlx::query_as("SELECT runs, crashes, state FROM step")
            .fetch_all(database.reader())
            .await
            .unwrap();
        assert!(
            steps.iter().all(|(runs, crashes, state)| *runs == crashes + 1 && state == "done"),
            "{steps:?}"
        );
        let interrupted: i64 = steps.iter().map(|(_, crashes, _)| crashes).sum();
        let threads = std::thread::available_parallelism().unwrap().get();
        assert!(interrupted as usize <= kills * threads, "{interrupted}");
        let named = "SELECT digest FROM uploaded_blob UNION SELECT digest FROM job_blob";
        let named: Vec<String> = sqlx::query_scalar(named).fetch_all(database.reader()).await.unwrap();
        assert_eq!(files(&folder.join("blobs")), named.into_iter().collect());
        assert_eq!(files(&folder.join("uploads")), BTreeSet::new());
        database.close().await;
    });
    for name in files(&folder.join("blobs")) {
        let bytes = std::fs::read(folder.join("blobs").join(&name[..2]).join(&name)).unwrap();
        assert_eq!(Sha256::of(&bytes).to_string(), name);
    }
}

/// The names of all files beneath a folder.
fn files(folder: &Path) -> BTreeSet<String> {
    let mut names = BTreeSet::new();
    let mut waiting = vec![folder.to_owned()];
    while let Some(path) = waiting.pop() {
        if path.is_dir() {
            waiting.extend(std::fs::read_dir(&path).unwrap().map(|entry| entry.unwrap().path()));
        } else {
            names.insert(path.file_name().unwrap().to_string_lossy().into_owned());
        }
    }
    names
}

use std::path::Path;
use std::time::Duration;

use onemesh::demo::{Sculptor, Settings};
use onemesh::formats::{landmarks_json, ply_bytes};
use serde_json::{Value, json};

use crate::server::Server;

/// A year in milliseconds.
const YEAR: i64 = 365 * 24 * 3600 * 1000;

/// Every column that holds a time.
const TIMES: [(&str, &str); 9] = [
    ("scan", "created_at"),
    ("scan", "expires_at"),
    ("job", "created_at"),
    ("job", "started_at"),
    ("job", "finished_at"),
    ("job", "expires_at"),
    ("event", "at"),
    ("idempotency_key", "created_at"),
    ("webhook_delivery", "next_at"),
];

/// Changes all times that a folder holds: to the next server it is as if the clock had been set the other way.
fn shift(folder: &Path, by: i64) {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    runtime.block_on(async {
        let database = onemesh::job::Database::open(&folder.join("onemesh.db")).await.unwrap();
        for (table, column) in TIMES {
            let update = format!("UPDATE {table} SET {column} = {column} + {by}");
            sqlx::query(sqlx::AssertSqlSafe(update)).execute(database.writer()).await.unwrap();
        }
        database.close().await;
    });
}

fn upload(server: &Server) -> String {
    let small = Settings { triangles: 3000, ..Settings::default() };
    let head = &Sculptor::new(7).with(small).collection(1, &[1.0])[0];
    let scan = server.json("POST", "/v1/scans", "model/ply", &ply_bytes(&head.mesh));
    let id = scan["id"].as_str().unwrap().to_owned();
    let landmarks = landmarks_json(&head.landmarks).to_string();
    server.json("PUT", &format!("/v1/scans/{id}/landmarks"), "application/json", landmarks.as_bytes());
    id
}

fn ask(server: &Server, scan: &str) -> String {
    let asked = json!({ "scans": [{ "id": scan }], "vertices": 642,
        "parameters": { "groupwise.phases": 2, "groupwise.iterations": 2 } });
    let registration: Value =
        server.json("POST", "/v1/registrations", "application/json", asked.to_string().as_bytes());
    format!("/v1/registrations/{}", registration["id"].as_str().unwrap())
}

#[test]
fn a_clock_that_is_set_back_a_year_holds_no_work_back() {
    let folder = tempfile::tempdir().unwrap();
    let server = Server::start(folder.path());
    let scan = upload(&server);
    let path = ask(&server, &scan);
    server.kill();
    shift(folder.path(), YEAR);
    let server = Server::start(folder.path());
    assert_eq!(server.ended(&path, Duration::from_secs(120))["status"], "succeeded");
    let second = ask(&server, &scan);
    assert_eq!(server.ended(&second, Duration::from_secs(120))["status"], "succeeded");
    let listed = server.json("GET", "/v1/registrations", "", &[]);
    let ids: Vec<&str> =
        listed["items"].as_array().unwrap().iter().map(|item| item["id"].as_str().unwrap()).collect();
    assert!(second.ends_with(ids[0]) && path.ends_with(ids[1]), "the latest is the first: {ids:?}");
}

#[test]
fn a_clock_that_is_set_forward_a_year_loses_no_work_under_way() {
    let folder = tempfile::tempdir().unwrap();
    let server = Server::start(folder.path());
    let path = ask(&server, &upload(&server));
    server.kill();
    // The scan is over by then; what was asked for keeps its files.
    shift(folder.path(), -YEAR);
    let server = Server::start(folder.path());
    assert_eq!(server.ended(&path, Duration::from_secs(120))["status"], "succeeded");
}

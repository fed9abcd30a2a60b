//! A small collection that registers within a second or two.

use onemesh::demo::{Sculptor, Settings};
use onemesh::formats::{landmarks_json, ply_bytes};
use serde_json::{Value, json};

use crate::server::{Answer, Server};

/// Uploads sculpted heads with their landmarks and gives their scans' ids.
pub async fn upload(server: &Server, count: usize) -> Vec<String> {
    let small = Settings { triangles: 3000, ..Settings::default() };
    let mut ids = Vec::new();
    for head in Sculptor::new(7).with(small).collection(count, &[1.0]) {
        let path = format!("/v1/scans?name={}", head.name);
        let scan = server.post(&path, "model/ply", ply_bytes(&head.mesh)).await.json();
        let id = scan["id"].as_str().unwrap_or_else(|| panic!("{scan}")).to_owned();
        let landmarks = landmarks_json(&head.landmarks).to_string();
        let put = server.put(&format!("/v1/scans/{id}/landmarks"), "application/json", landmarks).await;
        assert_eq!(put.status, 200, "{}", put.text());
        ids.push(id);
    }
    ids
}

/// A request that takes a second, for these scans.
pub fn quick(scans: &[String]) -> Value {
    let scans: Vec<Value> = scans.iter().map(|id| json!({ "id": id })).collect();
    json!({
        "scans": scans,
        "vertices": 642,
        "parameters": {
            "fit.levels.0.iterations": 20, "register.levels.0.iterations": 20,
            "groupwise.phases": 2, "groupwise.iterations": 2, "transfer.phases": 2, "transfer.iterations": 2
        }
    })
}

/// Asks for a registration and waits for its end.
pub async fn register(server: &Server, request: &Value) -> Value {
    let asked = ask(server, request).await;
    assert_eq!(asked.status, 202, "{}", asked.text());
    ended(server, &asked.headers["location"]).await
}

pub async fn ask(server: &Server, request: &Value) -> Answer {
    server.post("/v1/registrations", "application/json", request.to_string()).await
}

/// Waits until a registration has ended, by its events.
pub async fn ended(server: &Server, path: &str) -> Value {
    let events = format!("{path}/events");
    let limit = std::time::Duration::from_secs(120);
    let events = tokio::time::timeout(limit, server.get(&events)).await.unwrap();
    assert_eq!(events.headers["content-type"], "text/event-stream");
    server.get(path).await.json()
}

/// Waits until the job at `path` runs.
pub async fn begun(server: &Server, path: &str) {
    for _ in 0..600 {
        if server.get(path).await.json()["status"] == "running" {
            return;
        }
        tokio::time::sleep(std::time::Duration::from_millis(100)).await;
    }
    panic!("{path} does not begin");
}

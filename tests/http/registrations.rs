//! `/v1/registrations`

use hyper::Request;
use serde_json::json;

use crate::server::Server;
use crate::study::{ask, ended, quick, register, upload};

#[tokio::test(flavor = "multi_thread")]
async fn scans_are_registered() {
    let server = Server::start().await;
    let scans = upload(&server, 2).await;
    let done = register(&server, &quick(&scans)).await;
    assert_eq!(done["status"], "succeeded", "{done}");
    assert_eq!((&done["progress"], &done["settings"]["vertices"]), (&1.0.into(), &642.into()));
    let children = done["children"].as_array().unwrap();
    assert_eq!(children.len(), 2);
    for child in children {
        assert!(child["verdict"].is_string() && child["status"] == "succeeded", "{child}");
        let mesh = server.get(child["mesh"].as_str().unwrap()).await;
        assert!(mesh.status == 200 && mesh.body.starts_with(b"glTF"));
    }
    let listed = server.get("/v1/registrations?status=succeeded").await.json();
    assert_eq!(listed["items"][0]["id"], done["id"]);
    assert_eq!(server.get("/v1/registrations?status=failed").await.json()["items"], json!([]));
    let id = done["id"].as_str().unwrap();
    let path = format!("/v1/registrations/{id}");
    for after in [id, "00000000000000000000000000000000"] {
        let rest = server.get(&format!("/v1/registrations?after={after}")).await.json();
        assert_eq!(rest["items"], json!([]), "{after}");
    }
    let later = server.get("/v1/registrations?after=ffffffffffffffffffffffffffffffff").await.json();
    assert_eq!(later["items"][0]["id"], id, "the next page stands, whatever was deleted");
    assert_eq!(server.delete(&path).await.status, 204);
    assert_eq!(server.get(&path).await.problem(), (404, "not-found".into()));
}

#[tokio::test(flavor = "multi_thread")]
async fn who_prefers_to_wait_is_told_the_end() {
    let server = Server::start().await;
    let scans = upload(&server, 1).await;
    let request = Request::post("/v1/registrations").header("content-type", "application/json");
    let waited = server.send(request.header("prefer", "wait=50"), quick(&scans).to_string()).await;
    assert_eq!((waited.status.as_u16(), &waited.json()["status"]), (200, &"succeeded".into()));
    assert_eq!(waited.headers["preference-applied"], "wait");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_registration_is_stopped() {
    let server = Server::start().await;
    let scans = upload(&server, 2).await;
    let mut slow = quick(&scans);
    (slow["parameters"], slow["vertices"]) = (json!({}), 40962.into());
    let path = ask(&server, &slow).await.headers["location"].clone();
    let refused = server.get(&format!("{path}/manifest.json")).await;
    assert_eq!(refused.problem(), (409, "conflict".into()));
    let start = std::time::Instant::now();
    assert_eq!(server.post(&format!("{path}/cancel"), "application/json", "").await.status, 200);
    assert_eq!(ended(&server, &path).await["status"], "canceled");
    assert!(start.elapsed().as_secs_f64() < 2.0, "it took {:?}", start.elapsed());
}

#[tokio::test(flavor = "multi_thread")]
async fn scans_are_added_to_what_has_ended() {
    let server = Server::start().await;
    let scans = upload(&server, 3).await;
    let done = register(&server, &quick(&scans[..2])).await;
    let path = format!("/v1/registrations/{}/scans", done["id"].as_str().unwrap());
    let body = json!({ "scans": [{ "id": scans[2], "name": "late" }] }).to_string();
    let added = server.post(&path, "application/json", body).await;
    assert_eq!(added.status, 202, "{}", added.text());
    let added = ended(&server, &added.headers["location"]).await;
    assert_eq!(
        (&added["status"], &added["children"][0]["name"]),
        (&"succeeded".into(), &"late".into()),
        "{added}"
    );
    assert_eq!(added["template"], format!("registration:{}", done["id"].as_str().unwrap()));
    let metrics = server.get("/metrics").await.text();
    assert!(metrics.contains("\nonemesh_residual_count 3\n"), "each result's residual: {metrics}");
}

#[tokio::test(flavor = "multi_thread")]
async fn requests_that_are_wrong_name_the_field() {
    let server = Server::start().await;
    let scans = upload(&server, 1).await;
    let field = async |change: serde_json::Value| {
        let mut request = quick(&scans);
        for (name, value) in change.as_object().unwrap() {
            request[name] = value.clone();
        }
        let answer = ask(&server, &request).await;
        let (status, _) = answer.problem();
        (status, answer.json()["field"].as_str().unwrap_or_default().to_owned())
    };
    assert_eq!(field(json!({ "scans": [] })).await, (422, "scans".into()));
    assert_eq!(field(json!({ "scans": [{ "id": "x" }] })).await, (422, "scans[0].id".into()));
    assert_eq!(field(json!({ "scans": [{ "id": "0".repeat(32) }] })).await, (422, "scans[0]".into()));
    assert_eq!(field(json!({ "scans": [{ "name": "x" }] })).await, (422, "scans[0]".into()));
    assert_eq!(field(json!({ "template": "x" })).await, (422, "template".into()));
    assert_eq!(field(json!({ "template": "0".repeat(32) })).await, (422, "template".into()));
    assert_eq!(field(json!({ "vertices": 643 })).await, (422, "vertices".into()));
    assert_eq!(field(json!({ "preset": "mine" })).await, (422, "preset".into()));
    assert_eq!(
        field(json!({ "parameters": { "groupwise.round": 1 } })).await,
        (422, "parameters.groupwise.round".into())
    );
    assert_eq!(field(json!({ "webhook": "https://10.0.0.1/" })).await, (422, "webhook".into()));
    assert_eq!(field(json!({ "extra": 1 })).await, (422, "extra".into()));
    let malformed = server.post("/v1/registrations", "application/json", "{").await;
    assert_eq!(malformed.problem(), (400, "bad-request".into()));
    assert_eq!(server.post("/v1/registrations", "text/plain", "{}").await.problem().0, 415);
}

#[tokio::test(flavor = "multi_thread")]
async fn the_same_key_asks_once() {
    let server = Server::start().await;
    let scans = upload(&server, 1).await;
    let post = || {
        let request = Request::post("/v1/registrations").header("content-type", "application/json");
        server.send(request.header("idempotency-key", "once"), quick(&scans).to_string())
    };
    let (first, second) = (post().await, post().await);
    assert_eq!(first.headers["location"], second.headers["location"]);
    assert_eq!(server.get("/v1/registrations").await.json()["items"].as_array().unwrap().len(), 1);
}

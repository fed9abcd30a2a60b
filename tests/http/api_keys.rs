//! Who may ask.

use hyper::Request;
use onemesh::http::config::{Config, KeyPolicy};
use onemesh::http::{Service, ServiceError};
use onemesh::job::api_key::Scope;

use crate::server::{OBJ, Server};

#[tokio::test]
async fn keys_let_in_as_far_as_they_go() {
    let folder = tempfile::tempdir().unwrap();
    let keys = crate::server::keys(folder.path()).await;
    let (_, reader) = keys.create("reader", Scope::Read).await.unwrap();
    let (writer_key, writer) = keys.create("writer", Scope::Write).await.unwrap();
    let server = Server::in_folder(folder, |config| config.server.keys = KeyPolicy::Required).await;
    let get = async |authorization: &str| {
        server.send(Request::get("/v1/scans").header("authorization", authorization), "").await
    };
    let post = async |authorization: &str| {
        let request = Request::post("/v1/scans").header("content-type", "model/obj");
        server.send(request.header("authorization", authorization), OBJ).await
    };
    let refused = server.get("/v1/scans").await;
    assert_eq!(refused.problem(), (401, "unauthorized".into()));
    assert_eq!(refused.headers["www-authenticate"], "Bearer");
    let id = &writer_key.id;
    for wrong in
        ["Bearer x", "Basic x", "Bearer", "Bearer onemesh_x_y", &format!("Bearer onemesh_{id}_wrong")]
    {
        assert_eq!(get(wrong).await.problem(), (401, "unauthorized".into()), "{wrong}");
    }
    assert_eq!(get(&format!("Bearer {reader}")).await.status, 200);
    assert_eq!(post(&format!("Bearer {reader}")).await.problem(), (403, "forbidden".into()));
    assert_eq!(post(&format!("bearer {writer}")).await.status, 201);
    assert!(keys.revoke(id).await.unwrap() && !keys.revoke(id).await.unwrap());
    assert_eq!(get(&format!("Bearer {writer}")).await.problem(), (401, "unauthorized".into()));
    assert_eq!(server.get("/healthz").await.status, 200);
    assert_eq!(server.get("/metrics").await.status, 401);
    let stored = std::fs::read(server.folder.path().join("data/onemesh.db")).unwrap();
    let secret = writer.to_string();
    let secret = secret.rsplit_once('_').unwrap().1.as_bytes();
    assert!(!stored.windows(secret.len()).any(|window| window == secret), "the secret is in the database");
}

#[tokio::test]
async fn without_keys_it_listens_to_nobody_but_this_machine() {
    let folder = tempfile::tempdir().unwrap();
    let mut config = Config::default();
    config.server.listen = ([0, 0, 0, 0], 0).into();
    config.data.folder = folder.path().join("data");
    assert!(matches!(Service::open(config.clone()).await, Err(ServiceError::NoKeys { .. })));
    config.server.keys = KeyPolicy::Off;
    assert!(Service::open(config).await.is_ok());
}

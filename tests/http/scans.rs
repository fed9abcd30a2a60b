//! `/v1/scans`

use std::time::Duration;

use hyper::Request;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;

use crate::server::{Answer, OBJ, Server};

const LANDMARKS: &str =
    r#"{"scheme": "mine", "landmarks": {"a": [0, 0, 0], "b": [20, 0, 0], "c": [0, 20, 0]}}"#;

fn id(answer: &Answer) -> String {
    answer.json()["id"].as_str().unwrap_or_else(|| panic!("{}", answer.text())).to_owned()
}

fn form(parts: &[(&str, &str, &str)]) -> String {
    let part = |(name, file, body): &(&str, &str, &str)| {
        let file = if file.is_empty() { String::new() } else { format!("; filename=\"{file}\"") };
        format!("--b\r\nContent-Disposition: form-data; name=\"{name}\"{file}\r\n\r\n{body}\r\n")
    };
    parts.iter().map(part).chain(["--b--\r\n".to_owned()]).collect()
}

const FORM: &str = "multipart/form-data; boundary=b";

fn blobs(server: &Server) -> usize {
    let folders = std::fs::read_dir(server.folder.path().join("data/blobs")).unwrap();
    folders.map(|folder| std::fs::read_dir(folder.unwrap().path()).unwrap().count()).sum()
}

fn uploads(server: &Server) -> usize {
    std::fs::read_dir(server.folder.path().join("data/uploads")).unwrap().count()
}

/// Waits until nothing is kept.
async fn emptied(server: &Server) {
    for _ in 0..100 {
        if blobs(server) == 0 {
            return;
        }
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
    panic!("{} blobs are kept", blobs(server));
}

#[tokio::test]
async fn an_uploaded_scan_is_looked_at() {
    let server = Server::start().await;
    let made = server.post("/v1/scans?name=anna", "model/obj", OBJ).await;
    assert_eq!(made.status, 201, "{}", made.text());
    let scan = made.json();
    assert_eq!((&scan["name"], &scan["media_type"]), (&"anna".into(), &"model/obj".into()));
    assert_eq!((&scan["report"]["triangles"], &scan["report"]["outward"]), (&4.into(), &true.into()));
    assert_eq!(made.headers["location"], format!("/v1/scans/{}", id(&made)));
    assert_eq!(server.get(&made.headers["location"]).await.json(), scan);
    assert_eq!(server.get(&format!("{}/mesh", made.headers["location"])).await.text(), OBJ);
}

#[tokio::test]
async fn the_same_bytes_again_give_the_same_scan() {
    let server = Server::start().await;
    let first = server.post("/v1/scans", "model/obj", OBJ).await;
    let second = server.post("/v1/scans", "model/obj", OBJ).await;
    assert_eq!((first.status.as_u16(), second.status.as_u16()), (201, 200));
    assert_eq!(id(&first), id(&second));
    let named = server.post("/v1/scans?name=other", "model/obj", OBJ).await;
    assert_ne!(id(&first), id(&named));
    assert_eq!(blobs(&server), 1);
}

#[tokio::test]
async fn a_form_brings_all_files_at_once() {
    let server = Server::start().await;
    let parts = [
        ("mesh", "x.obj", OBJ),
        ("landmarks", "x.json", LANDMARKS),
        ("mask", "", "[1, 1, 1, 0]"),
        ("name", "", "ben"),
    ];
    let scan = server.post("/v1/scans", FORM, form(&parts)).await.json();
    assert_eq!((&scan["name"], &scan["report"]["landmarks"]["present"]), (&"ben".into(), &3.into()));
    assert!(scan["mask"].is_string() && scan["texture"].is_null());
}

#[tokio::test]
async fn forms_that_are_wrong_are_refused() {
    let server = Server::start().await;
    let refused = async |parts: &[(&str, &str, &str)]| {
        let answer = server.post("/v1/scans", FORM, form(parts)).await;
        (answer.problem().0, answer.json()["field"].as_str().unwrap_or_default().to_owned())
    };
    assert_eq!(refused(&[("name", "", "ben")]).await, (422, "mesh".into()));
    assert_eq!(refused(&[("mesh", "x.obj", OBJ), ("mesh", "x.obj", OBJ)]).await, (422, "mesh".into()));
    assert_eq!(refused(&[("mesh", "x.obj", OBJ), ("extra", "", "1")]).await, (422, "extra".into()));
    assert_eq!(refused(&[("mesh", "", "what is this")]).await, (422, "mesh".into()));
    assert_eq!(refused(&[("mesh", "x.obj", OBJ), ("landmarks", "", "{}")]).await, (422, "landmarks".into()));
    assert_eq!(refused(&[("mesh", "x.obj", OBJ), ("mask", "", "[1]")]).await, (422, "mask".into()));
    assert_eq!(
        refused(&[("mesh", "x.obj", OBJ), ("texture", "", "no picture")]).await,
        (422, "texture".into())
    );
    assert_eq!(refused(&[("mesh", "x.obj", OBJ), ("name", "", "a\u{7}b")]).await, (422, "name".into()));
    let cut = &form(&[("mesh", "x.obj", OBJ)])[..60];
    assert_eq!(server.post("/v1/scans", FORM, cut.to_owned()).await.status, 400);
    assert_eq!(server.post("/v1/scans", "multipart/form-data", "").await.status, 400);
    assert_eq!(server.get("/v1/scans").await.json()["items"], serde_json::json!([]));
}

#[tokio::test]
async fn bodies_that_are_wrong_are_refused() {
    let server = Server::with(|config| config.limits.scan.upload_bytes = 10_000).await;
    let problem = async |media_type: &str, body: &str| {
        server.post("/v1/scans", media_type, body.to_owned()).await.problem()
    };
    assert_eq!(problem("model/ply", "garbage").await, (422, "unreadable-file".into()));
    assert_eq!(
        problem("model/gltf-binary", "glTF\x02\0\0\0\u{7f}\u{7f}\u{7f}\u{7f}").await,
        (422, "unreadable-file".into())
    );
    assert_eq!(problem("application/zip", "PK\x03\x04").await, (422, "unreadable-file".into()));
    assert_eq!(problem("model/obj", "").await, (422, "unreadable-file".into()));
    assert_eq!(problem("text/html", OBJ).await, (415, "unsupported-media-type".into()));
    assert_eq!(problem("application/octet-stream", "???").await, (422, "unreadable-file".into()));
    assert_eq!(problem("model/obj", &"v 0 0 0\n".repeat(2000)).await, (413, "limit-exceeded".into()));
    assert_eq!(server.send(Request::post("/v1/scans"), OBJ).await.problem().0, 415);
    assert_eq!(server.post("/v1/scans?nme=x", "model/obj", OBJ).await.problem().0, 400);
    assert_eq!(server.post("/v1/scans?name=", "model/obj", OBJ).await.problem().0, 400);
    let claim = "ply\nformat binary_little_endian 1.0\nelement vertex 4000000000\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
    assert_eq!(problem("model/ply", claim).await, (422, "unreadable-file".into()));
    assert_eq!(uploads(&server), 0);
    emptied(&server).await;
}

#[tokio::test]
async fn bytes_that_say_what_they_are_need_no_media_type() {
    let server = Server::start().await;
    let scan = server.post("/v1/scans", "application/octet-stream", OBJ).await.json();
    assert_eq!(scan["media_type"], "model/obj");
}

#[tokio::test]
async fn landmarks_masks_and_textures_are_put_and_got() {
    let server = Server::start().await;
    let path = format!("/v1/scans/{}", id(&server.post("/v1/scans", "model/obj", OBJ).await));
    assert_eq!(server.get(&format!("{path}/landmarks")).await.problem(), (404, "not-found".into()));
    let scan = server.put(&format!("{path}/landmarks"), "application/json", LANDMARKS).await.json();
    assert_eq!(scan["report"]["landmarks"]["scheme"], serde_json::Value::Null, "{scan}");
    assert_eq!(scan["report"]["landmarks"]["present"], 3);
    let got = server.get(&format!("{path}/landmarks")).await;
    assert_eq!(got.text(), LANDMARKS);
    let again = Request::get(format!("{path}/landmarks")).header("if-none-match", &got.headers["etag"]);
    assert_eq!(server.send(again, "").await.status, 304);
    let part = Request::get(format!("{path}/landmarks")).header("range", "bytes=2-7");
    let part = server.send(part, "").await;
    assert_eq!((part.status.as_u16(), part.text().as_str()), (206, "scheme"));
    let vertices = server.put(&format!("{path}/landmarks"), "text/plain", "0\n1\n2\n3\n").await.json();
    assert_eq!(vertices["report"]["landmarks"]["present"], 4);
    let mask = server.put(&format!("{path}/mask"), "application/json", "[1, 1, 1, 0.5]").await;
    assert_eq!(mask.status, 200, "{}", mask.text());
    let refused = server.put(&format!("{path}/texture"), "image/png", "no picture").await;
    assert_eq!(refused.problem(), (422, "unreadable-file".into()));
    let nobody = "/v1/scans/00000000000000000000000000000000/landmarks";
    assert_eq!(server.put(nobody, "application/json", LANDMARKS).await.problem().0, 404);
}

#[tokio::test]
async fn a_list_comes_in_pages() {
    let server = Server::start().await;
    for name in ["a", "b", "c"] {
        server.post(&format!("/v1/scans?name={name}"), "model/obj", OBJ).await;
    }
    let names = |page: &serde_json::Value| -> Vec<String> {
        let items = page["items"].as_array().unwrap().iter();
        items.map(|item| item["name"].as_str().unwrap().to_owned()).collect()
    };
    let first = server.get("/v1/scans?limit=2").await.json();
    assert_eq!(names(&first), ["c", "b"]);
    let next = first["next"].as_str().unwrap();
    let second = server.get(&format!("/v1/scans?limit=2&after={next}")).await.json();
    assert_eq!(names(&second), ["a"]);
    assert!(second["next"].is_null());
    for wrong in ["limit=0", "limit=201", "limit=x", "after=x", "before=1"] {
        assert_eq!(server.get(&format!("/v1/scans?{wrong}")).await.problem().0, 400, "{wrong}");
    }
}

#[tokio::test]
async fn a_deleted_scan_is_gone() {
    let server = Server::start().await;
    let path = format!("/v1/scans/{}", id(&server.post("/v1/scans", "model/obj", OBJ).await));
    assert_eq!(server.delete(&path).await.status, 204);
    assert_eq!(blobs(&server), 0, "its files go with it");
    assert_eq!(server.delete(&path).await.problem(), (404, "not-found".into()));
    assert_eq!(server.get(&path).await.problem(), (404, "not-found".into()));
    assert_eq!(server.get("/v1/scans/nonsense").await.problem(), (404, "not-found".into()));
}

#[tokio::test]
async fn what_was_acknowledged_is_there_after_a_restart() {
    let server = Server::start().await;
    let made = server.post("/v1/scans", "model/obj", OBJ).await;
    let server = Server::in_folder(server.end().await, |_| {}).await;
    assert_eq!(server.get(&made.headers["location"]).await.json(), made.json());
}

#[tokio::test]
async fn a_client_that_hangs_up_leaves_nothing() {
    let server = Server::start().await;
    let mut stream = TcpStream::connect(server.address).await.unwrap();
    let head = "POST /v1/scans HTTP/1.1\r\nHost: x\r\nContent-Type: model/obj\r\nContent-Length: 1000000\r\n\r\nv 0 0 0\n";
    stream.write_all(head.as_bytes()).await.unwrap();
    tokio::time::sleep(Duration::from_millis(200)).await;
    drop(stream);
    for _ in 0..100 {
        if uploads(&server) == 0 {
            break;
        }
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
    assert_eq!((uploads(&server), blobs(&server)), (0, 0));
    assert_eq!(server.post("/v1/scans", "model/obj", OBJ).await.status, 201);
}

#[tokio::test]
async fn a_client_that_sends_nothing_more_is_not_waited_for() {
    let server = Server::with(|config| config.server.body_idle_seconds = 1).await;
    let mut stream = TcpStream::connect(server.address).await.unwrap();
    let head = "POST /v1/scans HTTP/1.1\r\nHost: x\r\nContent-Type: model/obj\r\nContent-Length: 1000000\r\n\r\nv 0 0 0\n";
    stream.write_all(head.as_bytes()).await.unwrap();
    let mut answer = [0; 1024];
    let count =
        tokio::time::timeout(Duration::from_secs(20), stream.read(&mut answer)).await.unwrap().unwrap();
    let answer = String::from_utf8_lossy(&answer[..count]);
    assert!(answer.starts_with("HTTP/1.1 400") && answer.contains("broken-off"), "{answer}");
}

#[tokio::test]
async fn a_damaged_file_is_said_to_be() {
    let server = Server::start().await;
    let made = server.post("/v1/scans", "model/obj", OBJ).await;
    let digest = made.json()["sha256"].as_str().unwrap().to_owned();
    let file = server.folder.path().join("data/blobs").join(&digest[..2]).join(&digest);
    std::fs::write(&file, OBJ.replace("20", "30")).unwrap();
    let path = format!("{}/mesh", made.headers["location"]);
    assert_eq!(server.get(&path).await.problem(), (500, "damaged-file".into()));
    server.post("/v1/scans", "model/obj", OBJ).await;
    assert_eq!(server.get(&path).await.text(), OBJ, "the same bytes again mend it");
}

#[tokio::test]
async fn an_idempotency_key_gives_the_first_answer_again() {
    let server = Server::start().await;
    let post = |key: &'static str| {
        Request::post("/v1/scans").header("content-type", "model/obj").header("idempotency-key", key)
    };
    let first = server.send(post("k1"), OBJ).await;
    let again = server.send(post("k1"), OBJ).await;
    assert_eq!((first.status.as_u16(), again.status.as_u16()), (201, 201));
    assert_eq!((&first.body, &first.headers["location"]), (&again.body, &again.headers["location"]));
    assert_eq!(again.headers["idempotency-replayed"], "true");
    let other = server.send(post("k1"), OBJ.replace("20", "30")).await;
    assert_eq!(other.problem(), (422, "idempotency-key-reused".into()));
    let other =
        Request::post("/v1/scans?name=x").header("content-type", "model/obj").header("idempotency-key", "k1");
    assert_eq!(server.send(other, OBJ).await.problem(), (422, "idempotency-key-reused".into()));
    assert_eq!(server.send(post("not a key"), OBJ).await.problem(), (400, "bad-request".into()));
    let failed = server.send(post("k2"), "garbage").await;
    assert_eq!(failed.status, 422);
    assert_eq!(server.send(post("k2"), OBJ).await.status, 200, "what failed may be tried again");
}

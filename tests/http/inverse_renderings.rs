//! `/v1/inverse-renderings`

use hyper::Request;
use serde_json::{Value, json};

use crate::pictures::{QUICK, files, folder, form, zip};
use crate::server::{Answer, Server};
use crate::study::{begun, ended};

const FORM: &str = "multipart/form-data; boundary=b";

/// A server that draws without a driver, so that all see the same.
async fn server() -> Server {
    Server::with(|config| config.work.adapter = "reference".to_owned()).await
}

async fn ask(server: &Server, query: &str, zip: Vec<u8>) -> Answer {
    server.post(&format!("/v1/inverse-renderings?{query}"), "application/zip", zip).await
}

fn blobs(server: &Server) -> usize {
    let mut count = 0;
    for folder in std::fs::read_dir(server.folder.path().join("data/blobs")).unwrap() {
        count += std::fs::read_dir(folder.unwrap().path()).unwrap().count();
    }
    count
}

/// Waits until no more than so many files are kept.
async fn emptied(server: &Server, left: usize) {
    for _ in 0..200 {
        if blobs(server) == left {
            return;
        }
        tokio::time::sleep(std::time::Duration::from_millis(50)).await;
    }
    panic!("{} blobs are kept", blobs(server));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_mesh_comes_of_a_zip_and_the_same_of_a_form_and_becomes_a_scan() {
    let server = server().await;
    let pictures = folder(8);
    let files = files(pictures.path());
    let asked = ask(&server, &format!("name=head&{QUICK}"), zip(&files)).await;
    assert_eq!(asked.status, 202, "{}", asked.text());
    let path = asked.headers["location"].clone();
    let done = ended(&server, &path).await;
    assert_eq!((&done["status"], &done["name"]), (&"succeeded".into(), &"head".into()), "{done}");
    assert_eq!((&done["progress"], &done["settings"]["vertices"]), (&1.0.into(), &642.into()));
    let mesh = server.get(done["results"]["mesh"].as_str().unwrap()).await;
    assert!(mesh.status == 200 && mesh.body.starts_with(b"glTF"));
    let part = Request::get(done["results"]["mesh"].as_str().unwrap()).header("range", "bytes=0-3");
    let part = server.send(part, "").await;
    assert_eq!((part.status.as_u16(), part.body.as_slice()), (206, b"glTF".as_slice()));
    let known = Request::get(done["results"]["mesh"].as_str().unwrap());
    let known = known.header("if-none-match", &mesh.headers["etag"]);
    assert_eq!(server.send(known, "").await.status, 304);
    let report = server.get(done["results"]["report"].as_str().unwrap()).await.json();
    assert_eq!(report["views"].as_array().unwrap().len(), 8, "{report}");
    let sheet = server.get(done["results"]["sheet"].as_str().unwrap()).await;
    assert!(sheet.body.starts_with(b"\x89PNG"));

    let other = server.post(&format!("/v1/inverse-renderings?name=head&{QUICK}"), FORM, form(&files)).await;
    assert_eq!(other.status, 202, "{}", other.text());
    let other = ended(&server, &other.headers["location"]).await;
    let same = server.get(other["results"]["mesh"].as_str().unwrap()).await;
    assert!(same.body == mesh.body, "the same pictures give the same bytes");

    let scan = server.post(done["results"]["scan"].as_str().unwrap(), "application/json", "").await;
    assert_eq!((scan.status.as_u16(), &scan.json()["name"]), (201, &"head".into()), "{}", scan.text());
    assert_eq!(scan.json()["report"]["vertices"], 642, "{}", scan.text());
    let again = server.post(done["results"]["scan"].as_str().unwrap(), "application/json", "").await;
    assert_eq!(again.headers["location"], scan.headers["location"]);
    for path in [&path, other["results"]["mesh"].as_str().unwrap().trim_end_matches("/mesh.glb")] {
        assert_eq!(server.delete(path).await.status, 204);
    }
    assert_eq!(server.get(&path).await.problem(), (404, "not-found".into()));
    let kept = server.get(&format!("{}/mesh", scan.headers["location"])).await;
    assert!(kept.body == mesh.body, "the scan stays");
    emptied(&server, 1).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn it_is_listed_told_of_and_stopped_as_a_registration_is_but_is_none() {
    let server = server().await;
    let pictures = folder(6);
    let many = "vertices=10242&parameters=%7B%22levels.0.iterations%22%3A20000%7D";
    let asked = ask(&server, many, zip(&files(pictures.path()))).await;
    assert_eq!(asked.status, 202, "{}", asked.text());
    let path = asked.headers["location"].clone();
    let id = path.rsplit('/').next().unwrap().to_owned();
    let listed = server.get("/v1/inverse-renderings").await.json();
    assert_eq!(listed["items"][0]["id"], id);
    assert_eq!(server.get("/v1/registrations").await.json()["items"], json!([]));
    for method in ["", "/events", "/report.json"] {
        let other = server.get(&format!("/v1/registrations/{id}{method}")).await;
        assert_eq!(other.problem().0, 404, "{method}");
    }
    begun(&server, &path).await;
    let early = server.get(&format!("{path}/mesh.glb")).await;
    assert_eq!(early.problem(), (409, "conflict".into()));
    let start = std::time::Instant::now();
    assert_eq!(server.post(&format!("{path}/cancel"), "application/json", "").await.status, 200);
    assert_eq!(ended(&server, &path).await["status"], "canceled");
    assert!(start.elapsed().as_secs_f64() < 2.0, "it took {:?}", start.elapsed());
    let events = server.get(&format!("{path}/events")).await.text();
    assert!(events.contains("event: stage") && events.contains(r#""stage":"invert""#), "{events}");
    let last: Value = serde_json::from_str(events.rsplit("data: ").next().unwrap().trim()).unwrap();
    assert_eq!(last["status"], "canceled");
    let metrics = server.get("/metrics").await.text();
    assert!(metrics.contains(r#"onemesh_jobs{kind="inverse_rendering",status="canceled"} 1"#), "{metrics}");
}

#[tokio::test(flavor = "multi_thread")]
async fn what_is_wrong_is_named_and_not_kept() {
    let server = server().await;
    let pictures = folder(3);
    let all = files(pictures.path());
    let without =
        |name: &str| zip(&all.iter().filter(|(path, _)| !path.ends_with(name)).cloned().collect::<Vec<_>>());
    let cases: [(&str, Vec<u8>, u16, &str); 8] = [
        ("", without("transforms.json"), 422, "holds no cameras"),
        ("", without("001.png"), 422, "001"),
        ("", b"PK no zip".to_vec(), 422, "zip"),
        ("preset=mine", zip(&all), 400, "preset"),
        ("vertices=643", zip(&all), 422, "vertices"),
        ("parameters=%7B%22nothing%22%3A1%7D", zip(&all), 422, "parameters.nothing"),
        ("parameters=%7B%22levels.0.iterations%22%3A1000000%7D", zip(&all), 422, "iterations"),
        ("parameters=x", zip(&all), 422, "parameters"),
    ];
    for (query, body, status, said) in cases {
        let refused = ask(&server, query, body).await;
        assert_eq!(refused.problem().0, status, "{query}: {}", refused.text());
        assert!(refused.text().contains(said), "{said}: {}", refused.text());
    }
    let text = server.post("/v1/inverse-renderings", "text/plain", "x").await;
    assert_eq!(text.problem(), (415, "unsupported-media-type".into()));
    let field = "--b\r\nContent-Disposition: form-data; name=\"mesh\"\r\n\r\nx\r\n--b--\r\n";
    let wrong = server.post("/v1/inverse-renderings", FORM, field).await;
    assert_eq!((wrong.problem().0, &wrong.json()["field"]), (422, &"mesh".into()));
    emptied(&server, 0).await;
    assert_eq!(server.get("/v1/inverse-renderings").await.json()["items"], json!([]));
}

#[tokio::test(flavor = "multi_thread")]
async fn limits_hold() {
    let server = Server::with(|config| {
        config.work.adapter = "reference".to_owned();
        config.limits.capture.views = 2;
    });
    let server = server.await;
    let pictures = folder(3);
    let refused = ask(&server, "", zip(&files(pictures.path()))).await;
    assert_eq!(refused.problem(), (413, "limit-exceeded".into()), "{}", refused.text());
    assert!(refused.text().contains("views: 3"), "{}", refused.text());
}

#[tokio::test(flavor = "multi_thread")]
async fn without_an_adapter_it_says_what_to_install() {
    let server = Server::with(|config| config.work.adapter = "no card is called so".to_owned()).await;
    let pictures = folder(2);
    let refused = ask(&server, "", zip(&files(pictures.path()))).await;
    assert_eq!(refused.problem(), (503, "no-adapter".into()), "{}", refused.text());
    assert!(refused.json()["remedy"].as_str().unwrap().contains("mesa-vulkan-drivers"));
    let renderer = &server.get("/v1/capabilities").await.json()["renderer"];
    assert!(renderer["problem"].is_string() && renderer["name"].is_null(), "{renderer}");
}

#[tokio::test(flavor = "multi_thread")]
async fn the_same_key_asks_once() {
    let server = server().await;
    let pictures = folder(6);
    let zip = zip(&files(pictures.path()));
    let post = || {
        let request = Request::post(format!("/v1/inverse-renderings?{QUICK}"));
        let request = request.header("content-type", "application/zip").header("idempotency-key", "once");
        server.send(request.header("prefer", "wait=50"), zip.clone())
    };
    let (first, second) = (post().await, post().await);
    assert_eq!((first.status.as_u16(), &first.json()["status"]), (200, &"succeeded".into()));
    assert_eq!(first.headers["location"], second.headers["location"]);
    assert_eq!(server.get("/v1/inverse-renderings").await.json()["items"].as_array().unwrap().len(), 1);
}

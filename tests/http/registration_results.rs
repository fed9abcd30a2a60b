//! `/v1/registrations/{id}/meshes/…`, `…/manifest.json`, `…/set.zip` and so on

use std::io::{Cursor, Read};

use hyper::Request;
use serde_json::Value;

use crate::server::Server;
use crate::study::{quick, register, upload};

async fn finished(server: &Server) -> Value {
    let scans = upload(server, 2).await;
    register(server, &quick(&scans)).await
}

#[tokio::test(flavor = "multi_thread")]
async fn results_have_tags_and_come_in_ranges() {
    let server = Server::start().await;
    let done = finished(&server).await;
    for (name, path) in done["results"].as_object().unwrap() {
        let path = path.as_str().unwrap();
        let whole = server.get(path).await;
        assert_eq!(whole.status, 200, "{name}: {}", whole.text());
        assert!(whole.headers["cache-control"].contains("immutable"), "{name}");
        let tag = &whole.headers["etag"];
        let known = server.send(Request::get(path).header("if-none-match", tag), "").await;
        assert_eq!((known.status.as_u16(), known.body.len()), (304, 0), "{name}");
        let part =
            server.send(Request::get(path).header("range", "bytes=5-20").header("if-range", tag), "").await;
        assert_eq!((part.status.as_u16(), &part.body[..]), (206, &whole.body[5..=20]), "{name}");
        assert_eq!(part.headers["content-range"], format!("bytes 5-20/{}", whole.body.len()), "{name}");
        let beyond = server.send(Request::get(path).header("range", "bytes=999999999-"), "").await;
        assert_eq!(beyond.problem(), (416, "range-not-satisfiable".into()), "{name}");
        let head = server.send(Request::head(path), "").await;
        assert_eq!(head.headers["content-length"], whole.body.len().to_string(), "{name}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn the_set_is_a_zip_of_all_results() {
    let server = Server::start().await;
    let done = finished(&server).await;
    let set = server.get(done["results"]["set"].as_str().unwrap()).await;
    let mut zip = zip::ZipArchive::new(Cursor::new(set.body)).unwrap();
    let mut names: Vec<String> = zip.file_names().map(|name| name.unwrap().into_owned()).collect();
    names.sort();
    assert!(names.contains(&"manifest.json".to_owned()) && names.len() >= 6, "{names:?}");
    let mut report = Vec::new();
    zip.by_name("report.json").unwrap().read_to_end(&mut report).unwrap();
    assert_eq!(server.get(done["results"]["report"].as_str().unwrap()).await.body, report);
}

#[tokio::test(flavor = "multi_thread")]
async fn what_is_not_among_the_results_is_not_there() {
    let server = Server::start().await;
    let done = finished(&server).await;
    let root = format!("/v1/registrations/{}", done["id"].as_str().unwrap());
    for path in ["meshes/x.glb", "meshes/00000000000000000000000000000000.glb", "other.json"] {
        assert_eq!(
            server.get(&format!("{root}/{path}")).await.problem(),
            (404, "not-found".into()),
            "{path}"
        );
    }
    let nobody = "/v1/registrations/00000000000000000000000000000000/manifest.json";
    assert_eq!(server.get(nobody).await.problem(), (404, "not-found".into()));
}

#[tokio::test(flavor = "multi_thread")]
async fn who_reads_slowly_disturbs_nobody() {
    use tokio::io::{AsyncReadExt, AsyncWriteExt};
    let server = Server::start().await;
    let done = finished(&server).await;
    let set = done["results"]["set"].as_str().unwrap();
    let mut slow = Vec::new();
    for _ in 0..50 {
        let mut stream = tokio::net::TcpStream::connect(server.address).await.unwrap();
        stream.write_all(format!("GET {set} HTTP/1.1\r\nHost: x\r\n\r\n").as_bytes()).await.unwrap();
        assert_eq!(stream.read_u8().await.unwrap(), b'H');
        slow.push(stream);
    }
    let start = std::time::Instant::now();
    assert_eq!(server.get("/v1/capabilities").await.status, 200);
    assert_eq!(server.get(set).await.status, 200);
    assert!(start.elapsed().as_secs() < 5, "it took {:?}", start.elapsed());
}

use std::time::Duration;

use hyper::Request;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;

use crate::server::Server;

#[tokio::test]
async fn it_lives_and_takes_work() {
    let server = Server::start().await;
    assert_eq!(server.get("/healthz").await.json()["status"], "ok");
    assert_eq!(server.get("/readyz").await.json()["status"], "ok");
}

#[tokio::test]
async fn a_full_disk_takes_no_work() {
    let server = Server::with(|config| config.data.keep_free_bytes = u64::MAX >> 1).await;
    assert_eq!(server.get("/healthz").await.status, 200);
    assert_eq!(server.get("/readyz").await.problem(), (503, "storage-unavailable".into()));
    let refused = server.post("/v1/scans", "model/obj", crate::server::OBJ).await;
    assert_eq!(refused.problem(), (503, "storage-unavailable".into()));
    assert!(refused.headers.contains_key("retry-after"));
}

#[tokio::test]
async fn requests_are_counted_by_route() {
    let server = Server::start().await;
    server.get("/v1/scans/00000000000000000000000000000000").await;
    let metrics = server.get("/metrics").await.text();
    let counted = r#"onemesh_http_requests_total{method="GET",route="/v1/scans/{id}",status="404"} 1"#;
    assert!(metrics.contains(counted) && metrics.ends_with("# EOF\n"), "{metrics}");
}

#[tokio::test]
async fn whatever_is_not_there_is_a_problem() {
    let server = Server::start().await;
    assert_eq!(server.get("/nowhere").await.problem(), (404, "not-found".into()));
    let answer = server.send(Request::patch("/v1/scans"), "").await;
    assert_eq!(answer.problem(), (405, "method-not-allowed".into()));
    assert!(answer.headers["allow"].contains("GET"), "{:?}", answer.headers);
}

#[tokio::test]
async fn a_request_has_an_id() {
    let server = Server::start().await;
    let given = server.send(Request::get("/healthz").header("x-request-id", "mine"), "").await;
    assert_eq!(given.headers["x-request-id"], "mine");
    assert_eq!(server.get("/healthz").await.headers["x-request-id"].len(), 32);
}

#[tokio::test]
async fn a_request_that_does_not_come_is_not_waited_for() {
    let server = Server::with(|config| config.server.header_seconds = 1).await;
    let mut silent = TcpStream::connect(server.address).await.unwrap();
    let mut slow = TcpStream::connect(server.address).await.unwrap();
    slow.write_all(b"GET /healthz HTTP/1.1\r\nHost: x\r\nX-A: ").await.unwrap();
    for stream in [&mut silent, &mut slow] {
        let mut rest = Vec::new();
        let ended = tokio::time::timeout(Duration::from_secs(20), stream.read_to_end(&mut rest));
        ended.await.expect("the connection ends").unwrap();
    }
    assert_eq!(server.get("/healthz").await.status, 200);
}

#[tokio::test]
async fn who_asks_too_often_is_told_to_wait() {
    let server = Server::with(|config| {
        config.limits.requests.per_second = 1;
        config.limits.requests.burst = 2;
    });
    let server = server.await;
    let statuses = [(); 3].map(|()| server.get("/healthz"));
    let statuses = futures_util::future::join_all(statuses).await;
    let refused: Vec<_> = statuses.iter().filter(|answer| answer.status != 200).collect();
    assert_eq!(refused[0].problem(), (429, "too-many-requests".into()));
    assert!(refused[0].headers["retry-after"].parse::<u64>().unwrap() >= 1);
}

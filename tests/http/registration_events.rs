//! `/v1/registrations/{id}/events`

use hyper::Request;
use serde_json::Value;

use crate::server::{Answer, Server};
use crate::study::{quick, register, upload};

/// The events of a stream: id, name, data.
fn events(answer: &Answer) -> Vec<(u64, String, Value)> {
    let text = answer.text();
    let blocks = text.split("\n\n").filter(|block| !block.is_empty() && !block.starts_with(':'));
    blocks
        .map(|block| {
            let field = |name: &str| {
                let mut lines = block.lines().filter_map(|line| line.strip_prefix(name)?.strip_prefix(": "));
                lines.next().unwrap_or_else(|| panic!("{block}")).to_owned()
            };
            (field("id").parse().unwrap(), field("event"), serde_json::from_str(&field("data")).unwrap())
        })
        .collect()
}

#[tokio::test(flavor = "multi_thread")]
async fn the_whole_history_comes_and_goes_on_where_it_was_left() {
    let server = Server::start().await;
    let scans = upload(&server, 2).await;
    let done = register(&server, &quick(&scans)).await;
    let path = format!("/v1/registrations/{}/events", done["id"].as_str().unwrap());
    let all = events(&server.get(&path).await);
    let numbers: Vec<u64> = all.iter().map(|(id, ..)| *id).collect();
    assert!(numbers.is_sorted() && numbers[0] == 1, "{numbers:?}");
    let children = all.iter().filter(|(_, name, _)| name == "child").count();
    assert_eq!(children, 2);
    let (_, name, last) = all.last().unwrap();
    assert_eq!((name.as_str(), &last["status"]), ("status", &"succeeded".into()));
    let rest = Request::get(&path).header("last-event-id", numbers[1].to_string());
    assert_eq!(events(&server.send(rest, "").await), all[2..]);
    let odd = Request::get(&path).header("last-event-id", "x");
    assert_eq!(server.send(odd, "").await.problem(), (400, "bad-request".into()));
}

#[tokio::test(flavor = "multi_thread")]
async fn streams_end_with_the_server() {
    let server = Server::start().await;
    let scans = upload(&server, 1).await;
    let mut slow = quick(&scans);
    (slow["parameters"], slow["vertices"]) = (serde_json::json!({}), 40962.into());
    let path = crate::study::ask(&server, &slow).await.headers["location"].clone();
    let path = format!("{path}/events");
    let address = server.address;
    let stream = tokio::spawn(async move {
        use tokio::io::{AsyncReadExt, AsyncWriteExt};
        let mut stream = tokio::net::TcpStream::connect(address).await.unwrap();
        let head = format!("GET {path} HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n");
        stream.write_all(head.as_bytes()).await.unwrap();
        let mut text = String::new();
        stream.read_to_string(&mut text).await.unwrap();
        text
    });
    tokio::time::sleep(std::time::Duration::from_millis(300)).await;
    let start = std::time::Instant::now();
    server.end().await;
    assert!(stream.await.unwrap().contains("event: "));
    assert!(start.elapsed().as_secs() < 10, "the server took {:?} to end", start.elapsed());
}

//! How ends of registrations are told.

use std::time::Duration;

use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpListener;

use crate::server::Server;
use crate::study::{quick, register, upload};

const SECRET: &str = "whsec_MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw";

/// Answers one request with a status and gives its text.
async fn hear(listener: &TcpListener, status: &str) -> String {
    let (mut stream, _) =
        tokio::time::timeout(Duration::from_secs(30), listener.accept()).await.unwrap().unwrap();
    let mut bytes = Vec::new();
    loop {
        let count = stream.read_buf(&mut bytes).await.unwrap();
        let text = String::from_utf8_lossy(&bytes).into_owned();
        let Some((head, body)) = text.split_once("\r\n\r\n") else { continue };
        let length = head
            .lines()
            .find_map(|line| line.to_ascii_lowercase().strip_prefix("content-length: ")?.parse().ok());
        if count == 0 || body.len() >= length.unwrap_or(0) {
            let answer = format!("HTTP/1.1 {status}\r\nlocation: /elsewhere\r\ncontent-length: 0\r\n\r\n");
            stream.write_all(answer.as_bytes()).await.unwrap();
            return text;
        }
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn an_end_is_told_again_until_it_is_heard() {
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let server = Server::with(|config| {
        config.webhooks.allow_private_addresses = true;
        config.webhooks.allow_http = true;
        config.webhooks.secret = Some(SECRET.to_owned());
    });
    let server = server.await;
    let scans = upload(&server, 1).await;
    let mut request = quick(&scans);
    request["webhook"] = format!("http://{}/hook?x=1", listener.local_addr().unwrap()).into();
    let (done, first) = tokio::join!(register(&server, &request), hear(&listener, "302 Found"));
    assert!(first.starts_with("POST /hook?x=1 HTTP/1.1\r\n"), "{first}");
    // It is tried again after five seconds, a redirection being no success; as the same message.
    let second = hear(&listener, "204 No Content").await;
    let header = |text: &str, name: &str| {
        let found = text.lines().find_map(|line| line.strip_prefix(&format!("{name}: ")).map(str::to_owned));
        found.unwrap_or_else(|| panic!("{text}"))
    };
    assert_eq!(header(&first, "webhook-id"), header(&second, "webhook-id"));
    assert!(header(&second, "webhook-signature").starts_with("v1,"));
    let body: serde_json::Value = serde_json::from_str(second.split_once("\r\n\r\n").unwrap().1).unwrap();
    assert_eq!((&body["type"], &body["data"]["id"]), (&"registration.succeeded".into(), &done["id"]));
}

//! A client that speaks just enough HTTP, one connection a request.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::server::Server;

/// The status of an answer, and its body.
pub type Answer = (u16, Vec<u8>);

impl Server {
    /// Sends a request.
    pub fn send(&self, method: &str, path: &str, media_type: &str, body: &[u8]) -> std::io::Result<Answer> {
        let mut stream = TcpStream::connect(self.url.trim_start_matches("http://"))?;
        stream.set_read_timeout(Some(Duration::from_secs(60)))?;
        let length = body.len();
        write!(
            stream,
            "{method} {path} HTTP/1.0\r\nHost: onemesh\r\nContent-Type: {media_type}\r\nContent-Length: {length}\r\n\r\n"
        )?;
        stream.write_all(body)?;
        let mut answer = Vec::new();
        stream.read_to_end(&mut answer)?;
        let cut = || std::io::Error::other("the answer is cut off");
        let head = answer.windows(4).position(|window| window == b"\r\n\r\n").ok_or_else(cut)?;
        let status = String::from_utf8_lossy(&answer[..head]).split(' ').nth(1).and_then(|s| s.parse().ok());
        Ok((status.ok_or_else(cut)?, answer.split_off(head + 4)))
    }

    /// The JSON that a request gives, which must be answered well.
    pub fn json(&self, method: &str, path: &str, media_type: &str, body: &[u8]) -> Value {
        let (status, body) = self.send(method, path, media_type, body).unwrap();
        assert!(status < 300, "{method} {path}: {status}: {}", String::from_utf8_lossy(&body));
        serde_json::from_slice(&body).unwrap_or(Value::Null)
    }

    /// A registration at its end.
    pub fn ended(&self, path: &str, within: Duration) -> Value {
        let start = Instant::now();
        loop {
            let registration = self.json("GET", path, "", &[]);
            let status = registration["status"].as_str().unwrap();
            if !["queued", "running"].contains(&status) {
                return registration;
            }
            assert!(start.elapsed() < within, "{registration}");
            std::thread::sleep(Duration::from_millis(50));
        }
    }
}

//! The program as a server that can be killed, and a client that asks again until it is answered.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;

/// A running server; killed when it is dropped.
pub struct Server {
    child: Child,
    address: SocketAddr,
}

impl Server {
    /// Starts the program over a data folder and waits until it listens.
    pub fn start(folder: &Path) -> Self {
        let mut child = Command::new(env!("CARGO_BIN_EXE_onemesh"))
            .args(["serve", "--listen", "127.0.0.1:0", "--set", "data.keep_free_bytes=0", "--data"])
            .arg(folder)
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
        let line = lines.next().expect("the server says where it listens").unwrap();
        let address = line.strip_prefix("listening on http://").unwrap_or_else(|| panic!("{line}"));
        Self { address: address.parse().unwrap(), child }
    }

    /// Ends it at once, as a loss of power would.
    pub fn kill(mut self) {
        // SIGKILL: nothing of the program runs after it.
        self.child.kill().unwrap();
        self.child.wait().unwrap();
    }

    /// Sends a request; the answer's status and body.
    pub fn send(
        &self,
        method: &str,
        path: &str,
        media_type: &str,
        body: &[u8],
    ) -> std::io::Result<(u16, Vec<u8>)> {
        let mut stream = TcpStream::connect(self.address)?;
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

    /// The bytes of a file.
    pub fn file(&self, path: &str) -> Vec<u8> {
        let (status, body) = self.send("GET", path, "", &[]).unwrap();
        assert_eq!(status, 200, "{path}");
        body
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

impl Drop for Server {
    fn drop(&mut self) {
        // It may have been killed before.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

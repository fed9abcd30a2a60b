//! A server for one test, and a client that speaks just enough HTTP.

use std::collections::BTreeMap;

use http_body_util::{BodyExt, Full};
use hyper::{Method, Request, StatusCode};
use hyper_util::rt::TokioIo;
use onemesh::http::Service;
use onemesh::http::config::Config;
use onemesh::job::Database;
use onemesh::job::api_key::ApiKeys;
use serde_json::Value;
use tempfile::TempDir;
use tokio::net::TcpStream;
use tokio::sync::oneshot;

/// A tetrahedron as OBJ.
pub const OBJ: &str = "v 0 0 0\nv 20 0 0\nv 0 20 0\nv 0 0 20\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

/// The API keys of a server's folder, which need no server.
pub async fn keys(folder: &std::path::Path) -> ApiKeys {
    let data = folder.join("data");
    std::fs::create_dir_all(&data).unwrap();
    ApiKeys::new(Database::open(&data.join("onemesh.db")).await.unwrap())
}

/// A running server, which ends with this value.
pub struct Server {
    pub address: std::net::SocketAddr,
    pub folder: TempDir,
    stop: Option<oneshot::Sender<()>>,
    running: tokio::task::JoinHandle<()>,
}

/// An answer, read to its end.
#[derive(Debug)]
pub struct Answer {
    pub status: StatusCode,
    pub headers: BTreeMap<String, String>,
    pub body: Vec<u8>,
}

impl Server {
    pub async fn start() -> Self {
        Self::with(|_| {}).await
    }

    /// A server with some of its configuration changed.
    pub async fn with(change: impl FnOnce(&mut Config)) -> Self {
        Self::in_folder(tempfile::tempdir().unwrap(), change).await
    }

    /// A server over a data folder that was used before.
    pub async fn in_folder(folder: TempDir, change: impl FnOnce(&mut Config)) -> Self {
        let mut config = Config::default();
        config.server.listen.set_port(0);
        config.data.folder = folder.path().join("data");
        config.data.keep_free_bytes = 0;
        change(&mut config);
        let service = Service::open(config).await.unwrap();
        let address = service.address();
        let (stop, stopped) = oneshot::channel();
        let running = tokio::spawn(async move {
            let stopped = async move { drop(stopped.await) };
            service.run(stopped).await;
        });
        Self { address, folder, stop: Some(stop), running }
    }

    /// Ends it in order and gives its folder.
    pub async fn end(mut self) -> TempDir {
        drop(self.stop.take());
        self.running.await.unwrap();
        self.folder
    }

    pub async fn get(&self, path: &str) -> Answer {
        self.send(Request::get(path), "").await
    }

    pub async fn delete(&self, path: &str) -> Answer {
        self.send(Request::delete(path), "").await
    }

    pub async fn post(&self, path: &str, media_type: &str, body: impl Into<bytes::Bytes>) -> Answer {
        self.send(Request::post(path).header("content-type", media_type), body).await
    }

    pub async fn put(&self, path: &str, media_type: &str, body: impl Into<bytes::Bytes>) -> Answer {
        self.send(Request::put(path).header("content-type", media_type), body).await
    }

    pub async fn send(
        &self,
        request: hyper::http::request::Builder,
        body: impl Into<bytes::Bytes>,
    ) -> Answer {
        let stream = TcpStream::connect(self.address).await.unwrap();
        let (mut sender, connection) =
            hyper::client::conn::http1::handshake(TokioIo::new(stream)).await.unwrap();
        tokio::spawn(connection);
        let request = request.header("host", self.address.to_string()).body(Full::new(body.into())).unwrap();
        let head_only = request.method() == Method::HEAD;
        let response = sender.send_request(request).await.unwrap();
        let (head, body) = response.into_parts();
        let body = body.collect().await.unwrap().to_bytes().to_vec();
        assert!(!head_only || body.is_empty());
        let text = |value: &hyper::header::HeaderValue| value.to_str().unwrap().to_owned();
        let headers = head.headers.iter().map(|(name, value)| (name.to_string(), text(value))).collect();
        Answer { status: head.status, headers, body }
    }
}

impl Answer {
    pub fn json(&self) -> Value {
        serde_json::from_slice(&self.body).unwrap_or_else(|_| panic!("{}", self.text()))
    }

    pub fn text(&self) -> String {
        String::from_utf8_lossy(&self.body).into_owned()
    }

    /// The status, and the end of the problem's type; fails for anything but a well-formed problem.
    pub fn problem(&self) -> (u16, String) {
        assert_eq!(self.headers["content-type"], "application/problem+json", "{}", self.text());
        let problem = self.json();
        assert_eq!(problem["status"], self.status.as_u16());
        assert!(problem["title"].is_string() && problem["detail"].is_string(), "{problem}");
        let kind = problem["type"].as_str().unwrap().strip_prefix("urn:onemesh:problem:").unwrap();
        (self.status.as_u16(), kind.to_owned())
    }
}

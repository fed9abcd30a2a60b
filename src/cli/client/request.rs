use std::fmt;
use std::io::Read;
use std::str::FromStr;
use std::sync::Arc;
use std::time::Duration;

use serde::de::DeserializeOwned;
use tokio_rustls::rustls::crypto::ring;
use ureq::http::{self, Response, header};
use ureq::tls::{Certificate, RootCerts, TlsConfig};
use ureq::{Agent, Body, SendBody};
use url::Url;

use super::failure::{Failure, Refusal};
use super::patience::Patience;

/// How long a connection may take to come about.
const CONNECT: Duration = Duration::from_secs(10);
/// How long a server may be silent: it reads a large scan before it answers.
const SILENCE: Duration = Duration::from_secs(300);
/// How long a stream may be silent, in which the server says something every 15 seconds.
const HEARTBEAT: Duration = Duration::from_secs(40);
/// Bytes of an answer in JSON, at most.
const JSON_BYTES: u64 = 64 << 20;
/// Bytes of a problem, at most.
const PROBLEM_BYTES: u64 = 1 << 20;

/// Where a server is: `http://HOST:PORT`, perhaps with a path that the service lies under.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ServerUrl(String);

/// Asks one server.
#[derive(Debug, Clone)]
pub struct Client {
    agent: Agent,
    server: ServerUrl,
    authorization: Option<String>,
    /// How long is tried again what fails for now.
    pub patience: Patience,
}

impl FromStr for ServerUrl {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let url = Url::parse(text).map_err(|error| format!("{error}: write it as http://HOST:PORT"))?;
        if !matches!(url.scheme(), "http" | "https") || !url.has_host() {
            return Err("write it as http://HOST:PORT or https://HOST".to_owned());
        }
        if url.query().is_some() || url.fragment().is_some() || !url.username().is_empty() {
            return Err("write it without user, `?` and `#`".to_owned());
        }
        Ok(Self(url.as_str().trim_end_matches('/').to_owned()))
    }
}

impl fmt::Display for ServerUrl {
    fn fmt(&self, out: &mut fmt::Formatter) -> fmt::Result {
        out.write_str(&self.0)
    }
}

impl Client {
    /// A client of `server`, with an API key where one is needed.
    pub fn new(server: ServerUrl, key: Option<&str>, patience: Duration) -> Self {
        let mut config = Agent::config_builder()
            .http_status_as_error(false)
            .user_agent(concat!("onemesh/", env!("CARGO_PKG_VERSION")))
            .timeout_connect(Some(CONNECT))
            .timeout_per_write(Some(SILENCE));
        if server.0.starts_with("https:") {
            config = config.tls_config(tls());
        }
        let authorization = key.map(|key| format!("Bearer {}", key.trim()));
        Self { agent: config.build().into(), server, authorization, patience: Patience(patience) }
    }

    /// The server.
    pub fn server(&self) -> &ServerUrl {
        &self.server
    }

    /// The answer to a GET, if it is one of success or 304.
    ///
    /// # Errors
    /// [`Failure`]; it is not tried again.
    pub fn get(&self, path: &str, headers: &[(&str, &str)]) -> Result<Response<Body>, Failure> {
        self.send("GET", path, headers, SendBody::none(), SILENCE)
    }

    /// The answer to a GET that goes on and on, in which something comes every few seconds.
    ///
    /// # Errors
    /// [`Failure`]; it is not tried again.
    pub fn listen(&self, path: &str, headers: &[(&str, &str)]) -> Result<Response<Body>, Failure> {
        self.send("GET", path, headers, SendBody::none(), HEARTBEAT)
    }

    /// The JSON at a path, tried for as long as patience is.
    ///
    /// # Errors
    /// [`Failure`].
    pub fn get_json<T: DeserializeOwned>(&self, path: &str) -> Result<T, Failure> {
        self.patience.persist(|| json(self.get(path, &[])?))
    }

    /// The answer to a POST.
    ///
    /// # Errors
    /// [`Failure`]; it is not tried again.
    pub fn post(
        &self,
        path: &str,
        headers: &[(&str, &str)],
        body: SendBody,
    ) -> Result<Response<Body>, Failure> {
        self.send("POST", path, headers, body, SILENCE)
    }

    fn send(
        &self,
        method: &str,
        path: &str,
        headers: &[(&str, &str)],
        body: SendBody,
        silence: Duration,
    ) -> Result<Response<Body>, Failure> {
        let mut request = http::Request::builder().method(method).uri(format!("{}{path}", self.server));
        for (name, value) in headers {
            request = request.header(*name, *value);
        }
        if let Some(authorization) = &self.authorization {
            request = request.header(header::AUTHORIZATION, authorization);
        }
        let request = request.body(body).map_err(|error| Failure::Odd(error.to_string()))?;
        let request = self.agent.configure_request(request).timeout_per_read(Some(silence)).build();
        let failed = |error| Failure::Connection(format!("{}: {error}", self.server));
        let response = self.agent.run(request).map_err(failed)?;
        match response.status().as_u16() {
            200..300 | 304 => Ok(response),
            _ => Err(refusal(response)),
        }
    }
}

/// Whom to trust, as the system does.
fn tls() -> TlsConfig {
    let system = rustls_native_certs::load_native_certs().certs;
    let roots = system.iter().map(|certificate| Certificate::from_der(certificate).to_owned());
    TlsConfig::builder()
        .root_certs(RootCerts::from(roots))
        .unversioned_rustls_crypto_provider(Arc::new(ring::default_provider()))
        .build()
}

/// The JSON of an answer.
///
/// # Errors
/// [`Failure`].
pub fn json<T: DeserializeOwned>(response: Response<Body>) -> Result<T, Failure> {
    let bytes = bytes(response, JSON_BYTES)?;
    serde_json::from_slice(&bytes).map_err(|error| Failure::Odd(error.to_string()))
}

/// A header of an answer.
pub fn header_of<'a>(response: &'a Response<Body>, name: &str) -> Option<&'a str> {
    response.headers().get(name)?.to_str().ok()
}

fn bytes(response: Response<Body>, limit: u64) -> Result<Vec<u8>, Failure> {
    let mut bytes = Vec::new();
    let mut reader = response.into_body().into_reader().take(limit);
    reader.read_to_end(&mut bytes).map_err(|error| Failure::Connection(error.to_string()))?;
    Ok(bytes)
}

fn refusal(response: Response<Body>) -> Failure {
    let status = response.status().as_u16();
    let retry_after = header_of(&response, "retry-after").and_then(|text| text.parse().ok());
    let retry_after = retry_after.map(Duration::from_secs);
    // What a proxy on the way says has no such body: the status tells enough then.
    let body = bytes(response, PROBLEM_BYTES).unwrap_or_default();
    let problem = serde_json::from_slice(&body).unwrap_or_default();
    Failure::Refused(Box::new(Refusal { status, retry_after, problem }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn servers_are_written_as_addresses() {
        let read = |text: &str| text.parse::<ServerUrl>().map(|url| url.to_string());
        assert_eq!(read("http://127.0.0.1:8080/").unwrap(), "http://127.0.0.1:8080");
        assert_eq!(read("https://faces.example/onemesh/").unwrap(), "https://faces.example/onemesh");
        for wrong in ["localhost:8080", "faces.example", "ftp://a", "http://a/?x", "http://me@a/"] {
            assert!(read(wrong).unwrap_err().contains("write it"), "{wrong}");
        }
    }
}

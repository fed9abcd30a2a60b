//! One delivery: to an address that was looked at, without following redirects.

use std::net::SocketAddr;
use std::sync::{Arc, LazyLock};

use bytes::Bytes;
use http_body_util::Full;
use hyper::Request;
use hyper_util::rt::TokioIo;
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::net::{TcpStream, lookup_host};
use tokio_rustls::TlsConnector;
use tokio_rustls::rustls::pki_types::ServerName;
use tokio_rustls::rustls::{ClientConfig, RootCertStore, crypto};
use url::Url;

use super::address::is_public;

/// Whom to trust, as the system does.
static TLS: LazyLock<Arc<ClientConfig>> = LazyLock::new(|| {
    let mut roots = RootCertStore::empty();
    roots.add_parsable_certificates(rustls_native_certs::load_native_certs().certs);
    let provider = Arc::new(crypto::ring::default_provider());
    let versions = ClientConfig::builder_with_provider(provider).with_safe_default_protocol_versions();
    let builder = versions.expect("the provider knows the usual versions of TLS");
    Arc::new(builder.with_root_certificates(roots).with_no_client_auth())
});

/// Sends a POST and gives the answer's status.
///
/// # Errors
/// Why it was not answered, for the log.
pub(super) async fn post(
    url: &Url,
    headers: &[(&str, String)],
    body: Bytes,
    allow_private: bool,
) -> Result<u16, String> {
    let host = url.host_str().ok_or("the address names no host")?;
    let plain = host.trim_matches(['[', ']']);
    let port = url.port_or_known_default().unwrap_or(443);
    let addresses = lookup_host((plain, port)).await.map_err(|error| format!("{host}: {error}"))?;
    // What is connected to is what was looked at: a name that changes its address meanwhile gains nothing.
    let may = |address: &SocketAddr| allow_private || is_public(address.ip());
    let address = addresses.into_iter().find(may).ok_or_else(|| format!("{host}: has no public address"))?;
    let stream = TcpStream::connect(address).await.map_err(|error| format!("{address}: {error}"))?;
    let mut request = Request::post(&url[url::Position::BeforePath..url::Position::AfterQuery])
        .header("host", &url[url::Position::BeforeHost..url::Position::AfterPort]);
    for (name, value) in headers {
        request = request.header(*name, value);
    }
    let request = request.body(Full::new(body)).map_err(|error| error.to_string())?;
    if url.scheme() == "http" {
        return exchange(stream, request).await;
    }
    let name = ServerName::try_from(plain.to_owned()).map_err(|error| error.to_string())?;
    let stream = TlsConnector::from(TLS.clone()).connect(name, stream).await;
    exchange(stream.map_err(|error| format!("{host}: {error}"))?, request).await
}

async fn exchange<S>(stream: S, request: Request<Full<Bytes>>) -> Result<u16, String>
where
    S: AsyncRead + AsyncWrite + Unpin + Send + 'static,
{
    let text = |error: hyper::Error| error.to_string();
    let (mut sender, connection) =
        hyper::client::conn::http1::handshake(TokioIo::new(stream)).await.map_err(text)?;
    // Nothing of the answer's body is read: the connection ends with the exchange.
    tokio::select! {
        response = sender.send_request(request) => response.map(|response| response.status().as_u16()).map_err(text),
        ended = connection => Err(ended.err().map_or_else(|| "hung up".to_owned(), text)),
    }
}

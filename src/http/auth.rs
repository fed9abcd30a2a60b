//! Who asks, whether they may, and how often.

use std::net::SocketAddr;

use axum::extract::{ConnectInfo, Request, State};
use axum::http::header::AUTHORIZATION;
use axum::http::{HeaderMap, Method};
use axum::middleware::Next;
use axum::response::Response;

use super::app::App;
use super::problem::{Kind, Problem};
use crate::job::api_key::Scope;

/// Who asks: the id of their API key; nobody where no keys are needed.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Client {
    /// The key's id.
    pub key: Option<String>,
}

/// Paths that everybody may look at.
const OPEN: [&str; 3] = ["/healthz", "/readyz", "/openapi.json"];

/// Lets a request through whose key allows it, and counts it; leaves a [`Client`] for the routes.
///
/// # Errors
/// A [`Problem`].
pub async fn admit(State(app): State<App>, mut request: Request, next: Next) -> Result<Response, Problem> {
    let path = request.uri().path();
    let open = OPEN.contains(&path) || path == "/docs" || path.starts_with("/docs/");
    let client = if app.config.needs_keys() && !open {
        key_of(&app, request.method(), request.headers()).await?
    } else {
        Client::default()
    };
    let address = request.extensions().get::<ConnectInfo<SocketAddr>>().map(|info| info.0.ip().to_string());
    app.rates.count(client.key.as_ref().or(address.as_ref()).map_or("", String::as_str))?;
    request.extensions_mut().insert(client);
    Ok(next.run(request).await)
}

async fn key_of(app: &App, method: &Method, headers: &HeaderMap) -> Result<Client, Problem> {
    let header = headers.get(AUTHORIZATION).and_then(|value| value.to_str().ok());
    let text = header.and_then(|value| value.split_once(' '));
    let text = text.filter(|(scheme, _)| scheme.eq_ignore_ascii_case("bearer")).map(|(_, text)| text.trim());
    let remedy = "send `Authorization: Bearer` and a key; `onemesh key create` makes one";
    let Some(text) = text else {
        return Err(Problem::of_field(Kind::Unauthorized, "Authorization", "holds no key", remedy));
    };
    let Some(key) = app.keys.find(text).await? else {
        return Err(Problem::of_field(Kind::Unauthorized, "Authorization", "the key is not known", remedy));
    };
    let reads = [Method::GET, Method::HEAD, Method::OPTIONS].contains(method);
    if key.scope < Scope::Write && !reads {
        let finding = format!("the key `{}` is for reading", key.id);
        let remedy = "use a key made with `--scope write`";
        return Err(Problem::of_field(Kind::Forbidden, "Authorization", finding, remedy));
    }
    Ok(Client { key: Some(key.id) })
}

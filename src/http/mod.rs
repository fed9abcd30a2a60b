//! The service over HTTP: routes, wire types, problems, the OpenAPI document. Layer 6.

mod app;
mod auth;
mod blob_answer;
mod capture_upload;
pub mod config;
mod config_source;
mod connections;
mod document;
mod event_stream;
mod extract;
mod idempotency;
mod job_answer;
mod metrics;
mod observe;
mod page;
mod problem;
mod rate;
mod refusal;
mod routes;
mod service;
mod upload;
mod webhook;
mod wire;
mod zip_stream;

use axum::extract::DefaultBodyLimit;
use axum::response::{IntoResponse, Response};
use axum::{Json, Router, middleware, routing};
use tower_http::catch_panic::CatchPanicLayer;
use utoipa::OpenApi;
use utoipa_axum::router::OpenApiRouter;
use utoipa_swagger_ui::SwaggerUi;

pub use app::{App, Parts};
pub use config_source::ConfigError;
pub use problem::{Kind, Problem};
pub use service::{Service, ServiceError};

/// The OpenAPI document, as `openapi/onemesh.v1.json` holds it.
pub fn openapi_json() -> String {
    let (_, document) = documented_routes();
    let mut text = document.to_pretty_json().unwrap_or_default();
    text.push('\n');
    text
}

fn documented_routes() -> (Router<App>, utoipa::openapi::OpenApi) {
    let beginning = OpenApiRouter::with_openapi(document::Beginning::openapi());
    let (router, mut api) = beginning.merge(routes::router()).split_for_parts();
    document::complete(&mut api);
    (router, api)
}

/// All routes with what goes around them.
fn router(app: App) -> Router {
    let (routes, document) = documented_routes();
    let ui = SwaggerUi::new("/docs").config(utoipa_swagger_ui::Config::new(["/openapi.json"]));
    routes
        .route("/openapi.json", routing::get(async move || Json(document)))
        .merge(ui)
        .fallback(async || Problem::not_found("there is nothing at this path; /docs lists what there is"))
        .method_not_allowed_fallback(async || {
            Problem::new(Kind::MethodNotAllowed, "see /docs for this path's methods")
        })
        // Uploads are counted as they are stored.
        .layer(DefaultBodyLimit::disable())
        .layer(middleware::from_fn_with_state(app.clone(), idempotency::replay))
        .layer(middleware::from_fn_with_state(app.clone(), auth::admit))
        .layer(CatchPanicLayer::custom(|_| crashed()))
        .layer(middleware::from_fn_with_state(app.clone(), observe::observe))
        .with_state(app)
}

fn crashed() -> Response {
    tracing::error!("a request crashed");
    Problem::new(Kind::Internal, "the request crashed, which is a fault of ours").into_response()
}

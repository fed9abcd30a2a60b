//! `/healthz`, `/readyz`, `/metrics`

use axum::Json;
use axum::extract::State;
use axum::http::HeaderName;
use axum::http::header::CONTENT_TYPE;
use serde::Serialize;
use utoipa::ToSchema;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::http::app::App;
use crate::http::metrics::{JobLabels, StatusLabels};
use crate::http::problem::{Kind, Problem};
use crate::http::upload::check_room;

/// What OpenMetrics is called.
const OPEN_METRICS: &str = "application/openmetrics-text; version=1.0.0; charset=utf-8";

pub fn router() -> OpenApiRouter<App> {
    OpenApiRouter::new().routes(routes!(health)).routes(routes!(ready)).routes(routes!(metrics))
}

/// How the service is.
#[derive(Debug, Serialize, ToSchema)]
#[schema(example = json!({ "status": "ok" }))]
struct Health {
    /// `ok`.
    #[schema(pattern = "^ok$")]
    status: &'static str,
}

const OK: Json<Health> = Json(Health { status: "ok" });

/// Says that the server lives
#[utoipa::path(
    get, path = "/healthz", operation_id = "get_health", tag = "service",
    responses((status = 200, description = "It does.", body = Health)),
)]
async fn health() -> Json<Health> {
    OK
}

/// Says whether the server takes work
///
/// Not while its disk is full or cannot be written, and not when it is about to end.
#[utoipa::path(
    get, path = "/readyz", operation_id = "get_readiness", tag = "service",
    responses((status = 200, description = "It does.", body = Health)),
)]
async fn ready(State(app): State<App>) -> Result<Json<Health>, Problem> {
    if app.ending.is_cancelled() {
        return Err(Problem::new(Kind::ShuttingDown, "the server is about to end").retry_after(5));
    }
    check_room(&app)?;
    let probed = app.clone();
    let probe = tokio::task::spawn_blocking(move || probed.folder.check_writable()).await;
    probe.map_err(|_| Problem::new(Kind::Internal, "the data folder could not be looked at"))??;
    app.database.check().await?;
    if let Some(reason) = app.jobs.figures().await?.paused {
        return Err(Problem::new(Kind::StorageUnavailable, reason).retry_after(60));
    }
    Ok(OK)
}

/// Counts things, for Prometheus
#[utoipa::path(
    get, path = "/metrics", operation_id = "get_metrics", tag = "service",
    responses((status = 200, description = "OpenMetrics.", body = String, content_type = "application/openmetrics-text",
        example = "# TYPE onemesh_http_requests counter\n# EOF\n")),
)]
async fn metrics(State(app): State<App>) -> Result<([(HeaderName, &'static str); 1], String), Problem> {
    let figures = app.jobs.figures().await?;
    for (kind, status, count) in figures.jobs {
        let labels = JobLabels { kind: kind.name(), status: status.name() };
        app.metrics.jobs.get_or_create(&labels).set(count.cast_signed());
    }
    for (status, count) in [("ready", figures.steps_ready), ("running", figures.steps_running)] {
        app.metrics.steps.get_or_create(&StatusLabels { status }).set(count.cast_signed());
    }
    for (stage, (steps, seconds)) in figures.stages {
        app.metrics.set_stage(stage, steps, seconds);
    }
    for residual in app.jobs.take_residuals() {
        app.metrics.residuals.observe(residual);
    }
    app.metrics.free_bytes.set(app.folder.free_bytes()? as f64);
    Ok(([(CONTENT_TYPE, OPEN_METRICS)], app.metrics.text()))
}

//! `/v1/capabilities`

use axum::Json;
use axum::extract::State;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::http::app::App;
use crate::http::wire::capabilities::Capabilities;

pub fn router() -> OpenApiRouter<App> {
    OpenApiRouter::new().routes(routes!(get))
}

/// Says what the service takes and can do
#[utoipa::path(
    get, path = "/v1/capabilities", operation_id = "get_capabilities", tag = "service",
    responses((status = 200, description = "Formats, limits, parameters.", body = Capabilities)),
)]
async fn get(State(app): State<App>) -> Json<Capabilities> {
    let renderer = app.jobs.renderer().await;
    Json(Capabilities::of(&app.config, renderer))
}

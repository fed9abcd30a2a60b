//! One file per resource.

mod capabilities;
mod health;
mod inverse_rendering_files;
mod inverse_renderings;
mod registration_events;
mod registration_results;
mod registrations;
mod scan_files;
mod scans;
mod templates;

use utoipa_axum::router::OpenApiRouter;

use super::app::App;

/// Every route.
pub fn router() -> OpenApiRouter<App> {
    OpenApiRouter::new()
        .merge(scans::router())
        .merge(scan_files::router())
        .merge(templates::router())
        .merge(registrations::router())
        .merge(registration_events::router())
        .merge(registration_results::router())
        .merge(inverse_renderings::router())
        .merge(inverse_rendering_files::router())
        .merge(capabilities::router())
        .merge(health::router())
}

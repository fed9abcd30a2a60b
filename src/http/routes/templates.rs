//! `/v1/templates`

use axum::Json;
use axum::extract::{Request, State};
use axum::http::header::LOCATION;
use axum::http::{HeaderName, StatusCode};
use serde::Deserialize;
use utoipa::IntoParams;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::http::app::App;
use crate::http::extract::{Id, QueryOf};
use crate::http::page::{LAST_PLACE, Page, PageQuery};
use crate::http::problem::{Kind, Problem};
use crate::http::upload::receive;
use crate::http::wire::Binary;
use crate::http::wire::form::TemplateForm;
use crate::http::wire::scan::Name;
use crate::http::wire::template::TemplateView;
use crate::job::scan::{NewScan, Part};
use crate::job::template::{NewTemplate, TemplateId};

pub fn router() -> OpenApiRouter<App> {
    OpenApiRouter::new().routes(routes!(create, list)).routes(routes!(get, delete))
}

/// What is said of an uploaded template beside its bytes.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
struct TemplateQuery {
    /// What people call it.
    #[param(nullable = false)]
    name: Option<Name>,
}

/// Uploads a template
///
/// A mesh with its landmarks, and perhaps a mask, as a form, or the `template.frozen.glb` of a finished registration as the body. The same files under
/// the same name again give the same template, with status 200.
#[utoipa::path(
    post, path = "/v1/templates", operation_id = "create_template", tag = "templates",
    params(TemplateQuery),
    request_body(description = "A form with a mesh and its landmarks, or a frozen template.", content(
        (TemplateForm = "multipart/form-data"), (Binary = "model/gltf-binary"), (Binary = "application/octet-stream"),
    )),
    responses(
        (status = 201, description = "It is kept.", body = TemplateView, headers(("Location" = String, description = "Its path."))),
        (status = 200, description = "It was there already.", body = TemplateView, headers(("Location" = String, description = "Its path."))),
    ),
)]
async fn create(
    State(app): State<App>,
    QueryOf(query): QueryOf<TemplateQuery>,
    request: Request,
) -> Result<(StatusCode, [(HeaderName, String); 1], Json<TemplateView>), Problem> {
    let NewScan { name, kind, mesh, landmarks, mask, .. } =
        receive(&app, request, &[Part::Mesh, Part::Landmarks, Part::Mask]).await?;
    let name = name.or(query.name.map(Into::into));
    let (template, new) = app.templates.add(NewTemplate { name, kind, mesh, landmarks, mask }).await?;
    let status = if new { StatusCode::CREATED } else { StatusCode::OK };
    Ok((status, [(LOCATION, format!("/v1/templates/{}", template.id))], Json(template.into())))
}

/// Lists templates
///
/// The built-in one, then the uploaded ones, the latest first.
#[utoipa::path(
    get, path = "/v1/templates", operation_id = "list_templates", tag = "templates",
    params(PageQuery),
    responses((status = 200, description = "A part of the list.", body = Page<TemplateView>)),
)]
async fn list(
    State(app): State<App>,
    QueryOf(query): QueryOf<PageQuery>,
) -> Result<Json<Page<TemplateView>>, Problem> {
    let first = query.after.is_none().then(|| (LAST_PLACE, TemplateView::built_in()));
    let templates = app.templates.list(query.limit + 1, query.after).await?;
    let uploaded = templates.into_iter().map(|template| (template.sequence, template.into()));
    Ok(Json(Page::of(query.limit, first.into_iter().chain(uploaded).collect())))
}

/// Tells of a template
#[utoipa::path(
    get, path = "/v1/templates/{id}", operation_id = "get_template", tag = "templates",
    params(("id" = String, Path, description = "`default`, or the template's id.", pattern = "^(default|[0-9a-f]{32})$")),
    responses((status = 200, description = "What is known of it.", body = TemplateView)),
)]
async fn get(State(app): State<App>, Id(id): Id<String>) -> Result<Json<TemplateView>, Problem> {
    if id == TemplateView::DEFAULT {
        return Ok(Json(TemplateView::built_in()));
    }
    let id: TemplateId = id.parse().map_err(Problem::not_found)?;
    Ok(Json(app.templates.get(&id).await?.into()))
}

/// Deletes a template
///
/// Registrations that were asked for before are not disturbed.
#[utoipa::path(
    delete, path = "/v1/templates/{id}", operation_id = "delete_template", tag = "templates",
    params(("id" = String, Path, description = "The template's id.", pattern = "^(default|[0-9a-f]{32})$")),
    responses((status = 204, description = "It is gone.")),
)]
async fn delete(State(app): State<App>, Id(id): Id<String>) -> Result<StatusCode, Problem> {
    if id == TemplateView::DEFAULT {
        return Err(Problem::new(Kind::Conflict, "the built-in template stays"));
    }
    let id: TemplateId = id.parse().map_err(Problem::not_found)?;
    app.templates.delete(&id).await?;
    Ok(StatusCode::NO_CONTENT)
}

//! The OpenAPI document: what the routes say of themselves, and what holds for all of them.

use utoipa::OpenApi;
use utoipa::openapi::path::{HttpMethod, Operation, Parameter, ParameterBuilder, ParameterIn};
use utoipa::openapi::security::{Http, HttpAuthScheme, SecurityRequirement, SecurityScheme};
use utoipa::openapi::{
    ContentBuilder, HeaderBuilder, ObjectBuilder, PathItem, Ref, RefOr, Required, ResponseBuilder, Type,
};

use super::problem::{PROBLEM_JSON, ProblemBody};
use super::wire::registration::EventView;

/// What the document begins with.
#[derive(OpenApi)]
#[openapi(
    info(
        title = "onemesh",
        description = "One mesh for every face: registers collections of 3D face scans onto one shared triangle mesh, and makes \
            meshes from pictures with cameras.\n\n\
            Upload scans with their landmarks, ask for a registration, follow its events, download the results.",
    ),
    tags(
        (name = "scans", description = "Surfaces to be registered, with their landmarks, masks and textures."),
        (name = "templates", description = "What results take their triangles from."),
        (name = "registrations", description = "Work that is asked for, watched and stopped."),
        (name = "inverse renderings", description = "Meshes from pictures with cameras: asked for, watched and stopped."),
        (name = "results", description = "What registrations leave. It never changes."),
        (name = "service", description = "The service itself."),
    ),
    components(schemas(ProblemBody, EventView)),
    servers((url = "/")),
)]
pub(super) struct Beginning;

/// The API key's scheme.
const KEY: &str = "api_key";
/// Operations that need no key.
const OPEN: [&str; 2] = ["get_health", "get_readiness"];

/// Adds what holds for all routes: problems, keys, idempotency, ranges.
pub(super) fn complete(document: &mut utoipa::openapi::OpenApi) {
    let scheme = SecurityScheme::Http(Http::new(HttpAuthScheme::Bearer));
    document.components.get_or_insert_default().add_security_scheme(KEY, scheme);
    for item in document.paths.paths.values_mut() {
        for (method, operation) in operations(item) {
            complete_operation(&method, operation);
        }
    }
}

/// A path's operations.
pub fn operations(item: &mut PathItem) -> impl Iterator<Item = (HttpMethod, &mut Operation)> {
    let all = [
        (HttpMethod::Get, item.get.as_mut()),
        (HttpMethod::Put, item.put.as_mut()),
        (HttpMethod::Post, item.post.as_mut()),
        (HttpMethod::Delete, item.delete.as_mut()),
    ];
    all.into_iter().filter_map(|(method, operation)| Some((method, operation?)))
}

fn complete_operation(method: &HttpMethod, operation: &mut Operation) {
    let posts = *method == HttpMethod::Post;
    let reads = *method == HttpMethod::Get;
    if posts {
        operation.parameters.get_or_insert_default().push(idempotency_key().into());
    }
    let places: Vec<ParameterIn> = operation.parameters.iter().flatten().filter_map(place).collect();
    let in_path = places.contains(&ParameterIn::Path);
    let elsewhere = places.iter().any(|place| *place != ParameterIn::Path);
    let id = operation.operation_id.clone().unwrap_or_default();
    let file = gives_file(operation);
    let open = OPEN.contains(&id.as_str());
    let body = operation.request_body.is_some();
    let conflicts = posts || file || id == "delete_template";
    let problems = [
        (400, body || elsewhere, "The request cannot be understood."),
        (401, !open, "An API key is needed."),
        (403, !open && !reads, "The API key does not allow it."),
        (404, in_path, "There is no such thing."),
        (409, conflicts, "Not in this state."),
        (413, body, "More was sent than is taken."),
        (415, body, "The media type is not one that is read here."),
        (416, file, "The range is not within the file."),
        (422, body || posts, "A field or a file cannot be used."),
        (429, true, "Too many requests, or registrations at once."),
        (500, true, "The server failed."),
        (503, true, "Nothing can be kept for now, or the server is about to end."),
    ];
    for (status, may, description) in problems {
        if may {
            operation.responses.responses.insert(status.to_string(), problem(status, description));
        }
    }
    if file {
        let headers = [("ETag", "The file's tag.")];
        let whole = operation.responses.responses.get("200").cloned();
        let part = match whole {
            Some(RefOr::T(mut whole)) => {
                "A part of the file.".clone_into(&mut whole.description);
                RefOr::T(whole)
            }
            _ => return,
        };
        operation.responses.responses.insert("206".to_owned(), part);
        let mut known = ResponseBuilder::new().description("The client has it.");
        for (name, description) in headers {
            known = known.header(
                name,
                HeaderBuilder::new().schema(Some(text())).description(Some(description)).build(),
            );
        }
        operation.responses.responses.insert("304".to_owned(), known.build().into());
    }
    if !open {
        let none = SecurityRequirement::default();
        operation.security = Some(vec![SecurityRequirement::new::<_, [&str; 0], _>(KEY, []), none]);
    }
}

/// Where a parameter stands.
fn place(parameter: &RefOr<Parameter>) -> Option<ParameterIn> {
    match parameter {
        RefOr::T(parameter) => Some(parameter.parameter_in.clone()),
        RefOr::Ref(_) => None,
    }
}

/// Whether an operation answers with a stored file, which comes in ranges and has a tag.
fn gives_file(operation: &Operation) -> bool {
    let ok = operation.responses.responses.get("200");
    matches!(ok, Some(RefOr::T(response)) if response.headers.contains_key("ETag"))
}

fn problem(status: u16, description: &str) -> RefOr<utoipa::openapi::Response> {
    let schema = Ref::from_schema_name("Problem");
    let content = ContentBuilder::new().schema(Some(schema)).build();
    let mut response = ResponseBuilder::new().description(description).content(PROBLEM_JSON, content);
    if status == 429 || status == 503 {
        let header = HeaderBuilder::new().schema(Some(text())).description(Some("Seconds to wait.")).build();
        response = response.header("Retry-After", header);
    }
    response.build().into()
}

fn idempotency_key() -> Parameter {
    let description = "Sent again with the same key, the request is answered as the first time; for a day. A UUID is a good one.";
    ParameterBuilder::new()
        .name("Idempotency-Key")
        .parameter_in(ParameterIn::Header)
        .required(Required::False)
        .description(Some(description))
        .example(Some("8e03978e-40d5-43e8-bc93-6894a57f9324".into()))
        .schema(Some(ObjectBuilder::new().schema_type(Type::String).pattern(Some("^[!-~]{1,255}$"))))
        .build()
}

fn text() -> ObjectBuilder {
    ObjectBuilder::new().schema_type(Type::String)
}

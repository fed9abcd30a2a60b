//! What goes over the wire: these types alone derive the OpenAPI schema, and are made from the domain's.

pub mod capabilities;
pub mod form;
pub mod inverse_rendering;
pub mod registration;
pub mod scan;
pub mod template;
mod time;

pub use time::rfc3339;

/// The bytes of a file.
#[derive(serde::Deserialize, utoipa::ToSchema)]
#[schema(value_type = String, format = Binary)]
pub struct Binary(#[allow(dead_code)] Vec<u8>);

use serde::Deserialize;
use utoipa::ToSchema;

use super::Binary;
use super::scan::Name;

/// A scan as a form.
#[derive(Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[allow(dead_code)]
pub struct ScanForm {
    /// The mesh; its field's Content-Type, or the end of its file name, says what it is.
    #[schema(value_type = Binary)]
    mesh: Binary,
    /// The landmarks, in any form that is read.
    #[schema(value_type = Binary, nullable = false)]
    landmarks: Option<Binary>,
    /// The mask, in any form that is read.
    #[schema(value_type = Binary, nullable = false)]
    mask: Option<Binary>,
    /// The texture: PNG or JPEG.
    #[schema(value_type = Binary, nullable = false)]
    texture: Option<Binary>,
    /// What people call it.
    #[schema(nullable = false)]
    name: Option<Name>,
}

/// A template as a form.
#[derive(Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[allow(dead_code)]
pub struct TemplateForm {
    /// The mesh; its field's Content-Type, or the end of its file name, says what it is.
    #[schema(value_type = Binary)]
    mesh: Binary,
    /// Its landmarks; a frozen collection has its own.
    #[schema(value_type = Binary, nullable = false)]
    landmarks: Option<Binary>,
    /// How much each of its vertices takes of the scans' data, in any form that masks of scans have; a frozen collection has
    /// its own.
    #[schema(value_type = Binary, nullable = false)]
    mask: Option<Binary>,
    /// What people call it.
    #[schema(nullable = false)]
    name: Option<Name>,
}

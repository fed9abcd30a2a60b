use serde::Serialize;
use utoipa::ToSchema;

use crate::formats::LandmarkFile;
use crate::formats::MaskFile;
use crate::http::config::Config;
use crate::job::JobError;
use crate::job::scan::MeshKind;
use crate::render::Adapter;

/// Vertices of the built-in template unless a registration says otherwise.
pub const USUAL_VERTICES: usize = 10242;

/// What the service takes and can do.
#[derive(Debug, Serialize, ToSchema)]
#[schema(example = json!({
    "version": "0.1.0",
    "mesh_media_types": ["model/obj", "model/ply"],
    "landmark_files": ["json", "pp"],
    "mask_files": ["json", "png"],
    "presets": ["default", "paper"],
    "template_vertices": [642, 2562, 10242, 40962],
    "priorities": ["low", "normal", "high"],
    "keys_required": false,
    "renderer": { "name": "llvmpipe (LLVM 15.0.6, 256 bits)", "kind": "software", "driver": "llvmpipe, Mesa 22.3.6" },
    "limits": {
        "upload_bytes": 536870912, "vertices": 5000000, "triangles": 10000000, "texture_pixels": 268435456,
        "unpacked_bytes": 2147483648_u64, "zip_files": 64, "capture_upload_bytes": 2147483648_u64,
        "capture_bytes": 4294967296_u64, "capture_files": 4000, "capture_views": 1000, "capture_picture_pixels": 64000000,
        "scans_per_registration": 5000,
        "unfinished_registrations": 1000, "requests_per_second": 500, "step_seconds": 1200,
        "registration_seconds": 86400
    },
    "retention_days": { "scans": 30, "registrations": 30 }
}))]
pub struct Capabilities {
    /// The program's version.
    version: &'static str,
    /// Media types that meshes may have.
    mesh_media_types: Vec<&'static str>,
    /// Ends of the names of landmark files that are read; what they are is told from their content.
    landmark_files: Vec<&'static str>,
    /// The same of masks.
    mask_files: Vec<&'static str>,
    /// Where a registration's parameters may begin.
    presets: Vec<&'static str>,
    /// How many vertices the built-in template may have.
    template_vertices: Vec<u64>,
    /// Which registrations may go first.
    priorities: Vec<&'static str>,
    /// Whether requests need an API key.
    keys_required: bool,
    /// What draws inverse renderings.
    renderer: RendererView,
    /// How much is taken.
    limits: LimitsView,
    /// How long things are kept.
    retention_days: RetentionView,
}

/// What draws inverse renderings, or why nothing does.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = RendererStatus)]
pub struct RendererView {
    /// As its driver calls it.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    name: Option<String>,
    /// `discrete`, `integrated`, `virtual`, `software` or `reference`.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    kind: Option<String>,
    /// The driver with its version.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    driver: Option<String>,
    /// Why nothing draws, and what to do.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    problem: Option<String>,
}

impl From<Result<Adapter, JobError>> for RendererView {
    fn from(found: Result<Adapter, JobError>) -> Self {
        match found {
            Ok(Adapter { name, kind, driver }) => {
                Self { name: Some(name), kind: Some(kind.to_string()), driver: Some(driver), problem: None }
            }
            Err(error) => Self { name: None, kind: None, driver: None, problem: Some(error.to_string()) },
        }
    }
}

/// How much is taken.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = Limits)]
pub struct LimitsView {
    /// Bytes of one uploaded file.
    upload_bytes: u64,
    /// Vertices of a mesh.
    vertices: u64,
    /// Triangles of a mesh.
    triangles: u64,
    /// Pixels of a texture.
    texture_pixels: u64,
    /// Bytes of a zip when it is unpacked.
    unpacked_bytes: u64,
    /// Files in a zip.
    zip_files: u64,
    /// Bytes of one file of pictures with cameras, as a zip of them.
    capture_upload_bytes: u64,
    /// Bytes of all their files, unpacked.
    capture_bytes: u64,
    /// Files of them.
    capture_files: u64,
    /// Pictures.
    capture_views: u64,
    /// Pixels of one.
    capture_picture_pixels: u64,
    /// Scans of one registration.
    scans_per_registration: u64,
    /// Unfinished registrations of one API key.
    unfinished_registrations: u64,
    /// Requests a second of one client.
    requests_per_second: u64,
    /// Seconds that one step, as the fit of one scan, may take.
    step_seconds: u64,
    /// Seconds of work that one registration may take, over all its steps.
    registration_seconds: u64,
}

/// How long things are kept, in days; 0 keeps them.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = Retention)]
pub struct RetentionView {
    /// Scans, from their last upload.
    scans: u32,
    /// Registrations and their results, from their end.
    registrations: u32,
}

impl Capabilities {
    /// Those of a service so configured, that draws with what was found.
    pub fn of(config: &Config, renderer: Result<Adapter, JobError>) -> Self {
        let (scan, registration) = (&config.limits.scan, &config.limits.registration);
        let capture = &config.limits.capture;
        Self {
            version: env!("CARGO_PKG_VERSION"),
            mesh_media_types: MeshKind::ALL.map(MeshKind::media_type).to_vec(),
            landmark_files: LandmarkFile::EXTENSIONS.to_vec(),
            mask_files: MaskFile::EXTENSIONS.to_vec(),
            presets: vec!["default", "paper"],
            template_vertices: vec![642, 2562, 10242, 40962],
            priorities: vec!["low", "normal", "high"],
            keys_required: config.needs_keys(),
            renderer: renderer.into(),
            limits: LimitsView {
                upload_bytes: scan.upload_bytes,
                vertices: scan.vertices as u64,
                triangles: scan.triangles as u64,
                texture_pixels: scan.texture_pixels,
                unpacked_bytes: scan.unpacked_bytes,
                zip_files: scan.zip_files as u64,
                capture_upload_bytes: capture.upload_bytes,
                capture_bytes: capture.bytes,
                capture_files: capture.files as u64,
                capture_views: capture.views as u64,
                capture_picture_pixels: capture.picture_pixels,
                scans_per_registration: registration.scans as u64,
                unfinished_registrations: registration.unfinished_per_key as u64,
                requests_per_second: config.limits.requests.per_second.into(),
                step_seconds: registration.step_seconds,
                registration_seconds: registration.seconds,
            },
            retention_days: RetentionView {
                scans: config.retention.scan_days,
                registrations: config.retention.registration_days,
            },
        }
    }
}

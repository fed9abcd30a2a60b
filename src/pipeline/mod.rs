//! The paper's stages over a collection: fit, resample, register, and what we add to them. Layer 4.

mod capture;
mod carried;
mod comparison;
mod confidence;
mod connectivity;
mod density_term;
mod fit;
mod frozen;
mod groupwise;
mod head;
mod invert;
mod known;
mod landmark_weights;
mod laying;
mod manifest;
mod mask;
mod matching;
mod membership;
mod observer;
mod output;
mod package;
mod plan;
mod precheck;
mod presets;
mod register;
mod report;
mod resample;
mod scan_result;
mod scan_surface;
mod setting_name;
mod settings;
mod sphere;
mod sphere_course;
mod state;
mod strays;
mod template;
mod transfer;
mod verdict;

pub use capture::{CaptureSettings, capture, studio_light};
pub use comparison::{ComparisonRow, MOST_ROWS, comparison_row, comparison_sheet};
pub use confidence::confidence;
pub use connectivity::Connectivity;
pub use fit::{SphereLandmark, fit};
pub use frozen::{FrozenCollection, FrozenError};
pub use head::head;
pub use invert::{
    AdapterEntry, Albedo, HullReport, Inversion, InversionReport, InvertError, InvertLevel, InvertPreset,
    InvertSettings, Shown, Smooth, UnitSpace, ViewPictures, ViewReport, Views, What, invert,
};
pub use landmark_weights::LandmarkWeights;
pub use manifest::{InputEntry, LandmarkEntry, Manifest, OutputEntry, ScanEntry, TemplateEntry};
pub use mask::MaskError;
pub use membership::{FailedScan, leave_out};
pub use observer::{Canceled, Observer, Progress, Stage, Watch};
pub use output::{OutputFormat, Outputs, ResultMesh};
pub use package::{
    MANIFEST, Package, PackageError, REPORT, SHEET, TEMPLATE, record_bytes, spare_inputs, vertex_normals,
};
pub use plan::{Plan, PlanStage, Prepared};
pub use precheck::{Inspected, Precheck, audit_landmarks, precheck, precheck_inspected};
pub use register::{LEAST_LANDMARKS, RegisterError, Registration, Subject, fit_scan, register, register_to};
pub use report::{Report, ScanReport};
pub use scan_result::ScanResult;
pub use scan_surface::{ScanSurface, SurfaceSample};
pub use settings::{
    Density, FitSettings, GroupwiseSettings, LevelSettings, Preset, Ramp, ResampleSettings, SettingError,
    Settings,
};
pub use sphere::Sphere;
pub use sphere_course::{Aligned, SphereCourse};
pub use state::{BadState, Contribution, Mean, Placed, ScanState, SharedState, decode, encode};
pub use template::Template;
pub use transfer::{Laid, TemplateCourse};
pub use verdict::{CRITERIA, Criterion, Reason, Verdict, Worse, verdict_of};

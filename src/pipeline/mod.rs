//! The paper's stages over a collection: fit, resample, register, and what we add to them. Layer 4.

mod fit;
mod groupwise;
mod observer;
mod presets;
mod register;
mod resample;
mod scan_surface;
mod setting_name;
mod settings;
mod sphere;

pub use fit::{SphereLandmark, fit};
pub use observer::{Canceled, Observer, Progress, Stage, Watch};
pub use register::{LEAST_LANDMARKS, RegisterError, Registration, Subject, Template, fit_scan, register};
pub use scan_surface::{ScanSurface, SurfaceSample};
pub use settings::{
    Density, FitSettings, GroupwiseSettings, LevelSettings, Preset, Ramp, ResampleSettings, SettingError,
    Settings,
};
pub use sphere::Sphere;

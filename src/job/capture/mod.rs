//! Uploaded captures: pictures with cameras, their limits, and how they are laid out to be read.

mod fault;
mod files;
mod limits;
mod new_capture;

pub use fault::CaptureFault;
pub(super) use files::CaptureFiles;
pub use limits::CaptureLimits;
pub use new_capture::{CaptureParts, NewCapture, Role};

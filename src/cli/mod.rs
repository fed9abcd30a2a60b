//! The commands, one a file. On top of all layers; alone in naming clap, anyhow and indicatif.

#[macro_use]
mod output;

mod audit;
mod bench;
mod capture;
mod client;
mod demo;
mod difference;
mod doctor;
mod evaluate;
mod findings;
mod fit;
mod formats;
mod health;
mod inspect;
mod invert;
mod key;
mod logging;
mod openapi;
mod parameters;
mod progress;
mod register;
mod serve;
mod service_config;
#[cfg(feature = "otel")]
mod span_export;
mod submit;
mod summary;
mod template;
mod threads;

use std::process::ExitCode;

pub use audit::Audit;
pub use bench::Bench;
pub use capture::Capture;
pub use demo::Demo;
pub use doctor::Doctor;
pub use evaluate::Evaluate;
pub use fit::Fit;
pub use health::Health;
pub use inspect::Inspect;
pub use invert::Invert;
pub use key::Key;
pub use openapi::Openapi;
pub use register::Register;
pub use serve::Serve;
pub use submit::Submit;
pub use threads::Threads;

/// The exit code where some scans were left out and the others are delivered; wrong arguments have 2.
const PARTIAL: u8 = 3;

/// Says what went wrong, if anything did, and how the program ends.
pub fn finish(outcome: anyhow::Result<()>) -> ExitCode {
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            remark!("error: {error:#}");
            if error.is::<summary::LeftOut>() { ExitCode::from(PARTIAL) } else { ExitCode::FAILURE }
        }
    }
}

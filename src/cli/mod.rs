//! The commands, one a file. On top of all layers; alone in naming clap, anyhow and indicatif.

mod audit;
mod bench;
mod demo;
mod evaluate;
mod findings;
mod fit;
mod inspect;
mod parameters;
mod progress;
mod register;
mod template;
mod threads;

use std::process::ExitCode;

pub use audit::Audit;
pub use bench::Bench;
pub use demo::Demo;
pub use evaluate::Evaluate;
pub use fit::Fit;
pub use inspect::Inspect;
pub use register::Register;
pub use threads::Threads;

/// Says what went wrong, if anything did, and how the program ends.
pub fn finish(outcome: anyhow::Result<()>) -> ExitCode {
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

//! What is asked for, its state, its store, its worker: everything the service keeps in one data folder. Layer 5; knows no
//! HTTP.

pub mod api_key;
mod archive;
pub mod blobs;
/// Pictures with cameras.
pub mod capture;
mod clock;
mod data_folder;
mod database;
pub mod idempotency;
pub mod scan;
mod store_error;
pub mod template;
pub mod webhook_outbox;

pub use data_folder::DataFolder;
pub use database::Database;
pub use store_error::StoreError;

mod cache;
mod compute;
mod engine;
mod error;
/// What happens to jobs.
pub mod event;
mod feed;
mod graph;
mod inputs;
/// Meshes from pictures, as they are asked for.
pub mod inverse_rendering;
mod invert_work;
mod job_id;
pub mod jobs;
mod new_job;
mod queue;
mod record;
/// Registrations as they are asked for and told of.
pub mod registration;
/// Files that jobs leave.
pub mod result_file;
mod settings;
mod snapshots;
mod source;
mod stage;
/// How jobs stand.
pub mod state;
mod submission;
mod submit;
mod submit_inverse;
mod supervisor;
mod sweep;
#[cfg(test)]
mod tests;
mod told;
mod work;

pub use error::JobError;
pub use feed::EventFeed;
pub use job_id::{BadJobId, JobId, JobKind, OfKind};
pub use jobs::Jobs;
pub use settings::JobSettings;
pub use told::Told;

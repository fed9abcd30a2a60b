//! What is asked for, its state, its store, its worker: everything the service keeps in one data folder. Layer 5; knows no
//! HTTP.

pub mod api_key;
pub mod blobs;
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
/// What happens to registrations.
pub mod event;
mod feed;
mod graph;
mod inputs;
pub mod jobs;
mod queue;
mod record;
/// Registrations as they are asked for and told of.
pub mod registration;
mod settings;
mod source;
mod stage;
mod submission;
mod supervisor;
mod sweep;
#[cfg(test)]
mod tests;
mod work;

pub use error::JobError;
pub use feed::EventFeed;
pub use jobs::Jobs;
pub use settings::JobSettings;

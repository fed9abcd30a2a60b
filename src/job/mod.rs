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

pub mod event;
pub mod jobs;
pub mod registration;

//! The service as its clients see it: what `/openapi.json` describes, asked for over HTTP.

mod download;
mod events;
mod failure;
mod patience;
mod progress;
mod registration;
mod request;
mod scan_upload;
mod server;
mod upload;

pub use download::download;
pub use events::watch;
pub use progress::WatchedBars;
pub use registration::{Asked, AskedScan, Registration, Scan, ask_for};
pub use request::{Client, ServerUrl, json};
pub use scan_upload::{KnownScans, ScanUpload};
pub use server::ServerOptions;
pub use upload::{Form, MeshUpload};

//! The service over HTTP. A file for each path; each test has a data folder and a port of its own.

mod api_keys;
mod capabilities;
mod contract;
mod document;
mod health;
mod inverse_renderings;
mod pictures;
mod registration_events;
mod registration_results;
mod registrations;
mod scans;
mod server;
mod study;
mod templates;
mod webhooks;

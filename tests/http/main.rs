//! The service over HTTP. A file for each path; each test has a data folder and a port of its own.

mod capabilities;
mod document;
mod health;
mod scans;
mod server;

//! The service as its users meet it: `onemesh submit`, the demo and the quick start, against the program as a server.

#[path = "../common/mod.rs"]
mod common;
mod demo;
mod health;
mod proxy;
mod quick_start;
#[path = "../common/server.rs"]
mod server;
mod submit;

//! What befalls a server: its disk is full, or cannot be written, or its clock jumps. Each is said clearly and got over, and
//! other clients don't notice. Broken uploads, damaged files and slow readers are in tests/http.

#[path = "../common/client.rs"]
mod client;
mod clock;
mod disk;
#[path = "../common/server.rs"]
mod server;

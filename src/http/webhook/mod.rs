//! Telling others of a registration's end, after Standard Webhooks: signed, tried again, and never to a private network
//! unless that is allowed.

mod address;
mod request;
mod sender;
mod signature;

pub use address::check_address;
pub use sender::run;
pub use signature::WebhookSecret;

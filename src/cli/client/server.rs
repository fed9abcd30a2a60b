use std::time::Duration;

use serde::Deserialize;

use super::failure::Failure;
use super::request::{Client, ServerUrl, json};

/// Which server to ask, and as whom.
#[derive(Debug, clap::Args)]
pub struct ServerOptions {
    /// The server, as http://127.0.0.1:8080
    #[arg(long, value_name = "URL", env = "ONEMESH_SERVER")]
    server: ServerUrl,
    /// The API key, where the server needs one; safer in the environment, where other users do not see it
    #[arg(long, value_name = "KEY", env = "ONEMESH_API_KEY", hide_env_values = true)]
    api_key: Option<String>,
    /// Seconds for which a request is tried again when the connection breaks
    #[arg(long, value_name = "SECONDS", default_value_t = 300)]
    patience: u64,
}

/// What is looked at of a server's capabilities.
#[derive(Debug, Deserialize)]
struct Capabilities {
    #[allow(dead_code)]
    version: String,
}

impl ServerOptions {
    /// A client of the server, which has answered.
    ///
    /// # Errors
    /// [`Failure`], at once where nobody answers: an address that is wrong does not get better.
    pub fn reach(&self) -> Result<Client, Failure> {
        let patience = Duration::from_secs(self.patience);
        let client = Client::new(self.server.clone(), self.api_key.as_deref(), patience);
        match client.get("/v1/capabilities", &[]).and_then(json::<Capabilities>) {
            Ok(_) => Ok(client),
            Err(Failure::Connection(error)) => Err(Failure::Connection(format!(
                "{error}: no server can be reached there; start one by `onemesh serve`, or correct --server"
            ))),
            Err(failure) => Err(failure),
        }
    }
}

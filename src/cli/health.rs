use std::time::Duration;

use super::client::{Client, ServerUrl, json};

/// Asks a server whether it takes work; the exit code is 0 if it does.
#[derive(Debug, clap::Args)]
pub struct Health {
    /// The server
    #[arg(default_value = "http://127.0.0.1:8080", value_name = "URL", env = "ONEMESH_SERVER")]
    server: ServerUrl,
}

impl Health {
    /// Does it.
    pub fn run(self) -> anyhow::Result<()> {
        let client = Client::new(self.server, None, Duration::ZERO);
        let health: serde_json::Value = json(client.get("/readyz", &[])?)?;
        say!("{}: {}", client.server(), health["status"].as_str().unwrap_or_default());
        Ok(())
    }
}

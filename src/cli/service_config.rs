use std::net::SocketAddr;
use std::path::PathBuf;

use anyhow::Context;
use onemesh::http::config::{Config, KeyPolicy, LogFormat};

/// What is set about the service: by flags, over them by nothing; else by environment variables as
/// `ONEMESH_LIMITS__SCAN__VERTICES`; else by a TOML file; else the defaults.
#[derive(Debug, clap::Args)]
pub struct ServiceConfig {
    /// A TOML file, as --print-config prints it
    #[arg(long, value_name = "FILE", env = "ONEMESH_CONFIG")]
    config: Option<PathBuf>,
    /// The folder that holds everything the service keeps
    #[arg(long, value_name = "FOLDER", env = "ONEMESH_DATA")]
    data: Option<PathBuf>,
    /// Sets anything by its dotted name, as in `limits.scan.vertices=100000`; may be repeated
    #[arg(long, value_name = "NAME=VALUE")]
    set: Vec<String>,
}

/// Where the service listens and what it logs.
#[derive(Debug, clap::Args)]
pub struct Listening {
    /// Address and port; port 0 takes any that is free
    #[arg(long, value_name = "ADDRESS", env = "ONEMESH_LISTEN")]
    listen: Option<SocketAddr>,
    /// Lets everybody in who reaches the server, though it does not listen on a loopback address only
    #[arg(long)]
    without_keys: bool,
    /// `human` or `json`
    #[arg(long, value_name = "FORMAT", value_parser = log_format, env = "ONEMESH_LOG_FORMAT")]
    log_format: Option<LogFormat>,
}

impl ServiceConfig {
    /// All of it put together.
    pub fn read(&self) -> anyhow::Result<Config> {
        let assignment = |text: &String| {
            let (name, value) =
                text.split_once('=').with_context(|| format!("--set {text}: write it as NAME=VALUE"))?;
            Ok((name.to_owned(), value.to_owned()))
        };
        let assignments = self.set.iter().map(assignment).collect::<anyhow::Result<Vec<_>>>()?;
        let environment = std::env::vars_os();
        let environment = environment
            .filter_map(|(name, value)| Some((name.into_string().ok()?, value.into_string().ok()?)));
        let mut config = Config::from_sources(self.config.as_deref(), environment, &assignments)?;
        if let Some(folder) = &self.data {
            config.data.folder.clone_from(folder);
        }
        Ok(config)
    }
}

impl Listening {
    /// The configuration with these over it.
    pub fn over(&self, mut config: Config) -> Config {
        config.server.listen = self.listen.unwrap_or(config.server.listen);
        config.log.format = self.log_format.unwrap_or(config.log.format);
        if self.without_keys {
            config.server.keys = KeyPolicy::Off;
        }
        config
    }
}

fn log_format(text: &str) -> Result<LogFormat, &'static str> {
    match text {
        "human" => Ok(LogFormat::Human),
        "json" => Ok(LogFormat::Json),
        _ => Err("choose human or json"),
    }
}

//! What can be set about the service.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;

use serde::{Deserialize, Serialize};

use crate::job::JobSettings;
use crate::job::capture::CaptureLimits;
use crate::job::scan::ScanLimits;
use crate::render::AdapterChoice;

/// Everything that can be set about the service, with its defaults: a TOML file has the same names.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// Where it listens and who may ask.
    pub server: ServerConfig,
    /// Where it keeps everything.
    pub data: DataConfig,
    /// How much is taken.
    pub limits: Limits,
    /// How work is done.
    pub work: WorkConfig,
    /// How long things are kept.
    pub retention: Retention,
    /// How ends of registrations are told.
    pub webhooks: WebhookConfig,
    /// What is logged.
    pub log: LogConfig,
}

/// Where the service listens and who may ask.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ServerConfig {
    /// Address and port; port 0 takes any that is free.
    pub listen: SocketAddr,
    /// Whether API keys are needed.
    pub keys: KeyPolicy,
    /// Seconds that a client may take to send the head of a request, from the connection or the answer before on.
    pub header_seconds: u64,
    /// Seconds that a client may take to send the next piece of a body.
    pub body_idle_seconds: u64,
    /// Seconds that requests under way have to end when the server does.
    pub shutdown_seconds: u64,
}

/// Whether API keys are needed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum KeyPolicy {
    /// Unless the server listens on a loopback address.
    Auto,
    /// Always.
    Required,
    /// Never: whoever reaches the server may do everything.
    Off,
}

/// Where the service keeps everything.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DataConfig {
    /// The data folder.
    pub folder: PathBuf,
    /// Bytes of the disk that stay free: below that nothing new is taken.
    pub keep_free_bytes: u64,
}

/// How much is taken.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Limits {
    /// How large a scan may be.
    pub scan: ScanLimits,
    /// How large pictures with cameras may be.
    pub capture: CaptureLimits,
    /// How many registrations there may be.
    pub registration: RegistrationLimits,
    /// How often may be asked.
    pub requests: RequestLimits,
}

/// How large and how many registrations may be.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RegistrationLimits {
    /// Scans of one.
    pub scans: usize,
    /// Unfinished ones of one API key.
    pub unfinished_per_key: usize,
    /// Seconds that one step, as the fit of one scan, may take.
    pub step_seconds: u64,
    /// Seconds of work that one may take, over all its steps.
    pub seconds: u64,
}

/// How work is done.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct WorkConfig {
    /// Steps that are worked on at the same time, each on as many threads but four at most; 0 for one each processor.
    pub threads: usize,
    /// Bytes of scans that are kept ready between steps.
    pub cache_bytes: usize,
    /// What draws inverse renderings: `best`, `fastest`, `reference` for the program's own rasterizer, or a
    /// part of an adapter's name.
    pub adapter: String,
}

/// How often may be asked.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RequestLimits {
    /// Requests a second of one API key, or of one address where no keys are needed.
    pub per_second: u32,
    /// Requests of one at once.
    pub burst: u32,
    /// Scans that are read at the same time, which bounds memory.
    pub read_at_once: usize,
}

/// How long things are kept.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Retention {
    /// Days a scan is kept after it was last uploaded; 0 keeps it.
    pub scan_days: u32,
    /// Days a registration and its results are kept after its end; 0 keeps them.
    pub registration_days: u32,
}

/// How ends of registrations are told.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct WebhookConfig {
    /// Whether addresses of private networks may be told.
    pub allow_private_addresses: bool,
    /// Whether `http:` may be used where `https:` is usual.
    pub allow_http: bool,
    /// What deliveries are signed with, as `whsec_` and base64; without it the server makes one and keeps it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub secret: Option<String>,
    /// How often a delivery is tried.
    pub attempts: u32,
    /// Seconds that one try may take.
    pub timeout_seconds: u64,
}

/// What is logged.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LogConfig {
    /// For people or for machines.
    pub format: LogFormat,
    /// What is logged, as `info` or `onemesh=debug,warn`.
    pub filter: String,
}

/// How logs look.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum LogFormat {
    /// A line for people.
    Human,
    /// A JSON object a line.
    Json,
}

impl Default for ServerConfig {
    fn default() -> Self {
        let listen = SocketAddr::from(([127, 0, 0, 1], 8080));
        let keys = KeyPolicy::Auto;
        Self { listen, keys, header_seconds: 30, body_idle_seconds: 60, shutdown_seconds: 20 }
    }
}

impl Default for DataConfig {
    fn default() -> Self {
        Self { folder: "onemesh-data".into(), keep_free_bytes: 1 << 30 }
    }
}

impl Default for RegistrationLimits {
    fn default() -> Self {
        Self { scans: 5000, unfinished_per_key: 1000, step_seconds: 1200, seconds: 24 * 3600 }
    }
}

impl Default for WorkConfig {
    fn default() -> Self {
        Self { threads: 0, cache_bytes: 1 << 30, adapter: AdapterChoice::Best.to_string() }
    }
}

impl Default for RequestLimits {
    fn default() -> Self {
        Self { per_second: 500, burst: 2000, read_at_once: 2 }
    }
}

impl Default for Retention {
    fn default() -> Self {
        Self { scan_days: 30, registration_days: 30 }
    }
}

impl Default for WebhookConfig {
    fn default() -> Self {
        Self {
            allow_private_addresses: false,
            allow_http: false,
            secret: None,
            attempts: 12,
            timeout_seconds: 20,
        }
    }
}

impl Default for LogConfig {
    fn default() -> Self {
        Self { format: LogFormat::Human, filter: "info".to_owned() }
    }
}

impl Retention {
    /// How long a scan is kept.
    pub fn scans(&self) -> Option<Duration> {
        days(self.scan_days)
    }

    /// How long a registration is kept after its end.
    pub fn registrations(&self) -> Option<Duration> {
        days(self.registration_days)
    }
}

impl Config {
    /// Whether requests need an API key.
    pub fn needs_keys(&self) -> bool {
        match self.server.keys {
            KeyPolicy::Auto => !self.server.listen.ip().is_loopback(),
            KeyPolicy::Required => true,
            KeyPolicy::Off => false,
        }
    }
}

impl From<&Config> for JobSettings {
    fn from(config: &Config) -> Self {
        let (usual, limits) = (Self::default(), &config.limits.registration);
        Self {
            threads: if config.work.threads > 0 { config.work.threads } else { usual.threads },
            scans: limits.scans,
            jobs_per_owner: limits.unfinished_per_key,
            step_time: Duration::from_secs(limits.step_seconds),
            job_time: Duration::from_secs(limits.seconds),
            cache_bytes: config.work.cache_bytes,
            keep_free: config.data.keep_free_bytes,
            keep: config.retention.registrations(),
            scan_limits: config.limits.scan,
            capture_limits: config.limits.capture,
            // Every text is a choice.
            adapter: config.work.adapter.parse().unwrap_or_default(),
            ..usual
        }
    }
}

fn days(count: u32) -> Option<Duration> {
    (count > 0).then(|| Duration::from_secs(u64::from(count) * 24 * 60 * 60))
}

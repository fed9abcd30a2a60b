use std::io::IsTerminal;

use anyhow::Context;
use onemesh::http::config::{LogConfig, LogFormat};
use tracing_subscriber::layer::SubscriberExt;
use tracing_subscriber::util::SubscriberInitExt;
use tracing_subscriber::{EnvFilter, Layer, fmt, registry};

#[cfg(feature = "otel")]
use super::span_export::SpanExport;

/// Logs as long as it lives.
pub struct Logging {
    #[cfg(feature = "otel")]
    _export: SpanExport,
}

/// Begins to log to the error stream, and to export spans where that is built in.
pub fn start(config: &LogConfig) -> anyhow::Result<Logging> {
    let filter =
        EnvFilter::try_new(&config.filter).with_context(|| format!("log.filter {}", config.filter))?;
    let log = fmt::layer().with_writer(std::io::stderr).with_ansi(std::io::stderr().is_terminal());
    let log = match config.format {
        LogFormat::Human => log.boxed(),
        LogFormat::Json => log.json().boxed(),
    };
    let subscriber = registry().with(filter).with(log);
    #[cfg(feature = "otel")]
    let export = SpanExport::start()?;
    #[cfg(feature = "otel")]
    let subscriber = subscriber.with(export.layer());
    subscriber.try_init().map_err(|error| anyhow::anyhow!("logging cannot begin: {error}"))?;
    Ok(Logging {
        #[cfg(feature = "otel")]
        _export: export,
    })
}

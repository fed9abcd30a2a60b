use anyhow::Context;
use opentelemetry::trace::TracerProvider;
use opentelemetry_otlp::SpanExporter;
use opentelemetry_sdk::Resource;
use opentelemetry_sdk::trace::{SdkTracer, SdkTracerProvider};
use tracing::Subscriber;
use tracing_opentelemetry::OpenTelemetryLayer;
use tracing_subscriber::registry::LookupSpan;

/// Environment variables that say where spans go; without one they go nowhere.
const ENDPOINTS: [&str; 2] = ["OTEL_EXPORTER_OTLP_TRACES_ENDPOINT", "OTEL_EXPORTER_OTLP_ENDPOINT"];

/// Sends spans by OTLP over HTTP, as OpenTelemetry's own environment variables say; the last go when it is dropped.
pub struct SpanExport(Option<SdkTracerProvider>);

impl SpanExport {
    /// Begins, outside of any async runtime.
    pub fn start() -> anyhow::Result<Self> {
        let wanted = ENDPOINTS.into_iter().any(|name| std::env::var_os(name).is_some());
        let provider = wanted.then(|| {
            let exporter = SpanExporter::builder().with_http().build().context("spans cannot be exported")?;
            let resource = Resource::builder().with_service_name(env!("CARGO_PKG_NAME")).build();
            let provider = SdkTracerProvider::builder().with_resource(resource);
            anyhow::Ok(provider.with_batch_exporter(exporter).build())
        });
        Ok(Self(provider.transpose()?))
    }

    /// What takes spans up.
    pub fn layer<S>(&self) -> Option<OpenTelemetryLayer<S, SdkTracer>>
    where
        S: Subscriber + for<'a> LookupSpan<'a>,
    {
        let tracer = self.0.as_ref()?.tracer(env!("CARGO_PKG_NAME"));
        Some(tracing_opentelemetry::layer().with_tracer(tracer))
    }
}

impl Drop for SpanExport {
    fn drop(&mut self) {
        if let Some(Err(error)) = self.0.take().map(|provider| provider.shutdown()) {
            remark!("the last spans were not exported: {error}");
        }
    }
}

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use prometheus_client::encoding::EncodeLabelSet;
use prometheus_client::encoding::text::encode;
use prometheus_client::metrics::counter::Counter;
use prometheus_client::metrics::family::Family;
use prometheus_client::metrics::gauge::Gauge;
use prometheus_client::metrics::histogram::Histogram;
use prometheus_client::registry::{Registry, Unit};

/// Bounds of how long requests take, in seconds.
const REQUEST_SECONDS: [f64; 12] = [0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 5.0, 30.0];

/// Bounds of scans' mean distances from their results, in the scan's radius.
const RESIDUALS: [f64; 10] = [1e-4, 2e-4, 5e-4, 1e-3, 2e-3, 5e-3, 1e-2, 2e-2, 5e-2, 0.1];

/// What is counted, for Prometheus.
pub struct Metrics {
    registry: Registry,
    requests: Family<RequestLabels, Counter>,
    seconds: Family<RouteLabels, Histogram, fn() -> Histogram>,
    /// Jobs by kind and status.
    pub jobs: Family<JobLabels, Gauge>,
    /// Steps that could run or run.
    pub steps: Family<StatusLabels, Gauge>,
    stage_steps: Family<StageLabels, Counter>,
    stage_seconds: Family<StageLabels, Counter<f64, AtomicU64>>,
    /// Scans' mean distances from their results, in the scan's radius.
    pub residuals: Histogram,
    /// Bytes free on the data folder's disk.
    pub free_bytes: Gauge<f64, AtomicU64>,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct RequestLabels {
    method: String,
    route: String,
    status: u16,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct RouteLabels {
    method: String,
    route: String,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct StageLabels {
    stage: &'static str,
}

/// A kind of job and a status.
#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
pub struct JobLabels {
    /// The kind's name.
    pub kind: &'static str,
    /// The status' name.
    pub status: &'static str,
}

/// A status.
#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
pub struct StatusLabels {
    /// Its name.
    pub status: &'static str,
}

impl Metrics {
    /// All at nothing.
    pub fn new() -> Self {
        let mut registry = Registry::with_prefix("onemesh");
        let requests = Family::default();
        registry.register("http_requests", "Requests answered", requests.clone());
        let seconds = Family::<_, _, fn() -> _>::new_with_constructor(|| Histogram::new(REQUEST_SECONDS));
        let help = "Time to an answer's head";
        registry.register_with_unit("http_request_duration", help, Unit::Seconds, seconds.clone());
        let jobs = Family::default();
        registry.register("jobs", "Jobs by kind and status", jobs.clone());
        let steps = Family::default();
        registry.register("steps", "Steps of work that wait for a thread or run", steps.clone());
        let stage_steps = Family::default();
        registry.register("stage_steps", "Steps done since the start, by stage", stage_steps.clone());
        let stage_seconds = Family::default();
        let help = "Time that they took";
        registry.register_with_unit("stage", help, Unit::Seconds, stage_seconds.clone());
        let residuals = Histogram::new(RESIDUALS);
        let help = "Mean distance of each registered scan from its result, in the scan's radius";
        registry.register("residual", help, residuals.clone());
        let free_bytes = Gauge::default();
        let help = "Free on the data folder's disk";
        registry.register_with_unit("data_folder_free", help, Unit::Bytes, free_bytes.clone());
        Self { registry, requests, seconds, jobs, steps, stage_steps, stage_seconds, residuals, free_bytes }
    }

    /// Counts a request: by its route, not its path, so that there are few series.
    pub fn count_request(&self, method: &str, route: &str, status: u16, took: Duration) {
        let (method, route) = (method.to_owned(), route.to_owned());
        let labels = RequestLabels { method: method.clone(), route: route.clone(), status };
        self.requests.get_or_create(&labels).inc();
        self.seconds.get_or_create(&RouteLabels { method, route }).observe(took.as_secs_f64());
    }

    /// Notes how many steps of a stage were done since the start, and how long they took.
    pub fn set_stage(&self, stage: &'static str, steps: u64, seconds: f64) {
        let labels = StageLabels { stage };
        self.stage_steps.get_or_create(&labels).inner().store(steps, Ordering::Relaxed);
        // The counter keeps the bits of a number.
        self.stage_seconds.get_or_create(&labels).inner().store(seconds.to_bits(), Ordering::Relaxed);
    }

    /// All of it in OpenMetrics' text.
    pub fn text(&self) -> String {
        let mut text = String::new();
        // Writing to a string does not fail.
        let _ = encode(&mut text, &self.registry);
        text
    }
}

impl Default for Metrics {
    fn default() -> Self {
        Self::new()
    }
}

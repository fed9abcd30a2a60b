use std::time::Duration;

use super::capture::CaptureLimits;
use super::scan::ScanLimits;
use crate::render::AdapterChoice;

/// How jobs are worked on, and their limits.
#[derive(Debug, Clone)]
pub struct JobSettings {
    /// Steps that run at the same time; each computes on as many threads, but four at most.
    pub threads: usize,
    /// Scans of one job.
    pub scans: usize,
    /// Jobs of one owner that have not ended.
    pub jobs_per_owner: usize,
    /// The longest that a step may take; the scan fails then.
    pub step_time: Duration,
    /// The most work that a job may take, over all its steps.
    pub job_time: Duration,
    /// A step during which the program ended so often is taken to be the reason.
    pub crashes: u32,
    /// Bytes of scans that are kept ready between steps.
    pub cache_bytes: usize,
    /// Bytes of the disk that stay free: no work begins with less.
    pub keep_free: u64,
    /// How long a job and its results are kept after it ends; for ever without.
    pub keep: Option<Duration>,
    /// How large scans and templates may be.
    pub scan_limits: ScanLimits,
    /// How large captures may be.
    pub capture_limits: CaptureLimits,
    /// What inverse renderings are drawn with.
    pub adapter: AdapterChoice,
}

impl Default for JobSettings {
    fn default() -> Self {
        Self {
            threads: std::thread::available_parallelism().map_or(1, usize::from),
            scans: 5000,
            jobs_per_owner: 1000,
            step_time: Duration::from_secs(20 * 60),
            job_time: Duration::from_secs(24 * 3600),
            // More than bad luck gives one that takes as long as the program lives between two falls.
            crashes: 10,
            cache_bytes: 512 << 20,
            keep_free: 1 << 30,
            keep: Some(Duration::from_secs(30 * 24 * 3600)),
            scan_limits: ScanLimits::default(),
            capture_limits: CaptureLimits::default(),
            adapter: AdapterChoice::Best,
        }
    }
}

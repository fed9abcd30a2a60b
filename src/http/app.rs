use std::ops::Deref;
use std::sync::Arc;

use tokio_util::sync::CancellationToken;

use super::config::Config;
use super::metrics::Metrics;
use super::rate::RateLimits;
use crate::job::api_key::ApiKeys;
use crate::job::blobs::Blobs;
use crate::job::idempotency::IdempotencyKeys;
use crate::job::jobs::Jobs;
use crate::job::scan::Scans;
use crate::job::template::Templates;
use crate::job::{DataFolder, Database, StoreError};

/// What every route works with; cheap to clone.
#[derive(Clone)]
pub struct App(Arc<Parts>);

/// The parts of the service.
pub struct Parts {
    /// What is set.
    pub config: Config,
    /// Where everything is kept.
    pub folder: DataFolder,
    /// The database in it.
    pub database: Database,
    /// The files in it.
    pub blobs: Blobs,
    /// Uploaded scans.
    pub scans: Scans,
    /// Uploaded templates.
    pub templates: Templates,
    /// Registrations.
    pub jobs: Jobs,
    /// Who may ask.
    pub keys: ApiKeys,
    /// Answers that are given again.
    pub idempotency: IdempotencyKeys,
    /// What is counted.
    pub metrics: Metrics,
    /// Who asked how often.
    pub rates: RateLimits,
    /// Says when streams without an end are to end.
    pub ending: CancellationToken,
}

impl App {
    /// The service over a data folder and its running jobs.
    ///
    /// # Errors
    /// [`StoreError`] if the database fails.
    pub async fn new(
        config: Config,
        folder: DataFolder,
        database: Database,
        blobs: Blobs,
        jobs: Jobs,
    ) -> Result<Self, StoreError> {
        let (scan, requests) = (config.limits.scan, &config.limits.requests);
        let scratch = folder.uploads();
        let keep = config.retention.scans();
        let parts = Parts {
            scans: Scans::new(
                database.clone(),
                blobs.clone(),
                scratch.clone(),
                scan,
                keep,
                requests.read_at_once,
            ),
            templates: Templates::new(database.clone(), blobs.clone(), scratch, scan),
            keys: ApiKeys::new(database.clone()),
            idempotency: IdempotencyKeys::open(database.clone()).await?,
            metrics: Metrics::new(),
            rates: RateLimits::new(requests),
            ending: CancellationToken::new(),
            config,
            folder,
            database,
            blobs,
            jobs,
        };
        Ok(Self(Arc::new(parts)))
    }
}

impl Deref for App {
    type Target = Parts;

    fn deref(&self) -> &Parts {
        &self.0
    }
}

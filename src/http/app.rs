use std::ops::Deref;
use std::sync::Arc;

use tokio_util::sync::CancellationToken;

use super::config::Config;
use super::metrics::Metrics;
use super::rate::RateLimits;
use crate::job::api_key::ApiKeys;
use crate::job::blobs::Blobs;
use crate::job::idempotency::IdempotencyKeys;
use crate::job::scan::Scans;
use crate::job::template::Templates;
use crate::job::{DataFolder, Database, JobSettings, Jobs, StoreError};

/// What every route works with; cheap to clone.
#[derive(Clone)]
pub struct App(Arc<Parts>);

/// The parts of the service.
pub struct Parts {
    /// What is set.
    pub config: Config,
    /// Where everything is kept.
    pub folder: Arc<DataFolder>,
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
    /// The service over a data folder, whose unfinished work goes on.
    ///
    /// # Errors
    /// [`StoreError`] if the database fails.
    pub async fn start(
        config: Config,
        folder: Arc<DataFolder>,
        database: Database,
    ) -> Result<Self, StoreError> {
        let blobs = Blobs::open(folder.path())?;
        let (limits, requests) = (config.limits.scan, &config.limits.requests);
        let (keep, at_once) = (config.retention.scans(), requests.read_at_once);
        let scans = Scans::new(database.clone(), blobs.clone(), folder.uploads(), limits, keep, at_once);
        let templates = Templates::new(database.clone(), blobs.clone(), folder.uploads(), limits);
        let both = (scans.clone(), templates.clone());
        let settings = JobSettings::from(&config);
        let parts = Parts {
            jobs: Jobs::start(folder.clone(), database.clone(), blobs.clone(), both, settings).await?,
            scans,
            templates,
            keys: ApiKeys::new(database.clone()),
            idempotency: IdempotencyKeys::open(database.clone()).await?,
            metrics: Metrics::new(),
            rates: RateLimits::new(requests),
            ending: CancellationToken::new(),
            config,
            folder,
            database,
            blobs,
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

use std::time::Duration;

use futures_util::StreamExt;
use serde::Serialize;
use serde_json::{Value, json};

use super::address::check_address;
use super::request::post;
use super::signature::WebhookSecret;
use crate::http::app::App;
use crate::http::wire::inverse_rendering::InverseRenderingSummary;
use crate::http::wire::registration::RegistrationSummary;
use crate::http::wire::rfc3339;
use crate::job::inverse_rendering::Inverting;
use crate::job::registration::Registering;
use crate::job::state::Job;
use crate::job::webhook_outbox::{Delivery, LONGEST_PAUSE, WebhookOutbox};
use crate::job::{BadJobId, JobError, JobId, JobKind, OfKind, StoreError};

/// Deliveries that are tried at the same time.
const AT_ONCE: usize = 8;
/// Those that are taken up together.
const BATCH: u32 = 64;
/// Milliseconds before the second try; each pause after it is three times as long.
const FIRST_PAUSE: i64 = 5000;
/// How long to wait when nothing says that there is something to do.
const IDLE: Duration = Duration::from_secs(60);

/// Delivers until the service ends. What is not delivered then is so after the next start.
pub async fn run(app: App, secret: WebhookSecret) {
    let outbox = WebhookOutbox::new(app.database.clone());
    let mut finished = app.jobs.finished();
    let ending = app.ending.clone();
    loop {
        let pause = match round(&app, &outbox, &secret).await {
            Ok(pause) => pause,
            Err(error) => {
                tracing::error!(%error, "webhooks cannot be looked up");
                IDLE
            }
        };
        tokio::select! {
            () = tokio::time::sleep(pause) => {}
            // Without a sender nothing will end any more: time alone counts.
            Ok(()) = finished.changed() => {}
            () = ending.cancelled() => return,
        }
    }
}

/// Tries what is due; gives how long nothing will be.
async fn round(app: &App, outbox: &WebhookOutbox, secret: &WebhookSecret) -> Result<Duration, StoreError> {
    outbox.collect().await?;
    loop {
        let due = outbox.due(BATCH).await?;
        if due.is_empty() || app.ending.is_cancelled() {
            return Ok(outbox.next_in().await?.map_or(IDLE, Duration::from_millis).min(IDLE));
        }
        let tries = futures_util::stream::iter(due).map(|delivery| attempt(app, outbox, secret, delivery));
        let results: Vec<Result<(), StoreError>> = tries.buffer_unordered(AT_ONCE).collect().await;
        results.into_iter().collect::<Result<(), _>>()?;
    }
}

async fn attempt(
    app: &App,
    outbox: &WebhookOutbox,
    secret: &WebhookSecret,
    delivery: Delivery,
) -> Result<(), StoreError> {
    let (config, job) = (&app.config.webhooks, &delivery.job);
    let patience = Duration::from_secs(config.timeout_seconds.max(1));
    let outcome = match tokio::time::timeout(patience, deliver(app, secret, &delivery)).await {
        Ok(outcome) => outcome,
        Err(_) => Err("no answer in time".to_owned()),
    };
    match outcome {
        Ok(()) => {
            tracing::info!(job, "webhook delivered");
            outbox.end(&delivery).await
        }
        Err(error) if delivery.failed + 1 >= config.attempts => {
            tracing::warn!(job, error, "webhook given up");
            outbox.end(&delivery).await
        }
        Err(error) => {
            let pause = FIRST_PAUSE.saturating_mul(3_i64.saturating_pow(delivery.failed)).min(LONGEST_PAUSE);
            tracing::info!(job, error, pause, "webhook will be tried again");
            outbox.postpone(&delivery, pause).await
        }
    }
}

/// What is told of the end of a job.
async fn body(app: &App, delivery: &Delivery) -> Result<Value, JobError> {
    match delivery.kind {
        JobKind::Registration => ended::<Registering, RegistrationSummary>(app, &delivery.job).await,
        JobKind::InverseRendering => ended::<Inverting, InverseRenderingSummary>(app, &delivery.job).await,
    }
}

async fn ended<K: OfKind, V: Serialize + From<Job<K>>>(app: &App, id: &str) -> Result<Value, JobError> {
    let id: JobId<K> = id.parse().map_err(|error: BadJobId| JobError::NotFound(error.to_string()))?;
    let job = app.jobs.get(&id).await?;
    let kind = format!("{}.{}", K::KIND.name(), job.status.name());
    let timestamp = rfc3339(job.finished_at.unwrap_or(job.created_at));
    Ok(json!({ "type": kind, "timestamp": timestamp, "data": V::from(job) }))
}

async fn deliver(app: &App, secret: &WebhookSecret, delivery: &Delivery) -> Result<(), String> {
    let config = &app.config.webhooks;
    let url = check_address(&delivery.url, config)
        .map_err(|_| "the address may not be told any more".to_owned())?;
    let body = match body(app, delivery).await {
        Ok(body) => body.to_string(),
        // It was deleted before it could be told.
        Err(JobError::NotFound(_)) => return Ok(()),
        Err(error) => return Err(error.to_string()),
    };
    let now = jiff::Timestamp::now().as_second();
    let headers = [
        ("content-type", "application/json".to_owned()),
        ("user-agent", concat!("onemesh/", env!("CARGO_PKG_VERSION")).to_owned()),
        ("webhook-id", delivery.message.clone()),
        ("webhook-timestamp", now.to_string()),
        ("webhook-signature", secret.sign(&delivery.message, now, body.as_bytes())),
    ];
    match post(&url, &headers, body.into(), config.allow_private_addresses).await? {
        200..300 => Ok(()),
        status => Err(format!("answered with status {status}")),
    }
}

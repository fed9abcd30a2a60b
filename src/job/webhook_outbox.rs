//! What is still to be told of ended jobs, and when it is tried again.

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use sqlx::Row;

use super::clock::now;
use super::database::Database;
use super::job_id::JobKind;
use super::record::kind_of;
use super::store_error::StoreError;

/// Milliseconds that a delivery is put off at most.
pub const LONGEST_PAUSE: i64 = 12 * 60 * 60 * 1000;
/// What secrets begin with.
const PREFIX: &str = "whsec_";

/// A delivery to be tried now.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Delivery {
    /// The message's id, the same at every try.
    pub message: String,
    /// What it is about.
    pub job: String,
    /// What that is.
    pub kind: JobKind,
    /// Where to.
    pub url: String,
    /// Tries that failed.
    pub failed: u32,
}

/// The deliveries of a data folder; cheap to clone.
#[derive(Debug, Clone)]
pub struct WebhookOutbox {
    database: Database,
}

impl WebhookOutbox {
    /// Those of a database.
    pub fn new(database: Database) -> Self {
        Self { database }
    }

    /// Takes on a delivery for every job that has ended and is to be told of, each once.
    ///
    /// # Errors
    /// [`StoreError::Database`].
    pub async fn collect(&self) -> Result<(), StoreError> {
        let insert = "INSERT INTO webhook_delivery (job, kind, message, url, failed, next_at) \
            SELECT id, kind, 'msg_' || lower(hex(randomblob(16))), webhook, 0, ?1 FROM job \
            WHERE webhook IS NOT NULL AND finished_at IS NOT NULL \
            AND id NOT IN (SELECT job FROM webhook_delivery)";
        sqlx::query(insert).bind(now()).execute(self.database.writer()).await?;
        Ok(())
    }

    /// At most `limit` deliveries whose time has come.
    ///
    /// # Errors
    /// [`StoreError::Database`].
    pub async fn due(&self, limit: u32) -> Result<Vec<Delivery>, StoreError> {
        // What is further off than any pause was put off by a clock that has been set back since.
        let query = "SELECT * FROM webhook_delivery WHERE ended_at IS NULL
            AND (next_at <= ?1 OR next_at > ?1 + ?2) ORDER BY next_at LIMIT ?3";
        let rows = sqlx::query(query)
            .bind(now())
            .bind(LONGEST_PAUSE)
            .bind(limit)
            .fetch_all(self.database.reader())
            .await?;
        let delivery = |row: sqlx::sqlite::SqliteRow| {
            Ok(Delivery {
                message: row.try_get("message")?,
                job: row.try_get("job")?,
                kind: kind_of(row.try_get("kind")?)?,
                url: row.try_get("url")?,
                failed: row.try_get("failed")?,
            })
        };
        rows.into_iter().map(delivery).collect()
    }

    /// Milliseconds until the next delivery's time, if there is one.
    ///
    /// # Errors
    /// [`StoreError::Database`].
    pub async fn next_in(&self) -> Result<Option<u64>, StoreError> {
        let query = "SELECT MIN(next_at) FROM webhook_delivery WHERE ended_at IS NULL";
        let next: Option<i64> = sqlx::query_scalar(query).fetch_one(self.database.reader()).await?;
        Ok(next.map(|at| u64::try_from(at.saturating_sub(now())).unwrap_or(0)))
    }

    /// Notes that a delivery arrived, or that it is given up.
    ///
    /// # Errors
    /// [`StoreError::Database`].
    pub async fn end(&self, delivery: &Delivery) -> Result<(), StoreError> {
        let update = sqlx::query("UPDATE webhook_delivery SET ended_at = ? WHERE message = ?");
        update.bind(now()).bind(&delivery.message).execute(self.database.writer()).await?;
        Ok(())
    }

    /// Notes that a delivery failed, and in how many milliseconds it is tried again, at most [`LONGEST_PAUSE`].
    ///
    /// # Errors
    /// [`StoreError::Database`].
    pub async fn postpone(&self, delivery: &Delivery, milliseconds: i64) -> Result<(), StoreError> {
        let update = sqlx::query("UPDATE webhook_delivery SET failed = ?, next_at = ? WHERE message = ?");
        let update = update.bind(delivery.failed + 1).bind(now() + milliseconds.min(LONGEST_PAUSE));
        update.bind(&delivery.message).execute(self.database.writer()).await?;
        Ok(())
    }

    /// The secret that this data folder's deliveries are signed with, which is made when it is first asked for.
    ///
    /// # Errors
    /// [`StoreError`] if it cannot be kept, or the system has no randomness to give.
    pub async fn secret(&self) -> Result<String, StoreError> {
        let mut bytes = [0; 32];
        getrandom::fill(&mut bytes)
            .map_err(|error| StoreError::Record { what: "a secret", problem: error.to_string() })?;
        let fresh = format!("{PREFIX}{}", BASE64_STANDARD.encode(bytes));
        let mut transaction = self.database.begin_write().await?;
        let insert = sqlx::query(
            "INSERT INTO setting (name, value) VALUES ('webhook_secret', ?) ON CONFLICT DO NOTHING",
        );
        insert.bind(fresh).execute(&mut *transaction).await?;
        let query = sqlx::query_scalar("SELECT value FROM setting WHERE name = 'webhook_secret'");
        let secret = query.fetch_one(&mut *transaction).await?;
        transaction.commit().await?;
        Ok(secret)
    }
}

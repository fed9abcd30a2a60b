//! Idempotency keys: a request that is sent again with the same key gets the answer of the first time.

use sqlx::Row;

use super::clock::now;
use super::database::Database;
use super::store_error::StoreError;

/// How long an answer is kept: a day.
const KEPT: i64 = 24 * 60 * 60 * 1000;

/// An answer as it was given.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Answer {
    /// The request's body, as a digest; `None` if it says nothing.
    pub request_body: Option<String>,
    /// The status.
    pub status: u16,
    /// Headers by name.
    pub headers: Vec<(String, String)>,
    /// The body.
    pub body: Vec<u8>,
}

/// What is known of a key.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Known {
    /// Nothing: it is now under way, and [`IdempotencyKeys::finish`] or [`IdempotencyKeys::release`] must follow.
    New,
    /// The first request is still being worked on.
    UnderWay,
    /// It was used for another request.
    OtherRequest,
    /// It was answered.
    Answered(Answer),
}

/// The idempotency keys of a data folder; cheap to clone.
#[derive(Debug, Clone)]
pub struct IdempotencyKeys {
    database: Database,
}

impl IdempotencyKeys {
    /// Those of a database. What was under way when the last server ended is forgotten: it was never answered.
    ///
    /// # Errors
    /// [`StoreError::Database`].
    pub async fn open(database: Database) -> Result<Self, StoreError> {
        let forget = sqlx::query("DELETE FROM idempotency_key WHERE status IS NULL OR created_at < ?");
        forget.bind(now() - KEPT).execute(database.writer()).await?;
        Ok(Self { database })
    }

    /// Begins a request, told by its method, path and what else makes it the same one, or says what became of it.
    ///
    /// # Errors
    /// [`StoreError::Database`].
    pub async fn begin(&self, owner: &str, key: &str, request: &str) -> Result<Known, StoreError> {
        let mut transaction = self.database.begin_write().await?;
        let stale = sqlx::query("DELETE FROM idempotency_key WHERE created_at < ?").bind(now() - KEPT);
        stale.execute(&mut *transaction).await?;
        let insert = "INSERT INTO idempotency_key (owner, key, request, created_at) VALUES (?, ?, ?, ?) \
            ON CONFLICT DO NOTHING";
        let insert = sqlx::query(insert).bind(owner).bind(key).bind(request).bind(now());
        let known = match insert.execute(&mut *transaction).await?.rows_affected() {
            0 => {
                let query = sqlx::query("SELECT * FROM idempotency_key WHERE owner = ? AND key = ?");
                let row = query.bind(owner).bind(key).fetch_one(&mut *transaction).await?;
                if row.try_get::<&str, _>("request")? == request {
                    known_of(&row)?
                } else {
                    Known::OtherRequest
                }
            }
            _ => Known::New,
        };
        transaction.commit().await?;
        Ok(known)
    }

    /// Keeps the answer.
    ///
    /// # Errors
    /// [`StoreError::Database`].
    pub async fn finish(&self, owner: &str, key: &str, answer: &Answer) -> Result<(), StoreError> {
        let update = "UPDATE idempotency_key SET body = ?, status = ?, headers = ?, answer = ? \
            WHERE owner = ? AND key = ?";
        sqlx::query(update)
            .bind(&answer.request_body)
            .bind(answer.status)
            .bind(serde_json::to_string(&answer.headers).unwrap_or_default())
            .bind(&answer.body)
            .bind(owner)
            .bind(key)
            .execute(self.database.writer())
            .await?;
        Ok(())
    }

    /// Forgets a request that was not answered, so that it may be tried again.
    ///
    /// # Errors
    /// [`StoreError::Database`].
    pub async fn release(&self, owner: &str, key: &str) -> Result<(), StoreError> {
        let delete =
            sqlx::query("DELETE FROM idempotency_key WHERE owner = ? AND key = ? AND status IS NULL");
        delete.bind(owner).bind(key).execute(self.database.writer()).await?;
        Ok(())
    }
}

fn known_of(row: &sqlx::sqlite::SqliteRow) -> Result<Known, StoreError> {
    let Some(status) = row.try_get::<Option<u16>, _>("status")? else { return Ok(Known::UnderWay) };
    let broken =
        |error: serde_json::Error| StoreError::Record { what: "an answer", problem: error.to_string() };
    Ok(Known::Answered(Answer {
        request_body: row.try_get("body")?,
        status,
        headers: serde_json::from_str(row.try_get("headers")?).map_err(broken)?,
        body: row.try_get("answer")?,
    }))
}

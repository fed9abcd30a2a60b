//! API keys: who may ask for what. A key's secret is shown once and kept as its digest alone.

use std::fmt;

use base64::Engine;
use base64::prelude::BASE64_URL_SAFE_NO_PAD;
use serde::{Deserialize, Serialize};
use sqlx::Row;
use subtle::ConstantTimeEq;

use super::clock::now;
use super::database::Database;
use super::store_error::StoreError;
use crate::formats::Sha256;

/// What every key begins with, so that one that got out is recognised.
const PREFIX: &str = "onemesh_";
/// Random bytes of a secret: more than can be guessed, so that one round of hashing is enough.
const SECRET: usize = 32;

/// What a key allows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Scope {
    /// To look at everything.
    Read,
    /// That, and to upload, register, cancel and delete.
    Write,
}

/// A key as it is kept.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ApiKey {
    /// Its id, which is no secret.
    pub id: String,
    /// Who it is for.
    pub name: String,
    /// What it allows.
    pub scope: Scope,
    /// Milliseconds since 1970 when it was made.
    pub created_at: i64,
    /// When it was taken back.
    pub revoked_at: Option<i64>,
}

/// A key's text, which is shown once.
#[derive(Clone, PartialEq, Eq)]
pub struct Secret(String);

/// The API keys of a data folder; cheap to clone.
#[derive(Debug, Clone)]
pub struct ApiKeys {
    database: Database,
}

impl ApiKeys {
    /// Those of a database.
    pub fn new(database: Database) -> Self {
        Self { database }
    }

    /// Makes a key.
    ///
    /// # Errors
    /// [`StoreError`] if it cannot be kept, or the system has no randomness to give.
    pub async fn create(&self, name: &str, scope: Scope) -> Result<(ApiKey, Secret), StoreError> {
        let id: [u8; 8] = random()?;
        let id: String = id.iter().map(|byte| format!("{byte:02x}")).collect();
        let secret = BASE64_URL_SAFE_NO_PAD.encode(random::<SECRET>()?);
        let insert =
            "INSERT INTO api_key (id, name, secret_sha256, scope, created_at) VALUES (?, ?, ?, ?, ?)";
        let created_at = now();
        sqlx::query(insert)
            .bind(&id)
            .bind(name)
            .bind(Sha256::of(secret.as_bytes()).to_string())
            .bind(scope.name())
            .bind(created_at)
            .execute(self.database.writer())
            .await?;
        let text = Secret(format!("{PREFIX}{id}_{secret}"));
        Ok((ApiKey { id, name: name.to_owned(), scope, created_at, revoked_at: None }, text))
    }

    /// The key of this text, if there is one that holds. How long it takes tells nothing of the secret.
    ///
    /// # Errors
    /// [`StoreError::Database`].
    pub async fn find(&self, text: &str) -> Result<Option<ApiKey>, StoreError> {
        let Some((id, secret)) = text.strip_prefix(PREFIX).and_then(|rest| rest.split_once('_')) else {
            return Ok(None);
        };
        let query = sqlx::query("SELECT * FROM api_key WHERE id = ? AND revoked_at IS NULL").bind(id);
        let Some(row) = query.fetch_optional(self.database.reader()).await? else { return Ok(None) };
        let given = Sha256::of(secret.as_bytes()).to_string();
        let known: String = row.try_get("secret_sha256")?;
        Ok(bool::from(given.as_bytes().ct_eq(known.as_bytes())).then(|| key_of(&row)).transpose()?)
    }

    /// Every key, the oldest first.
    ///
    /// # Errors
    /// [`StoreError::Database`].
    pub async fn list(&self) -> Result<Vec<ApiKey>, StoreError> {
        let query = sqlx::query("SELECT * FROM api_key ORDER BY created_at, id");
        let rows = query.fetch_all(self.database.reader()).await?;
        Ok(rows.iter().map(key_of).collect::<Result<_, _>>()?)
    }

    /// Takes a key back; says whether there was one.
    ///
    /// # Errors
    /// [`StoreError::Database`].
    pub async fn revoke(&self, id: &str) -> Result<bool, StoreError> {
        let update = "UPDATE api_key SET revoked_at = ? WHERE id = ? AND revoked_at IS NULL";
        let update = sqlx::query(update).bind(now()).bind(id);
        Ok(update.execute(self.database.writer()).await?.rows_affected() > 0)
    }
}

impl Scope {
    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Read => "read",
            Self::Write => "write",
        }
    }
}

impl fmt::Display for Secret {
    fn fmt(&self, out: &mut fmt::Formatter) -> fmt::Result {
        out.write_str(&self.0)
    }
}

impl fmt::Debug for Secret {
    fn fmt(&self, out: &mut fmt::Formatter) -> fmt::Result {
        out.write_str("Secret(..)")
    }
}

fn key_of(row: &sqlx::sqlite::SqliteRow) -> Result<ApiKey, sqlx::Error> {
    Ok(ApiKey {
        id: row.try_get("id")?,
        name: row.try_get("name")?,
        scope: if row.try_get::<&str, _>("scope")? == "write" { Scope::Write } else { Scope::Read },
        created_at: row.try_get("created_at")?,
        revoked_at: row.try_get("revoked_at")?,
    })
}

fn random<const N: usize>() -> Result<[u8; N], StoreError> {
    let mut bytes = [0; N];
    getrandom::fill(&mut bytes)
        .map_err(|error| StoreError::Record { what: "a key", problem: error.to_string() })?;
    Ok(bytes)
}

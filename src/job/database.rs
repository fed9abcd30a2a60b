use std::path::Path;
use std::str::FromStr;
use std::time::Duration;

use sqlx::sqlite::{
    SqliteConnectOptions, SqliteJournalMode, SqlitePool, SqlitePoolOptions, SqliteSynchronous,
};
use sqlx::{Sqlite, Transaction};

use super::store_error::StoreError;

/// How long a statement waits for another one's write.
const BUSY: Duration = Duration::from_secs(30);
/// Connections that read at the same time.
const READERS: u32 = 8;

/// The database of a data folder. SQLite has one writer at a time: here it is one connection that all writes queue for,
/// so that none fails because another is under way; readers see the last committed state and wait for nobody.
#[derive(Debug, Clone)]
pub struct Database {
    reader: SqlitePool,
    writer: SqlitePool,
}

impl Database {
    /// Opens the file, makes it where it is not there, and brings its tables to this program's version. What was
    /// committed is on the disk, also after a loss of power.
    ///
    /// # Errors
    /// [`StoreError::Database`] if it cannot be opened; [`StoreError::Version`] if it is of a newer program.
    pub async fn open(file: &Path) -> Result<Self, StoreError> {
        let options = SqliteConnectOptions::from_str("sqlite://")?
            .filename(file)
            .create_if_missing(true)
            .journal_mode(SqliteJournalMode::Wal)
            .synchronous(SqliteSynchronous::Full)
            .foreign_keys(true)
            .busy_timeout(BUSY);
        let writer = SqlitePoolOptions::new().max_connections(1).connect_with(options.clone()).await?;
        let mut migrator = sqlx::migrate!("src/job/migrations");
        // The job engine keeps its own list of migrations under the usual name.
        migrator.dangerous_set_table_name("onemesh_migrations");
        migrator.run(&writer).await?;
        let reader = SqlitePoolOptions::new()
            .max_connections(READERS)
            .connect_with(options.create_if_missing(false).read_only(true))
            .await?;
        Ok(Self { reader, writer })
    }

    /// Connections to read by.
    pub fn reader(&self) -> &SqlitePool {
        &self.reader
    }

    /// The connection to write by.
    pub fn writer(&self) -> &SqlitePool {
        &self.writer
    }

    /// A transaction that may write: it is alone from its beginning.
    ///
    /// # Errors
    /// [`StoreError::Database`] if none can begin, as on a read-only disk.
    pub async fn begin_write(&self) -> Result<Transaction<'static, Sqlite>, StoreError> {
        Ok(self.writer.begin_with("BEGIN IMMEDIATE").await?)
    }

    /// Whether something can be written.
    ///
    /// # Errors
    /// [`StoreError::Database`].
    pub async fn check(&self) -> Result<(), StoreError> {
        // A transaction that is begun to write takes the lock, and finds a read-only or vanished file.
        self.begin_write().await?.rollback().await?;
        Ok(())
    }

    /// Waits for what is under way, moves the write-ahead log into the database file and closes it.
    pub async fn close(&self) {
        self.reader.close().await;
        self.writer.close().await;
    }
}

use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use tokio::net::TcpListener;

use super::app::App;
use super::config::{Config, KeyPolicy};
use super::connections;
use super::webhook::{self, WebhookSecret};
use crate::job::api_key::ApiKeys;
use crate::job::webhook_outbox::WebhookOutbox;
use crate::job::{DataFolder, Database, StoreError};

/// The service on its address, ready to run.
pub struct Service {
    app: App,
    listener: TcpListener,
    address: SocketAddr,
    secret: WebhookSecret,
}

/// Why the service cannot begin or go on.
#[derive(Debug, thiserror::Error)]
pub enum ServiceError {
    /// The data folder cannot be used.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// Nobody could ask.
    #[error(
        "{address} can be reached by others and there is no API key: make one by `onemesh key create`, or let everybody \
         in by `--without-keys`"
    )]
    NoKeys {
        /// The address.
        address: SocketAddr,
    },
    /// The webhooks' secret is none.
    #[error("webhooks.secret: {0}")]
    Secret(String),
    /// The address cannot be listened on.
    #[error("{address}: cannot be listened on: {error}")]
    Listen {
        /// The address.
        address: SocketAddr,
        /// What the system says.
        error: io::Error,
    },
}

impl Service {
    /// Opens the data folder, begins to work on what is left in it, and listens.
    ///
    /// # Errors
    /// [`ServiceError`] says what to change.
    pub async fn open(config: Config) -> Result<Self, ServiceError> {
        let folder = DataFolder::open(&config.data.folder)?;
        let database = Database::open(&folder.database()).await?;
        let keys = ApiKeys::new(database.clone()).list().await?;
        let address = config.server.listen;
        if config.server.keys == KeyPolicy::Auto
            && config.needs_keys()
            && keys.iter().all(|key| key.revoked_at.is_some())
        {
            return Err(ServiceError::NoKeys { address });
        }
        let secret = match &config.webhooks.secret {
            Some(secret) => secret.clone(),
            None => WebhookOutbox::new(database.clone()).secret().await?,
        };
        let secret =
            WebhookSecret::parse(&secret).map_err(|error| ServiceError::Secret(error.to_string()))?;
        let listen = |error| ServiceError::Listen { address, error };
        let listener = TcpListener::bind(address).await.map_err(listen)?;
        let address = listener.local_addr().map_err(listen)?;
        let app = App::start(config, Arc::new(folder), database).await?;
        Ok(Self { app, listener, address, secret })
    }

    /// Where it listens.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// What it works with.
    pub fn app(&self) -> &App {
        &self.app
    }

    /// Answers until `stop` is ready; requests under way then have as long as the configuration gives them.
    pub async fn run(self, stop: impl Future<Output = ()> + Send + 'static) {
        let Self { app, listener, secret, .. } = self;
        let webhooks = tokio::spawn(webhook::run(app.clone(), secret));
        let ending = app.ending.clone();
        let stopping = ending.clone();
        tokio::spawn(async move {
            stop.await;
            tracing::info!("the server ends");
            stopping.cancel();
        });
        let server = &app.config.server;
        let patience = Duration::from_secs(server.shutdown_seconds);
        let for_heads = Duration::from_secs(server.header_seconds.max(1));
        tokio::select! {
            () = connections::serve(listener, super::router(app.clone()), for_heads, ending.clone()) => {}
            // Who still reads then is cut off.
            () = async { ending.cancelled().await; tokio::time::sleep(patience).await } => {}
        }
        // A delivery under way is tried again after the next start.
        let _ = tokio::time::timeout(Duration::from_secs(1), webhooks).await;
        app.jobs.close().await;
        app.database.close().await;
    }
}

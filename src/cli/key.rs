use anyhow::{Context, ensure};
use clap::{Subcommand, ValueEnum};
use onemesh::job::api_key::{ApiKeys, Scope};
use onemesh::job::webhook_outbox::WebhookOutbox;
use onemesh::job::{Database, StoreError};

use super::service_config::ServiceConfig;

/// Makes, lists and takes back API keys. The server may run meanwhile.
#[derive(Debug, clap::Args)]
pub struct Key {
    #[command(flatten)]
    config: ServiceConfig,
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// Makes a key and prints it: it is shown this once
    Create {
        /// Who it is for
        name: String,
        /// What it allows
        #[arg(long, value_enum, default_value = "write")]
        scope: ScopeName,
    },
    /// Lists keys by their ids
    List,
    /// Takes a key back
    Revoke {
        /// The key's id
        id: String,
    },
    /// Prints the secret that webhooks are signed with
    WebhookSecret,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum ScopeName {
    Read,
    Write,
}

impl Key {
    /// Does it.
    pub fn run(self) -> anyhow::Result<()> {
        let config = self.config.read()?;
        let folder = config.data.folder;
        let shown = folder.display().to_string();
        std::fs::create_dir_all(&folder).with_context(|| shown.clone())?;
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
        runtime.block_on(async {
            let database = Database::open(&folder.join("onemesh.db")).await.with_context(|| shown)?;
            let done = self.action.run(&database).await;
            database.close().await;
            done
        })
    }
}

impl Action {
    async fn run(self, database: &Database) -> anyhow::Result<()> {
        let keys = ApiKeys::new(database.clone());
        match self {
            Self::Create { name, scope } => {
                let scope = match scope {
                    ScopeName::Read => Scope::Read,
                    ScopeName::Write => Scope::Write,
                };
                let (key, secret) = keys.create(&name, scope).await?;
                remark!("key {} for {name}, to {}; it is shown this once:", key.id, scope.name());
                say!("{secret}");
            }
            Self::List => list(&keys).await?,
            Self::Revoke { id } => ensure!(keys.revoke(&id).await?, "there is no key {id} that holds"),
            Self::WebhookSecret => say!("{}", WebhookOutbox::new(database.clone()).secret().await?),
        }
        Ok(())
    }
}

async fn list(keys: &ApiKeys) -> Result<(), StoreError> {
    for key in keys.list().await? {
        let holds = if key.revoked_at.is_some() { "revoked" } else { key.scope.name() };
        say!("{}  {holds:7}  {}", key.id, key.name);
    }
    Ok(())
}

use anyhow::Context;
use onemesh::http::Service;

use super::logging;
use super::service_config::{Listening, ServiceConfig};

/// Serves registration over HTTP, from one data folder.
///
/// What was acknowledged is on the disk: after a crash the work goes on from the steps that were done. SIGTERM and Ctrl-C
/// end it in order.
#[derive(Debug, clap::Args)]
pub struct Serve {
    #[command(flatten)]
    config: ServiceConfig,
    #[command(flatten)]
    listening: Listening,
    /// Prints what is set, as TOML, and does nothing else
    #[arg(long)]
    print_config: bool,
}

impl Serve {
    /// Does it.
    pub fn run(self) -> anyhow::Result<()> {
        let config = self.listening.over(self.config.read()?);
        if self.print_config {
            say!("{}", config.to_toml().trim_end());
            return Ok(());
        }
        let _logging = logging::start(&config.log)?;
        let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build();
        runtime.context("no threads can be started")?.block_on(async {
            let service = Service::open(config).await?;
            say!("listening on http://{}", service.address());
            service.run(stop()).await;
            Ok(())
        })
    }
}

/// Waits for the signal to end.
async fn stop() {
    let interrupted = tokio::signal::ctrl_c();
    #[cfg(unix)]
    {
        use tokio::signal::unix::{SignalKind, signal};
        if let Ok(mut terminated) = signal(SignalKind::terminate()) {
            tokio::select! {
                _ = interrupted => {}
                _ = terminated.recv() => {}
            }
            return;
        }
    }
    // Where no signal can be heard the server runs until it is killed, which it survives.
    if interrupted.await.is_err() {
        std::future::pending::<()>().await;
    }
}

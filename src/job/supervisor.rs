use std::sync::Arc;
use std::time::{Duration, Instant};

use super::engine::Engine;
use super::store_error::StoreError;
use super::{queue, sweep};

/// How often it looks whether the store can be written and no step is forgotten.
const LOOK: Duration = Duration::from_millis(500);
/// How often it looks for what is over.
const SWEEP: Duration = Duration::from_secs(60);
/// How often every blob is looked at.
const SWEEP_ALL: Duration = Duration::from_secs(3600);

/// Watches over the work until the program ends: begins it again when the disk has room, gives forgotten steps back, and
/// deletes what is over. Its times are told by a clock that does not jump.
pub(super) async fn watch(engine: Arc<Engine>) {
    let mut closing = engine.closing.subscribe();
    let (mut swept, mut swept_all) = (Instant::now(), Instant::now());
    while !*closing.borrow() {
        let pause = tokio::time::timeout(LOOK, closing.wait_for(|closing| *closing));
        if pause.await.is_ok() {
            return;
        }
        if let Err(error) = look(&engine).await {
            engine.pause(&error);
            continue;
        }
        if swept.elapsed() < SWEEP {
            continue;
        }
        swept = Instant::now();
        let all = swept_all.elapsed() >= SWEEP_ALL;
        if all {
            swept_all = swept;
        }
        if let Err(error) = sweep(&engine, all).await {
            tracing::warn!(%error, "what is over cannot be deleted now");
        }
    }
}

async fn look(engine: &Engine) -> Result<(), StoreError> {
    let free = engine.folder.free_bytes()?;
    let keep = engine.settings.keep_free;
    if free < keep {
        let reason = format!("the disk has less than {keep} bytes free: make room");
        if engine.paused.borrow().as_ref() != Some(&reason) {
            engine.paused.send_replace(Some(reason));
        }
        return Ok(());
    }
    if engine.paused.borrow().is_some() {
        let folder = engine.folder.clone();
        let writable = tokio::task::spawn_blocking(move || folder.check_writable()).await;
        if !matches!(writable, Ok(Ok(()))) {
            return Ok(());
        }
        tracing::info!("the store can be written: work goes on");
        engine.paused.send_replace(None);
    }
    queue::reconcile(engine).await
}

async fn sweep(engine: &Engine, all: bool) -> Result<(), StoreError> {
    let mut tx = engine.database.begin_write().await?;
    queue::clear(&mut tx).await?;
    tx.commit().await?;
    sweep::expire(engine).await?;
    if all {
        sweep::collect_all(engine).await?;
    }
    Ok(())
}

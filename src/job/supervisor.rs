use std::sync::Arc;
use std::time::{Duration, Instant};

use super::clock::now;
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
    let mut told = now();
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
        let (jumped, time) = (jump(told, now(), swept.elapsed()), now());
        (swept, told) = (Instant::now(), time);
        if jumped > SWEEP {
            // What seems to be over may not be: it is looked at again when the clock has gone on evenly.
            tracing::warn!(seconds = jumped.as_secs(), "the clock jumped: nothing is deleted for now");
            continue;
        }
        let all = swept_all.elapsed() >= SWEEP_ALL;
        if all {
            swept_all = swept;
        }
        if let Err(error) = sweep(&engine, all).await {
            tracing::warn!(%error, "what is over cannot be deleted now");
        }
    }
}

/// How far the clock on the wall went apart from one that does not jump; times are milliseconds.
fn jump(before: i64, after: i64, passed: Duration) -> Duration {
    let passed = i64::try_from(passed.as_millis()).unwrap_or(i64::MAX);
    Duration::from_millis(after.saturating_sub(before).saturating_sub(passed).unsigned_abs())
}

async fn look(engine: &Engine) -> Result<(), StoreError> {
    // Uploads that came to nothing, refused or broken off between two files; first, since they may be what fills the disk.
    sweep::collect_soon(&engine.database, &engine.blobs, engine.blobs.take_released()).await;
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_jump_is_seen_in_both_directions() {
        let minute = Duration::from_secs(60);
        assert_eq!(jump(1_000, 61_000, minute), Duration::ZERO);
        assert_eq!(jump(1_000, 3_661_000, minute), Duration::from_secs(3600));
        assert_eq!(jump(3_600_000, 60_000, minute), Duration::from_secs(3600));
    }
}

use std::collections::BTreeMap;
use std::io::IsTerminal;
use std::sync::{Mutex, MutexGuard};
use std::time::Duration;

use indicatif::{MultiProgress, ProgressBar, ProgressStyle};
use onemesh::pipeline::{Observer, Progress, Stage};

/// Shows progress on the terminal: a bar for each scan at work with its stage, iteration and energy. Elsewhere, a line
/// whenever a stage is done with a scan.
pub struct ProgressBars {
    bars: MultiProgress,
    by_scan: Mutex<BTreeMap<(Stage, String), ProgressBar>>,
    on_terminal: bool,
}

impl ProgressBars {
    /// Bars on standard error, where results do not go.
    pub fn new() -> Self {
        let on_terminal = std::io::stderr().is_terminal();
        Self { bars: MultiProgress::new(), by_scan: Mutex::default(), on_terminal }
    }

    /// A spinner for work that has no iterations, until it is dropped or finished.
    pub fn spinner(&self, message: &'static str) -> ProgressBar {
        let spinner = self.bars.add(ProgressBar::new_spinner().with_message(message));
        if self.on_terminal {
            spinner.enable_steady_tick(Duration::from_millis(120));
        } else {
            remark!("{message}");
        }
        spinner
    }

    fn lock(&self) -> MutexGuard<'_, BTreeMap<(Stage, String), ProgressBar>> {
        // Bars that a panic left half drawn are drawn anew.
        self.by_scan.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }

    fn draw(&self, progress: Progress) {
        let key = (progress.stage, progress.scan.to_owned());
        let done = progress.iteration >= progress.iterations;
        let mut bars = self.lock();
        let bar = bars.entry(key.clone()).or_insert_with(|| self.bars.add(bar(&progress)));
        bar.set_position(progress.iteration as u64);
        bar.set_message(format!("energy {:.3e}", progress.energy));
        if done {
            bar.finish_and_clear();
            bars.remove(&key);
        }
    }
}

impl Observer for ProgressBars {
    fn progress(&self, progress: Progress) {
        if self.on_terminal {
            self.draw(progress);
        } else if progress.iteration == progress.iterations {
            let Progress { stage, scan, iterations, energy, .. } = progress;
            remark!("{stage:<10} {scan}: {iterations} iterations, energy {energy:.3e}");
        }
    }
}

fn bar(progress: &Progress) -> ProgressBar {
    let style = ProgressStyle::with_template("{prefix} {bar:30} {pos:>5} of {len} {msg}");
    ProgressBar::new(progress.iterations as u64)
        .with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
        .with_prefix(format!("{:<10} {:<12}", progress.stage, progress.scan))
}

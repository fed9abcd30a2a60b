use std::collections::BTreeMap;
use std::io::IsTerminal;

use indicatif::{MultiProgress, ProgressBar, ProgressStyle};

use super::events::{Happening, Watcher};
use super::registration::{Registration, Status};

/// Parts of a bar that shows a share.
const PARTS: u64 = 1000;

/// Shows a registration's way on the terminal: a bar for the whole, and one for each scan at work. Elsewhere, a line for
/// each stage and for each scan that comes to its end.
pub struct WatchedBars {
    bars: MultiProgress,
    whole: ProgressBar,
    by_scan: BTreeMap<String, ProgressBar>,
    /// What scans are called, by their ids.
    names: BTreeMap<String, String>,
    on_terminal: bool,
}

impl WatchedBars {
    /// Bars on standard error for scans with these names by their ids.
    pub fn new(names: BTreeMap<String, String>) -> Self {
        let bars = MultiProgress::new();
        let whole = bars.add(bar("{prefix:<23} {bar:30} {percent:>3} % {msg}").with_prefix("registering"));
        let on_terminal = std::io::stderr().is_terminal();
        Self { bars, whole, by_scan: BTreeMap::new(), names, on_terminal }
    }

    /// Takes the bars away.
    pub fn finish(self) {
        self.by_scan.values().for_each(ProgressBar::finish_and_clear);
        self.whole.finish_and_clear();
    }

    fn name(&self, scan: &str) -> String {
        self.names.get(scan).map_or(scan, String::as_str).to_owned()
    }

    fn say(&self, line: &str) {
        if self.on_terminal {
            self.whole.set_message(line.to_owned());
        } else {
            remark!("{line}");
        }
    }
}

impl Watcher for WatchedBars {
    fn happened(&mut self, happening: &Happening) {
        match happening {
            Happening::Stage { stage } => self.say(stage),
            Happening::Progress { progress, scan, stage, stage_progress } => {
                self.whole.set_position(parts(*progress));
                if self.on_terminal {
                    let name = self.name(scan);
                    let own = self.by_scan.entry(scan.clone());
                    let own =
                        own.or_insert_with(|| self.bars.add(bar("{prefix:<23} {bar:30} {percent:>3} %")));
                    own.set_prefix(format!("{stage:<10} {name:<12}"));
                    own.set_position(parts(*stage_progress));
                }
            }
            Happening::Child { scan, status, verdict, problem } => {
                if let Some(own) = self.by_scan.remove(scan) {
                    own.finish_and_clear();
                }
                let name = self.name(scan);
                match (problem, verdict) {
                    (Some(problem), _) if *status == Status::Failed => {
                        let line = format!("{name}: left out: {}", problem.detail);
                        self.bars.suspend(|| remark!("{line}"));
                    }
                    (_, Some(verdict)) => self.say(&format!("{name}: {verdict}")),
                    _ => {}
                }
            }
            Happening::Other => {}
        }
    }

    fn stands(&mut self, registration: &Registration) {
        self.whole.set_position(parts(registration.progress));
        match registration.queue_position {
            Some(before) if before > 0 => self.whole.set_message(format!("{before} before it in the queue")),
            _ => self.whole.set_message(registration.stage.clone().unwrap_or_default()),
        }
    }
}

/// A bar of a share.
fn bar(template: &str) -> ProgressBar {
    let style = ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::new(PARTS).with_style(style)
}

fn parts(share: f64) -> u64 {
    (share.clamp(0.0, 1.0) * PARTS as f64) as u64
}

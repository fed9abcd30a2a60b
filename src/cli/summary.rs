use std::path::Path;
use std::time::Duration;

use anyhow::{Context, ensure};
use onemesh::pipeline::{FailedScan, Verdict};
use serde::Deserialize;

/// What people are told of a report.
#[derive(Debug, Deserialize)]
pub struct Summary {
    scans: Vec<ScanSummary>,
    /// The scans that were left out.
    pub failed: Vec<FailedScan>,
}

#[derive(Debug, Deserialize)]
struct ScanSummary {
    name: String,
    verdict: Verdict,
    reasons: Vec<Reason>,
    scan_to_mesh: Option<Distances>,
    landmark_mean: Option<f64>,
    flipped: Option<f64>,
    sliver: Option<f64>,
}

#[derive(Debug, Deserialize)]
struct Reason {
    code: String,
    verdict: Verdict,
    found: String,
    advice: String,
}

#[derive(Debug, Deserialize)]
struct Distances {
    p50: Option<f64>,
    p99: Option<f64>,
}

/// Some scans were left out, the others are delivered.
#[derive(Debug, thiserror::Error)]
#[error("{failed} of {of} scans are left out, see `failed` in report.json; the others are delivered")]
pub struct LeftOut {
    failed: usize,
    of: usize,
}

impl Summary {
    /// That of the report in a folder of results.
    pub fn of(results: &Path) -> anyhow::Result<Self> {
        let path = results.join("report.json");
        let bytes = std::fs::read(&path).with_context(|| path.display().to_string())?;
        serde_json::from_slice(&bytes).with_context(|| path.display().to_string())
    }

    /// Says how it went, how long it `took`, and where the results are.
    pub fn print(&self, output: &Path, took: Duration) {
        let widest = self.scans.iter().map(|scan| scan.name.len()).max().unwrap_or(0);
        for scan in &self.scans {
            let distance =
                |figure: fn(&Distances) -> Option<f64>| or_none(scan.scan_to_mesh.as_ref().and_then(figure));
            say!(
                "{:widest$}  {:6}  distance median {:.3e}, 99 % {:.3e}; landmarks {:.3e}; flipped {:.2} %, sliver {:.2} %",
                scan.name,
                scan.verdict,
                distance(|distances| distances.p50),
                distance(|distances| distances.p99),
                or_none(scan.landmark_mean),
                100.0 * or_none(scan.flipped),
                100.0 * or_none(scan.sliver),
            );
            for Reason { code, verdict, found, advice } in &scan.reasons {
                say!("{:widest$}  - {verdict}: {code}: {found}; {advice}", "");
            }
        }
        let [pass, review, fail] =
            [Verdict::Pass, Verdict::Review, Verdict::Fail].map(|verdict| self.count(verdict));
        say!("{pass} pass, {review} to review, {fail} failed");
        say!("{} scans in {:.1} s: {}", self.scans.len(), took.as_secs_f64(), output.display());
        say!("look at {}", output.join("sheet.png").display());
    }

    /// How the program is to end, where `earlier` scans were left out before the registration.
    ///
    /// # Errors
    /// [`LeftOut`], or that no result of the collection can be used.
    pub fn conclude(&self, collection: &Path, earlier: usize) -> anyhow::Result<()> {
        let failed = self.count(Verdict::Fail);
        ensure!(
            failed < self.scans.len(),
            "{}: no result can be used: {}",
            collection.display(),
            if failed == 1 { "the only one failed".to_owned() } else { format!("all {failed} failed") }
        );
        match earlier + self.failed.len() {
            0 => Ok(()),
            failed => Err(LeftOut { failed, of: failed + self.scans.len() }.into()),
        }
    }

    fn count(&self, verdict: Verdict) -> usize {
        self.scans.iter().filter(|scan| scan.verdict == verdict).count()
    }
}

/// A figure; one that is beyond all numbers is stored as nothing.
fn or_none(figure: Option<f64>) -> f64 {
    figure.unwrap_or(f64::NAN)
}

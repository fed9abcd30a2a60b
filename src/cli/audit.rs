use std::path::{Path, PathBuf};

use onemesh::pipeline::{FailedScan, audit_landmarks};
use onemesh::preflight::LandmarkAudit;

use super::findings::print_findings;
use super::register::{Reading, read};

/// Holds the landmarks of a collection against each other and against their scans.
#[derive(Debug, clap::Args)]
pub struct Audit {
    /// A collection as for `register`
    collection: PathBuf,
    /// Prints JSON
    #[arg(long)]
    json: bool,
}

impl Audit {
    /// Does it.
    pub fn run(self) -> anyhow::Result<()> {
        let Reading { subjects, failed, .. } = read(&self.collection)?;
        failed.iter().for_each(|FailedScan { name, problem }| remark!("{name}: left out: {problem}"));
        anyhow::ensure!(!subjects.is_empty(), "{}: no scan is left to audit", self.collection.display());
        let audit = audit_landmarks(&subjects);
        if self.json {
            say!("{}", serde_json::to_string_pretty(&audit)?);
        } else {
            print(&self.collection, &audit);
        }
        Ok(())
    }
}

fn print(collection: &Path, audit: &LandmarkAudit) {
    let wrong = audit.scans.iter().filter(|scan| !scan.findings.is_empty()).count();
    say!("{}: {wrong} of {} scans need a look", collection.display(), audit.scans.len());
    for scan in audit.scans.iter().filter(|scan| !scan.findings.is_empty()) {
        say!("{}", scan.name);
        print_findings(&scan.findings);
    }
    let mut spread: Vec<(&String, &f64)> = audit.spread.iter().collect();
    spread.sort_by(|a, b| b.1.total_cmp(a.1));
    let widest: Vec<String> =
        spread.iter().take(6).map(|(name, spread)| format!("`{name}` {:.1} %", 100.0 * **spread)).collect();
    if !widest.is_empty() {
        say!("{} landmarks; most spread, in the face's radius: {}", audit.spread.len(), widest.join(", "));
    }
}

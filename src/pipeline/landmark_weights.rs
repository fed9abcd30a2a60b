use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::register::LEAST_LANDMARKS;
use super::settings::Settings;
use crate::preflight::LandmarkAudit;

/// How much each landmark of each scan counts in a registration; without an audit all count alike.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct LandmarkWeights {
    /// By the scan's name and the landmark's.
    audited: BTreeMap<String, BTreeMap<String, f64>>,
}

impl LandmarkWeights {
    /// Those that an audit of the collection's landmarks gives, if the settings ask for them.
    pub fn of(audit: impl FnOnce() -> LandmarkAudit, settings: &Settings) -> Self {
        if !settings.audit_weights {
            return Self::default();
        }
        Self { audited: audit().scans.into_iter().map(|scan| (scan.name, scan.weights)).collect() }
    }

    /// The weights of these landmarks of a scan, 0 to 1. A scan on which too few would be left keeps all of them: they
    /// are all that is known of it.
    pub(super) fn on(&self, scan: &str, names: &[impl AsRef<str>]) -> Vec<f64> {
        let audited = self.audited.get(scan);
        let weight = |name: &str| audited.and_then(|weights| weights.get(name)).copied().unwrap_or(1.0);
        let weights: Vec<f64> = names.iter().map(|name| weight(name.as_ref())).collect();
        let trusted = weights.iter().filter(|weight| **weight >= 0.5).count();
        if trusted < LEAST_LANDMARKS { vec![1.0; names.len()] } else { weights }
    }
}

use std::collections::BTreeMap;

use super::precheck::audit_landmarks;
use super::register::{LEAST_LANDMARKS, Subject};
use super::settings::Settings;

/// How much each landmark of each scan counts in a registration.
pub(super) struct LandmarkWeights {
    /// By the scan and the landmark's name, as the audit has them; without an audit all count alike.
    audited: Option<Vec<BTreeMap<String, f64>>>,
}

impl LandmarkWeights {
    /// Those that the audit of the collection's landmarks gives, if the settings ask for them.
    pub fn of(subjects: &[Subject], settings: &Settings) -> Self {
        let audit = || audit_landmarks(subjects).scans.into_iter().map(|scan| scan.weights).collect();
        Self { audited: settings.audit_weights.then(audit) }
    }

    /// The weights of these landmarks of a scan, 0 to 1. A scan on which too few would be left keeps all of them: they
    /// are all that is known of it.
    pub fn on(&self, scan: usize, names: &[impl AsRef<str>]) -> Vec<f64> {
        let audited = self.audited.as_ref().map(|scans| &scans[scan]);
        let weight = |name: &str| audited.and_then(|weights| weights.get(name)).copied().unwrap_or(1.0);
        let weights: Vec<f64> = names.iter().map(|name| weight(name.as_ref())).collect();
        let trusted = weights.iter().filter(|weight| **weight >= 0.5).count();
        if trusted < LEAST_LANDMARKS { vec![1.0; names.len()] } else { weights }
    }
}

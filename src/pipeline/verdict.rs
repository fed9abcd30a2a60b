//! Whether a result can be used as it is. Every limit is in [`CRITERIA`]; `docs/report.md` tells them to people.

use serde::{Deserialize, Serialize};

use super::report::ScanReport;
use crate::preflight::{Code, Finding, Severity};

/// What to do with a result.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Use it.
    Pass,
    /// Look at it first.
    Review,
    /// Do not use it.
    Fail,
}

impl Verdict {
    /// Its name, as it is serialised.
    pub fn name(self) -> &'static str {
        match self {
            Self::Pass => "pass",
            Self::Review => "review",
            Self::Fail => "fail",
        }
    }
}

impl std::fmt::Display for Verdict {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        out.pad(self.name())
    }
}

/// Why a result does not pass.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Reason {
    /// The code of a criterion, or of a finding from before the registration.
    pub code: &'static str,
    /// The verdict that it alone would lead to.
    pub verdict: Verdict,
    /// What was found.
    pub found: String,
    /// What to do about it.
    pub advice: String,
}

/// Which values of a figure are bad.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Worse {
    /// Those above the limit.
    Above,
    /// Those below it.
    Below,
}

/// A figure of the report and the limits that it should keep.
#[derive(Debug, Clone, Copy)]
pub struct Criterion {
    /// The name of the reason that it gives.
    pub code: &'static str,
    /// What the figure is.
    pub figure: &'static str,
    /// Which side is bad.
    pub worse: Worse,
    /// Beyond this the result needs a look.
    pub review: f64,
    /// Beyond this it is of no use.
    pub fail: Option<f64>,
    /// What to do.
    pub advice: &'static str,
    /// The figure, where the report has it.
    value: fn(&ScanReport) -> Option<f64>,
}

/// The criteria for the figures of a report. Lengths are shares of the scan's radius or of the tolerance, so that neither
/// unit nor noise of a scan matters.
pub const CRITERIA: &[Criterion] = &[
    Criterion {
        code: "coarse_scan",
        figure: "the scan's median edge over its radius",
        worse: Worse::Above,
        review: 0.08,
        fail: None,
        advice: "give a finer scan; features smaller than its triangles are not in it",
        value: |report| ratio(report.fidelity.scan.edge, report.fidelity.scan.radius),
    },
    Criterion {
        code: "noisy_scan",
        figure: "the scan's noise over its radius",
        worse: Worse::Above,
        review: 0.005,
        fail: None,
        advice: "give a smoother scan, or smooth it; the result follows the noise",
        value: |report| ratio(report.fidelity.scan.noise, report.fidelity.scan.radius),
    },
    Criterion {
        code: "spiky_scan",
        figure: "share of the scan's vertices that are spikes",
        worse: Worse::Above,
        review: 0.003,
        fail: None,
        advice: "remove stray vertices from the scan; the result follows some of them",
        value: |report| Some(report.fidelity.scan.spikes),
    },
    Criterion {
        code: "damaged_scan",
        figure: "faults of the scan's connectivity to a triangle",
        worse: Worse::Above,
        review: 0.01,
        fail: None,
        advice: "repair the scan: `onemesh inspect` counts the faults by kind",
        value: |report| Some(report.precheck.damage),
    },
    Criterion {
        code: "ragged_scan",
        figure: "share of the scan's edges that have one triangle only",
        worse: Worse::Above,
        review: 0.1,
        fail: None,
        advice: "weld vertices where seams are open, and fill small holes",
        value: |report| Some(report.fidelity.scan.rim),
    },
    Criterion {
        code: "fragmented_scan",
        figure: "share of the scan's area in its largest part",
        worse: Worse::Below,
        review: 0.95,
        fail: None,
        advice: "keep one head alone, and weld vertices where seams are open",
        value: |report| Some(report.precheck.largest_part),
    },
    Criterion {
        code: "scan_missed",
        figure: "share of the scan's surface that the result covers",
        worse: Worse::Below,
        review: 0.88,
        fail: Some(0.7),
        advice: "look for what the result leaves out: a second object, a deep cavity, hair",
        value: |report| Some(report.fidelity.overlap.scan),
    },
    Criterion {
        code: "off_scan",
        figure: "share of the result over the scan that lies on it",
        worse: Worse::Below,
        review: 0.85,
        fail: Some(0.6),
        advice: "look at `_RESIDUAL` for where the result spans a gap or was led astray by landmarks",
        value: |report| Some(report.fidelity.overlap.mesh),
    },
    Criterion {
        code: "little_data",
        figure: "share of the result that is over the scan, not over holes or beyond its rim",
        worse: Worse::Below,
        review: 0.35,
        fail: Some(0.1),
        advice: "what is not over the scan is a guess; give a more complete scan",
        value: |report| Some(report.fidelity.overlap.mesh_over_scan),
    },
    Criterion {
        code: "surface_distance",
        figure: "the larger of the two median distances over the tolerance",
        worse: Worse::Above,
        review: 0.3,
        fail: Some(1.0),
        advice: "the result does not lie on the scan: check landmarks, orientation and that it is a head",
        value: |report| {
            let ways = [report.fidelity.scan_to_mesh, report.fidelity.mesh_to_scan];
            let largest = ways.into_iter().flatten().map(|way| way.p50).reduce(f64::max)?;
            ratio(largest, report.fidelity.overlap.tolerance)
        },
    },
    Criterion {
        code: "normals_differ",
        figure: "mean squared difference of unit normals",
        worse: Worse::Above,
        review: 0.3,
        fail: Some(0.8),
        advice: "the result is rough or folded where the scan is not, or the reverse",
        value: |report| report.fidelity.normal,
    },
    Criterion {
        code: "landmarks_distant",
        figure: "mean distance of the landmarks over the radius",
        worse: Worse::Above,
        review: 0.01,
        fail: Some(0.05),
        advice: "the landmarks do not fit the surface: `onemesh audit` looks for the wrong ones",
        value: |report| ratio(report.landmark_mean, report.fidelity.scan.radius),
    },
    Criterion {
        code: "landmark_distant",
        figure: "largest distance of a landmark over the radius",
        worse: Worse::Above,
        review: 0.03,
        fail: None,
        advice: "look at that landmark on the scan and place it anew, or give null",
        value: |report| {
            ratio(report.landmarks.values().copied().fold(0.0, f64::max), report.fidelity.scan.radius)
        },
    },
    Criterion {
        code: "flipped_triangles",
        figure: "share of triangles that face away from the scan",
        worse: Worse::Above,
        review: 0.03,
        fail: Some(0.15),
        advice: "look at lips, nostrils and ears in the picture",
        value: |report| Some(report.fidelity.flipped),
    },
    Criterion {
        code: "sliver_triangles",
        figure: "share of triangles that are slivers",
        worse: Worse::Above,
        review: 0.02,
        fail: Some(0.15),
        advice: "textures will be smeared there; look at the picture",
        value: |report| Some(report.fidelity.sliver),
    },
    Criterion {
        code: "self_intersections",
        figure: "share of triangles that meet another",
        worse: Worse::Above,
        review: 0.06,
        fail: Some(0.25),
        advice: "look at lips, nostrils and ears in the picture",
        value: |report| Some(report.fidelity.self_intersecting),
    },
    Criterion {
        code: "long_edges",
        figure: "the length that one edge in a thousand exceeds, over the median",
        worse: Worse::Above,
        review: 12.0,
        fail: None,
        advice: "few triangles cover a large part: look for spikes, a second object or a wide gap",
        value: |report| Some(report.fidelity.spacing.longest),
    },
    Criterion {
        code: "bent_edges",
        figure: "share of edges at which the result turns by more than 60 degrees",
        worse: Worse::Above,
        review: 0.1,
        fail: None,
        advice: "the triangles are too large for the surface: take a template of more vertices, or a smoother scan",
        value: |report| Some(report.fidelity.spacing.bent),
    },
];

/// A share of nothing is none.
fn ratio(length: f64, unit: f64) -> Option<f64> {
    (unit > 0.0).then(|| length / unit)
}

impl Criterion {
    /// The reason that a report gives by this criterion, if it does not keep the limits.
    fn reason(&self, report: &ScanReport) -> Option<Reason> {
        let value = (self.value)(report)?;
        // A figure that is no number keeps no limit.
        let keeps = |limit: f64| match self.worse {
            Worse::Above => value <= limit,
            Worse::Below => value >= limit,
        };
        if keeps(self.review) {
            return None;
        }
        let failed = self.fail.filter(|&limit| !keeps(limit));
        let (verdict, limit) = failed.map_or((Verdict::Review, self.review), |limit| (Verdict::Fail, limit));
        let side = match self.worse {
            Worse::Above => "at most",
            Worse::Below => "at least",
        };
        Some(Reason {
            code: self.code,
            verdict,
            found: format!("{}: {value:.4}, should be {side} {limit}", self.figure),
            advice: self.advice.to_owned(),
        })
    }
}

/// What a finding from before the registration alone leads to.
pub fn verdict_of(code: Code) -> Verdict {
    match code {
        // The result's left is the scan's right, or what a vertex marks is anybody's guess.
        Code::LandmarksMirrored
        | Code::LeftRightSwapped
        | Code::LandmarksDisordered
        | Code::LandmarksElsewhere => Verdict::Fail,
        Code::LandmarksOffSurface | Code::LandmarksSwapped | Code::LandmarkMisplaced => Verdict::Review,
        _ if code.severity() == Severity::Error => Verdict::Review,
        // Whether they matter shows in the figures.
        _ => Verdict::Pass,
    }
}

impl Reason {
    /// Why a report does not pass, the worst first; nothing if it does.
    pub(super) fn all_of(report: &ScanReport) -> Vec<Self> {
        let found = report.precheck.findings.iter().filter_map(Self::of_finding);
        let measured = CRITERIA.iter().filter_map(|criterion| criterion.reason(report));
        let mut reasons: Vec<Self> = found.chain(measured).collect();
        // Stable: those of one verdict stay in the order of cause and effect.
        reasons.sort_by_key(|reason| std::cmp::Reverse(reason.verdict));
        reasons
    }

    fn of_finding(finding: &Finding) -> Option<Self> {
        let verdict = verdict_of(finding.code);
        (verdict > Verdict::Pass).then(|| Self {
            code: finding.code.name(),
            verdict,
            found: finding.found.clone(),
            advice: finding.advice.clone(),
        })
    }
}

impl std::fmt::Display for Reason {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(out, "{}: {}; {}", self.code, self.found, self.advice)
    }
}

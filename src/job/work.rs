//! What a step does: from the bytes of its inputs to the bytes of its output, and nothing else. It runs on the threads
//! that compute, never on those that answer requests.

use std::collections::BTreeMap;
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use serde_json::value::RawValue;

use super::invert_work::InvertWork;
use super::result_file::ResultFile;
use super::scan::ScanId;
use super::stage::JobStage;
use super::state::Problem;
use crate::formats::Sha256;
use crate::pipeline::{
    BadState, ComparisonRow, FailedScan, FrozenCollection, InputEntry, Inspected, LandmarkEntry,
    LandmarkWeights, MOST_ROWS, Manifest, Observer, OutputEntry, OutputFormat, Placed, Plan, PlanStage,
    Precheck, Prepared, RegisterError, Report, ScanEntry, ScanReport, ScanResult, ScanState, Settings,
    SharedState, Subject, Template, Verdict, comparison_row, comparison_sheet, decode, encode, leave_out,
    precheck_inspected, record_bytes,
};
use crate::preflight::LandmarkAudit;

/// A step with all that it needs.
#[expect(clippy::large_enum_variant, reason = "one lives at a time, and not for long")]
pub(super) enum Work {
    /// [`JobStage::Inspect`] of a scan.
    Inspect(Arc<Subject>),
    /// [`JobStage::Plan`].
    Plan(PlanWork),
    /// [`JobStage::Engine`] of one scan.
    Scan {
        stage: PlanStage,
        plan: Arc<PlanFile>,
        scan: Arc<Prepared>,
        own: Option<Vec<u8>>,
        shared: Option<Vec<u8>>,
    },
    /// [`JobStage::Engine`] of all.
    Shared { stage: PlanStage, plan: Arc<PlanFile>, scans: Vec<Vec<u8>>, shared: Option<Vec<u8>> },
    /// [`JobStage::Package`].
    Package(PackageWork),
    /// [`JobStage::Set`].
    Set(SetWork),
    /// [`JobStage::Invert`].
    Invert(InvertWork),
}

/// The scans as they were inspected, by their places.
pub(super) struct PlanWork {
    pub scans: Vec<(i64, String, Vec<u8>)>,
    pub template: Option<Template>,
    pub settings: Settings,
}

/// A scan and the last state of it.
pub(super) struct PackageWork {
    pub plan: Arc<PlanFile>,
    pub place: i64,
    pub scan: ScanId,
    pub subject: Arc<Subject>,
    pub inputs: Vec<InputEntry>,
    pub own: Vec<u8>,
    pub shared: Option<Vec<u8>>,
}

/// All that was packaged.
pub(super) struct SetWork {
    pub plan: Arc<PlanFile>,
    pub scans: Vec<Vec<u8>>,
    pub shared: Option<Vec<u8>>,
    pub failed: Vec<FailedScan>,
    pub seconds: BTreeMap<String, f64>,
}

/// What a step leaves.
#[derive(Default)]
pub(super) struct Produced {
    /// For the steps after it.
    pub output: Vec<u8>,
    /// For the user.
    pub files: Vec<(ResultFile, Vec<u8>)>,
    /// What it decides.
    pub decided: Decided,
}

/// What a step decides for its job.
#[derive(Default)]
pub(super) enum Decided {
    #[default]
    Nothing,
    /// What is done from now on, and which scans are left out, by their places.
    Course(Vec<JobStage>, Vec<(i64, String)>),
    /// How good a scan's result is.
    Judgement(Judgement),
}

/// How good a scan's result is.
pub(super) struct Judgement {
    /// Whether it can be used.
    pub verdict: Verdict,
    /// Mean distance of the scan from it, in the scan's radius; none where they do not face each other.
    pub residual: Option<f64>,
}

/// Why a step leaves nothing.
#[derive(Debug, thiserror::Error)]
pub(super) enum Fault {
    /// It was asked to stop.
    #[error("stopped")]
    Stopped,
    /// Its inputs are at fault: it would fail again.
    #[error("{}", .0.detail)]
    Problem(Problem),
}

/// The plan of a registration and what it was made by.
#[derive(Serialize, Deserialize)]
pub(super) struct PlanFile {
    pub plan: Plan,
    /// JSON, whose fields may be left out.
    judged: Vec<u8>,
}

/// What was found wrong before.
#[derive(Serialize, Deserialize)]
struct Judged {
    prechecks: BTreeMap<i64, Precheck>,
    audit: LandmarkAudit,
}

/// A packaged scan.
#[derive(Serialize, Deserialize)]
struct PackagedScan {
    /// JSON of [`PackagedRecord`].
    record: Vec<u8>,
    row: Option<ComparisonRow>,
}

#[derive(Serialize, Deserialize)]
struct PackagedRecord {
    entry: ScanEntry,
    report: Box<RawValue>,
    landmarks: BTreeMap<String, [f64; 3]>,
}

/// `landmarks.json`.
#[derive(Serialize)]
struct LandmarksFile {
    record: u32,
    scheme: Option<String>,
    template: BTreeMap<String, LandmarkEntry>,
    scans: BTreeMap<String, BTreeMap<String, [f64; 3]>>,
    audit: LandmarkAudit,
}

impl Fault {
    pub fn problem(code: &str, detail: impl ToString) -> Self {
        Self::Problem(Problem { code: code.to_owned(), detail: detail.to_string() })
    }
}

impl From<RegisterError> for Fault {
    fn from(error: RegisterError) -> Self {
        match error {
            RegisterError::Canceled(_) => Self::Stopped,
            RegisterError::TooFewLandmarks { .. } | RegisterError::TooFewForTemplate { .. } => {
                Self::problem("too_few_landmarks", error)
            }
            RegisterError::Mask { .. } => Self::problem("unusable_scan", error),
            error => Self::problem("engine", error),
        }
    }
}

impl From<BadState> for Fault {
    fn from(error: BadState) -> Self {
        Self::problem("engine", error)
    }
}

impl From<serde_json::Error> for Fault {
    fn from(error: serde_json::Error) -> Self {
        Self::problem("engine", format!("an intermediate result cannot be read: {error}"))
    }
}

impl Work {
    /// Does it.
    pub fn run(self, observer: &dyn Observer) -> Result<Produced, Fault> {
        match self {
            Self::Inspect(subject) => {
                Ok(Produced { output: serde_json::to_vec(&Inspected::of(&subject))?, ..Produced::default() })
            }
            Self::Plan(work) => work.run(),
            Self::Scan { stage, plan, scan, own, shared } => {
                let own: Option<ScanState> = own.as_deref().map(decode).transpose()?;
                let shared = shared_state(shared.as_deref())?;
                let state = plan.plan.scan_step(stage, &scan, own.as_ref(), shared.as_ref(), observer)?;
                Ok(Produced { output: encode(&state), ..Produced::default() })
            }
            Self::Shared { stage, plan, scans, shared } => {
                let scans: Vec<ScanState> = scans.iter().map(|own| decode(own)).collect::<Result<_, _>>()?;
                let shared = shared_state(shared.as_deref())?;
                let state = plan.plan.shared_step(stage, &scans, shared.as_ref())?;
                Ok(Produced { output: encode(&state), ..Produced::default() })
            }
            Self::Package(work) => work.run(),
            Self::Set(work) => work.run(),
            Self::Invert(work) => work.run(observer),
        }
    }
}

fn shared_state(bytes: Option<&[u8]>) -> Result<Option<SharedState>, BadState> {
    bytes.map(decode).transpose()
}

impl PlanFile {
    /// A plan from its blob.
    pub fn read(bytes: &[u8]) -> Result<Self, BadState> {
        decode(bytes)
    }

    fn judged(&self) -> Result<Judged, Fault> {
        Ok(serde_json::from_slice(&self.judged)?)
    }
}

impl PlanWork {
    fn run(self) -> Result<Produced, Fault> {
        let inspected: Vec<Inspected> =
            self.scans.iter().map(|(_, _, bytes)| serde_json::from_slice(bytes)).collect::<Result<_, _>>()?;
        let named = || self.scans.iter().map(|(_, name, _)| name.as_str()).zip(&inspected);
        let landmarks: Vec<_> = named().map(|(name, own)| (name, &own.landmarks)).collect();
        let left_out = leave_out(&landmarks, self.template.as_ref());
        let stays = |name: &str| left_out.iter().all(|failed| failed.name != name);
        let kept: Vec<_> = named().filter(|(name, _)| stays(name)).collect();
        let gone = self.scans.iter().filter_map(|(place, name, _)| {
            let failed = left_out.iter().find(|failed| failed.name == *name)?;
            Some((*place, failed.problem.clone()))
        });
        let gone: Vec<(i64, String)> = gone.collect();
        if kept.is_empty() {
            let why = left_out
                .first()
                .map_or(String::new(), |failed| format!(": `{}` {}", failed.name, failed.problem));
            return Err(Fault::problem("too_few_landmarks", format!("no scan can be registered{why}")));
        }
        let (prechecks, audit) = precheck_inspected(&kept);
        let plan = match &self.template {
            Some(template) => Plan::from_template(template, kept.len(), &self.settings)?,
            None => {
                let landmarks: Vec<_> = kept.iter().map(|(_, own)| &own.landmarks).collect();
                Plan::new(&landmarks, &self.settings)?
            }
        };
        let plan = plan.weighing(LandmarkWeights::of(|| audit.clone(), &self.settings));
        let places = self.scans.iter().filter(|(_, name, _)| stays(name)).map(|(place, ..)| *place);
        let judged = Judged { prechecks: places.zip(prechecks).collect(), audit };
        let decided = Decided::Course(JobStage::all_of(&plan), gone);
        let file = PlanFile { plan, judged: serde_json::to_vec(&judged)? };
        Ok(Produced { output: encode(&file), files: Vec::new(), decided })
    }
}

impl PackageWork {
    fn run(self) -> Result<Produced, Fault> {
        let Self { plan, place, scan, subject, inputs, own, shared } = self;
        let placed: Placed = Placed::try_from(decode::<ScanState>(&own)?)?;
        let template = plan.plan.template(shared_state(shared.as_deref())?.as_ref())?;
        let judged = plan.judged()?;
        let precheck = judged.prechecks.get(&place).ok_or(RegisterError::State)?;
        let unfit = |error: &dyn std::fmt::Display| Fault::problem("engine", error);
        let result = ScanResult::of(&subject, precheck, &template, &placed.positions, &placed.confidence)
            .map_err(|error| unfit(&error))?;
        let glb = result.bytes(OutputFormat::Glb, None).map_err(|error| unfit(&error))?;
        let file = format!("{}.glb", subject.name);
        let record = PackagedRecord {
            entry: ScanEntry {
                name: subject.name.clone(),
                inputs,
                outputs: vec![OutputEntry { file, sha256: Sha256::of(&glb) }],
            },
            report: serde_json::value::to_raw_value(&result.report)?,
            landmarks: result.landmarks(),
        };
        // Pictures of the first on the sheet, as many as there are places for.
        let rank = judged.prechecks.keys().position(|other| *other == place);
        let row = rank.filter(|&rank| rank < MOST_ROWS).map(|_| comparison_row(&subject, &result.mesh));
        let packaged = PackagedScan { record: serde_json::to_vec(&record)?, row };
        Ok(Produced {
            output: encode(&packaged),
            files: vec![(ResultFile::Mesh(scan), glb)],
            decided: Decided::Judgement(Judgement::of(&result.report, &subject)),
        })
    }
}

impl Judgement {
    fn of(report: &ScanReport, subject: &Subject) -> Self {
        let radius = subject.mesh.radius_about(subject.mesh.centroid());
        let distances = report.fidelity.scan_to_mesh.as_ref();
        Self { verdict: report.verdict, residual: distances.map(|distances| distances.mean / radius) }
    }
}

impl SetWork {
    fn run(self) -> Result<Produced, Fault> {
        let template = self.plan.plan.template(shared_state(self.shared.as_deref())?.as_ref())?;
        let settings = self.plan.plan.settings();
        let (mut entries, mut reports, mut rows, mut landmarks) =
            (Vec::new(), Vec::new(), Vec::new(), BTreeMap::new());
        for bytes in &self.scans {
            let PackagedScan { record, row } = decode(bytes)?;
            let record: PackagedRecord = serde_json::from_slice(&record)?;
            landmarks.insert(record.entry.name.clone(), record.landmarks);
            entries.push(record.entry);
            reports.push(Written(record.report));
            rows.extend(row);
        }
        let engine = |error: &dyn std::fmt::Display| Fault::problem("engine", error);
        let sheet = comparison_sheet(rows, entries.len()).png_bytes().map_err(|error| engine(&error))?;
        let manifest = Manifest::of(settings, &template, entries);
        let landmarks = LandmarksFile {
            record: 1,
            scheme: template.scheme.clone(),
            template: manifest.template.landmarks.clone(),
            scans: landmarks,
            audit: self.plan.judged()?.audit,
        };
        let frozen = FrozenCollection { template, settings: settings.clone() };
        let frozen = frozen.glb_bytes().map_err(|error| engine(&error))?;
        let report = Report::of(self.seconds, reports, self.failed);
        let files = vec![
            (ResultFile::Template, frozen),
            (ResultFile::Sheet, sheet),
            (ResultFile::Report, record_bytes(&report)),
            (ResultFile::Landmarks, record_bytes(&landmarks)),
            (ResultFile::Manifest, record_bytes(&manifest)),
        ];
        Ok(Produced { files, ..Produced::default() })
    }
}

/// A report that was written before, to be written again with the same numbers.
struct Written(Box<RawValue>);

impl Serialize for Written {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut read = serde_json::Deserializer::from_str(self.0.get());
        serde_transcode::transcode(&mut read, serializer)
    }
}

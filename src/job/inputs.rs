//! The inputs of a step, out of the store.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use sqlx::Row;

use super::cache::Cache;
use super::capture::{CaptureFiles, CaptureParts};
use super::engine::Engine;
use super::graph::Claim;
use super::invert_work::InvertWork;
use super::record::{ALL, broken, from_json};
use super::scan::{ScanId, ScanLimits, ScanParts};
use super::source::{self, For, Source};
use super::stage::JobStage;
use super::state::Problem;
use super::store_error::StoreError;
use super::template::{TemplateFiles, TemplateParts};
use super::work::{Fault, PackageWork, PlanFile, PlanWork, SetWork, Work};
use crate::formats::Sha256;
use crate::pipeline::{FailedScan, InputEntry, PlanStage, Settings};

/// What a step needs, as bytes; to be understood where it is worked on.
pub(super) enum Inputs {
    Inspect(Source),
    Plan {
        scans: Vec<(i64, String, Vec<u8>)>,
        template: Option<TemplateFiles>,
        settings: Settings,
        limits: ScanLimits,
        scratch: PathBuf,
    },
    Scan {
        stage: PlanStage,
        plan: PlanBytes,
        source: Source,
        own: Option<Vec<u8>>,
        shared: Option<Vec<u8>>,
    },
    Shared {
        stage: PlanStage,
        plan: PlanBytes,
        scans: Vec<Vec<u8>>,
        shared: Option<Vec<u8>>,
    },
    Package {
        plan: PlanBytes,
        place: i64,
        scan: ScanId,
        source: Source,
        inputs: Vec<InputEntry>,
        own: Vec<u8>,
        shared: Option<Vec<u8>>,
    },
    Set {
        plan: PlanBytes,
        scans: Vec<Vec<u8>>,
        shared: Option<Vec<u8>>,
        failed: Vec<FailedScan>,
        seconds: BTreeMap<String, f64>,
    },
    Invert(InvertWork),
}

/// A plan that is still there from the step before, or its bytes.
pub(super) struct PlanBytes {
    digest: Sha256,
    there: Option<Arc<PlanFile>>,
    bytes: Vec<u8>,
}

/// Reads what one step needs.
struct Reader<'a> {
    engine: &'a Engine,
    claim: &'a Claim,
}

/// A scan of a job.
struct Member {
    scan: ScanId,
    name: String,
    parts: ScanParts,
}

impl Inputs {
    /// What a step needs.
    ///
    /// # Errors
    /// [`StoreError`].
    pub async fn fetch(engine: &Engine, claim: &Claim) -> Result<Self, StoreError> {
        let reader = Reader { engine, claim };
        match claim.stage() {
            JobStage::Inspect => Ok(Self::Inspect(reader.source(&reader.member().await?, None).await?)),
            JobStage::Plan => reader.plan_inputs().await,
            JobStage::Engine(stage) if stage.is_shared() => Ok(Self::Shared {
                stage,
                plan: reader.plan().await?,
                scans: reader.scans(claim.number - 1).await?.into_iter().map(|(.., bytes)| bytes).collect(),
                shared: reader.shared().await?,
            }),
            JobStage::Engine(stage) => {
                let plan = reader.plan().await?;
                let source = reader.source(&reader.member().await?, Some(plan.digest)).await?;
                Ok(Self::Scan {
                    stage,
                    plan,
                    source,
                    own: reader.own().await?,
                    shared: reader.shared().await?,
                })
            }
            JobStage::Package => {
                let member = reader.member().await?;
                Ok(Self::Package {
                    plan: reader.plan().await?,
                    place: claim.place,
                    source: reader.source(&member, None).await?,
                    inputs: source::inputs(&engine.blobs, &member.parts, &member.name).await?,
                    own: reader.own().await?.ok_or_else(|| broken("a scan has no result"))?,
                    shared: reader.shared().await?,
                    scan: member.scan,
                })
            }
            JobStage::Set => Ok(Self::Set {
                plan: reader.plan().await?,
                scans: reader.scans(claim.number - 1).await?.into_iter().map(|(.., bytes)| bytes).collect(),
                shared: reader.shared().await?,
                failed: reader.failed().await?,
                seconds: reader.seconds().await?,
            }),
            JobStage::Invert => reader.invert().await,
        }
    }

    /// The step itself; it takes a moment, so not on an async thread.
    pub fn into_work(self, cache: &Cache) -> Result<Work, Fault> {
        Ok(match self {
            Self::Inspect(source) => Work::Inspect(source.subject(cache)?),
            Self::Plan { scans, template, settings, limits, scratch } => {
                let template = template.map(|files| files.read(&limits, &scratch)).transpose();
                let template = template.map_err(|fault| Fault::problem("unusable_template", fault))?;
                Work::Plan(PlanWork { scans, template: template.map(|(template, _)| template), settings })
            }
            Self::Scan { stage, plan, source, own, shared } => {
                let (digest, plan) = (plan.digest, plan.read(cache)?);
                let scan = source.prepared(cache, &For { digest, plan: &plan })?;
                Work::Scan { stage, plan, scan, own, shared }
            }
            Self::Shared { stage, plan, scans, shared } => {
                Work::Shared { stage, plan: plan.read(cache)?, scans, shared }
            }
            Self::Package { plan, place, scan, source, inputs, own, shared } => {
                let (plan, subject) = (plan.read(cache)?, source.subject(cache)?);
                Work::Package(PackageWork { plan, place, scan, subject, inputs, own, shared })
            }
            Self::Set { plan, scans, shared, failed, seconds } => {
                Work::Set(SetWork { plan: plan.read(cache)?, scans, shared, failed, seconds })
            }
            Self::Invert(work) => Work::Invert(work),
        })
    }
}

impl PlanBytes {
    fn read(self, cache: &Cache) -> Result<Arc<PlanFile>, Fault> {
        if let Some(plan) = self.there {
            return Ok(plan);
        }
        let plan = Arc::new(PlanFile::read(&self.bytes)?);
        cache.keep_plan(self.digest, &plan);
        Ok(plan)
    }
}

impl Reader<'_> {
    async fn member(&self) -> Result<Member, StoreError> {
        let query = sqlx::query("SELECT scan, name, parts FROM child WHERE job = ? AND place = ?");
        let query = query.bind(self.claim.job).bind(self.claim.place);
        let row = query.fetch_one(self.engine.database.reader()).await?;
        Ok(Member {
            scan: row.try_get::<&str, _>("scan")?.parse().map_err(broken)?,
            name: row.try_get("name")?,
            parts: from_json(row.try_get("parts")?)?,
        })
    }

    async fn source(&self, member: &Member, plan: Option<Sha256>) -> Result<Source, StoreError> {
        let Engine { blobs, cache, settings, folder, .. } = self.engine;
        let place = (settings.scan_limits, folder.uploads());
        Source::fetch(blobs, cache, &member.parts, &member.name, plan, place).await
    }

    async fn plan_inputs(&self) -> Result<Inputs, StoreError> {
        let Engine { blobs, settings: own, folder, database, .. } = self.engine;
        let query = sqlx::query("SELECT parts, settings FROM job WHERE sequence = ?");
        let row = query.bind(self.claim.job).fetch_one(database.reader()).await?;
        let parts: Option<TemplateParts> =
            row.try_get::<Option<&str>, _>("parts")?.map(from_json).transpose()?;
        let template = match parts {
            Some(parts) => Some(TemplateFiles::fetch(blobs, &parts).await?),
            None => None,
        };
        Ok(Inputs::Plan {
            scans: self.scans(self.claim.number - 1).await?,
            template,
            settings: from_json(row.try_get("settings")?)?,
            limits: own.scan_limits,
            scratch: folder.uploads(),
        })
    }

    async fn invert(&self) -> Result<Inputs, StoreError> {
        let Engine { blobs, settings: own, folder, database, .. } = self.engine;
        let query = sqlx::query("SELECT parts, settings FROM job WHERE sequence = ?");
        let row = query.bind(self.claim.job).fetch_one(database.reader()).await?;
        let parts: CaptureParts = from_json(row.try_get("parts")?)?;
        Ok(Inputs::Invert(InvertWork {
            files: CaptureFiles::find(blobs, &parts).await?,
            settings: from_json(row.try_get("settings")?)?,
            limits: own.capture_limits,
            scratch: folder.uploads(),
            adapter: own.adapter.clone(),
        }))
    }

    async fn plan(&self) -> Result<PlanBytes, StoreError> {
        let digest = self.output(1, ALL).await?;
        let digest = digest.ok_or_else(|| broken("it has no plan"))?;
        let there = self.engine.cache.plan(digest);
        let bytes = if there.is_some() { Vec::new() } else { self.engine.blobs.read(digest).await?.into() };
        Ok(PlanBytes { digest, there, bytes })
    }

    /// The last state of the step's own scan that an engine stage left.
    async fn own(&self) -> Result<Option<Vec<u8>>, StoreError> {
        let first = JobStage::FIRST.len() as i64;
        let own =
            (first..self.claim.number).rev().find(|&number| !self.claim.stages[number as usize].is_shared());
        let Some(number) = own else { return Ok(None) };
        let digest = self.output(number, self.claim.place).await?;
        Ok(match digest {
            Some(digest) => Some(self.engine.blobs.read(digest).await?.into()),
            None => return Err(broken("a step's output is gone")),
        })
    }

    /// The last state that all share.
    async fn shared(&self) -> Result<Option<Vec<u8>>, StoreError> {
        let first = JobStage::FIRST.len() as i64;
        let shared =
            (first..self.claim.number).rev().find(|&number| self.claim.stages[number as usize].is_shared());
        let Some(number) = shared else { return Ok(None) };
        match self.output(number, ALL).await? {
            Some(digest) => Ok(Some(self.engine.blobs.read(digest).await?.into())),
            None => Err(broken("a step's output is gone")),
        }
    }

    async fn output(&self, number: i64, place: i64) -> Result<Option<Sha256>, StoreError> {
        let query =
            "SELECT output FROM step WHERE job = ? AND stage = ? AND place = ? AND output IS NOT NULL";
        let query = sqlx::query_scalar::<_, String>(query).bind(self.claim.job).bind(number).bind(place);
        let digest = query.fetch_optional(self.engine.database.reader()).await?;
        digest.map(|digest| digest.parse().map_err(broken)).transpose()
    }

    /// What a stage left of every scan that has not failed, in the order of their places.
    async fn scans(&self, number: i64) -> Result<Vec<(i64, String, Vec<u8>)>, StoreError> {
        let query = "SELECT s.place, c.name, s.output FROM step s
            JOIN child c ON c.job = s.job AND c.place = s.place
            WHERE s.job = ? AND s.stage = ? AND s.output IS NOT NULL AND c.status != 'failed' ORDER BY s.place";
        let rows = sqlx::query(query).bind(self.claim.job).bind(number);
        let mut scans = Vec::new();
        for row in rows.fetch_all(self.engine.database.reader()).await? {
            let digest = row.try_get::<&str, _>("output")?.parse().map_err(broken)?;
            let bytes = self.engine.blobs.read(digest).await?.into();
            scans.push((row.try_get("place")?, row.try_get("name")?, bytes));
        }
        Ok(scans)
    }

    async fn failed(&self) -> Result<Vec<FailedScan>, StoreError> {
        let query = "SELECT name, problem FROM child WHERE job = ? AND status = 'failed' ORDER BY name";
        let rows = sqlx::query(query).bind(self.claim.job).fetch_all(self.engine.database.reader()).await?;
        let failed = rows.iter().map(|row| {
            let problem: Option<Problem> =
                row.try_get::<Option<&str>, _>("problem")?.map(from_json).transpose()?;
            let problem = problem.map_or_else(String::new, |problem| problem.detail);
            Ok(FailedScan { name: row.try_get("name")?, problem })
        });
        failed.collect()
    }

    /// Seconds of work in each stage.
    async fn seconds(&self) -> Result<BTreeMap<String, f64>, StoreError> {
        let query =
            "SELECT stage, sum(coalesce(seconds, 0.0)) AS seconds FROM step WHERE job = ? GROUP BY stage";
        let rows = sqlx::query(query).bind(self.claim.job).fetch_all(self.engine.database.reader()).await?;
        let mut seconds = BTreeMap::new();
        for row in rows {
            if let Some(stage) = self.claim.stages.get(row.try_get::<i64, _>("stage")? as usize) {
                *seconds.entry(stage.name().to_owned()).or_default() += row.try_get::<f64, _>("seconds")?;
            }
        }
        Ok(seconds)
    }
}

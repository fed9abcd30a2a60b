//! How registrations are asked for.

use super::engine::Engine;
use super::error::JobError;
use super::job_id::{JobId, OfKind};
use super::jobs::Jobs;
use super::new_job::{Begun, NewJob};
use super::record::{broken, json};
use super::registration::{NewMember, NewRegistration, Registration, RegistrationId, TemplateChoice};
use super::result_file::ResultFile;
use super::scan::MeshKind;
use super::stage::JobStage;
use super::state::Job;
use super::store_error::StoreError;
use super::submission::{self, Member};
use super::template::{TemplateError, TemplateParts};

impl Jobs {
    /// Takes a registration on: it is kept before this returns.
    ///
    /// # Errors
    /// [`JobError::Invalid`] names the field; [`JobError::TooMany`] if the owner has too many open;
    /// [`JobError::Unavailable`] while nothing can be kept.
    pub async fn submit(&self, new: NewRegistration) -> Result<Registration, JobError> {
        self.check_running()?;
        if let Some(known) = self.known(new.dedupe_key.as_deref()).await? {
            return Ok(known);
        }
        let Engine { blobs, settings: own, folder, .. } = &*self.engine;
        let members = submission::members(&self.scans, &new.scans, own).await?;
        let template = self.template_parts(&new.template).await?;
        let scratch = folder.uploads();
        let settings =
            submission::settings(blobs, &new, template.as_ref(), own.scan_limits, &scratch).await?;
        let id = RegistrationId::new();
        let job = NewJob {
            id: &id,
            name: new.name.as_deref(),
            owner: new.owner.as_deref(),
            dedupe_key: new.dedupe_key.as_deref(),
            priority: new.priority,
            template: &new.template,
            parts: template.as_ref().map(json),
            settings: json(&settings),
            webhook: new.webhook.as_deref(),
            stages: &JobStage::FIRST,
        };
        let (mut tx, sequence, mut changed) = match self.begin(&job).await? {
            Begun::Known(job) => return Ok(job),
            Begun::New(tx, sequence, changed) => (tx, sequence, changed),
        };
        for (place, member) in (0..).zip(&members) {
            insert_member(&mut tx, sequence, place, member).await?;
        }
        check_still_there(&mut tx, sequence, members.len()).await?;
        changed.ready = members.len();
        self.engine.commit(tx, changed).await?;
        self.get(&id).await
    }

    /// A registration of further scans, against the template that a finished one left: the results of that stay as
    /// they are.
    ///
    /// # Errors
    /// As [`submit`](Self::submit); [`JobError::Conflict`] while the earlier one has no template.
    pub async fn add_scans(
        &self,
        to: &RegistrationId,
        scans: Vec<NewMember>,
        owner: Option<String>,
        dedupe_key: Option<String>,
    ) -> Result<Registration, JobError> {
        let earlier = self.get(to).await?;
        let template = TemplateChoice::Of(to.clone());
        let (name, priority) = (earlier.name, earlier.priority);
        let usual = NewRegistration::default();
        self.submit(NewRegistration { name, priority, scans, template, owner, dedupe_key, ..usual }).await
    }

    /// Refuses what cannot be kept for now.
    pub(super) fn check_running(&self) -> Result<(), JobError> {
        self.paused().map_or(Ok(()), |reason| Err(JobError::Unavailable(reason)))
    }

    /// What was asked for with a key before.
    pub(super) async fn known<K: OfKind>(&self, key: Option<&str>) -> Result<Option<Job<K>>, JobError> {
        let Some(key) = key else { return Ok(None) };
        let query = sqlx::query_scalar::<_, String>("SELECT id FROM job WHERE dedupe_key = ?").bind(key);
        let Some(id) = query.fetch_optional(self.engine.database.reader()).await? else { return Ok(None) };
        let id: JobId<K> = id.parse().map_err(broken)?;
        self.get(&id).await.map(Some)
    }

    async fn template_parts(&self, choice: &TemplateChoice) -> Result<Option<TemplateParts>, JobError> {
        match choice {
            TemplateChoice::Default => Ok(None),
            TemplateChoice::Stored(id) => match self.templates.get(id).await {
                Ok(stored) => Ok(Some(stored.parts)),
                Err(TemplateError::Store(error)) => Err(error.into()),
                Err(error) => Err(JobError::invalid("template", error)),
            },
            TemplateChoice::Of(id) => {
                let mesh = self.result(id, &ResultFile::Template).await?.digest;
                Ok(Some(TemplateParts { kind: MeshKind::Glb, mesh, landmarks: None, mask: None }))
            }
        }
    }
}

async fn insert_member(
    tx: &mut sqlx::SqliteConnection,
    job: i64,
    place: i64,
    member: &Member,
) -> Result<(), StoreError> {
    let child = "INSERT INTO child (job, place, scan, name, parts, status) VALUES (?, ?, ?, ?, ?, 'queued')";
    let child = sqlx::query(child).bind(job).bind(place).bind(member.scan.as_str());
    child.bind(&member.name).bind(json(&member.parts)).execute(&mut *tx).await?;
    let step = "INSERT INTO step (job, stage, place, state) VALUES (?, 0, ?, 'ready')";
    sqlx::query(step).bind(job).bind(place).execute(tx).await?;
    Ok(())
}

/// Whether no scan was deleted since it was looked at: from now on its files are kept.
async fn check_still_there(
    tx: &mut sqlx::SqliteConnection,
    job: i64,
    members: usize,
) -> Result<(), JobError> {
    let there = "SELECT count(*) FROM child c JOIN scan s ON s.id = c.scan WHERE c.job = ?";
    let there: i64 = sqlx::query_scalar(there).bind(job).fetch_one(tx).await?;
    match there as usize == members {
        true => Ok(()),
        false => Err(JobError::invalid("scans", "one was deleted just now: leave it out")),
    }
}

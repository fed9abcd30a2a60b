//! Where a scan of a registration comes from, as its steps need it.

use std::path::PathBuf;
use std::sync::Arc;

use super::blobs::Blobs;
use super::cache::{Cache, Key};
use super::scan::{ScanFiles, ScanLimits, ScanParts};
use super::store_error::StoreError;
use super::work::{Fault, PlanFile};
use crate::formats::Sha256;
use crate::pipeline::{InputEntry, Prepared, RegisterError, Subject};

/// A scan that is still there from the step before, or its files.
pub(super) struct Source {
    key: Key,
    from: From,
}

enum From {
    Prepared(Arc<Prepared>),
    Read(Arc<Subject>),
    Files { files: ScanFiles, name: String, limits: ScanLimits, scratch: PathBuf },
}

/// What a scan is prepared for.
pub(super) struct For<'a> {
    pub digest: Sha256,
    pub plan: &'a Arc<PlanFile>,
}

impl Source {
    /// Fetches what is not there; `plan` where the scan is to be prepared for it.
    pub async fn fetch(
        blobs: &Blobs,
        cache: &Cache,
        parts: &ScanParts,
        name: &str,
        plan: Option<Sha256>,
        (limits, scratch): (ScanLimits, PathBuf),
    ) -> Result<Self, StoreError> {
        let key = Key { scan: format!("{}\n{name}", super::record::json(parts)), plan: None };
        let prepared = plan.and_then(|plan| cache.prepared(&key.with(plan)));
        let from = match (prepared, cache.subject(&key)) {
            (Some(prepared), _) => From::Prepared(prepared),
            (None, Some(subject)) => From::Read(subject),
            _ => From::Files {
                files: ScanFiles::fetch(blobs, parts).await?,
                name: name.to_owned(),
                limits,
                scratch,
            },
        };
        Ok(Self { key, from })
    }

    /// The scan, read.
    pub fn subject(&self, cache: &Cache) -> Result<Arc<Subject>, Fault> {
        match &self.from {
            From::Read(subject) => Ok(subject.clone()),
            From::Files { files, name, limits, scratch } => {
                let read =
                    files.read(limits, scratch).map_err(|fault| Fault::problem("unusable_scan", fault))?;
                let subject = Arc::new(read.into_subject(name.clone()));
                cache.keep_subject(self.key.clone(), &subject);
                Ok(subject)
            }
            // Whoever asks for the scan itself fetches it without a plan.
            From::Prepared(_) => Err(RegisterError::State.into()),
        }
    }

    /// The scan, made ready for the plan that it was fetched for.
    pub fn prepared(&self, cache: &Cache, to: &For) -> Result<Arc<Prepared>, Fault> {
        if let From::Prepared(prepared) = &self.from {
            return Ok(prepared.clone());
        }
        let prepared = Arc::new(to.plan.plan.prepare(&*self.subject(cache)?)?);
        cache.keep_prepared(self.key.with(to.digest), &prepared);
        Ok(prepared)
    }
}

impl Key {
    fn with(&self, plan: Sha256) -> Self {
        Self { scan: self.scan.clone(), plan: Some(plan) }
    }
}

/// What a manifest tells of a scan's files, as if they lay in a folder of the scan's name.
pub(super) async fn inputs(
    blobs: &Blobs,
    parts: &ScanParts,
    name: &str,
) -> Result<Vec<InputEntry>, StoreError> {
    let mesh = Some((format!("scan.{}", parts.kind.extension()), parts.mesh));
    let landmarks = parts.landmarks.map(|digest| ("landmarks.json".to_owned(), digest));
    let mask = parts.mask.map(|digest| ("mask.json".to_owned(), digest));
    let texture = parts.texture.map(|digest| ("texture.png".to_owned(), digest));
    let mut inputs = Vec::new();
    for (file, sha256) in [mesh, texture, landmarks, mask].into_iter().flatten() {
        let size = blobs.size(sha256).await?.ok_or(StoreError::Missing { digest: sha256 })?;
        inputs.push(InputEntry { file: format!("{name}/{file}"), size, sha256 });
    }
    Ok(inputs)
}

//! What the layers below refuse, as problems.

use super::problem::{Kind, Problem};
use crate::job::JobError;
use crate::job::StoreError;
use crate::job::capture::CaptureFault;
use crate::job::scan::{ScanError, ScanFault};
use crate::job::template::TemplateError;

/// What whoever runs the server does where nothing draws.
const DRIVER: &str = "whoever runs the server must install a Vulkan driver, as by `apt install mesa-vulkan-drivers`, or set `work.adapter` to `reference`";
/// Seconds until a full disk is worth another try.
const STORAGE_RETRY: u64 = 60;

impl From<StoreError> for Problem {
    fn from(error: StoreError) -> Self {
        match error {
            StoreError::BrokenOff(problem) => Self::new(Kind::BrokenOff, problem).remedied("send it again"),
            StoreError::TooLarge { limit } => Self::new(
                Kind::LimitExceeded,
                format!("more than {limit} bytes were sent, which is the limit for one file"),
            )
            .remedied("send less, or raise `limits.scan.upload_bytes` in the server's configuration"),
            StoreError::Corrupted { .. } | StoreError::Missing { .. } => {
                tracing::error!(%error, "a stored file is damaged");
                Self::new(Kind::Damaged, error)
            }
            error if error.is_full() || matches!(error, StoreError::Folder { .. }) => {
                tracing::error!(%error, "nothing can be kept");
                Self::new(Kind::StorageUnavailable, "the server's disk is full or cannot be written")
                    .remedied("try again later; whoever runs the server must make room")
                    .retry_after(STORAGE_RETRY)
            }
            error => {
                tracing::error!(%error, "the store failed");
                Self::new(Kind::Internal, "the server's store failed; its log says more")
            }
        }
    }
}

impl From<ScanFault> for Problem {
    fn from(fault: ScanFault) -> Self {
        let field = fault.part();
        match fault {
            ScanFault::Unreadable { error, .. } => {
                Self::of_field(Kind::UnreadableFile, field, error, "correct the file, or export it again")
            }
            ScanFault::TooLarge { what, found, limit, remedy, .. } => {
                let finding = format!("has {found} {what}; at most {limit} are taken");
                Self::of_field(Kind::LimitExceeded, field, finding, remedy)
            }
            ScanFault::Unfit { problem, .. } => Self::of_field(Kind::UnreadableFile, field, problem, ""),
            ScanFault::Scratch(error) => StoreError::Folder { path: "uploads".into(), error }.into(),
        }
    }
}

impl From<CaptureFault> for Problem {
    fn from(fault: CaptureFault) -> Self {
        match fault {
            CaptureFault::Unfit { problem } => Self::of_field(Kind::UnreadableFile, "capture", problem, ""),
            CaptureFault::TooLarge { what, found, limit, remedy } => {
                let finding = format!("{what} {found}; at most {limit} are taken");
                Self::of_field(Kind::LimitExceeded, "capture", finding, remedy)
            }
            CaptureFault::Scratch(error) => StoreError::Folder { path: "uploads".into(), error }.into(),
        }
    }
}

impl From<ScanError> for Problem {
    fn from(error: ScanError) -> Self {
        match error {
            ScanError::Fault(fault) => fault.into(),
            ScanError::NotFound(_) => Self::not_found(error),
            ScanError::Store(error) => error.into(),
            ScanError::Crashed => Self::new(Kind::Internal, error),
        }
    }
}

impl From<TemplateError> for Problem {
    fn from(error: TemplateError) -> Self {
        match error {
            TemplateError::Fault(fault) => fault.into(),
            TemplateError::NotFound(_) => Self::not_found(error),
            TemplateError::Store(error) => error.into(),
            TemplateError::Crashed => Self::new(Kind::Internal, error),
        }
    }
}

impl From<JobError> for Problem {
    fn from(error: JobError) -> Self {
        match error {
            JobError::Invalid { field, problem } => Self::of_field(Kind::InvalidField, field, problem, ""),
            JobError::Capture(fault) => fault.into(),
            JobError::NoAdapter(finding) => {
                Self::new(Kind::NoAdapter, finding).remedied(DRIVER).retry_after(STORAGE_RETRY)
            }
            JobError::NotFound(_) => Self::not_found(error),
            JobError::Conflict(_) => Self::new(Kind::Conflict, error),
            JobError::TooMany(_) => Self::new(Kind::TooManyJobs, error)
                .remedied("wait until one has ended, or cancel one")
                .retry_after(10),
            JobError::Unavailable(_) => Self::new(Kind::StorageUnavailable, error).retry_after(STORAGE_RETRY),
            JobError::Store(error) => error.into(),
        }
    }
}

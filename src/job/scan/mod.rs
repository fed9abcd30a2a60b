//! Uploaded scans: their files, what is known of them, and how they are read.

mod archive;
mod fault;
mod files;
mod id;
mod limits;
mod picture;
mod record;
mod scans;
#[cfg(test)]
mod tests;

pub use fault::{Part, ScanFault};
pub use files::{ReadScan, ScanFiles};
pub use id::{BadId, ScanId};
pub(super) use id::{checked_id, digest_id};
pub use limits::ScanLimits;
pub(super) use record::kind_of;
pub use record::{MeshKind, Scan, ScanParts};
pub use scans::{NewScan, ScanError, Scans};

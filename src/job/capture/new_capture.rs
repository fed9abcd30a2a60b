use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::fault::CaptureFault;
use crate::formats::Sha256;
use crate::job::blobs::Kept;

/// What a file of a capture is for, which says where it is laid.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// A zip of everything.
    Zip,
    /// The cameras, or a part of them.
    Cameras,
    /// A picture.
    Image,
    /// A silhouette.
    Mask,
}

/// The files of a capture that were sent and that nobody has looked at yet.
#[derive(Debug, Default)]
pub struct NewCapture {
    zip: Option<Kept>,
    /// By their places in the capture's folder.
    files: BTreeMap<String, Kept>,
}

/// A capture's files in the store.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct CaptureParts {
    /// A zip of everything.
    pub zip: Option<Sha256>,
    /// Files by their places in the capture's folder.
    pub files: BTreeMap<String, Sha256>,
}

impl NewCapture {
    /// Adds a file by the name that its sender gives it.
    ///
    /// # Errors
    /// [`CaptureFault::Unfit`] for a name that names no file, or one that is there.
    pub fn add(&mut self, role: Role, name: &str, file: Kept) -> Result<(), CaptureFault> {
        if role == Role::Zip {
            return match self.zip.replace(file) {
                None => Ok(()),
                Some(_) => Err(unfit("there are two zips: send one".to_owned())),
            };
        }
        // Some clients send whole paths; the last part is the file's own name.
        let own = name.rsplit(['/', '\\']).next().unwrap_or_default();
        if own.is_empty() || own.starts_with('.') || own.len() > 200 || own.contains(char::is_control) {
            return Err(unfit(format!("{name:?} names no file: send each file with its name")));
        }
        let place = match role {
            Role::Image => format!("images/{own}"),
            Role::Mask => format!("masks/{own}"),
            Role::Cameras | Role::Zip => own.to_owned(),
        };
        match self.files.insert(place, file) {
            None => Ok(()),
            Some(_) => Err(unfit(format!("{own:?} is there twice: send it once"))),
        }
    }

    /// How many files there are.
    pub fn count(&self) -> usize {
        self.files.len() + usize::from(self.zip.is_some())
    }

    /// Bytes of all files, as they were sent.
    pub fn bytes(&self) -> u64 {
        self.zip.iter().chain(self.files.values()).map(|kept| kept.info.size).sum()
    }

    /// Which files there are.
    pub fn parts(&self) -> CaptureParts {
        CaptureParts {
            zip: self.zip.as_ref().map(|kept| kept.info.digest),
            files: self.files.iter().map(|(place, kept)| (place.clone(), kept.info.digest)).collect(),
        }
    }
}

impl CaptureParts {
    /// The digests of all files.
    pub fn digests(&self) -> impl Iterator<Item = Sha256> {
        self.zip.into_iter().chain(self.files.values().copied())
    }
}

fn unfit(problem: String) -> CaptureFault {
    CaptureFault::Unfit { problem }
}

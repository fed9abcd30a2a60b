use std::io;

/// What is wrong with an uploaded capture.
#[derive(Debug, thiserror::Error)]
pub enum CaptureFault {
    /// It cannot be understood, or is not whole.
    #[error("{problem}")]
    Unfit {
        /// Which file, what was found and what to do.
        problem: String,
    },
    /// It is larger than is taken.
    #[error("{what} {found}; at most {limit} are taken: {remedy}")]
    TooLarge {
        /// Of what there is too much, as `has views:`.
        what: String,
        /// How much there is, at least.
        found: u64,
        /// How much may be.
        limit: u64,
        /// What to do.
        remedy: &'static str,
    },
    /// The folder that it is laid out in failed.
    #[error("cannot be unpacked: {0}")]
    Scratch(#[from] io::Error),
}

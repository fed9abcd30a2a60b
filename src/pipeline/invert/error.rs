use crate::formats::FormatError;
use crate::mesh::MeshError;
use crate::pipeline::observer::Canceled;
use crate::pipeline::settings::SettingError;
use crate::render::RenderError;

/// Why no mesh came of the pictures.
#[derive(Debug, thiserror::Error)]
pub enum InvertError {
    /// The observer asked to stop.
    #[error(transparent)]
    Canceled(#[from] Canceled),
    /// A parameter that cannot be worked with.
    #[error(transparent)]
    Setting(#[from] SettingError),
    /// A picture that cannot be read.
    #[error(transparent)]
    Format(#[from] FormatError),
    /// The pictures cannot be drawn.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// Too few views.
    #[error(
        "there are {found} views: a shape takes two at least that see it from different sides, better a dozen"
    )]
    TooFewViews {
        /// How many.
        found: usize,
    },
    /// Nothing says where the object is in a picture.
    #[error(
        "view `{view}` has no silhouette: give its picture an opacity, or put white-on-black pictures of the object \
         into masks/"
    )]
    NoSilhouette {
        /// Which.
        view: String,
    },
    /// The object fills every picture.
    #[error("the silhouettes of all views fill their pictures: mask what is not the object")]
    Unmasked,
    /// The silhouettes are of no common object.
    #[error("the cameras and silhouettes agree on {agreement:.0} % of the silhouettes' area only: {remedy}")]
    Cameras {
        /// Percent of the silhouettes' area that the volume common to all covers.
        agreement: f64,
        /// What to do.
        remedy: String,
    },
    /// A camera in the object.
    #[error(
        "the camera of view `{view}` stands inside the object that the silhouettes leave room for: correct its pose, or \
         leave the view out"
    )]
    Inside {
        /// Which.
        view: String,
    },
    /// The shape was lost on the way.
    #[error("the shape fell apart at iteration {iteration}: lower the `rate` of the levels")]
    Diverged {
        /// Of its level.
        iteration: usize,
    },
    /// No mesh of the result.
    #[error("the result is no mesh: {0}")]
    Mesh(#[from] MeshError),
}

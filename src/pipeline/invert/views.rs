use glam::DVec3;

use super::error::InvertError;
use super::settings::{InvertSettings, What};
use super::shown::{self, Shown};
use crate::formats::{Capture, CaptureView, Encoding, FormatError, Photograph};
use crate::pipeline::observer::{Canceled, Observer};

/// Pictures that are looked at to find out what all show, and the longest side at which they are.
const LOOKED_AT: usize = 4;
const GLANCE: u32 = 256;

/// The pictures of an inversion, ready to be matched.
#[derive(Debug, Clone)]
pub struct Views {
    /// Each with a silhouette.
    pub photographs: Vec<Photograph>,
    /// What they show.
    pub shown: Shown,
    /// What was left out on the way, and why.
    pub warnings: Vec<String>,
}

impl Views {
    /// Takes pictures in memory: those of shaded objects as light intensities, not in sRGB's code.
    ///
    /// # Errors
    /// [`InvertError::TooFewViews`], [`InvertError::NoSilhouette`], [`InvertError::Unmasked`].
    pub fn new(mut photographs: Vec<Photograph>, what: What) -> Result<Self, InvertError> {
        enough(photographs.len())?;
        shown::silhouettes(&mut photographs, what)?;
        let shown = Shown::of(&photographs, what);
        Ok(Self { photographs, shown, warnings: Vec::new() })
    }

    /// Reads the pictures of a capture, one after another, each reduced to what the settings ask for; of more than
    /// `most_views` those that stand farthest from one another.
    ///
    /// # Errors
    /// As [`Views::new`], and [`InvertError::Format`] for a picture that cannot be read; [`InvertError::Canceled`].
    pub fn of_capture(
        capture: &Capture,
        settings: &InvertSettings,
        observer: &dyn Observer,
    ) -> Result<Self, InvertError> {
        enough(capture.views.len())?;
        let mut warnings = capture.warnings.clone();
        let chosen = apart(&capture.views, settings.most_views);
        if chosen.len() < capture.views.len() {
            warnings.push(format!(
                "of {} views the {} are used that stand farthest apart; raise most_views for more",
                capture.views.len(),
                chosen.len()
            ));
        }
        let encoding = encoding(&chosen, settings.what)?;
        let mut photographs = Vec::with_capacity(chosen.len());
        for view in chosen {
            if observer.cancelled() {
                return Err(Canceled.into());
            }
            photographs.push(view.photograph(settings.longest_side(), encoding)?);
        }
        let what = match encoding {
            Encoding::Srgb => What::Shaded,
            Encoding::Linear => settings.what,
        };
        Ok(Self { warnings, ..Self::new(photographs, what)? })
    }
}

fn enough(found: usize) -> Result<(), InvertError> {
    if found < 2 { Err(InvertError::TooFewViews { found }) } else { Ok(()) }
}

/// How the pictures' numbers are to be read, by a glance at some.
fn encoding(views: &[&CaptureView], what: What) -> Result<Encoding, InvertError> {
    match what {
        What::Shaded => return Ok(Encoding::Srgb),
        What::Detect => {}
        _ => return Ok(Encoding::Linear),
    }
    let glance = |view: &&CaptureView| view.photograph(GLANCE, Encoding::Linear);
    let some = views.iter().step_by(views.len().div_ceil(LOOKED_AT));
    let mut glances = some.map(glance).collect::<Result<Vec<_>, FormatError>>()?;
    shown::silhouettes(&mut glances, what).or_else(|error| match error {
        InvertError::Unmasked => Ok(()),
        error => Err(error),
    })?;
    Ok(if Shown::of(&glances, what) == Shown::Shaded { Encoding::Srgb } else { Encoding::Linear })
}

/// At most so many views, in their order: the first, then again and again the one farthest from those taken.
fn apart(views: &[CaptureView], most: usize) -> Vec<&CaptureView> {
    if views.len() <= most {
        return views.iter().collect();
    }
    let places: Vec<DVec3> = views.iter().map(|view| view.camera.pose.centre()).collect();
    let mut distances = vec![f64::INFINITY; views.len()];
    let mut taken = vec![false; views.len()];
    let mut next = 0;
    for _ in 0..most {
        taken[next] = true;
        for (distance, place) in distances.iter_mut().zip(&places) {
            *distance = distance.min(place.distance_squared(places[next]));
        }
        // The first of the farthest.
        let farthest = |best: usize, at: usize| {
            if !taken[at] && (taken[best] || distances[at] > distances[best]) { at } else { best }
        };
        next = (0..views.len()).fold(next, farthest);
    }
    views.iter().zip(taken).filter(|(_, taken)| *taken).map(|(view, _)| view).collect()
}

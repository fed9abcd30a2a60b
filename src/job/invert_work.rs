use std::path::PathBuf;

use super::capture::{CaptureFault, CaptureFiles, CaptureLimits};
use super::result_file::ResultFile;
use super::work::{Fault, Produced};
use crate::formats::Capture;
use crate::pipeline::{Inversion, InvertError, InvertSettings, Observer, OutputFormat, Views, invert};
use crate::render::{self, AdapterChoice, RenderError};

/// Devices that are tried before one that is lost is the job's end.
const DEVICES: usize = 3;

/// [`JobStage::Invert`](super::stage::JobStage::Invert) with all that it needs.
pub(super) struct InvertWork {
    pub files: CaptureFiles,
    pub settings: InvertSettings,
    pub limits: CaptureLimits,
    pub scratch: PathBuf,
    pub adapter: AdapterChoice,
}

impl InvertWork {
    /// From pictures to a mesh.
    pub fn run(self, observer: &dyn Observer) -> Result<Produced, Fault> {
        let folder = tempfile::tempdir_in(&self.scratch).map_err(CaptureFault::Scratch)?;
        let capture = self.files.lay_out(folder.path(), &self.limits)?;
        let inversion = self.invert(&capture, observer).map_err(|error| {
            // The folder's path means nothing to whoever sent the pictures.
            let path = format!("{}/", folder.path().display());
            fault_of(error, &path)
        })?;
        let unfit = |error: &dyn std::fmt::Display| Fault::problem("engine", error);
        let files = vec![
            (ResultFile::Object, inversion.bytes("mesh", OutputFormat::Glb).map_err(|error| unfit(&error))?),
            (ResultFile::Sheet, inversion.sheet().png_bytes().map_err(|error| unfit(&error))?),
            (ResultFile::Report, inversion.report_json().into_bytes()),
        ];
        Ok(Produced { files, ..Produced::default() })
    }

    fn invert(&self, capture: &Capture, observer: &dyn Observer) -> Result<Inversion, InvertError> {
        let views = Views::of_capture(capture, &self.settings, observer)?;
        let open = || render::open(&self.adapter);
        on_device(open, |mut renderer| invert(&views, &self.settings, &mut *renderer, observer))
    }
}

/// Does work on a device, and again on a new one where that is lost.
fn on_device<R, T>(
    open: impl Fn() -> Result<R, RenderError>,
    work: impl Fn(R) -> Result<T, InvertError>,
) -> Result<T, InvertError> {
    let mut left = DEVICES;
    loop {
        left -= 1;
        match work(open()?) {
            Err(InvertError::Render(error @ RenderError::Device { .. })) if left > 0 => {
                tracing::warn!(%error, "the device is lost: it is begun again on a new one");
            }
            outcome => return outcome,
        }
    }
}

impl From<CaptureFault> for Fault {
    fn from(fault: CaptureFault) -> Self {
        match fault {
            CaptureFault::Scratch(_) => Self::problem("storage", fault),
            fault => Self::problem("unusable_capture", fault),
        }
    }
}

fn fault_of(error: InvertError, folder: &str) -> Fault {
    let code = match &error {
        InvertError::Canceled(_) => return Fault::Stopped,
        InvertError::Render(RenderError::NoAdapter | RenderError::NoSuchAdapter { .. }) => "no_adapter",
        InvertError::Render(RenderError::Device { .. }) => "device_lost",
        InvertError::Render(_) | InvertError::Mesh(_) => "engine",
        InvertError::Setting(_) | InvertError::Diverged { .. } => "unusable_settings",
        _ => "unusable_capture",
    };
    Fault::problem(code, error.to_string().replace(folder, ""))
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use super::*;

    /// What comes of work on devices of which so many are lost, and how many were opened.
    fn lost(count: usize) -> (Result<usize, InvertError>, usize) {
        let opened = Cell::new(0);
        let open = || {
            opened.set(opened.get() + 1);
            Ok(opened.get())
        };
        let outcome = on_device(open, |device| match device > count {
            true => Ok(device),
            false => Err(RenderError::Device { adapter: "card".into(), finding: "lost".into() }.into()),
        });
        (outcome, opened.get())
    }

    #[test]
    fn a_lost_device_is_followed_by_a_new_one_but_not_for_ever() {
        assert!(matches!(lost(0), (Ok(1), 1)));
        assert!(matches!(lost(DEVICES - 1), (Ok(DEVICES), DEVICES)));
        assert!(matches!(lost(DEVICES), (Err(InvertError::Render(RenderError::Device { .. })), DEVICES)));
        let other = on_device(|| Ok(()), |()| Err::<(), _>(InvertError::Unmasked));
        assert!(matches!(other, Err(InvertError::Unmasked)));
        let none = on_device(|| Err::<(), _>(RenderError::NoAdapter), |()| Ok(()));
        assert!(matches!(none, Err(InvertError::Render(RenderError::NoAdapter))));
    }
}

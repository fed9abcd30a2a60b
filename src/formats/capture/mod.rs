//! Captures: pictures of one scene with the cameras that took them, as folders of nerfstudio and instant-ngp, COLMAP, and
//! Metashape have them.

mod colmap;
mod lens;
mod metashape;
mod photograph;
mod pictures;
#[cfg(test)]
mod tests;
mod transforms;
mod writer;

use std::path::{Path, PathBuf};

use super::error::{Fault, FormatError};
use super::input::read_file;
use crate::camera::Camera;
pub use photograph::Photograph;
use pictures::Pictures;
pub use writer::write_capture;

/// A picture and the camera that took it.
#[derive(Debug, Clone, PartialEq)]
pub struct CaptureView {
    /// What the cameras' file calls the picture.
    pub name: String,
    /// The picture's file.
    pub image: PathBuf,
    /// The file of its silhouette, where there is one beside it: white or opaque is the object.
    pub mask: Option<PathBuf>,
    /// The camera. Its picture's size is zero where the cameras' file does not say it.
    pub camera: Camera,
}

/// The pictures of a folder with their cameras, in the cameras' file's order.
#[derive(Debug, Clone, PartialEq)]
pub struct Capture {
    /// The file that has the cameras.
    pub cameras: PathBuf,
    /// The views.
    pub views: Vec<CaptureView>,
    /// What was left out, and why.
    pub warnings: Vec<String>,
}

/// Where the cameras of a folder may be, by the program that wrote them; the first that is there is read.
const TRANSFORMS: [&str; 3] = ["transforms.json", "transforms_train.json", "cameras.json"];
const COLMAP: [&str; 4] = ["sparse/0", "colmap/sparse/0", "sparse", ""];

impl Capture {
    /// Reads the cameras of a folder, or those of a file in it; the pictures themselves are not read.
    ///
    /// # Errors
    /// [`FormatError`] where there are no cameras, or none that can be read, or a picture is missing.
    pub fn open(path: impl AsRef<Path>) -> Result<Self, FormatError> {
        let path = path.as_ref();
        if path.is_dir() {
            return Self::of_folder(path);
        }
        let folder = path.parent().unwrap_or(Path::new(""));
        match path.extension().and_then(|extension| extension.to_str()) {
            Some("json") => Self::of_transforms(folder, path),
            Some("xml") => Self::of_metashape(folder, path),
            _ => {
                let problem =
                    "is no folder of a capture, no transforms.json and no Metashape XML: give one of these";
                Err(FormatError::from(Fault::at("this path", problem)).in_file(path))
            }
        }
    }

    fn of_folder(folder: &Path) -> Result<Self, FormatError> {
        let file = |name: &&str| folder.join(name).is_file();
        if let Some(name) = TRANSFORMS.iter().find(|name| file(name)) {
            return Self::of_transforms(folder, &folder.join(name));
        }
        if let Some(model) =
            COLMAP.iter().map(|place| folder.join(place)).find(|model| colmap::is_model(model))
        {
            return Self::of_colmap(folder, &model);
        }
        match xml_files(folder)?.as_slice() {
            [] => {
                let problem = "holds no cameras: neither transforms.json, nor a COLMAP model (cameras and images, .bin \
                               or .txt, in sparse/0, sparse or here), nor a Metashape XML";
                Err(FormatError::from(Fault::at("the folder", problem)).in_file(folder))
            }
            [one] => Self::of_metashape(folder, one),
            several => {
                let problem = format!("holds {} XML files: give the one with the cameras", several.len());
                Err(FormatError::from(Fault::at("the folder", problem)).in_file(folder))
            }
        }
    }

    fn of_transforms(folder: &Path, path: &Path) -> Result<Self, FormatError> {
        let frames = transforms::read(&read_file(path)?).map_err(|fault| in_file(fault, path))?;
        Self::with_pictures(Pictures::of(folder, &[""])?, path, frames, Vec::new())
    }

    fn of_colmap(folder: &Path, model: &Path) -> Result<Self, FormatError> {
        let (path, frames) = colmap::read(model)?;
        Self::with_pictures(Pictures::of(folder, &["images", "input", ""])?, &path, frames, Vec::new())
    }

    fn of_metashape(folder: &Path, path: &Path) -> Result<Self, FormatError> {
        let (frames, warnings) = metashape::read(&read_file(path)?).map_err(|fault| in_file(fault, path))?;
        Self::with_pictures(Pictures::of(folder, &["images", "", "photos"])?, path, frames, warnings)
    }

    fn with_pictures(
        pictures: Pictures,
        path: &Path,
        frames: Vec<Frame>,
        warnings: Vec<String>,
    ) -> Result<Self, FormatError> {
        if frames.is_empty() {
            return Err(in_file(
                Fault::at("its cameras", "are none: it must place at least one picture"),
                path,
            ));
        }
        let view = |frame: Frame| {
            let image = pictures.find(&frame.name).map_err(|fault| in_file(fault, path))?;
            let mask = match &frame.mask {
                Some(mask) => Some(pictures.find(mask).map_err(|fault| in_file(fault, path))?),
                None => pictures.mask_of(&frame.name),
            };
            Ok(CaptureView { name: frame.name, image, mask, camera: frame.camera })
        };
        let views = frames.into_iter().map(view).collect::<Result<_, FormatError>>()?;
        Ok(Self { cameras: path.to_owned(), views, warnings })
    }
}

/// A view as a cameras' file has it.
struct Frame {
    /// The picture's path, perhaps without its extension.
    name: String,
    /// The mask's, where the file names one.
    mask: Option<String>,
    camera: Camera,
}

fn in_file(fault: Fault, path: &Path) -> FormatError {
    FormatError::from(fault).in_file(path)
}

fn xml_files(folder: &Path) -> Result<Vec<PathBuf>, FormatError> {
    let entries = std::fs::read_dir(folder).map_err(|error| in_file(Fault::Unreadable(error), folder))?;
    let paths = entries.filter_map(|entry| Some(entry.ok()?.path()));
    let mut files: Vec<PathBuf> = paths.filter(|path| path.extension().is_some_and(|e| e == "xml")).collect();
    files.sort();
    Ok(files)
}

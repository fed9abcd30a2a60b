use std::collections::HashMap;
use std::fs;
use std::path::{Component, Path, PathBuf};

use crate::formats::error::{Fault, FormatError};

/// What pictures may be called, where their extension is left out.
const EXTENSIONS: [&str; 5] = ["png", "jpg", "jpeg", "PNG", "JPG"];

/// Folders that hold silhouettes.
const MASKS: [&str; 2] = ["masks", "mask"];

/// The picture files of a capture's folder.
pub(super) struct Pictures {
    folder: PathBuf,
    /// Where names are sought, relative to the folder.
    places: Vec<PathBuf>,
    /// The files in the folders of silhouettes, by their names.
    masks: HashMap<String, PathBuf>,
}

impl Pictures {
    pub fn of(folder: &Path, places: &[&str]) -> Result<Self, FormatError> {
        let mut masks = HashMap::new();
        for place in MASKS {
            let Ok(entries) = fs::read_dir(folder.join(place)) else { continue };
            let mut paths: Vec<PathBuf> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
            paths.sort();
            for path in paths {
                if let Some(name) = path.file_name().and_then(|name| name.to_str()) {
                    masks.entry(name.to_owned()).or_insert(path);
                }
            }
        }
        let places = places.iter().map(PathBuf::from).collect();
        Ok(Self { folder: folder.to_owned(), places, masks })
    }

    /// The file that a cameras' file calls `name`, with or without its extension.
    pub fn find(&self, name: &str) -> Result<PathBuf, Fault> {
        let inside = inside(name).ok_or_else(|| {
            Fault::at(
                format_args!("picture `{name}`"),
                "lies outside the capture's folder: use paths relative to it, without `..`",
            )
        })?;
        let at = |place: &PathBuf| self.folder.join(place).join(&inside);
        let with = |path: PathBuf| {
            let extended = EXTENSIONS.iter().map(|extension| {
                let mut longer = path.clone().into_os_string();
                longer.push(".");
                longer.push(extension);
                PathBuf::from(longer)
            });
            let candidates: Vec<PathBuf> = std::iter::once(path.clone()).chain(extended).collect();
            candidates.into_iter().find(|candidate| candidate.is_file())
        };
        self.places.iter().find_map(|place| with(at(place))).ok_or_else(|| {
            let problem = "is not there: put the pictures where the cameras' file says, or correct its paths";
            Fault::at(format_args!("picture `{name}`"), problem)
        })
    }

    /// The silhouette of the picture called `name`: `masks/NAME`, `masks/NAME.png` with or without the picture's own
    /// extension.
    pub fn mask_of(&self, name: &str) -> Option<PathBuf> {
        let file = Path::new(name).file_name()?.to_str()?;
        let stem = Path::new(file).file_stem()?.to_str()?;
        let names = [file.to_owned(), format!("{file}.png"), format!("{stem}.png"), format!("{stem}.jpg")];
        let found = names.iter().find_map(|name| self.masks.get(name)).cloned();
        found.or_else(|| self.masks.get(&format!("{stem}_mask.png")).cloned())
    }
}

/// A relative path that stays inside its folder.
fn inside(name: &str) -> Option<PathBuf> {
    let path = name.replace('\\', "/");
    let parts = Path::new(&path).components().filter(|part| *part != Component::CurDir);
    let inside: Option<PathBuf> =
        parts.map(|part| matches!(part, Component::Normal(_)).then_some(part)).collect();
    inside.filter(|inside| *inside != Path::new(""))
}

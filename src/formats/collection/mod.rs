//! Collections: the scans that are registered together, from a folder or from a manifest.

mod error;
mod folder;
mod manifest;
#[cfg(test)]
mod tests;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use super::input::{InputFile, read_file};
use super::landmarks::LandmarkFile;
use super::mask::MaskFile;
use super::mesh_file::MeshFile;
use crate::mesh::{LandmarkSet, TriangleMesh};
pub use error::CollectionError;

/// Scans with their landmarks, sorted by name; at least one landmark is present on all of them.
#[derive(Debug, Clone)]
pub struct Collection {
    members: Vec<Member>,
}

/// One scan of a collection, its landmarks read, its mesh not yet.
#[derive(Debug, Clone)]
pub struct Member {
    /// Unique in the collection, and fit to name a file.
    pub name: String,
    /// The mesh's file.
    pub mesh: PathBuf,
    /// The landmarks' file.
    pub landmarks_file: InputFile,
    /// The landmarks, perhaps by vertices or triangles of the mesh.
    pub landmarks: LandmarkFile,
    /// The file of its mask, if it has one.
    pub mask: Option<PathBuf>,
}

/// A scan that has been read whole.
#[derive(Debug, Clone)]
pub struct Scan {
    /// The member's name.
    pub name: String,
    /// The surface, in the scan's own space.
    pub mesh: TriangleMesh,
    /// Its landmarks, in the same space.
    pub landmarks: LandmarkSet,
    /// How much each vertex counts as data `[N]`, 0 to 1, if it has a mask.
    pub mask: Option<Vec<f32>>,
    /// All files it was read from: the mesh, what the mesh names, the landmarks, the mask.
    pub inputs: Vec<InputFile>,
}

/// A scan that cannot be used, and why.
#[derive(Debug)]
pub struct Refused {
    /// Its name.
    pub name: String,
    /// What is wrong.
    pub error: Box<CollectionError>,
}

impl Refused {
    fn new(name: impl Into<String>, error: CollectionError) -> Self {
        Self { name: name.into(), error: Box::new(error) }
    }
}

/// Where a scan's files are.
struct Source {
    name: String,
    mesh: PathBuf,
    landmarks: PathBuf,
    mask: Option<PathBuf>,
    /// What the landmarks are called, if their own file does not say.
    scheme: Option<String>,
}

impl Collection {
    /// Opens a folder of scans or a JSON manifest, and reads all landmarks. Meshes are read by [`Member::read`].
    ///
    /// A folder holds `NAME/scan.ply` with `NAME/landmarks.json`, or `NAME.ply` with `NAME.landmarks.json`, where the
    /// mesh may also be OBJ, STL, GLB or glTF, and the landmarks any of [`LandmarkFile::EXTENSIONS`]; of several meshes
    /// in `NAME/`, that called `scan` is taken. `NAME/mask.json` or `NAME.mask.json`, or `.png`, is its mask. Folders without a mesh and names that begin with a dot are passed over.
    /// A manifest is `{"scans": [{"name": "...", "mesh": "path", "landmarks": "path"}, ...]}`, perhaps with a
    /// `"mask": "path"`, paths relative to its folder; its `"scheme"`, or that of a scan, is for landmarks whose own file states none.
    ///
    /// # Errors
    /// [`CollectionError`] names the scan or the file, and what was expected.
    pub fn open(path: impl AsRef<Path>) -> Result<Self, CollectionError> {
        let members: Result<Vec<Member>, Refused> = members(path.as_ref())?.into_iter().collect();
        let members = members.map_err(|refused| *refused.error)?;
        check_schemes(&members)?;
        check_common(&members)?;
        Ok(Self { members })
    }

    /// Opens a collection as [`open`](Self::open) does, without the scans that have something wrong with them; these are
    /// told beside it. Of several landmark schemes that of the most scans, or else of the first, counts. That scans have
    /// landmarks in common is not looked at.
    ///
    /// # Errors
    /// [`CollectionError`] if the folder or the manifest as a whole cannot be read, holds no scan, or names scans wrongly.
    pub fn open_usable(path: impl AsRef<Path>) -> Result<(Self, Vec<Refused>), CollectionError> {
        let mut refused = Vec::new();
        let members = members(path.as_ref())?.into_iter();
        let mut members: Vec<Member> =
            members.filter_map(|member| member.map_err(|error| refused.push(error)).ok()).collect();
        let most = usual_scheme(&members).map(|(member, scheme)| (member.name.clone(), scheme.to_owned()));
        if let Some((first, first_scheme)) = most {
            members.retain(|member| match member.landmarks.scheme() {
                Some(scheme) if scheme != first_scheme => {
                    let (second, second_scheme) = (member.name.clone(), scheme.to_owned());
                    let (first, first_scheme) = (first.clone(), first_scheme.clone());
                    let error = CollectionError::SchemesDiffer { first, first_scheme, second, second_scheme };
                    refused.push(Refused::new(&member.name, error));
                    false
                }
                _ => true,
            });
        }
        refused.sort_by(|a, b| a.name.cmp(&b.name));
        Ok((Self { members }, refused))
    }

    /// Its members, sorted by name.
    pub fn members(&self) -> &[Member] {
        &self.members
    }

    /// The names of the landmarks that are present on every scan, in the order of the first scan.
    pub fn common_landmarks(&self) -> Vec<&str> {
        let first = self.members[0].landmarks.present();
        let common = common_names(&self.members).unwrap_or_default();
        first.filter(|name| common.contains(name)).collect()
    }

    /// The landmark scheme that the scans state, if any does.
    pub fn scheme(&self) -> Option<&str> {
        self.members.iter().find_map(|member| member.landmarks.scheme())
    }
}

impl Member {
    fn open(source: Source) -> Result<Self, CollectionError> {
        let Source { name, mesh, landmarks: file, mask, scheme } = source;
        if !mesh.exists() {
            return Err(CollectionError::MissingMesh { name, path: mesh });
        }
        if !file.exists() {
            return Err(CollectionError::MissingLandmarks { name, expected: file });
        }
        if let Some(path) = mask.iter().find(|path| !path.exists()) {
            return Err(CollectionError::MissingMask { name, path: path.clone() });
        }
        let read = || {
            let bytes = read_file(&file)?;
            let landmarks = LandmarkFile::parse(&bytes).and_then(|landmarks| match &scheme {
                Some(scheme) => landmarks.or_scheme(scheme),
                None => Ok(landmarks),
            });
            Ok((InputFile::of(&file, &bytes), landmarks.map_err(|error| error.in_file(&file))?))
        };
        match read() {
            Ok((landmarks_file, landmarks)) => Ok(Self { name, mesh, landmarks_file, landmarks, mask }),
            Err(error) => Err(CollectionError::Scan { name, error }),
        }
    }

    /// Reads the scan's mesh, and finds the landmarks and the mask on it.
    ///
    /// # Errors
    /// [`CollectionError::Scan`] with the file and what is wrong in it.
    pub fn read(&self) -> Result<Scan, CollectionError> {
        let failed = |error| CollectionError::Scan { name: self.name.clone(), error };
        let (file, mut inputs) = MeshFile::read_with_inputs(&self.mesh).map_err(failed)?;
        let landmarks = self.landmarks.on(&file);
        let landmarks = landmarks.map_err(|error| failed(error.in_file(&self.landmarks_file.path)))?;
        inputs.push(self.landmarks_file.clone());
        let mask = self.mask.as_ref().map(|path| {
            let bytes = read_file(path)?;
            inputs.push(InputFile::of(path, &bytes));
            let mask = MaskFile::parse(&bytes).and_then(|mask| mask.on(&file, &landmarks));
            mask.map_err(|error| error.in_file(path))
        });
        let mask = mask.transpose().map_err(failed)?;
        Ok(Scan { name: self.name.clone(), mesh: file.mesh, landmarks, mask, inputs })
    }
}

/// The scans of a folder or manifest with their landmarks, sorted by name, each as far as it can be used.
fn members(path: &Path) -> Result<Vec<Result<Member, Refused>>, CollectionError> {
    let mut sources = if path.is_dir() { folder::sources(path)? } else { manifest::sources(path)? };
    if sources.is_empty() {
        return Err(CollectionError::Empty { path: path.to_owned() });
    }
    sources.sort_by(|a, b| name_of(a).cmp(name_of(b)));
    check_names(&sources)?;
    let open = |source: Source| {
        let name = source.name.clone();
        Member::open(source).map_err(|error| Refused::new(name, error))
    };
    Ok(sources.into_iter().map(|source| source.and_then(open)).collect())
}

fn name_of(source: &Result<Source, Refused>) -> &str {
    match source {
        Ok(source) => &source.name,
        Err(refused) => &refused.name,
    }
}

/// The scheme that most members state, and the first that does.
fn usual_scheme(members: &[Member]) -> Option<(&Member, &str)> {
    let stated = || members.iter().filter_map(|member| Some((member, member.landmarks.scheme()?)));
    let count = |scheme: &str| stated().filter(|(_, other)| *other == scheme).count();
    let schemes: BTreeSet<&str> = stated().map(|(_, scheme)| scheme).collect();
    let most = schemes.into_iter().map(count).max()?;
    stated().find(|(_, scheme)| count(scheme) == most)
}

fn check_names(sources: &[Result<Source, Refused>]) -> Result<(), CollectionError> {
    let unfit = |name: &str| {
        name.is_empty()
            || name.starts_with('.')
            || name.contains(|c: char| c.is_control() || "/\\:".contains(c))
    };
    if let Some(name) = sources.iter().map(name_of).find(|name| unfit(name)) {
        return Err(CollectionError::BadName { name: name.to_owned() });
    }
    let twice = sources.windows(2).find_map(|pair| match pair {
        [Ok(first), Ok(second)] if first.name == second.name => Some((first, second)),
        _ => None,
    });
    match twice {
        Some((first, second)) => Err(CollectionError::DuplicateName {
            name: first.name.clone(),
            first: first.mesh.clone(),
            second: second.mesh.clone(),
        }),
        None => Ok(()),
    }
}

fn check_schemes(members: &[Member]) -> Result<(), CollectionError> {
    // Subsets of a scheme state the whole.
    let mut stated = members.iter().filter_map(|member| Some((member, member.landmarks.scheme()?)));
    let Some((first, first_scheme)) = stated.next() else {
        return Ok(());
    };
    match stated.find(|(_, scheme)| scheme != &first_scheme) {
        Some((second, second_scheme)) => Err(CollectionError::SchemesDiffer {
            first: first.name.clone(),
            first_scheme: first_scheme.to_owned(),
            second: second.name.clone(),
            second_scheme: second_scheme.to_owned(),
        }),
        None => Ok(()),
    }
}

fn check_common(members: &[Member]) -> Result<(), CollectionError> {
    common_names(members).map(|_| ()).map_err(|(member, before)| CollectionError::NoCommonLandmark {
        name: member.name.clone(),
        there: some_of(&present_names(member)),
        before: some_of(&before),
    })
}

/// The landmarks present on all members, or the first member that shares none with those before it, and what they share.
fn common_names(members: &[Member]) -> Result<BTreeSet<&str>, (&Member, BTreeSet<&str>)> {
    let mut common = members.first().map(present_names).unwrap_or_default();
    for member in members {
        let shared: BTreeSet<_> = common.intersection(&present_names(member)).copied().collect();
        if shared.is_empty() {
            return Err((member, common));
        }
        common = shared;
    }
    Ok(common)
}

fn present_names(member: &Member) -> BTreeSet<&str> {
    member.landmarks.present().collect()
}

fn some_of(names: &BTreeSet<&str>) -> String {
    const MOST: usize = 5;
    let some: Vec<_> = names.iter().take(MOST).map(|name| format!("`{name}`")).collect();
    let more = if names.len() > MOST { ", ..." } else { "" };
    some.join(", ") + more
}

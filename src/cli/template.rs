use std::path::{Path, PathBuf};

use anyhow::Context;
use onemesh::formats::{LandmarkFile, MeshSource};
use onemesh::pipeline::{FrozenCollection, Settings, Template};

/// A template of the user's.
#[derive(Debug, clap::Args)]
pub struct TemplateFiles {
    /// A mesh of your own, or the `template.frozen.glb` of an earlier registration: its triangles in place of a sphere's
    #[arg(long, value_name = "FILE")]
    template: Option<PathBuf>,
    /// The template's landmarks, where they do not lie in the file or beside it under its name
    #[arg(long, value_name = "FILE", requires = "template")]
    template_landmarks: Option<PathBuf>,
}

/// What a template brings.
#[derive(Debug, Default)]
pub struct GivenTemplate {
    /// The template, where one is given.
    pub template: Option<Template>,
    /// With a frozen collection, its settings.
    pub settings: Option<Settings>,
    /// With a mesh of the user's, its file.
    pub source: Option<MeshSource>,
}

impl TemplateFiles {
    /// Reads it, where one is given.
    pub fn read(&self) -> anyhow::Result<GivenTemplate> {
        let Some(path) = &self.template else { return Ok(GivenTemplate::default()) };
        let shown = || path.display().to_string();
        let bytes = std::fs::read(path).with_context(shown)?;
        Ok(match FrozenCollection::parse(&bytes).with_context(shown)? {
            Some(FrozenCollection { template, settings }) => {
                GivenTemplate { template: Some(template), settings: Some(settings), source: None }
            }
            None => self.of_mesh(path)?,
        })
    }

    /// Its files, where one is given: the mesh, and its landmarks unless it is a frozen collection, which holds its own.
    pub fn files(&self) -> anyhow::Result<Option<(PathBuf, Option<PathBuf>)>> {
        let Some(path) = &self.template else { return Ok(None) };
        let frozen = self.read()?.settings.is_some();
        let landmarks = self.template_landmarks.clone().or_else(|| beside(path));
        Ok(Some((path.clone(), landmarks.filter(|_| !frozen))))
    }

    fn of_mesh(&self, path: &Path) -> anyhow::Result<GivenTemplate> {
        let source = MeshSource::read(path)?;
        let landmarks = match self.template_landmarks.clone().or_else(|| beside(path)) {
            Some(landmarks) => LandmarkFile::read(landmarks)?,
            None => anyhow::bail!(
                "{}: has no landmarks: lay them beside it, as {}.landmarks.json, or name them by --template-landmarks",
                path.display(),
                path.file_stem().unwrap_or_default().to_string_lossy(),
            ),
        };
        let landmarks = landmarks.on(&source.file).with_context(|| path.display().to_string())?;
        let template = Template::of_file(&source.file, &landmarks);
        Ok(GivenTemplate { template: Some(template), settings: None, source: Some(source) })
    }
}

/// The landmarks that lie beside a mesh, as `NAME.landmarks.EXTENSION` or `NAME.EXTENSION`.
fn beside(mesh: &Path) -> Option<PathBuf> {
    let called = |middle: &str, extension: &str| mesh.with_extension(format!("{middle}{extension}"));
    let names = ["landmarks.", ""].into_iter();
    names
        .flat_map(|middle| LandmarkFile::EXTENSIONS.map(|extension| called(middle, extension)))
        .find(|path| path.is_file())
}

use std::path::{Path, PathBuf};

use anyhow::{Context, ensure};
use onemesh::formats::{LandmarkFile, MaskFile, MeshSource};
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
    /// How much each vertex of the template takes of the scans' data: a JSON of weights, spheres or a colour, or a
    /// painted PNG, as masks of scans are
    #[arg(long, value_name = "FILE", requires = "template")]
    template_mask: Option<PathBuf>,
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

/// The files of a template for a server.
pub struct SentTemplate {
    /// The mesh.
    pub mesh: PathBuf,
    /// Its landmarks; a frozen collection holds its own.
    pub landmarks: Option<PathBuf>,
    /// Its mask.
    pub mask: Option<PathBuf>,
}

impl TemplateFiles {
    /// Reads it, where one is given.
    pub fn read(&self) -> anyhow::Result<GivenTemplate> {
        let Some(path) = &self.template else { return Ok(GivenTemplate::default()) };
        let shown = || path.display().to_string();
        let bytes = std::fs::read(path).with_context(shown)?;
        Ok(match FrozenCollection::parse(&bytes).with_context(shown)? {
            Some(FrozenCollection { template, settings }) => {
                ensure!(
                    self.template_mask.is_none(),
                    "{}: is a frozen collection, which keeps its own mask: leave --template-mask out",
                    path.display()
                );
                GivenTemplate { template: Some(template), settings: Some(settings), source: None }
            }
            None => self.of_mesh(MeshSource::of_bytes(path, bytes)?, path)?,
        })
    }

    /// Its files for a server, where one is given.
    pub fn files(&self) -> anyhow::Result<Option<SentTemplate>> {
        let Some(path) = &self.template else { return Ok(None) };
        let frozen = self.read()?.settings.is_some();
        let landmarks = self.template_landmarks.clone().or_else(|| beside(path)).filter(|_| !frozen);
        Ok(Some(SentTemplate { mesh: path.clone(), landmarks, mask: self.template_mask.clone() }))
    }

    fn of_mesh(&self, source: MeshSource, path: &Path) -> anyhow::Result<GivenTemplate> {
        let landmarks = match self.template_landmarks.clone().or_else(|| beside(path)) {
            Some(landmarks) => LandmarkFile::read(landmarks)?,
            None => anyhow::bail!(
                "{}: has no landmarks: lay them beside it, as {}.landmarks.json, or name them by --template-landmarks",
                path.display(),
                path.file_stem().unwrap_or_default().to_string_lossy(),
            ),
        };
        let landmarks = landmarks.on(&source.file).with_context(|| path.display().to_string())?;
        let mask = self.template_mask.as_ref().map(|mask| {
            MaskFile::read(mask)?.on(&source.file, &landmarks).with_context(|| mask.display().to_string())
        });
        let template = Template { mask: mask.transpose()?, ..Template::of_file(&source.file, &landmarks) };
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

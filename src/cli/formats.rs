use std::path::{Path, PathBuf};

use anyhow::Context;
use onemesh::formats::MeshSource;
use onemesh::pipeline::OutputFormat;

/// What results are written as.
#[derive(Debug, Clone, clap::Args)]
pub struct Formats {
    /// The formats of results, with the same vertex order in each. `template` is the file of a template of your own with
    /// other positions, everything else in it kept byte for byte. By default glb, and beside it template where that is an
    /// OBJ or PLY; for `fit` that of the file's extension
    #[arg(long = "format", value_enum, value_delimiter = ',', value_name = "FORMAT,...")]
    formats: Vec<FormatName>,
}

#[derive(Debug, Clone, Copy, PartialEq, clap::ValueEnum)]
enum FormatName {
    Glb,
    Obj,
    Ply,
    Template,
}

impl From<FormatName> for OutputFormat {
    fn from(name: FormatName) -> Self {
        match name {
            FormatName::Glb => Self::Glb,
            FormatName::Obj => Self::Obj,
            FormatName::Ply => Self::Ply,
            FormatName::Template => Self::Template,
        }
    }
}

impl Formats {
    /// Those of a registration, from a template of the user's if its file is given. Whether that file takes other
    /// positions is tried here, before the work.
    pub fn of_registration(&self, source: Option<&MeshSource>) -> anyhow::Result<Vec<OutputFormat>> {
        let tried = source.map(|source| source.with_positions(source.file.mesh.positions()));
        let mut formats: Vec<OutputFormat> = self.formats.iter().map(|&name| name.into()).collect();
        if formats.contains(&OutputFormat::Template) {
            tried
                .context("--format template: needs a mesh of your own as --template")?
                .context("--format template")?;
        } else if formats.is_empty() {
            formats.push(OutputFormat::Glb);
            match (tried, source.map(MeshSource::extension)) {
                (Some(Ok(_)), Some("obj" | "ply" | "gltf")) => formats.push(OutputFormat::Template),
                (Some(Err(error)), Some("obj" | "ply" | "gltf")) => {
                    remark!("results are written as GLB alone, not as the template's own file: {error}");
                }
                _ => {}
            }
        }
        Ok(formats)
    }

    /// Those of one mesh that is to be written to `path`, each with its file.
    pub fn of_file(&self, path: &Path) -> anyhow::Result<Vec<(OutputFormat, PathBuf)>> {
        let known = [("glb", OutputFormat::Glb), ("obj", OutputFormat::Obj), ("ply", OutputFormat::Ply)];
        if self.formats.is_empty() {
            let extension = path.extension().and_then(|extension| extension.to_str()).unwrap_or_default();
            let own = known.into_iter().find(|(known, _)| known.eq_ignore_ascii_case(extension));
            return Ok(vec![(own.map_or(OutputFormat::Glb, |(_, format)| format), path.to_owned())]);
        }
        anyhow::ensure!(
            !self.formats.contains(&FormatName::Template),
            "--format template: a fit has no template of your own; choose glb, obj or ply"
        );
        let chosen =
            known.into_iter().filter(|(_, format)| self.formats.iter().any(|&name| *format == name.into()));
        Ok(chosen.map(|(extension, format)| (format, path.with_extension(extension))).collect())
    }
}

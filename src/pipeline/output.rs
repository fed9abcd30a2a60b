use std::borrow::Cow;
use std::path::PathBuf;

use glam::DVec2;
use serde_json::Value;

use super::package::vertex_normals;
use crate::formats::{Fault, FormatError, Glb, MeshSource, Obj, Ply, Polygons, Texture, glb_bytes};
use crate::mesh::TriangleMesh;

/// A format that results are written in; the order of vertices is the same in all of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OutputFormat {
    /// Triangles, normals, texture coordinates, figures of each vertex, landmarks.
    Glb,
    /// Polygons and texture coordinates, the template's own where it was read from a file.
    Obj,
    /// Polygons, texture coordinates and figures of each vertex.
    Ply,
    /// The file that the template was read from with other positions, see [`MeshSource::with_positions`].
    Template,
}

/// The files that each scan's result is written to.
#[derive(Debug, Clone, Copy)]
pub struct Outputs<'a> {
    /// The formats; one that is named twice is written once.
    pub formats: &'a [OutputFormat],
    /// The file that the template was read from, if it is a user's.
    pub source: Option<&'a MeshSource>,
}

impl Outputs<'_> {
    /// GLB alone.
    pub const GLB: Self = Self { formats: &[OutputFormat::Glb], source: None };

    /// The formats with the file that each has for the scan called `name`: `NAME.EXTENSION`. That in the template's
    /// own format is called `NAME.template.EXTENSION` where another has the same extension.
    pub fn files(&self, name: &str) -> Vec<(OutputFormat, String)> {
        let mut files: Vec<(OutputFormat, String)> = Vec::new();
        // The template's comes last: it gives way.
        let last = |format: &&OutputFormat| **format == OutputFormat::Template;
        let others = self.formats.iter().filter(|format| !last(format));
        for &format in others.chain(self.formats.iter().filter(last)) {
            let mut file = format!("{name}.{}", self.extension(format));
            if files.iter().any(|(other, _)| *other == format) {
                continue;
            }
            if files.iter().any(|(_, other)| *other == file) {
                file = format!("{name}.template.{}", self.extension(format));
            }
            files.push((format, file));
        }
        files
    }

    /// The files that results in the template's own format name and need beside them: each one's name in the folder of
    /// results, and where it is.
    pub fn companions(&self) -> Vec<(PathBuf, PathBuf)> {
        let source = self.source.filter(|_| self.formats.contains(&OutputFormat::Template));
        source.map(MeshSource::companions).unwrap_or_default()
    }

    fn extension(&self, format: OutputFormat) -> &'static str {
        match format {
            OutputFormat::Glb => "glb",
            OutputFormat::Obj => "obj",
            OutputFormat::Ply => "ply",
            OutputFormat::Template => self.source.map_or("glb", MeshSource::extension),
        }
    }
}

/// A result on its way to a file.
#[derive(Debug, Clone)]
pub struct ResultMesh<'a> {
    /// The scan's name.
    pub name: &'a str,
    /// The shared mesh on the scan.
    pub mesh: &'a TriangleMesh,
    /// Texture coordinates of each vertex `[N, 2]`, (0, 0) in the image's upper left corner.
    pub texture_coordinates: Option<&'a [DVec2]>,
    /// Figures of each vertex `[N]` by their names, of small letters: `residual` is `_RESIDUAL` in a GLB.
    pub figures: Vec<(&'a str, &'a [f64])>,
    /// Anything else, for the `extras` of a GLB.
    pub extras: Value,
}

impl ResultMesh<'_> {
    /// The file in a format; `source` is the file that the template was read from.
    ///
    /// # Errors
    /// [`FormatError`] without a file, where the result does not fit the format or there is no template's file.
    pub fn bytes(&self, format: OutputFormat, source: Option<&MeshSource>) -> Result<Vec<u8>, FormatError> {
        match (format, source) {
            (OutputFormat::Glb, _) => self.glb(),
            (OutputFormat::Obj, _) => Ok(self.obj(source)),
            (OutputFormat::Ply, _) => Ok(self.ply(source)),
            (OutputFormat::Template, Some(source)) => source.with_positions(self.mesh.positions()),
            (OutputFormat::Template, None) => {
                let problem =
                    "the template is no file of your own, so that results cannot be written as it is";
                Err(Fault::DoesNotFit(problem.to_owned()).into())
            }
        }
    }

    fn glb(&self) -> Result<Vec<u8>, FormatError> {
        let attribute = |name: &str| format!("_{}", name.to_ascii_uppercase());
        let names: Vec<String> = self.figures.iter().map(|(name, _)| attribute(name)).collect();
        let scalars = names.iter().zip(&self.figures).map(|(name, (_, values))| (name.as_str(), *values));
        glb_bytes(&Glb {
            name: self.name,
            normals: Some(&vertex_normals(self.mesh)),
            texture_coordinates: self.texture_coordinates,
            scalars: scalars.collect(),
            extras: self.extras.clone(),
            ..Glb::new(self.mesh)
        })
    }

    fn obj(&self, source: Option<&MeshSource>) -> Vec<u8> {
        let positions = self.mesh.positions();
        if let Some(MeshSource { file, .. }) = source {
            return Obj { positions, polygons: &file.polygons(), texture: file.texture.as_ref() }.bytes();
        }
        let polygons = Polygons::of_triangles(self.mesh.triangles());
        let texture = self.texture_coordinates.map(|uv| Texture::of_vertices(uv, &polygons));
        Obj { positions, polygons: &polygons, texture: texture.as_ref() }.bytes()
    }

    fn ply(&self, source: Option<&MeshSource>) -> Vec<u8> {
        let polygons = match source {
            Some(source) => source.file.polygons(),
            None => Cow::Owned(Polygons::of_triangles(self.mesh.triangles())),
        };
        Ply {
            positions: self.mesh.positions(),
            polygons: &polygons,
            texture_coordinates: self.texture_coordinates,
            scalars: self.figures.clone(),
        }
        .bytes()
    }
}

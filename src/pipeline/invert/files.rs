use glam::DVec3;

use super::Inversion;
use super::pictures::contact_sheet;
use crate::formats::FormatError;
use crate::mesh::{Topology, sphere_layout};
use crate::picture::Image;
use crate::pipeline::output::{OutputFormat, ResultMesh};

impl Inversion {
    /// The mesh as binary glTF, in the cameras' world, with normals and texture coordinates.
    ///
    /// # Errors
    /// [`FormatError`] where it does not fit the format.
    pub fn glb_bytes(&self) -> Result<Vec<u8>, FormatError> {
        let layout = sphere_layout(&Topology::of(&self.mesh), &self.sphere, DVec3::Z, DVec3::Y);
        let mesh = ResultMesh {
            name: "mesh",
            mesh: &self.mesh,
            texture_coordinates: Some(&layout),
            figures: Vec::new(),
            extras: serde_json::Value::Null,
        };
        mesh.bytes(OutputFormat::Glb, None)
    }

    /// Its views beside their pictures.
    pub fn sheet(&self) -> Image {
        let (overlap, mae) = (100.0 * self.report.overlap, self.report.mae);
        let title = format!("{} views, overlap {overlap:.2} %, error {mae:.4}", self.report.views.len());
        contact_sheet(&title, &self.pictures)
    }
}

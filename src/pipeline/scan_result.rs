use std::collections::BTreeMap;

use glam::DVec3;
use serde_json::{Value, json};

use super::output::{OutputFormat, ResultMesh};
use super::package::PackageError;
use super::precheck::Precheck;
use super::register::Subject;
use super::report::{ScanReport, position};
use super::template::Template;
use crate::formats::{FormatError, MeshSource};
use crate::mesh::TriangleMesh;

/// The result on one scan, judged.
pub struct ScanResult<'a> {
    template: &'a Template,
    confidence: Vec<f64>,
    /// The shared triangles on the scan, in its own space.
    pub mesh: TriangleMesh,
    /// How well they lie on it.
    pub report: ScanReport,
}

impl<'a> ScanResult<'a> {
    /// The shared triangles at `positions` `[N, 3]`, known as far as `confidence` `[N]` says, held against the scan.
    ///
    /// # Errors
    /// [`PackageError::Result`] if they are no mesh.
    pub fn of(
        subject: &Subject,
        precheck: &Precheck,
        template: &'a Template,
        positions: &[DVec3],
        confidence: &[f32],
    ) -> Result<Self, PackageError> {
        let mesh = TriangleMesh::new(positions.to_vec(), template.triangles.clone())
            .map_err(|error| PackageError::Result { name: subject.name.clone(), error })?;
        let report = ScanReport::of(subject, precheck, &mesh, confidence, template);
        Ok(Self { template, confidence: confidence.iter().copied().map(f64::from).collect(), mesh, report })
    }

    /// The result as a file; `source` is the file that the template was read from.
    ///
    /// # Errors
    /// As [`ResultMesh::bytes`].
    pub fn bytes(&self, format: OutputFormat, source: Option<&MeshSource>) -> Result<Vec<u8>, FormatError> {
        let mesh = ResultMesh {
            name: &self.report.name,
            mesh: &self.mesh,
            texture_coordinates: self.template.texture_coordinates.as_deref(),
            figures: vec![("residual", &self.report.fidelity.residuals), ("confidence", &self.confidence)],
            extras: self.extras(),
        };
        mesh.bytes(format, source)
    }

    /// The template's landmarks on the result, in the scan's space.
    pub fn landmarks(&self) -> BTreeMap<String, [f64; 3]> {
        let on_result = self.template.landmarks.iter();
        on_result.map(|(name, at)| (name.clone(), position(&self.mesh, at).to_array())).collect()
    }

    /// The template's landmarks on the result, as landmark files have them and with their places on the triangles.
    fn extras(&self) -> Value {
        let landmarks = self.template.landmarks.iter().map(|(name, at)| {
            let on_result = position(&self.mesh, at).to_array();
            json!({ "name": name, "position": on_result, "triangle": at.triangle.0, "weights": at.weights })
        });
        let landmarks: Vec<Value> = landmarks.collect();
        match &self.template.scheme {
            Some(scheme) => json!({ "scheme": scheme, "landmarks": landmarks }),
            None => json!({ "landmarks": landmarks }),
        }
    }
}

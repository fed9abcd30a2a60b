use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::mask::check_mask;
use super::package::vertex_normals;
use super::settings::Settings;
use super::template::Template;
use crate::formats::{Fault, FormatError, Glb, MeshFile, MeshFormat, glb_bytes, scene_extras};
use crate::mesh::{SurfacePoint, TriangleId, TriangleMesh};

/// Version of the record.
const RECORD: u32 = 1;

/// What a finished collection leaves for further scans, in one GLB: its mean with the shared triangles, the landmarks
/// on them, and the settings.
#[derive(Debug, Clone)]
pub struct FrozenCollection {
    /// The template, frozen.
    pub template: Template,
    /// What the collection was registered with.
    pub settings: Settings,
}

/// Why a GLB is no frozen collection, though it says so.
#[derive(Debug, thiserror::Error)]
pub enum FrozenError {
    /// The mesh cannot be read or written.
    #[error(transparent)]
    Mesh(#[from] FormatError),
    /// The record that goes with it is wrong.
    #[error(
        "the scene's `extras.frozen` of a template by onemesh: {0}; register the collection again to make it anew"
    )]
    Record(String),
}

/// The record in the scene's `extras`; landmarks are as landmark files have them, and with their places.
#[derive(Serialize, Deserialize)]
struct Extras {
    #[serde(skip_serializing_if = "Option::is_none")]
    scheme: Option<String>,
    landmarks: Vec<Landmark>,
    frozen: Frozen,
}

#[derive(Serialize, Deserialize)]
struct Frozen {
    record: u32,
    settings: Settings,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    mask: Option<Vec<f32>>,
}

#[derive(Serialize, Deserialize)]
struct Landmark {
    name: String,
    position: [f64; 3],
    triangle: u32,
    weights: [f64; 3],
}

impl FrozenCollection {
    /// The file.
    ///
    /// # Errors
    /// [`FrozenError::Mesh`] if the template is no mesh.
    pub fn glb_bytes(&self) -> Result<Vec<u8>, FrozenError> {
        let template = &self.template;
        let mesh = TriangleMesh::new(template.positions.clone(), template.triangles.clone())
            .map_err(|error| FormatError::from(Fault::from(error)))?;
        let landmark = |(name, at): (&String, &SurfacePoint)| Landmark {
            name: name.clone(),
            position: template.point(&template.positions, at).to_array(),
            triangle: at.triangle.0,
            weights: at.weights,
        };
        let extras = Extras {
            scheme: template.scheme.clone(),
            landmarks: template.landmarks.iter().map(landmark).collect(),
            frozen: Frozen { record: RECORD, settings: self.settings.clone(), mask: template.mask.clone() },
        };
        let glb = Glb {
            name: "template",
            normals: Some(&vertex_normals(&mesh)),
            texture_coordinates: template.texture_coordinates.as_deref(),
            extras: serde_json::to_value(extras).expect("a record of names and numbers"),
            ..Glb::new(&mesh)
        };
        Ok(glb_bytes(&glb)?)
    }

    /// Reads a file by [`glb_bytes`](Self::glb_bytes); `None` if it is a GLB of another kind or none at all.
    ///
    /// # Errors
    /// [`FrozenError`] if it says that it is one and is damaged.
    pub fn parse(bytes: &[u8]) -> Result<Option<Self>, FrozenError> {
        let Some(extras) = scene_extras(bytes).filter(|extras| extras.get("frozen").is_some()) else {
            return Ok(None);
        };
        let extras: Extras =
            serde_json::from_value(extras).map_err(|error| FrozenError::Record(error.to_string()))?;
        if extras.frozen.record != RECORD {
            return Err(FrozenError::Record(format!("is of version {}", extras.frozen.record)));
        }
        let file = MeshFile::parse(bytes, MeshFormat::Gltf)?;
        if let Some(mask) = &extras.frozen.mask {
            let checked = check_mask(mask, file.mesh.positions().len());
            checked.map_err(|error| FrozenError::Record(format!("its mask {error}")))?;
        }
        let template = Template {
            positions: file.mesh.positions().to_vec(),
            triangles: file.mesh.triangles().to_vec(),
            landmarks: places(extras.landmarks, &file.mesh)?,
            scheme: extras.scheme,
            texture_coordinates: file.vertex_texture_coordinates(),
            mask: extras.frozen.mask,
            frozen: true,
        };
        Ok(Some(Self { template, settings: extras.frozen.settings }))
    }
}

fn places(
    landmarks: Vec<Landmark>,
    mesh: &TriangleMesh,
) -> Result<BTreeMap<String, SurfacePoint>, FrozenError> {
    let place = |landmark: Landmark| {
        let Landmark { name, triangle, weights, .. } = landmark;
        let sum: f64 = weights.iter().sum();
        if triangle as usize >= mesh.triangles().len() || (sum - 1.0).abs() > 1e-3 {
            return Err(FrozenError::Record(format!("landmark `{name}` lies on no triangle of it")));
        }
        Ok((name, SurfacePoint { triangle: TriangleId(triangle), weights }))
    };
    landmarks.into_iter().map(place).collect()
}

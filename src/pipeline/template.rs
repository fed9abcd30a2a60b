use std::collections::BTreeMap;

use glam::{DVec2, DVec3, Vec3A};

use super::mask::{MaskError, check_mask};
use super::sphere::Sphere;
use crate::formats::{MeshFile, Region, Scheme};
use crate::mesh::{LandmarkSet, Points, SurfacePoint, TriangleId, sphere_layout};
use crate::spatial::SurfaceIndex;

/// What registered scans share: a shape's triangles, and where the landmarks lie on them.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub struct Template {
    /// The shape `[N, 3]`: a collection's mean in unit space, the bare sphere, or a user's mesh in its own space.
    pub positions: Vec<DVec3>,
    /// The triangles that every result shares `[F, 3]`.
    pub triangles: Vec<[u32; 3]>,
    /// Where each landmark lies on them.
    pub landmarks: BTreeMap<String, SurfacePoint>,
    /// The scheme that the landmarks are named by.
    pub scheme: Option<String>,
    /// Texture coordinates `[N, 2]`, where each vertex has one.
    pub texture_coordinates: Option<Vec<DVec2>>,
    /// How much each vertex takes of the scans' data `[N]`, 0 to 1; without it all do.
    pub mask: Option<Vec<f32>>,
    /// It is that of a finished collection and stays as it is, whatever is registered from it.
    pub frozen: bool,
}

impl Template {
    /// A template of a mesh with landmarks in its space: each is taken to its closest point of the mesh.
    pub fn of_file<P: Points>(file: &MeshFile<P>, landmarks: &LandmarkSet) -> Self {
        let mesh = &file.mesh;
        // Nearest points are found in single precision, so about the mesh's own centre and at its own scale.
        let centre = mesh.centroid();
        let radius = mesh.radius_about(centre);
        let unit = |p: DVec3| ((p - centre) / radius).as_vec3a();
        let positions: Vec<Vec3A> = mesh.points().each().map(unit).collect();
        let index = SurfaceIndex::new(&positions, mesh.triangles());
        let place = |(name, point): (&str, DVec3)| {
            let hit = index.closest(unit(point));
            let weights = hit.weights.map(f64::from);
            (name.to_owned(), SurfacePoint { triangle: TriangleId(hit.triangle), weights })
        };
        Self {
            positions: mesh.points().each().collect(),
            triangles: mesh.triangles().to_vec(),
            landmarks: landmarks.present().map(place).collect(),
            scheme: landmarks.scheme.clone(),
            texture_coordinates: file.vertex_texture_coordinates(),
            mask: None,
            frozen: false,
        }
    }

    /// The template of a collection that was registered from a sphere: its mean `[N, 3]`, or the sphere if it has none.
    pub(super) fn of_sphere(
        sphere: &Sphere,
        landmarks: impl Iterator<Item = (String, SurfacePoint)>,
        mean: &[Vec3A],
        scheme: Option<&str>,
    ) -> Self {
        let positions = if mean.is_empty() { &sphere.rest } else { mean };
        let landmarks: BTreeMap<_, _> = landmarks.collect();
        Self {
            positions: positions.iter().map(|p| p.as_dvec3()).collect(),
            triangles: sphere.connectivity.topology.triangles.clone(),
            texture_coordinates: Some(layout(sphere, &landmarks, scheme)),
            landmarks,
            scheme: scheme.map(str::to_owned),
            mask: None,
            frozen: false,
        }
    }

    /// Whether its mask, if it has one, is one of its vertices.
    ///
    /// # Errors
    /// [`MaskError`] names what is wrong.
    pub fn check_mask(&self) -> Result<(), MaskError> {
        self.mask.as_ref().map_or(Ok(()), |mask| check_mask(mask, self.positions.len()))
    }

    /// Where a landmark lies on positions `[N, 3]` of the shared triangles.
    pub fn point(&self, positions: &[DVec3], at: &SurfacePoint) -> DVec3 {
        let corners = self.triangles[at.triangle.0 as usize];
        corners.iter().zip(at.weights).map(|(&i, weight)| positions[i as usize] * weight).sum()
    }
}

/// Texture coordinates `[N, 2]` of a sphere: its landmarks say where the face is and, in a known scheme, which way is
/// up; the sphere's +Z and +Y do where they do not.
fn layout(sphere: &Sphere, landmarks: &BTreeMap<String, SurfacePoint>, scheme: Option<&str>) -> Vec<DVec2> {
    let points: Vec<Option<DVec3>> = sphere.directions(landmarks.values()).map(Some).collect();
    let face = points.iter().flatten().sum::<DVec3>();
    let landmarks = LandmarkSet { scheme: None, names: landmarks.keys().cloned().collect(), points };
    let up = scheme.and_then(Scheme::named).and_then(|scheme| upwards(scheme, &landmarks));
    let rest: Vec<DVec3> = sphere.rest.iter().map(|p| p.as_dvec3()).collect();
    sphere_layout(&sphere.connectivity.topology, &rest, face, up.unwrap_or(DVec3::Y))
}

/// From the lips to the eyes.
fn upwards(scheme: &Scheme, landmarks: &LandmarkSet) -> Option<DVec3> {
    let centre = |region| scheme.centre(region, landmarks);
    let eyes = centre(Region::RightEye)? + centre(Region::LeftEye)?;
    Some(eyes / 2.0 - centre(Region::OuterLips)?)
}

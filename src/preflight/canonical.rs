use std::sync::OnceLock;

use super::alignment::{Points, align, shared_shape};
use super::face_model::FaceModel;
use crate::demo::Sculptor;
use crate::formats::Scheme;
use crate::mesh::LandmarkSet;
use crate::numeric::once;
use glam::DVec3;

/// Sculpted heads that stand for all faces.
const HEADS: usize = 40;
/// How far they depart from the mean, in turn.
const STRENGTHS: [f64; 2] = [1.0, 2.0];

/// How the landmarks of a known scheme lie on faces, learned from sculpted heads.
pub(super) struct Canonical {
    /// The mean shape `[B, 3]`, centred, of mean square radius one; +Y is up and +Z is where the face looks.
    pub shape: Vec<DVec3>,
    /// How faces vary about it.
    pub model: FaceModel,
}

/// Landmarks of all heads, in the scheme's order.
fn heads() -> &'static [Vec<DVec3>] {
    static HEADS_LANDMARKS: OnceLock<Vec<Vec<DVec3>>> = OnceLock::new();
    once::<Vec<_>>(&HEADS_LANDMARKS, || Sculptor::landmarks_of_heads(1, HEADS, &STRENGTHS))
}

impl Canonical {
    /// The landmarks of these names; `None` if the sets do not state a scheme that the heads' landmarks are of, or some
    /// name is not of it.
    pub fn of<'a>(sets: impl Iterator<Item = &'a LandmarkSet>, names: &[String]) -> Option<Self> {
        let scheme = sets.filter_map(|set| Scheme::named(set.scheme.as_deref()?)).next()?;
        let heads = heads();
        let known = |name: &String| scheme.region(name).and_then(|_| name.parse::<usize>().ok());
        let indices: Vec<usize> = names.iter().map(known).collect::<Option<_>>()?;
        if indices.is_empty() || scheme.count() != heads[0].len() {
            return None;
        }
        let faces: Vec<Points> =
            heads.iter().map(|head| indices.iter().map(|&i| Some(head[i])).collect()).collect();
        let shape = shared_shape(&faces);
        let aligned: Vec<Points> = faces.iter().map(|face| align(face, &shape).points).collect();
        let model = FaceModel::new(&aligned.iter().collect::<Vec<_>>(), &shape);
        Some(Self { shape, model })
    }
}

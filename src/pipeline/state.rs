//! What passes from one step of a registration to the next, and its form on disk.

use glam::{DVec3, Vec3A};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::mesh::SurfacePoint;

/// Version of the form on disk, its first byte: a state of another version is not read.
const VERSION: u8 = 1;

/// One scan between two stages, positions in its unit space.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum ScanState {
    /// Where its landmarks lie on the sphere `[B, 3]`, by its own fit.
    OnSphere(Vec<DVec3>),
    /// It has been registered and goes into the next mean.
    Shaped(Contribution),
    /// Nothing more is to be done.
    Placed(Placed),
}

/// What a scan brings to the mean of all.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Contribution {
    /// The shared vertices on the scan `[N, 3]`.
    pub shape: Vec<Vec3A>,
    /// How far each of them is known `[N]`.
    pub known: Vec<f64>,
    /// How much the scan counts.
    pub weight: f64,
    /// How many vertices it needs around each of them `[N]`; empty where vertices stay.
    pub need: Vec<f32>,
}

/// The result on one scan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Placed {
    /// Vertex positions `[N, 3]` in the scan's own space.
    pub positions: Vec<DVec3>,
    /// How far each vertex is known from the scan's data `[N]`, from 0 to 1.
    pub confidence: Vec<f32>,
}

/// What all scans of a collection share between two stages.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum SharedState {
    /// The landmarks' mean places on the sphere `[B, 3]`.
    OnSphere(Vec<DVec3>),
    /// The mean of all.
    Mean(Mean),
}

/// The shape that every scan is registered from in a round.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Mean {
    /// The sphere whose triangles it has; without meaning where a template is given.
    pub level: u32,
    /// Its vertices `[N, 3]`.
    pub positions: Vec<Vec3A>,
    /// The landmarks on its triangles; none where a template is given, whose own stay.
    pub points: Vec<SurfacePoint>,
    /// The point of the sphere that each vertex moved to `[N]`, triangle and weights; empty where they stayed.
    pub moved: Vec<(u32, [f32; 3])>,
}

/// Bytes that are no state, or one of another version of the program.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("an intermediate result cannot be read: another version of the program wrote it, or it is damaged")]
pub struct BadState;

/// A state as bytes: the version, and what postcard makes of it.
///
/// # Panics
/// Never for the states of this module and plans, which are plain numbers and names.
pub fn encode(state: &impl Serialize) -> Vec<u8> {
    postcard::to_extend(state, vec![VERSION]).expect("plain numbers and names")
}

/// A state from its bytes.
///
/// # Errors
/// [`BadState`].
pub fn decode<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, BadState> {
    let rest = bytes.strip_prefix(&[VERSION]).ok_or(BadState)?;
    match postcard::take_from_bytes(rest) {
        Ok((state, [])) => Ok(state),
        _ => Err(BadState),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_state_comes_back_bit_for_bit_and_damage_is_told() {
        let contribution = Contribution {
            shape: vec![Vec3A::new(0.1, -f32::MIN_POSITIVE, 1e30), Vec3A::ZERO],
            known: vec![0.02, 1.0 / 3.0],
            weight: 1e6 / 7.0,
            need: vec![0.2],
        };
        let state = ScanState::Shaped(contribution);
        let bytes = encode(&state);
        assert_eq!(decode(&bytes), Ok(state));
        assert_eq!(decode::<ScanState>(&bytes[..bytes.len() - 1]), Err(BadState));
        assert_eq!(decode::<ScanState>(&[&bytes[..], &[0]].concat()), Err(BadState));
        assert_eq!(decode::<ScanState>(&[&[VERSION + 1], &bytes[1..]].concat()), Err(BadState));
    }
}

/// Why weights are no mask of a scan or a template.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum MaskError {
    /// Not one for each vertex.
    #[error("has {weights} weights, but there are {vertices} vertices: give one each")]
    Length {
        /// How many there are.
        weights: usize,
        /// How many there should be.
        vertices: usize,
    },
    /// A weight that is none.
    #[error("gives vertex {vertex} the weight {weight}: it must be from 0 to 1")]
    Weight {
        /// The vertex.
        vertex: usize,
        /// Its weight.
        weight: f32,
    },
    /// No data.
    #[error("leaves nothing: every vertex has weight 0")]
    Nothing,
}

/// Whether `weights` are one for each of so many vertices, from 0 to 1, and not all 0.
///
/// # Errors
/// [`MaskError`] names the first that is wrong.
pub(super) fn check_mask(weights: &[f32], vertices: usize) -> Result<(), MaskError> {
    if weights.len() != vertices {
        return Err(MaskError::Length { weights: weights.len(), vertices });
    }
    if let Some(vertex) = weights.iter().position(|weight| !(0.0..=1.0).contains(weight)) {
        return Err(MaskError::Weight { vertex, weight: weights[vertex] });
    }
    if weights.iter().any(|weight| *weight > 0.0) { Ok(()) } else { Err(MaskError::Nothing) }
}

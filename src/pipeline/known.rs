use glam::Vec3A;

use super::confidence::confidence;
use super::connectivity::Connectivity;
use super::scan_surface::ScanSurface;
use crate::numeric::SolveBuffer;

/// Weight in the mean of a vertex that its member knows nothing of: where nobody does, there is a mean all the same.
const UNKNOWN: f64 = 0.02;

/// Diffusion of how far vertices are known, so that the mean has no step where a member ends.
const KNOWN_SMOOTHING: f64 = 10.0;

/// A weight for each of a member's vertices in the mean `[N]`: a whole scan knows all of its, a part its own.
pub fn known(connectivity: &Connectivity, scan: &ScanSurface, shape: &[Vec3A]) -> Vec<f64> {
    if scan.whole() {
        return vec![1.0; shape.len()];
    }
    let mut known = confidence(scan, &connectivity.topology, shape);
    let smoother = connectivity.diffusion(KNOWN_SMOOTHING);
    smoother.solve_scalar(&mut known, &mut SolveBuffer::default());
    known.into_iter().map(|known| f64::from(known).clamp(UNKNOWN, 1.0)).collect()
}

/// The vertices `[N]` that no member knows, by the members' weights `[M][N]`.
pub fn unknown(known: &[&[f64]]) -> Vec<bool> {
    let vertices = known.first().map_or(0, |known| known.len());
    (0..vertices).map(|i| known.iter().all(|known| known[i] < 0.25)).collect()
}

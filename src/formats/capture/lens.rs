use glam::DVec2;

use crate::camera::{Distortion, Intrinsics};
use crate::formats::error::Fault;

/// The largest width or height of a picture, in pixels.
pub(super) const LARGEST: u64 = 1 << 20;

/// Whether intrinsics can be those of a camera; `place` is what has them.
pub(super) fn checked(
    intrinsics: Intrinsics,
    distortion: Distortion,
    place: &str,
) -> Result<(Intrinsics, Distortion), Fault> {
    let Intrinsics { focal, centre, skew, .. } = intrinsics;
    let usable = |f: f64| f.is_finite() && f.abs() > 1e-9 && f.abs() < 1e9;
    if !usable(focal.x) || !usable(focal.y) || focal.x < 0.0 || focal.y < 0.0 {
        let problem =
            format!("has the focal lengths {} and {}: they must be positive pixels", focal.x, focal.y);
        return Err(Fault::at(place, problem));
    }
    if !centre.is_finite() || !skew.is_finite() || !coefficients(&distortion).iter().all(|c| c.is_finite()) {
        let problem = "has a principal point or a lens coefficient that is not finite: calibrate it anew";
        return Err(Fault::at(place, problem));
    }
    Ok((intrinsics, distortion))
}

fn coefficients(distortion: &Distortion) -> Vec<f64> {
    match distortion {
        Distortion::None => Vec::new(),
        Distortion::Brown { radial, denominator, tangential } => {
            [&radial[..], &denominator[..], &tangential[..]].concat()
        }
        Distortion::Fisheye { radial } => radial.to_vec(),
    }
}

/// Brown's lens, or none where all coefficients are zero.
pub(super) fn brown(radial: [f64; 4], denominator: [f64; 3], tangential: [f64; 2]) -> Distortion {
    let distortion = Distortion::Brown { radial, denominator, tangential };
    if coefficients(&distortion).iter().all(|c| *c == 0.0) { Distortion::None } else { distortion }
}

/// A picture's size, which must be one.
pub(super) fn size(width: u64, height: u64, place: &str) -> Result<[u32; 2], Fault> {
    let fits = |length: u64| (1..=LARGEST).contains(&length);
    if fits(width) && fits(height) {
        return Ok([width as u32, height as u32]);
    }
    let problem = format!("has pictures of {width} x {height} pixels: each side must be 1 to {LARGEST}");
    Err(Fault::at(place, problem))
}

/// Intrinsics without skew.
pub(super) fn pinhole(size: [u32; 2], focal: [f64; 2], centre: [f64; 2]) -> Intrinsics {
    Intrinsics { size, focal: DVec2::from(focal), centre: DVec2::from(centre), skew: 0.0 }
}

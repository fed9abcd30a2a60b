//! The difference between a picture and its target, and its gradient with respect to the picture.

use glam::Vec3A;

use super::silhouette::{Crossing, Silhouette};

/// Sets `picture` to the colours blended where silhouettes pass.
pub fn blend(colours: &[Vec3A], crossings: &[(Silhouette, Crossing)], picture: &mut Vec<Vec3A>) {
    picture.clear();
    picture.extend_from_slice(colours);
    for (_, crossing) in crossings {
        let (pixel, other, share) = crossing.blend();
        picture[pixel] += (colours[other] - colours[pixel]) * share;
    }
}

/// Returns sum w |R - I| of a picture R, which becomes its gradient, scaled.
pub fn loss(picture: &mut [Vec3A], targets: &[[f32; 3]], weights: Option<&[f32]>, scale: f32) -> f64 {
    let mut sum = 0.0;
    for (i, (colour, &target)) in picture.iter_mut().zip(targets).enumerate() {
        let weight = weights.map_or(1.0, |weights| weights[i]);
        let difference = *colour - Vec3A::from_array(target);
        sum += f64::from(difference.abs().element_sum() * weight);
        let sign = |x: f32| f32::from(x > 0.0) - f32::from(x < 0.0);
        let signs = Vec3A::from_array(difference.to_array().map(sign));
        *colour = signs * (weight * scale);
    }
    sum
}

/// Sets `unblended` to the gradient with respect to the colours before they were blended.
pub fn unblend(gradient: &[Vec3A], crossings: &[(Silhouette, Crossing)], unblended: &mut Vec<Vec3A>) {
    unblended.clear();
    unblended.extend_from_slice(gradient);
    for (_, crossing) in crossings {
        let (pixel, other, share) = crossing.blend();
        unblended[pixel] -= gradient[pixel] * share;
        unblended[other] += gradient[pixel] * share;
    }
}

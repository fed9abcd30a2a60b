use std::borrow::Cow;

use super::shown::Shown;
use super::unit_space::UnitSpace;
use crate::camera::Intrinsics;
use crate::formats::{Photograph, Pixels};
use crate::render::{Light, Target, View};

/// A photograph as targets of several sizes are made of it.
pub(super) struct Source<'a> {
    photograph: &'a Photograph,
    shown: Shown,
    background: [f32; 3],
    view: View,
    light: Light,
}

impl<'a> Source<'a> {
    pub fn new(photograph: &'a Photograph, shown: Shown, background: [f32; 3], space: &UnitSpace) -> Self {
        let view = View { pose: space.pose(&photograph.pose), intrinsics: photograph.intrinsics };
        Self { photograph, shown, background, view, light: shown.light(photograph) }
    }

    /// The picture to match, halved until no side is longer than `longest`.
    pub fn target(&self, longest: u32) -> Target {
        let mut pixels = Cow::Borrowed(&self.photograph.pixels);
        let mut weights: Option<Vec<f32>> = self
            .photograph
            .unseen
            .as_ref()
            .map(|unseen| unseen.iter().map(|&unseen| if unseen { 0.0 } else { 1.0 }).collect());
        let mut intrinsics: Intrinsics = self.view.intrinsics;
        while too_long(&pixels, longest) {
            let halved = pixels.halved();
            weights = weights.map(|weights| halved_weights(&weights, pixels.size, halved.size));
            intrinsics = intrinsics.reduced(2, halved.size);
            pixels = Cow::Owned(halved);
        }
        Target {
            view: View { pose: self.view.pose, intrinsics },
            light: self.light,
            background: self.background,
            colours: self.colours(&pixels),
            weights,
        }
    }

    /// Which pixels of the same size are the object's by more than a share `[H * W]`.
    pub fn object(&self, longest: u32, share: f32) -> Vec<bool> {
        let mut pixels = Cow::Borrowed(&self.photograph.pixels);
        while too_long(&pixels, longest) {
            pixels = Cow::Owned(pixels.halved());
        }
        pixels.values.iter().map(|pixel| pixel[3] > share).collect()
    }

    fn colours(&self, pixels: &Pixels) -> Vec<[f32; 3]> {
        let colour = |&[red, green, blue, opacity]: &[f32; 4]| match self.shown {
            Shown::Silhouette => [opacity; 3],
            _ => {
                let [r, g, b] = self.background.map(|level| level * (1.0 - opacity));
                [red + r, green + g, blue + b]
            }
        };
        pixels.values.iter().map(colour).collect()
    }
}

fn too_long(pixels: &Pixels, longest: u32) -> bool {
    pixels.size[0].max(pixels.size[1]) > longest && pixels.size[0].min(pixels.size[1]) > 1
}

/// Only squares that are wholly seen count.
fn halved_weights(weights: &[f32], from: [u32; 2], to: [u32; 2]) -> Vec<f32> {
    let at = |x: u32, y: u32| weights[(y.min(from[1] - 1) * from[0] + x.min(from[0] - 1)) as usize];
    let least = |x: u32, y: u32| {
        at(2 * x, 2 * y).min(at(2 * x + 1, 2 * y)).min(at(2 * x, 2 * y + 1)).min(at(2 * x + 1, 2 * y + 1))
    };
    (0..to[1]).flat_map(|y| (0..to[0]).map(move |x| least(x, y))).collect()
}

/// What stands behind the object: black, but behind shaded pictures white where the object is dark, so that outlines show.
pub(super) fn background(photographs: &[Photograph], shown: Shown) -> [f32; 3] {
    if shown != Shown::Shaded {
        return [0.0; 3];
    }
    let (mut sum, mut area) = (0.0, 0.0);
    for &[red, green, blue, opacity] in photographs.iter().flat_map(|photograph| &photograph.pixels.values) {
        sum += f64::from(red + green + blue) / 3.0;
        area += f64::from(opacity);
    }
    if sum < 0.5 * area { [1.0; 3] } else { [0.0; 3] }
}

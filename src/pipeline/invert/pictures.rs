use super::shown::Shown;
use crate::picture::{Colour, Image, Sheet};
use crate::render::{Rendering, Target};

/// Longest side of the pictures that are left behind, and most views on a contact sheet.
const SIDE: usize = 256;
const MOST_ROWS: usize = 8;
/// A difference of this much is drawn in full red or blue.
const FULL: f32 = 0.5;

/// A view as it was given, as the result looks, and the difference.
#[derive(Debug, Clone)]
pub struct ViewPictures {
    /// The view.
    pub name: String,
    /// The picture to match.
    pub target: Image,
    /// The result's.
    pub rendering: Image,
    /// White where both are alike, red where the result is brighter, blue where it is darker.
    pub difference: Image,
}

impl ViewPictures {
    pub(super) fn of(name: &str, shown: Shown, target: &Target, rendering: &Rendering) -> Self {
        let [width, height] = rendering.size;
        let step = width.max(height).div_ceil(SIDE);
        let image = |value: &dyn Fn(usize) -> [f32; 3]| {
            let (across, down) = (width / step, height / step);
            let mut image = Image::filled(across.max(1), down.max(1), Colour::WHITE);
            for y in 0..down {
                for x in 0..across {
                    image.set(x, y, mean(value, [x * step, y * step], step, width));
                }
            }
            image
        };
        let coded = |colour: [f32; 3]| if shown == Shown::Shaded { colour.map(srgb) } else { colour };
        let off = |at: usize| -> f32 {
            let (a, b) = (rendering.colours[at], target.colours[at]);
            (0..3).map(|c| a[c] - b[c]).sum::<f32>() / 3.0
        };
        Self {
            name: name.to_owned(),
            target: image(&|at| coded(target.colours[at])),
            rendering: image(&|at| coded(rendering.colours[at])),
            difference: image(&|at| {
                let share = (off(at) / FULL).clamp(-1.0, 1.0);
                [1.0 + share.min(0.0), 1.0 - share.abs(), 1.0 - share.max(0.0)]
            }),
        }
    }
}

fn srgb(level: f32) -> f32 {
    if level <= 0.003_130_8 { 12.92 * level } else { 1.055 * level.powf(1.0 / 2.4) - 0.055 }
}

/// The mean of a square of pixels, in bytes.
fn mean(value: &dyn Fn(usize) -> [f32; 3], [left, top]: [usize; 2], step: usize, width: usize) -> [u8; 3] {
    let mut sum = [0.0; 3];
    for y in top..top + step {
        for x in left..left + step {
            for (sum, value) in sum.iter_mut().zip(value(y * width + x)) {
                *sum += value.clamp(0.0, 1.0);
            }
        }
    }
    sum.map(|sum| (255.0 * sum / (step * step) as f32).round() as u8)
}

/// Target, rendering and difference of some views, spread over all of them.
pub(super) fn contact_sheet(title: &str, views: &[ViewPictures]) -> Image {
    let mut sheet = Sheet::new(title);
    for view in views.iter().step_by(views.len().div_ceil(MOST_ROWS).max(1)) {
        sheet.row([
            (view.name.clone(), view.target.clone()),
            ("result".to_owned(), view.rendering.clone()),
            ("difference".to_owned(), view.difference.clone()),
        ]);
    }
    sheet.image()
}

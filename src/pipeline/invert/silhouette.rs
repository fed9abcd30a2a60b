use glam::{DVec2, DVec3};

use crate::camera::{Intrinsics, Pose};
use crate::formats::{Photograph, Pixels};

/// Longest side of the silhouettes that hulls are carved from.
const SIDE: u32 = 256;

/// What a camera saw of the object and what not, with how much of it lies in any rectangle.
#[derive(Debug, Clone)]
pub(super) struct Silhouette {
    pub pose: Pose,
    pub intrinsics: Intrinsics,
    /// Pixels of the object above and to the left of each corner of a pixel `[(H + 1) * (W + 1)]`.
    sums: Vec<u32>,
}

/// Where a point with some extent falls.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Fall {
    /// Behind the camera or beside its picture.
    Unseen,
    /// On the object.
    Inside,
    /// Beside the object.
    Outside,
}

impl Silhouette {
    pub fn of(photograph: &Photograph) -> Self {
        let (mut intrinsics, mut reduced) = (photograph.intrinsics, None::<Pixels>);
        while intrinsics.size[0].max(intrinsics.size[1]) > SIDE {
            let halved = reduced.as_ref().unwrap_or(&photograph.pixels).halved();
            intrinsics = intrinsics.reduced(2, halved.size);
            reduced = Some(halved);
        }
        let pixels = reduced.as_ref().unwrap_or(&photograph.pixels);
        Self { pose: photograph.pose, intrinsics, sums: sums(pixels) }
    }

    /// The same object seen by a camera with other axes or another lens.
    pub fn with(&self, pose: Pose, intrinsics: Intrinsics) -> Self {
        Self { pose, intrinsics, sums: self.sums.clone() }
    }

    /// Width and height.
    pub fn size(&self) -> [usize; 2] {
        self.intrinsics.size.map(|side| side as usize)
    }

    /// Whether a pixel is the object's.
    pub fn holds(&self, x: usize, y: usize) -> bool {
        self.count([x, y], [x + 1, y + 1]) > 0
    }

    /// Pixels of the object.
    pub fn area(&self) -> u32 {
        self.sums.last().copied().unwrap_or(0)
    }

    fn count(&self, [left, top]: [usize; 2], [right, bottom]: [usize; 2]) -> u32 {
        let stride = self.size()[0] + 1;
        let at = |x: usize, y: usize| self.sums[y * stride + x];
        at(right, bottom) + at(left, top) - at(right, top) - at(left, bottom)
    }

    /// The pixels about a ball of the world, those of the picture alone: first and end. `None` if there are none.
    pub fn about(&self, centre: DVec3, radius: f64) -> Option<[[usize; 2]; 2]> {
        let seen = self.pose.to_camera(centre);
        if seen.z <= radius {
            return None;
        }
        let pixel = self.intrinsics.pixel(seen.truncate() / seen.z);
        let reach = self.intrinsics.focal.abs() * (radius / seen.z);
        let size = DVec2::new(f64::from(self.intrinsics.size[0]), f64::from(self.intrinsics.size[1]));
        let (low, high) = (pixel - reach, pixel + reach);
        let inside = low.cmplt(size).all() && high.cmpgt(DVec2::ZERO).all() && pixel.is_finite();
        inside.then(|| {
            let first = low.max(DVec2::ZERO).floor();
            let end = high.min(size).ceil();
            [[first.x as usize, first.y as usize], [end.x as usize, end.y as usize]]
        })
    }

    /// Where a ball falls: inside if any of its pixels is the object's.
    pub fn fall(&self, centre: DVec3, radius: f64) -> Fall {
        match self.about(centre, radius) {
            None => Fall::Unseen,
            Some([first, end]) if self.count(first, end) > 0 => Fall::Inside,
            Some(_) => Fall::Outside,
        }
    }

    /// The mean of the object's pixels, and how far the farthest is from `from` in pixels.
    pub fn middle(&self) -> DVec2 {
        let (mut sum, mut count) = (DVec2::ZERO, 0.0);
        self.for_each(|pixel| {
            sum += pixel;
            count += 1.0;
        });
        sum / f64::max(count, 1.0)
    }

    /// How far the object's farthest pixel is from a place of the picture.
    pub fn reach(&self, from: DVec2) -> f64 {
        let mut farthest = 0.0;
        self.for_each(|pixel| farthest = f64::max(farthest, pixel.distance(from)));
        farthest
    }

    fn for_each(&self, mut visit: impl FnMut(DVec2)) {
        let [width, height] = self.size();
        for y in 0..height {
            for x in (0..width).filter(|&x| self.holds(x, y)) {
                visit(DVec2::new(x as f64 + 0.5, y as f64 + 0.5));
            }
        }
    }
}

fn sums(pixels: &Pixels) -> Vec<u32> {
    let [width, height] = pixels.size.map(|side| side as usize);
    let mut sums = vec![0; (width + 1) * (height + 1)];
    for y in 0..height {
        let mut row = 0;
        for x in 0..width {
            row += u32::from(pixels.values[y * width + x][3] > 0.5);
            sums[(y + 1) * (width + 1) + x + 1] = sums[y * (width + 1) + x + 1] + row;
        }
    }
    sums
}

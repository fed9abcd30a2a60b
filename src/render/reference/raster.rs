//! Which triangle each pixel's centre sees.

use glam::Vec2;

use super::corner::Corner;

/// Steps of a pixel on which corners are rounded, as graphics hardware does.
const STEPS: f32 = 256.0;

/// Farthest from the picture's corner that a rounded corner may be, in steps: products of two stay in 64 bits.
const FARTHEST: f32 = (1 << 30) as f32;

/// What every pixel sees: one more than the triangle, and how near it is. Zeros where there is nothing.
#[derive(Debug, Clone, Default)]
pub struct Raster {
    pub width: usize,
    pub height: usize,
    /// `[H * W]`.
    pub ids: Vec<u32>,
    /// 1 / w `[H * W]`.
    pub nearness: Vec<f32>,
}

impl Raster {
    /// Draws triangles `[F, 3]`; those whose inside is seen are left out on closed meshes, as are those that reach
    /// behind the camera.
    pub fn draw(&mut self, size: [usize; 2], corners: &[Corner], triangles: &[[u32; 3]], closed: bool) {
        [self.width, self.height] = size;
        self.ids.clear();
        self.ids.resize(self.width * self.height, 0);
        self.nearness.clear();
        self.nearness.resize(self.width * self.height, 0.0);
        for (id, triangle) in (1..).zip(triangles) {
            self.draw_triangle(id, triangle.map(|corner| &corners[corner as usize]), closed);
        }
    }

    fn draw_triangle(&mut self, id: u32, corners: [&Corner; 3], closed: bool) {
        if !corners.iter().all(|corner| corner.is_before()) {
            return;
        }
        let Some(mut cover) = Cover::new(corners.map(|corner| corner.pixel), closed) else { return };
        let [[left, top], [right, bottom]] = cover.bounds([self.width, self.height]);
        if left > right || top > bottom {
            return;
        }
        let near = cover.plane([left, top], corners.map(|corner| corner.nearness));
        cover.start([left, top]);
        let width = (right - left + 1) as usize;
        for y in top..=bottom {
            let at = y as usize * self.width + left as usize;
            let row = self.ids[at..at + width].iter_mut().zip(&mut self.nearness[at..at + width]);
            let mut sides = cover.sides;
            let first = near[0] + near[2] * (y - top) as f32;
            for (x, (seen, nearest)) in row.enumerate() {
                if (sides[0] | sides[1] | sides[2]) >= 0 {
                    let nearness = first + near[1] * x as f32;
                    if nearness > *nearest {
                        (*seen, *nearest) = (id, nearness);
                    }
                }
                for (side, step) in sides.iter_mut().zip(cover.across) {
                    *side += step;
                }
            }
            for (side, step) in cover.sides.iter_mut().zip(cover.down) {
                *side += step;
            }
        }
    }
}

/// The three edge functions of a triangle on a grid of steps, not negative inside; of the pixel centres on an edge it
/// has those on its left and upper ones (the top-left rule).
struct Cover {
    corners: [[i64; 2]; 3],
    doubled_area: i64,
    /// Value of each edge's function, less one where the edge itself is left out.
    sides: [i64; 3],
    /// Their change from a pixel to the one on its right.
    across: [i64; 3],
    /// And to the one below.
    down: [i64; 3],
    /// Whether the corners' order is turned round, for the inside.
    turned: bool,
}

impl Cover {
    fn new(pixels: [Vec2; 3], closed: bool) -> Option<Self> {
        let round = |x: f32| (x * STEPS).round_ties_even().clamp(-FARTHEST, FARTHEST) as i64;
        let mut corners = pixels.map(|pixel| [round(pixel.x), round(pixel.y)]);
        let from = |a: [i64; 2], b: [i64; 2]| [b[0] - a[0], b[1] - a[1]];
        let cross = |a: [i64; 2], b: [i64; 2]| a[0] * b[1] - a[1] * b[0];
        let doubled = cross(from(corners[0], corners[1]), from(corners[0], corners[2]));
        if doubled == 0 || (closed && doubled > 0) {
            return None;
        }
        let turned = doubled < 0;
        if turned {
            corners.swap(1, 2);
        }
        let zeros = [0; 3];
        Some(Self { corners, doubled_area: doubled.abs(), sides: zeros, across: zeros, down: zeros, turned })
    }

    /// First and last column and row whose pixels' centres it may have, in a picture of a size.
    fn bounds(&self, size: [usize; 2]) -> [[i64; 2]; 2] {
        let [steps, half] = [STEPS as i64, STEPS as i64 / 2];
        let along = |axis: usize| self.corners.map(|corner| corner[axis]);
        let first = |axis| ((min(along(axis)) - half + steps - 1).div_euclid(steps)).max(0);
        let last = |axis| ((max(along(axis)) - half).div_euclid(steps)).min(size[axis] as i64 - 1);
        [[first(0), first(1)], [last(0), last(1)]]
    }

    /// The edge functions at a pixel's centre without the top-left rule, and their steps.
    fn edge(&self, edge: usize, [x, y]: [i64; 2]) -> [i64; 3] {
        let [a, b] = [self.corners[(edge + 1) % 3], self.corners[(edge + 2) % 3]];
        let [dx, dy] = [b[0] - a[0], b[1] - a[1]];
        let (steps, half) = (STEPS as i64, STEPS as i64 / 2);
        let value = dx * (y * steps + half - a[1]) - dy * (x * steps + half - a[0]);
        [value, -dy * steps, dx * steps]
    }

    /// Sets the edge functions to those at a pixel's centre.
    fn start(&mut self, pixel: [i64; 2]) {
        for edge in 0..3 {
            let [value, across, down] = self.edge(edge, pixel);
            // On this grid, with rows that run down, left edges go up and upper edges to the right.
            let left_or_upper = across > 0 || (across == 0 && down > 0);
            self.sides[edge] = value - i64::from(!left_or_upper);
            (self.across[edge], self.down[edge]) = (across, down);
        }
    }

    /// What is linear on the picture and has values at the corners: its value at a pixel's centre, and its steps.
    fn plane(&self, pixel: [i64; 2], mut values: [f32; 3]) -> [f32; 3] {
        if self.turned {
            values.swap(1, 2);
        }
        let mut plane = [0.0; 3];
        for (edge, value) in values.into_iter().enumerate() {
            for (sum, part) in plane.iter_mut().zip(self.edge(edge, pixel)) {
                *sum += (part as f64 / self.doubled_area as f64) as f32 * value;
            }
        }
        plane
    }
}

fn min(values: [i64; 3]) -> i64 {
    values[0].min(values[1]).min(values[2])
}

fn max(values: [i64; 3]) -> i64 {
    values[0].max(values[1]).max(values[2])
}

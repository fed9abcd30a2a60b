use glam::DVec3;

use super::surface::Surface;

/// Points spread over a surface uniformly by area.
pub(super) struct Samples {
    /// The triangle of each, in rising order.
    pub triangles: Vec<u32>,
    /// Where each is.
    pub points: Vec<DVec3>,
}

impl Samples {
    /// Cuts the surface's area into `count` equal parts and draws a point from each: less noise than independent draws.
    pub fn new(surface: &Surface, count: usize, seed: u64) -> Self {
        let total: f64 = surface.crosses.iter().map(|c| c.length()).sum();
        let mut random = SplitMix(seed);
        let mut samples = Self { triangles: Vec::with_capacity(count), points: Vec::with_capacity(count) };
        let (mut triangle, mut passed) = (0, surface.crosses[0].length());
        let last = surface.triangles.len() - 1;
        for sample in 0..count {
            let wanted = (sample as f64 + random.uniform()) / count as f64 * total;
            while passed < wanted && triangle < last {
                triangle += 1;
                passed += surface.crosses[triangle].length();
            }
            samples.triangles.push(triangle as u32);
            samples.points.push(random.on_triangle(surface.corners(triangle as u32)));
        }
        samples
    }
}

/// The splitmix64 generator (Steele, Lea and Flood 2014): the same numbers everywhere and always.
struct SplitMix(u64);

impl SplitMix {
    /// Uniform in 0 to 1, 1 excluded.
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^= z >> 31;
        (z >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn on_triangle(&mut self, [a, b, c]: [DVec3; 3]) -> DVec3 {
        let (mut v, mut w) = (self.uniform(), self.uniform());
        if v + w > 1.0 {
            (v, w) = (1.0 - v, 1.0 - w);
        }
        a + (b - a) * v + (c - a) * w
    }
}

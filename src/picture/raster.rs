use glam::{DVec2, DVec3};

/// What each sample of a picture sees: the nearest triangle and how near it is.
pub(super) struct Raster {
    pub width: usize,
    pub height: usize,
    nearness: Vec<f32>,
    triangle: Vec<u32>,
}

const NOTHING: u32 = u32::MAX;

impl Raster {
    /// Draws triangles `[F, 3]` with corners projected to (column, row, nearness) `[N, 3]`.
    pub fn draw(width: usize, height: usize, points: &[DVec3], triangles: &[[u32; 3]]) -> Self {
        let samples = width * height;
        let (nearness, triangle) = (vec![f32::NEG_INFINITY; samples], vec![NOTHING; samples]);
        let mut raster = Self { width, height, nearness, triangle };
        for (index, corners) in triangles.iter().enumerate() {
            raster.draw_triangle(index as u32, corners.map(|i| points[i as usize]));
        }
        raster
    }

    /// The triangle seen at a sample.
    pub fn seen(&self, x: usize, y: usize) -> Option<u32> {
        let triangle = self.triangle[y * self.width + x];
        (triangle != NOTHING).then_some(triangle)
    }

    /// Whether something lies before `point` by more than `tolerance` samples.
    pub fn hides(&self, point: DVec3, tolerance: f64) -> bool {
        let [x, y] = [point.x, point.y];
        let inside = x >= 0.0 && y >= 0.0 && x < self.width as f64 && y < self.height as f64;
        inside && f64::from(self.nearness[y as usize * self.width + x as usize]) > point.z + tolerance
    }

    fn draw_triangle(&mut self, index: u32, corners: [DVec3; 3]) {
        let low = corners.iter().copied().fold(DVec3::INFINITY, DVec3::min);
        let high = corners.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
        // Only samples whose middles, at halves, lie in the box.
        let first = |bound: f64| (bound - 0.5).ceil().max(0.0) as usize;
        let end = |bound: f64, size: usize| ((bound - 0.5).floor() + 1.0).clamp(0.0, size as f64) as usize;
        for y in first(low.y)..end(high.y, self.height) {
            for x in first(low.x)..end(high.x, self.width) {
                let Some(weights) = barycentric(middle(x, y), corners) else { return };
                if weights.iter().all(|&w| w >= 0.0) {
                    let near = (0..3).map(|i| weights[i] * corners[i].z).sum::<f64>() as f32;
                    let at = y * self.width + x;
                    if near > self.nearness[at] {
                        self.nearness[at] = near;
                        self.triangle[at] = index;
                    }
                }
            }
        }
    }
}

/// The middle of a sample.
pub(super) fn middle(x: usize, y: usize) -> DVec2 {
    DVec2::new(x as f64 + 0.5, y as f64 + 0.5)
}

/// Twice the signed area of a triangle on the picture; negative when its outside is seen, because rows run down.
pub(super) fn doubled_area([a, b, c]: [DVec3; 3]) -> f64 {
    (b - a).truncate().perp_dot((c - a).truncate())
}

/// Weights of the corners at a place of the picture; `None` for a triangle seen edge-on.
pub(super) fn barycentric(at: DVec2, corners: [DVec3; 3]) -> Option<[f64; 3]> {
    let area = doubled_area(corners);
    if area == 0.0 {
        return None;
    }
    let part = |i: usize| {
        let [from, to] = [corners[(i + 1) % 3].truncate(), corners[(i + 2) % 3].truncate()];
        (to - from).perp_dot(at - from) / area
    };
    Some([part(0), part(1), part(2)])
}

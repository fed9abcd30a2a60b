use glam::DVec2;

/// From directions `(x / z, y / z)` to pixels: u = f_x x + s y + c_x, v = f_y y + c_y.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Intrinsics {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Focal lengths f in pixels.
    pub focal: DVec2,
    /// Principal point c in pixels.
    pub centre: DVec2,
    /// s, in pixels; zero for all but a few calibrations.
    pub skew: f64,
}

impl Intrinsics {
    /// Those of a picture with square pixels whose width spans an angle in radians.
    pub fn with_angle(size: [u32; 2], angle: f64) -> Self {
        let [width, height] = size.map(f64::from);
        let focal = 0.5 * width / (0.5 * angle).tan();
        Self { size, focal: DVec2::splat(focal), centre: DVec2::new(0.5 * width, 0.5 * height), skew: 0.0 }
    }

    /// The pixel of a direction.
    pub fn pixel(&self, direction: DVec2) -> DVec2 {
        self.focal * direction + self.centre + DVec2::new(self.skew * direction.y, 0.0)
    }

    /// The direction of a pixel.
    pub fn direction(&self, pixel: DVec2) -> DVec2 {
        let y = (pixel.y - self.centre.y) / self.focal.y;
        DVec2::new((pixel.x - self.centre.x - self.skew * y) / self.focal.x, y)
    }

    /// The same camera where each square of `factor` pixels a side has become one of `size`; what fills no square is cut
    /// off at the right and below.
    pub fn reduced(&self, factor: u32, size: [u32; 2]) -> Self {
        let factor = f64::from(factor.max(1));
        Self { size, focal: self.focal / factor, centre: self.centre / factor, skew: self.skew / factor }
    }

    /// The same camera with a picture of another size, the lengths scaled along.
    pub fn resized(&self, size: [u32; 2]) -> Self {
        let scale = DVec2::new(
            f64::from(size[0]) / f64::from(self.size[0]),
            f64::from(size[1]) / f64::from(self.size[1]),
        );
        Self { size, focal: self.focal * scale, centre: self.centre * scale, skew: self.skew * scale.x }
    }
}

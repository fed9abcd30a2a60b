use glam::{DQuat, DVec3};

/// A stream of random numbers: the same seed gives the same numbers everywhere (SplitMix64).
#[derive(Debug, Clone)]
pub struct Random {
    state: u64,
}

impl Random {
    /// The stream of a seed.
    pub fn new(seed: u64) -> Self {
        Self { state: seed }
    }

    /// The stream of the `index`-th part of what a seed makes.
    pub fn part(seed: u64, index: u64) -> Self {
        Self { state: Self::new(seed ^ Self::new(index).bits()).bits() }
    }

    /// The next 64 bits.
    pub fn bits(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.state ^ (self.state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ (mixed >> 31)
    }

    /// Even in `[low, high)`.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.bits() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Bell-shaped about 0 with deviation 1, never beyond 3: the sum of three even numbers.
    pub fn bell(&mut self) -> f64 {
        (0..3).map(|_| self.between(-1.0, 1.0)).sum()
    }

    /// A unit vector, even over the sphere.
    pub fn direction(&mut self) -> DVec3 {
        let y = self.between(-1.0, 1.0);
        let (sine, cosine) = self.between(0.0, std::f64::consts::TAU).sin_cos();
        let level = (1.0 - y * y).sqrt();
        DVec3::new(level * sine, y, level * cosine)
    }

    /// A rotation about a random axis by an angle up to `angle` radians.
    pub fn turn(&mut self, angle: f64) -> DQuat {
        let axis = self.direction();
        DQuat::from_axis_angle(axis, self.between(-angle, angle))
    }
}

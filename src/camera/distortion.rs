use glam::{DMat2, DVec2};

/// How a lens bends directions `(x, y) = (X / Z, Y / Z)`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Distortion {
    /// Not at all.
    #[default]
    None,
    /// Brown and Conrady's, as OpenCV has it: x (1 + k_1 r^2 + ...) / (1 + d_1 r^2 + ...) + 2 p_1 x y + p_2 (r^2 + 2 x^2),
    /// and y with p_1 and p_2 changing places.
    Brown {
        /// Coefficients of r^2, r^4, r^6, r^8.
        radial: [f64; 4],
        /// Those of r^2, r^4, r^6 beneath the fraction.
        denominator: [f64; 3],
        /// p_1, p_2.
        tangential: [f64; 2],
    },
    /// Kannala and Brandt's equidistant fisheye: the angle t from the axis becomes t (1 + k_1 t^2 + k_2 t^4 + ...).
    Fisheye {
        /// k_1 to k_4.
        radial: [f64; 4],
    },
}

/// Steps of Newton's method after which a direction is taken to have no origin, and how close is close enough.
const STEPS: usize = 30;
const CLOSE: f64 = 1e-10;

/// c_1 x + c_2 x^2 + ...
fn polynomial(coefficients: &[f64], x: f64) -> f64 {
    coefficients.iter().rev().fold(0.0, |sum, c| (sum + c) * x)
}

impl Distortion {
    /// Where a direction is seen.
    pub fn distort(&self, direction: DVec2) -> DVec2 {
        match self {
            Self::None => direction,
            Self::Brown { radial, denominator, tangential: [p1, p2] } => {
                let DVec2 { x, y } = direction;
                let r2 = direction.length_squared();
                let scale = (1.0 + polynomial(radial, r2)) / (1.0 + polynomial(denominator, r2));
                let tangential = DVec2::new(
                    2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
                    p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
                );
                direction * scale + tangential
            }
            Self::Fisheye { radial } => {
                let r = direction.length();
                if r < 1e-12 {
                    return direction;
                }
                let angle = r.atan();
                direction * (angle * (1.0 + polynomial(radial, angle * angle)) / r)
            }
        }
    }

    /// The direction that is seen there, by Newton's method; `None` where there is none.
    pub fn undistort(&self, seen: DVec2) -> Option<DVec2> {
        if *self == Self::None {
            return Some(seen);
        }
        let mut direction = self.guess(seen)?;
        for _ in 0..STEPS {
            let off = self.distort(direction) - seen;
            let jacobian = self.jacobian(direction);
            // Where the formula has turned back, what it gives is no picture.
            if !(jacobian.determinant() > 0.0) {
                return None;
            }
            if off.length() < CLOSE {
                return Some(direction);
            }
            direction -= jacobian.inverse() * off;
        }
        None
    }

    fn guess(&self, seen: DVec2) -> Option<DVec2> {
        match self {
            Self::None | Self::Brown { .. } => Some(seen),
            Self::Fisheye { .. } => {
                let angle = seen.length();
                let far = std::f64::consts::FRAC_PI_2 - 1e-3;
                (angle < far).then(|| if angle < 1e-12 { seen } else { seen * (angle.tan() / angle) })
            }
        }
    }

    fn jacobian(&self, at: DVec2) -> DMat2 {
        let h = 1e-6 * (1.0 + at.length());
        let along = |axis: DVec2| (self.distort(at + axis * h) - self.distort(at - axis * h)) / (2.0 * h);
        DMat2::from_cols(along(DVec2::X), along(DVec2::Y))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn undistorted_directions_are_seen_where_they_came_from() {
        let lenses = [
            Distortion::None,
            Distortion::Brown {
                radial: [-0.28, 0.07, 0.002, 0.0],
                denominator: [0.0; 3],
                tangential: [2e-4, 1e-5],
            },
            Distortion::Brown {
                radial: [0.5, -0.1, 0.02, 1e-3],
                denominator: [0.4, 0.1, 0.01],
                tangential: [1e-3, -3e-3],
            },
            Distortion::Fisheye { radial: [-0.01, 0.02, -0.003, 1e-3] },
        ];
        for lens in lenses {
            for i in 0..100 {
                let (x, y) = (f64::from(i % 10) / 9.0 - 0.5, f64::from(i / 10) / 9.0 - 0.5);
                let direction = DVec2::new(x, y);
                let back = lens.undistort(lens.distort(direction)).unwrap();
                assert!(back.distance(direction) < 1e-8, "{lens:?} {direction} {back}");
            }
        }
    }

    #[test]
    fn what_the_formula_cannot_reach_is_nothing() {
        let lens =
            Distortion::Brown { radial: [-0.3, 0.0, 0.0, 0.0], denominator: [0.0; 3], tangential: [0.0; 2] };
        // r (1 - 0.3 r^2) is never above 0.71.
        assert_eq!(lens.undistort(DVec2::new(0.9, 0.0)), None);
        assert!(lens.undistort(DVec2::new(0.6, 0.0)).is_some());
        assert_eq!(Distortion::Fisheye { radial: [0.0; 4] }.undistort(DVec2::new(1.7, 0.0)), None);
    }

    #[test]
    fn opencv_s_example_is_met() {
        // x = 0.3, y = -0.2: r^2 = 0.13.
        let lens = Distortion::Brown {
            radial: [0.1, 0.01, 0.0, 0.0],
            denominator: [0.0; 3],
            tangential: [0.02, 0.03],
        };
        let scale = 1.0 + 0.1 * 0.13 + 0.01 * 0.13 * 0.13;
        let expected = DVec2::new(
            0.3 * scale + 2.0 * 0.02 * -0.06 + 0.03 * (0.13 + 2.0 * 0.09),
            -0.2 * scale + 0.02 * (0.13 + 2.0 * 0.04) + 2.0 * 0.03 * -0.06,
        );
        assert!(lens.distort(DVec2::new(0.3, -0.2)).distance(expected) < 1e-15);
    }
}

use glam::Vec3A;

use crate::render::Light;

/// A light with its factors side by side, as the passes over pixels read them.
#[derive(Debug, Clone, Copy)]
pub struct Lamp {
    /// By polynomial: the channels.
    rows: [Vec3A; 9],
    /// By channel: the factors of x, y, z; those of xy, yz, xz; those of 3z^2 - 1 and x^2 - y^2.
    columns: [[Vec3A; 3]; 3],
}

impl Lamp {
    pub fn new(Light(factors): &Light) -> Self {
        let of = |channel: usize, rows: [usize; 3]| Vec3A::from_array(rows.map(|row| factors[row][channel]));
        let columns =
            [0, 1, 2].map(|channel| [of(channel, [1, 2, 3]), of(channel, [4, 5, 7]), of(channel, [6, 8, 8])]);
        Self { rows: factors.map(Vec3A::from_array), columns }
    }

    /// [`Light::colour`].
    #[inline]
    pub fn colour(&self, n: Vec3A) -> Vec3A {
        let mut colour = Vec3A::ZERO;
        for (row, y) in self.rows.iter().zip(Light::polynomials(n)) {
            colour += *row * y;
        }
        colour
    }

    /// [`Light::pull_back`].
    #[inline]
    pub fn pull_back(&self, n: Vec3A, upstream: Vec3A) -> Vec3A {
        let [red, green, blue] = &self.columns;
        let pulled =
            |part: usize| red[part] * upstream.x + green[part] * upstream.y + blue[part] * upstream.z;
        let [linear, mixed, square] = [pulled(0), pulled(1), pulled(2)];
        let of_squares = n * Vec3A::new(2.0 * square.y, -2.0 * square.y, 6.0 * square.x);
        let (xy, yz, xz) = (mixed.x, mixed.y, mixed.z);
        linear + of_squares + Vec3A::new(xy * n.y + xz * n.z, xy * n.x + yz * n.z, yz * n.y + xz * n.x)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::scenes::light;

    #[test]
    fn is_its_light() {
        let (light, upstream) = (light(), Vec3A::new(0.3, -0.8, 0.5));
        let lamp = Lamp::new(&light);
        for n in [Vec3A::X, Vec3A::new(0.6, 0.0, -0.8), Vec3A::new(0.48, -0.6, 0.64)] {
            assert!(lamp.colour(n).distance(Vec3A::from_array(light.colour(n))) < 1e-6);
            let pulled = light.pull_back(n, upstream.to_array());
            assert!(lamp.pull_back(n, upstream).distance(pulled) < 1e-6);
        }
    }
}

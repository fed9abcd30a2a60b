use glam::Vec3A;

use crate::camera::Pose;

/// Distant light by direction, to second order: the factors L `[9, 3]` of the plain polynomials
/// Y = (1, x, y, z, xy, yz, 3z^2 - 1, xz, x^2 - y^2) of a unit world normal, a row per polynomial, a column per channel.
///
/// A surface point with unit normal n and albedo a has colour_c = a_c sum_j L_jc Y_j(n). These are the real spherical
/// harmonics without their constants (Ramamoorthi and Hanrahan 2001).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Light(pub [[f32; 3]; 9]);

impl Light {
    /// The same colour whatever the normal: silhouettes in white on black, say.
    pub fn uniform(colour: [f32; 3]) -> Self {
        let mut factors = [[0.0; 3]; 9];
        factors[0] = colour;
        Self(factors)
    }

    /// Pictures of world normals: colour = 0.5 + 0.5 n.
    pub fn world_normals() -> Self {
        Self::normals(|channel, axis| if channel == axis { 0.5 } else { 0.0 })
    }

    /// Pictures of normals in a camera's axes: colour = 0.5 + 0.5 R n.
    pub fn camera_normals(pose: &Pose) -> Self {
        Self::normals(|channel, axis| 0.5 * pose.rotation.row(channel)[axis] as f32)
    }

    fn normals(factor: impl Fn(usize, usize) -> f32) -> Self {
        let mut factors = [[0.0; 3]; 9];
        factors[0] = [0.5; 3];
        for axis in 0..3 {
            factors[1 + axis] = [0, 1, 2].map(|channel| factor(channel, axis));
        }
        Self(factors)
    }

    /// Y(n) `[9]`.
    #[inline]
    pub fn polynomials(n: Vec3A) -> [f32; 9] {
        let (x, y, z) = (n.x, n.y, n.z);
        [1.0, x, y, z, x * y, y * z, 3.0 * z * z - 1.0, x * z, x * x - y * y]
    }

    /// The colour of a white surface with unit normal n.
    #[inline]
    pub fn colour(&self, n: Vec3A) -> [f32; 3] {
        let polynomials = Self::polynomials(n);
        let mut colour = [0.0; 3];
        for (factors, y) in self.0.iter().zip(polynomials) {
            for (sum, factor) in colour.iter_mut().zip(factors) {
                *sum += factor * y;
            }
        }
        colour
    }

    /// The gradient of `upstream . colour(n)` with respect to n, taken as free of its unit length.
    #[inline]
    pub fn pull_back(&self, n: Vec3A, upstream: [f32; 3]) -> Vec3A {
        let [_, lx, ly, lz, lxy, lyz, lzz, lxz, lxxyy] =
            self.0.map(|row| row[0] * upstream[0] + row[1] * upstream[1] + row[2] * upstream[2]);
        Vec3A::new(
            lx + lxy * n.y + lxz * n.z + 2.0 * lxxyy * n.x,
            ly + lxy * n.x + lyz * n.z - 2.0 * lxxyy * n.y,
            lz + lyz * n.y + lxz * n.x + 6.0 * lzz * n.z,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::Random;
    use crate::numeric::finite_difference::directional_error;
    use glam::DVec3;

    #[test]
    fn pull_back_of_colours() {
        let mut random = Random::new(3);
        let light = Light(std::array::from_fn(|_| std::array::from_fn(|_| random.signed() as f32)));
        let normals: Vec<Vec3A> = (0..8)
            .map(|_| Vec3A::new(random.signed() as f32, random.signed() as f32, random.signed() as f32))
            .collect();
        let upstream = [0.3, -0.7, 0.9];
        let gradient: Vec<Vec3A> = normals.iter().map(|&n| light.pull_back(n, upstream)).collect();
        let error = directional_error(&normals, &gradient, 1e-3, 8, |normals| {
            let dot = |c: [f32; 3]| f64::from(c[0] * upstream[0] + c[1] * upstream[1] + c[2] * upstream[2]);
            normals.iter().map(|&n| dot(light.colour(n))).sum()
        });
        assert!(error < 2e-3, "{error}");
    }

    #[test]
    fn normals_as_colours() {
        let n = Vec3A::new(0.6, 0.0, -0.8);
        let world = Vec3A::from_array(Light::world_normals().colour(n));
        assert!(world.distance(Vec3A::new(0.8, 0.5, 0.1)) < 1e-6, "{world}");
        let pose = Pose::looking(DVec3::new(2.0, 1.0, 3.0), DVec3::ZERO, DVec3::Y);
        let towards = pose.centre().normalize().as_vec3a();
        let colour = Light::camera_normals(&pose).colour(towards);
        assert!(Vec3A::from_array(colour).distance(Vec3A::new(0.5, 0.5, 0.0)) < 1e-6, "{colour:?}");
        assert_eq!(Light::uniform([1.0, 0.5, 0.0]).colour(n), [1.0, 0.5, 0.0]);
    }
}

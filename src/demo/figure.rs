use glam::DVec3;

use super::surface_net::surface_net;
use crate::mesh::TriangleMesh;

/// A body of limbs that flow into each other: one piece without holes through it, like heads, but with parts that stand
/// far out. Lengths are in units of about its own size, +Y is up, +Z is where it looks.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// What it is called.
    pub name: &'static str,
    limbs: Vec<Limb>,
    /// How far limbs flow into each other.
    blend: f64,
}

/// A cone with round ends.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Limb {
    ends: [DVec3; 2],
    radii: [f64; 2],
}

type LimbNumbers = ([f64; 3], f64, [f64; 3], f64);

const HARE: [LimbNumbers; 12] = [
    ([0.0, -0.35, -0.15], 0.34, [0.0, 0.0, 0.08], 0.24),
    ([0.0, 0.32, 0.2], 0.2, [0.0, 0.27, 0.36], 0.12),
    ([0.0, 0.0, 0.1], 0.2, [0.0, 0.3, 0.18], 0.14),
    ([0.08, 0.42, 0.14], 0.06, [0.2, 0.95, -0.02], 0.075),
    ([-0.08, 0.42, 0.14], 0.06, [-0.28, 0.9, 0.06], 0.075),
    ([0.2, -0.1, 0.15], 0.09, [0.22, -0.58, 0.32], 0.075),
    ([-0.2, -0.1, 0.15], 0.09, [-0.22, -0.58, 0.32], 0.075),
    ([0.22, -0.58, 0.3], 0.07, [0.22, -0.62, 0.44], 0.06),
    ([-0.22, -0.58, 0.3], 0.07, [-0.22, -0.62, 0.44], 0.06),
    ([0.28, -0.4, -0.2], 0.17, [0.3, -0.62, 0.08], 0.09),
    ([-0.28, -0.4, -0.2], 0.17, [-0.3, -0.62, 0.08], 0.09),
    ([0.0, -0.4, -0.45], 0.1, [0.0, -0.34, -0.6], 0.1),
];

const GOAT: [LimbNumbers; 13] = [
    ([0.0, 0.05, -0.45], 0.24, [0.0, 0.08, 0.3], 0.22),
    ([0.0, 0.1, 0.35], 0.18, [0.0, 0.5, 0.62], 0.12),
    ([0.0, 0.5, 0.6], 0.15, [0.0, 0.36, 0.9], 0.09),
    ([0.06, 0.62, 0.56], 0.05, [0.14, 0.86, 0.4], 0.04),
    ([-0.06, 0.62, 0.56], 0.05, [-0.14, 0.86, 0.4], 0.04),
    ([0.14, 0.86, 0.4], 0.04, [0.2, 0.9, 0.2], 0.025),
    ([-0.14, 0.86, 0.4], 0.04, [-0.2, 0.9, 0.2], 0.025),
    ([0.0, 0.26, 0.88], 0.05, [0.0, 0.12, 0.86], 0.025),
    ([0.15, 0.0, 0.3], 0.1, [0.18, -0.7, 0.33], 0.06),
    ([-0.15, 0.0, 0.3], 0.1, [-0.18, -0.7, 0.33], 0.06),
    ([0.15, 0.0, -0.45], 0.11, [0.18, -0.7, -0.5], 0.06),
    ([-0.15, 0.0, -0.45], 0.11, [-0.18, -0.7, -0.5], 0.06),
    ([0.0, 0.15, -0.62], 0.06, [0.0, 0.34, -0.82], 0.05),
];

const SQUID: [LimbNumbers; 11] = [
    ([0.0, 0.15, 0.0], 0.3, [0.0, 0.6, 0.0], 0.12),
    ([0.14, 0.62, 0.0], 0.05, [0.34, 0.82, 0.0], 0.03),
    ([-0.14, 0.62, 0.0], 0.05, [-0.34, 0.82, 0.0], 0.03),
    ([0.16, 0.0, 0.1], 0.1, [0.62, -0.3, 0.3], 0.06),
    ([0.62, -0.3, 0.3], 0.06, [0.72, -0.62, 0.5], 0.035),
    ([-0.16, 0.0, 0.1], 0.1, [-0.6, -0.24, 0.36], 0.06),
    ([-0.6, -0.24, 0.36], 0.06, [-0.88, -0.1, 0.5], 0.035),
    ([0.0, 0.0, 0.18], 0.1, [0.02, -0.5, 0.5], 0.06),
    ([0.14, 0.0, -0.14], 0.1, [0.36, -0.4, -0.6], 0.05),
    ([-0.14, 0.0, -0.14], 0.1, [-0.4, -0.56, -0.42], 0.05),
    ([0.0, 0.0, -0.18], 0.09, [-0.06, -0.7, -0.1], 0.05),
];

impl Figure {
    /// Sits with long ears up.
    pub fn hare() -> Self {
        Self::of("hare", &HARE, 0.05)
    }

    /// Stands on four legs, with horns, a beard and a tail.
    pub fn goat() -> Self {
        Self::of("goat", &GOAT, 0.05)
    }

    /// Six arms and two fins about a bulb.
    pub fn squid() -> Self {
        Self::of("squid", &SQUID, 0.08)
    }

    /// All of them.
    pub fn all() -> [Self; 3] {
        [Self::hare(), Self::goat(), Self::squid()]
    }

    fn of(name: &'static str, limbs: &[LimbNumbers], blend: f64) -> Self {
        let limb = |&(from, thick, to, thin): &LimbNumbers| Limb {
            ends: [DVec3::from(from), DVec3::from(to)],
            radii: [thick, thin],
        };
        Self { name, limbs: limbs.iter().map(limb).collect(), blend }
    }

    /// The surface, from a grid of `cells` cells along its longest side.
    ///
    /// # Panics
    /// For so few cells that none is crossed.
    pub fn mesh(&self, cells: usize) -> TriangleMesh {
        let low = self.extreme(DVec3::INFINITY, |limb, end| limb.ends[end] - limb.radii[end], DVec3::min);
        let high =
            self.extreme(DVec3::NEG_INFINITY, |limb, end| limb.ends[end] + limb.radii[end], DVec3::max);
        let room = DVec3::splat(self.blend + (high - low).max_element() / cells as f64);
        surface_net(|point| self.distance(point), [low - room, high + room], cells)
    }

    fn extreme(
        &self,
        start: DVec3,
        of: impl Fn(&Limb, usize) -> DVec3,
        pick: fn(DVec3, DVec3) -> DVec3,
    ) -> DVec3 {
        self.limbs.iter().flat_map(|limb| [of(limb, 0), of(limb, 1)]).fold(start, pick)
    }

    /// About the distance to the surface, negative inside.
    fn distance(&self, point: DVec3) -> f64 {
        self.limbs
            .iter()
            .map(|limb| limb.distance(point))
            .fold(f64::INFINITY, |a, b| blended(a, b, self.blend))
    }
}

impl Limb {
    fn distance(&self, point: DVec3) -> f64 {
        let [from, to] = self.ends;
        let along = to - from;
        let share = ((point - from).dot(along) / along.length_squared()).clamp(0.0, 1.0);
        point.distance(from + along * share) - (self.radii[0] + (self.radii[1] - self.radii[0]) * share)
    }
}

/// The smaller of two, smoothly where they are within `reach` of each other.
fn blended(a: f64, b: f64, reach: f64) -> f64 {
    if a.is_infinite() {
        return b;
    }
    let share = (1.0 - (a - b).abs() / (4.0 * reach)).max(0.0);
    a.min(b) - share * share * reach
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Topology, components};

    #[test]
    fn figures_are_spheres_that_were_pulled_at() {
        for figure in Figure::all() {
            let mesh = figure.mesh(60);
            let topology = Topology::of(&mesh);
            let (vertices, edges, triangles) =
                (mesh.positions().len(), topology.edges.len(), mesh.triangles().len());
            assert!(topology.on_rim.iter().all(|rim| !rim), "{} is closed", figure.name);
            assert_eq!(2 * edges, 3 * triangles, "{} is a surface", figure.name);
            assert_eq!(vertices + triangles, edges + 2, "{} has no hole through it", figure.name);
            assert_eq!(
                components(vertices, mesh.triangles()).iter().max().copied(),
                Some(0),
                "{} is one piece",
                figure.name
            );
            let volume: f64 = (mesh.triangles().iter())
                .map(|t| t.map(|i| mesh.positions()[i as usize]))
                .map(|[a, b, c]| a.dot(b.cross(c)) / 6.0)
                .sum();
            assert!(volume > 0.0, "{} faces outwards", figure.name);
            let off = mesh.positions().iter().map(|p| figure.distance(*p).abs()).fold(0.0, f64::max);
            assert!(off < 1e-3, "{}: a vertex is {off} off its surface", figure.name);
        }
    }
}

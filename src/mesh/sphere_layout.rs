//! Texture coordinates of a template sphere: the face in the middle, no vertex twice, no seam across the face.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

use glam::{DVec2, DVec3};

use super::Topology;

/// How much of the stereographic projection is mixed in, in edge lengths: enough that rings around the opening stay
/// apart by more than the chords of the outer ones cut into the inner ones.
const SPREAD: f64 = 0.25;
/// How far from the antipode of the face the sphere may be opened, in edge lengths.
const NEAR: f64 = 2.5;
/// Where the outermost vertices but the four in the corners lie; the middle is 0, the border 0.5.
const RIM: f64 = 0.49;

/// Texture coordinates `[N, 2]` of a closed sphere with unit vertices `[N, 3]`, for a face that looks along `face` with
/// `up` towards the forehead; (0, 0) is the upper left corner, and the face's left is on the right.
///
/// An azimuthal equal-area map about the face. Such a map of a whole sphere without a seam has to be open somewhere: it
/// is opened at one edge behind the face, whose two triangles lie over the entire layout and whose four vertices are the
/// corners of the square. All other triangles keep their orientation and overlap nowhere.
///
/// An `up` along `face`, or none, leaves which way is up undecided but fixed.
pub fn sphere_layout(topology: &Topology, sphere: &[DVec3], face: DVec3, up: DVec3) -> Vec<DVec2> {
    let opening = Opening::behind(topology, sphere, Compass::new(face.normalize_or(DVec3::Z), up));
    let compass = opening.compass;
    let edge = mean_edge(topology, sphere);
    let polar: Vec<[f64; 2]> = sphere.iter().map(|&p| compass.polar(p, edge, opening.twist)).collect();
    let outermost = (0..sphere.len()).filter(|&v| !opening.is_corner(v)).map(|v| polar[v][0]);
    let scale = RIM / outermost.fold(f64::MIN_POSITIVE, f64::max);
    let place = |(vertex, &[radius, azimuth]): (usize, &[f64; 2])| {
        let offset = if opening.is_corner(vertex) {
            let quarter = ((azimuth - FRAC_PI_4) / FRAC_PI_2).round();
            DVec2::from_angle(quarter * FRAC_PI_2 + FRAC_PI_4) * 0.5f64.sqrt()
        } else {
            DVec2::from_angle(azimuth) * radius * scale
        };
        // Images count their rows from the top. The corners' rounding must not leave the square.
        (DVec2::splat(0.5) + offset * DVec2::new(1.0, -1.0)).clamp(DVec2::ZERO, DVec2::ONE)
    };
    polar.iter().enumerate().map(place).collect()
}

fn mean_edge(topology: &Topology, sphere: &[DVec3]) -> f64 {
    let length = |&[a, b]: &[u32; 2]| sphere[a as usize].distance(sphere[b as usize]);
    topology.edges.iter().map(length).sum::<f64>() / topology.edges.len() as f64
}

/// Where the face looks, and what is right and up for its viewer.
#[derive(Debug, Clone, Copy)]
struct Compass {
    face: DVec3,
    right: DVec3,
    up: DVec3,
}

impl Compass {
    fn new(face: DVec3, up: DVec3) -> Self {
        let right = up.cross(face).normalize_or(face.any_orthonormal_vector());
        Self { face, right, up: face.cross(right) }
    }

    fn azimuth(&self, direction: DVec3) -> f64 {
        direction.dot(self.up).atan2(direction.dot(self.right))
    }

    /// Radius and azimuth of a unit direction; the azimuth turns by `twist` on the way to the back.
    fn polar(&self, direction: DVec3, edge: f64, twist: f64) -> [f64; 2] {
        let half = self.face.angle_between(direction) / 2.0;
        let equal_area = half.sin();
        [equal_area + SPREAD * edge * half.tan(), self.azimuth(direction) + twist * equal_area.powi(4)]
    }
}

/// The edge at which the sphere is opened.
struct Opening {
    /// With the face opposite the edge's middle.
    compass: Compass,
    /// By how much the edge's direction has to turn to lie on a diagonal of the square.
    twist: f64,
    corners: [u32; 4],
}

impl Opening {
    /// Of the edges near the antipode of the face, the one that has to turn least.
    fn behind(topology: &Topology, sphere: &[DVec3], compass: Compass) -> Self {
        let middle = |edge: usize| topology.edges[edge].map(|v| sphere[v as usize]).iter().sum::<DVec3>();
        let offset = |edge: usize| middle(edge).normalize_or_zero().distance(-compass.face);
        let offsets: Vec<f64> = (0..topology.edges.len()).map(offset).collect();
        let least = offsets.iter().copied().fold(f64::INFINITY, f64::min);
        let near = least.max(NEAR * mean_edge(topology, sphere));
        let candidates = (0..offsets.len()).filter(|&edge| offsets[edge] <= near);
        let openings = candidates.map(|edge| Self::at(topology, sphere, compass.up, edge));
        openings.min_by(|a, b| a.twist.abs().total_cmp(&b.twist.abs())).expect("one edge is the nearest")
    }

    fn at(topology: &Topology, sphere: &[DVec3], up: DVec3, edge: usize) -> Self {
        let [a, b] = topology.edges[edge];
        let [from, to] = [a, b].map(|v| sphere[v as usize]);
        let compass = Compass::new(-(from + to).normalize_or_zero(), up);
        let azimuth = compass.azimuth(to - from);
        let diagonal = ((azimuth - FRAC_PI_4) / FRAC_PI_2).round() * FRAC_PI_2 + FRAC_PI_4;
        let across = topology.edge_triangles[edge].map(|t| {
            let corners = topology.triangles[t as usize];
            corners.into_iter().find(|&v| v != a && v != b).unwrap_or(a)
        });
        Self { compass, twist: diagonal - azimuth, corners: [a, b, across[0], across[1]] }
    }

    fn is_corner(&self, vertex: usize) -> bool {
        self.corners.contains(&(vertex as u32))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Icosphere;

    /// Twice the areas of the layout's triangles, positive where they look like their originals from outside.
    fn areas(layout: &[DVec2], topology: &Topology) -> Vec<f64> {
        let area = |corners: &[u32; 3]| {
            let [a, b, c] = corners.map(|v| layout[v as usize]);
            // Rows run downwards.
            -(b - a).perp_dot(c - a)
        };
        topology.triangles.iter().map(area).collect()
    }

    fn directions() -> impl Iterator<Item = DVec3> {
        let axes = [DVec3::Z, DVec3::X, DVec3::NEG_Y];
        let spiral = (0..40).map(|k| {
            let (height, turn) = (1.0 - (2.0 * f64::from(k) + 1.0) / 40.0, 2.4 * f64::from(k));
            (DVec2::from_angle(turn) * (1.0 - height * height).sqrt()).extend(height)
        });
        axes.into_iter().chain(spiral)
    }

    #[test]
    fn all_but_two_triangles_lie_side_by_side() {
        for level in 2..=6 {
            let sphere = Icosphere::new(level);
            let topology = Topology::new(sphere.positions.len(), &sphere.triangles);
            for face in directions() {
                let layout = sphere_layout(&topology, &sphere.positions, face, DVec3::Y);
                assert!(layout.iter().all(|uv| uv.min_element() >= 0.0 && uv.max_element() <= 1.0));
                let areas = areas(&layout, &topology);
                let laid: Vec<f64> = areas.iter().copied().filter(|area| *area > 0.0).collect();
                assert_eq!(laid.len(), areas.len() - 2, "level {level}, face {face}");
                // The square holds all of them side by side.
                assert!((laid.iter().sum::<f64>() - 2.0).abs() < 1e-9, "level {level}, face {face}");
            }
        }
    }

    #[test]
    fn the_face_is_in_the_middle_and_upright() {
        let sphere = Icosphere::new(4);
        let topology = Topology::new(sphere.positions.len(), &sphere.triangles);
        let layout = sphere_layout(&topology, &sphere.positions, DVec3::Z, DVec3::Y);
        let nearest = |direction: DVec3| {
            let distance = |v: &usize| sphere.positions[*v].distance(direction);
            layout[(0..layout.len()).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap()]
        };
        assert!(nearest(DVec3::Z).distance(DVec2::splat(0.5)) < 0.06);
        let [forehead, left] = [DVec3::new(0.0, 0.6, 0.8), DVec3::new(0.6, 0.0, 0.8)].map(nearest);
        assert!(forehead.y < 0.45 && (forehead.x - 0.5).abs() < 0.06, "{forehead}");
        assert!(left.x > 0.55 && (left.y - 0.5).abs() < 0.06, "{left}");
    }
}

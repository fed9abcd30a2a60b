//! The visual hull: all of space that every camera sees inside its silhouette.

use std::collections::{HashMap, HashSet};

use glam::{DMat3, DVec3, IVec3, Vec3Swizzles};
use rayon::prelude::*;

use super::silhouette::{Fall, Silhouette};
use crate::mesh::{Topology, TriangleMesh};

/// A cube of space.
#[derive(Debug, Clone, Copy)]
struct Region {
    centre: DVec3,
    half: f64,
}

/// What the silhouettes leave of the region that the cameras share, as cells of a grid.
#[derive(Debug, Clone)]
pub(super) struct Hull {
    /// The middles of the cells that are left.
    pub cells: Vec<DVec3>,
    /// Half of a cell's side.
    pub half: f64,
    /// The share of each silhouette that the hull covers `[V]`.
    pub covered: Vec<f64>,
    /// The share of the hull's cells that fall beside each silhouette `[V]`.
    pub beside: Vec<f64>,
}

impl Hull {
    /// Carves a grid of `cells` cells a side: first a coarse one of the region that all silhouettes point at, then one of
    /// what that left. Cells beside no more than `spared` silhouettes stay. `None` where the silhouettes point nowhere.
    pub fn carve(silhouettes: &[Silhouette], cells: usize, spared: usize) -> Option<Self> {
        let coarse = carved(silhouettes, region(silhouettes)?, cells.min(32), spared);
        let bounds = coarse.bounds();
        let fine = bounds.map(|region| carved(silhouettes, region, cells, spared));
        Some(fine.unwrap_or(coarse).measured(silhouettes))
    }

    /// The mean over the silhouettes of what the hull covers of each.
    pub fn agreement(&self) -> f64 {
        self.covered.iter().sum::<f64>() / self.covered.len().max(1) as f64
    }

    /// The mean of its cells.
    pub fn centre(&self) -> DVec3 {
        self.cells.iter().sum::<DVec3>() / self.cells.len().max(1) as f64
    }

    /// The distance of its farthest cell from a point.
    pub fn radius_about(&self, centre: DVec3) -> f64 {
        self.cells.iter().map(|cell| cell.distance(centre)).fold(0.0, f64::max) + self.half
    }

    /// The radius of the ball as large as it.
    pub fn ball_radius(&self) -> f64 {
        let volume = self.cells.len() as f64 * (2.0 * self.half).powi(3);
        (volume * 0.75 / std::f64::consts::PI).cbrt()
    }

    /// Whether a point lies in a cell that is left.
    pub fn holds(&self, point: DVec3) -> bool {
        self.cells.iter().any(|cell| (*cell - point).abs().max_element() <= self.half)
    }

    /// Its surface: the cells' outer sides, rounded off. `None` where nothing is left.
    pub fn surface(&self) -> Option<TriangleMesh> {
        let low = self.cells.iter().copied().reduce(DVec3::min)?;
        let side = 2.0 * self.half;
        let place = |cell: &DVec3| ((*cell - low) / side).round().as_ivec3();
        let filled: HashSet<IVec3> = self.cells.iter().map(place).collect();
        let (mut corners, mut positions, mut triangles) = (HashMap::new(), Vec::new(), Vec::new());
        for cell in &self.cells {
            let at = place(cell);
            for outward in SIDES.into_iter().filter(|outward| !filled.contains(&(at + *outward))) {
                let [a, b, c, d] = square(outward).map(|corner| {
                    *corners.entry(at + corner).or_insert_with(|| {
                        positions.push(low + (at + corner).as_dvec3() * side - self.half);
                        positions.len() as u32 - 1
                    })
                });
                triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
        let topology = Topology::new(positions.len(), &triangles);
        for _ in 0..ROUNDINGS {
            positions = rounded(&topology, &positions);
        }
        TriangleMesh::new(positions, triangles).ok()
    }

    /// A cube about what is left, a cell wider.
    fn bounds(&self) -> Option<Region> {
        let low = self.cells.iter().copied().reduce(DVec3::min)?;
        let high = self.cells.iter().copied().reduce(DVec3::max)?;
        let half = 0.5 * (high - low).max_element() + 2.0 * self.half;
        Some(Region { centre: 0.5 * (low + high), half })
    }

    /// The same, held against the silhouettes.
    fn measured(self, silhouettes: &[Silhouette]) -> Self {
        let shares = silhouettes.par_iter().map(|silhouette| self.against(silhouette)).collect::<Vec<_>>();
        let (covered, beside) = shares.into_iter().unzip();
        Self { covered, beside, ..self }
    }

    /// The share of a silhouette that is covered, and of the cells beside it.
    fn against(&self, silhouette: &Silhouette) -> (f64, f64) {
        let [width, height] = silhouette.size();
        let mut painted = vec![false; width * height];
        let mut beside = 0;
        for &cell in &self.cells {
            if let Some([[left, top], [right, bottom]]) = silhouette.about(cell, self.half) {
                for y in top..bottom {
                    painted[y * width + left..y * width + right].fill(true);
                }
            }
            beside += usize::from(silhouette.fall(cell, self.half) == Fall::Outside);
        }
        let held = |at: &usize| silhouette.holds(at % width, at / width);
        let covered = (0..width * height).filter(held).filter(|&at| painted[at]).count();
        (covered as f64 / f64::from(silhouette.area().max(1)), beside as f64 / self.cells.len().max(1) as f64)
    }
}

/// How often the corners of the surface move to the middle of their neighbours.
const ROUNDINGS: usize = 3;

/// Outwards from the six sides of a cell.
const SIDES: [IVec3; 6] = [IVec3::X, IVec3::NEG_X, IVec3::Y, IVec3::NEG_Y, IVec3::Z, IVec3::NEG_Z];

/// The corners of a cell's side, each 0 or 1 along every axis, counter-clockwise as seen from outside.
fn square(outward: IVec3) -> [IVec3; 4] {
    let along = outward.abs();
    let (across, up) = (along.zxy(), along.yzx());
    let start = along * outward.max_element().max(0);
    let around = [start, start + across, start + across + up, start + up];
    if outward.max_element() > 0 { around } else { [around[0], around[3], around[2], around[1]] }
}

fn rounded(topology: &Topology, positions: &[DVec3]) -> Vec<DVec3> {
    let at = |i: usize| {
        let ring = topology.neighbours.row(i);
        let sum: DVec3 = ring.iter().map(|&j| positions[j as usize]).sum();
        if ring.is_empty() { positions[i] } else { 0.5 * (positions[i] + sum / ring.len() as f64) }
    };
    (0..positions.len()).map(at).collect()
}

/// What the silhouettes leave of a region.
fn carved(silhouettes: &[Silhouette], region: Region, count: usize, spared: usize) -> Hull {
    let half = region.half / count as f64;
    let place = |i: usize| (2 * i + 1) as f64 * half - region.half;
    let least = silhouettes.len().min(2);
    let left = |cell: DVec3| {
        let (mut seen, mut beside) = (0, 0);
        for silhouette in silhouettes {
            match silhouette.fall(cell, half) {
                Fall::Unseen => {}
                Fall::Inside => seen += 1,
                Fall::Outside => {
                    beside += 1;
                    if beside > spared {
                        return false;
                    }
                }
            }
        }
        seen >= least
    };
    let slab = |z: usize| {
        let row = |y: usize| (0..count).map(move |x| DVec3::new(place(x), place(y), place(z)));
        (0..count).flat_map(row).map(|at| region.centre + at).filter(|cell| left(*cell)).collect::<Vec<_>>()
    };
    let slabs: Vec<Vec<DVec3>> = (0..count).into_par_iter().map(slab).collect();
    Hull { cells: slabs.concat(), half, covered: Vec::new(), beside: Vec::new() }
}

/// The region that the silhouettes point at: about the point nearest to the lines through their middles, with room for
/// the farthest pixel of each. `None` where the lines are parallel or most cameras look away from the point.
fn region(silhouettes: &[Silhouette]) -> Option<Region> {
    let line = |silhouette: &Silhouette| {
        let direction = silhouette.intrinsics.direction(silhouette.middle()).extend(1.0).normalize();
        (silhouette.pose.centre(), silhouette.pose.rotation.transpose() * direction)
    };
    let lines: Vec<(DVec3, DVec3)> = silhouettes.iter().map(line).collect();
    let centre = nearest_to(&lines)?;
    let half = |silhouette: &Silhouette| {
        let seen = silhouette.pose.to_camera(centre);
        (seen.z > 0.0).then(|| {
            let at = silhouette.intrinsics.pixel(seen.truncate() / seen.z);
            silhouette.reach(at) * seen.z / silhouette.intrinsics.focal.abs().min_element()
        })
    };
    let mut halves: Vec<f64> = silhouettes.iter().filter_map(half).collect();
    halves.sort_by(f64::total_cmp);
    let typical = halves.get(halves.len() / 2).copied().filter(|_| 2 * halves.len() > silhouettes.len())?;
    // One silhouette gone astray is not to blow the region up.
    let half = 1.1 * halves.last().copied()?.min(3.0 * typical);
    (half.is_finite() && half > 0.0).then_some(Region { centre, half })
}

/// The point with the least sum of distances from lines, by reweighted least squares.
fn nearest_to(lines: &[(DVec3, DVec3)]) -> Option<DVec3> {
    const ROUNDS: usize = 20;
    let mut point = None::<DVec3>;
    for _ in 0..ROUNDS {
        let (mut matrix, mut wanted) = (DMat3::ZERO, DVec3::ZERO);
        for &(origin, direction) in lines {
            let across = DMat3::IDENTITY - outer(direction);
            let distance = point.map_or(1.0, |point| (across * (point - origin)).length());
            let weight = 1.0 / distance.max(1e-6 * origin.length().max(f64::MIN_POSITIVE));
            matrix += across * weight;
            wanted += across * origin * weight;
        }
        // The axes' spread: nothing where all lines are parallel.
        let spread = matrix.determinant() / (matrix.x_axis.x + matrix.y_axis.y + matrix.z_axis.z).powi(3);
        if !(spread.is_finite() && spread > 1e-9) {
            return None;
        }
        point = Some(matrix.inverse() * wanted);
    }
    point.filter(|point| point.is_finite())
}

fn outer(v: DVec3) -> DMat3 {
    DMat3::from_cols(v * v.x, v * v.y, v * v.z)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_surface_of_some_cells_is_closed_and_faces_outwards() {
        let cells = vec![DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.0)];
        let hull = Hull { cells, half: 0.5, covered: Vec::new(), beside: Vec::new() };
        let surface = hull.surface().unwrap();
        assert_eq!(surface.triangles().len(), 2 * (3 * 6 - 2 * 2));
        assert!(Topology::of(&surface).on_rim.iter().all(|rim| !rim));
        let volume: f64 = (surface.triangles().iter())
            .map(|t| t.map(|i| surface.positions()[i as usize]))
            .map(|[a, b, c]| a.dot(b.cross(c)) / 6.0)
            .sum();
        assert!(volume > 0.1 && volume < 3.0, "{volume}");
    }
}

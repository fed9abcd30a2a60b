use glam::{DVec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};
use rayon::prelude::*;

use super::triangle_pair::{has_area, intersect};

/// Where a surface passes through itself.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct SelfIntersections {
    /// The triangles that meet another, ascending.
    pub triangles: Vec<u32>,
    /// How many pairs of triangles meet.
    pub pairs: usize,
}

/// Finds all triangles `[F, 3]` on positions `[N, 3]` that meet another where they should not.
///
/// Two triangles meet if they have a point in common: apart from the corner that they share, or from the edge, where
/// they share one. Corners in the same place count as one, whatever their number, so that seams are closed. Triangles
/// that share an edge meet if they are folded flat onto each other; triangles with the same corners always do.
/// Triangles without area are left out.
///
/// The answer is exact for the positions as they are given, as long as products of three coordinates neither overflow
/// nor underflow. Time grows with the number of pairs whose boxes overlap, memory with the number of triangles alone.
///
/// # Panics
/// With indices out of range.
pub fn self_intersections(positions: &[DVec3], triangles: &[[u32; 3]]) -> SelfIntersections {
    let surface = Surface::new(positions, triangles);
    let Some(tree) = surface.tree() else {
        return SelfIntersections::default();
    };
    let of_one = |at: usize| {
        let mut partners = 0;
        surface.each_partner(&tree, at, |_| partners += 1);
        partners
    };
    let partners: Vec<usize> =
        (0..surface.members.len()).into_par_iter().with_min_len(256).map(of_one).collect();
    let meets = surface.members.iter().zip(&partners).filter(|&(_, &partners)| partners > 0);
    let mut found: Vec<u32> = meets.map(|(member, _)| member.triangle).collect();
    found.sort_unstable();
    SelfIntersections { triangles: found, pairs: partners.iter().sum::<usize>() / 2 }
}

/// A triangle that has an area.
struct Member {
    triangle: u32,
    corners: [DVec3; 3],
    around: Aabb,
}

struct Surface {
    members: Vec<Member>,
}

impl Surface {
    fn new(positions: &[DVec3], triangles: &[[u32; 3]]) -> Self {
        let member = |(triangle, corners): (usize, &[u32; 3])| {
            let corners = corners.map(|i| positions[i as usize]);
            has_area(corners).then(|| Member { triangle: triangle as u32, corners, around: around(corners) })
        };
        Self { members: triangles.iter().enumerate().filter_map(member).collect() }
    }

    fn tree(&self) -> Option<Bvh2> {
        let boxes: Vec<Aabb> = self.members.iter().map(|member| member.around).collect();
        let order = (0..boxes.len() as u32).collect();
        let build =
            || PlocBuilder::new().build(PlocSearchDistance::Minimum, &boxes, order, SortPrecision::U64, 2);
        (!boxes.is_empty()).then(build)
    }

    /// Names each member that one meets.
    fn each_partner(&self, tree: &Bvh2, at: usize, mut met: impl FnMut(usize)) {
        let one = &self.members[at];
        tree.aabb_traverse(one.around, |tree, node| {
            let node = &tree.nodes[node as usize];
            let first = node.first_index as usize;
            for &other in &tree.primitive_indices[first..first + node.prim_count as usize] {
                let other = other as usize;
                if other != at && intersect(one.corners, self.members[other].corners) {
                    met(other);
                }
            }
            true
        });
    }
}

/// The box around a triangle, rounded outwards to single precision.
fn around(corners: [DVec3; 3]) -> Aabb {
    let [a, b, c] = corners;
    let (min, max) = (a.min(b).min(c), a.max(b).max(c));
    // The nearest f32 may lie inside by half a step; what overflows stays finite, for the tree's sake.
    let least = |x: f64| (x as f32).next_down().max(f32::MIN);
    let most = |x: f64| (x as f32).next_up().min(f32::MAX);
    let down = |p: DVec3| Vec3A::new(least(p.x), least(p.y), least(p.z));
    let up = |p: DVec3| Vec3A::new(most(p.x), most(p.y), most(p.z));
    Aabb::new(down(min), up(max))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Icosphere;
    use crate::numeric::Random;

    /// All pairs, one by one.
    fn by_brute_force(positions: &[DVec3], triangles: &[[u32; 3]]) -> SelfIntersections {
        let corners: Vec<_> = triangles.iter().map(|t| t.map(|i| positions[i as usize])).collect();
        let mut found = SelfIntersections::default();
        let mut meets = vec![false; corners.len()];
        for i in 0..corners.len() {
            for j in 0..i {
                let both = has_area(corners[i]) && has_area(corners[j]);
                if both && intersect(corners[i], corners[j]) {
                    (meets[i], meets[j]) = (true, true);
                    found.pairs += 1;
                }
            }
        }
        found.triangles = (0..corners.len() as u32).filter(|&t| meets[t as usize]).collect();
        found
    }

    #[test]
    fn agrees_with_all_pairs_of_random_meshes() {
        let mut random = Random::new(5);
        for round in 0..20 {
            let mut point = |reach: f64| DVec3::from_array([0; 3].map(|_| reach * random.signed()));
            let mut positions = Vec::new();
            for _ in 0..300 {
                let a = point(1.0);
                positions.extend([a, a + point(0.3), a + point(0.3)]);
            }
            // Every other round on a coarse grid, where triangles lie in one plane and touch exactly.
            if round % 2 == 1 {
                positions.iter_mut().for_each(|p| *p = (*p * 4.0).round());
            }
            let triangles: Vec<[u32; 3]> = (0..300).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
            let found = self_intersections(&positions, &triangles);
            assert!(found.pairs > 0);
            assert_eq!(found, by_brute_force(&positions, &triangles), "round {round}");
        }
    }

    #[test]
    fn a_sphere_is_clean_until_it_is_pushed_through_itself() {
        let Icosphere { mut positions, triangles } = Icosphere::new(3);
        assert_eq!(self_intersections(&positions, &triangles), SelfIntersections::default());
        let top = (0..positions.len()).max_by(|&a, &b| positions[a].y.total_cmp(&positions[b].y)).unwrap();
        positions[top].y = -1.5;
        let found = self_intersections(&positions, &triangles);
        assert!(found.pairs > 4);
        assert_eq!(found, by_brute_force(&positions, &triangles));
    }

    #[test]
    fn seams_are_no_intersections() {
        let Icosphere { positions, triangles } = Icosphere::new(2);
        let split: Vec<DVec3> = triangles.iter().flatten().map(|&i| positions[i as usize]).collect();
        let own: Vec<[u32; 3]> = (0..triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        assert_eq!(self_intersections(&split, &own), SelfIntersections::default());
    }

    #[test]
    fn two_spheres_meet_in_a_ring() {
        let Icosphere { positions, triangles } = Icosphere::new(3);
        let count = positions.len() as u32;
        let far = |offset: f64| {
            let other = positions.iter().map(|&p| p + offset * DVec3::new(1.0, 0.1, 0.03));
            let all: Vec<DVec3> = positions.iter().copied().chain(other).collect();
            let more = triangles.iter().map(|t| t.map(|i| i + count));
            let all_triangles: Vec<[u32; 3]> = triangles.iter().copied().chain(more).collect();
            self_intersections(&all, &all_triangles)
        };
        assert_eq!(far(2.1).pairs, 0);
        assert!(far(1.2).pairs > 20);
    }

    #[test]
    fn what_is_tiny_huge_or_empty_does_not_panic() {
        assert_eq!(self_intersections(&[], &[]), SelfIntersections::default());
        for size in [1e-300, 1e300] {
            let positions = [DVec3::ZERO, DVec3::X * size, DVec3::Y * size];
            self_intersections(&positions, &[[0, 1, 2], [0, 0, 1]]);
        }
    }
}

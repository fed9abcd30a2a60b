use std::collections::{HashMap, HashSet};
use std::ops::Range;

use glam::Vec3A;

use crate::mesh::Topology;

/// Parts this small are not dissected further.
const LEAF: usize = 6;

/// The halves of sets this large are dissected apart, on a thread each.
const APART: usize = 1000;

/// A nested-dissection ordering of a mesh's vertices: two halves that no edge joins, then the separator between them,
/// each half ordered the same way. A Cholesky factor in this order is sparse, and its two halves solve independently.
#[derive(Debug, Clone)]
pub struct Dissection {
    /// The vertex at each place of the order `[N]`.
    pub order: Vec<u32>,
    /// Where the second half begins.
    pub second: usize,
    /// Where the top separator begins.
    pub separator: usize,
}

impl Dissection {
    /// Dissects by planes through rest positions `[N, 3]`: of thirteen directions and three places each, the cut with
    /// the smallest separator.
    pub fn new(topology: &Topology, positions: &[Vec3A]) -> Self {
        Cutter::new(topology, positions).dissect((0..positions.len() as u32).collect())
    }

    /// The two halves and the separator as ranges of the order.
    pub fn parts(&self) -> [Range<usize>; 3] {
        [0..self.second, self.second..self.separator, self.separator..self.order.len()]
    }
}

#[derive(Clone, Copy, PartialEq)]
enum Side {
    Outside,
    First,
    Second,
}

/// A cut of a vertex set across a direction, after the first `half` of its vertices along it.
struct Cut {
    cost: f64,
    direction: Vec3A,
    half: usize,
    separator: HashSet<u32>,
}

struct Cutter<'a> {
    topology: &'a Topology,
    positions: &'a [Vec3A],
    side: Vec<Side>,
}

impl<'a> Cutter<'a> {
    fn new(topology: &'a Topology, positions: &'a [Vec3A]) -> Self {
        Self { topology, positions, side: vec![Side::Outside; positions.len()] }
    }

    /// The order of a set.
    fn dissect(&mut self, set: Vec<u32>) -> Dissection {
        let undivided = |set: Vec<u32>| Dissection { second: set.len(), separator: set.len(), order: set };
        if set.len() <= LEAF {
            return undivided(set);
        }
        let Some(cut) = self.best_cut(&set) else { return undivided(set) };
        let sorted = self.sorted(&set, cut.direction);
        let [first, second] = [&sorted[..cut.half], &sorted[cut.half..]]
            .map(|half| half.iter().copied().filter(|v| !cut.separator.contains(v)).collect::<Vec<_>>());
        if first.is_empty() || second.is_empty() {
            return undivided(set);
        }
        let (topology, positions) = (self.topology, self.positions);
        let (first, second) = if set.len() < APART {
            (self.dissect(first), self.dissect(second))
        } else {
            // Which vertex lies on which side is each half's own.
            rayon::join(|| self.dissect(first), || Cutter::new(topology, positions).dissect(second))
        };
        let mut order = first.order;
        let second_start = order.len();
        order.extend(second.order);
        let separator = order.len();
        let mut curve: Vec<u32> = cut.separator.into_iter().collect();
        curve.sort_unstable();
        order.extend(self.along_longest_direction(curve));
        Dissection { order, second: second_start, separator }
    }

    /// A set by how far its vertices lie along a direction.
    fn sorted(&self, set: &[u32], direction: Vec3A) -> Vec<u32> {
        let key = |&v: &u32| (self.positions[v as usize].dot(direction), v);
        let mut keyed: Vec<(f32, u32)> = set.iter().map(key).collect();
        keyed.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        keyed.into_iter().map(|(_, v)| v).collect()
    }

    fn best_cut(&mut self, set: &[u32]) -> Option<Cut> {
        let mut best: Option<Cut> = None;
        for direction in directions() {
            let sorted = self.sorted(set, direction);
            for fraction in [0.46, 0.5, 0.54] {
                let cut = self.cut(&sorted, direction, (sorted.len() as f64 * fraction) as usize);
                if best.as_ref().is_none_or(|b| cut.cost < b.cost) {
                    best = Some(cut);
                }
            }
        }
        best
    }

    /// Cuts after the first `half` vertices. The separator is the smallest set of vertices that touches every cut edge.
    fn cut(&mut self, sorted: &[u32], direction: Vec3A, half: usize) -> Cut {
        for (i, &v) in sorted.iter().enumerate() {
            self.side[v as usize] = if i < half { Side::First } else { Side::Second };
        }
        let across = |v: u32| {
            let ring = self.topology.neighbours.row(v as usize).iter().copied();
            ring.filter(|&w| self.side[w as usize] == Side::Second)
        };
        let separator = smallest_cover(&sorted[..half], across);
        let of_first = separator.iter().filter(|&&v| self.side[v as usize] == Side::First).count();
        for &v in sorted {
            self.side[v as usize] = Side::Outside;
        }
        let (first, second) = (half - of_first, sorted.len() - half - (separator.len() - of_first));
        let imbalance = (first as f64 - second as f64).abs() / sorted.len() as f64;
        Cut { cost: separator.len() as f64 * (1.0 + imbalance), direction, half, separator }
    }

    /// A separator is a curve: ordered along it, neighbours stay together.
    fn along_longest_direction(&self, mut separator: Vec<u32>) -> Vec<u32> {
        let key = |v: u32, direction: Vec3A| self.positions[v as usize].dot(direction);
        let extent = |direction: &Vec3A| {
            let (low, high) = separator.iter().fold((f32::MAX, f32::MIN), |(low, high), &v| {
                (low.min(key(v, *direction)), high.max(key(v, *direction)))
            });
            high - low
        };
        let all = directions();
        let longest = all.iter().copied().max_by(|a, b| extent(a).total_cmp(&extent(b)));
        if let Some(direction) = longest {
            separator.sort_by(|&a, &b| key(a, direction).total_cmp(&key(b, direction)).then(a.cmp(&b)));
        }
        separator
    }
}

/// The axes, the face diagonals and the space diagonals of a cube.
fn directions() -> Vec<Vec3A> {
    let mut directions = Vec::with_capacity(13);
    for x in -1..=1 {
        for y in -1..=1 {
            for z in -1..=1 {
                if (x, y, z) > (0, 0, 0) {
                    directions.push(Vec3A::new(x as f32, y as f32, z as f32).normalize());
                }
            }
        }
    }
    directions
}

/// The smallest vertex cover of a bipartite graph, from a maximum matching (Koenig's theorem).
fn smallest_cover<I: Iterator<Item = u32>>(left: &[u32], across: impl Fn(u32) -> I) -> HashSet<u32> {
    let left: Vec<u32> = left.iter().copied().filter(|&v| across(v).next().is_some()).collect();
    let mut partner_of_right: HashMap<u32, u32> = HashMap::new();
    let mut matched_left: HashSet<u32> = HashSet::new();
    for &v in &left {
        if augment(v, &across, &mut partner_of_right, &mut HashSet::new()) {
            matched_left.insert(v);
        }
    }
    let mut reached_left: HashSet<u32> = HashSet::new();
    let mut reached_right: HashSet<u32> = HashSet::new();
    let mut stack: Vec<u32> = left.iter().copied().filter(|v| !matched_left.contains(v)).collect();
    while let Some(v) = stack.pop() {
        if reached_left.insert(v) {
            for w in across(v) {
                if reached_right.insert(w) {
                    stack.extend(partner_of_right.get(&w));
                }
            }
        }
    }
    left.into_iter().filter(|v| !reached_left.contains(v)).chain(reached_right).collect()
}

/// Tries to match `v`, moving earlier matches along an alternating path.
fn augment<I: Iterator<Item = u32>>(
    v: u32,
    across: &impl Fn(u32) -> I,
    partner_of_right: &mut HashMap<u32, u32>,
    seen: &mut HashSet<u32>,
) -> bool {
    for w in across(v) {
        if seen.insert(w) {
            let free = match partner_of_right.get(&w) {
                None => true,
                Some(&other) => augment(other, across, partner_of_right, seen),
            };
            if free {
                partner_of_right.insert(w, v);
                return true;
            }
        }
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Icosphere;

    #[test]
    fn is_an_ordering_whose_halves_do_not_touch() {
        let sphere = Icosphere::new(3);
        let topology = Topology::new(sphere.positions.len(), &sphere.triangles);
        let positions: Vec<Vec3A> = sphere.positions.iter().map(|p| p.as_vec3a()).collect();
        let dissection = Dissection::new(&topology, &positions);
        let mut sorted = dissection.order.clone();
        sorted.sort_unstable();
        assert!(sorted.iter().enumerate().all(|(i, &v)| i == v as usize));
        let [first, second, separator] = dissection.parts();
        assert!(first.len() > 250 && second.len() > 250 && separator.len() < 50);
        let half: HashSet<u32> = dissection.order[first].iter().copied().collect();
        for &v in &dissection.order[second] {
            assert!(topology.neighbours.row(v as usize).iter().all(|w| !half.contains(w)));
        }
    }
}

use super::Topology;

/// Where a surface ends: the sides and corners of its triangles that lie on a boundary.
#[derive(Debug, Clone)]
pub struct Rim {
    /// Which sides of each triangle (opposite its first, second, third corner) are on it.
    sides: Vec<[bool; 3]>,
    /// Which corners are.
    corners: Vec<[bool; 3]>,
}

/// A barycentric weight below which a point lies on the opposite side.
const ON_SIDE: f32 = 1e-6;

impl Rim {
    /// The rim of a surface; a closed one has none.
    pub fn of(topology: &Topology) -> Self {
        let mut sides = vec![[false; 3]; topology.triangles.len()];
        for ([a, b], triangle) in topology.rim_edges() {
            let t = triangle as usize;
            for (side, corner) in sides[t].iter_mut().zip(topology.triangles[t]) {
                *side |= corner != a && corner != b;
            }
        }
        let corners = topology.triangles.iter().map(|t| t.map(|i| topology.on_rim[i as usize])).collect();
        Self { sides, corners }
    }

    /// Whether the point of these barycentric weights on a triangle lies on it.
    pub fn contains(&self, triangle: u32, weights: [f32; 3]) -> bool {
        let t = triangle as usize;
        (0..3).any(|k| {
            (weights[k] <= ON_SIDE && self.sides[t][k]) || (weights[k] >= 1.0 - ON_SIDE && self.corners[t][k])
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rim_of_two_triangles_is_all_but_their_common_side() {
        let rim = Rim::of(&Topology::new(4, &[[0, 1, 2], [2, 1, 3]]));
        assert!(!rim.contains(0, [0.0, 0.5, 0.5]), "the common side");
        assert!(rim.contains(0, [0.5, 0.0, 0.5]) && rim.contains(0, [0.5, 0.5, 0.0]));
        assert!(rim.contains(0, [0.0, 1.0, 0.0]), "its ends");
        assert!(!rim.contains(1, [0.3, 0.3, 0.4]));
        let closed = Rim::of(&Topology::new(4, &[[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]]));
        assert!(!closed.contains(0, [1.0, 0.0, 0.0]) && !closed.contains(3, [0.0, 0.5, 0.5]));
    }
}

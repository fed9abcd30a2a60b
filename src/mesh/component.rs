/// The component of each vertex `[N]`, called by its first vertex: what the edges of triangles join is one. A vertex
/// without a triangle is one by itself.
pub fn components(vertices: usize, triangles: &[[u32; 3]]) -> Vec<u32> {
    let mut parent: Vec<u32> = (0..vertices as u32).collect();
    for &[a, b, c] in triangles {
        for other in [b, c] {
            let (one, other) = (root(&mut parent, a), root(&mut parent, other));
            parent[one.max(other) as usize] = one.min(other);
        }
    }
    for vertex in 0..vertices as u32 {
        parent[vertex as usize] = root(&mut parent, vertex);
    }
    parent
}

/// The first vertex of a component, paths to it halved on the way.
fn root(parent: &mut [u32], mut vertex: u32) -> u32 {
    while parent[vertex as usize] != vertex {
        let above = parent[parent[vertex as usize] as usize];
        parent[vertex as usize] = above;
        vertex = above;
    }
    vertex
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_triangles_join_is_called_by_its_first_vertex() {
        let triangles = [[6, 2, 5], [1, 3, 7], [5, 6, 8]];
        assert_eq!(components(9, &triangles), [0, 1, 2, 1, 4, 2, 2, 1, 2]);
    }
}

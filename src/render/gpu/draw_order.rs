use crate::mesh::Rows;

/// Vertices as they are drawn. What a pixel sees is told by its triangle's first corner, so each triangle begins with one of
/// its own, whose place is the triangle's number; the other corners are taken from those that triangles nearby begin with.
/// A driver that keeps the vertices it has just placed then places half as many again as there are triangles at most, and
/// not three for each.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DrawOrder {
    /// The vertex of each place; after those that triangles begin with, those that none begins with.
    pub vertices: Vec<u32>,
    /// The corners of each triangle, by their places `[F, 3]`.
    pub corners: Vec<[u32; 3]>,
}

impl DrawOrder {
    /// Of triangles `[F, 3]` on so many vertices; they keep their direction.
    pub fn new(vertices: usize, triangles: &[[u32; 3]]) -> Self {
        let turned = turned(vertices, triangles);
        let places = Rows::from_pairs(vertices, turned.iter().map(|corners| corners[0]).zip(0u32..));
        let mut drawn: Vec<u32> = turned.iter().map(|corners| corners[0]).collect();
        let mut alone = vec![None; vertices];
        let mut place = |vertex: u32, triangle: u32| {
            let row = places.row(vertex as usize);
            // It ascends: one that many triangles begin with is not looked through for each of them.
            let after = row.partition_point(|&place| place < triangle);
            let beside = &row[after.saturating_sub(1)..row.len().min(after + 1)];
            let nearest = beside.iter().min_by_key(|place| place.abs_diff(triangle));
            nearest.copied().unwrap_or_else(|| {
                *alone[vertex as usize].get_or_insert_with(|| {
                    drawn.push(vertex);
                    drawn.len() as u32 - 1
                })
            })
        };
        let corners = (turned.iter().zip(0..))
            .map(|(&[_, b, c], triangle)| [triangle, place(b, triangle), place(c, triangle)])
            .collect();
        Self { vertices: drawn, corners }
    }
}

/// Triangles turned so that as many vertices as may be begin one.
fn turned(vertices: usize, triangles: &[[u32; 3]]) -> Vec<[u32; 3]> {
    let mut begins = vec![false; vertices];
    let turned = |corners: &[u32; 3]| {
        let mut corners = *corners;
        let first = corners.iter().position(|&corner| !begins[corner as usize]).unwrap_or(0);
        corners.rotate_left(first);
        begins[corners[0] as usize] = true;
        corners
    };
    triangles.iter().map(turned).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Icosphere;

    #[test]
    fn each_triangle_begins_with_a_place_of_its_own() {
        let Icosphere { positions, triangles } = Icosphere::new(3);
        let order = DrawOrder::new(positions.len(), &triangles);
        assert!(order.vertices.len() < triangles.len() + positions.len() / 10);
        for (number, (corners, triangle)) in order.corners.iter().zip(&triangles).enumerate() {
            assert_eq!(corners[0], number as u32);
            let mut of_places = corners.map(|place| order.vertices[place as usize]);
            let first = triangle.iter().position(|&corner| corner == of_places[0]).unwrap();
            of_places.rotate_right(first);
            assert_eq!(of_places, *triangle);
        }
    }
}

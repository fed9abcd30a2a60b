use glam::DVec3;

/// What a reader finds, before it is checked to be a mesh. Colours and texture coordinates will be optional fields here.
#[derive(Debug, Default)]
pub(super) struct Geometry {
    /// `[N, 3]`
    pub positions: Vec<DVec3>,
    /// `[F, 3]`
    pub triangles: Vec<[u32; 3]>,
}

/// Cuts a polygon into the triangles that its first corner makes with each of its edges.
#[derive(Default)]
pub(super) struct Fan {
    first: Option<u32>,
    previous: Option<u32>,
}

impl Fan {
    /// Takes the polygon's next corner; from the third on, each closes a triangle.
    pub fn corner(&mut self, index: u32) -> Option<[u32; 3]> {
        let Some(first) = self.first else {
            self.first = Some(index);
            return None;
        };
        let previous = self.previous.replace(index)?;
        Some([first, previous, index])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_polygon_of_n_corners_has_n_minus_2_triangles() {
        let mut fan = Fan::default();
        let triangles: Vec<_> = [4, 5, 6, 7, 8].into_iter().filter_map(|i| fan.corner(i)).collect();
        assert_eq!(triangles, [[4, 5, 6], [4, 6, 7], [4, 7, 8]]);
    }
}

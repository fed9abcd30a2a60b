/// The polygons of a mesh file as they stand in it: vertex indices, polygon after polygon.
///
/// Each has three corners or more. A polygon is cut into the triangles that its first corner makes with each edge that
/// does not touch it; polygon after polygon these are the triangles of the mesh.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Polygons {
    corners: Vec<u32>,
    ends: Vec<usize>,
}

impl Polygons {
    pub(super) fn with_capacity(polygons: usize) -> Self {
        Self { corners: Vec::with_capacity(3 * polygons), ends: Vec::with_capacity(polygons) }
    }

    /// Triangles `[F, 3]` as polygons.
    pub fn of_triangles(triangles: &[[u32; 3]]) -> Self {
        let mut polygons = Self::with_capacity(triangles.len());
        triangles.iter().for_each(|&corners| polygons.push_triangle(corners));
        polygons
    }

    /// The number of polygons P.
    pub fn len(&self) -> usize {
        self.ends.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.ends.is_empty()
    }

    /// The vertex indices of all polygons, one after the other `[C]`.
    pub fn corners(&self) -> &[u32] {
        &self.corners
    }

    /// Where each polygon ends in [`corners`](Self::corners) `[P]`; it begins where the one before ends.
    pub fn ends(&self) -> &[usize] {
        &self.ends
    }

    /// The vertex indices of each polygon.
    pub fn iter(&self) -> impl Iterator<Item = &[u32]> {
        self.ranges().map(|range| &self.corners[range])
    }

    /// For each triangle of the mesh, which of the `[C]` corners its own three are.
    pub fn triangle_corners(&self) -> impl Iterator<Item = [usize; 3]> {
        self.ranges().flat_map(|range| (range.start + 2..range.end).map(move |c| [range.start, c - 1, c]))
    }

    /// The triangles that the polygons are cut into `[F, 3]`.
    pub(super) fn triangles(&self) -> Vec<[u32; 3]> {
        let mut triangles = Vec::with_capacity(self.corners.len() - 2 * self.len());
        triangles.extend(self.triangle_corners().map(|corners| corners.map(|c| self.corners[c])));
        triangles
    }

    /// Adds a corner to the polygon that is being read.
    pub(super) fn corner(&mut self, index: u32) {
        self.corners.push(index);
    }

    /// Ends the polygon that is being read. One of fewer than three corners is left out, which `false` tells.
    pub(super) fn close(&mut self) -> bool {
        let start = self.closed();
        if self.corners.len() - start < 3 {
            self.corners.truncate(start);
            return false;
        }
        self.ends.push(self.corners.len());
        true
    }

    /// Corners of the polygons that are closed.
    pub(super) fn closed(&self) -> usize {
        self.ends.last().copied().unwrap_or(0)
    }

    pub(super) fn push_triangle(&mut self, corners: [u32; 3]) {
        self.corners.extend(corners);
        self.ends.push(self.corners.len());
    }

    fn ranges(&self) -> impl Iterator<Item = std::ops::Range<usize>> {
        self.ends.iter().scan(0, |start, &end| Some(std::mem::replace(start, end)..end))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_polygon_of_n_corners_has_n_minus_2_triangles() {
        let mut polygons = Polygons::default();
        let mut add = |corners: &[u32]| {
            corners.iter().for_each(|&index| polygons.corner(index));
            polygons.close()
        };
        assert!(add(&[4, 5, 6, 7, 8]));
        assert!(!add(&[1, 2]) && !add(&[]));
        assert!(add(&[3, 2, 1]));
        assert_eq!(polygons.triangles(), [[4, 5, 6], [4, 6, 7], [4, 7, 8], [3, 2, 1]]);
        assert_eq!(polygons.iter().map(<[u32]>::len).collect::<Vec<_>>(), [5, 3]);
        assert_eq!(polygons.triangle_corners().last(), Some([5, 6, 7]));
        assert_eq!(polygons.ends(), [5, 8]);
    }
}

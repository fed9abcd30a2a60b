use std::ops::Range;

/// The polygons of a mesh file as they stand in it: vertex indices, polygon after polygon.
///
/// Each has three corners or more. A polygon is cut into the triangles that its first corner makes with each edge that
/// does not touch it; polygon after polygon these are the triangles of the mesh.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Polygons {
    corners: Vec<u32>,
    /// How many corners belong to polygons that have ended.
    closed: usize,
    /// Where each polygon ends; empty as long as all are triangles.
    ends: Vec<usize>,
}

impl Polygons {
    pub(super) fn with_capacity(polygons: usize) -> Self {
        Self { corners: Vec::with_capacity(3 * polygons), ..Self::default() }
    }

    /// Triangles `[F, 3]` as polygons.
    pub fn of_triangles(triangles: &[[u32; 3]]) -> Self {
        let mut polygons = Self::with_capacity(triangles.len());
        triangles.iter().for_each(|&corners| polygons.push_triangle(corners));
        polygons
    }

    /// The number of polygons P.
    pub fn len(&self) -> usize {
        if self.all_triangles() { self.closed / 3 } else { self.ends.len() }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The vertex indices of all polygons, one after the other `[C]`.
    pub fn corners(&self) -> &[u32] {
        &self.corners
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

    /// The same, and the polygons where they are not the triangles themselves.
    pub(super) fn into_triangles(self) -> (Vec<[u32; 3]>, Option<Self>) {
        if !self.all_triangles() {
            return (self.triangles(), Some(self));
        }
        // Without a copy where the memory's size allows it.
        let copied = |(_, corners): (_, Vec<u32>)| corners.as_chunks::<3>().0.to_vec();
        (bytemuck::try_cast_vec(self.corners).unwrap_or_else(copied), None)
    }

    fn all_triangles(&self) -> bool {
        self.ends.is_empty()
    }

    /// Adds a corner to the polygon that is being read.
    pub(super) fn corner(&mut self, index: u32) {
        self.corners.push(index);
    }

    /// Ends the polygon that is being read. One of fewer than three corners is left out, which `false` tells.
    pub(super) fn close(&mut self) -> bool {
        let corners = self.corners.len() - self.closed;
        if corners < 3 {
            self.corners.truncate(self.closed);
            return false;
        }
        if self.all_triangles() && corners > 3 {
            self.ends.extend((3..=self.closed).step_by(3));
        }
        if !self.all_triangles() || corners > 3 {
            self.ends.push(self.corners.len());
        }
        self.closed = self.corners.len();
        true
    }

    /// Corners of the polygons that are closed.
    pub(super) fn closed(&self) -> usize {
        self.closed
    }

    pub(super) fn push_triangle(&mut self, corners: [u32; 3]) {
        self.corners.extend(corners);
        self.close();
    }

    fn ranges(&self) -> impl Iterator<Item = Range<usize>> {
        let triangles = if self.all_triangles() { self.closed } else { 0 };
        (0..triangles)
            .step_by(3)
            .map(|start| start..start + 3)
            .chain(self.ends.iter().scan(0, |start, &end| Some(std::mem::replace(start, end)..end)))
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
        assert_eq!(polygons.clone().into_triangles(), (polygons.triangles(), Some(polygons)));
    }

    #[test]
    fn triangles_are_taken_over_as_they_are() {
        let mut polygons = Polygons::with_capacity(2);
        polygons.push_triangle([0, 1, 2]);
        [2, 1, 3].into_iter().for_each(|index| polygons.corner(index));
        assert!(polygons.close());
        polygons.corner(9);
        assert!(!polygons.close());
        assert_eq!((polygons.len(), polygons.triangle_corners().last()), (2, Some([3, 4, 5])));
        assert_eq!(polygons.into_triangles(), (vec![[0, 1, 2], [2, 1, 3]], None));
        let mut mixed = Polygons::of_triangles(&[[0, 1, 2]]);
        (0..4).for_each(|index| mixed.corner(index));
        assert!(mixed.close());
        assert_eq!(mixed.iter().map(<[u32]>::len).collect::<Vec<_>>(), [3, 4]);
    }
}

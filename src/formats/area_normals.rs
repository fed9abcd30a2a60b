use glam::DVec3;

/// Normals that several corners of triangles may share: the sum of the area vectors of their triangles.
pub(super) struct AreaNormals<'a> {
    positions: &'a [DVec3],
    sums: Vec<DVec3>,
}

impl<'a> AreaNormals<'a> {
    /// So many normals, of triangles on positions `[N, 3]`.
    pub fn new(positions: &'a [DVec3], count: usize) -> Self {
        Self { positions, sums: vec![DVec3::ZERO; count] }
    }

    /// Adds a triangle to the normals that its corners have.
    pub fn add(&mut self, corners: [u32; 3], normals: [Option<usize>; 3]) {
        let [a, b, c] = corners.map(|corner| self.positions[corner as usize]);
        let area = (b - a).cross(c - a);
        for normal in normals.into_iter().flatten() {
            self.sums[normal] += area;
        }
    }

    /// The unit normals; `None` of one that no triangle with an area has.
    pub fn finish(self) -> Vec<Option<DVec3>> {
        self.sums.into_iter().map(DVec3::try_normalize).collect()
    }
}

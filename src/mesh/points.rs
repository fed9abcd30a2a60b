use glam::{DVec3, Vec3};

/// Positions `[N, 3]`, in whatever precision they are kept.
pub trait Points: Sync {
    /// How many there are.
    fn count(&self) -> usize;

    /// One of them.
    fn at(&self, index: usize) -> DVec3;

    /// All of them in turn.
    fn each(&self) -> impl Iterator<Item = DVec3> {
        (0..self.count()).map(|index| self.at(index))
    }
}

impl Points for Vec<DVec3> {
    fn count(&self) -> usize {
        self.len()
    }

    fn at(&self, index: usize) -> DVec3 {
        self[index]
    }
}

/// Positions as a file has them: in single precision, half as large, for as long as that says the same.
#[derive(Debug, Clone, PartialEq)]
pub enum FilePoints {
    /// Every coordinate is one of single precision.
    Single(Vec<Vec3>),
    /// Some are not.
    Double(Vec<DVec3>),
}

impl FilePoints {
    /// None yet, with room for so many.
    pub fn with_capacity(count: usize) -> Self {
        Self::Single(Vec::with_capacity(count))
    }

    /// Adds one.
    pub fn push(&mut self, point: DVec3) {
        match self {
            Self::Single(points) if point.as_vec3().as_dvec3() == point => points.push(point.as_vec3()),
            Self::Single(points) => {
                let mut wide = Vec::with_capacity(points.capacity());
                wide.extend(points.iter().map(|point| point.as_dvec3()));
                wide.push(point);
                *self = Self::Double(wide);
            }
            Self::Double(points) => points.push(point),
        }
    }
}

impl Default for FilePoints {
    fn default() -> Self {
        Self::Single(Vec::new())
    }
}

impl Points for FilePoints {
    fn count(&self) -> usize {
        match self {
            Self::Single(points) => points.len(),
            Self::Double(points) => points.len(),
        }
    }

    fn at(&self, index: usize) -> DVec3 {
        match self {
            Self::Single(points) => points[index].as_dvec3(),
            Self::Double(points) => points[index],
        }
    }
}

impl Extend<DVec3> for FilePoints {
    fn extend<I: IntoIterator<Item = DVec3>>(&mut self, points: I) {
        points.into_iter().for_each(|point| self.push(point));
    }
}

impl FromIterator<DVec3> for FilePoints {
    fn from_iter<I: IntoIterator<Item = DVec3>>(points: I) -> Self {
        let mut all = Self::default();
        all.extend(points);
        all
    }
}

impl From<FilePoints> for Vec<DVec3> {
    fn from(points: FilePoints) -> Self {
        match points {
            FilePoints::Single(points) => points.into_iter().map(|point| point.as_dvec3()).collect(),
            FilePoints::Double(points) => points,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_single_precision_does_not_hold_widens_all() {
        let single = [DVec3::new(0.5, -0.0, f64::from(1e30f32)), DVec3::splat(f64::from(0.1f32))];
        let all: FilePoints = single.into_iter().collect();
        assert!(matches!(all, FilePoints::Single(_)));
        for double in [DVec3::splat(0.1), DVec3::splat(1e300), DVec3::splat(1e-60)] {
            let mut wide = all.clone();
            wide.extend([double, single[0]]);
            assert!(matches!(wide, FilePoints::Double(_)));
            assert_eq!(wide.each().collect::<Vec<_>>(), [single[0], single[1], double, single[0]]);
            assert_eq!(wide.each().collect::<Vec<_>>(), Vec::from(wide));
        }
        assert!(all.at(0).y.is_sign_negative());
        assert_eq!(all.each().collect::<Vec<_>>(), Vec::from(all));
    }
}

use glam::DVec3;

use super::skull::Skull;
use super::tessellation::icosphere;

/// The way back from the skull to the anatomical sphere.
#[derive(Debug)]
pub(super) struct Chart<'a> {
    skull: &'a Skull,
    /// Directions all over the sphere and their points, to start from.
    starts: Vec<(DVec3, DVec3)>,
}

impl<'a> Chart<'a> {
    pub fn new(skull: &'a Skull) -> Self {
        let starts =
            icosphere(24).0.into_iter().map(|direction| (direction, skull.point(direction))).collect();
        Self { skull, starts }
    }

    /// The direction of the skull's point nearest to `point`.
    pub fn nearest(&self, point: DVec3) -> DVec3 {
        self.least(|skull| skull.distance_squared(point))
    }

    /// The direction of the point of the skull's front at `x` and `y`.
    pub fn front(&self, x: f64, y: f64) -> DVec3 {
        let behind = |skull: DVec3| (1.0 - skull.z).max(0.0);
        self.least(|skull| (skull.x - x).powi(2) + (skull.y - y).powi(2) + behind(skull).powi(2))
    }

    /// The direction of least `cost`, by ever smaller steps.
    fn least(&self, cost: impl Fn(DVec3) -> f64) -> DVec3 {
        let costs = self.starts.iter().map(|&(direction, point)| (cost(point), direction));
        let (mut least, mut here) = costs.min_by(|a, b| a.0.total_cmp(&b.0)).expect("the sphere has points");
        let mut step = 0.05;
        while step > 1e-10 {
            let aside = here.any_orthonormal_vector();
            let sides = [aside, -aside, here.cross(aside), -here.cross(aside)];
            let tries = sides.map(|side| (here + step * side).normalize());
            let (cost, best) = tries
                .map(|direction| (cost(self.skull.point(direction)), direction))
                .into_iter()
                .min_by(|a, b| a.0.total_cmp(&b.0))
                .expect("four tries");
            if cost < least {
                (least, here) = (cost, best);
            } else {
                step /= 2.0;
            }
        }
        here
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_its_way_back() {
        let skull = Skull::new();
        let chart = Chart::new(&skull);
        let direction = DVec3::new(0.3, -0.2, 0.8).normalize();
        let point = skull.point(direction);
        assert!(skull.point(chart.nearest(point)).distance(point) < 1e-6);
        assert!(skull.point(chart.front(point.x, point.y)).distance(point) < 1e-6);
    }
}

use glam::{DQuat, DVec3};

use super::tessellation::{Surface, tessellate};
use super::{Anatomy, Place, ear, mouth};

/// Directions of points spread evenly over the mean face and ears, a few thousand.
pub(super) fn directions(anatomy: &Anatomy) -> Vec<DVec3> {
    let skin = tessellate(&Skin(anatomy), DQuat::from_rotation_x(0.3));
    skin.directions.into_iter().filter(|&direction| covers(anatomy.place(direction))).collect()
}

/// The mean head, fine where there is truth.
struct Skin<'a>(&'a Anatomy);

impl Surface for Skin<'_> {
    fn point(&self, direction: DVec3) -> DVec3 {
        self.0.place(direction).mean
    }

    fn spacing(&self, direction: DVec3) -> f64 {
        if covers(self.0.place(direction)) { 0.45 } else { 1.2 }
    }
}

/// Whether a place is on the visible face or on an ear.
fn covers(Place { skull, .. }: Place) -> bool {
    let left = DVec3::new(skull.x.abs(), skull.y, skull.z);
    let ear = ear::patch(left).0 < 0.9 && left.x > 1.0;
    let face = skull.z > 2.5 && skull.y > -10.6 && skull.y < 6.0;
    ear || (face && !mouth::hides(skull))
}

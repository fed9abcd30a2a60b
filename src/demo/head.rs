use glam::DVec3;

use super::{Anatomy, Expression, Identity};

/// Somebody's head, as a smooth map from the unit directions of the anatomical sphere.
#[derive(Debug, Clone)]
pub struct Head<'a> {
    /// What all heads share.
    pub anatomy: &'a Anatomy,
    /// Who it is.
    pub identity: Identity,
    /// What the face does.
    pub expression: Expression,
}

impl Head<'_> {
    /// The head's point in a unit `direction`, in centimetres.
    pub fn point(&self, direction: DVec3) -> DVec3 {
        let place = self.anatomy.place(direction);
        place.mean + self.identity.displacement(place.mean) + self.expression.displacement(place)
    }
}

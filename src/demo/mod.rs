//! A collection to try everything on: synthetic heads, each triangulated its own way, with landmarks and dense truth.
//!
//! Layer 2: imports `mesh` alone. Every head is one smooth map from the directions of a sphere, so the same direction is
//! the same anatomical place on every head: landmarks and truth are exact by construction. All lengths are in
//! centimetres, +Y is up, +Z is where the face looks, and +X is the head's own left.

mod anatomy;
mod brush;
mod chart;
mod clay;
mod ear;
mod expression;
mod eye;
mod figure;
mod head;
mod identity;
mod landmarks;
mod mouth;
mod nose;
mod pose;
mod random;
mod sculptor;
mod skull;
mod spacing;
mod spline;
mod surface_net;
mod tessellation;
mod truth;

#[cfg(test)]
mod tests;

pub use anatomy::{Anatomy, Place};
pub use expression::Expression;
pub use figure::Figure;
pub use head::Head;
pub use identity::{Identity, PARAMETERS, Parameter};
pub use pose::Pose;
pub use random::Random;
pub use sculptor::{SculptedHead, Sculptor, Settings};

use glam::DVec3;
use rayon::prelude::*;

use super::clay::Clay;
use super::spacing::Spacing;
use super::tessellation::tessellate;
use super::{Anatomy, Expression, Head, Identity, Pose, Random, landmarks, truth};
use crate::mesh::{LandmarkSet, TriangleMesh};

/// Makes collections of heads. The same seed and settings make the same heads, byte for byte.
#[derive(Debug, Clone)]
pub struct Sculptor {
    seed: u64,
    anatomy: Anatomy,
    settings: Settings,
    landmarks: Vec<DVec3>,
    truth: Vec<DVec3>,
}

/// How the heads are made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// About how many triangles a head has; each head has its own number, up to a third more or fewer.
    pub triangles: usize,
    /// Whether the neck is cut open at its end, or rounded off.
    pub open_neck: bool,
    /// Whether heads are a little turned and moved, or all upright at the origin.
    pub posed: bool,
    /// Whether faces smile and open their mouths, or are all neutral.
    pub expressive: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Self { triangles: 30_000, open_neck: true, posed: true, expressive: true }
    }
}

/// A head with what is known about it. Lengths are in centimetres.
#[derive(Debug, Clone, PartialEq)]
pub struct SculptedHead {
    /// Its name, unique in its collection.
    pub name: String,
    /// Its surface, triangulated like no other head's.
    pub mesh: TriangleMesh,
    /// The 68 landmarks of the iBUG and Multi-PIE layout, named "0" to "67".
    pub landmarks: LandmarkSet,
    /// Positions of the same anatomical points on every head `[P, 3]`, over face and ears.
    pub truth: Vec<DVec3>,
    /// Where the head was put.
    pub pose: Pose,
}

/// Where on the anatomical sphere, from the crown (0) to the end (1), the neck is cut open.
const CUT: f64 = 0.91;

impl Sculptor {
    /// The sculptor of a seed, with the usual settings.
    pub fn new(seed: u64) -> Self {
        let anatomy = Anatomy::default();
        let (landmarks, truth) = (landmarks::directions(anatomy.skull()), truth::directions(&anatomy));
        Self { seed, anatomy, settings: Settings::default(), landmarks, truth }
    }

    /// The same with other settings.
    pub fn with(self, settings: Settings) -> Self {
        Self { settings, ..self }
    }

    /// The landmarks `[68, 3]` alone of `count` upright heads, as those of [`Sculptor::collection`] in their scheme and
    /// strengths; quick, since nothing is triangulated.
    ///
    /// # Panics
    /// If there are no strengths.
    pub fn landmarks_of_heads(seed: u64, count: usize, strengths: &[f64]) -> Vec<Vec<DVec3>> {
        let anatomy = Anatomy::default();
        let directions = landmarks::directions(anatomy.skull());
        let head = |index: usize| {
            let mut random = Random::part(seed, index as u64);
            let identity = Identity::random(&mut random, strengths[index % strengths.len()]);
            let expression = Expression::random(&mut random);
            let head = Head { anatomy: &anatomy, identity, expression };
            directions.iter().map(|&direction| head.point(direction)).collect()
        };
        (0..count).into_par_iter().map(head).collect()
    }

    /// What all its heads share.
    pub fn anatomy(&self) -> &Anatomy {
        &self.anatomy
    }

    /// Directions of the truth's points on the anatomical sphere `[P, 3]`.
    pub fn truth_directions(&self) -> &[DVec3] {
        &self.truth
    }

    /// `count` heads, the i-th with the i-th of `strengths`, over and over: 0 makes the mean head, 1 natural heads, 3
    /// caricatures.
    ///
    /// # Panics
    /// If there are no strengths.
    pub fn collection(&self, count: usize, strengths: &[f64]) -> Vec<SculptedHead> {
        (0..count).into_par_iter().map(|index| self.head(index, strengths[index % strengths.len()])).collect()
    }

    /// The `index`-th head of the sculptor's collections.
    pub fn head(&self, index: usize, strength: f64) -> SculptedHead {
        let mut random = Random::part(self.seed, index as u64);
        let identity = Identity::random(&mut random, strength);
        let neutral = Expression::default();
        let expression = if self.settings.expressive { Expression::random(&mut random) } else { neutral };
        let pose = if self.settings.posed { Pose::random(&mut random) } else { Pose::UPRIGHT };
        let head = Head { anatomy: &self.anatomy, identity, expression };
        let name = format!("head-{index:02}");
        self.sculpt(name, &head, pose, &mut random)
    }

    /// One head, triangulated as chance has it.
    pub fn sculpt(&self, name: String, head: &Head, pose: Pose, random: &mut Random) -> SculptedHead {
        let triangles = self.settings.triangles as f64 * random.between(0.75, 1.3);
        let clay = Clay { head, spacing: Spacing::random(random) }.with_triangles(triangles);
        let mut tessellation = tessellate(&clay, random.turn(std::f64::consts::PI));
        if self.settings.open_neck {
            tessellation.cut(&clay, CUT * std::f64::consts::PI);
        }
        let placed = |direction: &DVec3| pose.applied(head.point(*direction));
        let positions = tessellation.positions.iter().map(|&p| pose.applied(p)).collect();
        SculptedHead {
            name,
            mesh: TriangleMesh::new(positions, tessellation.triangles).expect("a head is a mesh"),
            landmarks: LandmarkSet {
                scheme: Some("multipie68".into()),
                names: (0..self.landmarks.len()).map(|index| index.to_string()).collect(),
                points: self.landmarks.iter().map(|direction| Some(placed(direction))).collect(),
            },
            truth: self.truth.iter().map(placed).collect(),
            pose,
        }
    }
}

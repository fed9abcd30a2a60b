use glam::DVec3;

use crate::numeric::Similarity;

/// Positions of landmarks in a shared order; a missing one is `None`.
pub(super) type Points = Vec<Option<DVec3>>;

/// Rounds of a robust alignment.
const ROUNDS: usize = 8;
/// Rounds in which a shared shape settles.
const SETTLING: usize = 4;
/// How many scans stand for all where each is held against each.
const CANDIDATES: usize = 16;
/// The mirror image is taken for the face if it fits at least this many times better: where a face is nearly flat, both fit.
const CLEARLY: f64 = 1.3;

/// Multiplied with a point gives its mirror image.
pub(super) const MIRROR: DVec3 = DVec3::new(-1.0, 1.0, 1.0);

/// The middle value; NaN of nothing.
pub(super) fn median(values: impl IntoIterator<Item = f64>) -> f64 {
    quantile(values, 0.5)
}

/// The value that this share of all stays below; NaN of nothing.
pub(super) fn quantile(values: impl IntoIterator<Item = f64>, share: f64) -> f64 {
    let mut values: Vec<f64> = values.into_iter().collect();
    if values.is_empty() {
        return f64::NAN;
    }
    let at = ((values.len() as f64 * share) as usize).min(values.len() - 1);
    *values.select_nth_unstable_by(at, f64::total_cmp).1
}

/// Points brought onto a shape, and how far from it they stay.
pub(super) struct Aligned {
    /// The points in the shape's frame.
    pub points: Points,
    /// The median of their distances from the shape.
    pub distance: f64,
    /// What brought them there.
    pub similarity: Similarity,
}

/// Brings points onto a shape by a similarity that a minority of misplaced points does not move: least squares again and
/// again, points beyond the median distance with less and less weight.
pub(super) fn align(points: &[Option<DVec3>], shape: &[DVec3]) -> Aligned {
    let pairs = points.iter().zip(shape).filter_map(|(point, &to)| point.map(|from| (from, to)));
    let (from, to): (Vec<DVec3>, Vec<DVec3>) = pairs.unzip();
    let mut weights = vec![1.0; from.len()];
    let (mut similarity, mut distance) = (Similarity::IDENTITY, f64::NAN);
    for _ in 0..ROUNDS {
        similarity = Similarity::between(&from, &to, &weights);
        let distances: Vec<f64> =
            from.iter().zip(&to).map(|(&p, q)| similarity.apply(p).distance(*q)).collect();
        distance = median(distances.iter().copied());
        let scale = distance.max(1e-12);
        for (weight, distance) in weights.iter_mut().zip(&distances) {
            *weight = (scale / distance.max(scale)).powi(2);
        }
    }
    let points = points.iter().map(|point| point.map(|point| similarity.apply(point))).collect();
    Aligned { points, distance, similarity }
}

/// As [`align`], of the points or of their mirror image, whichever clearly fits; and whether it is the image.
pub(super) fn align_either(points: &[Option<DVec3>], shape: &[DVec3]) -> (Aligned, bool) {
    let straight = align(points, shape);
    let image = align(&mirrored(points), shape);
    if image.distance * CLEARLY < straight.distance { (image, true) } else { (straight, false) }
}

/// The points' mirror image.
fn mirrored(points: &[Option<DVec3>]) -> Points {
    points.iter().map(|point| point.map(|p| p * MIRROR)).collect()
}

/// The shape `[B, 3]` that most faces come close to: centred, of mean square radius one, turned as one of them is.
///
/// Every landmark must be there on some face.
pub(super) fn shared_shape(faces: &[Points]) -> Vec<DVec3> {
    let mut shape = unit(&typical(faces));
    for _ in 0..SETTLING {
        let aligned: Vec<Points> = faces.iter().map(|face| align_either(face, &shape).0.points).collect();
        shape = unit(&middle(aligned.iter(), &shape));
    }
    shape
}

/// Each landmark's median over faces of one frame; where none has it, that of `otherwise`.
pub(super) fn middle<'a>(faces: impl Iterator<Item = &'a Points> + Clone, otherwise: &[DVec3]) -> Vec<DVec3> {
    let at = |(landmark, &other): (usize, &DVec3)| {
        let there = faces.clone().filter_map(|face| face[landmark]);
        let of = |axis: usize| median(there.clone().map(|p| p[axis]));
        let point = DVec3::new(of(0), of(1), of(2));
        if point.is_nan() { other } else { point }
    };
    otherwise.iter().enumerate().map(at).collect()
}

/// Of some faces, the one that the others come closest to; landmarks that it lacks are taken from them.
fn typical(faces: &[Points]) -> Vec<DVec3> {
    let step = faces.len().div_ceil(CANDIDATES).max(1);
    let some: Vec<&Points> = faces.iter().step_by(step).collect();
    let filled: Vec<Vec<DVec3>> = some.iter().map(|face| complete(face, faces)).collect();
    let strangeness = |shape: &Vec<DVec3>| {
        let size = radius(shape).max(1e-300);
        median(some.iter().map(|face| align(face, shape).distance)) / size
    };
    let best = filled.iter().min_by(|a, b| strangeness(a).total_cmp(&strangeness(b)));
    best.cloned().unwrap_or_default()
}

/// A face whose missing landmarks are where others have them.
fn complete(face: &Points, others: &[Points]) -> Vec<DVec3> {
    if face.iter().all(Option::is_some) {
        return face.iter().flatten().copied().collect();
    }
    let placed: Vec<Points> = others
        .iter()
        .map(|other| {
            let both = other.iter().zip(face).filter_map(|(&from, &to)| from.zip(to));
            let (from, to): (Vec<DVec3>, Vec<DVec3>) = both.unzip();
            let similarity = Similarity::between(&from, &to, &vec![1.0; from.len()]);
            other.iter().map(|point| point.map(|point| similarity.apply(point))).collect()
        })
        .collect();
    let guessed = middle(placed.iter(), &vec![DVec3::ZERO; face.len()]);
    face.iter().zip(guessed).map(|(own, guessed)| own.unwrap_or(guessed)).collect()
}

fn radius(shape: &[DVec3]) -> f64 {
    let count = shape.len().max(1) as f64;
    let centre = shape.iter().sum::<DVec3>() / count;
    (shape.iter().map(|p| p.distance_squared(centre)).sum::<f64>() / count).sqrt()
}

fn unit(shape: &[DVec3]) -> Vec<DVec3> {
    let centre = shape.iter().sum::<DVec3>() / shape.len().max(1) as f64;
    let radius = radius(shape).max(1e-300);
    shape.iter().map(|p| (*p - centre) / radius).collect()
}

#[cfg(test)]
mod tests {
    use glam::DMat3;

    use super::*;
    use crate::numeric::Random;

    fn face(random: &mut Random, count: usize) -> Points {
        (0..count).map(|_| Some(DVec3::from_array([0; 3].map(|_| random.signed())))).collect()
    }

    #[test]
    fn a_minority_does_not_move_the_rest() {
        let mut random = Random::new(1);
        let shape: Vec<DVec3> = face(&mut random, 30).into_iter().flatten().collect();
        let turn = DMat3::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 2.0);
        let mut points: Points = shape.iter().map(|&p| Some(5.0 * (turn * p) + DVec3::Y)).collect();
        for at in [3, 9, 20, 21, 22] {
            points[at] = Some(DVec3::from_array([0; 3].map(|_| 9.0 * random.signed())));
        }
        points[5] = None;
        let aligned = align(&points, &shape);
        assert!(aligned.points[4].unwrap().distance(shape[4]) < 1e-6);
        assert!(aligned.distance < 1e-6 && aligned.points[5].is_none());
        assert!(!align_either(&points, &shape).1);
        assert!(align_either(&mirrored(&points), &shape).1);
    }

    #[test]
    fn the_shared_shape_is_that_of_most() {
        let mut random = Random::new(2);
        let one = face(&mut random, 12);
        let mut faces = vec![one.clone(); 9];
        faces[0] = mirrored(&one);
        faces[1] = face(&mut random, 12);
        faces[2][3] = None;
        let shape = shared_shape(&faces);
        assert!(align(&one, &shape).distance < 1e-9);
        assert!((radius(&shape) - 1.0).abs() < 1e-9);
    }
}

use glam::DVec3;
use nalgebra::DMatrix;

use super::alignment::{Points, median, middle, quantile};

/// Distance over which neighbouring landmarks move together, in units of the face's root mean square radius.
const REACH: f64 = 0.4;
/// Variance of faces being wider, longer or deeper as a whole, to that of neighbours moving together.
const STRETCH: f64 = 0.3;
/// Variance of a landmark on its own, to the same.
const ALONE: f64 = 0.03;
/// The share of what has been seen of faces in what is known of them; the rest is that neighbours move together.
const SEEN: f64 = 0.5;
/// A deviation beyond this many times its landmark's median is cut to it, since it may be a mistake.
const TRUSTED: f64 = 3.0;
/// The deviation with which anybody places a landmark, in each coordinate: three quarters of a millimetre.
const HAND: f64 = 0.012;
/// The smallest variance of a coordinate, where all faces are the same.
const LEAST_VARIANCE: f64 = 1e-8;

/// The share of faces on which a landmark is no stranger than its looseness allows for. Tips of noses stray seldom and
/// then far, which the upper quartile of a dozen faces hides; beyond this a single mistake would count.
const LOOSE_ON: f64 = 0.85;
/// That quantile of the strangeness of landmarks that are as loose as others, in units of the median.
const USUAL_QUANTILE: f64 = 1.55;
/// The median strangeness of a face exactly like the mean is no measure: at least this.
const LEAST_USUAL: f64 = 0.5;

/// How strange the middle one of a face's landmarks looks.
pub(super) fn usual_strangeness(strangeness: impl IntoIterator<Item = f64>) -> f64 {
    median(strangeness).max(LEAST_USUAL)
}

/// How landmarks lie on faces and vary together: a Gaussian process over the mean face, whose covariance is half that
/// seen on some faces, and half that of a smooth deformation.
///
/// It tells where a landmark should be from where the others are, so that large heads, open mouths and caricatures
/// move what is expected with them.
pub(super) struct FaceModel {
    mean: Vec<DVec3>,
    /// Covariance of each coordinate `[B, B]`.
    covariance: DMatrix<f64>,
    /// How much farther each landmark strays than the covariance says `[B]`, at least 1.
    looseness: Vec<f64>,
}

impl FaceModel {
    /// Learns from faces that are aligned to `shape`.
    pub fn new(faces: &[&Points], shape: &[DVec3]) -> Self {
        let mean = middle(faces.iter().copied(), shape);
        let smooth = smooth(&mean);
        let mut model = Self { looseness: vec![1.0; mean.len()], covariance: smooth.clone(), mean };
        let filled: Vec<Vec<DVec3>> = faces.iter().map(|face| model.filled(face)).collect();
        let seen = seen(&filled, &model.mean);
        let scale = (seen.trace() / smooth.trace()).max(LEAST_VARIANCE);
        let hand = DMatrix::from_diagonal_element(shape.len(), shape.len(), HAND * HAND);
        model.covariance = SEEN * seen + (1.0 - SEEN) * scale * smooth + hand;
        model.looseness = model.looseness_on(&filled);
        model
    }

    /// The mean face, to be changed to another.
    fn expectation_of_mean(&self) -> Option<Expectation> {
        self.expectation(&self.mean.iter().copied().map(Some).collect())
    }

    /// A face whose missing landmarks are where the others put them: were they on the mean face, it would seem that they
    /// do not move with the others.
    fn filled(&self, face: &Points) -> Vec<DVec3> {
        let mut filled: Vec<DVec3> =
            face.iter().zip(&self.mean).map(|(p, mean)| p.unwrap_or(*mean)).collect();
        let missing = || (0..face.len()).filter(|&at| face[at].is_none());
        if missing().next().is_none() {
            return filled;
        }
        if let Some(mut expectation) = self.expectation_of_mean() {
            expectation.move_to(&filled);
            missing().for_each(|at| expectation.ignore(at));
            missing().for_each(|at| filled[at] = expectation.of(at).point);
        }
        filled
    }

    /// How strange each landmark looks on a seventh of the faces at least, in units of what is usual on each face.
    ///
    /// A tip of a nose departs from what its neighbours say by more than they do from each other.
    fn looseness_on(&self, faces: &[Vec<DVec3>]) -> Vec<f64> {
        let Some(mut expectation) = self.expectation_of_mean() else {
            return self.looseness.clone();
        };
        let mut relative = vec![Vec::with_capacity(faces.len()); self.mean.len()];
        for face in faces {
            expectation.move_to(face);
            let strangeness = expectation.strangeness();
            let usual = usual_strangeness(strangeness.iter().copied());
            relative
                .iter_mut()
                .zip(&strangeness)
                .for_each(|(all, strangeness)| all.push(strangeness / usual));
        }
        relative.into_iter().map(|all| (quantile(all, LOOSE_ON) / USUAL_QUANTILE).max(1.0)).collect()
    }

    /// The face's landmarks that are there, each to be held against the others; `None` if there are none.
    pub fn expectation(&self, face: &Points) -> Option<Expectation> {
        let landmarks: Vec<usize> = (0..face.len()).filter(|&i| face[i].is_some()).collect();
        let covariance = DMatrix::from_fn(landmarks.len(), landmarks.len(), |i, j| {
            self.covariance[(landmarks[i], landmarks[j])]
        });
        let precision = covariance.clone().cholesky()?.inverse();
        let deviations = landmarks.iter().filter_map(|&i| Some(face[i]? - self.mean[i])).collect();
        let mean = landmarks.iter().map(|&i| self.mean[i]).collect();
        let ignored = vec![false; landmarks.len()];
        let looseness = landmarks.iter().map(|&i| self.looseness[i]).collect();
        Some(Expectation { landmarks, mean, deviations, covariance, precision, looseness, ignored })
    }
}

/// The covariance seen on faces; what departs most counts less, since it may be a mistake or a caricature.
fn seen(faces: &[Vec<DVec3>], mean: &[DVec3]) -> DMatrix<f64> {
    let deviations: Vec<Vec<DVec3>> = faces
        .iter()
        .map(|face| face.iter().zip(mean).map(|(point, mean)| *point - *mean).collect())
        .collect();
    let typical: Vec<f64> =
        (0..mean.len()).map(|i| median(deviations.iter().map(|face| face[i].length()))).collect();
    let sizes: Vec<f64> = deviations.iter().map(|face| median(face.iter().map(|d| d.length()))).collect();
    let usual = median(sizes.iter().copied());
    let mut covariance = DMatrix::zeros(mean.len(), mean.len());
    for (face, size) in deviations.iter().zip(&sizes) {
        let weight = if *size > usual { usual / size } else { 1.0 };
        let trusted: Vec<DVec3> =
            face.iter().zip(&typical).map(|(d, t)| weight * d.clamp_length_max(TRUSTED * t)).collect();
        for (j, b) in trusted.iter().enumerate() {
            for (i, a) in trusted.iter().enumerate() {
                covariance[(i, j)] += a.dot(*b);
            }
        }
    }
    covariance / (3.0 * faces.len().max(1) as f64)
}

/// The covariance of smooth deformations of a face, up to scale.
fn smooth(mean: &[DVec3]) -> DMatrix<f64> {
    DMatrix::from_fn(mean.len(), mean.len(), |i, j| {
        let (a, b) = (mean[i], mean[j]);
        let together = (-a.distance_squared(b) / (2.0 * REACH * REACH)).exp();
        let alone = if i == j { ALONE } else { 0.0 };
        STRETCH * (1.0 + a.dot(b)) + together + alone
    })
}

/// Where a face's landmarks should be, each seen from those of the others that are not ignored.
pub(super) struct Expectation {
    /// The landmarks' numbers `[M]`.
    pub landmarks: Vec<usize>,
    mean: Vec<DVec3>,
    deviations: Vec<DVec3>,
    covariance: DMatrix<f64>,
    /// Inverse covariance of those not ignored, zero in the rows and columns of the others.
    precision: DMatrix<f64>,
    looseness: Vec<f64>,
    ignored: Vec<bool>,
}

/// Where a landmark is expected: a bell of this centre and deviation.
#[derive(Debug, Clone, Copy)]
pub(super) struct Expected {
    pub point: DVec3,
    pub deviation: f64,
}

impl Expected {
    /// How many deviations away a point is.
    pub fn strangeness(&self, point: DVec3) -> f64 {
        self.point.distance(point) / self.deviation
    }
}

impl Expectation {
    /// Where a landmark is.
    pub fn point(&self, at: usize) -> DVec3 {
        self.mean[at] + self.deviations[at]
    }

    /// Puts the landmarks elsewhere.
    fn move_to(&mut self, points: &[DVec3]) {
        self.deviations = points.iter().zip(&self.mean).map(|(point, mean)| *point - *mean).collect();
    }

    /// Where a landmark should be, from the others.
    pub fn of(&self, at: usize) -> Expected {
        let all = 0..self.mean.len();
        if self.ignored[at] {
            let seen = self.covariance.column(at);
            let weights = &self.precision * seen;
            let deviation: DVec3 = all.map(|j| weights[j] * self.deviations[j]).sum();
            let variance = self.covariance[(at, at)] - weights.dot(&seen);
            return Expected {
                point: self.mean[at] + deviation,
                deviation: self.looseness[at] * variance.max(1e-300).sqrt(),
            };
        }
        // With P = K^-1 it is expected at x - (P d) / P_ii, with variance 1 / P_ii.
        let variance = 1.0 / self.precision[(at, at)];
        let others = all.filter(|&j| j != at);
        let pull: DVec3 = others.map(|j| self.precision[(at, j)] * self.deviations[j]).sum();
        Expected { point: self.mean[at] - variance * pull, deviation: self.looseness[at] * variance.sqrt() }
    }

    /// How strange each landmark looks beside the others.
    pub fn strangeness(&self) -> Vec<f64> {
        (0..self.mean.len()).map(|at| self.of(at).strangeness(self.point(at))).collect()
    }

    /// Whether a landmark is ignored.
    pub fn ignores(&self, at: usize) -> bool {
        self.ignored[at]
    }

    /// Lets a landmark no longer count for where the others should be.
    pub fn ignore(&mut self, at: usize) {
        let pivot = self.precision[(at, at)];
        if self.ignored[at] {
            return;
        }
        // The precision of the rest follows by a step of rank one, which clears row and column too.
        let column = self.precision.column(at).clone_owned();
        self.precision.ger(-1.0 / pivot, &column, &column, 1.0);
        self.precision.row_mut(at).fill(0.0);
        self.precision.column_mut(at).fill(0.0);
        self.ignored[at] = true;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::Random;

    fn faces(count: usize) -> (Vec<Points>, Vec<DVec3>) {
        let mut random = Random::new(8);
        let mut point = || DVec3::from_array([0; 3].map(|_| random.signed()));
        let shape: Vec<DVec3> = (0..20).map(|_| point()).collect();
        let faces = (0..count).map(|_| shape.iter().map(|&p| Some(p + 0.1 * point())).collect()).collect();
        (faces, shape)
    }

    /// A landmark that is ignored is seen as if it were missing for the others, and they as before for it.
    #[test]
    fn ignoring_is_leaving_out() {
        let (faces, shape) = faces(6);
        let model = FaceModel::new(&faces.iter().collect::<Vec<_>>(), &shape);
        let mut expectation = model.expectation(&faces[0]).unwrap();
        let before = expectation.of(7);
        for at in [7, 3, 12] {
            expectation.ignore(at);
        }
        let mut fewer = faces[0].clone();
        for at in [3, 12] {
            fewer[at] = None;
        }
        let close = |a: Expected, b: Expected| {
            a.point.distance(b.point) < 1e-9 && (a.deviation - b.deviation).abs() < 1e-9
        };
        let with = model.expectation(&fewer).unwrap();
        let index = with.landmarks.iter().position(|&i| i == 7).unwrap();
        assert!(close(expectation.of(7), with.of(index)));
        assert!(!close(expectation.of(7), before));
        fewer[7] = None;
        let without = model.expectation(&fewer).unwrap();
        let index = without.landmarks.iter().position(|&i| i == 15).unwrap();
        assert!(close(expectation.of(15), without.of(index)));
    }

    #[test]
    fn one_face_seen_again_and_again_gives_numbers() {
        let (faces, shape) = faces(1);
        let model = FaceModel::new(&[&faces[0], &faces[0]], &shape);
        assert!(model.expectation(&faces[0]).unwrap().strangeness().iter().all(|s| s.is_finite()));
    }
}

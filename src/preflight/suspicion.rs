//! Which landmarks of one face are not where its others say they should be.

use super::face_model::{Expectation, usual_strangeness};

/// A landmark this many times as strange as the median landmark of its scan is misplaced.
const MISPLACED: f64 = 4.4;
/// From here on a landmark counts less and less.
const DOUBTED: f64 = 3.0;
/// A landmark closer than this to where it should be is right, in units of the face's root mean square radius: about
/// four millimetres.
const CLOSE: f64 = 0.07;
/// An exchange of two landmarks explains them if it leaves this share of their squared strangeness.
const EXPLAINED: f64 = 0.3;

/// What is thought of the landmarks of one face.
pub(super) struct Suspicion {
    /// The landmarks' numbers `[M]`.
    pub landmarks: Vec<usize>,
    /// How strange each is: 1 is misplaced.
    pub strangeness: Vec<f64>,
    /// How far each is from where it should be, in units of the face's root mean square radius.
    pub distances: Vec<f64>,
    /// Those that are misplaced, by their place in `landmarks`.
    pub misplaced: Vec<usize>,
    /// Those of them that are exchanged with another.
    pub exchanged: Vec<[usize; 2]>,
}

impl Suspicion {
    /// Takes out the strangest landmark again and again until none is strange, or half are gone.
    pub fn new(mut expectation: Expectation) -> Self {
        let count = expectation.landmarks.len();
        let mut usual = 1.0;
        for _ in 0..=count / 2 {
            let strangeness = expectation.strangeness();
            let kept = || (0..count).filter(|&at| !expectation.ignores(at));
            usual = usual_strangeness(kept().map(|at| strangeness[at]));
            let strange = |&at: &usize| {
                let distance = expectation.of(at).point.distance(expectation.point(at));
                strangeness[at] > MISPLACED * usual && distance > CLOSE
            };
            let strangest = kept().filter(strange).max_by(|&a, &b| strangeness[a].total_cmp(&strangeness[b]));
            match strangest {
                Some(at) => expectation.ignore(at),
                None => break,
            }
        }
        Self::judged(&mut expectation, MISPLACED * usual)
    }

    /// Judges every landmark by those that are left: one that was taken out may be found to be right.
    fn judged(expectation: &mut Expectation, limit: f64) -> Self {
        let count = expectation.landmarks.len();
        let strange = |expectation: &Expectation, at: usize| {
            let expected = expectation.of(at);
            let point = expectation.point(at);
            expected.strangeness(point) > limit && expected.point.distance(point) > CLOSE
        };
        let mut misplaced: Vec<usize> =
            (0..count).filter(|&at| expectation.ignores(at) && strange(expectation, at)).collect();
        let exchanged = exchanges(expectation, &misplaced, limit);
        misplaced.extend(exchanged.iter().flatten());
        misplaced.sort_unstable();
        misplaced.dedup();
        let distance = |at| expectation.of(at).point.distance(expectation.point(at));
        let strangeness = expectation.strangeness().into_iter().map(|s| s / limit).collect();
        let distances = (0..count).map(distance).collect();
        Self { landmarks: expectation.landmarks.clone(), strangeness, distances, misplaced, exchanged }
    }

    /// How much each landmark should count, from 0 to 1 `[M]`.
    pub fn weights(&self) -> Vec<f64> {
        let weight = |(at, strangeness): (usize, &f64)| {
            let doubt = (strangeness * MISPLACED - DOUBTED) / (MISPLACED - DOUBTED);
            if self.misplaced.contains(&at) { 0.0 } else { 1.0 - 0.5 * doubt.clamp(0.0, 1.0) }
        };
        self.strangeness.iter().enumerate().map(weight).collect()
    }
}

/// Pairs of landmarks, at least one of them misplaced, that are each where the other should be.
fn exchanges(expectation: &mut Expectation, misplaced: &[usize], limit: f64) -> Vec<[usize; 2]> {
    let mut pairs: Vec<[usize; 2]> = Vec::new();
    for &one in misplaced {
        if pairs.iter().flatten().any(|&at| at == one) {
            continue;
        }
        let partner = (0..expectation.landmarks.len())
            .filter(|&other| other != one && !pairs.iter().flatten().any(|&at| at == other))
            .filter_map(|other| Some((other, explained(expectation, one, other, limit)?)))
            .min_by(|a, b| a.1.total_cmp(&b.1));
        if let Some((other, _)) = partner {
            expectation.ignore(other);
            pairs.push([one.min(other), one.max(other)]);
        }
    }
    pairs
}

/// The share of two landmarks' squared strangeness that is left if they are exchanged; `None` if that does not explain
/// them.
fn explained(expectation: &Expectation, one: usize, other: usize, limit: f64) -> Option<f64> {
    let (first, second) = (expectation.of(one), expectation.of(other));
    let crossed = [first.strangeness(expectation.point(other)), second.strangeness(expectation.point(one))];
    let own = [first.strangeness(expectation.point(one)), second.strangeness(expectation.point(other))];
    let square = |pair: [f64; 2]| pair[0] * pair[0] + pair[1] * pair[1];
    let share = square(crossed) / square(own);
    (crossed.iter().all(|&s| s < limit) && share < EXPLAINED).then_some(share)
}

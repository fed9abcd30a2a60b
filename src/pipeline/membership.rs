//! Which scans of a collection can be registered together: one that cannot fails alone.

use std::collections::HashMap;

use serde::{Deserialize, Serialize};

use super::register::LEAST_LANDMARKS;
use super::template::Template;
use crate::mesh::LandmarkSet;

/// A scan that is left out of a registration, and why.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct FailedScan {
    /// Its name.
    pub name: String,
    /// What is wrong with it, and what to do.
    pub problem: String,
}

/// The scans that must be left out, in their order, so that the others can be registered.
///
/// From a `template` each scan needs [`LEAST_LANDMARKS`] of its landmarks. Without one, that many must be on all scans:
/// as long as they are not, the scan goes that shares as many with the fewest others; of several, that which shares the
/// fewest landmarks with all others in sum, then the last. One scan stays in any case if it has enough itself.
pub fn leave_out(scans: &[(&str, &LandmarkSet)], template: Option<&Template>) -> Vec<FailedScan> {
    let sets = landmark_sets(scans, template);
    let mut problems: Vec<Option<String>> = sets.iter().map(|set| too_few(set, template)).collect();
    let mut kept: Vec<usize> = (0..scans.len()).filter(|&at| problems[at].is_none()).collect();
    while template.is_none() && kept.len() > 1 && shared_by_all(&sets, &kept) < LEAST_LANDMARKS {
        let stranger = kept.remove(strangest(&sets, &kept));
        let partners = partners(&sets, stranger, &kept);
        problems[stranger] = Some(format!(
            "shares at least {LEAST_LANDMARKS} landmarks with {partners} of the {} scans that stay: \
             give it landmarks of the same scheme",
            kept.len()
        ));
    }
    let failed = |((name, _), problem): (&(&str, _), Option<String>)| {
        Some(FailedScan { name: (*name).to_owned(), problem: problem? })
    };
    scans.iter().zip(problems).filter_map(failed).collect()
}

/// Which landmarks a scan has, a bit for each.
type LandmarkBits = Vec<u64>;

/// The landmarks of each scan; with a template, those that it has too.
fn landmark_sets(scans: &[(&str, &LandmarkSet)], template: Option<&Template>) -> Vec<LandmarkBits> {
    let counts = |name: &str| template.is_none_or(|template| template.landmarks.contains_key(name));
    let mut numbers: HashMap<&str, usize> = HashMap::new();
    let mut own: Vec<Vec<usize>> = Vec::new();
    for (_, landmarks) in scans {
        let names = landmarks.present().map(|(name, _)| name).filter(|name| counts(name));
        let number = |name| {
            let next = numbers.len();
            *numbers.entry(name).or_insert(next)
        };
        own.push(names.map(number).collect());
    }
    let words = numbers.len().div_ceil(64);
    let bits = |numbers: Vec<usize>| {
        let mut bits = vec![0u64; words];
        numbers.into_iter().for_each(|number| bits[number / 64] |= 1 << (number % 64));
        bits
    };
    own.into_iter().map(bits).collect()
}

fn too_few(set: &LandmarkBits, template: Option<&Template>) -> Option<String> {
    let known: u32 = set.iter().map(|word| word.count_ones()).sum();
    let whose = if template.is_some() { "of the template's landmarks" } else { "landmarks" };
    ((known as usize) < LEAST_LANDMARKS).then(|| {
        format!(
            "has {known} {whose}; at least {LEAST_LANDMARKS} are needed: give it landmarks of the same scheme"
        )
    })
}

fn shared_by_all(sets: &[LandmarkBits], kept: &[usize]) -> usize {
    let words = sets.first().map_or(0, Vec::len);
    let common = |word: usize| kept.iter().fold(u64::MAX, |common, &at| common & sets[at][word]);
    (0..words).map(|word| common(word).count_ones() as usize).sum()
}

fn shared(a: &LandmarkBits, b: &LandmarkBits) -> usize {
    a.iter().zip(b).map(|(a, b)| (a & b).count_ones() as usize).sum()
}

/// With how many others a scan shares enough landmarks.
fn partners(sets: &[LandmarkBits], one: usize, others: &[usize]) -> usize {
    others.iter().filter(|&&at| at != one && shared(&sets[one], &sets[at]) >= LEAST_LANDMARKS).count()
}

/// Where among the kept that one stands which has least in common with the others.
fn strangest(sets: &[LandmarkBits], kept: &[usize]) -> usize {
    let in_common = |one: usize| {
        let sum: usize = kept.iter().map(|&at| shared(&sets[one], &sets[at])).sum();
        // A scan shares all with itself.
        (partners(sets, one, kept), sum - shared(&sets[one], &sets[one]))
    };
    let ranked = kept.iter().enumerate().rev().min_by_key(|&(_, &one)| in_common(one));
    ranked.map_or(0, |(place, _)| place)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    fn landmarks(names: &[&str]) -> LandmarkSet {
        let names: Vec<String> = names.iter().map(|&name| name.to_owned()).collect();
        LandmarkSet { scheme: None, points: vec![Some(DVec3::ZERO); names.len()], names }
    }

    fn left_out(scans: &[(&str, &[&str])]) -> Vec<String> {
        let sets: Vec<LandmarkSet> = scans.iter().map(|(_, own)| landmarks(own)).collect();
        let scans: Vec<_> = scans.iter().zip(&sets).map(|((name, _), set)| (*name, set)).collect();
        leave_out(&scans, None).into_iter().map(|failed| failed.name).collect()
    }

    const ALL: &[&str] = &["a", "b", "c", "d", "e"];

    #[test]
    fn nobody_goes_where_enough_is_shared() {
        assert!(left_out(&[("1", ALL), ("2", &["c", "b", "a"]), ("3", ALL)]).is_empty());
        assert!(left_out(&[]).is_empty());
    }

    #[test]
    fn who_has_too_few_goes() {
        assert_eq!(left_out(&[("1", &["a", "b"]), ("2", ALL), ("3", ALL)]), ["1"]);
        assert_eq!(left_out(&[("1", &["a", "b"]), ("2", &[])]), ["1", "2"]);
    }

    #[test]
    fn who_shares_least_goes_and_the_majority_stays() {
        assert_eq!(left_out(&[("1", &["a", "b", "x", "y", "z"]), ("2", ALL), ("3", ALL)]), ["1"]);
        let many: &[&str] = &["p", "q", "r", "s", "t", "u", "v"];
        assert_eq!(left_out(&[("1", ALL), ("2", many), ("3", ALL), ("4", many), ("5", ALL)]), ["2", "4"]);
        // Each pair shares enough, but not all three: the last of equals goes.
        let pairs: [(&str, &[&str]); 3] = [
            ("1", &["a", "b", "c", "d", "e", "f"]),
            ("2", &["a", "b", "c", "g", "h", "i"]),
            ("3", &["d", "e", "f", "g", "h", "i"]),
        ];
        assert_eq!(left_out(&pairs), ["3"]);
    }

    #[test]
    fn with_a_template_its_landmarks_count() {
        let template = |names: &[&str]| {
            let at =
                crate::mesh::SurfacePoint { triangle: crate::mesh::TriangleId(0), weights: [1.0, 0.0, 0.0] };
            Template {
                positions: vec![DVec3::ZERO, DVec3::X, DVec3::Y],
                triangles: vec![[0, 1, 2]],
                landmarks: names.iter().map(|&name| (name.to_owned(), at)).collect(),
                scheme: None,
                texture_coordinates: None,
                mask: None,
                frozen: false,
            }
        };
        let [one, two] = [landmarks(&["a", "b", "c"]), landmarks(&["c", "d", "e"])];
        let scans = [("1", &one), ("2", &two)];
        assert!(leave_out(&scans, Some(&template(ALL))).is_empty());
        let failed = leave_out(&scans, Some(&template(&["a", "b", "c"])));
        assert_eq!(failed.len(), 1);
        assert!(failed[0].problem.contains("has 1 of the template's landmarks"), "{failed:?}");
    }
}

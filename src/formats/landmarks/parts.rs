//! Landmarks named by the parts of the face that Menpo's LJSON says they belong to.

use std::ops::Range;

/// The scheme that iBUG's landmarks are of.
pub(super) const SCHEME: &str = "multipie68";

/// What Menpo and iBUG call the parts, and their numbers in the scheme. Left and right are a picture's, as Menpo's
/// are: the left eye is the person's right.
const PARTS: [(&[&str], Range<usize>); 7] = [
    (&["jaw", "chin"], 0..17),
    (&["lefteyebrow", "leyebrow"], 17..22),
    (&["righteyebrow", "reyebrow"], 22..27),
    (&["nose"], 27..36),
    (&["lefteye", "leye"], 36..42),
    (&["righteye", "reye"], 42..48),
    (&["mouth"], 48..68),
];

/// The corners of the inner lips, which the smaller sets leave out.
const INNER_CORNERS: [usize; 2] = [60, 64];

/// What the scheme calls the landmarks `0..count` of a file whose parts each have a label and the places of its
/// landmarks in the file, in the part's own order. `None` unless each landmark is in exactly one part of iBUG's, and each
/// of these parts is whole; labels of other names are passed over.
pub(super) fn names(parts: &[(String, Vec<usize>)], count: usize) -> Option<Vec<String>> {
    let mut names: Vec<Option<String>> = vec![None; count];
    for (label, places) in parts {
        let Some(numbers) = numbers(label, places.len()) else { continue };
        for (&place, number) in places.iter().zip(numbers?) {
            if names.get_mut(place)?.replace(number.to_string()).is_some() {
                return None;
            }
        }
    }
    names.into_iter().collect()
}

/// The numbers of a part of so many landmarks: `None` if it is none of iBUG's, `Some(None)` if it is not whole.
fn numbers(label: &str, count: usize) -> Option<Option<Vec<usize>>> {
    let plain: String = label.chars().filter(|c| c.is_alphanumeric()).flat_map(char::to_lowercase).collect();
    let (_, numbers) = PARTS.iter().find(|(labels, _)| labels.contains(&plain.as_str()))?;
    let all: Vec<usize> = numbers.clone().collect();
    let without: Vec<usize> = all.iter().copied().filter(|n| !INNER_CORNERS.contains(n)).collect();
    Some([all, without].into_iter().find(|numbers| numbers.len() == count))
}

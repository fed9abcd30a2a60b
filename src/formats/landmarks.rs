//! Landmark files: JSON, in any of the shapes that people keep named points in.

use std::collections::HashSet;
use std::fmt;
use std::path::Path;

use glam::DVec3;
use serde::Deserialize;
use serde::de::{MapAccess, Visitor};
use serde_json::value::RawValue;
use serde_json::{Value, json};

use super::error::{Fault, FormatError};
use super::input::read_file;
use super::output::write_whole;
use super::scheme::Scheme;
use super::text::{shown, without_mark};
use crate::mesh::LandmarkSet;

/// Reads the landmarks of one scan from a JSON file, in the file's order.
///
/// A point is `[x, y, z]` in the scan's own space and units, or `null` where it is missing. The file is one of
/// - `[point, ...]`: named by their indices "0", "1", ...
/// - `{"name": point, ...}`
/// - `{"points": ...}` or `{"landmarks": ...}` with either of these, or with a list of
///   `{"name": "...", "position": point}`; and, beside it, perhaps `"scheme": "..."`
/// - Menpo's LJSON, with one group.
///
/// # Errors
/// [`FormatError`] names the landmark that is malformed or not finite, a name that is given twice, or how the number of
/// points differs from the stated scheme's.
pub fn read_landmarks(path: impl AsRef<Path>) -> Result<LandmarkSet, FormatError> {
    let path = path.as_ref();
    parse_landmarks(&read_file(path)?).map_err(|error| error.in_file(path))
}

/// Reads landmarks as [`read_landmarks`] does, from the bytes of a file.
///
/// # Errors
/// As [`read_landmarks`], without a file.
pub fn parse_landmarks(bytes: &[u8]) -> Result<LandmarkSet, FormatError> {
    let bytes = without_mark(bytes);
    let document: &RawValue = serde_json::from_slice(bytes).map_err(|error| not_json(bytes, &error))?;
    let mut set = LandmarkSet::default();
    read_document(document, DEEPEST, &mut set)?;
    check(&set)?;
    Ok(set)
}

/// Says where JSON ends and quotes it: a program that writes `NaN` does not say which landmark is wrong, this does.
fn not_json(bytes: &[u8], error: &serde_json::Error) -> Fault {
    let line = bytes.split(|&b| b == b'\n').nth(error.line().saturating_sub(1)).unwrap_or_default();
    let near = &line[error.column().saturating_sub(12).min(line.len())..];
    let problem = format!("{error}, near `{}`; a missing landmark is written `null`", shown(near));
    Fault::at("its JSON", problem)
}

/// An object's members in their order, names that are given twice included.
struct Members<'a>(Vec<(String, &'a RawValue)>);

impl<'a> Members<'a> {
    fn of(raw: &'a RawValue) -> Option<Self> {
        serde_json::from_str(raw.get()).ok()
    }

    fn get(&self, name: &str) -> Option<&'a RawValue> {
        self.0.iter().find(|(member, _)| member == name).map(|&(_, raw)| raw)
    }
}

impl<'a> Deserialize<'a> for Members<'a> {
    fn deserialize<D: serde::Deserializer<'a>>(deserializer: D) -> Result<Self, D::Error> {
        struct InOrder;
        impl<'a> Visitor<'a> for InOrder {
            type Value = Members<'a>;

            fn expecting(&self, out: &mut fmt::Formatter) -> fmt::Result {
                out.write_str("an object")
            }

            fn visit_map<A: MapAccess<'a>>(self, mut map: A) -> Result<Self::Value, A::Error> {
                let mut members = Vec::new();
                while let Some(member) = map.next_entry()? {
                    members.push(member);
                }
                Ok(Members(members))
            }
        }
        deserializer.deserialize_map(InOrder)
    }
}

/// Objects that landmarks are wrapped in at most: those of LJSON.
const DEEPEST: usize = 3;

fn read_document(raw: &RawValue, depth: usize, set: &mut LandmarkSet) -> Result<(), Fault> {
    let Some(members) = Members::of(raw) else {
        return read_list(raw, set);
    };
    if let Some(scheme) = members.get("scheme") {
        let scheme = serde_json::from_str(scheme.get())
            .map_err(|_| Fault::at("scheme", "must be a name in quotes"))?;
        set.scheme = Some(scheme);
    }
    let inner = match members.get("groups") {
        Some(groups) => Some(only_group(groups)?),
        None => members.get("points").or_else(|| members.get("landmarks")),
    };
    match (inner, depth) {
        (None, _) => read_members(members, set),
        (Some(_), 0) => Err(Fault::at("the landmarks", "are wrapped in too many objects")),
        (Some(inner), _) => read_document(inner, depth - 1, set),
    }
}

/// LJSON keeps named groups of landmarks, of which a scan has one.
fn only_group(groups: &RawValue) -> Result<&RawValue, Fault> {
    match Members::of(groups).as_ref().map(|groups| &groups.0[..]) {
        Some([(_, group)]) => Ok(group),
        Some(several) => {
            let names: Vec<_> = several.iter().map(|(name, _)| name.as_str()).collect();
            let problem = format!(
                "has {} groups ({}): keep the one to use",
                names.len(),
                shown(names.join(", ").as_bytes())
            );
            Err(Fault::at("groups", problem))
        }
        None => Err(Fault::at("groups", "must be an object of landmark groups")),
    }
}

fn read_members(members: Members, set: &mut LandmarkSet) -> Result<(), Fault> {
    for (name, raw) in members.0 {
        if name != "scheme" {
            let point = read_point(raw, &name)?;
            set.names.push(name);
            set.points.push(point);
        }
    }
    Ok(())
}

#[derive(Deserialize)]
struct Named<'a> {
    name: String,
    #[serde(borrow)]
    position: Option<&'a RawValue>,
}

fn read_list(raw: &RawValue, set: &mut LandmarkSet) -> Result<(), Fault> {
    let entries: Vec<&RawValue> = serde_json::from_str(raw.get()).map_err(|_| {
        let problem =
            format!("is `{}`, where a list or an object of points must be", shown(raw.get().as_bytes()));
        Fault::at("the landmarks", problem)
    })?;
    let unnamed = entries.iter().all(|entry| !entry.get().starts_with('{'));
    let scheme = set.scheme.as_deref().and_then(Scheme::named);
    if let Some(scheme) = scheme.filter(|scheme| unnamed && scheme.count() != entries.len()) {
        let problem = format!("are {}, but the scheme {} has {}", entries.len(), scheme.name, scheme.count());
        return Err(Fault::at("the landmarks", problem));
    }
    for (index, entry) in entries.into_iter().enumerate() {
        let (name, point) = if entry.get().starts_with('{') {
            let named: Named = serde_json::from_str(entry.get()).map_err(|_| {
                let problem = "must have a `name` and a `position`, which is [x, y, z] or null";
                Fault::at(format_args!("landmark {index}"), problem)
            })?;
            (named.name, named.position)
        } else {
            (index.to_string(), Some(entry))
        };
        let point = point.map_or(Ok(None), |point| read_point(point, &name))?;
        set.names.push(name);
        set.points.push(point);
    }
    Ok(())
}

/// `[x, y, z]`; `null` and LJSON's `[null, null, null]` are a missing landmark.
fn read_point(raw: &RawValue, name: &str) -> Result<Option<DVec3>, Fault> {
    let point: Option<[Option<f64>; 3]> =
        serde_json::from_str(raw.get()).map_err(|_| not_a_point(raw, name))?;
    match point {
        None | Some([None, None, None]) => Ok(None),
        Some([Some(x), Some(y), Some(z)]) => Ok(Some(DVec3::new(x, y, z))),
        Some(_) => Err(not_a_point(raw, name)),
    }
}

fn not_a_point(raw: &RawValue, name: &str) -> Fault {
    let problem = format!(
        "is `{}`: it must be three finite numbers [x, y, z], or null where it is missing",
        shown(raw.get().as_bytes())
    );
    Fault::at(format_args!("landmark `{}`", shown(name.as_bytes())), problem)
}

fn check(set: &LandmarkSet) -> Result<(), Fault> {
    if set.present().next().is_none() {
        return Err(Fault::at("the landmarks", format!("are {} and none has a position", set.names.len())));
    }
    let mut seen = HashSet::new();
    if let Some(twice) = set.names.iter().find(|&name| !seen.insert(name)) {
        return Err(Fault::at(format_args!("landmark `{}`", shown(twice.as_bytes())), "is given twice"));
    }
    match set.scheme.as_deref().and_then(Scheme::named) {
        Some(scheme) => scheme.check(set).map_err(|problem| Fault::at("the landmarks", problem)),
        None => Ok(()),
    }
}

/// The landmarks as JSON that [`read_landmarks`] reads back: a plain list where they are named by their indices.
pub fn landmarks_json(set: &LandmarkSet) -> Value {
    let plain = set.names.iter().enumerate().all(|(index, name)| *name == index.to_string());
    let points = set.points.iter().map(|point| point.map(|p| p.to_array()));
    let mut document = if plain {
        json!({ "points": points.collect::<Vec<_>>() })
    } else {
        let named = set.names.iter().zip(points);
        let named: Vec<_> =
            named.map(|(name, position)| json!({ "name": name, "position": position })).collect();
        json!({ "landmarks": named })
    };
    if let Some(scheme) = &set.scheme {
        document["scheme"] = json!(scheme);
    }
    document
}

/// Writes [`landmarks_json`] to a file.
///
/// # Errors
/// [`FormatError`] where the file cannot be written.
pub fn write_landmarks(path: impl AsRef<Path>, set: &LandmarkSet) -> Result<(), FormatError> {
    write_whole(path.as_ref(), landmarks_json(set).to_string().as_bytes())
}

#[cfg(test)]
mod tests {
    use super::super::mutation::damage;
    use super::*;

    fn read(text: &str) -> LandmarkSet {
        parse_landmarks(text.as_bytes()).unwrap()
    }

    fn complaint(text: &str) -> String {
        parse_landmarks(text.as_bytes()).unwrap_err().to_string()
    }

    fn two(first: &str, second: &str) -> LandmarkSet {
        let points = vec![Some(DVec3::new(1.0, 2.0, 3.5)), None];
        LandmarkSet { scheme: None, names: vec![first.to_owned(), second.to_owned()], points }
    }

    #[test]
    fn every_shape_is_read() {
        let plain = two("0", "1");
        assert_eq!(read("\u{feff}[[1, 2, 3.5], null]"), plain);
        assert_eq!(read(r#"{"points": [[1, 2, 3.5], null]}"#), plain);
        assert_eq!(
            read(r#"{"version": 2, "landmarks": {"points": [[1, 2, 3.5], [null, null, null]]}}"#),
            plain
        );
        assert_eq!(
            read(r#"{"groups": {"LJSON": {"labels": [], "landmarks": {"points": [[1, 2, 3.5], null]}}}}"#),
            plain
        );
        let named = two("tip", "chin");
        assert_eq!(read(r#"{"tip": [1, 2, 3.5], "chin": null}"#), named);
        assert_eq!(read(r#"{"landmarks": {"tip": [1, 2, 3.5], "chin": null}}"#), named);
        let listed = r#"[{"name": "tip", "position": [1, 2, 3.5]}, {"name": "chin", "position": null}]"#;
        assert_eq!(read(&format!(r#"{{"landmarks": {listed}}}"#)), named);
        let own = LandmarkSet { scheme: Some("own".to_owned()), ..named };
        assert_eq!(read(r#"{"scheme": "own", "tip": [1, 2, 3.5], "chin": null}"#), own);
    }

    #[test]
    fn complaints_name_the_landmark() {
        assert!(complaint("[[1, 2, 3], [1, 2]]").contains("landmark `1`: is `[1, 2]`"));
        assert!(complaint(r#"{"tip": [1, 2, "3"]}"#).contains("landmark `tip`"));
        assert!(complaint("[[1, 2, 1e999]]").contains("landmark `0`: is `[1, 2, 1e999]`"));
        assert!(complaint("[[1, 2, null]]").contains("landmark `0`"));
        assert!(complaint(r#"{"a": [1, 2, 3], "a": [1, 2, 3]}"#).contains("landmark `a`: is given twice"));
        assert!(complaint(r#"{"landmarks": [{"position": [1, 2, 3]}]}"#).contains("landmark 0"));
        assert!(complaint("[[1, 2, 3],\n [4, NaN, 5]]").contains("line 2"));
        assert!(complaint("[[1, 2, 3],\n [4, NaN, 5]]").contains("NaN"));
    }

    #[test]
    fn what_holds_no_landmarks_is_refused() {
        for text in ["", "3", "\"a\"", "[]", "{}", "[null]", "[1]", r#"{"points": 3}"#, r#"{"groups": {}}"#] {
            assert!(parse_landmarks(text.as_bytes()).is_err(), "{text}");
        }
        let deep = "[".repeat(100_000);
        assert!(parse_landmarks(deep.as_bytes()).is_err());
        let nested = r#"{"points":"#.repeat(10_000) + "[[1, 2, 3]]" + &"}".repeat(10_000);
        assert!(complaint(&nested).contains("too many objects"));
    }

    #[test]
    fn a_known_scheme_is_held_to() {
        assert!(complaint(r#"{"scheme": "ibug68", "points": [[1, 2, 3]]}"#).contains("are 1, but"));
        assert!(complaint(r#"{"scheme": "ibug68", "tip": [1, 2, 3]}"#).contains("include `tip`"));
        assert_eq!(
            read(r#"{"scheme": "ibug68", "30": [1, 2, 3]}"#).get("30"),
            Some(DVec3::new(1.0, 2.0, 3.0))
        );
    }

    #[test]
    fn what_is_written_is_read_back() {
        for mut set in [two("0", "1"), two("tip", "chin"), two("1", "0")] {
            set.scheme = Some("own".to_owned());
            set.points[0] = Some(DVec3::new(0.1, -1.0 / 3.0, 1e-17));
            assert_eq!(read(&landmarks_json(&set).to_string()), set);
        }
    }

    #[test]
    fn damage_panics_nowhere() {
        let file = br#"{"scheme": "own", "landmarks": [[1, 2, 3.5], null, {"name": "a", "position": [0, 1e3, -2]}]}"#;
        damage(file, 30_000, |bytes| drop(parse_landmarks(bytes)));
    }
}

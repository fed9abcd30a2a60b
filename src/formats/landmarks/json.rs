use std::fmt;

use glam::DVec3;
use serde::Deserialize;
use serde::de::{MapAccess, Visitor};
use serde_json::value::RawValue;

use super::{LandmarkFile, Mark, parts, slicer};
use crate::formats::error::Fault;
use crate::formats::text::shown;

/// Lists and objects of points, as they are or wrapped; Menpo's LJSON; 3D Slicer's markups.
pub(super) fn read(bytes: &[u8]) -> Result<LandmarkFile, Fault> {
    let document: &RawValue = serde_json::from_slice(bytes).map_err(|error| not_json(bytes, &error))?;
    let mut file = LandmarkFile::default();
    match Members::of(document) {
        Some(members) => match members.get("markups") {
            Some(markups) => return slicer::read(markups),
            None => read_object(members, DEEPEST, &mut file)?,
        },
        None => read_list(document, &mut file)?,
    }
    file.maybe_on_triangles = may_be_on_triangles(document);
    Ok(file)
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

fn read_object(members: Members, depth: usize, file: &mut LandmarkFile) -> Result<(), Fault> {
    if let Some(scheme) = members.get("scheme") {
        let scheme = serde_json::from_str(scheme.get())
            .map_err(|_| Fault::at("scheme", "must be a name in quotes"))?;
        file.scheme = Some(scheme);
    }
    if let Some(groups) = members.get("groups").filter(|groups| groups.get().starts_with('[')) {
        return read_groups(groups, file);
    }
    let inner = match members.get("groups") {
        Some(groups) => Some(only_group(groups)?),
        None => members.get("points").or_else(|| members.get("landmarks")),
    };
    match (inner, depth) {
        (None, _) => read_members(members, file),
        (Some(_), 0) => Err(Fault::at("the landmarks", "are wrapped in too many objects")),
        (Some(inner), _) => {
            match Members::of(inner) {
                Some(members) => read_object(members, depth - 1, file),
                None => read_list(inner, file),
            }?;
            name_by_parts(labels(&members), file);
            Ok(())
        }
    }
}

#[derive(Deserialize)]
struct Label {
    label: String,
    mask: Vec<usize>,
}

/// The parts that LJSON of version 2 and 3 marks in its list; other programs' labels are theirs.
fn labels(members: &Members) -> Vec<(String, Vec<usize>)> {
    let labels: Option<Vec<Label>> =
        members.get("labels").and_then(|labels| serde_json::from_str(labels.get()).ok());
    labels.unwrap_or_default().into_iter().map(|Label { label, mask }| (label, mask)).collect()
}

/// Names a list by the parts of the face, where these are iBUG's and the file says nothing else.
fn name_by_parts(parts: Vec<(String, Vec<usize>)>, file: &mut LandmarkFile) {
    if file.scheme.is_some() || !file.listed {
        return;
    }
    if let Some(names) = parts::names(&parts, file.names.len()) {
        file.scheme = Some(parts::SCHEME.to_owned());
        file.names = names;
        file.listed = false;
    }
}

/// LJSON of version 3 keeps named groups of landmarks, of which a scan has one.
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

#[derive(Deserialize)]
struct Group<'a> {
    label: Option<String>,
    #[serde(borrow)]
    landmarks: Vec<GroupPoint<'a>>,
}

#[derive(Deserialize)]
struct GroupPoint<'a> {
    #[serde(borrow)]
    point: Option<&'a RawValue>,
}

/// LJSON of version 1 cuts one list into groups, by the parts of the face.
fn read_groups(groups: &RawValue, file: &mut LandmarkFile) -> Result<(), Fault> {
    let groups: Vec<&RawValue> =
        serde_json::from_str(groups.get()).map_err(|error| Fault::at("groups", error.to_string()))?;
    let mut parts = Vec::new();
    for (at, group) in groups.into_iter().enumerate() {
        let group: Group = serde_json::from_str(group.get())
            .map_err(|error| Fault::at(format_args!("groups[{at}]"), error.to_string()))?;
        let first = file.names.len();
        for point in group.landmarks {
            push_entry(point.point, file)?;
        }
        parts.push((group.label.unwrap_or_default(), (first..file.names.len()).collect()));
    }
    file.listed = true;
    name_by_parts(parts, file);
    Ok(())
}

fn read_members(members: Members, file: &mut LandmarkFile) -> Result<(), Fault> {
    for (name, raw) in members.0 {
        if name != "scheme" {
            let mark = read_point(raw, &name)?;
            file.push(name, mark);
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

fn read_list(raw: &RawValue, file: &mut LandmarkFile) -> Result<(), Fault> {
    let entries: Vec<&RawValue> = serde_json::from_str(raw.get()).map_err(|_| {
        let problem =
            format!("is `{}`, where a list or an object of points must be", shown(raw.get().as_bytes()));
        Fault::at("the landmarks", problem)
    })?;
    file.listed = entries.iter().all(|entry| !entry.get().starts_with('{'));
    for (index, entry) in entries.into_iter().enumerate() {
        if entry.get().starts_with('{') {
            let named: Named = serde_json::from_str(entry.get()).map_err(|_| {
                let problem = "must have a `name` and a `position`, which is [x, y, z] or null";
                Fault::at(format_args!("landmark {index}"), problem)
            })?;
            let mark = named.position.map_or(Ok(None), |point| read_point(point, &named.name))?;
            file.push(named.name, mark);
        } else {
            push_entry(Some(entry), file)?;
        }
    }
    Ok(())
}

/// Adds a point that is named by its index.
fn push_entry(raw: Option<&RawValue>, file: &mut LandmarkFile) -> Result<(), Fault> {
    let name = file.names.len().to_string();
    let mark = raw.map_or(Ok(None), |raw| read_point(raw, &name))?;
    file.push(name, mark);
    Ok(())
}

/// `[x, y, z]`; `null` and LJSON's `[null, null, null]` are a missing landmark.
fn read_point(raw: &RawValue, name: &str) -> Result<Option<Mark>, Fault> {
    let point: Option<[Option<f64>; 3]> =
        serde_json::from_str(raw.get()).map_err(|_| not_a_point(raw, name))?;
    match point {
        None | Some([None, None, None]) => Ok(None),
        Some([Some(x), Some(y), Some(z)]) => Ok(Some(Mark::Point(DVec3::new(x, y, z)))),
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

/// Whether all entries of a list or object, wrapped in nothing, are `[integer, u, v]` as Wrap writes them.
fn may_be_on_triangles(document: &RawValue) -> bool {
    let fits = |raw: &RawValue| match serde_json::from_str::<Option<(u32, f64, f64)>>(raw.get()) {
        Ok(None) => true,
        Ok(Some((_, u, v))) => u >= 0.0 && v >= 0.0 && u + v <= 1.0 + 1e-6,
        Err(_) => false,
    };
    match Members::of(document) {
        Some(members) => members.0.iter().all(|(name, raw)| name == "scheme" || fits(raw)),
        None => serde_json::from_str(document.get())
            .is_ok_and(|entries: Vec<&RawValue>| entries.into_iter().all(fits)),
    }
}

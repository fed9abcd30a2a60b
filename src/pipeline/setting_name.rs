//! Parameters by name, as people write them: `groupwise.rounds=3`, `fit.levels.0.lambda=6`.

use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;

use super::settings::{FitSettings, SettingError, Settings};
use crate::mesh::Icosphere;

/// No parameter is larger: counts beyond it would take all memory, and lengths and weights mean nothing there.
const LARGEST: f64 = 1e7;
/// The finest sphere: 40962 vertices.
pub(super) const FINEST: u32 = 6;

impl Settings {
    /// Sets the parameter of a dotted name: fields by their names, levels by their place counted from 0.
    ///
    /// The value is JSON; what is no JSON is taken as a string, so that `register.levels.0.density=off` needs no quotes.
    /// A whole level or stage may be set too.
    ///
    /// # Errors
    /// [`SettingError`] names what there is beside a name that does not exist, or says why a value cannot be.
    pub fn set(&mut self, name: &str, value: &str) -> Result<(), SettingError> {
        *self = with_parameter(self, name, value, Self::check)?;
        Ok(())
    }

    /// Settings from a JSON file's bytes: those that [`Settings`] serialize to, whole, or a manifest with such `settings`.
    ///
    /// # Errors
    /// [`SettingError::File`] with the field and what is wrong with it.
    pub fn from_json(bytes: &[u8]) -> Result<Self, SettingError> {
        let malformed = |error: serde_json::Error| SettingError::File(error.to_string());
        let mut document: Value = serde_json::from_slice(bytes).map_err(malformed)?;
        let inner = document.get_mut("settings").map(Value::take);
        let settings: Self = serde_json::from_value(inner.unwrap_or(document)).map_err(malformed)?;
        settings.check()?;
        Ok(settings)
    }

    /// Whether the parameters can be worked with.
    ///
    /// # Errors
    /// [`SettingError`] names the first that cannot.
    pub fn check(&self) -> Result<(), SettingError> {
        check_numbers(&document(self), "")?;
        check_levels("fit", &self.fit)?;
        check_levels("register", &self.register)?;
        let (last, own) =
            (self.register.levels.last().map(|level| level.level), Icosphere::level_of(self.vertices));
        // Only the groupwise stage can go on from a coarser level.
        if last > own || own.is_none() || (last < own && self.groupwise.rounds == 0) {
            return Err(SettingError::Levels {
                stage: "register",
                problem: format!("must end at the level of {} vertices", self.vertices),
            });
        }
        Ok(())
    }
}

/// Parameters of any kind with the one of a dotted name set, if they then pass `check`.
///
/// # Errors
/// As [`Settings::set`].
pub(super) fn with_parameter<S: Serialize + DeserializeOwned>(
    settings: &S,
    name: &str,
    value: &str,
    check: impl Fn(&S) -> Result<(), SettingError>,
) -> Result<S, SettingError> {
    let refused =
        |reason: String| SettingError::Value { name: name.to_owned(), value: value.to_owned(), reason };
    if name == "preset" || name == "vertices" {
        return Err(refused("all others follow from it; begin with the preset of that kind and size".into()));
    }
    let mut document = document(settings);
    let (place, is_new) = place(&mut document, name)?;
    let beside = known(place.parent);
    let parsed = serde_json::from_str(value).unwrap_or_else(|_| Value::from(value));
    place.put(parsed);
    let changed: S = serde_json::from_value(document).map_err(|error| {
        // A name beside those of a map, such as a landmark's, may be new; beside fields it may not.
        if is_new { unknown(name, beside) } else { refused(error.to_string()) }
    })?;
    check(&changed).map_err(|problem| refused(problem.to_string()))?;
    Ok(changed)
}

pub(super) fn document<S: Serialize>(settings: &S) -> Value {
    serde_json::to_value(settings).expect("settings are plain numbers and names")
}

/// A place in a document: the member `key` of `parent`.
struct Place<'a> {
    parent: &'a mut Value,
    key: &'a str,
}

impl Place<'_> {
    fn put(self, value: Value) {
        match self.parent {
            Value::Object(fields) => drop(fields.insert(self.key.to_owned(), value)),
            Value::Array(items) => {
                if let Some(item) = self.key.parse::<usize>().ok().and_then(|at| items.get_mut(at)) {
                    *item = value;
                }
            }
            _ => {}
        }
    }
}

/// The place of a dotted name and whether nothing is there yet; all but its last part must exist.
fn place<'a>(document: &'a mut Value, name: &'a str) -> Result<(Place<'a>, bool), SettingError> {
    let (path, key) = name.rsplit_once('.').map_or((None, name), |(path, key)| (Some(path), key));
    let mut parent = document;
    let mut passed = "";
    for part in path.into_iter().flat_map(|path| path.split('.')) {
        let beside = known(parent);
        parent = member(parent, part).ok_or_else(|| unknown_in(name, passed, beside))?;
        let end = part.as_ptr() as usize - name.as_ptr() as usize + part.len();
        passed = &name[..end];
    }
    let is_new = member(parent, key).is_none();
    if is_new && !parent.is_object() {
        return Err(unknown(name, known(parent)));
    }
    Ok((Place { parent, key }, is_new))
}

fn member<'a>(parent: &'a mut Value, key: &str) -> Option<&'a mut Value> {
    match parent {
        Value::Object(fields) => fields.get_mut(key),
        Value::Array(items) => items.get_mut(key.parse::<usize>().ok()?),
        _ => None,
    }
}

/// What a value holds, for people to choose from.
fn known(parent: &Value) -> String {
    match parent {
        Value::Object(fields) => fields.keys().cloned().collect::<Vec<_>>().join(", "),
        Value::Array(items) if !items.is_empty() => format!("0 to {}", items.len() - 1),
        _ => "nothing below it".to_owned(),
    }
}

fn unknown(name: &str, known: String) -> SettingError {
    unknown_in(name, name.rsplit_once('.').map_or("", |(parent, _)| parent), known)
}

fn unknown_in(name: &str, parent: &str, known: String) -> SettingError {
    let parent = if parent.is_empty() { "the top" } else { parent };
    SettingError::Unknown { name: name.to_owned(), parent: parent.to_owned(), known }
}

/// Cosines lie in [-1, 1]; everything else is a length, a weight or a count.
pub(super) fn check_numbers(value: &Value, name: &str) -> Result<(), SettingError> {
    let inner = |key: &str| if name.is_empty() { key.to_owned() } else { format!("{name}.{key}") };
    match value {
        Value::Object(fields) => fields.iter().try_for_each(|(key, value)| check_numbers(value, &inner(key))),
        Value::Array(items) => {
            items.iter().enumerate().try_for_each(|(at, value)| check_numbers(value, &inner(&at.to_string())))
        }
        // Not a number at all is what JSON has for numbers that are not finite.
        Value::Number(_) | Value::Null => {
            let range = if name.ends_with("cosine") { -1.0..=1.0 } else { 0.0..=LARGEST };
            if value.as_f64().is_some_and(|number| range.contains(&number)) {
                return Ok(());
            }
            let reason = format!("it must be between {} and {}", range.start(), range.end());
            Err(SettingError::Value { name: name.to_owned(), value: value.to_string(), reason })
        }
        _ => Ok(()),
    }
}

/// Each level is a subdivision of the one before.
fn check_levels(stage: &'static str, settings: &FitSettings) -> Result<(), SettingError> {
    let levels: Vec<u32> = settings.levels.iter().map(|level| level.level).collect();
    let nested = levels.array_windows().all(|&[coarse, fine]| fine == coarse + 1);
    if levels.is_empty() || !nested || levels.iter().any(|&level| level > FINEST) {
        let problem = format!("are {levels:?}; they must rise one by one, to {FINEST} at most");
        return Err(SettingError::Levels { stage, problem });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::settings::{Density, Preset};
    use super::*;

    fn settings() -> Settings {
        Settings::preset(Preset::Default, 2562).unwrap()
    }

    fn complaint(name: &str, value: &str) -> String {
        let mut changed = settings();
        let error = changed.set(name, value).unwrap_err().to_string();
        assert_eq!(changed, settings(), "{name} stays as it was");
        error
    }

    #[test]
    fn parameters_are_set_by_name() {
        let mut settings = settings();
        for (name, value) in [
            ("groupwise.rounds", "3"),
            ("fit.levels.0.lambda", "6"),
            ("fit.levels.1.foldover.1", "0.25"),
            ("register.levels.0.density", "off"),
            ("register.levels.1.density.fading.uniform", "2"),
            ("resample.weights.nose tip", "7"),
        ] {
            settings.set(name, value).unwrap();
        }
        assert_eq!(settings.groupwise.rounds, 3);
        assert_eq!(settings.fit.levels[0].lambda, 6.0);
        assert_eq!(settings.fit.levels[1].foldover[1], 0.25);
        assert_eq!(settings.register.levels[0].density, Density::Off);
        assert_eq!(settings.register.levels[1].density, Density::Fading { uniform: 2.0 });
        assert_eq!(settings.resample.weights["nose tip"], 7.0);
    }

    #[test]
    fn complaints_say_what_there_is() {
        assert!(complaint("groupwize.rounds", "3").contains("register"));
        assert!(complaint("groupwise.round", "3").contains("rounds"));
        assert!(complaint("fit.levels.9.lambda", "3").contains("0 to 1"));
        assert!(complaint("groupwise.rounds.0", "3").contains("nothing below it"));
        assert!(complaint("", "3").contains("groupwise"));
        assert!(complaint("groupwise.rounds", "many").contains("many"));
        assert!(complaint("groupwise.rounds", "-1").contains("-1"));
        assert!(complaint("fit.levels.0.lambda", "1e300").contains("between"));
        assert!(complaint("fit.levels.0.least_cosine", "-2").contains("between -1"));
        assert!(complaint("fit.levels.0.level", "2").contains("rise one by one"));
        assert!(complaint("register.levels", "[]").contains("rise one by one"));
        assert!(complaint("vertices", "642").contains("preset"));
    }

    #[test]
    fn settings_survive_their_file() {
        let bytes = serde_json::to_vec(&settings()).unwrap();
        assert_eq!(Settings::from_json(&bytes).unwrap(), settings());
        let manifest = serde_json::json!({ "settings": settings() }).to_string();
        assert_eq!(Settings::from_json(manifest.as_bytes()).unwrap(), settings());
        assert!(Settings::from_json(b"{}").unwrap_err().to_string().contains("preset"));
    }
}

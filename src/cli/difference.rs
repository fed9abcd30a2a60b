use std::collections::BTreeMap;

use serde_json::Value;

/// The parameters in which `wanted` differs from `base`, by their dotted names.
///
/// A list of another length and a map with other names is given whole.
pub fn difference(base: &Value, wanted: &Value) -> BTreeMap<String, Value> {
    let mut found = BTreeMap::new();
    collect(base, wanted, "", &mut found);
    found
}

fn collect(base: &Value, wanted: &Value, name: &str, found: &mut BTreeMap<String, Value>) {
    let inner = |part: &str| if name.is_empty() { part.to_owned() } else { format!("{name}.{part}") };
    match (base, wanted) {
        (Value::Object(base), Value::Object(wanted)) if base.keys().eq(wanted.keys()) => {
            for ((part, base), wanted) in base.iter().zip(wanted.values()) {
                collect(base, wanted, &inner(part), found);
            }
        }
        (Value::Array(base), Value::Array(wanted)) if base.len() == wanted.len() => {
            for (at, (base, wanted)) in base.iter().zip(wanted).enumerate() {
                collect(base, wanted, &inner(&at.to_string()), found);
            }
        }
        _ if base == wanted => {}
        _ => {
            found.insert(name.to_owned(), wanted.clone());
        }
    }
}

#[cfg(test)]
mod tests {
    use onemesh::pipeline::{Preset, Settings};

    use super::*;

    fn document(settings: &Settings) -> Value {
        serde_json::to_value(settings).unwrap()
    }

    #[test]
    fn what_differs_makes_the_same_again() {
        for preset in [Preset::Default, Preset::Paper] {
            let base = Settings::preset(preset, 2562).unwrap();
            assert!(difference(&document(&base), &document(&base)).is_empty());
            let mut wanted = base.clone().without_density();
            wanted.set("groupwise.rounds", "1").unwrap();
            wanted.set("fit.levels.0.lambda", "6").unwrap();
            wanted.set("resample.weights.nose", "3").unwrap();
            let mut again = base.clone();
            for (name, value) in difference(&document(&base), &document(&wanted)) {
                let text = value.as_str().map_or_else(|| value.to_string(), str::to_owned);
                again.set(&name, &text).unwrap();
            }
            assert_eq!(again, wanted);
        }
    }
}

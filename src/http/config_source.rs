//! Where the configuration comes from: a TOML file, then the environment, then what is said on the command line.

use std::path::{Path, PathBuf};

use toml::{Table, Value};

use super::config::Config;

/// What environment variables begin with: `ONEMESH_LIMITS__SCAN__VERTICES` is `limits.scan.vertices`.
const PREFIX: &str = "ONEMESH_";
/// Between the parts of a name in an environment variable.
const BETWEEN: &str = "__";

/// Why there is no configuration.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// The file cannot be read.
    #[error("{}: cannot be read: {error}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What the system says.
        error: std::io::Error,
    },
    /// It is no TOML.
    #[error("{}: {error}", path.display())]
    Malformed {
        /// The file.
        path: PathBuf,
        /// Where and why.
        error: Box<toml::de::Error>,
    },
    /// A name or value that does not exist.
    #[error("{origin}: {problem}; `onemesh serve --print-config` shows every name")]
    Invalid {
        /// Where it was said.
        origin: String,
        /// What is wrong.
        problem: String,
    },
}

impl Config {
    /// The defaults, over them a file's values, over them those of environment variables (of all that are given, those
    /// that begin with `ONEMESH_` and have a part `__`), over them `assignments` of dotted names.
    ///
    /// # Errors
    /// [`ConfigError`] says where what is wrong.
    pub fn from_sources(
        file: Option<&Path>,
        environment: impl Iterator<Item = (String, String)>,
        assignments: &[(String, String)],
    ) -> Result<Self, ConfigError> {
        let mut config = Table::try_from(Self::default()).unwrap_or_default();
        if let Some(path) = file {
            let unreadable = |error| ConfigError::Unreadable { path: path.to_owned(), error };
            let text = std::fs::read_to_string(path).map_err(unreadable)?;
            let malformed = |error| ConfigError::Malformed { path: path.to_owned(), error: Box::new(error) };
            overlay(&mut config, text.parse().map_err(malformed)?);
            checked(&config, &path.display().to_string())?;
        }
        for (name, value) in environment {
            let Some(path) = name.strip_prefix(PREFIX).filter(|rest| rest.contains(BETWEEN)) else {
                continue;
            };
            assign(&mut config, &path.to_ascii_lowercase().replace(BETWEEN, "."), &value);
            checked(&config, &name)?;
        }
        for (name, value) in assignments {
            assign(&mut config, name, value);
            checked(&config, name)?;
        }
        checked(&config, "the configuration")
    }

    /// All of it as a TOML file has it.
    pub fn to_toml(&self) -> String {
        toml::to_string_pretty(self).unwrap_or_default()
    }
}

fn checked(config: &Table, origin: &str) -> Result<Config, ConfigError> {
    config.clone().try_into().map_err(|error: toml::de::Error| ConfigError::Invalid {
        origin: origin.to_owned(),
        problem: error.message().to_owned(),
    })
}

/// Puts the values of `over` in place of those of the same names.
fn overlay(config: &mut Table, over: Table) {
    for (name, value) in over {
        match (config.get_mut(&name), value) {
            (Some(Value::Table(inner)), Value::Table(over)) => overlay(inner, over),
            (_, value) => {
                config.insert(name, value);
            }
        }
    }
}

/// Sets a dotted name to a value, which is a number or truth value where it looks like one.
fn assign(config: &mut Table, name: &str, value: &str) {
    let mut value = match value.parse::<i64>() {
        Ok(number) => Value::Integer(number),
        Err(_) => value.parse::<bool>().map_or_else(|_| Value::String(value.to_owned()), Value::Boolean),
    };
    let mut parts = name.rsplit('.');
    let last = parts.next().unwrap_or_default();
    let mut table = Table::from_iter([(last.to_owned(), value)]);
    for part in parts {
        value = Value::Table(table);
        table = Table::from_iter([(part.to_owned(), value)]);
    }
    overlay(config, table);
}

#[cfg(test)]
mod tests {
    use super::super::config::KeyPolicy;
    use super::*;

    fn pair(name: &str, value: &str) -> (String, String) {
        (name.to_owned(), value.to_owned())
    }

    #[test]
    fn later_sources_go_over_earlier_ones() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("onemesh.toml");
        std::fs::write(&file, "[limits.scan]\nvertices = 7\ntriangles = 8\n[server]\nkeys = \"off\"\n")
            .unwrap();
        let environment =
            [pair("ONEMESH_LIMITS__SCAN__VERTICES", "9"), pair("ONEMESH_LOG", "x"), pair("HOME", "/")];
        let said = [pair("data.folder", "elsewhere")];
        let config = Config::from_sources(Some(&file), environment.into_iter(), &said).unwrap();
        assert_eq!((config.limits.scan.vertices, config.limits.scan.triangles), (9, 8));
        assert_eq!((config.server.keys, config.data.folder), (KeyPolicy::Off, "elsewhere".into()));
        assert_eq!(config.limits.scan.zip_files, 64);
    }

    #[test]
    fn what_does_not_exist_is_named() {
        let wrong = |name: &str, value: &str| {
            Config::from_sources(None, std::iter::empty(), &[pair(name, value)]).unwrap_err().to_string()
        };
        assert!(
            wrong("limits.scan.vertexes", "1").contains("limits.scan.vertexes: unknown field `vertexes`")
        );
        assert!(wrong("server.listen", "everywhere").starts_with("server.listen: "));
        assert!(wrong("limits.scan.vertices", "-1").starts_with("limits.scan.vertices: "));
    }

    #[test]
    fn what_is_printed_is_read_again() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("onemesh.toml");
        std::fs::write(&file, Config::default().to_toml()).unwrap();
        let config = Config::from_sources(Some(&file), std::iter::empty(), &[]).unwrap();
        assert_eq!(config, Config::default());
    }

    #[test]
    fn keys_are_needed_off_loopback() {
        let needs = |listen: &str, keys: &str| {
            let said = [pair("server.listen", listen), pair("server.keys", keys)];
            Config::from_sources(None, std::iter::empty(), &said).unwrap().needs_keys()
        };
        assert!(!needs("127.0.0.1:0", "auto") && !needs("[::1]:0", "auto"));
        assert!(needs("0.0.0.0:0", "auto") && needs("[::]:0", "auto") && needs("127.0.0.1:0", "required"));
        assert!(!needs("0.0.0.0:0", "off"));
    }
}

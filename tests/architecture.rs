//! What imports what: the table in `src/lib.rs`, held against the source.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// Crates that only some files may name, and where.
const KEPT: [(&str, &[&str]); 25] = [
    ("nalgebra_sparse", &["numeric/cholesky.rs", "numeric/elimination.rs", "cli/bench/kernels.rs"]),
    ("clap", &["cli/", "main.rs"]),
    ("anyhow", &["cli/"]),
    ("indicatif", &["cli/"]),
    ("ureq", &["cli/"]),
    ("axum", &["http/"]),
    ("utoipa", &["http/"]),
    ("utoipa_axum", &["http/"]),
    ("utoipa_swagger_ui", &["http/"]),
    ("tower_http", &["http/"]),
    ("tokio", &["job/", "http/", "cli/"]),
    ("futures_util", &["job/", "http/", "cli/"]),
    ("sqlx", &["job/"]),
    ("object_store", &["job/"]),
    ("apalis", &["job/queue.rs"]),
    ("apalis_sqlite", &["job/queue.rs"]),
    ("lru", &["job/cache.rs"]),
    ("postcard", &["pipeline/state.rs"]),
    ("opentelemetry", &["cli/span_export.rs"]),
    ("opentelemetry_sdk", &["cli/span_export.rs"]),
    ("opentelemetry_otlp", &["cli/span_export.rs"]),
    ("tracing_opentelemetry", &["cli/span_export.rs"]),
    ("wgpu", &["render/"]),
    ("bytemuck", &["render/", "formats/polygons.rs"]),
    ("pollster", &["render/"]),
];

/// The lines of code of every source file, by its path under `src/`.
fn sources() -> BTreeMap<String, Vec<String>> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut waiting = vec![root.clone()];
    let mut sources = BTreeMap::new();
    while let Some(path) = waiting.pop() {
        if path.is_dir() {
            waiting.extend(fs::read_dir(&path).unwrap().map(|entry| entry.unwrap().path()));
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            sources.insert(name_under(&path, &root), code(&path));
        }
    }
    sources
}

fn name_under(path: &Path, root: &Path) -> String {
    let parts: PathBuf = path.strip_prefix(root).unwrap().components().collect();
    parts.to_string_lossy().replace('\\', "/")
}

fn code(path: &Path) -> Vec<String> {
    let text = fs::read_to_string(path).unwrap();
    text.lines().map(|line| line.split("//").next().unwrap_or_default().to_owned()).collect()
}

/// The layer of each module, from the table in `src/lib.rs`.
fn layers() -> BTreeMap<String, u32> {
    let text = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("src/lib.rs")).unwrap();
    let mut layers = BTreeMap::new();
    for row in text.lines().filter_map(|line| line.strip_prefix("//! | L")) {
        let mut cells = row.split('|').map(str::trim);
        let layer = cells.next().unwrap().parse().unwrap();
        layers.extend(cells.next().unwrap().split(", ").map(|module| (module.to_owned(), layer)));
    }
    layers
}

/// The module that a file is of: `mesh` for `mesh/normals.rs`, `reparam` for `reparam.rs`.
fn module(file: &str) -> &str {
    file.split('/').next().unwrap_or_default().trim_end_matches(".rs")
}

/// Whether `name` stands in `line` as a word of its own.
fn names(line: &str, name: &str) -> bool {
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    line.split(|c| !is_word(c)).any(|word| word == name)
}

/// The modules of this crate that a line names after `crate::`.
fn imports(line: &str) -> impl Iterator<Item = &str> {
    let ends = |c: char| !(c.is_alphanumeric() || c == '_');
    line.split("crate::").skip(1).filter_map(move |rest| rest.split(ends).next())
}

/// The lines before a file's unit tests, which may look anywhere: a gradient's test needs finite differences.
fn without_tests(lines: &[String]) -> impl Iterator<Item = &String> {
    let begins =
        lines.array_windows().position(|[mark, next]| mark == "#[cfg(test)]" && next == "mod tests {");
    lines[..begins.unwrap_or(lines.len())].iter()
}

#[test]
fn modules_import_lower_layers_only() {
    let layers = layers();
    for (file, lines) in sources().iter().filter(|(file, _)| *file != "lib.rs" && *file != "main.rs") {
        let own = module(file);
        let layer = layers.get(own).unwrap_or_else(|| panic!("src/lib.rs has no layer for {own}"));
        for imported in without_tests(lines).flat_map(|line| imports(line)).filter(|&name| name != own) {
            let below = layers.get(imported).unwrap_or_else(|| panic!("{file} imports crate::{imported}"));
            assert!(below < layer, "{file} of layer {layer} imports {imported} of layer {below}");
        }
    }
}

#[test]
fn every_module_of_the_table_is_there() {
    let sources = sources();
    for name in layers().keys() {
        assert!(sources.keys().any(|file| module(file) == name), "src/lib.rs gives a layer to {name}");
    }
}

#[test]
fn crates_are_named_where_they_may_be() {
    for (file, lines) in sources() {
        for (name, places) in KEPT {
            let may = places.iter().any(|place| file.starts_with(place));
            let line = lines.iter().position(|line| names(line, name));
            assert!(may || line.is_none(), "src/{file}:{} names {name}", line.unwrap_or(0) + 1);
        }
    }
}

#[test]
fn the_program_s_main_file_holds_the_commands_alone() {
    let lines = &sources()["main.rs"];
    assert!(lines.len() < 60, "src/main.rs has {} lines", lines.len());
}

//! A tiny collection and the built program, for tests that run it.

use std::path::{Path, PathBuf};
use std::process::Command;

use onemesh::demo::{Sculptor, Settings};
use onemesh::formats::{write_landmarks, write_ply};

/// Parameters that make a registration take seconds.
pub const QUICK: &[&str] = &[
    "--vertices",
    "642",
    "--set",
    "fit.levels.0.iterations=30",
    "--set",
    "register.levels.0.iterations=30",
    "--set",
    "groupwise.rounds=1",
    "--set",
    "groupwise.phases=2",
    "--set",
    "groupwise.iterations=2",
];

/// Writes `count` sculpted heads as `NAME/scan.ply` with `NAME/landmarks.json`; returns their names.
pub fn write_collection(folder: &Path, count: usize) -> Vec<String> {
    let settings = Settings { triangles: 3000, ..Settings::default() };
    let heads = Sculptor::new(7).with(settings).collection(count, &[1.0]);
    for head in &heads {
        let own = folder.join(&head.name);
        std::fs::create_dir_all(&own).unwrap();
        write_ply(own.join("scan.ply"), &head.mesh).unwrap();
        write_landmarks(own.join("landmarks.json"), &head.landmarks).unwrap();
    }
    heads.into_iter().map(|head| head.name).collect()
}

/// The program, to be run.
pub fn command() -> Command {
    Command::new(env!("CARGO_BIN_EXE_onemesh"))
}

/// The arguments of a quick registration.
pub fn quick_register(collection: &Path, output: &Path) -> Vec<PathBuf> {
    let mut arguments = vec!["register".into(), collection.to_owned(), "-o".into(), output.to_owned()];
    arguments.extend(QUICK.iter().map(PathBuf::from));
    arguments
}

//! The same input gives the same bytes, whatever the number of threads.

mod common;

use std::fs;
use std::path::Path;

use common::{command, quick_register, write_collection};
use serde_json::Value;

#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    let scans = folder.path().join("scans");
    let names = write_collection(&scans, 3);
    let outputs = ["1", "2", "3"].map(|threads| {
        let output = folder.path().join(threads);
        let mut program = command();
        program.args(quick_register(&scans, &output)).env("RAYON_NUM_THREADS", threads);
        assert!(program.output().unwrap().status.success());
        output
    });
    let mut files: Vec<String> = names.iter().map(|name| format!("{name}.glb")).collect();
    files.extend(["manifest.json".to_owned(), "sheet.png".to_owned()]);
    for other in &outputs[1..] {
        for file in &files {
            let [one, two] = [&outputs[0], other].map(|folder| fs::read(folder.join(file)).unwrap());
            assert!(one == two, "{file} differs between 1 thread and {}", other.display());
        }
        assert_eq!(report(&outputs[0]), report(other));
    }
}

/// The report without its seconds.
fn report(folder: &Path) -> Value {
    let mut report: Value = serde_json::from_slice(&fs::read(folder.join("report.json")).unwrap()).unwrap();
    report.as_object_mut().unwrap().remove("seconds").unwrap();
    report
}

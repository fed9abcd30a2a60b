use std::fs;
use std::path::Path;
use std::process::Command;

use crate::common::write_collection;
use crate::server::Server;

/// The quick start of the README, as it stands there.
#[test]
fn the_python_script_does_what_it_says() {
    if Command::new("python3").arg("--version").output().is_err() {
        eprintln!("skipped: there is no python3");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let (scans, out) = (folder.path().join("scans"), folder.path().join("out"));
    let names = write_collection(&scans, 2);
    let server = Server::start(&folder.path().join("data"));
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/quick_start.py");
    let quick = r#"{"vertices": 642, "parameters": {"groupwise.rounds": 1, "groupwise.phases": 2}}"#;
    let run = |server: &str, more: &str| {
        Command::new("python3").arg(&script).args([server]).args([&scans, &out]).arg(more).output().unwrap()
    };
    let output = run(&server.url, quick);
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{said}{}", String::from_utf8_lossy(&output.stderr));
    assert!(
        names.iter().all(|name| said.contains(name) && out.join(format!("{name}.glb")).exists()),
        "{said}"
    );
    assert!(fs::read(out.join("sheet.png")).unwrap().starts_with(b"\x89PNG"));
    let refused = run(&server.url, r#"{"vertices": 7}"#);
    let said = String::from_utf8_lossy(&refused.stderr);
    assert!(!refused.status.success() && said.contains("choose 642"), "{said}");
}

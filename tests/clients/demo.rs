use std::fs;
use std::path::Path;
use std::process::Command;

use crate::common::QUICK;

/// What `make demo` does, with fewer heads and vertices.
#[cfg(unix)]
#[test]
fn the_demo_runs_through_the_service() {
    let folder = tempfile::tempdir().unwrap();
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("scripts/demo");
    let demo = Command::new(script)
        .arg(env!("CARGO_BIN_EXE_onemesh"))
        .arg(folder.path())
        .args(QUICK)
        .env("DEMO_HEADS", "2")
        .env("ONEMESH_DATA__KEEP_FREE_BYTES", "0")
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&demo.stdout).into_owned();
    assert!(demo.status.success(), "{said}{}", String::from_utf8_lossy(&demo.stderr));
    let sheet = folder.path().join("result/sheet.png");
    assert!(said.contains(&format!("look at {}", sheet.display())), "{said}");
    assert!(fs::read(sheet).unwrap().starts_with(b"\x89PNG"));
    // The server has ended in order and left its log.
    let log = fs::read_to_string(folder.path().join("server/log")).unwrap();
    assert!(log.contains("the server ends"), "{log}");
}

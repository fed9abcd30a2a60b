use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

use crate::server::Server;

/// Bytes of a scan.
const SCAN: usize = 2 << 20;

/// A server over a small disk of its own, which others do not see.
struct SmallDisk {
    server: Server,
    _folder: tempfile::TempDir,
}

impl SmallDisk {
    /// `None`, and says so, where such a disk may not be mounted.
    fn new() -> Option<Self> {
        if !may_mount() {
            return None;
        }
        let folder = tempfile::tempdir().unwrap();
        let data = folder.path().join("data");
        std::fs::create_dir(&data).unwrap();
        let server = Server::by(on_own_disk("rw", folder.path()), &data, "127.0.0.1:0", &[]);
        Some(Self { server, _folder: folder })
    }

    /// The status of a request, and the end of its problem's type.
    fn status(&self, method: &str, path: &str, body: &[u8]) -> (u16, String) {
        let (status, body) = self.server.send(method, path, "model/obj", body).unwrap();
        let body: serde_json::Value = serde_json::from_slice(&body).unwrap_or_default();
        let kind = body["type"].as_str().unwrap_or_default();
        (status, kind.rsplit(':').next().unwrap_or_default().to_owned())
    }

    /// Waits until a request has this status.
    fn wait_for(&self, expected: u16, method: &str, path: &str, body: &[u8]) {
        let start = Instant::now();
        loop {
            let (status, kind) = self.status(method, path, body);
            if status == expected {
                return;
            }
            assert!(start.elapsed() < Duration::from_secs(30), "{method} {path}: {status} {kind}");
            std::thread::sleep(Duration::from_millis(50));
        }
    }
}

/// Whether disks may be mounted, and says so if not.
fn may_mount() -> bool {
    let may = Command::new("unshare").args(["--map-root-user", "--mount", "true"]).status();
    let may = may.is_ok_and(|status| status.success());
    if !may {
        eprintln!("SKIPPED: a disk cannot be mounted here (unshare --map-root-user --mount)");
    }
    may
}

/// The program over a small disk at `data` in a folder, which nobody else sees.
fn on_own_disk(mode: &str, folder: &Path) -> Command {
    let script = r#"
        set -eu
        mount -t tmpfs -o size=16m tmpfs "$2/data"
        mkdir "$2/data/blobs"
        mount -o "remount,$1" "$2/data"
        shift 2
        exec "$@""#;
    let mut command = Command::new("unshare");
    command.args(["--map-root-user", "--mount", "sh", "-c", script, "sh", mode]).arg(folder);
    command.arg(env!("CARGO_BIN_EXE_onemesh"));
    command
}

/// A tetrahedron as OBJ, with so many bytes that nobody reads.
fn scan(number: usize) -> Vec<u8> {
    let comment = "# of no matter\n".repeat(SCAN / 15);
    let text = format!(
        "# {number}\nv 0 0 0\nv 20 0 0\nv 0 20 0\nv 0 0 20\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n{comment}"
    );
    text.into_bytes()
}

fn path_of(server: &Server, body: &[u8]) -> String {
    let scan = server.json("POST", "/v1/scans", "model/obj", body);
    format!("/v1/scans/{}", scan["id"].as_str().unwrap())
}

#[test]
fn a_full_disk_refuses_uploads_keeps_what_there_is_and_has_room_again_for_what_is_deleted() {
    let Some(disk) = SmallDisk::new() else { return };
    let first = path_of(&disk.server, &scan(0));
    let refused = (1..40).map(|number| disk.status("POST", "/v1/scans", &scan(number)));
    let refused = refused.into_iter().find(|(status, _)| *status != 201);
    assert_eq!(refused, Some((503, "storage-unavailable".to_owned())));
    let (status, kept) = disk.server.send("GET", &format!("{first}/mesh"), "", &[]).unwrap();
    assert!(status == 200 && kept == scan(0), "{status}");
    assert_eq!(disk.status("GET", "/healthz", &[]).0, 200);
    assert_eq!(disk.status("DELETE", &first, &[]).0, 204);
    disk.wait_for(201, "POST", "/v1/scans", &scan(100));
    disk.wait_for(200, "GET", "/readyz", &[]);
}

#[test]
fn a_disk_that_cannot_be_written_is_named_at_the_start() {
    if !may_mount() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let data = folder.path().join("data");
    std::fs::create_dir(&data).unwrap();
    let mut command = on_own_disk("ro", folder.path());
    let output = command.args(["serve", "--listen", "127.0.0.1:0", "--data"]).arg(&data).output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains("cannot be used as data folder") && said.contains("Read-only"), "{said}");
}

#[test]
fn a_folder_that_cannot_be_used_is_named_at_the_start() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a-file");
    std::fs::write(&file, "").unwrap();
    let refused = |data: &Path| {
        let command = Command::new(env!("CARGO_BIN_EXE_onemesh"))
            .args(["serve", "--listen", "127.0.0.1:0", "--data"])
            .arg(data)
            .output()
            .unwrap();
        assert_eq!(command.status.code(), Some(1));
        String::from_utf8_lossy(&command.stderr).into_owned()
    };
    let said = refused(&file.join("data"));
    assert!(said.contains("a-file") && said.contains("cannot be used as data folder"), "{said}");
    let data = folder.path().join("data");
    let _server = Server::start(&data);
    let said = refused(&data);
    assert!(said.contains("another onemesh works in this data folder"), "{said}");
}

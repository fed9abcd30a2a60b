use std::io::{BufRead, BufReader};
use std::process::{Child, Stdio};

use tempfile::TempDir;

use crate::common::command;

/// The program as a server over a data folder of its own; killed when it is dropped.
pub struct Server {
    /// `http://HOST:PORT`.
    pub url: String,
    child: Child,
    folder: TempDir,
}

impl Server {
    pub fn start() -> Self {
        Self::with(&[])
    }

    /// One with further arguments.
    pub fn with(arguments: &[&str]) -> Self {
        Self::over(tempfile::tempdir().unwrap(), "127.0.0.1:0", arguments)
    }

    /// Kills it and starts another at its address, over what it has kept.
    pub fn killed_and_started_again(mut self) -> Self {
        self.end();
        let folder = std::mem::replace(&mut self.folder, tempfile::tempdir().unwrap());
        Self::over(folder, self.url.trim_start_matches("http://"), &[])
    }

    fn over(folder: TempDir, address: &str, arguments: &[&str]) -> Self {
        let mut child = command()
            .args(["serve", "--listen", address, "--set", "data.keep_free_bytes=0", "--data"])
            .arg(folder.path().join("data"))
            .args(arguments)
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
        let line = lines.next().expect("the server says where it listens").unwrap();
        let url = line.strip_prefix("listening on ").unwrap_or_else(|| panic!("{line}")).to_owned();
        Self { url, child, folder }
    }

    fn end(&mut self) {
        // It may have ended by itself.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.end();
    }
}

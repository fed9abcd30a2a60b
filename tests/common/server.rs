//! The program as a server that can be killed.

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};

/// A running server; killed when it is dropped.
pub struct Server {
    /// `http://HOST:PORT`.
    pub url: String,
    child: Child,
}

impl Server {
    /// Starts the program over a data folder, on a port of its own, and waits until it listens.
    pub fn start(folder: &Path) -> Self {
        Self::with(folder, "127.0.0.1:0", &[])
    }

    /// One at an address, with further arguments.
    pub fn with(folder: &Path, address: &str, arguments: &[&str]) -> Self {
        Self::by(Command::new(env!("CARGO_BIN_EXE_onemesh")), folder, address, arguments)
    }

    /// One that is run by a command of which the program's arguments are the last.
    pub fn by(mut command: Command, folder: &Path, address: &str, arguments: &[&str]) -> Self {
        let mut child = command
            .args(["serve", "--listen", address, "--set", "data.keep_free_bytes=0", "--data"])
            .arg(folder)
            .args(arguments)
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
        let line = lines.next().expect("the server says where it listens").unwrap();
        let url = line.strip_prefix("listening on ").unwrap_or_else(|| panic!("{line}")).to_owned();
        Self { url, child }
    }

    /// Ends it at once, as a loss of power would.
    pub fn kill(mut self) {
        // SIGKILL: nothing of the program runs after it.
        self.child.kill().unwrap();
        self.child.wait().unwrap();
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        // It may have been killed before.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

use std::fs::File;
use std::io::{self, BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Instant;

use anyhow::{Context, ensure};
use onemesh::formats::ply_bytes;

use super::clock::row;
use super::{memory, sculpt};

/// Triangles of a scan that is sent before, so that the program's own pages are not counted.
const SMALL: usize = 2_000;

/// A server of its own is sent a scan of so many triangles: the memory that it takes beside the parsed mesh's.
pub fn upload(triangles: usize) -> anyhow::Result<()> {
    let folder = tempfile::tempdir()?;
    let sculpted = |name: &str, triangles| {
        let (file, mesh) = (folder.path().join(name), sculpt(1, triangles).remove(0).mesh);
        std::fs::write(&file, ply_bytes(&mesh))?;
        anyhow::Ok((file, mesh))
    };
    let (small, _) = sculpted("small.ply", SMALL)?;
    let (file, mesh) = sculpted("scan.ply", triangles)?;
    let parsed = (24 * mesh.positions().len() + 12 * mesh.triangles().len()) as f64 / f64::from(1 << 20);
    let triangles = mesh.triangles().len();
    drop(mesh);
    let server = Server::start(&folder.path().join("data"))?;
    send(&server.address, &small)?;
    let before =
        memory::peak_of(server.child.id()).context("the system does not say what memory a program has")?;
    let start = Instant::now();
    send(&server.address, &file)?;
    let took = start.elapsed();
    let peak = memory::peak_of(server.child.id()).context("the server ended")?;
    let taken = peak - before;
    let name = format!(
        "upload of {triangles} triangles: {taken:.0} MiB more than before ({before:.0}), {:.2} times the parsed mesh ({parsed:.0})",
        taken / parsed
    );
    row(&name, &[took]);
    Ok(())
}

/// This program as a server; killed when it is dropped.
struct Server {
    child: Child,
    address: String,
}

impl Server {
    fn start(data: &Path) -> anyhow::Result<Self> {
        let mut child = Command::new(std::env::current_exe()?)
            .args(["serve", "--listen", "127.0.0.1:0", "--set", "data.keep_free_bytes=0", "--data"])
            .arg(data)
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()?;
        let mut line = String::new();
        let said = child.stdout.take().context("the server says nothing")?;
        BufReader::new(said).read_line(&mut line)?;
        let address =
            line.trim().strip_prefix("listening on http://").context("the server does not listen")?;
        Ok(Self { child, address: address.to_owned() })
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Sends a file as a scan, a little at a time.
fn send(address: &str, file: &Path) -> anyhow::Result<()> {
    let mut stream = TcpStream::connect(address)?;
    let length = file.metadata()?.len();
    write!(
        stream,
        "POST /v1/scans HTTP/1.0\r\nHost: {address}\r\nContent-Type: model/ply\r\nContent-Length: {length}\r\n\r\n"
    )?;
    io::copy(&mut File::open(file)?, &mut stream)?;
    let mut answer = String::new();
    stream.read_to_string(&mut answer)?;
    ensure!(answer.starts_with("HTTP/1.0 201"), "{answer}");
    Ok(())
}

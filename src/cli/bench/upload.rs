use std::fs::File;
use std::io::{self, BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Instant;

use anyhow::{Context, ensure};
use onemesh::formats::ply_bytes;
use onemesh::mesh::TriangleMesh;

use super::clock::row;
use super::{memory, sculpt};

/// Triangles of a scan that is sent before, so that the program's own pages are not counted.
const SMALL: usize = 2_000;

/// A server of its own is sent a scan of so many triangles, in the single precision that scanners write and in double:
/// the memory that it takes beside that of the mesh as it is registered.
pub fn upload(triangles: usize) -> anyhow::Result<()> {
    let folder = tempfile::tempdir()?;
    let small = folder.path().join("small.ply");
    std::fs::write(&small, ply_bytes(&sculpt(1, SMALL).remove(0).mesh))?;
    let mesh = sculpt(1, triangles).remove(0).mesh;
    for (precision, bytes) in [("single", single_ply_bytes(&mesh)), ("double", ply_bytes(&mesh))] {
        let file = folder.path().join(format!("{precision}.ply"));
        std::fs::write(&file, bytes)?;
        measure(&folder.path().join(format!("data-{precision}")), &small, &file, &mesh)
            .with_context(|| precision.to_owned())?;
    }
    Ok(())
}

fn measure(data: &Path, small: &Path, file: &Path, mesh: &TriangleMesh) -> anyhow::Result<()> {
    let parsed = (24 * mesh.positions().len() + 12 * mesh.triangles().len()) as f64 / f64::from(1 << 20);
    let triangles = mesh.triangles().len();
    let server = Server::start(data)?;
    send(&server.address, small)?;
    let before =
        memory::peak_of(server.child.id()).context("the system does not say what memory a program has")?;
    let start = Instant::now();
    send(&server.address, file)?;
    let took = start.elapsed();
    let peak = memory::peak_of(server.child.id()).context("the server ended")?;
    let taken = peak - before;
    let precision = file.file_stem().unwrap_or_default().display();
    let name = format!(
        "upload of {triangles} triangles, {precision} precision: {taken:.0} MiB more than before ({before:.0}), {:.2} times the parsed mesh ({parsed:.0})",
        taken / parsed
    );
    row(&name, &[took]);
    Ok(())
}

/// A mesh as binary PLY, coordinates as floats.
fn single_ply_bytes(mesh: &TriangleMesh) -> Vec<u8> {
    let mut bytes = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        mesh.positions().len(),
        mesh.triangles().len()
    )
    .into_bytes();
    for position in mesh.positions() {
        bytes.extend(position.as_vec3().to_array().into_iter().flat_map(f32::to_le_bytes));
    }
    for corners in mesh.triangles() {
        bytes.push(3);
        bytes.extend(corners.iter().flat_map(|corner| corner.to_le_bytes()));
    }
    bytes
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

use std::fs::{self, File, OpenOptions};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

use onemesh::formats::Sha256;
use sha2::Digest;
use ureq::Body;
use ureq::http::Response;

use super::failure::Failure;
use super::request::{Client, header_of};

/// Bytes that are read at once.
const PIECE: usize = 1 << 16;

/// Downloads a file to `target`: under another name first, from where an earlier try ended, and renamed when its digest
/// is the one that the server states. A file that is there already with this digest stays. Gives the digest.
///
/// # Errors
/// [`Failure`]; what came until then is kept for the next try.
pub fn download(client: &Client, path: &str, target: &Path) -> Result<Sha256, Failure> {
    let part = part_of(target);
    let mut pauses = client.patience.pauses();
    loop {
        let before = length(&part);
        match attempt(client, path, target, &part) {
            Err(failure) if failure.passes() => {
                if length(&part) > before {
                    pauses = client.patience.pauses();
                }
                pauses.rest(failure)?;
            }
            outcome => return outcome,
        }
    }
}

/// The name of a file that is not whole.
fn part_of(target: &Path) -> PathBuf {
    let name = target.file_name().unwrap_or_default().to_string_lossy();
    target.with_file_name(format!(".{name}.part"))
}

fn length(path: &Path) -> u64 {
    fs::metadata(path).map_or(0, |file| file.len())
}

fn attempt(client: &Client, path: &str, target: &Path, part: &Path) -> Result<Sha256, Failure> {
    let there = digest_of(target).ok();
    let tag = there.map(|digest| format!("\"{digest}\""));
    let start = length(part);
    let range = format!("bytes={start}-");
    let mut headers = Vec::new();
    headers.extend(tag.as_deref().map(|tag| ("if-none-match", tag)));
    if start > 0 {
        headers.push(("range", range.as_str()));
    }
    let answer = match client.get(path, &headers) {
        // What is there is of another file, or whole and not looked at.
        Err(failure) if failure.status() == Some(416) => {
            fs::remove_file(part).map_err(|error| Failure::file(part, error))?;
            return Err(Failure::Connection(format!("{path}: begins anew")));
        }
        answer => answer?,
    };
    if let (304, Some(sha256)) = (answer.status().as_u16(), there) {
        return Ok(sha256);
    }
    let resumed = answer.status().as_u16() == 206;
    let stated = header_of(&answer, "etag").and_then(|tag| tag.trim_matches('"').parse::<Sha256>().ok());
    write(answer, part, resumed)?;
    let sha256 = digest_of(part).map_err(|error| Failure::file(part, error))?;
    if stated.is_some_and(|stated| stated != sha256) {
        fs::remove_file(part).map_err(|error| Failure::file(part, error))?;
        let found = format!("{path}: what came is not what the server has");
        return Err(if resumed { Failure::Connection(found) } else { Failure::Odd(found) });
    }
    fs::rename(part, target).map_err(|error| Failure::file(target, error))?;
    Ok(sha256)
}

/// Writes an answer to a file, after what is there if it is `resumed`.
fn write(answer: Response<Body>, path: &Path, resumed: bool) -> Result<(), Failure> {
    let failed = |error| Failure::file(path, error);
    let mut options = OpenOptions::new();
    options.create(true).write(true).append(resumed).truncate(!resumed);
    let mut file = options.open(path).map_err(failed)?;
    let mut reader = answer.into_body().into_reader();
    let mut piece = vec![0; PIECE];
    loop {
        let count = reader.read(&mut piece).map_err(|error| Failure::Connection(error.to_string()))?;
        if count == 0 {
            return file.sync_all().map_err(failed);
        }
        file.write_all(&piece[..count]).map_err(failed)?;
    }
}

fn digest_of(path: &Path) -> io::Result<Sha256> {
    let mut hasher = sha2::Sha256::new();
    let mut file = File::open(path)?;
    let mut piece = vec![0; PIECE];
    loop {
        match file.read(&mut piece)? {
            0 => return Ok(hasher.into()),
            count => hasher.update(&piece[..count]),
        }
    }
}

use std::fs::{self, File};
use std::io::{self, Cursor, Read};
use std::path::{Path, PathBuf};

use zip::ZipArchive;
use zip::result::ZipError;

use super::fault::{Part, ScanFault};
use super::limits::ScanLimits;
use super::picture::check_picture;
use crate::formats::MeshFormat;

/// Ends of the names of files that belong to a mesh; all others are left packed.
const USEFUL: [&str; 13] =
    ["obj", "ply", "stl", "glb", "gltf", "mtl", "bin", "png", "jpg", "jpeg", "tga", "bmp", "tif"];
/// Of these, pictures whose size can be told.
const PICTURES: [&str; 3] = ["png", "jpg", "jpeg"];

/// Unpacks a zip into a folder, as far as it belongs to its one mesh, and says where that is.
///
/// Nothing is believed of what the zip says of sizes: bytes are counted as they come out.
pub(super) fn unpack(bytes: &[u8], folder: &Path, limits: &ScanLimits) -> Result<PathBuf, ScanFault> {
    let mut archive = ZipArchive::new(Cursor::new(bytes)).map_err(damaged)?;
    if archive.len() > limits.zip_files {
        let (found, limit) = (archive.len() as u64, limits.zip_files as u64);
        let remedy = "zip the mesh and what it names, nothing else";
        return Err(ScanFault::TooLarge { part: Part::Mesh, what: "files in its zip", found, limit, remedy });
    }
    let mut left = limits.unpacked_bytes;
    let mut meshes = Vec::new();
    for at in 0..archive.len() {
        let entry = archive.by_index(at).map_err(damaged)?;
        let Some(name) = entry.enclosed_name().filter(|name| entry.is_file() && useful(name)) else {
            continue;
        };
        let path = folder.join(&name);
        left -= extract(entry, &path, left, limits)?;
        let extension = name.extension().and_then(|extension| extension.to_str());
        if extension.and_then(MeshFormat::of_extension).is_some() {
            meshes.push(path);
        } else if extension.is_some_and(|extension| one_of(extension, &PICTURES)) {
            check_picture(&fs::read(&path).map_err(ScanFault::Scratch)?, Part::Mesh, limits.texture_pixels)?;
        }
    }
    match <[PathBuf; 1]>::try_from(meshes) {
        Ok([mesh]) => Ok(mesh),
        Err(meshes) => Err(unfit(format!("the zip holds {} meshes: put in exactly one", meshes.len()))),
    }
}

/// Writes a packed file out and counts its bytes.
fn extract(entry: impl Read, path: &Path, left: u64, limits: &ScanLimits) -> Result<u64, ScanFault> {
    if let Some(parent) = path.parent() {
        fs::create_dir_all(parent).map_err(ScanFault::Scratch)?;
    }
    let mut file = File::create(path).map_err(ScanFault::Scratch)?;
    let size = io::copy(&mut entry.take(left + 1), &mut file)
        .map_err(|error| unfit(format!("the zip cannot be unpacked: {error}")))?;
    if size > left {
        let (what, limit) = ("bytes when it is unpacked", limits.unpacked_bytes);
        let remedy = "send less, or a smaller texture";
        return Err(ScanFault::TooLarge { part: Part::Mesh, what, found: limit + 1, limit, remedy });
    }
    Ok(size)
}

fn useful(name: &Path) -> bool {
    let hidden = name.components().any(|part| {
        let part = part.as_os_str().to_string_lossy();
        part.starts_with('.') || part == "__MACOSX"
    });
    !hidden && name.extension().and_then(|e| e.to_str()).is_some_and(|e| one_of(e, &USEFUL))
}

fn one_of(extension: &str, known: &[&str]) -> bool {
    known.iter().any(|known| known.eq_ignore_ascii_case(extension))
}

fn damaged(error: ZipError) -> ScanFault {
    unfit(format!("is a zip that cannot be read: {error}; pack it again"))
}

fn unfit(problem: String) -> ScanFault {
    ScanFault::Unfit { part: Part::Mesh, problem }
}

use std::fs::{self, File};
use std::path::{Path, PathBuf};

use super::fault::{Part, ScanFault};
use super::limits::ScanLimits;
use super::picture::check_picture;
use crate::formats::MeshFormat;
use crate::job::archive::{self, ArchiveFault, ArchiveLimits, ends_in};

/// Ends of the names of files that belong to a mesh; all others are left packed.
const USEFUL: [&str; 13] =
    ["obj", "ply", "stl", "glb", "gltf", "mtl", "bin", "png", "jpg", "jpeg", "tga", "bmp", "tif"];
/// Of these, pictures whose size can be told.
const PICTURES: [&str; 3] = ["png", "jpg", "jpeg"];

/// Unpacks a zip into a folder, as far as it belongs to its one mesh, and says where that is.
pub(super) fn unpack(zip: &File, folder: &Path, limits: &ScanLimits) -> Result<PathBuf, ScanFault> {
    let most = ArchiveLimits { files: limits.zip_files, bytes: limits.unpacked_bytes };
    let names = archive::unpack(zip, folder, most, |name| ends_in(name, &USEFUL));
    let mut meshes = Vec::new();
    for name in names.map_err(|fault| fault_of(fault, limits))? {
        let path = folder.join(&name);
        let extension = name.extension().and_then(|extension| extension.to_str());
        if extension.and_then(MeshFormat::of_extension).is_some() {
            meshes.push(path);
        } else if ends_in(&name, &PICTURES) {
            check_picture(&fs::read(&path).map_err(ScanFault::Scratch)?, Part::Mesh, limits.texture_pixels)?;
        }
    }
    match <[PathBuf; 1]>::try_from(meshes) {
        Ok([mesh]) => Ok(mesh),
        Err(meshes) => Err(unfit(format!("the zip holds {} meshes: put in exactly one", meshes.len()))),
    }
}

fn fault_of(fault: ArchiveFault, limits: &ScanLimits) -> ScanFault {
    let too_large =
        |what, found, limit, remedy| ScanFault::TooLarge { part: Part::Mesh, what, found, limit, remedy };
    match fault {
        ArchiveFault::Damaged(problem) => unfit(problem),
        ArchiveFault::TooMany(found) => {
            let remedy = "zip the mesh and what it names, nothing else";
            too_large("files in its zip", found, limits.zip_files as u64, remedy)
        }
        ArchiveFault::TooLong => {
            let (what, limit) = ("bytes when it is unpacked", limits.unpacked_bytes);
            too_large(what, limit + 1, limit, "send less, or a smaller texture")
        }
        ArchiveFault::Folder(error) => ScanFault::Scratch(error),
    }
}

fn unfit(problem: String) -> ScanFault {
    ScanFault::Unfit { part: Part::Mesh, problem }
}

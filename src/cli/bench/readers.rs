use std::hint::black_box;

use glam::DVec2;
use onemesh::formats::{Glb, MeshFile, MeshFormat, glb_bytes, obj_bytes, ply_bytes};
use onemesh::mesh::TriangleMesh;

use super::clock::Clock;

/// Reading a mesh from memory, in each format.
pub fn readers(clock: &Clock, name: &str, mesh: &TriangleMesh) -> anyhow::Result<()> {
    let coordinates = vec![DVec2::splat(0.5); mesh.positions().len()];
    let glb = Glb { texture_coordinates: Some(&coordinates), ..Glb::new(mesh) };
    let files = [
        ("binary PLY", MeshFormat::Ply, ply_bytes(mesh)),
        ("GLB", MeshFormat::Gltf, foreign(glb_bytes(&glb)?)),
        ("OBJ", MeshFormat::Obj, obj_bytes(mesh)),
        ("OBJ with texture coordinates and colours", MeshFormat::Obj, textured_obj(mesh)),
        ("binary STL", MeshFormat::Stl, stl(mesh)),
    ];
    for (format, kind, bytes) in files {
        MeshFile::parse(&bytes, kind)?;
        clock.kernel(&format!("read {format} ({name})"), || {
            // That it can be read is known by now.
            let _ = black_box(MeshFile::parse(&bytes, kind));
        });
    }
    Ok(())
}

/// A GLB as another program's, so that its seams are sought.
fn foreign(mut glb: Vec<u8>) -> Vec<u8> {
    if let Some(at) = glb.windows(7).position(|window| window == b"onemesh") {
        glb[at..at + 7].copy_from_slice(b"another");
    }
    glb
}

/// As scanners write it: a colour at each vertex, texture coordinates at each corner.
fn textured_obj(mesh: &TriangleMesh) -> Vec<u8> {
    let vertices = mesh.positions().iter().map(|p| format!("v {} {} {} 0.5 0.25 0.125\n", p.x, p.y, p.z));
    let coordinates = mesh.positions().iter().map(|p| format!("vt {} {}\n", p.x, p.y));
    let corner = |index: u32| format!(" {0}/{0}", index + 1);
    let faces = mesh.triangles().iter().map(|corners| format!("f{}\n", corners.map(corner).concat()));
    vertices.chain(coordinates).chain(faces).collect::<String>().into_bytes()
}

fn stl(mesh: &TriangleMesh) -> Vec<u8> {
    let mut out = vec![0; 80];
    out.extend((mesh.triangles().len() as u32).to_le_bytes());
    for corners in mesh.triangles() {
        out.extend([0; 12]);
        let points = corners.map(|index| mesh.positions()[index as usize].as_vec3().to_array());
        out.extend(points.iter().flatten().flat_map(|x| x.to_le_bytes()));
        out.extend([0; 2]);
    }
    out
}

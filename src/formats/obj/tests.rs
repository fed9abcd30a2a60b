use glam::{DVec2, DVec3};

use super::obj_bytes;
use crate::formats::{MeshFile, MeshFormat, Texture, TextureImage, parse_mesh};
use crate::mesh::TriangleMesh;

fn mesh(text: &[u8]) -> TriangleMesh {
    parse_mesh(text, MeshFormat::Obj).unwrap()
}

fn complaint(text: &[u8]) -> String {
    parse_mesh(text, MeshFormat::Obj).unwrap_err().to_string()
}

const CORNERS: &str = "v 0 0 0\nv 1 0 0 1.0\nv 1 1 0 0.5 0.5 0.5 # colour\nv 0 1 0\n";

fn with_faces(faces: &str) -> Vec<u8> {
    format!("{CORNERS}{faces}").into_bytes()
}

#[test]
fn corners_are_named_in_every_way() {
    for faces in [
        "f 1 2 3 4",
        "f 1/1 2/2 3/3 4/4 # quad",
        "vn 0 0 1\nf 1//1 2//1 3//1 4//1",
        "f -4/-4/-4 -3 -2 -1",
        "f 1 2\\\n 3 \\\r\n4",
        "o caf\u{e9}\ng a b\ns off\nusemtl m\nl 1 2\np 1\nf 1 2\nf\t1 2 3 4\r\n",
    ] {
        assert_eq!(mesh(&with_faces(faces)).triangles(), [[0, 1, 2], [0, 2, 3]], "{faces}");
    }
}

#[test]
fn vertices_keep_their_number_and_order() {
    let mesh = mesh(b"f 3 2 1\nv 9 9 9\nv 1.5 -2e1 .25\nv 0 1 0\nv 7 7 7");
    assert_eq!(mesh.triangles(), [[2, 1, 0]]);
    assert_eq!(mesh.positions()[1], DVec3::new(1.5, -20.0, 0.25));
    assert_eq!(mesh.positions().len(), 4);
}

#[test]
fn complaints_name_the_line() {
    assert!(complaint(b"v 0 0 0\nv 1 nan 0").contains("line 2: the vertex's y is `nan`"));
    assert!(complaint(b"v 0 0").contains("line 1: the vertex has no z"));
    assert!(complaint(b"v 0 0 1e999").contains("line 1"));
    for face in ["f 1 2 0", "f 1 2 -5", "f 1 2 x", "f 1 2 /3", "f 1 2 1.5", "f 1 2 99999999999"] {
        assert!(complaint(&with_faces(face)).contains("line 5: the face's corner"), "{face}");
    }
    let beyond = complaint(&with_faces("f 1 2 3\nf 1 2 4294967296\nf 1 2 9"));
    assert!(beyond.contains("line 6: the face names vertex 4294967296, but the file has 4"), "{beyond}");
}

#[test]
fn what_holds_no_mesh_is_refused() {
    for text in ["", "\0\u{1}garbage", CORNERS, "v 1 1 1\nv 1 1 1\nv 1 1 1\nf 1 2 3"] {
        assert!(parse_mesh(text.as_bytes(), MeshFormat::Obj).is_err(), "{text}");
    }
}

#[test]
fn what_is_written_is_read_back() {
    let text = "v 0.1 -3e-7 123456789.123\nv 1 0 0\nv 0 1e20 0\nv 5 5 5\nf 2 1 3";
    let original = mesh(text.as_bytes());
    assert_eq!(mesh(&obj_bytes(&original)), original);
}

fn file_in(folder: &std::path::Path) -> MeshFile {
    MeshFile::read(folder.join("scan.obj")).unwrap()
}

#[test]
fn polygons_coordinates_and_pictures_are_kept_as_they_are() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write(
        "scan.obj",
        &format!(
            "mtllib ./a b.mtl\n{CORNERS}vt 0 0\nvt 1 0 0\nvt .1\nf 1/1 2/2 3/3\nusemtl skin\nf 1/-1 2/1 3 4//7\n\
             usemtl lost\nf 1 2\nf 1 2 4\n"
        ),
    );
    write(
        "a b.mtl",
        "newmtl skin\n map_kd -s 1 1 1 pic\\skin 1.png\nnewmtl lost\nmap_Kd lost.png\nmap_Kd ../up.png",
    );
    std::fs::create_dir(folder.path().join("pic")).unwrap();
    write("pic/skin 1.png", "not looked at");
    let mut file = file_in(folder.path());
    file.warnings.retain(|warning| !warning.contains("colours"));
    let polygons = file.polygons();
    let polygons: Vec<_> = polygons.iter().collect();
    assert_eq!(polygons, [&[0, 1, 2][..], &[0, 1, 2, 3], &[0, 1, 3]]);
    assert_eq!(file.mesh.triangles(), [[0, 1, 2], [0, 1, 2], [0, 2, 3], [0, 1, 3]]);
    let texture = file.texture.unwrap();
    let none = Texture::NONE;
    assert_eq!(texture.coordinates, [DVec2::ZERO, DVec2::X, DVec2::new(0.1, 0.0)]);
    assert_eq!(texture.corners, [0, 1, 2, 2, 0, none, none, none, none, none]);
    assert_eq!(texture.polygon_images, [none, 0, none]);
    assert_eq!(texture.image(1), Some(&TextureImage::File(folder.path().join("pic/skin 1.png"))));
    assert_eq!((texture.image(0), texture.coordinate(5)), (None, None));
    assert!(file.warnings[0].contains("a b.mtl, line 4: `map_Kd` names `lost.png`"), "{:?}", file.warnings);
    assert!(
        file.warnings[1].contains("line 5") && file.warnings[1].contains("only files in the same folder")
    );
}

#[test]
fn colours_are_taken_where_all_vertices_have_them() {
    let colours = |text: &str| MeshFile::parse(text.as_bytes(), MeshFormat::Obj).unwrap().colours;
    let of_one = "v 0 0 0 0 0.5 1\nv 1 0 0 1 1 1\nv 0 1 0 0 0 0\nf 1 2 3";
    assert_eq!(colours(of_one).unwrap(), [[0, 128, 255, 255], [255; 4], [0, 0, 0, 255]]);
    assert_eq!(colours(&of_one.replace("0.5", "128")).unwrap()[0], [0, 128, 1, 255]);
    let partly = MeshFile::parse(&with_faces("f 1 2 3"), MeshFormat::Obj).unwrap();
    assert!(partly.colours.is_none() && partly.warnings[0].contains("only 1 of 4 vertices"));
}

#[test]
fn mistakes_in_textures_leave_the_mesh_whole() {
    for (text, said) in [
        ("vt 0 0\nf 1/1 2/2 3/1", "line 6: the face names `vt` 2, but the file has 1"),
        ("vt nan 0\nf 1/1 2/1 3/1", "line 5: `vt`"),
        ("vt 0 0\nf 1/x 2/1 3/1", "texture coordinates `x`"),
        ("vt 0 0\nf 1/-2 2/1 3/1", "texture coordinates `-2`"),
        ("mtllib a.mtl\nvt 0 0\nf 1/1 2/1 3/1", "`mtllib` names the file `a.mtl`, which is not here"),
    ] {
        let file = MeshFile::parse(&with_faces(text), MeshFormat::Obj).unwrap();
        assert_eq!(file.mesh.triangles(), [[0, 1, 2]]);
        assert!(file.warnings.iter().any(|warning| warning.contains(said)), "{:?}", file.warnings);
    }
    let folder = tempfile::tempdir().unwrap();
    let text =
        CORNERS.replace(" 0.5 0.5 0.5", "") + "mtllib /etc/passwd\nmtllib lost.mtl\nvt 0 0\nf 1/1 2/1 3/1";
    std::fs::write(folder.path().join("scan.obj"), text).unwrap();
    let warnings = file_in(folder.path()).warnings;
    assert!(warnings[0].contains("only files in the same folder"), "{warnings:?}");
    assert!(warnings[1].contains("lost.mtl: cannot be read"), "{warnings:?}");
}

use glam::DVec2;
use serde_json::{Value, json};

use super::{data_uri, square, square_bytes, with};
use crate::formats::{MeshFile, MeshFormat, Texture, TextureImage};

/// The square with texture coordinates, colours and two pictures, its second triangle without a picture.
fn textured() -> Value {
    let mut bytes = square_bytes();
    bytes.extend([0u8, 0, 255, 0, 255, 255, 0, 255]);
    bytes
        .extend([0u16, 0, 0, 65535, 65535, 65535, 0, 0, 65535, 1, 1, 1].iter().flat_map(|c| c.to_le_bytes()));
    let mut document = with("/buffers/0", json!({ "byteLength": bytes.len(), "uri": data_uri(&bytes) }));
    let view =
        |offset: usize, length: usize| json!({ "buffer": 0, "byteOffset": offset, "byteLength": length });
    let views = document["bufferViews"].as_array_mut().unwrap();
    views.extend([view(60, 8), view(68, 24)]);
    let accessors = document["accessors"].as_array_mut().unwrap();
    accessors[1]["count"] = json!(3);
    accessors.extend([
        json!({ "bufferView": 1, "byteOffset": 6, "componentType": 5123, "count": 3, "type": "SCALAR" }),
        json!({ "bufferView": 2, "componentType": 5121, "normalized": true, "count": 4, "type": "VEC2" }),
        json!({ "bufferView": 3, "componentType": 5123, "normalized": true, "count": 4, "type": "VEC3" }),
    ]);
    let attributes = json!({ "POSITION": 0, "TEXCOORD_0": 3, "COLOR_0": 4 });
    document["meshes"] = json!([{ "primitives": [
        { "attributes": attributes, "indices": 1, "material": 0 },
        { "attributes": attributes, "indices": 2 },
    ] }]);
    document["materials"] = json!([{ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } }]);
    document["textures"] = json!([{ "source": 1 }]);
    document["images"] = json!([{ "uri": "lost.png" }, { "bufferView": 1, "mimeType": "image/png" }]);
    document
}

fn file(document: &Value) -> MeshFile {
    MeshFile::parse(document.to_string().as_bytes(), MeshFormat::Gltf).unwrap()
}

#[test]
fn colours_coordinates_and_pictures_are_read() {
    let read = file(&textured());
    assert_eq!(read.warnings, [""; 0]);
    assert_eq!(read.mesh, super::read(&square()));
    assert_eq!(read.colours.unwrap()[..2], [[0, 0, 0, 255], [255; 4]]);
    let texture = read.texture.unwrap();
    assert_eq!(texture.coordinates, [DVec2::ZERO, DVec2::X, DVec2::ONE, DVec2::Y]);
    assert_eq!(texture.corners, [0, 1, 2, 0, 2, 3]);
    assert_eq!(texture.polygon_images, [0, Texture::NONE]);
    let embedded = TextureImage::Embedded {
        media_type: Some("image/png".to_owned()),
        bytes: square_bytes()[48..].to_vec(),
    };
    assert_eq!(texture.images, [embedded]);
    let mut encoded = textured();
    encoded["images"][1] = json!({ "uri": "data:image/jpeg;base64,AAEC" });
    let image = TextureImage::Embedded { media_type: Some("image/jpeg".to_owned()), bytes: vec![0, 1, 2] };
    assert_eq!(file(&encoded).texture.unwrap().images, [image]);
}

#[test]
fn a_picture_beside_the_file_is_found_or_missed() {
    let folder = tempfile::tempdir().unwrap();
    let mut document = textured();
    document["images"][1] = json!({ "uri": "the%20skin.png" });
    let path = folder.path().join("scan.gltf");
    std::fs::write(&path, document.to_string()).unwrap();
    let missed = MeshFile::read(&path).unwrap();
    assert!(
        missed.warnings[0].contains("images[1]: names `the skin.png`, which is not there"),
        "{:?}",
        missed.warnings
    );
    let texture = missed.texture.unwrap();
    assert_eq!((texture.images.len(), texture.image(0)), (0, None));
    std::fs::write(folder.path().join("the skin.png"), "").unwrap();
    let texture = MeshFile::read(&path).unwrap().texture.unwrap();
    assert_eq!(texture.image(0), Some(&TextureImage::File(folder.path().join("the skin.png"))));
}

#[test]
fn mistakes_in_textures_leave_the_mesh_whole() {
    for (path, value, said) in [
        ("/accessors/3/type", json!("VEC3"), "accessors[3]: is of type VEC3"),
        ("/accessors/3/count", json!(3), "accessors[3]: has 3 texture coordinates for 4 vertices"),
        ("/accessors/4/count", json!(2), "accessors[4]: has 2 colours for 4 vertices"),
        ("/bufferViews/2/byteLength", json!(7), "accessors[3]: has 4 values"),
        ("/textures/0", json!({}), "textures[0]: has no plain picture"),
        ("/textures/0/source", json!(9), "images[9]: is named"),
        ("/images/1", json!({}), "images[1]: has neither"),
        ("/images/1", json!({ "uri": "../x.png" }), "images[1]: names"),
        (
            "/materials/0/pbrMetallicRoughness/baseColorTexture",
            json!({ "index": 7 }),
            "textures[7]: is named",
        ),
        ("/materials", json!([]), "materials[0]: is named"),
    ] {
        let mut document = textured();
        *document.pointer_mut(path).unwrap() = value;
        let read = file(&document);
        assert_eq!(read.mesh, super::read(&square()));
        assert_eq!(read.warnings.len(), 1, "{:?}", read.warnings);
        assert!(read.warnings[0].contains(said), "{:?}", read.warnings);
    }
}

#[test]
fn seams_keep_their_coordinates() {
    let corners = [[0.0f32, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let mut bytes: Vec<u8> =
        corners.iter().flat_map(|&[x, y]| [x, y, 0.0]).flat_map(f32::to_le_bytes).collect();
    bytes.extend((0..12u8).map(|i| i * 20));
    let mut document = with("/buffers/0", json!({ "byteLength": 84, "uri": data_uri(&bytes) }));
    document["bufferViews"] = json!([
        { "buffer": 0, "byteLength": 72 },
        { "buffer": 0, "byteOffset": 72, "byteLength": 12 },
    ]);
    document["accessors"] = json!([
        { "bufferView": 0, "componentType": 5126, "count": 6, "type": "VEC3" },
        { "bufferView": 1, "componentType": 5121, "count": 6, "type": "VEC2" },
    ]);
    document["meshes"] = json!([{ "primitives": [{ "attributes": { "POSITION": 0, "TEXCOORD_0": 1 } }] }]);
    let read = file(&document);
    assert_eq!(read.mesh, super::read(&square()));
    let texture = read.texture.unwrap();
    assert_eq!((texture.coordinates.len(), texture.corners), (6, vec![0, 1, 2, 3, 4, 5]));
}

#[test]
fn a_long_material_may_be_shared_by_many_primitives() {
    let mut document = textured();
    document["materials"][0]["name"] = json!("x".repeat(100_000));
    let primitive = document["meshes"][0]["primitives"][0].clone();
    document["meshes"][0]["primitives"] = json!(vec![primitive; 1000]);
    let read = file(&document);
    assert_eq!((read.polygons().len(), read.warnings.len()), (1000, 0));
    assert!(read.texture.unwrap().polygon_images.iter().all(|&image| image == 0));
}

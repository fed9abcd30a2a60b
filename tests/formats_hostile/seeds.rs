//! Small whole files of every format: a square of two triangles with all that their readers look at.

use base64::Engine;
use base64::prelude::BASE64_STANDARD;

/// Colours, texture coordinates, a material, continued lines, indices from the front and from the back.
pub const OBJ: &str = "mtllib skin.mtl\nv 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 1 1 0 0 0 1\nv 0 1 0 1 1 1\nvt 0 0\nvt 1 0\n\
                       vt 1 1\nusemtl skin\nf 1/1 2/2\\\n -2/-1\nf 1//1 3 4 # end\n";
/// Its material.
pub const MTL: &str =
    "# by hand\nnewmtl skin\nKd 1 1 1\nmap_Kd -s 1 1 1 -clamp on skin.png\nnewmtl other\nmap_Kd lost.png\n";

const CORNERS: [[f32; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
const FACES: [[u8; 3]; 2] = [[0, 1, 2], [0, 2, 3]];

fn ply_header(format: &str) -> String {
    format!(
        "ply\nformat {format} 1.0\ncomment TextureFile skin.png\nelement edge 1\nproperty list uchar int ends\n\
         element vertex 4\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\n\
         property uchar green\nproperty uchar blue\nproperty double s\nproperty double t\nelement face 2\n\
         property list uchar int vertex_indices\nproperty list uchar float texcoord\nproperty short texnumber\nend_header\n"
    )
}

/// Colours of vertices, texture coordinates of vertices and faces, an element before them.
pub fn ascii_ply() -> Vec<u8> {
    let rows = "2 0 1\n0 0 0 255 0 0 0 0\n1 0 0 0 255 0 1 0\n1 1 0 0 0 255 1 1\n0 1 0 9 9 9 0 1\n\
                3 0 1 2 6 0 0 1 0 1 1 0\n3 0 2 3 6 0 0 1 1 0 1 0\n";
    (ply_header("ascii") + rows).into_bytes()
}

/// The same in binary, `little` or `big` endian.
pub fn binary_ply(endian: &str) -> Vec<u8> {
    let mut out = ply_header(&format!("binary_{endian}_endian")).into_bytes();
    let mut add = |bytes: &[u8]| match endian {
        "big" => out.extend(bytes.iter().rev()),
        _ => out.extend(bytes),
    };
    add(&[2]);
    [0i32, 1].iter().for_each(|end| add(&end.to_le_bytes()));
    for corner in CORNERS {
        corner.iter().for_each(|x| add(&x.to_le_bytes()));
        [1, 2, 3].iter().for_each(|&channel| add(&[channel]));
        corner[..2].iter().for_each(|&x| add(&f64::from(x).to_le_bytes()));
    }
    for face in FACES {
        add(&[3]);
        face.iter().for_each(|&index| add(&i32::from(index).to_le_bytes()));
        add(&[6]);
        [0.0f32; 6].iter().for_each(|x| add(&x.to_le_bytes()));
        add(&[0, 0]);
    }
    out
}

/// Facets as text.
pub fn ascii_stl() -> Vec<u8> {
    let mut out = "solid square\n".to_owned();
    for face in FACES {
        out += "facet normal 0 0 1\nouter loop\n";
        for [x, y, z] in face.map(|index| CORNERS[usize::from(index)]) {
            out += &format!("vertex {x} {y} {z}\n");
        }
        out += "endloop\nendfacet\n";
    }
    (out + "endsolid square\n").into_bytes()
}

/// Facets in 50 bytes each, behind a header that begins as text does.
pub fn binary_stl() -> Vec<u8> {
    let mut out = b"solid, and yet binary".to_vec();
    out.resize(80, 0);
    out.extend((FACES.len() as u32).to_le_bytes());
    for face in FACES {
        out.extend([0; 12]);
        let corners = face.map(|index| CORNERS[usize::from(index)]);
        out.extend(corners.iter().flatten().flat_map(|x| x.to_le_bytes()));
        out.extend([0; 2]);
    }
    out
}

/// Positions, texture coordinates and colours of the square's corners, then its indices: 48, 8, 16 and 6 bytes.
fn buffer() -> Vec<u8> {
    let mut bytes: Vec<u8> = CORNERS.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
    bytes.extend([0u8, 0, 255, 0, 255, 255, 0, 255]);
    bytes.extend([200; 16]);
    bytes.extend(FACES.as_flattened());
    bytes
}

fn document(buffer: &str, sparse: &str) -> String {
    format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],
"nodes":[{{"children":[1],"translation":[1,2,3]}},{{"mesh":0,"rotation":[0,0,0,1],"scale":[2,2,2]}}],
"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"TEXCOORD_0":1,"COLOR_0":2}},"indices":3,"material":0}}]}}],
"materials":[{{"pbrMetallicRoughness":{{"baseColorTexture":{{"index":0,"texCoord":0}}}}}}],
"textures":[{{"source":0}}],"images":[{{"bufferView":2,"mimeType":"image/png"}},{{"uri":"skin.png"}}],
"accessors":[{{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"{sparse}}},
{{"bufferView":1,"componentType":5121,"normalized":true,"count":4,"type":"VEC2"}},
{{"bufferView":2,"componentType":5121,"normalized":true,"count":4,"type":"VEC4"}},
{{"bufferView":3,"componentType":5121,"count":6,"type":"SCALAR"}}],
"bufferViews":[{{"buffer":0,"byteLength":48}},{{"buffer":0,"byteOffset":48,"byteLength":8}},
{{"buffer":0,"byteOffset":56,"byteLength":16}},{{"buffer":0,"byteOffset":72,"byteLength":6}}],
"buffers":[{{"byteLength":78{buffer}}}]}}"#
    )
}

/// A node tree, a material, a picture, perhaps sparse positions.
pub fn gltf(sparse: bool) -> Vec<u8> {
    let uri =
        format!(r#","uri":"data:application/octet-stream;base64,{}""#, BASE64_STANDARD.encode(buffer()));
    let one =
        r#","sparse":{"count":1,"indices":{"bufferView":3,"componentType":5121},"values":{"bufferView":0}}"#;
    document(&uri, if sparse { one } else { "" }).into_bytes()
}

/// The same in a container.
pub fn glb() -> Vec<u8> {
    let (mut json, mut binary) = (document("", "").into_bytes(), buffer());
    json.resize(json.len().next_multiple_of(4), b' ');
    binary.resize(binary.len().next_multiple_of(4), 0);
    let mut out = b"glTF\x02\0\0\0".to_vec();
    out.extend((28 + json.len() as u32 + binary.len() as u32).to_le_bytes());
    for (kind, data) in [(b"JSON", json), (b"BIN\0", binary)] {
        out.extend((data.len() as u32).to_le_bytes());
        out.extend(kind);
        out.extend(data);
    }
    out
}

use super::stl;
use super::text::{Lines, without_mark, words};

/// The mesh formats that are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum MeshFormat {
    /// Wavefront OBJ.
    Obj,
    /// PLY: ascii, binary little-endian or binary big-endian.
    Ply,
    /// STL: ascii or binary.
    Stl,
    /// glTF 2.0, as JSON or as a binary container (GLB).
    Gltf,
}

const EXTENSIONS: [(&str, MeshFormat); 5] = [
    ("obj", MeshFormat::Obj),
    ("ply", MeshFormat::Ply),
    ("stl", MeshFormat::Stl),
    ("glb", MeshFormat::Gltf),
    ("gltf", MeshFormat::Gltf),
];
const OBJ_KEYWORDS: [&[u8]; 9] = [b"v", b"vn", b"vt", b"f", b"o", b"g", b"s", b"mtllib", b"usemtl"];

impl MeshFormat {
    /// The format of a file of `length` bytes, the first of them in `beginning`: as its content says, or else its
    /// extension (without the dot).
    pub fn sniff(beginning: &[u8], length: u64, extension: Option<&str>) -> Option<Self> {
        Self::of_content(beginning, length).or_else(|| Self::of_extension(extension?))
    }

    /// The format that files with this extension (without the dot, in any case) have.
    pub fn of_extension(extension: &str) -> Option<Self> {
        let found = EXTENSIONS.iter().find(|(known, _)| known.eq_ignore_ascii_case(extension));
        found.map(|&(_, format)| format)
    }

    fn of_content(bytes: &[u8], length: u64) -> Option<Self> {
        let text = without_mark(bytes);
        if bytes.starts_with(b"glTF") || text.trim_ascii_start().starts_with(b"{") {
            Some(Self::Gltf)
        } else if bytes.starts_with(b"ply\n") || bytes.starts_with(b"ply\r") {
            Some(Self::Ply)
        } else if stl::looks_like_stl(bytes, length) {
            Some(Self::Stl)
        } else {
            looks_like_obj(text).then_some(Self::Obj)
        }
    }
}

/// OBJ has no mark of its own: its first line that is no comment begins with one of its keywords.
fn looks_like_obj(text: &[u8]) -> bool {
    let firsts = Lines::new(text).filter_map(|line| words(line.text).next());
    let mut statements = firsts.filter(|word| !word.starts_with(b"#"));
    statements.next().is_some_and(|word| OBJ_KEYWORDS.contains(&word))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn content_goes_before_extension() {
        let sniff = |bytes: &[u8], extension| MeshFormat::sniff(bytes, bytes.len() as u64, extension);
        assert_eq!(sniff(b"ply\nformat", Some("obj")), Some(MeshFormat::Ply));
        assert_eq!(sniff(b"glTF\x02", Some("ply")), Some(MeshFormat::Gltf));
        assert_eq!(sniff(b"\xEF\xBB\xBF \n{\"asset\"", None), Some(MeshFormat::Gltf));
        assert_eq!(sniff(b"# by hand\n\nv 0 0 0", None), Some(MeshFormat::Obj));
        assert_eq!(sniff(b"cstype bezier", Some("OBJ")), Some(MeshFormat::Obj));
        assert_eq!(sniff(b"solid cube\n facet normal 0 0 1", Some("obj")), Some(MeshFormat::Stl));
        let mut binary = b"solid, says a binary file".to_vec();
        binary.resize(84 + 50, 0);
        binary[80] = 1;
        assert_eq!(sniff(&binary, None), Some(MeshFormat::Stl));
        assert_eq!(sniff(b"solid cube", None), None);
        assert_eq!(sniff(b"", None), None);
    }
}

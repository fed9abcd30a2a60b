use std::collections::HashMap;

use super::rest;
use crate::formats::input::Siblings;
use crate::formats::text::{Lines, finite, shown, without_mark};
use crate::formats::texture::TextureImage;

/// The pictures that the materials of an OBJ's MTL files have as their colour (`map_Kd`).
#[derive(Default)]
pub(super) struct Pictures {
    pub images: Vec<TextureImage>,
    of_material: HashMap<Vec<u8>, u32>,
    /// The pictures that were looked for, and those that were found.
    of_name: HashMap<String, Option<u32>>,
}

impl Pictures {
    /// Reads the MTL files of these names; those that are not there, or name pictures that are not, end in warnings.
    pub fn read(libraries: &[Vec<u8>], siblings: &Siblings, warnings: &mut Vec<String>) -> Self {
        let mut pictures = Self::default();
        for library in libraries {
            let name = file_name(library);
            match siblings.read(&name) {
                Ok(text) => pictures.library(&name, &text, siblings, warnings),
                Err(problem) => warn(warnings, format!("`mtllib` {problem}")),
            }
        }
        pictures
    }

    /// The picture of the material called `name`, among `images`.
    pub fn of(&self, name: &[u8]) -> Option<u32> {
        self.of_material.get(name).copied()
    }

    fn library(&mut self, library: &str, text: &[u8], siblings: &Siblings, warnings: &mut Vec<String>) {
        let mut material = Vec::new();
        for line in Lines::new(without_mark(text)) {
            let statement = line.text.trim_ascii();
            let keyword = statement.split(u8::is_ascii_whitespace).next().unwrap_or_default();
            if keyword == b"newmtl" {
                material = rest(statement).to_vec();
            } else if keyword.eq_ignore_ascii_case(b"map_Kd") {
                let name = file_name(without_options(rest(statement)));
                let place = format!("{}, line {}: `map_Kd`", shown(library.as_bytes()), line.number);
                if let Some(image) = self.find(name, &place, siblings, warnings) {
                    self.of_material.insert(material.clone(), image);
                }
            }
        }
    }

    fn find(
        &mut self,
        name: String,
        place: &str,
        siblings: &Siblings,
        warnings: &mut Vec<String>,
    ) -> Option<u32> {
        if let Some(&known) = self.of_name.get(&name) {
            return known;
        }
        let found = match siblings.find(&name) {
            Ok(path) => {
                self.images.push(TextureImage::File(path));
                Some(self.images.len() as u32 - 1)
            }
            Err(problem) => {
                warn(warnings, format!("{place} {problem}"));
                None
            }
        };
        self.of_name.insert(name, found);
        found
    }
}

/// Adds a warning, unless there are many already.
fn warn(warnings: &mut Vec<String>, warning: String) {
    const MOST: usize = 100;
    if warnings.len() < MOST {
        warnings.push(warning);
    }
}

/// A path as other systems write it.
fn file_name(name: &[u8]) -> String {
    String::from_utf8_lossy(name).replace('\\', "/")
}

/// The file's name behind options such as `-s 1 1 1` and `-clamp on`.
fn without_options(mut text: &[u8]) -> &[u8] {
    while let [b'-', ..] = text {
        let option = text.split(u8::is_ascii_whitespace).next().unwrap_or_default();
        text = rest(text);
        let values = match option {
            b"-o" | b"-s" | b"-t" => 3,
            b"-mm" => 2,
            _ => 1,
        };
        for at in 0..values {
            let word = text.split(u8::is_ascii_whitespace).next().unwrap_or_default();
            // Of three numbers the last two may be left out.
            if at == 0 || finite(word).is_some() {
                text = rest(text);
            }
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_stand_before_a_name() {
        for (text, name) in [
            ("a b.png", "a b.png"),
            ("-s 1 1 1 a b.png", "a b.png"),
            ("-o 0.5 a.png", "a.png"),
            ("-clamp on -mm 0 1 -bm 2 c.png", "c.png"),
            ("-clamp", ""),
        ] {
            assert_eq!(without_options(text.as_bytes()), name.as_bytes(), "{text}");
        }
    }
}

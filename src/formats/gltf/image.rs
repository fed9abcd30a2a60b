use std::collections::HashMap;

use super::buffer::{Buffers, embedded, percent_decoded};
use super::document::Image;
use crate::formats::error::Fault;
use crate::formats::texture::TextureImage;

/// The pictures that textures name, each looked for once.
pub(super) struct Images<'g, 'a> {
    buffers: &'g Buffers<'a>,
    pub found: Vec<TextureImage>,
    of_source: HashMap<usize, Option<u32>>,
    /// Bytes that embedded pictures take so far.
    copied: usize,
}

impl<'g, 'a> Images<'g, 'a> {
    pub fn new(buffers: &'g Buffers<'a>) -> Self {
        Self { buffers, found: Vec::new(), of_source: HashMap::new(), copied: 0 }
    }

    /// Which of those found the picture of a texture is. What is wrong with it is said once.
    pub fn of(&mut self, texture: usize) -> Result<Option<u32>, Fault> {
        let source = self.buffers.document().texture(texture)?.source;
        let source = source.ok_or_else(|| {
            let problem = "has no plain picture, only one of an extension: save it as PNG or JPEG";
            Fault::at(format_args!("textures[{texture}]"), problem)
        })?;
        if let Some(&known) = self.of_source.get(&source) {
            return Ok(known);
        }
        self.of_source.insert(source, None);
        let image = self.buffers.document().image(source)?;
        let image =
            self.load(image).map_err(|problem| Fault::at(format_args!("images[{source}]"), problem))?;
        self.found.push(image);
        let number = Some(self.found.len() as u32 - 1);
        self.of_source.insert(source, number);
        Ok(number)
    }

    fn load(&mut self, image: Image) -> Result<TextureImage, String> {
        let Image { uri, mime_type, buffer_view } = image;
        let (media_type, bytes) = match (uri, buffer_view) {
            (Some(uri), _) => match uri.strip_prefix("data:") {
                Some(data) => {
                    let (stated, bytes) = embedded(data)?;
                    (Some(stated.to_owned()), bytes)
                }
                None => {
                    let name = percent_decoded(&uri)?;
                    return self.buffers.siblings().find(&name).map(TextureImage::File);
                }
            },
            (None, Some(view)) => {
                let (bytes, _) = self.buffers.view(view).map_err(|fault| fault.to_string())?;
                self.allow(bytes.len())?;
                (mime_type, bytes.to_vec())
            }
            (None, None) => return Err("has neither a uri nor a bufferView to be in".to_owned()),
        };
        Ok(TextureImage::Embedded { media_type, bytes })
    }

    /// Several pictures may be in the same bytes; together they may not take more than the file has.
    fn allow(&mut self, bytes: usize) -> Result<(), String> {
        self.copied = self.copied.saturating_add(bytes);
        if self.copied > self.buffers.held() {
            return Err("repeats the bytes of other pictures too often".to_owned());
        }
        Ok(())
    }
}

use std::collections::HashMap;

use glam::DVec2;

use super::accessor;
use super::buffer::Buffers;
use super::document::{Primitive, TextureReference};
use super::image::Images;
use crate::formats::error::Fault;
use crate::formats::geometry::Geometry;
use crate::formats::texture::{ImageOrigin, Texture};
use crate::mesh::Points;

/// What a scene has beside its shape: colours, texture coordinates, pictures. A mistake in them ends in a warning.
pub(super) struct Surface<'g, 'a> {
    buffers: &'g Buffers<'a>,
    images: Images<'g, 'a>,
    /// By material.
    pictures: HashMap<usize, Picture>,
    /// For each vertex up to the last that has one.
    colours: Vec<[u8; 4]>,
    coordinates: Vec<DVec2>,
    /// First entry and number of entries of each accessor of coordinates; `None` where it cannot be used.
    placed: HashMap<usize, Option<(u32, u32)>>,
    /// For each corner and polygon up to the last that has coordinates, and a picture.
    corners: Vec<u32>,
    polygon_images: Vec<u32>,
    warnings: Vec<String>,
}

/// What a material shows.
#[derive(Clone, Copy, Default)]
struct Picture {
    /// Its number among the images, if it is there.
    image: Option<u32>,
    /// The set of texture coordinates that it lies by.
    set: usize,
}

impl<'g, 'a> Surface<'g, 'a> {
    pub fn new(buffers: &'g Buffers<'a>) -> Self {
        Self {
            buffers,
            images: Images::new(buffers),
            pictures: HashMap::new(),
            colours: Vec::new(),
            coordinates: Vec::new(),
            placed: HashMap::new(),
            corners: Vec::new(),
            polygon_images: Vec::new(),
            warnings: Vec::new(),
        }
    }

    /// Takes the colours of `count` vertices from `first` on.
    pub fn vertices(&mut self, (first, count): (u32, u32), colour: Option<usize>) {
        let Some(accessor) = colour else { return };
        let colours = accessor::colours(self.buffers, accessor)
            .and_then(|colours| expect_count(colours, count, accessor, "colours"));
        match colours {
            Ok(colours) => {
                self.colours.resize(first as usize, WHITE);
                self.colours.extend(colours);
            }
            Err(fault) => self.warn(fault),
        }
    }

    /// Takes what a primitive says of its triangles, whose corners, `before` of which came earlier, are vertices of the
    /// `count` from `first` on.
    pub fn triangles(&mut self, primitive: &Primitive, corners: &[u32], vertices: (u32, u32), before: usize) {
        let picture = primitive.material.map(|material| self.picture(material)).unwrap_or_default();
        let Some(accessor) = primitive.attributes.coordinates(picture.set) else { return };
        let Some(entry) = self.place(accessor, vertices.1) else { return };
        self.corners.resize(before, Texture::NONE);
        self.corners.extend(corners.iter().map(|&corner| corner - vertices.0 + entry));
        if let Some(image) = picture.image {
            self.polygon_images.resize(before / 3, Texture::NONE);
            self.polygon_images.resize((before + corners.len()) / 3, image);
        }
    }

    /// The picture of a material, looked for when first named.
    fn picture(&mut self, material: usize) -> Picture {
        if let Some(&known) = self.pictures.get(&material) {
            return known;
        }
        let texture = self.base_colour(material).map_err(|fault| self.warn(fault)).ok().flatten();
        let picture = texture.map_or(Picture::default(), |texture| Picture {
            set: texture.tex_coord,
            image: self.image(&texture),
        });
        self.pictures.insert(material, picture);
        picture
    }

    fn base_colour(&self, material: usize) -> Result<Option<TextureReference>, Fault> {
        let material = self.buffers.document().material(material)?;
        Ok(material.pbr_metallic_roughness.and_then(|base| base.base_color_texture))
    }

    fn image(&mut self, texture: &TextureReference) -> Option<u32> {
        if texture.extensions.is_some() {
            self.warn(Fault::at(
                format_args!("textures[{}]", texture.index),
                "is moved by an extension, which is not followed: apply it to the texture coordinates",
            ));
        }
        self.images.of(texture.index).map_err(|fault| self.warn(fault)).ok().flatten()
    }

    /// The first entry of an accessor's coordinates, read when first named.
    fn place(&mut self, accessor: usize, vertices: u32) -> Option<u32> {
        let placed = match self.placed.get(&accessor) {
            Some(&placed) => placed,
            None => {
                let placed = self.read(accessor).map_err(|fault| self.warn(fault)).ok();
                self.placed.insert(accessor, placed);
                placed
            }
        };
        let (first, count) = placed?;
        if count != vertices {
            self.warn(wrong_count(accessor, count, vertices, "texture coordinates"));
            return None;
        }
        Some(first)
    }

    fn read(&mut self, accessor: usize) -> Result<(u32, u32), Fault> {
        let coordinates = accessor::coordinates(self.buffers, accessor)?;
        let (first, count) = (u32::try_from(self.coordinates.len()), u32::try_from(coordinates.len()));
        let range = first.ok().zip(count.ok()).filter(|(first, count)| first.checked_add(*count).is_some());
        let range = range.ok_or_else(|| Fault::at("the texture coordinates", "are too many"))?;
        self.coordinates.extend(coordinates);
        Ok(range)
    }

    fn warn(&mut self, fault: Fault) {
        const MOST: usize = 100;
        let warning = fault.to_string();
        if self.warnings.len() < MOST && !self.warnings.contains(&warning) {
            self.warnings.push(warning);
        }
    }

    /// Adds what was found to the shape.
    pub fn finish(mut self, geometry: &mut Geometry) {
        if !self.colours.is_empty() {
            self.colours.resize(geometry.positions.count(), WHITE);
            geometry.colours = Some(self.colours);
        }
        if !self.corners.is_empty() {
            self.corners.resize(geometry.polygons.corners().len(), Texture::NONE);
            self.polygon_images.resize(geometry.polygons.len(), Texture::NONE);
            geometry.texture = Some(Texture {
                coordinates: self.coordinates,
                corners: self.corners,
                polygon_images: self.polygon_images,
                images: self.images.found,
                origin: ImageOrigin::UpperLeft,
            });
        }
        geometry.warnings = self.warnings;
    }
}

const WHITE: [u8; 4] = [255; 4];

fn expect_count<T>(values: Vec<T>, vertices: u32, accessor: usize, what: &str) -> Result<Vec<T>, Fault> {
    if values.len() == vertices as usize {
        return Ok(values);
    }
    Err(wrong_count(accessor, values.len() as u32, vertices, what))
}

fn wrong_count(accessor: usize, count: u32, vertices: u32, what: &str) -> Fault {
    Fault::at(format_args!("accessors[{accessor}]"), format!("has {count} {what} for {vertices} vertices"))
}

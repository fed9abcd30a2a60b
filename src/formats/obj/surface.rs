use std::collections::HashMap;

use glam::DVec2;

use super::counted_from_0;
use super::material::Pictures;
use crate::formats::geometry::Geometry;
use crate::formats::input::Siblings;
use crate::formats::text::{finite, shown};
use crate::formats::texture::{ImageOrigin, Texture};
use crate::mesh::Points;

/// What an OBJ has beside its shape: colours, texture coordinates, materials. A mistake in them ends in a warning.
#[derive(Default)]
pub(super) struct Surface {
    colours: Vec<[f32; 3]>,
    coordinates: Vec<DVec2>,
    /// For each corner read so far; corners without coordinates are filled in when one with them follows.
    corners: Vec<u32>,
    largest: Option<(u32, usize)>,
    /// Why the texture coordinates cannot be used.
    fault: Option<String>,
    libraries: Vec<Vec<u8>>,
    materials: HashMap<Vec<u8>, u32>,
    material: Option<u32>,
    /// For each polygon read so far, as `corners`.
    polygon_materials: Vec<u32>,
}

impl Surface {
    /// Takes what stands behind a vertex's position: nothing, a weight, or red, green and blue.
    pub fn colour<'a>(&mut self, mut words: impl Iterator<Item = &'a [u8]>) {
        let mut next = || words.next().and_then(finite).map(|value| value as f32);
        if let (Some(red), Some(green), Some(blue)) = (next(), next(), next()) {
            self.colours.push([red, green, blue]);
        }
    }

    /// Takes a `vt`; its `v` is 0 where it is left out.
    pub fn coordinate<'a>(&mut self, line: usize, mut words: impl Iterator<Item = &'a [u8]>) {
        let u = words.next().and_then(finite);
        let v = words.next().filter(|word| !word.starts_with(b"#")).map_or(Some(0.0), finite);
        if u.is_none() || v.is_none() {
            self.fail(line, "`vt` must have finite numbers u and v");
        }
        self.coordinates.push(DVec2::new(u.unwrap_or(0.0), v.unwrap_or(0.0)));
    }

    /// Takes the name of the texture coordinates at polygon corner `corner`; empty for none.
    pub fn corner(&mut self, corner: usize, line: usize, name: &[u8]) {
        if name.is_empty() || self.fault.is_some() {
            return;
        }
        let Some(index) = counted_from_0(name, self.coordinates.len()) else {
            return self.fail(line, &format!("the face names the texture coordinates `{}`", shown(name)));
        };
        if self.largest.is_none_or(|(largest, _)| index > largest) {
            self.largest = Some((index, line));
        }
        self.corners.resize(corner, Texture::NONE);
        self.corners.push(index);
    }

    /// Forgets the corners of a face that is left out.
    pub fn drop_corners(&mut self, left: usize) {
        self.corners.truncate(left);
    }

    /// Takes a polygon of the current material, which makes `polygons` of them.
    pub fn polygon(&mut self, polygons: usize) {
        if let Some(material) = self.material {
            self.polygon_materials.resize(polygons - 1, Texture::NONE);
            self.polygon_materials.push(material);
        }
    }

    /// Takes a `usemtl`.
    pub fn material(&mut self, name: &[u8]) {
        let next = self.materials.len() as u32;
        let known = self.materials.get(name).copied();
        self.material = known.or_else(|| {
            self.materials.insert(name.to_owned(), next);
            Some(next)
        });
    }

    /// Takes a `mtllib`.
    pub fn library(&mut self, name: &[u8]) {
        const MOST: usize = 64;
        if self.libraries.len() < MOST && !self.libraries.iter().any(|known| known == name) {
            self.libraries.push(name.to_owned());
        }
    }

    #[cold]
    fn fail(&mut self, line: usize, problem: &str) {
        self.fault.get_or_insert_with(|| format!("line {line}: {problem}"));
    }

    /// Adds what was found to the shape.
    pub fn finish(mut self, geometry: &mut Geometry, siblings: &Siblings) {
        geometry.colours = self.colours(geometry);
        if let Some((index, line)) = self.largest
            && index as usize >= self.coordinates.len()
        {
            let count = self.coordinates.len();
            self.fail(
                line,
                &format!("the face names `vt` {}, but the file has {count}", u64::from(index) + 1),
            );
        }
        match self.fault.take() {
            Some(fault) => geometry.warnings.push(format!("{fault}: texture coordinates are left out")),
            None if self.corners.is_empty() => {}
            None => geometry.texture = Some(self.texture(geometry, siblings)),
        }
    }

    fn colours(&self, geometry: &mut Geometry) -> Option<Vec<[u8; 4]>> {
        let (coloured, vertices) = (self.colours.len(), geometry.positions.count());
        if coloured == 0 {
            return None;
        }
        if coloured != vertices {
            let problem = format!("only {coloured} of {vertices} vertices have colours: they are left out");
            geometry.warnings.push(problem);
            return None;
        }
        // Most programs write 0 to 1, some 0 to 255.
        let scale = if self.colours.iter().flatten().any(|&value| value > 1.0) { 1.0 } else { 255.0 };
        let byte = |value: f32| (value * scale).round() as u8;
        Some(self.colours.iter().map(|&[r, g, b]| [byte(r), byte(g), byte(b), 255]).collect())
    }

    fn texture(mut self, geometry: &mut Geometry, siblings: &Siblings) -> Texture {
        self.corners.resize(geometry.polygons.corners().len(), Texture::NONE);
        self.polygon_materials.resize(geometry.polygons.len(), Texture::NONE);
        let pictures = Pictures::read(&self.libraries, siblings, &mut geometry.warnings);
        let mut image_of = vec![Texture::NONE; self.materials.len()];
        for (name, &material) in &self.materials {
            image_of[material as usize] = pictures.of(name).unwrap_or(Texture::NONE);
        }
        for material in &mut self.polygon_materials {
            *material = image_of.get(*material as usize).copied().unwrap_or(Texture::NONE);
        }
        Texture {
            coordinates: self.coordinates,
            corners: self.corners,
            polygon_images: self.polygon_materials,
            images: pictures.images,
            origin: ImageOrigin::LowerLeft,
        }
    }
}

use glam::{DVec2, DVec3};

use super::body::{Rows, each_row, skip};
use super::faces::Faces;
use super::header::{Element, Kind, Scalar};
use crate::formats::error::Fault;
use crate::formats::geometry::Geometry;
use crate::formats::input::Siblings;
use crate::formats::texture::{ImageOrigin, Texture, TextureImage};
use crate::mesh::FilePoints;

/// Where the numbers that are read stand in a row: `x y z`, then colours, then texture coordinates.
const NUMBERS: usize = 9;
const COLOUR: usize = 3;
const COORDINATES: usize = 7;
const NAMES: [&[&str]; NUMBERS] = [
    &["x"],
    &["y"],
    &["z"],
    &["red", "r", "diffuse_red"],
    &["green", "g", "diffuse_green"],
    &["blue", "b", "diffuse_blue"],
    &["alpha", "a"],
    &["s", "u", "texture_u", "texture_s"],
    &["t", "v", "texture_v", "texture_t"],
];

/// What is read of each vertex.
pub(super) struct VertexPlan {
    /// For each property the number that it is, if it is one.
    numbers: Vec<Option<usize>>,
    /// How colours are scaled, if there are any.
    colour: Option<f64>,
    coordinates: bool,
}

/// The vertices that were read.
#[derive(Default)]
pub(super) struct Vertices {
    positions: FilePoints,
    colours: Option<Vec<[u8; 4]>>,
    coordinates: Option<Vec<DVec2>>,
}

impl VertexPlan {
    pub fn new(element: &Element) -> Result<Self, Fault> {
        let single = |names: &[&str]| {
            let at = element.position(names)?;
            match element.properties[at].kind {
                Kind::One(scalar) => Some((at, scalar)),
                Kind::List { .. } => None,
            }
        };
        let found = NAMES.map(single);
        if let Some(axis) = found[..3].iter().position(Option::is_none) {
            let name = NAMES[axis][0];
            let problem = format!("the element `vertex` has no property `{name}` that is one number");
            return Err(Fault::at("the header", problem));
        }
        let mut numbers = vec![None; element.properties.len()];
        for (number, &(at, _)) in found.iter().enumerate().filter_map(|(n, f)| Some((n, f.as_ref()?))) {
            numbers[at] = Some(number);
        }
        let colour = found[COLOUR].filter(|_| found[COLOUR..COLOUR + 3].iter().all(Option::is_some));
        Ok(Self {
            numbers,
            colour: colour.map(|(_, scalar)| colour_scale(scalar)),
            coordinates: found[COORDINATES..].iter().all(Option::is_some),
        })
    }

    pub fn read(&self, element: &Element, rows: &mut impl Rows) -> Result<Vertices, Fault> {
        let count = element.count as usize;
        let mut vertices = Vertices {
            positions: FilePoints::with_capacity(count),
            colours: self.colour.map(|_| Vec::with_capacity(count)),
            coordinates: self.coordinates.then(|| Vec::with_capacity(count)),
        };
        // An opacity that is not there is full.
        let mut row = [f64::MAX; NUMBERS];
        let last = element.properties.len() - 1;
        each_row(element, rows, |at, kind, rows| {
            match (self.numbers[at], kind) {
                (Some(number @ ..COLOUR), Kind::One(scalar)) => row[number] = rows.number(scalar)?,
                (Some(number), Kind::One(scalar)) => row[number] = rows.any_number(scalar)?,
                _ => skip(kind, rows)?,
            }
            if at == last { self.take(&row, &mut vertices) } else { Ok(()) }
        })?;
        Ok(vertices)
    }

    fn take(&self, row: &[f64; NUMBERS], vertices: &mut Vertices) -> Result<(), String> {
        let position = DVec3::new(row[0], row[1], row[2]);
        if !position.is_finite() {
            return Err(format!("is at {position}: every coordinate must be a finite number"));
        }
        vertices.positions.push(position);
        if let (Some(scale), Some(colours)) = (self.colour, &mut vertices.colours) {
            // What is no number becomes 0, and what is too large 255.
            colours.push([0, 1, 2, 3].map(|channel| (row[COLOUR + channel] * scale).round() as u8));
        }
        if let Some(coordinates) = &mut vertices.coordinates {
            coordinates.push(DVec2::new(row[COORDINATES], row[COORDINATES + 1]));
        }
        Ok(())
    }
}

/// What brings colours of this type to 0 to 255.
fn colour_scale(scalar: Scalar) -> f64 {
    match scalar {
        Scalar::F32 | Scalar::F64 => 255.0,
        Scalar::U16 => 1.0 / 257.0,
        _ => 1.0,
    }
}

impl Vertices {
    /// The vertices with the polygons on them.
    pub fn with(self, faces: Faces, pictures: &[String], siblings: &Siblings) -> Geometry {
        let mut warnings = Vec::new();
        let Faces { polygons, texture: of_corners } = faces;
        let found = of_corners.or_else(|| {
            let coordinates = self.coordinates?;
            Some((coordinates, polygons.corners().to_vec(), vec![0; polygons.len()]))
        });
        let texture = found.and_then(|(coordinates, corners, mut images)| {
            if let Some(wrong) = coordinates.iter().find(|coordinate| !coordinate.is_finite()) {
                warnings.push(format!("has the texture coordinates {wrong}: they are left out"));
                return None;
            }
            let (images_of_numbers, images_there) = find(pictures, siblings, &mut warnings);
            for image in &mut images {
                *image = images_of_numbers.get(*image as usize).copied().unwrap_or(Texture::NONE);
            }
            let origin = ImageOrigin::LowerLeft;
            Some(Texture { coordinates, corners, polygon_images: images, images: images_there, origin })
        });
        Geometry {
            positions: self.positions,
            polygons,
            colours: self.colours,
            texture,
            warnings,
            ..Geometry::default()
        }
    }
}

/// The pictures that are there, and for each name which of them it is.
fn find(names: &[String], siblings: &Siblings, warnings: &mut Vec<String>) -> (Vec<u32>, Vec<TextureImage>) {
    const MOST: usize = 100;
    let mut images = Vec::new();
    let mut find = |name: &String| match siblings.find(name) {
        Ok(path) => {
            images.push(TextureImage::File(path));
            images.len() as u32 - 1
        }
        Err(problem) => {
            warnings.push(format!("`comment TextureFile` {problem}"));
            Texture::NONE
        }
    };
    (names.iter().take(MOST).map(&mut find).collect(), images)
}

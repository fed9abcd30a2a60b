use glam::DVec2;

use super::body::{Rows, each_row, list_length, skip};
use super::header::{Element, Kind, Scalar};
use crate::formats::error::Fault;
use crate::formats::polygons::Polygons;
use crate::formats::texture::Texture;

/// What is read of each face.
pub(super) struct FacePlan {
    /// Where the list of a polygon's vertices stands among the face's properties.
    corners: usize,
    /// Where MeshLab's list of texture coordinates stands: u and v of each corner.
    coordinates: Option<usize>,
    /// Where the picture's number stands.
    picture: Option<usize>,
}

/// The faces that were read.
#[derive(Default)]
pub(super) struct Faces {
    pub polygons: Polygons,
    /// Where faces have texture coordinates: these, the entry of each corner, and the number of each polygon's picture.
    pub texture: Option<(Vec<DVec2>, Vec<u32>, Vec<u32>)>,
}

/// One row as it is read.
#[derive(Default)]
struct Row {
    coordinates: Vec<f64>,
    picture: u32,
}

impl FacePlan {
    pub fn new(element: &Element) -> Result<Self, Fault> {
        let position = element.position(&["vertex_indices", "vertex_index"]);
        let corners = position.filter(
            |&at| matches!(element.properties[at].kind, Kind::List { item, .. } if item.is_integer()),
        );
        let problem = "the element `face` has no property `vertex_indices` that is a list of integers";
        let coordinates = element.position(&["texcoord"]);
        let picture = element.position(&["texnumber"]);
        Ok(Self {
            corners: corners.ok_or_else(|| Fault::at("the header", problem))?,
            coordinates: coordinates.filter(
                |&at| matches!(element.properties[at].kind, Kind::List { item, .. } if !item.is_integer()),
            ),
            picture: picture.filter(
                |&at| matches!(element.properties[at].kind, Kind::One(scalar) if scalar.is_integer()),
            ),
        })
    }

    pub fn read(&self, element: &Element, vertices: u64, rows: &mut impl Rows) -> Result<Faces, Fault> {
        let mut faces = Faces {
            polygons: Polygons::with_capacity(element.count as usize),
            texture: self.coordinates.map(|_| Default::default()),
        };
        let mut row = Row::default();
        let last = element.properties.len() - 1;
        each_row(element, rows, |at, kind, rows| {
            match kind {
                Kind::List { count, item } if at == self.corners => {
                    for _ in 0..list_length(count, rows)? {
                        faces.polygons.corner(corner(rows.integer(item)?, vertices)?);
                    }
                }
                Kind::List { count, item } if Some(at) == self.coordinates => {
                    row.read_coordinates(count, item, rows)?;
                }
                Kind::One(scalar) if Some(at) == self.picture => {
                    // What is no number of a picture becomes one that none has.
                    row.picture = rows.any_number(scalar)?.max(-1.0) as i64 as u32;
                }
                _ => skip(kind, rows)?,
            }
            if at == last {
                faces.close(&mut row);
            }
            Ok(())
        })?;
        Ok(faces)
    }
}

impl Row {
    fn read_coordinates(&mut self, count: Scalar, item: Scalar, rows: &mut impl Rows) -> Result<(), String> {
        for _ in 0..list_length(count, rows)? {
            self.coordinates.push(rows.any_number(item)?);
        }
        Ok(())
    }
}

impl Faces {
    /// Ends a polygon, with the rest of its row.
    fn close(&mut self, row: &mut Row) {
        let start = self.polygons.closed();
        let closed = self.polygons.close();
        if let (true, Some((coordinates, corners, pictures))) = (closed, &mut self.texture) {
            let (pairs, _) = row.coordinates.as_chunks::<2>();
            for at in 0..self.polygons.closed() - start {
                // A face may have fewer coordinates than corners, or none.
                let index = pairs.get(at).map_or(Texture::NONE, |_| coordinates.len() as u32);
                coordinates.extend(pairs.get(at).map(|&[u, v]| DVec2::new(u, v)));
                corners.push(index);
            }
            pictures.push(row.picture);
        }
        row.coordinates.clear();
        row.picture = 0;
    }
}

fn corner(index: i64, vertices: u64) -> Result<u32, String> {
    let there = u64::try_from(index).is_ok_and(|index| index < vertices);
    let index_u32 = u32::try_from(index).ok().filter(|_| there);
    index_u32.ok_or_else(|| format!("names vertex {index}, but the file has {vertices}, counted from 0"))
}

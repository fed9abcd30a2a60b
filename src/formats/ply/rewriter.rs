//! A PLY with other positions: the numbers x, y, z and nx, ny, nz of its vertices are replaced, all else stays byte for
//! byte.

use glam::DVec3;

use super::binary::BinaryRows;
use super::body::{Rows, list_length, skip};
use super::header::{Element, Encoding, Header, Kind, Scalar};
use crate::formats::area_normals::AreaNormals;
use crate::formats::error::Fault;
use crate::formats::splices::Splices;
use crate::formats::stream::Stream;
use crate::formats::text::{Lines, integer};

/// The bytes of a PLY that was read before, its vertices at other positions `[N, 3]`; normals are those of the triangles
/// `[F, 3]`.
pub(in crate::formats) fn rewrite(
    bytes: &[u8],
    positions: &[DVec3],
    triangles: &[[u32; 3]],
) -> Result<Vec<u8>, Fault> {
    let mut rows = Stream::of(bytes);
    let header = Header::read(&mut rows)?;
    let vertices = Vertices::new(header.element("vertex")?, positions, triangles)?;
    let start = bytes.len() - rows.left() as usize;
    let mut out = Splices::new(bytes);
    match header.encoding {
        Encoding::Ascii => vertices.ascii(&header, &bytes[start..], &mut out)?,
        Encoding::LittleEndian => vertices.binary::<false>(&header, &bytes[start..], start, &mut out)?,
        Encoding::BigEndian => vertices.binary::<true>(&header, &bytes[start..], start, &mut out)?,
    }
    Ok(out.finish())
}

/// The numbers that vertices get.
struct Vertices<'a> {
    element: &'a Element,
    positions: &'a [DVec3],
    normals: Vec<Option<DVec3>>,
    /// For each property which number it is, if it is one: x, y, z, nx, ny, nz.
    numbers: Vec<Option<usize>>,
}

const NAMES: [&str; 6] = ["x", "y", "z", "nx", "ny", "nz"];

impl<'a> Vertices<'a> {
    fn new(element: &'a Element, positions: &'a [DVec3], triangles: &[[u32; 3]]) -> Result<Self, Fault> {
        let mut numbers = vec![None; element.properties.len()];
        for (number, name) in NAMES.into_iter().enumerate() {
            let Some(at) = element.position(&[name]) else { continue };
            match element.properties[at].kind {
                Kind::One(Scalar::F32 | Scalar::F64) => numbers[at] = Some(number),
                // Normals of another type are left alone.
                _ if number >= 3 => {}
                _ => {
                    let problem = format!(
                        "the vertices' property `{name}` is no float or double, which results do not fit in: \
                         save the mesh with 32-bit floats"
                    );
                    return Err(Fault::DoesNotFit(problem));
                }
            }
        }
        let with_normals = numbers.iter().flatten().any(|&number| number >= 3);
        let mut normals = AreaNormals::new(positions, if with_normals { positions.len() } else { 0 });
        for &corners in triangles.iter().take_while(|_| with_normals) {
            normals.add(corners, corners.map(|corner| Some(corner as usize)));
        }
        Ok(Self { element, positions, normals: normals.finish(), numbers })
    }

    /// What the property `at` of vertex `vertex` becomes, if it is to be replaced.
    fn number(&self, vertex: usize, at: usize) -> Option<f64> {
        match self.numbers[at]? {
            axis @ ..3 => self.positions.get(vertex).map(|p| p[axis]),
            axis => self.normals.get(vertex).copied().flatten().map(|normal| normal[axis - 3]),
        }
    }

    fn ascii(&self, header: &Header, data: &[u8], out: &mut Splices) -> Result<(), Fault> {
        let mut lines = Lines::new(data).filter(|line| !line.text.trim_ascii().is_empty());
        let rows = header.elements.iter().filter(|element| !element.properties.is_empty());
        let before: u64 = rows.take_while(|element| element.name != self.element.name).map(|e| e.count).sum();
        (0..before).try_for_each(|_| lines.next().map(|_| ())).ok_or_else(cut_short)?;
        for (vertex, line) in lines.take(self.element.count as usize).enumerate() {
            let mut words = line.text.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
            for (at, property) in self.element.properties.iter().enumerate() {
                let word = words.next().ok_or_else(cut_short)?;
                match property.kind {
                    Kind::List { .. } => {
                        let items = integer(word).ok_or_else(cut_short)?;
                        words.by_ref().take(usize::try_from(items).unwrap_or(0)).for_each(|_| {});
                    }
                    Kind::One(scalar) => {
                        if let Some(number) = self.number(vertex, at) {
                            out.replace_part(word, spelled(number, scalar)?.as_bytes());
                        }
                    }
                }
            }
        }
        Ok(())
    }

    /// Replaces what is in `data`, all bytes from the `first` on.
    fn binary<const BIG: bool>(
        &self,
        header: &Header,
        data: &[u8],
        first: usize,
        out: &mut Splices,
    ) -> Result<(), Fault> {
        let mut stream = Stream::of(data);
        let mut rows = BinaryRows::<BIG>::new(&mut stream);
        let damaged = |problem| Fault::at("the rows", problem);
        for element in header.elements.iter().take_while(|element| element.name != self.element.name) {
            for _ in 0..if element.properties.is_empty() { 0 } else { element.count } {
                element.properties.iter().try_for_each(|p| skip(p.kind, &mut rows)).map_err(damaged)?;
            }
        }
        for vertex in 0..self.element.count as usize {
            for (at, property) in self.element.properties.iter().enumerate() {
                let start = first + data.len() - rows.left() as usize;
                match property.kind {
                    Kind::List { count, item } => {
                        let items = list_length(count, &mut rows).map_err(damaged)?;
                        rows.skip(item, items).map_err(damaged)?;
                    }
                    Kind::One(scalar) => {
                        rows.skip(scalar, 1).map_err(damaged)?;
                        if let Some(number) = self.number(vertex, at) {
                            out.replace(start..start + scalar.size(), &packed::<BIG>(number, scalar)?);
                        }
                    }
                }
            }
        }
        Ok(())
    }
}

fn spelled(number: f64, scalar: Scalar) -> Result<String, Fault> {
    Ok(if scalar == Scalar::F64 { number.to_string() } else { single(number)?.to_string() })
}

fn packed<const BIG: bool>(number: f64, scalar: Scalar) -> Result<Vec<u8>, Fault> {
    let mut bytes = match scalar {
        Scalar::F64 => number.to_le_bytes().to_vec(),
        _ => single(number)?.to_le_bytes().to_vec(),
    };
    if BIG {
        bytes.reverse();
    }
    Ok(bytes)
}

fn single(number: f64) -> Result<f32, Fault> {
    let single = number as f32;
    let problem = || format!("{number} is no 32-bit float: save the mesh with doubles");
    if single.is_finite() { Ok(single) } else { Err(Fault::DoesNotFit(problem())) }
}

/// The file was read before, so that this is never said.
fn cut_short() -> Fault {
    Fault::at("the rows", "are cut short")
}

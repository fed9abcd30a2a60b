use std::ops::Range;

use glam::{DVec2, DVec3};

use super::buffer::Buffers;
use super::document::{Accessor, Sparse};
use crate::formats::error::Fault;

/// Vertex positions `[N, 3]` that accessor `index` holds, integers scaled to [-1, 1] where it says that they are.
pub(super) fn positions(buffers: &Buffers, index: usize) -> Result<Vec<DVec3>, Fault> {
    let place = format!("accessors[{index}]");
    let accessor = buffers.document().accessor(index)?;
    expect_shape(&accessor, "VEC3", &place)?;
    let component = Component::coded(accessor.component_type, &place)?;
    let position = |bytes: &[u8]| {
        let stored = DVec3::from([0, 1, 2].map(|axis| component.decode(bytes, axis)));
        if accessor.normalized { component.normalize(stored) } else { stored }
    };
    let positions = values(&accessor, buffers, Item { component, width: 3 }, &place, position)?;
    match positions.iter().position(|p| !p.is_finite()) {
        Some(at) => {
            let problem =
                format!("position {at} is {}: every coordinate must be a finite number", positions[at]);
            Err(Fault::at(place, problem))
        }
        None => Ok(positions),
    }
}

/// Where the vectors of an accessor lie in their buffer, as 32-bit floats.
pub(super) struct Vectors {
    pub buffer: usize,
    start: usize,
    stride: usize,
    count: usize,
}

impl Vectors {
    /// Of accessor `index`.
    pub fn of(buffers: &Buffers, index: usize) -> Result<Self, Fault> {
        let place = format!("accessors[{index}]");
        let accessor = buffers.document().accessor(index)?;
        expect_shape(&accessor, "VEC3", &place)?;
        let component = Component::coded(accessor.component_type, &place)?;
        let (Component::F32, None, Some(view)) = (component, &accessor.sparse, accessor.buffer_view) else {
            let problem = "cannot take the places of results: save the mesh with plain 32-bit floats, \
                           neither quantized nor sparse";
            return Err(Fault::at(place, problem));
        };
        let item = Item { component, width: 3 };
        let Strided { stride, count, .. } =
            Strided::new(buffers, view, accessor.byte_offset, accessor.count, item, &place)?;
        let view = buffers.document().buffer_view(view)?;
        Ok(Self { buffer: view.buffer, start: view.byte_offset + accessor.byte_offset, stride, count })
    }

    /// Where each lies.
    pub fn ranges(&self) -> impl Iterator<Item = Range<usize>> {
        (0..self.count).map(|at| self.start + at * self.stride).map(|start| start..start + 12)
    }
}

/// Texture coordinates `[N, 2]` that accessor `index` holds, integers scaled to [0, 1] where it says that they are.
pub(super) fn coordinates(buffers: &Buffers, index: usize) -> Result<Vec<DVec2>, Fault> {
    let place = format!("accessors[{index}]");
    let accessor = buffers.document().accessor(index)?;
    expect_shape(&accessor, "VEC2", &place)?;
    let component = Component::coded(accessor.component_type, &place)?;
    let unit = if accessor.normalized { component.unit() } else { 1.0 };
    let decode = |bytes: &[u8]| DVec2::from([0, 1].map(|axis| component.decode(bytes, axis) / unit));
    let coordinates = values(&accessor, buffers, Item { component, width: 2 }, &place, decode)?;
    match coordinates.iter().find(|coordinate| !coordinate.is_finite()) {
        Some(wrong) => Err(Fault::at(place, format!("holds {wrong}, which must be finite numbers"))),
        None => Ok(coordinates),
    }
}

/// Colours `[N, 4]` that accessor `index` holds, opaque where it has no opacity.
pub(super) fn colours(buffers: &Buffers, index: usize) -> Result<Vec<[u8; 4]>, Fault> {
    let place = format!("accessors[{index}]");
    let accessor = buffers.document().accessor(index)?;
    let width = match accessor.shape.as_str() {
        "VEC3" => 3,
        "VEC4" => 4,
        other => return Err(Fault::at(place, format!("is of type {other}, where VEC3 or VEC4 is needed"))),
    };
    let component = Component::coded(accessor.component_type, &place)?;
    let channel = |bytes: &[u8], at| (component.decode(bytes, at) / component.unit() * 255.0).round() as u8;
    let decode = |bytes: &[u8]| [0, 1, 2, 3].map(|at| if at < width { channel(bytes, at) } else { 255 });
    values(&accessor, buffers, Item { component, width }, &place, decode)
}

/// Vertex indices `[K]` that accessor `index` holds.
pub(super) fn indices(buffers: &Buffers, index: usize) -> Result<Vec<u32>, Fault> {
    let place = format!("accessors[{index}]");
    let accessor = buffers.document().accessor(index)?;
    expect_shape(&accessor, "SCALAR", &place)?;
    let component = Component::coded(accessor.component_type, &place)?;
    component.expect_index(&place)?;
    values(&accessor, buffers, Item { component, width: 1 }, &place, |bytes| component.decode_index(bytes))
}

fn expect_shape(accessor: &Accessor, shape: &str, place: &str) -> Result<(), Fault> {
    if accessor.shape == shape {
        return Ok(());
    }
    Err(Fault::at(place, format!("is of type {}, where {shape} is needed", accessor.shape)))
}

/// The accessor's values: those of its view, or zeros, with its sparse ones put in their place.
fn values<T: Copy + Default>(
    accessor: &Accessor,
    buffers: &Buffers,
    item: Item,
    place: &str,
    decode: impl Fn(&[u8]) -> T,
) -> Result<Vec<T>, Fault> {
    buffers.unfold(accessor.count, place)?;
    let mut values = match (accessor.buffer_view, &accessor.sparse) {
        (Some(view), _) => {
            let strided = Strided::new(buffers, view, accessor.byte_offset, accessor.count, item, place)?;
            strided.items().map(&decode).collect()
        }
        (None, Some(_)) => vec![T::default(); accessor.count],
        (None, None) => {
            let problem = "has no bufferView: its data is compressed (Draco?) or lost; save the file without compression";
            return Err(Fault::at(place, problem));
        }
    };
    if let Some(sparse) = &accessor.sparse {
        overwrite(&mut values, sparse, buffers, item, place, decode)?;
    }
    Ok(values)
}

fn overwrite<T>(
    values: &mut [T],
    sparse: &Sparse,
    buffers: &Buffers,
    item: Item,
    place: &str,
    decode: impl Fn(&[u8]) -> T,
) -> Result<(), Fault> {
    let place = &format!("{place}.sparse");
    let at = Component::coded(sparse.indices.component_type, place)?;
    at.expect_index(place)?;
    let index_item = Item { component: at, width: 1 };
    let (view, offset) = (sparse.indices.buffer_view, sparse.indices.byte_offset);
    let indices = Strided::new(buffers, view, offset, sparse.count, index_item, place)?;
    let (view, offset) = (sparse.values.buffer_view, sparse.values.byte_offset);
    let replacements = Strided::new(buffers, view, offset, sparse.count, item, place)?;
    for (index, replacement) in indices.items().zip(replacements.items()) {
        let index = at.decode_index(index);
        let count = values.len();
        let value = values.get_mut(index as usize).ok_or_else(|| {
            Fault::at(place, format!("replaces value {index}, but the accessor has {count}, counted from 0"))
        })?;
        *value = decode(replacement);
    }
    Ok(())
}

/// One value of an accessor: `width` components side by side.
#[derive(Clone, Copy)]
struct Item {
    component: Component,
    width: usize,
}

/// Items at equal distances in a view.
struct Strided<'b> {
    bytes: &'b [u8],
    stride: usize,
    size: usize,
    count: usize,
}

impl<'b> Strided<'b> {
    fn new(
        buffers: &'b Buffers,
        view: usize,
        offset: usize,
        count: usize,
        item: Item,
        place: &str,
    ) -> Result<Self, Fault> {
        let (bytes, stride) = buffers.view(view)?;
        let size = item.component.size() * item.width;
        let stride = stride.unwrap_or(size);
        if stride < size {
            let problem =
                format!("holds values of {size} bytes, but bufferViews[{view}] sets them {stride} apart");
            return Err(Fault::at(place, problem));
        }
        let end = (count.max(1) - 1)
            .checked_mul(stride)
            .and_then(|last| last.checked_add(offset)?.checked_add(size));
        let fits = count == 0 || end.is_some_and(|end| end <= bytes.len());
        if !fits {
            let problem = format!(
                "has {count} values from byte {offset} on, which bufferViews[{view}] with {} bytes does not hold",
                bytes.len()
            );
            return Err(Fault::at(place, problem));
        }
        Ok(Self { bytes: bytes.get(offset..).unwrap_or_default(), stride, size, count })
    }

    fn items(&self) -> impl Iterator<Item = &'b [u8]> {
        let (bytes, stride, size) = (self.bytes, self.stride, self.size);
        (0..self.count).map(move |i| &bytes[i * stride..i * stride + size])
    }
}

/// The type of an accessor's components.
#[derive(Clone, Copy)]
enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    fn coded(code: u32, place: &str) -> Result<Self, Fault> {
        Ok(match code {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5125 => Self::U32,
            5126 => Self::F32,
            _ => {
                return Err(Fault::at(
                    place,
                    format!("has the componentType {code}, which glTF does not know"),
                ));
            }
        })
    }

    fn expect_index(self, place: &str) -> Result<(), Fault> {
        match self {
            Self::U8 | Self::U16 | Self::U32 => Ok(()),
            _ => Err(Fault::at(place, "indices must be of an unsigned integer type (5121, 5123 or 5125)")),
        }
    }

    fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }

    /// What stands for 1 where integers are scaled to [-1, 1] or [0, 1].
    fn unit(self) -> f64 {
        let largest: i32 = match self {
            Self::I8 => i8::MAX.into(),
            Self::U8 => u8::MAX.into(),
            Self::I16 => i16::MAX.into(),
            Self::U16 => u16::MAX.into(),
            Self::U32 | Self::F32 => 1,
        };
        f64::from(largest)
    }

    /// Scales integers to it, where the least too becomes -1.
    fn normalize(self, stored: DVec3) -> DVec3 {
        match self {
            Self::U32 | Self::F32 => stored,
            _ => (stored / self.unit()).max(DVec3::NEG_ONE),
        }
    }

    /// Component `axis` of an item.
    fn decode(self, item: &[u8], axis: usize) -> f64 {
        match self {
            Self::I8 => f64::from(item[axis] as i8),
            Self::U8 => f64::from(item[axis]),
            Self::I16 => f64::from(i16::from_le_bytes([item[2 * axis], item[2 * axis + 1]])),
            Self::U16 => f64::from(u16::from_le_bytes([item[2 * axis], item[2 * axis + 1]])),
            Self::U32 => f64::from(u32::from_le_bytes(four(item, axis))),
            Self::F32 => f64::from(f32::from_le_bytes(four(item, axis))),
        }
    }

    /// A single unsigned integer.
    fn decode_index(self, item: &[u8]) -> u32 {
        match *item {
            [a] => u32::from(a),
            [a, b] => u32::from(u16::from_le_bytes([a, b])),
            [a, b, c, d] => u32::from_le_bytes([a, b, c, d]),
            // No component has another size.
            _ => u32::MAX,
        }
    }
}

fn four(item: &[u8], axis: usize) -> [u8; 4] {
    let at = 4 * axis;
    [item[at], item[at + 1], item[at + 2], item[at + 3]]
}

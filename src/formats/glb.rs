//! GLB out: one mesh, its vertex order kept, with the attributes and the JSON that a result carries.

use std::path::Path;

use glam::{DVec2, DVec3};
use serde_json::{Map, Value, json};

use super::error::{Fault, FormatError};
use super::output::write_whole;
use crate::mesh::TriangleMesh;

/// How the `asset.generator` of files by this program begins.
pub(super) const PROGRAM: &str = "onemesh ";

/// What is written to a GLB file.
#[derive(Debug, Clone)]
pub struct Glb<'a> {
    /// The mesh, in the scan's own space.
    pub mesh: &'a TriangleMesh,
    /// The mesh's name.
    pub name: &'a str,
    /// A direction for each vertex `[N, 3]`, of any length; one of no length is written as +Z, since glTF has none.
    pub normals: Option<&'a [DVec3]>,
    /// Texture coordinates of each vertex `[N, 2]`, (0, 0) in the image's upper left corner.
    pub texture_coordinates: Option<&'a [DVec2]>,
    /// Numbers of each vertex `[N]`, by the names of their attributes: `_` and then capitals, digits or `_`.
    pub scalars: Vec<(&'a str, &'a [f64])>,
    /// Anything else, as the scene's `extras`; positions in it are in the scan's own space.
    pub extras: Value,
}

impl<'a> Glb<'a> {
    /// The mesh alone.
    pub fn new(mesh: &'a TriangleMesh) -> Self {
        Self {
            mesh,
            name: "mesh",
            normals: None,
            texture_coordinates: None,
            scalars: Vec::new(),
            extras: Value::Null,
        }
    }
}

/// Writes [`glb_bytes`] to a file.
///
/// # Errors
/// As [`glb_bytes`], and where the file cannot be written.
pub fn write_glb(path: impl AsRef<Path>, glb: &Glb) -> Result<(), FormatError> {
    let path = path.as_ref();
    let bytes = glb_bytes(glb).map_err(|error| error.in_file(path))?;
    write_whole(path, &bytes)
}

/// The mesh as binary glTF 2.0; the same input gives the same bytes.
///
/// glTF stores positions as 32-bit floats. Where the mesh is far from its origin for its size, positions are stored
/// about a rounded centre, which the node's translation adds again, so that their error stays below a millionth of the
/// mesh's size.
///
/// # Errors
/// [`Fault::DoesNotFit`] for an attribute that has not one finite value for each vertex or a name that glTF does not
/// allow, and for more than 4 GiB.
pub fn glb_bytes(glb: &Glb) -> Result<Vec<u8>, FormatError> {
    let centre = stored_centre(glb.mesh.positions());
    let mut parts = Parts::default();
    let attributes = write_attributes(glb, centre, &mut parts)?;
    let indices = parts.add(Values::indices(glb.mesh));
    let document = json!({
        "asset": { "version": "2.0", "generator": format!("{PROGRAM}{}", env!("CARGO_PKG_VERSION")) },
        "scene": 0,
        "scenes": [scene(glb)],
        "nodes": [node(glb, centre)],
        "meshes": [{ "name": glb.name, "primitives": [{ "attributes": attributes, "indices": indices }] }],
        "accessors": parts.accessors,
        "bufferViews": parts.views,
        "buffers": [{ "byteLength": parts.bytes.len() }],
    });
    Ok(container(document.to_string().into_bytes(), parts.bytes)?)
}

fn scene(glb: &Glb) -> Value {
    match &glb.extras {
        Value::Null => json!({ "nodes": [0] }),
        extras => json!({ "nodes": [0], "extras": extras }),
    }
}

fn node(glb: &Glb, centre: DVec3) -> Value {
    match centre {
        DVec3::ZERO => json!({ "name": glb.name, "mesh": 0 }),
        centre => json!({ "name": glb.name, "mesh": 0, "translation": centre.to_array() }),
    }
}

fn write_attributes(glb: &Glb, centre: DVec3, parts: &mut Parts) -> Result<Map<String, Value>, Fault> {
    let vertices = glb.mesh.positions().len();
    let mut attributes = Map::new();
    let mut add = |name: &str, values: Values| -> Result<(), Fault> {
        values.check(name, vertices)?;
        match attributes.insert(name.to_owned(), parts.add(values).into()) {
            Some(_) => Err(Fault::DoesNotFit(format!("the attribute `{name}` is given twice"))),
            None => Ok(()),
        }
    };
    add("POSITION", Values::floats("VEC3", glb.mesh.positions().iter().map(|&p| (p - centre).to_array())))?;
    if let Some(normals) = glb.normals {
        add("NORMAL", Values::floats("VEC3", normals.iter().map(|&n| unit(n).to_array())))?;
    }
    if let Some(coordinates) = glb.texture_coordinates {
        add("TEXCOORD_0", Values::floats("VEC2", coordinates.iter().map(|c| c.to_array())))?;
    }
    for (name, values) in &glb.scalars {
        check_name(name)?;
        add(name, Values::floats("SCALAR", values.iter().map(|&value| [value])))?;
    }
    Ok(attributes)
}

/// The direction of a vector of any length; +Z of one without.
fn unit(vector: DVec3) -> DVec3 {
    match vector.abs().max_element() {
        0.0 => DVec3::Z,
        // Divided first: the square of a very short or long vector is no number.
        largest => (vector / largest).normalize(),
    }
}

fn check_name(name: &str) -> Result<(), Fault> {
    let allowed = |c: char| c.is_ascii_uppercase() || c.is_ascii_digit() || c == '_';
    if name.len() > 1 && name.starts_with('_') && name.chars().all(allowed) {
        return Ok(());
    }
    let problem = format!("the attribute `{name}` must be named `_` and then capitals, digits or `_`");
    Err(Fault::DoesNotFit(problem))
}

/// The point that positions are stored about: the origin, or, where the mesh is many times its size away from it, the
/// centre of its bounding box, rounded to so few digits that 32-bit floats hold it too.
fn stored_centre(positions: &[DVec3]) -> DVec3 {
    const FAR: f64 = 16.0;
    let low = positions.iter().copied().fold(DVec3::INFINITY, DVec3::min);
    let high = positions.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
    // Halved first: the sum of two large numbers may not be one.
    let (centre, size) = (low / 2.0 + high / 2.0, (high / 2.0 - low / 2.0).max_element() * 2.0);
    if centre.abs().max_element() <= FAR * size || !size.is_normal() {
        return DVec3::ZERO;
    }
    let step = size.log2().floor().exp2();
    // Adding zero makes -0 plain.
    (centre / step).round() * step + 0.0
}

/// The values of one accessor, as they will be stored.
struct Values {
    shape: &'static str,
    component_type: u32,
    target: u32,
    count: usize,
    bytes: Vec<u8>,
    low: Vec<f64>,
    high: Vec<f64>,
}

impl Values {
    fn floats<const D: usize>(shape: &'static str, items: impl Iterator<Item = [f64; D]>) -> Self {
        let mut values = Self::of::<D>(shape, 5126, 34962);
        items.for_each(|item| {
            let stored = item.map(|value| value as f32);
            values.push(stored.map(f32::to_le_bytes), stored.map(f64::from));
        });
        values
    }

    fn indices(mesh: &TriangleMesh) -> Self {
        let mut values = Self::of::<1>("SCALAR", 5125, 34963);
        for &index in mesh.triangles().iter().flatten() {
            values.push([index.to_le_bytes()], [f64::from(index)]);
        }
        values
    }

    fn of<const D: usize>(shape: &'static str, component_type: u32, target: u32) -> Self {
        let (low, high) = (vec![f64::INFINITY; D], vec![f64::NEG_INFINITY; D]);
        Self { shape, component_type, target, count: 0, bytes: Vec::new(), low, high }
    }

    fn push<const D: usize>(&mut self, bytes: [[u8; 4]; D], stored: [f64; D]) {
        self.count += 1;
        self.bytes.extend(bytes.iter().flatten());
        for (axis, value) in stored.into_iter().enumerate() {
            // A NaN stays, to be found by the check.
            self.low[axis] = if value < self.low[axis] || value.is_nan() { value } else { self.low[axis] };
            self.high[axis] = if value > self.high[axis] || value.is_nan() { value } else { self.high[axis] };
        }
    }

    fn check(&self, name: &str, vertices: usize) -> Result<(), Fault> {
        if self.count != vertices {
            let problem = format!("the attribute `{name}` has {} values for {vertices} vertices", self.count);
            return Err(Fault::DoesNotFit(problem));
        }
        if !self.low.iter().chain(&self.high).all(|bound| bound.is_finite()) {
            let problem = format!("the attribute `{name}` has a value that is no finite 32-bit number");
            return Err(Fault::DoesNotFit(problem));
        }
        Ok(())
    }
}

/// The binary chunk as it grows, and the JSON that describes it. All components have four bytes, which aligns them.
#[derive(Default)]
struct Parts {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Parts {
    /// Adds an accessor with a view of its own; returns its index.
    fn add(&mut self, values: Values) -> usize {
        self.views.push(json!({
            "buffer": 0,
            "byteOffset": self.bytes.len(),
            "byteLength": values.bytes.len(),
            "target": values.target,
        }));
        self.accessors.push(json!({
            "bufferView": self.views.len() - 1,
            "componentType": values.component_type,
            "count": values.count,
            "type": values.shape,
            "min": values.low,
            "max": values.high,
        }));
        self.bytes.extend(values.bytes);
        self.accessors.len() - 1
    }
}

fn container(mut json: Vec<u8>, binary: Vec<u8>) -> Result<Vec<u8>, Fault> {
    json.resize(json.len().next_multiple_of(4), b' ');
    let length = 12 + 8 + json.len() + 8 + binary.len();
    let too_large = || Fault::DoesNotFit(format!("the file would have {length} bytes; GLB reaches to 2^32"));
    let length = u32::try_from(length).map_err(|_| too_large())?;
    let mut out = Vec::with_capacity(length as usize);
    out.extend(b"glTF");
    out.extend([2, length].map(u32::to_le_bytes).as_flattened());
    for (kind, data) in [(b"JSON", json), (b"BIN\0", binary)] {
        // Both are shorter than the whole, which fits.
        out.extend((data.len() as u32).to_le_bytes());
        out.extend(kind);
        out.extend(data);
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::super::{MeshFormat, parse_mesh};
    use super::*;

    fn tetrahedron(centre: DVec3) -> TriangleMesh {
        let corners = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z].map(|p| p * 0.25 + centre);
        TriangleMesh::new(corners.to_vec(), vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]).unwrap()
    }

    fn read_back(glb: &Glb) -> TriangleMesh {
        parse_mesh(&glb_bytes(glb).unwrap(), MeshFormat::Gltf).unwrap()
    }

    fn json_of(glb: &Glb) -> Value {
        let bytes = glb_bytes(glb).unwrap();
        let length = u32::from_le_bytes(*bytes[12..].first_chunk().unwrap()) as usize;
        serde_json::from_slice(&bytes[20..20 + length]).unwrap()
    }

    #[test]
    fn what_is_written_is_read_back() {
        let mesh = tetrahedron(DVec3::new(0.5, 0.0, -1.0));
        assert_eq!(read_back(&Glb::new(&mesh)), mesh);
        assert_eq!(json_of(&Glb::new(&mesh))["nodes"][0].get("translation"), None);
    }

    #[test]
    fn vertices_in_one_place_and_unnamed_ones_stay() {
        let mut positions = tetrahedron(DVec3::ZERO).positions().to_vec();
        positions.extend([DVec3::X * 0.25, DVec3::ONE]);
        let mesh = TriangleMesh::new(positions, vec![[0, 2, 1], [0, 4, 3]]).unwrap();
        assert_eq!(read_back(&Glb::new(&mesh)), mesh);
    }

    #[test]
    fn a_mesh_far_away_loses_nothing() {
        for far in [DVec3::new(1e6, 0.0, 0.0), DVec3::new(-4_531_234.56, 123.4, 7e7), DVec3::splat(1e12)] {
            let mesh = tetrahedron(far);
            let read = read_back(&Glb::new(&mesh));
            let pairs = mesh.positions().iter().zip(read.positions());
            let furthest = pairs.map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
            // Above 1e9 doubles themselves are coarser.
            assert!(furthest <= 1e-6 * 0.25 + far.length() * 1e-15, "{far}: {furthest}");
        }
    }

    #[test]
    fn the_stored_centre_is_a_32_bit_number() {
        let translation =
            &json_of(&Glb::new(&tetrahedron(DVec3::splat(123_456.789))))["nodes"][0]["translation"];
        for coordinate in translation.as_array().unwrap() {
            let coordinate = coordinate.as_f64().unwrap();
            assert_eq!(f64::from(coordinate as f32), coordinate);
            assert!((coordinate - 123_456.789).abs() < 0.25);
        }
    }

    #[test]
    fn attributes_and_extras_are_described() {
        let mesh = tetrahedron(DVec3::ZERO);
        let (normals, uvs) =
            ([DVec3::X * 1e-300, DVec3::ZERO, DVec3::Y * 1e300, DVec3::NEG_Z], [DVec2::ONE; 4]);
        let residual = [0.5, 0.1, 0.0, 2.0];
        let glb = Glb {
            normals: Some(&normals),
            texture_coordinates: Some(&uvs),
            scalars: vec![("_RESIDUAL", &residual)],
            extras: json!({ "landmarks": { "tip": [0.0, 0.0, 0.25] } }),
            ..Glb::new(&mesh)
        };
        let document = json_of(&glb);
        let attributes = &document["meshes"][0]["primitives"][0]["attributes"];
        assert_eq!(*attributes, json!({ "POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2, "_RESIDUAL": 3 }));
        assert_eq!(document["accessors"][0]["max"], json!([0.25, 0.25, 0.25]));
        assert_eq!(document["accessors"][1]["max"], json!([1.0, 1.0, 1.0]));
        assert_eq!(document["accessors"][3]["min"], json!([0.0]));
        assert_eq!(document["scenes"][0]["extras"]["landmarks"]["tip"], json!([0.0, 0.0, 0.25]));
        assert_eq!(glb_bytes(&glb).unwrap(), glb_bytes(&glb.clone()).unwrap());
    }

    #[test]
    fn what_does_not_fit_is_refused() {
        let mesh = tetrahedron(DVec3::ZERO);
        let complaint = |name, values: &[f64]| {
            let glb = Glb { scalars: vec![(name, values)], ..Glb::new(&mesh) };
            glb_bytes(&glb).unwrap_err().to_string()
        };
        assert!(complaint("_A", &[1.0; 3]).contains("3 values for 4 vertices"));
        assert!(complaint("_A", &[1.0, f64::NAN, 0.0, 0.0]).contains("`_A` has a value"));
        assert!(complaint("_A", &[1.0, 1e39, 0.0, 0.0]).contains("`_A` has a value"));
        for name in ["A", "_", "_a", "POSITION", ""] {
            assert!(complaint(name, &[1.0; 4]).contains("must be named"), "{name}");
        }
        let twice = Glb { scalars: vec![("_A", &[1.0; 4]), ("_A", &[1.0; 4])], ..Glb::new(&mesh) };
        assert!(glb_bytes(&twice).unwrap_err().to_string().contains("given twice"));
        let vast = TriangleMesh::new(vec![DVec3::ZERO, DVec3::X * 1e300, DVec3::Y], vec![[0, 1, 2]]).unwrap();
        assert!(glb_bytes(&Glb::new(&vast)).unwrap_err().to_string().contains("`POSITION`"));
    }
}

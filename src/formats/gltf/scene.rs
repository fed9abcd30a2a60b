use std::collections::{BTreeSet, HashMap};

use glam::{DMat4, DQuat, DVec3};

use super::accessor;
use super::buffer::Buffers;
use super::document::{Node, Primitive};
use super::surface::Surface;
use crate::formats::error::Fault;
use crate::formats::geometry::Geometry;
use crate::mesh::Points;

/// The triangles of a scene, in its space, and where their vertices stand in the file.
pub(super) struct Scene {
    pub geometry: Geometry,
    pub places: Vec<Place>,
}

/// An accessor's positions among the scene's vertices.
pub(super) struct Place {
    pub accessor: usize,
    /// To the scene.
    pub transform: DMat4,
    pub first: u32,
    pub count: u32,
    /// The accessors that hold normals of the same vertices.
    pub normals: BTreeSet<usize>,
}

/// The default scene. A file without nodes has its meshes as they are.
pub(super) fn gather(buffers: &Buffers) -> Result<Scene, Fault> {
    let document = buffers.document();
    let mut gathered = Gathered {
        buffers,
        geometry: Geometry::default(),
        surface: Surface::new(buffers),
        places: Vec::new(),
        placed: HashMap::new(),
        others: 0,
    };
    if document.node_count() == 0 {
        (0..document.mesh_count()).try_for_each(|mesh| gathered.mesh(mesh, DMat4::IDENTITY))?;
    } else {
        gathered.nodes()?;
    }
    if gathered.geometry.polygons.is_empty() {
        let problem = format!("has no triangle ({} primitives of points or lines)", gathered.others);
        return Err(Fault::at("the default scene", problem));
    }
    gathered.surface.finish(&mut gathered.geometry);
    Ok(Scene { geometry: gathered.geometry, places: gathered.places })
}

struct Gathered<'g, 'a> {
    buffers: &'g Buffers<'a>,
    geometry: Geometry,
    surface: Surface<'g, 'a>,
    places: Vec<Place>,
    /// The place of each accessor under each transform: primitives and meshes often share their vertices and differ in
    /// their indices.
    placed: HashMap<(usize, [u64; 16]), usize>,
    /// Primitives that are no triangles.
    others: usize,
}

/// A node whose children are being visited.
struct Branch {
    transform: DMat4,
    children: std::vec::IntoIter<usize>,
}

impl Gathered<'_, '_> {
    /// Walks the node tree without recursion: a file may nest deeper than the stack.
    fn nodes(&mut self) -> Result<(), Fault> {
        let document = self.buffers.document();
        let mut seen = vec![false; document.node_count()];
        let roots = document.roots()?;
        let mut branches = vec![Branch { transform: DMat4::IDENTITY, children: roots.into_iter() }];
        while let Some(branch) = branches.last_mut() {
            let Some(index) = branch.children.next() else {
                branches.pop();
                continue;
            };
            let parent = branch.transform;
            let node = document.node(index)?;
            if std::mem::replace(&mut seen[index], true) {
                let problem = "is reached twice: nodes must form a tree, without cycles and shared children";
                return Err(Fault::at(format_args!("nodes[{index}]"), problem));
            }
            let transform = self.node(index, &node, parent)?;
            branches.push(Branch { transform, children: node.children.into_iter() });
        }
        Ok(())
    }

    /// Adds a node's mesh; returns its transform to the scene.
    fn node(&mut self, index: usize, node: &Node, parent: DMat4) -> Result<DMat4, Fault> {
        let transform = parent * local_transform(node);
        if !transform.is_finite() {
            return Err(Fault::at(format_args!("nodes[{index}]"), "has a transform that is not finite"));
        }
        if let Some(mesh) = node.mesh {
            // A skin places its mesh by its joints, not by the node.
            self.mesh(mesh, if node.skin.is_some() { DMat4::IDENTITY } else { transform })?;
        }
        Ok(transform)
    }

    fn mesh(&mut self, index: usize, transform: DMat4) -> Result<(), Fault> {
        for (at, primitive) in self.buffers.document().mesh(index)?.primitives.iter().enumerate() {
            if !(4..=6).contains(&primitive.mode) {
                self.others += 1;
                continue;
            }
            let place = format!("meshes[{index}].primitives[{at}]");
            let position = primitive.attributes.position;
            let accessor =
                position.ok_or_else(|| Fault::at(&place, "has no POSITION: its vertices are lost"))?;
            let key = (accessor, transform.to_cols_array().map(f64::to_bits));
            let placed = match self.placed.get(&key) {
                Some(&placed) => placed,
                None => {
                    let (first, count) = self.vertices(accessor, transform)?;
                    self.surface.vertices((first, count), primitive.attributes.colour);
                    self.places.push(Place { accessor, transform, first, count, normals: BTreeSet::new() });
                    self.places.len() - 1
                }
            };
            self.placed.insert(key, placed);
            let place_of = &mut self.places[placed];
            place_of.normals.extend(primitive.attributes.normal);
            let range = (place_of.first, place_of.count);
            self.primitive(primitive, range, transform.determinant() < 0.0, &place)?;
        }
        Ok(())
    }

    /// Adds an accessor's positions; returns the first one's index and their number.
    fn vertices(&mut self, accessor: usize, transform: DMat4) -> Result<(u32, u32), Fault> {
        let positions = accessor::positions(self.buffers, accessor)?;
        let range =
            u32::try_from(self.geometry.positions.count()).ok().zip(u32::try_from(positions.len()).ok());
        let fits = range.filter(|(first, count)| first.checked_add(*count).is_some());
        let range = fits
            .ok_or_else(|| Fault::at("the default scene", "has more vertices than 32-bit indices reach"))?;
        self.geometry.positions.extend(positions.into_iter().map(|p| transform.transform_point3(p)));
        Ok(range)
    }

    fn primitive(
        &mut self,
        primitive: &Primitive,
        (first, count): (u32, u32),
        mirrored: bool,
        place: &str,
    ) -> Result<(), Fault> {
        let indices = match primitive.indices {
            Some(accessor) => accessor::indices(self.buffers, accessor)?,
            None => (0..count).collect(),
        };
        if let Some(index) = indices.iter().find(|&&index| index >= count) {
            let problem = format!("names vertex {index}, but has {count}, counted from 0");
            return Err(Fault::at(place, problem));
        }
        if primitive.mode == 4 && indices.len() % 3 != 0 {
            let problem = format!("has {} indices, which do not make whole triangles", indices.len());
            return Err(Fault::at(place, problem));
        }
        let turned = |[a, b, c]: [u32; 3]| if mirrored { [a, c, b] } else { [a, b, c] };
        let polygons = &mut self.geometry.polygons;
        let before = polygons.corners().len();
        for corners in triangles(primitive.mode, &indices) {
            polygons.push_triangle(turned(corners.map(|index| first + index)));
        }
        self.surface.triangles(primitive, &polygons.corners()[before..], (first, count), before);
        Ok(())
    }
}

/// Corners of the triangles (4), strip (5) or fan (6), all turning the same way.
fn triangles(mode: u32, indices: &[u32]) -> impl Iterator<Item = [u32; 3]> {
    let count = if mode == 4 { indices.len() / 3 } else { indices.len().saturating_sub(2) };
    (0..count).map(move |i| match mode {
        4 => [indices[3 * i], indices[3 * i + 1], indices[3 * i + 2]],
        5 => [indices[i], indices[i + 1 + i % 2], indices[i + 2 - i % 2]],
        _ => [indices[i + 1], indices[i + 2], indices[0]],
    })
}

fn local_transform(node: &Node) -> DMat4 {
    if let Some(matrix) = &node.matrix {
        return DMat4::from_cols_array(matrix);
    }
    let rotation = DQuat::from_array(node.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]));
    // A quaternion of no length turns nothing.
    let length = rotation.length();
    let rotation = if length > 0.0 { rotation / length } else { DQuat::IDENTITY };
    let scale = node.scale.map_or(DVec3::ONE, DVec3::from);
    let translation = node.translation.map_or(DVec3::ZERO, DVec3::from);
    DMat4::from_scale_rotation_translation(scale, rotation, translation)
}

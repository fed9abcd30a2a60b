use glam::DVec3;

use super::{Axes, LandmarkFile, Mark};
use crate::formats::error::{Fault, FormatError};
use crate::formats::geometry::{GONE, Numbers};
use crate::formats::mesh_file::MeshFile;
use crate::formats::text::shown;
use crate::mesh::{LandmarkSet, Points, TriangleMesh};

impl LandmarkFile {
    /// The landmarks' positions on their scan, in its own space.
    ///
    /// Points of 3D Slicer come out in the axes of the mesh: right, front, up where its file says `SPACE=RAS`, and
    /// otherwise left, back, up, which Slicer and all else takes a mesh file to be in. A list of `[integer, u, v]` is taken for
    /// points where all of them are within the mesh's bounds, and for triangles otherwise.
    ///
    /// # Errors
    /// [`FormatError`] names the landmark, or the line, and the vertex or triangle that the mesh does not have.
    pub fn on<P: Points>(&self, mesh: &MeshFile<P>) -> Result<LandmarkSet, FormatError> {
        let on_triangles = self.maybe_on_triangles && !self.is_within(&mesh.mesh);
        let turned = self.axes.is_some_and(|axes| (axes == Axes::Ras) != mesh.states_ras);
        let position = |mark: Mark| match mark {
            Mark::Point(point) if on_triangles => on_triangle(point, mesh),
            Mark::Point(point) if turned => Ok(turned_about(point)),
            Mark::Point(point) => Ok(point),
            Mark::Vertex { index, line } => vertex(index, mesh).map_err(|problem| {
                Fault::at(format_args!("line {line}"), format!("names vertex {index}, {problem}"))
            }),
        };
        self.resolved(position)
    }

    /// The landmarks' positions, where they need no mesh; points of 3D Slicer to left, back and up.
    ///
    /// # Errors
    /// [`FormatError`] where landmarks are vertices of a mesh.
    pub fn positions(&self) -> Result<LandmarkSet, FormatError> {
        self.resolved(|mark| match mark {
            Mark::Point(point) if self.axes == Some(Axes::Ras) => Ok(turned_about(point)),
            Mark::Point(point) => Ok(point),
            Mark::Vertex { .. } => {
                Err(Fault::at("the landmarks", "are vertices: they need the mesh beside them"))
            }
        })
    }

    fn resolved(&self, position: impl Fn(Mark) -> Result<DVec3, Fault>) -> Result<LandmarkSet, FormatError> {
        let point = |(name, mark): (&String, &Option<Mark>)| {
            let place = || format!("landmark `{}`", shown(name.as_bytes()));
            let Some(mark) = *mark else { return Ok(None) };
            match position(mark)? {
                point if point.is_finite() => Ok(Some(point)),
                point => Err(Fault::at(place(), format!("is at {point}, which is no finite number"))),
            }
        };
        let points = self.names.iter().zip(&self.marks).map(point).collect::<Result<_, _>>()?;
        Ok(LandmarkSet { scheme: self.scheme.clone(), names: self.names.clone(), points })
    }

    /// Whether all points are within the bounds of the mesh, or as good as.
    fn is_within(&self, mesh: &TriangleMesh<impl Points>) -> bool {
        const MARGIN: f64 = 0.05;
        let low = mesh.points().each().fold(DVec3::INFINITY, DVec3::min);
        let high = mesh.points().each().fold(DVec3::NEG_INFINITY, DVec3::max);
        let margin = DVec3::splat(MARGIN * (high - low).length());
        let within = |point: DVec3| point.cmpge(low - margin).all() && point.cmple(high + margin).all();
        self.marks.iter().flatten().all(|mark| matches!(mark, Mark::Point(point) if within(*point)))
    }
}

/// From left, back, up to right, front, up, or back.
fn turned_about(point: DVec3) -> DVec3 {
    DVec3::new(-point.x, -point.y, point.z)
}

/// The point that `[triangle, u, v]` means.
fn on_triangle(mark: DVec3, mesh: &MeshFile<impl Points>) -> Result<DVec3, Fault> {
    let [_, u, v] = mark.to_array();
    let index = mark.x as u64;
    let triangles = mesh.mesh.triangles();
    let corners = number(&mesh.order.triangles, index).and_then(|index| triangles.get(index)).ok_or_else(|| {
        let problem = format!(
            "[{index}, {u}, {v}] is no point within the mesh's bounds, and the mesh, which has {} triangles, \
             has none of that number: it is another mesh, or was saved again",
            triangles.len()
        );
        Fault::at("the landmarks", problem)
    })?;
    let [a, b, c] = corners.map(|index| mesh.mesh.position(index));
    Ok(a * u + b * v + c * (1.0 - u - v))
}

fn vertex(index: u64, mesh: &MeshFile<impl Points>) -> Result<DVec3, String> {
    let numbers = &mesh.order.vertices;
    let count = match numbers {
        Numbers::Kept => mesh.mesh.points().count(),
        Numbers::Changed(numbers) => numbers.len(),
        Numbers::None => {
            return Err("but STL has no numbered vertices: give points, or the mesh as PLY or OBJ".to_owned());
        }
    };
    if usize::try_from(index).is_ok_and(|index| index < count) {
        let there = number(numbers, index).map(|index| mesh.mesh.points().at(index));
        return there.ok_or_else(|| "which is of no triangle".to_owned());
    }
    Err(format!("but the mesh has {count}, counted from 0"))
}

/// The number in the mesh of what has this number in its file.
fn number(numbers: &Numbers, index: u64) -> Option<usize> {
    let index = usize::try_from(index).ok()?;
    match numbers {
        Numbers::Kept => Some(index),
        Numbers::Changed(numbers) => numbers.get(index).filter(|&&to| to != GONE).map(|&to| to as usize),
        Numbers::None => None,
    }
}

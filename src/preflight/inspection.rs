//! One scan by itself.

use glam::DVec3;
use serde::Serialize;

use super::connectivity::{BoundaryLoop, Component, Connectivity};
use super::finding::{Code, Finding, Severity};
use super::frame::{Axes, Basis, UnitGuess, between_eyes};
use super::scan_landmarks::{LandmarkFigures, inspect_landmarks};
use super::triangles;
use crate::formats::Scheme;
use crate::mesh::{LandmarkSet, Points, TriangleMesh};

/// Components and boundary loops that are listed, the largest of them; all are counted.
const LISTED: usize = 16;
/// Parts with less of the surface's area than this are crumbs.
const CRUMB: f64 = 0.01;
/// Volume to area^(3/2), six times; below it a surface has no clear inside. That of a sphere is 0.56.
const HOLLOW: f64 = 0.01;

/// What is known of a scan before it is registered. Lengths are in scan units.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Inspection {
    /// What is wrong or worth knowing, the worst first.
    pub findings: Vec<Finding>,
    /// Number of vertices.
    pub vertices: usize,
    /// Number of triangles.
    pub triangles: usize,
    /// The smallest coordinates of the vertices that triangles name.
    pub min: [f64; 3],
    /// The largest.
    pub max: [f64; 3],
    /// The surface's area.
    pub area: f64,
    /// In which unit it seems to be.
    pub unit: UnitGuess,
    /// How the face is turned.
    pub axes: Axes,
    /// How many parts share no vertex.
    pub component_count: usize,
    /// The largest of them by area, at most 16.
    pub components: Vec<Component>,
    /// How many rims there are.
    pub boundary_loop_count: usize,
    /// The longest of them, at most 16.
    pub boundary_loops: Vec<BoundaryLoop>,
    /// Edges of three and more triangles.
    pub non_manifold_edges: usize,
    /// Vertices whose triangles are not one fan.
    pub non_manifold_vertices: usize,
    /// Triangles that name a vertex twice or are flat.
    pub degenerate_triangles: usize,
    /// Triangles with the corners of one before them.
    pub duplicate_triangles: usize,
    /// Edges between triangles with opposed normals.
    pub opposed_edges: usize,
    /// Vertices of no triangle.
    pub unreferenced_vertices: usize,
    /// Whether the normals point outwards; `null` where the surface has no clear inside.
    pub outward: Option<bool>,
    /// The landmarks, if any were given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub landmarks: Option<LandmarkFigures>,
}

impl Inspection {
    /// Looks at a scan and, if there are any, its landmarks in the same space.
    pub fn new(mesh: &TriangleMesh<impl Points>, landmarks: Option<&LandmarkSet>) -> Self {
        let connectivity = Connectivity::of(mesh);
        let (min, max) = bounds(mesh);
        let scheme = landmarks.and_then(|set| Scheme::named(set.scheme.as_deref()?));
        let known = scheme.zip(landmarks);
        let eyes = known.and_then(|(scheme, set)| between_eyes(scheme, set));
        let (figures, axes, findings) = match landmarks.map(|set| inspect_landmarks(mesh, set)) {
            Some((figures, axes, findings)) => (Some(figures), axes, findings),
            None => (None, None, Vec::new()),
        };
        let area = connectivity.components.iter().map(|part| part.area).sum();
        let largest = connectivity.components.first().map_or(0.0, |part| part.area);
        let hollow = HOLLOW * largest.powf(1.5);
        let clear = connectivity.largest_volume.abs() > hollow;
        let mut inspection = Self {
            findings: Vec::new(),
            vertices: mesh.points().count(),
            triangles: mesh.triangles().len(),
            min: min.to_array(),
            max: max.to_array(),
            area,
            unit: UnitGuess::new(max - min, eyes),
            axes: axes.unwrap_or_else(|| Axes::guessed(min.midpoint(max), max - min, &connectivity.loops)),
            component_count: connectivity.components.len(),
            components: connectivity.components.iter().take(LISTED).copied().collect(),
            boundary_loop_count: connectivity.loops.len(),
            boundary_loops: connectivity.loops.iter().take(LISTED).copied().collect(),
            non_manifold_edges: connectivity.non_manifold_edges,
            non_manifold_vertices: connectivity.non_manifold_vertices,
            degenerate_triangles: triangles::degenerate(mesh),
            duplicate_triangles: connectivity.duplicate_triangles,
            opposed_edges: connectivity.opposed_edges,
            unreferenced_vertices: connectivity.unreferenced_vertices,
            outward: clear.then_some(connectivity.largest_volume > 0.0),
            landmarks: figures,
        };
        inspection.find_in_frame();
        inspection.find_in_surface(&connectivity);
        inspection.find_in_triangles();
        inspection.findings.extend(findings);
        // Stable: findings of one severity stay in the order of the scan's parts.
        inspection.findings.sort_by_key(|finding| std::cmp::Reverse(finding.severity));
        inspection
    }

    /// The worst severity found.
    pub fn worst(&self) -> Option<Severity> {
        self.findings.first().map(|finding| finding.severity)
    }

    fn find(&mut self, code: Code, found: String, advice: &str) {
        self.findings.push(Finding::new(code, found, advice));
    }

    fn find_in_frame(&mut self) {
        let UnitGuess { unit, clear, basis, length } = self.unit;
        if !clear {
            let what = match basis {
                Basis::Landmarks => "between the eyes",
                Basis::Extent => "along its longest side",
            };
            let found =
                format!("{length:.4} units {what} are no head in m, cm or mm; {} is nearest", unit.sign());
            self.find(
                Code::UnitUnclear,
                found,
                "registration works in any unit; figures in millimetres will be wrong",
            );
        }
        if self.axes.basis == Basis::Extent {
            let found =
                "no landmarks of a known scheme tell which way is up and where the face looks".to_owned();
            self.find(Code::AxesGuessed, found, "give landmarks with their scheme, for instance multipie68");
        }
    }

    fn find_in_surface(&mut self, connectivity: &Connectivity) {
        let parts = &connectivity.components;
        if parts.len() > 1 {
            let crumbs = parts.iter().filter(|part| part.area < CRUMB * self.area).count();
            let share = 100.0 * parts[0].area / self.area;
            let found = format!(
                "{} parts share no vertex; the largest has {share:.1} % of the area, {crumbs} have less than 1 %",
                parts.len()
            );
            self.find(Code::SeveralComponents, found, "keep the head, and weld vertices if seams are open");
        }
        if let Some(longest) = connectivity.loops.first() {
            let found = format!(
                "{} rims, the longest of {} vertices and {:.4} units",
                connectivity.loops.len(),
                longest.vertices,
                longest.length
            );
            self.find(Code::OpenBoundary, found, "nothing, if the scan is meant to be open there");
        }
        if self.outward == Some(false) {
            let found = "the triangles' normals point into the head".to_owned();
            self.find(
                Code::InsideOut,
                found,
                "turn all triangles round, or mirror the scan back if it is mirrored",
            );
        }
    }

    fn find_in_triangles(&mut self) {
        let weld = "repair the mesh: the surface is ambiguous there";
        let drop = "leave them out of the mesh";
        let counted = [
            (Code::NonManifoldEdges, self.non_manifold_edges, "edges of three or more triangles", weld),
            (
                Code::NonManifoldVertices,
                self.non_manifold_vertices,
                "vertices where surfaces touch in a point",
                weld,
            ),
            (Code::DegenerateTriangles, self.degenerate_triangles, "triangles without area", drop),
            (
                Code::DuplicateTriangles,
                self.duplicate_triangles,
                "triangles that are there more than once",
                drop,
            ),
            (
                Code::OrientationInconsistent,
                self.opposed_edges,
                "edges between triangles with opposed normals",
                "orient the triangles alike",
            ),
            (
                Code::UnreferencedVertices,
                self.unreferenced_vertices,
                "vertices of no triangle",
                "nothing, or leave them out: they move the scan's centre",
            ),
        ];
        for (code, count, what, advice) in counted.into_iter().filter(|(_, count, ..)| *count > 0) {
            self.find(code, format!("{count} {what}"), advice);
        }
    }
}

/// The box around the vertices that triangles name.
fn bounds(mesh: &TriangleMesh<impl Points>) -> (DVec3, DVec3) {
    let corners = mesh.triangles().iter().flatten().map(|&i| mesh.position(i));
    corners.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(min, max), p| (min.min(p), max.max(p)))
}

//! Parts of a template that lie apart from the face and carry no landmark, eyeballs and teeth for instance: they are
//! matched to nothing and follow the face around them.

use std::collections::BTreeMap;

use glam::DVec3;
use rayon::prelude::*;

use super::template::Template;
use crate::mesh::{SurfacePoint, components};
use crate::numeric::Similarity;

/// A template taken apart.
#[derive(Debug, Clone)]
pub(super) struct Parts {
    whole: Template,
    /// The components with landmarks, as a template of their own; all of them if none has any.
    pub main: Template,
    /// The vertices of the whole that are the main part's, in their order.
    main_vertices: Vec<u32>,
    /// The vertices of each other component; those without a triangle are one.
    carried: Vec<Vec<u32>>,
}

impl Parts {
    pub fn of(whole: &Template) -> Self {
        let component = components_with_triangles(whole);
        let landmark_on = |at: &SurfacePoint| component[whole.triangles[at.triangle.0 as usize][0] as usize];
        let mut is_main = vec![whole.landmarks.is_empty(); whole.positions.len() + 1];
        whole.landmarks.values().for_each(|at| is_main[landmark_on(at) as usize] = true);
        let mut carried: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
        let mut main_vertices = Vec::new();
        for (vertex, &component) in component.iter().enumerate() {
            let part = if is_main[component as usize] {
                &mut main_vertices
            } else {
                carried.entry(component).or_default()
            };
            part.push(vertex as u32);
        }
        let main = part(whole, &main_vertices);
        Self { whole: whole.clone(), main, main_vertices, carried: carried.into_values().collect() }
    }

    /// The whole template's positions `[N, 3]` with the main part at `main`: each other part follows by a similarity.
    pub fn carry(&self, main: &[DVec3]) -> Vec<DVec3> {
        let mut positions = self.whole.positions.clone();
        for (&vertex, &position) in self.main_vertices.iter().zip(main) {
            positions[vertex as usize] = position;
        }
        let follow = |part: &Vec<u32>| self.similarity(part, main);
        let similarities: Vec<Similarity> = self.carried.par_iter().map(follow).collect();
        for (part, similarity) in self.carried.iter().zip(similarities) {
            for &vertex in part {
                positions[vertex as usize] = similarity.apply(self.whole.positions[vertex as usize]);
            }
        }
        positions
    }

    /// How far each vertex of the whole template `[N]` is known, by the main part's; the other parts only follow.
    pub fn confidence(&self, main: &[f32]) -> Vec<f32> {
        let mut confidence = vec![0.0; self.whole.positions.len()];
        for (&vertex, &own) in self.main_vertices.iter().zip(main) {
            confidence[vertex as usize] = own;
        }
        confidence
    }

    /// How the main part moves around another: near vertices count most, by a Gaussian of their distance at rest that is
    /// as wide as the part itself, or as its distance from the main part where that is more.
    fn similarity(&self, part: &[u32], main: &[DVec3]) -> Similarity {
        let own = || part.iter().map(|&vertex| self.whole.positions[vertex as usize]);
        let centre = own().sum::<DVec3>() / part.len() as f64;
        let radius = own().map(|p| p.distance_squared(centre)).fold(0.0, f64::max);
        let squared: Vec<f64> = self.main.positions.iter().map(|p| p.distance_squared(centre)).collect();
        let nearest = squared.iter().copied().fold(f64::INFINITY, f64::min);
        let width = radius.max(nearest).max(f64::MIN_POSITIVE);
        let weights: Vec<f64> = squared.iter().map(|squared| (-(squared - nearest) / width).exp()).collect();
        Similarity::between(&self.main.positions, main, &weights)
    }
}

/// The triangles of the template that are held against scans: those of components with landmarks, and of these not
/// where a mask takes nothing. All of them if that leaves none.
pub(super) fn matched_triangles(template: &Template) -> Vec<[u32; 3]> {
    let component = components(template.positions.len(), &template.triangles);
    let mut has_landmark = vec![template.landmarks.is_empty(); template.positions.len()];
    for at in template.landmarks.values() {
        has_landmark[component[template.triangles[at.triangle.0 as usize][0] as usize] as usize] = true;
    }
    let takes = |i: u32| template.mask.as_ref().is_none_or(|mask| mask[i as usize] > 0.0);
    let matched = |corners: &&[u32; 3]| {
        has_landmark[component[corners[0] as usize] as usize] && corners.iter().all(|&i| takes(i))
    };
    let triangles: Vec<[u32; 3]> = template.triangles.iter().filter(matched).copied().collect();
    if triangles.is_empty() { template.triangles.clone() } else { triangles }
}

/// The component of each vertex `[N]`, called by a vertex of it; N for vertices without a triangle.
fn components_with_triangles(template: &Template) -> Vec<u32> {
    let vertices = template.positions.len();
    let mut has_triangle = vec![false; vertices];
    template.triangles.iter().flatten().for_each(|&corner| has_triangle[corner as usize] = true);
    let components = components(vertices, &template.triangles);
    let called = |(component, has)| if has { component } else { vertices as u32 };
    components.into_iter().zip(has_triangle).map(called).collect()
}

/// The part of a template that has these vertices, ascending: whole components, and those of all landmarks.
fn part(whole: &Template, vertices: &[u32]) -> Template {
    if vertices.len() == whole.positions.len() {
        return whole.clone();
    }
    const GONE: u32 = u32::MAX;
    let mut number = vec![GONE; whole.positions.len()];
    vertices.iter().zip(0..).for_each(|(&vertex, new)| number[vertex as usize] = new);
    let mut triangle_number = vec![GONE; whole.triangles.len()];
    let mut triangles = Vec::new();
    for (old, corners) in whole.triangles.iter().enumerate() {
        let corners = corners.map(|corner| number[corner as usize]);
        if corners[0] != GONE {
            triangle_number[old] = triangles.len() as u32;
            triangles.push(corners);
        }
    }
    let moved = |(name, at): (&String, &SurfacePoint)| {
        let mut at = *at;
        at.triangle.0 = triangle_number[at.triangle.0 as usize];
        (name.clone(), at)
    };
    Template {
        positions: vertices.iter().map(|&vertex| whole.positions[vertex as usize]).collect(),
        triangles,
        landmarks: whole.landmarks.iter().map(moved).collect(),
        scheme: whole.scheme.clone(),
        texture_coordinates: whole.texture_coordinates.as_ref().map(|uv| those(uv, vertices)),
        mask: whole.mask.as_ref().map(|mask| those(mask, vertices)),
        frozen: whole.frozen,
    }
}

fn those<T: Copy>(values: &[T], vertices: &[u32]) -> Vec<T> {
    vertices.iter().map(|&vertex| values[vertex as usize]).collect()
}

//! The head that comes with the program: the frozen collection of sculpted heads in `templates/head68.glb`, which
//! `make templates` makes.

use std::sync::LazyLock;

use glam::{DVec3, Vec3A};

use super::frozen::FrozenCollection;
use super::sphere::Sphere;
use super::template::Template;
use crate::mesh::Icosphere;

static HEAD: LazyLock<Template> = LazyLock::new(|| {
    let bytes = include_bytes!("../../templates/head68.glb");
    let frozen = FrozenCollection::parse(bytes).ok().flatten();
    frozen.expect("the head that comes with the program is whole, as a test holds").template
});

/// The mean of sculpted heads with the landmarks of the 68-point scheme, on the triangles of a sphere.
pub fn head() -> &'static Template {
    &HEAD
}

/// Whether these landmarks of a collection are the head's.
pub(super) fn has_landmarks(names: &[String], scheme: Option<&str>) -> bool {
    scheme == head().scheme.as_deref() && names.iter().all(|name| head().landmarks.contains_key(name))
}

/// The head on the triangles of a sphere of at most its own level `[N, 3]`: a sphere's vertices are the first ones of
/// the next finer one.
pub(super) fn positions(level: u32) -> Vec<Vec3A> {
    let count = Icosphere::new(level).positions.len();
    head().positions.iter().take(count).map(|p| p.as_vec3a()).collect()
}

/// Where these landmarks of the head are on the sphere; those it does not have are left out.
pub(super) fn directions(names: &[String]) -> Vec<DVec3> {
    let level = Icosphere::level_of(head().positions.len()).unwrap_or(0);
    Sphere::of_level(level).directions(names.iter().filter_map(|name| head().landmarks.get(name))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Topology;

    #[test]
    fn the_head_is_whole_and_on_the_triangles_of_a_sphere() {
        let head = head();
        let level = Icosphere::level_of(head.positions.len()).unwrap();
        assert_eq!(head.triangles, Icosphere::new(level).triangles);
        assert_eq!(head.landmarks.len(), 68);
        assert_eq!(head.scheme.as_deref(), Some("multipie68"));
        assert!(head.frozen && head.texture_coordinates.is_some());
    }

    #[test]
    fn its_coarse_version_has_the_same_shape() {
        let coarse = positions(4);
        let topology = Topology::new(coarse.len(), &Icosphere::new(4).triangles);
        let longest = topology.edges.iter().map(|&[a, b]| coarse[a as usize].distance(coarse[b as usize]));
        assert!(longest.fold(0.0, f32::max) < 0.3, "its vertices are not the first ones of the fine head");
    }
}

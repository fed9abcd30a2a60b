use glam::DVec3;

use super::Colour;
use crate::mesh::LandmarkSet;

/// How a mesh is drawn.
#[derive(Debug, Clone, PartialEq)]
pub struct Style {
    /// Colour of triangles seen from outside.
    pub surface: Colour,
    /// Colour of triangles seen from inside: a warning.
    pub inside: Colour,
    /// Colour where there is no mesh.
    pub paper: Colour,
    /// How the light's angle is taken.
    pub shading: Shading,
    /// A colour for every vertex `[N]` in place of `surface`.
    pub vertex_colours: Option<Vec<Colour>>,
    /// Edges drawn over the surface.
    pub wireframe: Option<Wireframe>,
    /// Dots drawn where the surface does not hide them.
    pub dots: Vec<Dot>,
}

/// How the light's angle is taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shading {
    /// From normals interpolated between the vertices.
    Smooth,
    /// From each triangle's own normal.
    Flat,
}

/// How edges are drawn over the surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wireframe {
    /// Colour of the lines.
    pub colour: Colour,
    /// Width of the lines in pixels.
    pub width: f64,
}

/// A dot on the picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dot {
    /// Where it is, in the mesh's space.
    pub position: DVec3,
    /// Its colour.
    pub colour: Colour,
    /// Its radius in pixels.
    pub radius: f64,
}

impl Default for Style {
    fn default() -> Self {
        Self {
            surface: Colour::srgb(0xd9cdc0),
            inside: Colour::srgb(0xe02020),
            paper: Colour::WHITE,
            shading: Shading::Smooth,
            vertex_colours: None,
            wireframe: None,
            dots: Vec::new(),
        }
    }
}

impl Style {
    /// Smooth shaded.
    pub fn smooth() -> Self {
        Self::default()
    }

    /// Flat shaded with thin dark edges.
    pub fn wireframe() -> Self {
        let lines = Wireframe { colour: Colour::srgb(0x1d2b3a), width: 0.8 };
        Self { shading: Shading::Flat, wireframe: Some(lines), ..Self::default() }
    }

    /// The same with a heat map of `values` `[N]`, one a vertex: 0 cold, `hot` and more hot.
    pub fn heated(self, values: &[f64], hot: f64) -> Self {
        Self { vertex_colours: Some(values.iter().map(|v| Colour::heat(v / hot)).collect()), ..self }
    }

    /// The same with a dot on every landmark that is present.
    pub fn dotted(mut self, landmarks: &LandmarkSet, colour: Colour) -> Self {
        self.dots.extend(landmarks.present().map(|(_, position)| Dot { position, colour, radius: 3.0 }));
        self
    }
}

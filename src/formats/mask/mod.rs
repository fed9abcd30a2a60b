//! Masks: how much each vertex of a scan counts as data, or of a template takes of it, from 0 (none) to 1.

mod json;
mod painted;
#[cfg(test)]
mod tests;

use std::path::Path;

use glam::DVec3;

use super::error::{Fault, FormatError};
use super::geometry::{GONE, Numbers};
use super::input::read_file;
use super::mesh_file::MeshFile;
use crate::mesh::{LandmarkSet, Points};
use painted::Painted;

/// A mask as its file has it, for a mesh that is not known yet.
#[derive(Debug, Clone, PartialEq)]
pub struct MaskFile(Source);

#[derive(Debug, Clone, PartialEq)]
enum Source {
    /// A weight for each vertex, as the mesh's file numbers them.
    Weights(Vec<f32>),
    Regions {
        spheres: Vec<Sphere>,
        outside: f32,
    },
    Colours {
        channel: Channel,
        threshold: Option<f32>,
        inverted: bool,
    },
    Painted(Painted),
}

#[derive(Debug, Clone, PartialEq)]
struct Sphere {
    centre: Centre,
    radius: f64,
    weight: f32,
}

#[derive(Debug, Clone, PartialEq)]
enum Centre {
    Landmark(String),
    Point(DVec3),
}

/// What of a vertex's colour is its weight.
#[derive(Debug, Clone, Copy, PartialEq, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
enum Channel {
    Red,
    Green,
    Blue,
    Alpha,
    Grey,
}

impl MaskFile {
    /// The ends of masks' file names.
    pub const EXTENSIONS: [&str; 2] = ["json", "png"];

    /// Reads a mask, whose form is told from the content:
    /// - `[w, ...]` or `{"weights": [w, ...]}`: a weight for each vertex, as the mesh's file numbers them.
    /// - `{"spheres": [{"landmark": "30", "radius": r, "weight": w}, {"centre": [x, y, z], ...}], "outside": w}`: the
    ///   least weight of the spheres that a vertex lies in, else that outside, 1 if it is not said. Centres and radii
    ///   are in the scan's own space and units; a sphere's weight is 0 if it is not said.
    /// - `{"colour": {"channel": "red", "threshold": t, "inverted": true}}`: the vertex's colour, 0 to 1, of the channel
    ///   `red`, `green`, `blue`, `alpha` or `grey` (the mean of the first three); with a threshold 1 from there on and 0
    ///   below; `inverted` takes it from 1.
    /// - A PNG, white for 1 and black for 0, that lies on the mesh as its texture does.
    ///
    /// # Errors
    /// [`FormatError`] names the field or the vertex, what was found there and what to do.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, FormatError> {
        let path = path.as_ref();
        Self::parse(&read_file(path)?).map_err(|error| error.in_file(path))
    }

    /// Reads a mask as [`read`](Self::read) does, from its bytes.
    ///
    /// # Errors
    /// As [`read`](Self::read), without a file.
    pub fn parse(bytes: &[u8]) -> Result<Self, FormatError> {
        let source = if painted::is_png(bytes) {
            Painted::decode(bytes).map(Source::Painted)
        } else {
            json::read(bytes)
        };
        Ok(Self(source?))
    }

    /// The weights of a mesh's vertices `[N]`, each from 0 to 1.
    ///
    /// # Errors
    /// [`FormatError`] where the mesh has not what the mask is about: as many vertices, the landmark, colours, texture
    /// coordinates; and where the mask leaves no vertex any weight.
    pub fn on<P: Points>(
        &self,
        mesh: &MeshFile<P>,
        landmarks: &LandmarkSet,
    ) -> Result<Vec<f32>, FormatError> {
        let weights = match &self.0 {
            Source::Weights(weights) => by_vertex(weights, mesh),
            Source::Regions { spheres, outside } => in_spheres(spheres, *outside, mesh, landmarks),
            Source::Colours { channel, threshold, inverted } => {
                by_colour(*channel, *threshold, *inverted, mesh)
            }
            Source::Painted(painted) => painted.on(mesh),
        }?;
        if weights.iter().all(|w| *w == 0.0) {
            return Err(Fault::at("the mask", "leaves nothing: every vertex has weight 0").into());
        }
        Ok(weights)
    }
}

fn by_vertex(weights: &[f32], mesh: &MeshFile<impl Points>) -> Result<Vec<f32>, Fault> {
    let vertices = mesh.mesh.points().count();
    let in_file = match &mesh.order.vertices {
        Numbers::Kept => vertices,
        Numbers::Changed(numbers) => numbers.len(),
        Numbers::None => {
            let problem = "are by vertex, but the mesh's format does not number its vertices: use spheres";
            return Err(Fault::at("weights", problem));
        }
    };
    if weights.len() != in_file {
        let problem =
            format!("are {}, but the mesh's file has {in_file} vertices: give one each", weights.len());
        return Err(Fault::at("weights", problem));
    }
    let Numbers::Changed(numbers) = &mesh.order.vertices else { return Ok(weights.to_vec()) };
    // Vertices that a seam repeats are one in the mesh: what any of them leaves out is out.
    let mut least = vec![1.0f32; vertices];
    for (&number, &weight) in numbers.iter().zip(weights).filter(|(number, _)| **number != GONE) {
        least[number as usize] = least[number as usize].min(weight);
    }
    Ok(least)
}

fn in_spheres(
    spheres: &[Sphere],
    outside: f32,
    mesh: &MeshFile<impl Points>,
    landmarks: &LandmarkSet,
) -> Result<Vec<f32>, Fault> {
    let mut weights: Vec<Option<f32>> = vec![None; mesh.mesh.points().count()];
    for (k, Sphere { centre, radius, weight }) in spheres.iter().enumerate() {
        let centre = match centre {
            Centre::Point(point) => *point,
            Centre::Landmark(name) => landmarks.get(name).ok_or_else(|| {
                let problem = format!("`{name}` is not among the landmarks: name one, or give a `centre`");
                Fault::at(format!("spheres, entry {k}, landmark"), problem)
            })?,
        };
        for (own, position) in weights.iter_mut().zip(mesh.mesh.points().each()) {
            if position.distance(centre) <= *radius {
                *own = Some(own.map_or(*weight, |own| own.min(*weight)));
            }
        }
    }
    Ok(weights.into_iter().map(|weight| weight.unwrap_or(outside)).collect())
}

fn by_colour(
    channel: Channel,
    threshold: Option<f32>,
    inverted: bool,
    mesh: &MeshFile<impl Points>,
) -> Result<Vec<f32>, Fault> {
    let Some(colours) = &mesh.colours else {
        return Err(Fault::at("colour", "is asked for, but the mesh's file has no vertex colours"));
    };
    let weight = |&[red, green, blue, alpha]: &[u8; 4]| {
        let level = match channel {
            Channel::Red => f32::from(red),
            Channel::Green => f32::from(green),
            Channel::Blue => f32::from(blue),
            Channel::Alpha => f32::from(alpha),
            Channel::Grey => (f32::from(red) + f32::from(green) + f32::from(blue)) / 3.0,
        } / 255.0;
        let weight = threshold.map_or(level, |threshold| if level >= threshold { 1.0 } else { 0.0 });
        if inverted { 1.0 - weight } else { weight }
    };
    Ok(colours.iter().map(weight).collect())
}

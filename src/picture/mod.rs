//! Pictures of meshes for people to look at: orthographic views, shaded or with edges, tiled into labelled sheets.
//!
//! Layer 2: imports `mesh` alone. A plain z-buffer on the CPU; nothing here is differentiated or measured.

mod colour;
mod image;
mod raster;
mod render;
mod sheet;
mod style;
mod text;
mod view;

pub use colour::Colour;
pub use image::{Image, PictureError};
pub use render::render;
pub use sheet::Sheet;
pub use style::{Dot, Shading, Style, Wireframe};
pub use view::{Frame, View};

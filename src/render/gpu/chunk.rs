use std::ops::Range;

use super::layout::{EDGE_GRADIENT, GROUP, STRIP, TRIANGLE_GRADIENT, filled_pixels};
use crate::render::connectivity::Connectivity;
use crate::render::{RenderError, Target, View};

/// Pixels that are worked on at once at most, where one picture alone has fewer: hundreds of megabytes.
const MOST_PIXELS: u64 = 1 << 22;

/// What a number of views takes.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Room {
    pub views: u64,
    /// With what fills up their rows.
    pub pixels: u64,
    /// Of the largest width and the largest height.
    pub size: [u32; 2],
    /// Most strips in a view.
    pub strips: u32,
}

impl Room {
    /// What these views and another take.
    #[must_use]
    pub fn with(self, view: &View) -> Self {
        let [width, height] = view.intrinsics.size;
        Self {
            views: self.views + 1,
            pixels: self.pixels + filled_pixels(view),
            size: [self.size[0].max(width), self.size[1].max(height)],
            strips: self.strips.max(height.div_ceil(STRIP)),
        }
    }

    /// What is enough for either.
    #[must_use]
    pub fn or(self, other: Self) -> Self {
        Self {
            views: self.views.max(other.views),
            pixels: self.pixels.max(other.pixels),
            size: [0, 1].map(|axis| self.size[axis].max(other.size[axis])),
            strips: self.strips.max(other.strips),
        }
    }

    /// Of views.
    pub fn groups(&self) -> u64 {
        self.views.div_ceil(GROUP.into())
    }

    /// Bytes of the largest buffer of pixels, where none has more than four numbers.
    fn bytes(&self) -> u64 {
        16 * self.pixels
    }

    /// Pixels of the textures' layers.
    fn layered(&self) -> u64 {
        self.views * u64::from(self.size[0]) * u64::from(self.size[1])
    }
}

/// Cuts targets into runs whose views an adapter takes at once.
///
/// # Errors
/// [`RenderError::TooLarge`] for a mesh or a picture that is too large by itself.
pub fn chunks(
    targets: &[Target],
    mesh: &Connectivity,
    limits: &wgpu::Limits,
) -> Result<Vec<(Range<usize>, Room)>, RenderError> {
    let largest = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
    let of_view = 4
        * (TRIANGLE_GRADIENT * mesh.triangles.len() as u64)
            .max(EDGE_GRADIENT * mesh.edges.len() as u64)
            .max(4 * mesh.vertices as u64);
    if of_view > largest {
        return Err(RenderError::TooLarge {
            what: "the mesh's gradient in bytes".into(),
            found: of_view,
            limit: largest,
            remedy: "simplify the mesh",
        });
    }
    let most_views = (largest / of_view).min(u64::from(limits.max_texture_array_layers));
    let mut chunks: Vec<(Range<usize>, Room)> = Vec::new();
    for (index, target) in targets.iter().enumerate() {
        let alone = Room::default().with(&target.view);
        check(index, &alone, largest, limits)?;
        if let Some((range, room)) = chunks.last_mut() {
            let more = room.with(&target.view);
            let fits = more.views <= most_views && more.bytes() <= largest;
            if fits && more.pixels.max(more.layered()) <= MOST_PIXELS {
                (range.end, *room) = (index + 1, more);
                continue;
            }
        }
        chunks.push((index..index + 1, alone));
    }
    Ok(chunks)
}

fn check(index: usize, alone: &Room, largest: u64, limits: &wgpu::Limits) -> Result<(), RenderError> {
    let side = u64::from(alone.size[0].max(alone.size[1]));
    let longest = u64::from(limits.max_texture_dimension_2d);
    let remedy = "make the pictures smaller";
    if side > longest {
        let what = format!("the longer side of target {index} in pixels");
        return Err(RenderError::TooLarge { what, found: side, limit: longest, remedy });
    }
    if alone.bytes() > largest {
        let what = format!("the picture of target {index} in bytes");
        return Err(RenderError::TooLarge { what, found: alone.bytes(), limit: largest, remedy });
    }
    Ok(())
}

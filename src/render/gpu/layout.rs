use crate::render::{Light, View};

/// The buffers' numbers in `shaders/common.wgsl`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum Binding {
    Batch = 0,
    Views,
    Positions,
    Normals,
    Albedo,
    Triangles,
    Edges,
    CornerRows,
    EndRows,
    Targets,
    Corners,
    Ids,
    Colours,
    Marks,
    Pulled,
    Blends,
    StripLosses,
    TriangleGradients,
    EdgeGradients,
    EdgeLosses,
    Silhouettes,
    SilhouetteCount,
    Result,
    /// [`Self::Corners`], where vertices are drawn: to read alone.
    Drawn,
}

/// Threads in a row of pixels.
pub const ROW: u32 = 64;

/// Rows of pixels whose loss is summed by one row of threads.
pub const STRIP: u32 = 16;

/// Numbers of a triangle's gradient, with albedo.
pub const TRIANGLE_GRADIENT: u64 = 27;

/// Numbers of an edge's gradient.
pub const EDGE_GRADIENT: u64 = 6;

/// `Batch` of the shaders.
#[derive(Debug, Clone, Copy, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct BatchUniform {
    pub views: u32,
    pub vertices: u32,
    pub triangles: u32,
    pub edges: u32,
    pub closed: u32,
    pub with_albedo: u32,
    pub strips: u32,
    pub scale: f32,
}

/// `View` of the shaders.
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct ViewUniform {
    rows: [[f32; 4]; 3],
    light: [[f32; 4]; 9],
    background: [f32; 4],
    size: [u32; 2],
    stride: u32,
    pixels: u32,
    target_pixels: u32,
    padding: [u32; 7],
}

impl ViewUniform {
    /// A view that begins at places among pixels, and among the targets' pixels.
    pub fn new(view: &View, light: &Light, background: [f32; 3], pixels: u32, target_pixels: u32) -> Self {
        let filled = |[r, g, b]: [f32; 3]| [r, g, b, 0.0];
        Self {
            rows: view.projection(),
            light: light.0.map(filled),
            background: filled(background),
            size: view.intrinsics.size,
            stride: stride(view),
            pixels,
            target_pixels,
            padding: [0; 7],
        }
    }
}

/// Pixels in a row of a view with what fills it up: textures are copied to rows of 256 bytes, and ids have four.
pub fn stride(view: &View) -> u32 {
    view.intrinsics.size[0].next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT / 4)
}

/// Pixels of a view with what fills up its rows.
pub fn filled_pixels(view: &View) -> u64 {
    u64::from(stride(view)) * u64::from(view.intrinsics.size[1])
}

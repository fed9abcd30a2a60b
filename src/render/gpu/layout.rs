use crate::render::{Light, Target, View};

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
    Changed,
    DrawOrder,
}

/// Threads in a row of pixels.
pub const ROW: u32 = 64;

/// Rows of pixels whose loss is summed by one row of threads.
pub const STRIP: u32 = 16;

/// Views of which a triangle's gradient is summed up by one thread.
pub const GROUP: u32 = 4;

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

/// What a target's numbers are between, each of which is kept in 16 bits: those of pictures of 8 bits exactly.
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Range {
    lowest: f32,
    span: f32,
    heaviest: f32,
}

impl Range {
    /// That of a target.
    pub fn of(target: &Target) -> Self {
        let colours = || target.colours.as_flattened().iter().copied();
        let [lowest, highest] = [colours().fold(0.0, f32::min), colours().fold(1.0, f32::max)];
        let weights = target.weights.iter().flatten().copied();
        let heaviest = if target.weights.is_some() { weights.fold(0.0, f32::max) } else { 1.0 };
        Self { lowest, span: highest - lowest, heaviest }
    }

    /// A pixel's colour and weight: red and green, blue and weight, the first of each in the lower bits.
    pub fn packed(&self, [r, g, b]: [f32; 3], weight: f32) -> [u32; 2] {
        let bits = |part: f32| (part * 65535.0).round() as u32;
        let [r, g, b] = [r, g, b].map(|number| bits((number - self.lowest) / self.span));
        let weight = if self.heaviest > 0.0 { bits(weight / self.heaviest) } else { 0 };
        [r | g << 16, b | weight << 16]
    }
}

/// `View` of the shaders.
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct ViewUniform {
    rows: [[f32; 4]; 3],
    light: [[f32; 4]; 9],
    size: [u32; 2],
    stride: u32,
    pixels: u32,
    target_pixels: u32,
    range: Range,
    /// A view by itself begins at a multiple of 256 bytes.
    padding: [u32; 8],
}

impl ViewUniform {
    /// A view that begins at places among pixels, and among the targets' pixels.
    pub fn new(view: &View, light: &Light, range: Range, pixels: u32, target_pixels: u32) -> Self {
        let filled = |[r, g, b]: [f32; 3]| [r, g, b, 0.0];
        Self {
            rows: view.projection(),
            light: light.0.map(filled),
            size: view.intrinsics.size,
            stride: stride(view),
            pixels,
            target_pixels,
            range,
            padding: [0; 8],
        }
    }
}

/// Pixels in a row of a view with what fills it up: textures are copied to rows of 256 bytes, and colours have sixteen.
pub fn stride(view: &View) -> u32 {
    view.intrinsics.size[0].next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT / 16)
}

/// Pixels of a view with what fills up its rows.
pub fn filled_pixels(view: &View) -> u64 {
    u64::from(stride(view)) * u64::from(view.intrinsics.size[1])
}

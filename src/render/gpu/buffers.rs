use wgpu::BufferUsages;
use wgpu::util::DeviceExt;

use super::chunk::Room;
use super::draw_order::DrawOrder;
use super::layout::{BatchUniform, Binding, EDGE_GRADIENT, ROW, Range, TRIANGLE_GRADIENT, ViewUniform};
use super::raster::{COLOURS, DEPTH};
use crate::mesh::Rows;
use crate::render::Target;
use crate::render::connectivity::Connectivity;

/// What the kernels work on, but for the targets.
#[derive(Debug)]
pub struct Buffers {
    batch: wgpu::Buffer,
    views: wgpu::Buffer,
    positions: wgpu::Buffer,
    normals: wgpu::Buffer,
    albedo: wgpu::Buffer,
    triangles: wgpu::Buffer,
    draw_order: wgpu::Buffer,
    edges: wgpu::Buffer,
    corner_rows: wgpu::Buffer,
    end_rows: wgpu::Buffer,
    corners: wgpu::Buffer,
    colours: wgpu::Buffer,
    marks: wgpu::Buffer,
    pulled: wgpu::Buffer,
    blends: wgpu::Buffer,
    changed: wgpu::Buffer,
    strip_losses: wgpu::Buffer,
    triangle_gradients: wgpu::Buffer,
    edge_gradients: wgpu::Buffer,
    edge_losses: wgpu::Buffer,
    silhouettes: wgpu::Buffer,
    silhouette_count: wgpu::Buffer,
    result: wgpu::Buffer,
    /// The triangles' corners among those of the draw order.
    pub drawn_corners: wgpu::Buffer,
    /// What is read back.
    pub read: wgpu::Buffer,
    /// What is drawn: a layer for each view.
    pub drawn: wgpu::Texture,
    pub layers: Vec<wgpu::TextureView>,
    pub depth: wgpu::TextureView,
}

impl Buffers {
    /// For a mesh, and so much at once.
    pub fn new(device: &wgpu::Device, mesh: &Connectivity, room: Room) -> Self {
        let [vertices, triangles, edges] =
            [mesh.vertices, mesh.triangles.len(), mesh.edges.len()].map(|count| count as u64);
        let with = |numbers: &[u32], usage: BufferUsages| {
            let contents = bytemuck::cast_slice(numbers);
            device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: None, contents, usage })
        };
        let filled = |numbers: &[u32]| with(numbers, BufferUsages::STORAGE);
        let order = DrawOrder::new(mesh.vertices, &mesh.triangles);
        let empty = |usage: BufferUsages, numbers: u64| buffer(device, usage, numbers);
        let input = BufferUsages::STORAGE | BufferUsages::COPY_DST;
        // Copied from by tests alone.
        let inner = BufferUsages::STORAGE | BufferUsages::COPY_SRC;
        let output = BufferUsages::STORAGE | BufferUsages::COPY_SRC | BufferUsages::COPY_DST;
        let numbers = |bytes: usize| bytes as u64 / 4;
        let results = 9 * vertices + u64::from(ROW) * room.views;
        let layers = room.views as u32;
        let drawn = texture(device, room.size, layers, COLOURS, wgpu::TextureUsages::COPY_SRC);
        let depth = texture(device, room.size, 1, DEPTH, wgpu::TextureUsages::empty());
        Self {
            batch: empty(BufferUsages::UNIFORM | BufferUsages::COPY_DST, numbers(size_of::<BatchUniform>())),
            views: empty(input | BufferUsages::UNIFORM, room.views * numbers(size_of::<ViewUniform>())),
            positions: empty(input, 4 * vertices),
            normals: empty(input, 4 * vertices),
            albedo: empty(input, 4 * vertices),
            triangles: filled(mesh.triangles.as_flattened()),
            draw_order: filled(&order.vertices),
            edges: filled(mesh.edges.as_flattened()),
            corner_rows: filled(&flat(&mesh.corners)),
            end_rows: filled(&flat(&mesh.ends)),
            corners: empty(inner, 4 * vertices * room.views),
            colours: empty(output, 4 * room.pixels),
            marks: empty(output, 2 * room.pixels),
            pulled: empty(inner, room.pixels),
            blends: empty(inner, 4 * room.pixels),
            changed: empty(inner, 4 * room.pixels),
            strip_losses: empty(inner, u64::from(ROW * room.strips) * room.views),
            triangle_gradients: empty(inner, TRIANGLE_GRADIENT * triangles * room.groups()),
            edge_gradients: empty(output, EDGE_GRADIENT * edges * room.views),
            edge_losses: empty(output, edges * room.views),
            silhouettes: empty(inner, edges * room.views),
            silhouette_count: empty(output | BufferUsages::INDIRECT, 4),
            result: empty(output, results),
            drawn_corners: with(order.corners.as_flattened(), BufferUsages::INDEX),
            read: empty(BufferUsages::MAP_READ | BufferUsages::COPY_DST, results),
            layers: (0..layers).map(|layer| single_layer(&drawn, layer)).collect(),
            depth: single_layer(&depth, 0),
            drawn,
        }
    }

    /// The buffer of a binding; the targets' is given.
    pub fn get<'a>(&'a self, binding: Binding, targets: &'a wgpu::Buffer) -> &'a wgpu::Buffer {
        match binding {
            Binding::Batch => &self.batch,
            Binding::Views => &self.views,
            Binding::Positions => &self.positions,
            Binding::Normals => &self.normals,
            Binding::Albedo => &self.albedo,
            Binding::Triangles => &self.triangles,
            Binding::DrawOrder => &self.draw_order,
            Binding::Edges => &self.edges,
            Binding::CornerRows => &self.corner_rows,
            Binding::EndRows => &self.end_rows,
            Binding::Targets => targets,
            Binding::Corners | Binding::Drawn => &self.corners,
            Binding::Colours => &self.colours,
            Binding::Marks => &self.marks,
            Binding::Pulled => &self.pulled,
            Binding::Blends => &self.blends,
            Binding::Changed => &self.changed,
            Binding::StripLosses => &self.strip_losses,
            Binding::TriangleGradients => &self.triangle_gradients,
            Binding::EdgeGradients => &self.edge_gradients,
            Binding::EdgeLosses => &self.edge_losses,
            Binding::Silhouettes => &self.silhouettes,
            Binding::SilhouetteCount => &self.silhouette_count,
            Binding::Result => &self.result,
        }
    }
}

/// The colours and weights of a run of targets.
pub fn upload_targets(device: &wgpu::Device, targets: &[Target]) -> wgpu::Buffer {
    let pixels: usize = targets.iter().map(|target| target.colours.len()).sum();
    let mut numbers: Vec<[u32; 2]> = Vec::with_capacity(pixels);
    for target in targets {
        let range = Range::of(target);
        let weight = |pixel: usize| target.weights.as_ref().map_or(1.0, |weights| weights[pixel]);
        let pixels = target.colours.iter().enumerate();
        numbers.extend(pixels.map(|(pixel, &colour)| range.packed(colour, weight(pixel))));
    }
    device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
        label: None,
        contents: bytemuck::cast_slice(&numbers),
        usage: BufferUsages::STORAGE,
    })
}

/// A buffer for numbers of four bytes.
pub fn buffer(device: &wgpu::Device, usage: BufferUsages, numbers: u64) -> wgpu::Buffer {
    device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: 4 * numbers.max(4),
        usage,
        mapped_at_creation: false,
    })
}

/// How rows begin, then the rows.
fn flat(rows: &Rows<u32>) -> Vec<u32> {
    let mut starts = vec![0];
    let mut items = Vec::new();
    for row in 0..rows.len() {
        items.extend_from_slice(rows.row(row));
        starts.push(items.len() as u32);
    }
    starts.append(&mut items);
    starts
}

fn texture(
    device: &wgpu::Device,
    [width, height]: [u32; 2],
    layers: u32,
    format: wgpu::TextureFormat,
    read: wgpu::TextureUsages,
) -> wgpu::Texture {
    device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d { width, height, depth_or_array_layers: layers },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | read,
        view_formats: &[],
    })
}

fn single_layer(texture: &wgpu::Texture, layer: u32) -> wgpu::TextureView {
    texture.create_view(&wgpu::TextureViewDescriptor {
        dimension: Some(wgpu::TextureViewDimension::D2),
        base_array_layer: layer,
        array_layer_count: Some(1),
        ..Default::default()
    })
}

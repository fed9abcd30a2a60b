use super::buffers::{Buffers, upload_targets};
use super::chunk::{Room, chunks};
use super::device::Device;
use super::kernels::{Kernel, Kernels};
use super::layout::{BatchUniform, Binding, GROUP, ROW, Range, STRIP, ViewUniform, stride};
use crate::render::connectivity::Connectivity;
use crate::render::{RenderError, Surface, Target};

/// The passes of a loss, in their order, and the one of a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pass {
    Project,
    Raster,
    Silhouette,
    Loss,
    Blend,
    SilhouetteBackward,
    Backward,
    Gather,
    Total,
    Picture,
}

impl Pass {
    /// What gives a loss and its gradient.
    pub const LOSS: [Self; 9] = [
        Self::Project,
        Self::Raster,
        Self::Silhouette,
        Self::Loss,
        Self::Blend,
        Self::SilhouetteBackward,
        Self::Backward,
        Self::Gather,
        Self::Total,
    ];

    /// What gives a picture.
    pub const PICTURE: [Self; 4] = [Self::Project, Self::Raster, Self::Silhouette, Self::Picture];

    /// Its file's name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Project => "project",
            Self::Raster => "raster",
            Self::Silhouette => "silhouette",
            Self::Loss => "loss",
            Self::Blend => "blend",
            Self::SilhouetteBackward => "silhouette_backward",
            Self::Backward => "backward",
            Self::Gather => "gather",
            Self::Total => "total",
            Self::Picture => "picture",
        }
    }
}

/// A mesh and targets on a device.
#[derive(Debug)]
pub struct Loaded {
    pub buffers: Buffers,
    /// What the buffers have room for.
    pub room: Room,
    chunks: Vec<Chunk>,
    /// Each view by itself, for the raster.
    views: Vec<wgpu::BindGroup>,
    counts: BatchUniform,
}

/// How many threads a pass has.
#[derive(Debug, Clone, Copy)]
enum Threads {
    /// So many workgroups.
    Groups([u32; 3]),
    /// One for each silhouette, which the device counts.
    OfSilhouettes,
}

/// A run of targets with the kernels' buffers.
#[derive(Debug)]
struct Chunk {
    targets: std::ops::Range<usize>,
    /// Where each begins among the pixels of the run.
    begins: Vec<u32>,
    /// What its numbers are between.
    ranges: Vec<Range>,
    /// For each pass.
    groups: [wgpu::BindGroup; 10],
}

/// Views that are worked on at once.
#[derive(Debug)]
pub struct Batch {
    chunk: usize,
    uniform: BatchUniform,
    views: Vec<ViewUniform>,
    pictures: Vec<Picture>,
    room: Room,
}

/// Where a view is drawn, and copied to.
#[derive(Debug, Clone, Copy)]
struct Picture {
    size: [u32; 2],
    background: [f32; 3],
    /// Pixels in a row with what fills it up.
    stride: u32,
    /// Its first one's place.
    pixels: u64,
}

impl Loaded {
    /// Uploads a mesh and targets, in runs within an adapter's limits.
    ///
    /// # Errors
    /// [`RenderError::TooLarge`], or [`RenderError::Device`].
    pub fn new(
        device: &Device,
        kernels: &Kernels,
        mesh: &Connectivity,
        targets: &[Target],
        limits: &wgpu::Limits,
    ) -> Result<Self, RenderError> {
        let ranges = chunks(targets, mesh, limits)?;
        let room = ranges.iter().fold(Room::default(), |room, (_, more)| room.or(*more));
        let room = if ranges.is_empty() { Room { views: 1, size: [1, 1], ..room } } else { room };
        let buffers = Buffers::new(&device.device, mesh, room);
        let chunks = (ranges.into_iter())
            .map(|(range, _)| Chunk::new(&device.device, kernels, &buffers, range, targets))
            .collect();
        let counts = BatchUniform {
            vertices: mesh.vertices as u32,
            triangles: mesh.triangles.len() as u32,
            edges: mesh.edges.len() as u32,
            closed: mesh.closed.into(),
            strips: room.strips,
            ..Default::default()
        };
        let views =
            kernels.raster.bind_views(&device.device, buffers.get(Binding::Views, &buffers.read), room.views);
        device.check()?;
        Ok(Self { buffers, room, chunks, views, counts })
    }

    /// Cuts listed targets into batches of one run each.
    pub fn batches(&self, listed: &[usize], targets: &[Target], with_albedo: bool, scale: f32) -> Vec<Batch> {
        let mut batches: Vec<Batch> = Vec::new();
        for (chunk, Chunk { targets: range, begins, ranges, .. }) in self.chunks.iter().enumerate() {
            let first = batches.len();
            for &index in listed.iter().filter(|index| range.contains(index)) {
                let view = &targets[index].view;
                let fits = |batch: &Batch| {
                    let more = batch.room.with(view);
                    more.views <= self.room.views && more.pixels <= self.room.pixels
                };
                if batches.len() == first || !batches.last().is_some_and(fits) {
                    let uniform = BatchUniform { with_albedo: with_albedo.into(), scale, ..self.counts };
                    batches.push(Batch::new(chunk, uniform));
                }
                if let Some(batch) = batches.last_mut() {
                    let of_run = index - range.start;
                    batch.push(&targets[index], ranges[of_run], begins[of_run]);
                }
            }
        }
        batches
    }

    /// Uploads a surface.
    pub fn upload_surface(&self, device: &Device, surface: &Surface<'_>, scratch: &mut Vec<[f32; 4]>) {
        let mut upload = |binding, numbers: &mut dyn Iterator<Item = [f32; 4]>| {
            scratch.clear();
            scratch.extend(numbers);
            let buffer = self.buffers.get(binding, &self.buffers.read);
            device.queue.write_buffer(buffer, 0, bytemuck::cast_slice(scratch));
        };
        upload(Binding::Positions, &mut surface.positions.iter().map(|p| p.extend(1.0).to_array()));
        upload(Binding::Normals, &mut surface.normals.iter().map(|n| n.extend(0.0).to_array()));
        if let Some(albedo) = surface.albedo {
            upload(Binding::Albedo, &mut albedo.iter().map(|&[r, g, b]| [r, g, b, 0.0]));
        }
    }

    /// Uploads what a batch is, for the passes to come.
    pub fn upload_batch(&self, device: &Device, batch: &Batch) {
        let buffer = |binding| self.buffers.get(binding, &self.buffers.read);
        device.queue.write_buffer(buffer(Binding::Batch), 0, bytemuck::bytes_of(&batch.uniform));
        device.queue.write_buffer(buffer(Binding::Views), 0, bytemuck::cast_slice(&batch.views));
    }

    /// Records a pass over a batch.
    pub fn encode(&self, pass: Pass, kernels: &Kernels, batch: &Batch, encoder: &mut wgpu::CommandEncoder) {
        if pass == Pass::Raster {
            return self.encode_raster(kernels, batch, encoder);
        }
        let BatchUniform { vertices, triangles, edges, views, .. } = batch.uniform;
        let [_, rows] = batch.room.size;
        let columns = batch.room.size[0].div_ceil(ROW);
        let groups = |threads: u32| threads.div_ceil(64);
        let (kernel, threads) = match pass {
            Pass::Project => (&kernels.project, Threads::Groups([groups(vertices), views, 1])),
            Pass::Silhouette => (&kernels.silhouette, Threads::Groups([groups(edges), views, 1])),
            Pass::Loss => (&kernels.loss, Threads::Groups([1, rows.div_ceil(STRIP), views])),
            Pass::Blend => (&kernels.blend, Threads::OfSilhouettes),
            Pass::SilhouetteBackward => (&kernels.silhouette_backward, Threads::OfSilhouettes),
            Pass::Backward => {
                (&kernels.backward, Threads::Groups([groups(triangles), views.div_ceil(GROUP), 1]))
            }
            Pass::Gather => (&kernels.gather, Threads::Groups([groups(vertices), 1, 1])),
            Pass::Total => (&kernels.total, Threads::Groups([1, views, 1])),
            Pass::Raster | Pass::Picture => (&kernels.picture, Threads::Groups([columns, rows, views])),
        };
        let buffer = |binding| self.buffers.get(binding, &self.buffers.read);
        if pass == Pass::Silhouette {
            for zeroed in
                [Binding::Marks, Binding::SilhouetteCount, Binding::EdgeLosses, Binding::EdgeGradients]
            {
                encoder.clear_buffer(buffer(zeroed), 0, None);
            }
        }
        let mut recorded = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        recorded.set_pipeline(&kernel.pipeline);
        recorded.set_bind_group(0, &self.chunks[batch.chunk].groups[pass as usize], &[]);
        match threads {
            Threads::Groups([x, y, z]) => recorded.dispatch_workgroups(x, y, z),
            Threads::OfSilhouettes => {
                recorded.dispatch_workgroups_indirect(buffer(Binding::SilhouetteCount), 0);
            }
        }
    }

    fn encode_raster(&self, kernels: &Kernels, batch: &Batch, encoder: &mut wgpu::CommandEncoder) {
        let pipeline = kernels.raster.pipeline(self.counts.closed != 0, batch.uniform.with_albedo != 0);
        let group = &self.chunks[batch.chunk].groups[Pass::Raster as usize];
        for (view, &Picture { size: [width, height], background, .. }) in (0..).zip(&batch.pictures) {
            let [r, g, b] = background.map(f64::from);
            let mut recorded = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                    view: &self.buffers.layers[view as usize],
                    depth_slice: None,
                    resolve_target: None,
                    ops: wgpu::Operations {
                        load: wgpu::LoadOp::Clear(wgpu::Color { r, g, b, a: 0.0 }),
                        store: wgpu::StoreOp::Store,
                    },
                })],
                depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                    view: &self.buffers.depth,
                    depth_ops: Some(wgpu::Operations {
                        load: wgpu::LoadOp::Clear(0.0),
                        store: wgpu::StoreOp::Discard,
                    }),
                    stencil_ops: None,
                }),
                ..Default::default()
            });
            recorded.set_viewport(0.0, 0.0, width as f32, height as f32, 0.0, 1.0);
            recorded.set_scissor_rect(0, 0, width, height);
            recorded.set_pipeline(pipeline);
            recorded.set_bind_group(0, group, &[]);
            recorded.set_bind_group(1, &self.views[view as usize], &[]);
            recorded.set_index_buffer(self.buffers.drawn_corners.slice(..), wgpu::IndexFormat::Uint32);
            recorded.draw_indexed(0..3 * self.counts.triangles, 0, view..view + 1);
        }
        let (texture, buffer) = (&self.buffers.drawn, self.buffers.get(Binding::Colours, &self.buffers.read));
        for (layer, &Picture { size: [width, height], stride, pixels, .. }) in (0..).zip(&batch.pictures) {
            let mut from = texture.as_image_copy();
            from.origin.z = layer;
            let layout = wgpu::TexelCopyBufferLayout {
                offset: 16 * pixels,
                bytes_per_row: Some(16 * stride),
                rows_per_image: None,
            };
            let size = wgpu::Extent3d { width, height, depth_or_array_layers: 1 };
            encoder.copy_texture_to_buffer(from, wgpu::TexelCopyBufferInfo { buffer, layout }, size);
        }
    }
}

impl Chunk {
    fn new(
        device: &wgpu::Device,
        kernels: &Kernels,
        buffers: &Buffers,
        range: std::ops::Range<usize>,
        targets: &[Target],
    ) -> Self {
        let colours = upload_targets(device, &targets[range.clone()]);
        let begins = (targets[range.clone()].iter())
            .scan(0, |pixels, target| {
                let begin = *pixels;
                *pixels += target.view.pixels() as u32;
                Some(begin)
            })
            .collect();
        let buffer = |binding| buffers.get(binding, &colours);
        let bound = |kernel: &Kernel| kernel.bind(device, buffer);
        let groups = [
            bound(&kernels.project),
            kernels.raster.bind(device, buffer),
            bound(&kernels.silhouette),
            bound(&kernels.loss),
            bound(&kernels.blend),
            bound(&kernels.silhouette_backward),
            bound(&kernels.backward),
            bound(&kernels.gather),
            bound(&kernels.total),
            bound(&kernels.picture),
        ];
        let ranges = targets[range.clone()].iter().map(Range::of).collect();
        Self { targets: range, begins, ranges, groups }
    }
}

impl Batch {
    fn new(chunk: usize, uniform: BatchUniform) -> Self {
        Self { chunk, uniform, views: Vec::new(), pictures: Vec::new(), room: Room::default() }
    }

    fn push(&mut self, target: &Target, range: Range, target_pixels: u32) {
        let Target { view, light, background, .. } = target;
        let pixels = self.room.pixels;
        self.views.push(ViewUniform::new(view, light, range, pixels as u32, target_pixels));
        let size = view.intrinsics.size;
        self.pictures.push(Picture { size, background: *background, stride: stride(view), pixels });
        self.room = self.room.with(view);
        self.uniform.views += 1;
    }
}

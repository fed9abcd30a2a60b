use super::kernels::{bind, module, options};
use super::layout::{Binding, ViewUniform};

/// Format of what each pixel sees: its colour, and the triangle.
pub const COLOURS: wgpu::TextureFormat = wgpu::TextureFormat::Rgba32Float;

/// Format of how near it is.
pub const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// What draws the triangles of one view after the other.
#[derive(Debug)]
pub struct Raster {
    /// By whether those alone are drawn whose outside is seen, and whether they have albedo.
    pipelines: [[wgpu::RenderPipeline; 2]; 2],
    layout: wgpu::BindGroupLayout,
    view_layout: wgpu::BindGroupLayout,
}

/// What it binds, but for the view.
const BINDINGS: &[Binding] =
    &[Binding::Batch, Binding::Normals, Binding::Albedo, Binding::Drawn, Binding::DrawOrder];

impl Raster {
    /// Compiles it; what does not compile is the device's to tell.
    pub fn new(device: &wgpu::Device) -> Self {
        let uniform = |binding: &Binding| *binding == Binding::Batch;
        let entries: Vec<_> =
            BINDINGS.iter().map(|binding| entry(*binding as u32, uniform(binding))).collect();
        let layout_of = |entries: &[wgpu::BindGroupLayoutEntry]| {
            device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: None, entries })
        };
        let (layout, view_layout) = (layout_of(&entries), layout_of(&[entry(0, true)]));
        let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: None,
            bind_group_layouts: &[Some(&layout), Some(&view_layout)],
            immediate_size: 0,
        });
        let module = module(device, "raster", include_str!("shaders/raster.wgsl"));
        let pipelines = [None, Some(wgpu::Face::Back)].map(|culled| {
            [0.0, 1.0].map(|albedo| pipeline(device, &module, &pipeline_layout, culled, albedo))
        });
        Self { pipelines, layout, view_layout }
    }

    /// What draws a mesh that is closed or not, with albedo or without.
    pub fn pipeline(&self, closed: bool, with_albedo: bool) -> &wgpu::RenderPipeline {
        &self.pipelines[usize::from(closed)][usize::from(with_albedo)]
    }

    /// Its buffers, ready to be bound.
    pub fn bind<'a>(
        &self,
        device: &wgpu::Device,
        buffer: impl Fn(Binding) -> &'a wgpu::Buffer,
    ) -> wgpu::BindGroup {
        bind(device, &self.layout, BINDINGS, buffer)
    }

    /// Each view by itself, ready to be bound.
    pub fn bind_views(
        &self,
        device: &wgpu::Device,
        views: &wgpu::Buffer,
        count: u64,
    ) -> Vec<wgpu::BindGroup> {
        let bytes = size_of::<ViewUniform>() as u64;
        let bound = |view: u64| {
            let resource = wgpu::BindingResource::Buffer(wgpu::BufferBinding {
                buffer: views,
                offset: view * bytes,
                size: wgpu::BufferSize::new(bytes),
            });
            let entries = &[wgpu::BindGroupEntry { binding: 0, resource }];
            let layout = &self.view_layout;
            device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout, entries })
        };
        (0..count).map(bound).collect()
    }
}

fn entry(binding: u32, uniform: bool) -> wgpu::BindGroupLayoutEntry {
    let ty = match uniform {
        true => wgpu::BufferBindingType::Uniform,
        false => wgpu::BufferBindingType::Storage { read_only: true },
    };
    wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::VERTEX_FRAGMENT,
        ty: wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None },
        count: None,
    }
}

fn pipeline(
    device: &wgpu::Device,
    module: &wgpu::ShaderModule,
    layout: &wgpu::PipelineLayout,
    culled: Option<wgpu::Face>,
    albedo: f64,
) -> wgpu::RenderPipeline {
    let constants: &[(&str, f64)] = &[("WITH_ALBEDO", albedo)];
    let options = wgpu::PipelineCompilationOptions { constants, ..options() };
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("raster"),
        layout: Some(layout),
        vertex: wgpu::VertexState {
            module,
            entry_point: Some("place"),
            compilation_options: options.clone(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState { cull_mode: culled, ..Default::default() },
        depth_stencil: Some(wgpu::DepthStencilState {
            format: DEPTH,
            depth_write_enabled: Some(true),
            depth_compare: Some(wgpu::CompareFunction::Greater),
            stencil: Default::default(),
            bias: Default::default(),
        }),
        multisample: Default::default(),
        fragment: Some(wgpu::FragmentState {
            module,
            entry_point: Some("shade"),
            compilation_options: options,
            targets: &[Some(wgpu::ColorTargetState {
                format: COLOURS,
                blend: None,
                write_mask: wgpu::ColorWrites::ALL,
            })],
        }),
        multiview_mask: None,
        cache: None,
    })
}

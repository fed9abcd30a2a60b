use super::layout::{Binding, ViewUniform};

/// What the kernels share, before each of them.
const COMMON: &str = include_str!("shaders/common.wgsl");

/// Format of what each pixel sees: its colour, and the triangle.
pub const COLOURS: wgpu::TextureFormat = wgpu::TextureFormat::Rgba32Float;

/// Format of how near it is.
pub const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// A kernel with the buffers that it binds.
#[derive(Debug)]
pub struct Kernel<P> {
    pub pipeline: P,
    layout: wgpu::BindGroupLayout,
    bindings: &'static [Binding],
}

impl<P> Kernel<P> {
    /// Its buffers, ready to be bound.
    pub fn bind<'a>(
        &self,
        device: &wgpu::Device,
        buffer: impl Fn(Binding) -> &'a wgpu::Buffer,
    ) -> wgpu::BindGroup {
        let entries: Vec<_> = (self.bindings.iter())
            .map(|&binding| wgpu::BindGroupEntry {
                binding: binding as u32,
                resource: buffer(binding).as_entire_binding(),
            })
            .collect();
        device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &self.layout,
            entries: &entries,
        })
    }
}

impl Kernel<wgpu::RenderPipeline> {
    /// Each view by itself, ready to be bound.
    pub fn bind_views(
        &self,
        device: &wgpu::Device,
        views: &wgpu::Buffer,
        count: u64,
    ) -> Vec<wgpu::BindGroup> {
        let layout = self.pipeline.get_bind_group_layout(1);
        let bytes = size_of::<ViewUniform>() as u64;
        let bound = |view: u64| {
            let resource = wgpu::BindingResource::Buffer(wgpu::BufferBinding {
                buffer: views,
                offset: view * bytes,
                size: wgpu::BufferSize::new(bytes),
            });
            let entries = &[wgpu::BindGroupEntry { binding: 0, resource }];
            device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout: &layout, entries })
        };
        (0..count).map(bound).collect()
    }
}

/// Every kernel, compiled.
#[derive(Debug)]
pub struct Kernels {
    pub project: Kernel<wgpu::ComputePipeline>,
    /// With all triangles, and with those alone whose outside is seen.
    pub raster: [Kernel<wgpu::RenderPipeline>; 2],
    pub silhouette: Kernel<wgpu::ComputePipeline>,
    pub loss: Kernel<wgpu::ComputePipeline>,
    pub blend: Kernel<wgpu::ComputePipeline>,
    pub picture: Kernel<wgpu::ComputePipeline>,
    pub silhouette_backward: Kernel<wgpu::ComputePipeline>,
    pub backward: Kernel<wgpu::ComputePipeline>,
    pub gather: Kernel<wgpu::ComputePipeline>,
    pub total: Kernel<wgpu::ComputePipeline>,
}

/// A compute kernel of a file's name, and what it binds.
macro_rules! kernel {
    ($device:expr, $name:literal, [$($binding:ident),*]) => {
        compute($device, $name, include_str!(concat!("shaders/", $name, ".wgsl")), &[$(Binding::$binding),*])
    };
}

impl Kernels {
    /// Compiles them; what does not compile is the device's to tell.
    pub fn new(device: &wgpu::Device) -> Self {
        Self {
            project: kernel!(device, "project", [Batch, Views, Positions, Corners]),
            raster: [None, Some(wgpu::Face::Back)].map(|culled| raster(device, culled)),
            silhouette: kernel!(
                device,
                "silhouette",
                [Batch, Views, Triangles, Edges, Corners, Colours, Marks, Silhouettes, SilhouetteCount]
            ),
            loss: kernel!(device, "loss", [Batch, Views, Targets, Colours, Pulled, StripLosses]),
            blend: kernel!(
                device,
                "blend",
                [
                    Batch,
                    Views,
                    Edges,
                    Targets,
                    Corners,
                    Colours,
                    Marks,
                    Blends,
                    EdgeLosses,
                    Silhouettes,
                    SilhouetteCount
                ]
            ),
            picture: kernel!(device, "picture", [Batch, Views, Edges, Corners, Colours, Marks, Blends]),
            silhouette_backward: kernel!(
                device,
                "silhouette_backward",
                [
                    Batch,
                    Views,
                    Edges,
                    Corners,
                    Colours,
                    Marks,
                    Pulled,
                    Blends,
                    Changed,
                    EdgeGradients,
                    Silhouettes,
                    SilhouetteCount
                ]
            ),
            backward: kernel!(
                device,
                "backward",
                [
                    Batch,
                    Views,
                    Normals,
                    Albedo,
                    Triangles,
                    Corners,
                    Colours,
                    Pulled,
                    Changed,
                    TriangleGradients
                ]
            ),
            gather: kernel!(
                device,
                "gather",
                [Batch, CornerRows, EndRows, TriangleGradients, EdgeGradients, Result]
            ),
            total: kernel!(device, "total", [Batch, Views, StripLosses, EdgeLosses, Result]),
        }
    }
}

fn module(device: &wgpu::Device, name: &str, source: &str) -> wgpu::ShaderModule {
    device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some(name),
        source: wgpu::ShaderSource::Wgsl(format!("{COMMON}\n{source}").into()),
    })
}

fn compute(
    device: &wgpu::Device,
    name: &str,
    source: &str,
    bindings: &'static [Binding],
) -> Kernel<wgpu::ComputePipeline> {
    let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some(name),
        layout: None,
        module: &module(device, name, source),
        entry_point: Some(name),
        compilation_options: options(),
        cache: None,
    });
    let layout = pipeline.get_bind_group_layout(0);
    Kernel { pipeline, layout, bindings }
}

fn raster(device: &wgpu::Device, culled: Option<wgpu::Face>) -> Kernel<wgpu::RenderPipeline> {
    let module = module(device, "raster", include_str!("shaders/raster.wgsl"));
    let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("raster"),
        layout: None,
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("place"),
            compilation_options: options(),
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
            module: &module,
            entry_point: Some("shade"),
            compilation_options: options(),
            targets: &[Some(wgpu::ColorTargetState {
                format: COLOURS,
                blend: None,
                write_mask: wgpu::ColorWrites::ALL,
            })],
        }),
        multiview_mask: None,
        cache: None,
    });
    let layout = pipeline.get_bind_group_layout(0);
    const BINDINGS: &[Binding] =
        &[Binding::Batch, Binding::Normals, Binding::Albedo, Binding::Triangles, Binding::Drawn];
    Kernel { pipeline, layout, bindings: BINDINGS }
}

fn options() -> wgpu::PipelineCompilationOptions<'static> {
    // Nothing uses memory of a workgroup.
    wgpu::PipelineCompilationOptions { zero_initialize_workgroup_memory: false, ..Default::default() }
}

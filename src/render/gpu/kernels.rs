use super::layout::Binding;
use super::raster::Raster;

/// What the kernels share, before each of them.
const COMMON: &str = include_str!("shaders/common.wgsl");

/// A kernel with the buffers that it binds.
#[derive(Debug)]
pub struct Kernel {
    pub pipeline: wgpu::ComputePipeline,
    layout: wgpu::BindGroupLayout,
    bindings: &'static [Binding],
}

impl Kernel {
    /// Its buffers, ready to be bound.
    pub fn bind<'a>(
        &self,
        device: &wgpu::Device,
        buffer: impl Fn(Binding) -> &'a wgpu::Buffer,
    ) -> wgpu::BindGroup {
        bind(device, &self.layout, self.bindings, buffer)
    }
}

/// Buffers of these numbers, ready to be bound.
pub fn bind<'a>(
    device: &wgpu::Device,
    layout: &wgpu::BindGroupLayout,
    bindings: &[Binding],
    buffer: impl Fn(Binding) -> &'a wgpu::Buffer,
) -> wgpu::BindGroup {
    let entries: Vec<_> = (bindings.iter())
        .map(|&binding| wgpu::BindGroupEntry {
            binding: binding as u32,
            resource: buffer(binding).as_entire_binding(),
        })
        .collect();
    device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout, entries: &entries })
}

/// Every kernel, compiled.
#[derive(Debug)]
pub struct Kernels {
    pub project: Kernel,
    pub raster: Raster,
    pub silhouette: Kernel,
    pub loss: Kernel,
    pub blend: Kernel,
    pub picture: Kernel,
    pub silhouette_backward: Kernel,
    pub backward: Kernel,
    pub gather: Kernel,
    pub total: Kernel,
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
            raster: Raster::new(device),
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

pub fn module(device: &wgpu::Device, name: &str, source: &str) -> wgpu::ShaderModule {
    device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some(name),
        source: wgpu::ShaderSource::Wgsl(format!("{COMMON}\n{source}").into()),
    })
}

fn compute(device: &wgpu::Device, name: &str, source: &str, bindings: &'static [Binding]) -> Kernel {
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

pub fn options() -> wgpu::PipelineCompilationOptions<'static> {
    // Nothing uses memory of a workgroup.
    wgpu::PipelineCompilationOptions { zero_initialize_workgroup_memory: false, ..Default::default() }
}

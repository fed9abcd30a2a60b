//! What the kernels give, against the reference, on whatever adapter there is.

mod kernels;

use super::*;
use crate::numeric::Random;
use crate::render::reference::Reference;
use crate::render::scenes::{Scene as Shape, targets, views};

/// The best adapter; without one the tests that want it say so, or fail if one is required.
fn gpu() -> Option<Gpu> {
    match Gpu::open(&AdapterChoice::Best) {
        Ok(gpu) => Some(gpu),
        Err(error) if std::env::var_os("ONEMESH_REQUIRE_GPU").is_some() => panic!("{error}"),
        Err(error) => {
            eprintln!("skipped: {error}");
            None
        }
    }
}

fn shapes() -> [Shape; 3] {
    [Shape::bumpy(3), Shape::eared(), Shape::bowl()]
}

/// Pictures of several sizes.
fn mixed_targets() -> Vec<Target> {
    let sizes = [[96, 96], [65, 40], [128, 90]];
    let mut random = Random::new(1);
    let mut all = Vec::new();
    for (i, size) in sizes.into_iter().enumerate() {
        all.push(targets(&views(3, size), &mut random).remove(i));
    }
    all
}

fn prepared(mut renderer: impl Renderer, shape: &Shape, targets: &[Target]) -> impl Renderer {
    renderer.prepare(MeshLayout::of(&shape.topology), targets).unwrap();
    renderer
}

/// |a - b| / |b|.
fn difference<'a>(a: impl Iterator<Item = &'a f32>, b: impl Iterator<Item = &'a f32>) -> f64 {
    let (mut squares, mut apart) = (0.0, 0.0);
    for (&a, &b) in a.zip(b) {
        squares += f64::from(b).powi(2);
        apart += f64::from(a - b).powi(2);
    }
    (apart / squares.max(1e-30)).sqrt()
}

fn flat(vectors: &[Vec3A]) -> Vec<f32> {
    vectors.iter().flat_map(|vector| vector.to_array()).collect()
}

/// Loss and gradient.
fn outcome(renderer: &mut impl Renderer, shape: &Shape, listed: &[usize]) -> (f64, RenderGradient) {
    let mut gradient = RenderGradient::default();
    let value = renderer.loss(&shape.surface(), listed, &mut gradient).unwrap();
    (value, gradient)
}

fn assert_alike((value, gradient): &(f64, RenderGradient), twin: &(f64, RenderGradient)) {
    assert!((value / twin.0 - 1.0).abs() < 1e-5, "{value} {}", twin.0);
    let error = |of: fn(&RenderGradient) -> Vec<f32>| difference(of(gradient).iter(), of(&twin.1).iter());
    let errors = [
        error(|gradient| flat(&gradient.positions)),
        error(|gradient| flat(&gradient.normals)),
        error(|gradient| gradient.albedo.as_flattened().to_vec()),
    ];
    assert!(errors.iter().all(|&error| error < 0.01), "{errors:?}");
}

#[test]
fn whole_losses_and_pictures_are_as_the_reference_s() {
    let Some(mut gpu) = gpu() else { return };
    // More than a group of views.
    let targets = [mixed_targets(), mixed_targets()].concat();
    for shape in shapes() {
        gpu.prepare(MeshLayout::of(&shape.topology), &targets).unwrap();
        let mut reference = prepared(Reference::new(), &shape, &targets);
        for listed in [&[0, 1, 2, 3, 4, 5][..], &[2], &[1, 0], &[0, 0, 2, 1, 1, 2, 0, 0, 0]] {
            assert_alike(&outcome(&mut gpu, &shape, listed), &outcome(&mut reference, &shape, listed));
        }
        for target in 0..targets.len() {
            let [one, other] = [&mut gpu as &mut dyn Renderer, &mut reference]
                .map(|renderer| renderer.picture(&shape.surface(), target).unwrap());
            assert_eq!(one.size, other.size);
            let apart = difference(one.colours.as_flattened().iter(), other.colours.as_flattened().iter());
            let others = one.covered.iter().zip(&other.covered).filter(|(one, other)| one != other).count();
            assert!(apart < 0.01 && others < 5, "{apart} {others}");
        }
    }
}

#[test]
fn other_lights_are_seen_and_the_same_input_gives_the_same_bytes() {
    let Some(mut gpu) = gpu() else { return };
    let (shape, mut targets) = (Shape::eared(), mixed_targets());
    gpu.prepare(MeshLayout::of(&shape.topology), &targets).unwrap();
    let first = outcome(&mut gpu, &shape, &[0, 1, 2]);
    gpu.set_lights(&[Light::uniform([0.5; 3]); 3]).unwrap();
    let other = outcome(&mut gpu, &shape, &[0, 1, 2]);
    assert_ne!(first, other);
    gpu.set_lights(&targets.iter().map(|target| target.light).collect::<Vec<_>>()).unwrap();
    for _ in 0..3 {
        assert_eq!(outcome(&mut gpu, &shape, &[0, 1, 2]), first);
    }
    targets.iter_mut().for_each(|target| target.light = Light::uniform([0.5; 3]));
    let mut reference = prepared(Reference::new(), &shape, &targets);
    assert_alike(&other, &outcome(&mut reference, &shape, &[0, 1, 2]));
    assert_eq!(gpu.set_lights(&[]), Err(RenderError::Lights { found: 0, targets: 3 }));
}

#[test]
fn a_lost_device_is_replaced() {
    let Some(mut gpu) = gpu() else { return };
    let (shape, targets) = (Shape::bowl(), mixed_targets());
    gpu.prepare(MeshLayout::of(&shape.topology), &targets).unwrap();
    let before = outcome(&mut gpu, &shape, &[0, 1]);
    gpu.device.device.destroy();
    assert_eq!(outcome(&mut gpu, &shape, &[0, 1]), before);
    gpu.device.device.destroy();
    assert!(gpu.picture(&shape.surface(), 1).is_ok());
}

#[test]
fn a_failure_of_the_driver_is_an_error_once() {
    let Some(gpu) = gpu() else { return };
    buffers::buffer(&gpu.device.device, wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::INDEX, 1);
    let error = gpu.device.check().unwrap_err();
    assert!(matches!(error, RenderError::Device { .. }), "{error}");
    assert_eq!(gpu.device.check(), Ok(()));
}

#[test]
fn what_is_too_large_is_cut_or_refused() {
    let Some(mut gpu) = gpu() else { return };
    let (shape, targets) = (Shape::eared(), mixed_targets());
    let mesh = Connectivity::new(MeshLayout::of(&shape.topology));
    let mut limits = gpu.device.device.limits();
    // Room for one view's gradient, and little more.
    limits.max_storage_buffer_binding_size = 4 * 27 * mesh.triangles.len() as u64 * 3 / 2;
    let cut = chunk::chunks(&targets, &mesh, &limits).unwrap();
    assert_eq!(cut.iter().map(|(range, _)| range.clone()).collect::<Vec<_>>(), [0..1, 1..2, 2..3]);
    gpu.prepare(MeshLayout::of(&shape.topology), &targets).unwrap();
    let whole = outcome(&mut gpu, &shape, &[2, 0, 1]);
    let scene = gpu.scene.as_mut().unwrap();
    scene.loaded = Loaded::new(&gpu.device, &gpu.kernels, &mesh, &targets, &limits).unwrap();
    assert_alike(&outcome(&mut gpu, &shape, &[2, 0, 1]), &whole);

    limits.max_storage_buffer_binding_size = 1000;
    let error = chunk::chunks(&targets, &mesh, &limits).unwrap_err();
    assert!(error.to_string().contains("simplify the mesh"), "{error}");
    limits.max_storage_buffer_binding_size = 1 << 30;
    limits.max_texture_dimension_2d = 100;
    let error = chunk::chunks(&targets, &mesh, &limits).unwrap_err();
    assert!(error.to_string().contains("target 2 in pixels is 128"), "{error}");
}

#[test]
fn adapters_are_chosen_by_name() {
    let Some(gpu) = gpu() else { return };
    let name = gpu.adapter().name.to_uppercase();
    assert_eq!(Gpu::open(&AdapterChoice::Named(name)).unwrap().adapter(), gpu.adapter());
    let error = Gpu::open(&AdapterChoice::Named("no such card".into())).unwrap_err();
    assert!(error.to_string().contains(&gpu.adapter().name), "{error}");
}

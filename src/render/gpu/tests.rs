//! Each kernel against its twin of the reference, on whatever adapter there is.

use super::*;
use crate::numeric::Random;
use crate::render::reference::Reference;
use crate::render::reference::backward::{Pulled, VertexGradient};
use crate::render::reference::frame::{Frame, Job};
use crate::render::reference::shade::Looks;
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

/// The numbers of a buffer after the passes of a loss over all targets.
struct Ran<'a> {
    gpu: &'a mut Gpu,
    shape: &'a Shape,
    targets: &'a [Target],
    with_albedo: bool,
}

impl<'a> Ran<'a> {
    fn new(gpu: &'a mut Gpu, shape: &'a Shape, targets: &'a [Target], with_albedo: bool) -> Self {
        gpu.prepare(MeshLayout::of(&shape.topology), targets).unwrap();
        let ran = Self { gpu, shape, targets, with_albedo };
        let surface = ran.surface();
        let listed: Vec<usize> = (0..targets.len()).collect();
        ran.gpu.loss(&surface, &listed, &mut RenderGradient::default()).unwrap();
        ran
    }

    fn surface(&self) -> Surface<'a> {
        let surface = self.shape.surface();
        Surface { albedo: surface.albedo.filter(|_| self.with_albedo), ..surface }
    }

    fn read(&mut self, binding: Binding, numbers: usize) -> Vec<f32> {
        let Gpu { device, scene, .. } = &mut *self.gpu;
        let usage = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST;
        let read = buffers::buffer(&device.device, usage, numbers as u64);
        let mut encoder = device.device.create_command_encoder(&Default::default());
        let from = scene.as_ref().unwrap().loaded.buffers.get(binding, &read);
        encoder.copy_buffer_to_buffer(from, 0, &read, 0, 4 * numbers as u64);
        device.queue.submit([encoder.finish()]);
        device.read(&read, numbers).unwrap()
    }

    /// A buffer's numbers for each pixel of each view, without what fills up rows.
    fn pixels<const K: usize>(&mut self, binding: Binding) -> Vec<Vec<[f32; K]>> {
        let count = |target: &Target| layout::filled_pixels(&target.view) as usize;
        let all = self.read(binding, K * self.targets.iter().map(count).sum::<usize>());
        let (mut pixels, _) = all.as_chunks::<K>();
        let mut views = Vec::new();
        for target in self.targets {
            let (view, others) = pixels.split_at(count(target));
            let [width, _] = target.view.size();
            let rows = view.chunks_exact(layout::stride(&target.view) as usize);
            views.push(rows.flat_map(|row| row[..width].to_vec()).collect());
            pixels = others;
        }
        views
    }

    /// What each pixel of each view sees.
    fn ids(&mut self) -> Vec<Vec<u32>> {
        let ids = |view: &Vec<[f32; 4]>| view.iter().map(|pixel| pixel[3] as u32).collect();
        self.pixels(Binding::Colours).iter().map(ids).collect()
    }

    fn scale(&self) -> f32 {
        (1.0 / (3.0 * self.targets.iter().map(Target::weight).sum::<f64>())) as f32
    }

    /// The reference's passes over a target.
    fn twin(&self, target: &Target) -> (Frame, Vec<VertexGradient>) {
        let (mut frame, mut gradient) = (Frame::default(), Vec::new());
        let mesh = Connectivity::new(MeshLayout::of(&self.shape.topology));
        let surface = self.surface();
        let job = Job { mesh: &mesh, surface: &surface, target, scale: self.scale() };
        for (_, pass) in Frame::PASSES {
            pass(&mut frame, job, &mut gradient);
        }
        (frame, gradient)
    }

    fn twins(&self) -> Vec<(Frame, Vec<VertexGradient>)> {
        self.targets.iter().map(|target| self.twin(target)).collect()
    }
}

/// Runs a check of every shape, with and without albedo.
fn for_all(check: impl Fn(Ran<'_>)) {
    let Some(mut gpu) = gpu() else { return };
    let targets = mixed_targets();
    for shape in shapes() {
        for with_albedo in [true, false] {
            check(Ran::new(&mut gpu, &shape, &targets, with_albedo));
        }
    }
}

#[test]
fn project() {
    for_all(|mut ran| {
        let vertices = ran.shape.positions.len();
        let corners = ran.read(Binding::Corners, 4 * vertices * ran.targets.len());
        let twin: Vec<f32> = (ran.twins().iter())
            .flat_map(|(frame, _)| frame.corners.iter().flat_map(|c| [c.homogeneous.extend(c.nearness)]))
            .flat_map(|corner| corner.to_array())
            .collect();
        assert!(difference(corners.iter(), twin.iter()) < 1e-6);
    });
}

#[test]
fn raster() {
    for_all(|mut ran| {
        for (ids, (frame, _)) in ran.ids().iter().zip(ran.twins()) {
            let covered = frame.raster.ids.iter().filter(|&&id| id != 0).count();
            let others = ids.iter().zip(&frame.raster.ids).filter(|(one, other)| one != other).count();
            assert!(covered > 500 && others * 200 < covered, "{others} of {covered}");
        }
    });
}

#[test]
fn shade() {
    for_all(|mut ran| {
        let (colours, ids) = (ran.pixels::<4>(Binding::Colours), ran.ids());
        for ((colours, ids), (frame, _)) in colours.iter().zip(&ids).zip(ran.twins()) {
            for (at, (colour, &id)) in colours.iter().zip(ids).enumerate() {
                if id == frame.raster.ids[at] {
                    let (colour, twin) = (Vec3A::from_slice(colour), frame.colours[at]);
                    assert!(colour.distance(twin) < 2e-3, "{colour} {twin}");
                }
            }
        }
    });
}

#[test]
fn silhouette() {
    for_all(|mut ran| {
        let marks = ran.pixels::<2>(Binding::Marks);
        let twins = ran.twins();
        let twin = twins.iter().flat_map(|(frame, _)| frame.marks.as_flattened());
        // How far out a mark is may be rounded to the next step.
        let edge = |mark: u32| mark & 0xff_ffff;
        let (mut marked, mut others) = (0, 0);
        for (mark, &twin) in marks.iter().flatten().flatten().map(|mark| mark.to_bits()).zip(twin) {
            marked += usize::from(twin != 0);
            others += usize::from(edge(mark) != edge(twin));
        }
        assert!(marked > 500 && others * 100 < marked, "{others} of {marked}");
    });
}

#[test]
fn loss_and_blend() {
    for_all(|mut ran| {
        // With respect to the blended colours where some are blended, and to all before they are.
        let (pulled, blends) = (ran.pixels::<3>(Binding::Pulled), ran.pixels::<4>(Binding::Blends));
        for ((pulled, blends), (frame, _)) in pulled.iter().zip(&blends).zip(ran.twins()) {
            let pulled: Vec<Vec3A> = pulled.iter().map(|pixel| Vec3A::from_slice(pixel)).collect();
            let error = difference(flat(&pulled).iter(), flat(&frame.unblended).iter());
            assert!(error < 0.01, "{error}");
            let crossed = frame.crossings.iter().map(|(_, crossing)| crossing.blend().0);
            let (found, wanted): (Vec<Vec3A>, Vec<Vec3A>) =
                crossed.map(|pixel| (Vec3A::from_slice(&blends[pixel]), frame.picture[pixel])).unzip();
            let error = difference(flat(&found).iter(), flat(&wanted).iter());
            assert!(wanted.len() > 50 && error < 0.05, "{error}");
        }
    });
}

#[test]
fn total() {
    for_all(|mut ran| {
        let [width, vertices] = [if ran.with_albedo { 9 } else { 6 }, ran.shape.positions.len()];
        let row = ROW as usize;
        let values = ran.read(Binding::Result, width * vertices + row * ran.targets.len());
        for (values, (frame, _)) in values[width * vertices..].chunks_exact(row).zip(ran.twins()) {
            let value: f64 = values.iter().map(|&value| f64::from(value)).sum();
            assert!((value / frame.value - 1.0).abs() < 1e-4, "{value} {}", frame.value);
        }
    });
}

#[test]
fn backward() {
    for_all(|mut ran| {
        let triangles = &ran.shape.topology.triangles;
        let width = if ran.with_albedo { 9 } else { 6 };
        let gradients = ran.read(Binding::TriangleGradients, 3 * width * triangles.len() * ran.targets.len());
        let surface = ran.surface();
        let closed = !ran.shape.topology.on_rim.contains(&true);
        let mut twin = Vec::new();
        // But for triangles one of whose pixels is not the same: of a sliver it asks much.
        let mut others = vec![false; triangles.len() * ran.targets.len()];
        let (ids, pulled) = (ran.ids(), ran.pixels::<3>(Binding::Pulled));
        for (view, (target, (frame, _))) in ran.targets.iter().zip(ran.twins()).enumerate() {
            for (at, (&one, &other)) in ids[view].iter().zip(&frame.raster.ids).enumerate() {
                let apart = Vec3A::from_slice(&pulled[view][at]).distance(frame.unblended[at]);
                let differ = one != other || apart > 1e-3 * ran.scale();
                for id in [one, other].into_iter().filter(|&id| differ && id != 0) {
                    others[view * triangles.len() + id as usize - 1] = true;
                }
            }
            let projection = target.view.projection();
            let pulled = Pulled {
                projection: &projection,
                light: &target.light,
                raster: &frame.raster,
                gradient: &frame.unblended,
            };
            for (id, &ends) in (1..).zip(triangles) {
                let corners = ends.map(|end| &frame.corners[end as usize]);
                let parts = pulled.triangle(id, corners, &Looks::new(&surface, ends), closed);
                for VertexGradient { position, normal, albedo } in parts.unwrap_or_default() {
                    twin.extend(&flat(&[position, normal, albedo])[..width]);
                }
            }
        }
        for part in 0..width / 3 {
            let of = |numbers: &[f32]| -> Vec<f32> {
                (numbers.chunks_exact(3 * width).zip(&others).filter(|(_, other)| !**other))
                    .flat_map(|(slot, _)| slot.chunks_exact(width).flat_map(|at| &at[3 * part..3 * part + 3]))
                    .copied()
                    .collect()
            };
            let error = difference(of(&gradients).iter(), of(&twin).iter());
            assert!(error < 0.01, "part {part}: {error}");
        }
    });
}

#[test]
fn silhouette_backward() {
    for_all(|mut ran| {
        let mesh = Connectivity::new(MeshLayout::of(&ran.shape.topology));
        let edges = mesh.edges.len();
        let gradients = ran.read(Binding::EdgeGradients, 6 * edges * ran.targets.len());
        let mut twin = vec![0.0; gradients.len()];
        for ((target, (frame, _)), slots) in
            ran.targets.iter().zip(ran.twins()).zip(twin.chunks_exact_mut(6 * edges))
        {
            let projection = target.view.projection();
            let pulled = Pulled {
                projection: &projection,
                light: &target.light,
                raster: &frame.raster,
                gradient: &frame.unblended,
            };
            for (silhouette, crossing) in &frame.crossings {
                let place = Pulled::place(crossing, &frame.colours, &frame.picture);
                let parts = pulled.edge(silhouette, place, place * crossing.along);
                let slot = &mut slots[6 * crossing.edge as usize..][..6];
                slot.iter_mut().zip(flat(&parts)).for_each(|(sum, part)| *sum += part);
            }
        }
        let error = difference(gradients.iter(), twin.iter());
        assert!(error < 0.02, "{error}");
    });
}

#[test]
fn gather() {
    for_all(|mut ran| {
        let vertices = ran.shape.positions.len();
        let width = if ran.with_albedo { 9 } else { 6 };
        let sums = ran.read(Binding::Result, width * vertices);
        let [triangles, edges] = [&ran.shape.topology.triangles.len(), &ran.shape.topology.edges.len()];
        let of_triangles = ran.read(Binding::TriangleGradients, 3 * width * triangles * ran.targets.len());
        let of_edges = ran.read(Binding::EdgeGradients, 6 * edges * ran.targets.len());
        let mut twin = vec![0f64; width * vertices];
        let mut add = |vertex: u32, numbers: &[f32]| {
            let sums = twin[width * vertex as usize..].iter_mut();
            sums.zip(numbers).for_each(|(sum, number)| *sum += f64::from(*number));
        };
        let corners = ran.shape.topology.triangles.as_flattened().iter().cycle();
        corners.zip(of_triangles.chunks_exact(width)).for_each(|(&vertex, part)| add(vertex, part));
        let ends = ran.shape.topology.edges.as_flattened().iter().cycle();
        ends.zip(of_edges.chunks_exact(3)).for_each(|(&vertex, part)| add(vertex, part));
        let twin: Vec<f32> = twin.iter().map(|&sum| sum as f32).collect();
        assert!(difference(sums.iter(), twin.iter()) < 1e-5);
    });
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
    let targets = mixed_targets();
    for shape in shapes() {
        gpu.prepare(MeshLayout::of(&shape.topology), &targets).unwrap();
        let mut reference = prepared(Reference::new(), &shape, &targets);
        for listed in [&[0, 1, 2][..], &[2], &[1, 0], &[0, 0, 2, 1, 1, 2]] {
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

//! Each kernel against its twin of the reference.

use super::*;
use crate::render::reference::backward::{Pulled, VertexGradient};
use crate::render::reference::frame::{Frame, Job};
use crate::render::reference::lamp::Lamp;
use crate::render::reference::shade::Looks;

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

    /// The gradient with respect to each pixel's colour in each view.
    fn pulled(&mut self) -> Vec<Vec<Vec3A>> {
        let (packed, changed) = (self.pixels::<1>(Binding::Pulled), self.pixels::<4>(Binding::Changed));
        let scale = self.scale();
        let pull = |([packed], changed): (&[f32; 1], &[f32; 4])| {
            let packed = packed.to_bits();
            let signs = [0, 2, 4].map(|shift| (packed >> shift & 3) as f32 - 1.0);
            // The heaviest of the tests' weights is one.
            let weight = (packed >> 16) as f32 / 65535.0;
            let is_changed = packed & 64 != 0;
            if is_changed { Vec3A::from_slice(changed) } else { Vec3A::from_array(signs) * (weight * scale) }
        };
        packed
            .iter()
            .zip(&changed)
            .map(|(packed, changed)| packed.iter().zip(changed).map(pull).collect())
            .collect()
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
        let (pulled, blends) = (ran.pulled(), ran.pixels::<4>(Binding::Blends));
        for ((pulled, blends), (frame, _)) in pulled.iter().zip(&blends).zip(ran.twins()) {
            let error = difference(flat(pulled).iter(), flat(&frame.unblended).iter());
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
        // One group of views.
        assert!(ran.targets.len() <= layout::GROUP as usize);
        let gradients = ran.read(Binding::TriangleGradients, 3 * width * triangles.len());
        let surface = ran.surface();
        let closed = !ran.shape.topology.on_rim.contains(&true);
        let mut twin = vec![0.0; gradients.len()];
        // But for triangles one of whose pixels is not the same: of a sliver it asks much.
        let mut others = vec![false; triangles.len()];
        let (ids, pulled) = (ran.ids(), ran.pulled());
        for (view, (target, (frame, _))) in ran.targets.iter().zip(ran.twins()).enumerate() {
            for (at, (&one, &other)) in ids[view].iter().zip(&frame.raster.ids).enumerate() {
                let apart = pulled[view][at].distance(frame.unblended[at]);
                let differ = one != other || apart > 1e-3 * ran.scale();
                for id in [one, other].into_iter().filter(|&id| differ && id != 0) {
                    others[id as usize - 1] = true;
                }
            }
            let projection = target.view.projection();
            let pulled = Pulled {
                projection: &projection,
                lamp: &Lamp::new(&target.light),
                raster: &frame.raster,
                gradient: &frame.unblended,
            };
            for ((id, &ends), sums) in (1..).zip(triangles).zip(twin.chunks_exact_mut(3 * width)) {
                let corners = ends.map(|end| &frame.corners[end as usize]);
                let parts = pulled.triangle(id, corners, &Looks::new(&surface, ends), closed);
                let parts = parts.unwrap_or_default().map(|part| [part.position, part.normal, part.albedo]);
                for (sums, part) in sums.chunks_exact_mut(width).zip(parts) {
                    sums.iter_mut().zip(flat(&part)).for_each(|(sum, number)| *sum += number);
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
                lamp: &Lamp::new(&target.light),
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
        let of_triangles = ran.read(Binding::TriangleGradients, 3 * width * triangles);
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

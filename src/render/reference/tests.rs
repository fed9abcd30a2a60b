//! Each pass against a plainer way to the same, and the whole gradient against finite differences.

use glam::{DVec3, Vec3A};

use super::backward::{Pulled, VertexGradient};
use super::frame::Frame;
use super::lamp::Lamp;
use super::shade::{Looks, shade};
use super::*;
use crate::mesh::Normals;
use crate::numeric::Random;
use crate::numeric::finite_difference::directional_error;
use crate::render::View;
use crate::render::scenes::{Scene, light, targets, views};

fn connectivity(scene: &Scene) -> Connectivity {
    Connectivity::new(MeshLayout::of(&scene.topology))
}

fn drawn(scene: &Scene, target: &Target) -> Frame {
    let mut frame = Frame::default();
    let (mesh, surface) = (&connectivity(scene), &scene.surface());
    frame.draw(Job { mesh, surface, target, scale: 1.0 });
    frame
}

fn scenes() -> [Scene; 3] {
    [Scene::bumpy(3), Scene::eared(), Scene::bowl()]
}

/// The nearest triangle on the ray through a pixel's centre, and where; back faces too if they are drawn.
fn cast(scene: &Scene, view: &View, x: usize, y: usize, closed: bool) -> Option<(u32, f64, DVec3)> {
    let seen = view.intrinsics.direction(glam::DVec2::new(x as f64 + 0.5, y as f64 + 0.5));
    let ray = view.pose.rotation.transpose() * seen.extend(1.0);
    let from = view.pose.centre();
    let hits = (1..).zip(&scene.topology.triangles).filter_map(|(id, corners)| {
        let [a, b, c] = corners.map(|corner| scene.positions[corner as usize].as_dvec3() - from);
        let parts = DVec3::new(b.cross(c).dot(ray), c.cross(a).dot(ray), a.cross(b).dot(ray));
        let sum = parts.element_sum();
        let weights = parts / sum;
        let outside = a.dot((b - a).cross(c - a)) < 0.0;
        ((outside || !closed) && weights.min_element() >= 0.0)
            .then(|| (id, a.dot((b - a).cross(c - a)) / sum, weights))
    });
    hits.filter(|hit| hit.1 > 0.0).min_by(|one, other| one.1.total_cmp(&other.1))
}

#[test]
fn pixels_see_and_show_what_rays_through_their_centres_meet() {
    for scene in scenes() {
        let closed = connectivity(&scene).closed;
        for target in targets(&views(3, [50, 40]), &mut Random::new(1)) {
            let frame = drawn(&scene, &target);
            let (mut covered, mut others) = (0, 0);
            for (at, &id) in frame.raster.ids.iter().enumerate() {
                let hit = cast(&scene, &target.view, at % 50, at / 50, closed);
                covered += usize::from(hit.is_some());
                // Corners are rounded to parts of pixels: rays near an edge may meet its other side.
                if hit.map_or(0, |hit| hit.0) != id {
                    others += 1;
                    continue;
                }
                let Some((id, depth, weights)) = hit else {
                    assert_eq!(frame.colours[at].to_array(), target.background);
                    continue;
                };
                assert!((frame.raster.nearness[at] as f64 * depth - 1.0).abs() < 1e-3);
                let corners = scene.topology.triangles[id as usize - 1].map(|corner| corner as usize);
                let mean = |values: [Vec3A; 3]| {
                    (0..3).map(|k| values[k].as_dvec3() * weights[k]).sum::<DVec3>().as_vec3a()
                };
                let normal = mean(corners.map(|corner| scene.normals[corner])).normalize();
                let albedo = mean(corners.map(|corner| Vec3A::from_array(scene.albedo[corner])));
                let colour = albedo * Vec3A::from_array(target.light.colour(normal));
                assert!(colour.distance(frame.colours[at]) < 1e-3, "{colour} {}", frame.colours[at]);
            }
            assert!(covered > 300 && others * 100 < covered, "{others} of {covered}");
        }
    }
}

/// The picture as the mean of many samples in each pixel.
fn supersampled(scene: &Scene, target: &Target, samples: usize) -> Vec<Vec3A> {
    let [width, height] = target.view.size();
    let fine = target.view.intrinsics.size.map(|side| side * samples as u32);
    let view = View { intrinsics: target.view.intrinsics.resized(fine), ..target.view };
    let fine = Target { view, colours: Vec::new(), weights: None, ..*target };
    let frame = drawn(scene, &fine);
    let mut picture = vec![Vec3A::ZERO; width * height];
    for (y, row) in frame.colours.chunks_exact(width * samples).enumerate() {
        for (x, &colour) in row.iter().enumerate() {
            picture[(y / samples) * width + x / samples] += colour;
        }
    }
    picture.iter().map(|sum| *sum / (samples * samples) as f32).collect()
}

#[test]
fn blending_brings_outlines_nearer_to_a_supersampled_picture() {
    for scene in scenes() {
        for target in targets(&views(3, [64, 64]), &mut Random::new(1)) {
            let frame = drawn(&scene, &target);
            let fine = supersampled(&scene, &target, 16);
            let error = |picture: &[Vec3A]| -> f32 {
                frame
                    .crossings
                    .iter()
                    .map(|(_, crossing)| crossing.blend().0)
                    .map(|at| picture[at].distance(fine[at]))
                    .sum()
            };
            let (hard, soft) = (error(&frame.colours), error(&frame.picture));
            assert!(soft < 0.45 * hard, "{soft} {hard}");
        }
    }
}

#[test]
fn every_outline_before_the_background_is_found() {
    for scene in scenes() {
        for target in targets(&views(4, [96, 96]), &mut Random::new(1)) {
            let frame = drawn(&scene, &target);
            let (mut found, mut outlines) = (0, 0);
            for (at, &id) in frame.raster.ids.iter().enumerate() {
                for (axis, step) in [1, 96].into_iter().enumerate() {
                    let inside = if axis == 0 { at % 96 < 95 } else { at / 96 < 95 };
                    if inside && (id == 0) != (frame.raster.ids[at + step] == 0) {
                        // Steep edges cross rows alone, and flat ones columns: either side's pixel has one.
                        let near = [at, at + step, at.saturating_sub(96), at.saturating_sub(1)];
                        outlines += 1;
                        found += usize::from(near.iter().any(|&at| frame.marks[at] != [0; 2]));
                    }
                }
            }
            assert!(outlines > 100 && found * 100 >= outlines * 98, "{found} of {outlines}");
        }
    }
}

#[test]
fn pull_back_of_the_loss_and_of_blending() {
    let scene = Scene::eared();
    let target = &targets(&views(1, [40, 40]), &mut Random::new(3))[0];
    let Frame { colours, crossings, .. } = drawn(&scene, target);
    let (mut pulled, mut gradient) = (Vec::new(), Vec::new());
    loss::blend(&colours, &crossings, &mut pulled);
    loss::loss(&mut pulled, &target.colours, target.weights.as_deref(), 0.5);
    loss::unblend(&pulled, &crossings, &mut gradient);
    assert!(crossings.len() > 50);
    let error = directional_error(&colours, &gradient, 1e-2, 8, |colours| {
        loss::blend(colours, &crossings, &mut pulled);
        0.5 * loss::loss(&mut pulled, &target.colours, target.weights.as_deref(), 0.5)
    });
    assert!(error < 1e-4, "{error}");
}

/// Sum of a fixed picture of weights times the colours of what is seen, with what is seen held.
struct Held {
    scene: Scene,
    target: Target,
    frame: Frame,
    upstream: Vec<Vec3A>,
}

impl Held {
    fn new(scene: Scene) -> Self {
        let target = targets(&views(3, [48, 48]), &mut Random::new(1)).remove(2);
        let frame = drawn(&scene, &target);
        let mut random = Random::new(8);
        let upstream =
            frame.colours.iter().map(|_| Vec3A::from_array([0; 3].map(|_| random.signed() as f32)));
        let upstream = upstream.collect();
        Self { scene, target, frame, upstream }
    }

    fn value(&self, surface: &Surface<'_>) -> f64 {
        let (mut corners, mut colours) = (Vec::new(), Vec::new());
        corner::project(&self.target.view.projection(), surface.positions, &mut corners);
        let triangles = &self.scene.topology.triangles;
        shade(&self.frame.raster, &corners, triangles, surface, &light(), [0.0; 3], &mut colours);
        colours.iter().zip(&self.upstream).map(|(colour, pull)| f64::from(colour.dot(*pull))).sum()
    }

    fn gradient(&self) -> Vec<VertexGradient> {
        let projection = self.target.view.projection();
        let light = light();
        let pulled = Pulled {
            projection: &projection,
            lamp: &Lamp::new(&light),
            raster: &self.frame.raster,
            gradient: &self.upstream,
        };
        let mut gradient = vec![VertexGradient::default(); self.scene.positions.len()];
        for (id, &ends) in (1..).zip(&self.scene.topology.triangles) {
            let corners = ends.map(|end| &self.frame.corners[end as usize]);
            let looks = Looks::new(&self.scene.surface(), ends);
            for (end, part) in pulled
                .triangle(id, corners, &looks, false)
                .into_iter()
                .flat_map(|parts| ends.into_iter().zip(parts))
            {
                gradient[end as usize] += part;
            }
        }
        gradient
    }
}

#[test]
fn pull_back_of_shading_to_positions_normals_and_albedo() {
    for scene in scenes() {
        let held = Held::new(scene);
        let gradient = held.gradient();
        let surface = held.scene.surface();
        let of = |part: fn(&VertexGradient) -> Vec3A| gradient.iter().map(part).collect::<Vec<_>>();
        let positions = directional_error(surface.positions, &of(|g| g.position), 2e-4, 6, |positions| {
            held.value(&Surface { positions, ..surface })
        });
        let normals = directional_error(surface.normals, &of(|g| g.normal), 1e-3, 6, |normals| {
            held.value(&Surface { normals, ..surface })
        });
        let albedo: Vec<Vec3A> = held.scene.albedo.iter().map(|&a| Vec3A::from_array(a)).collect();
        let albedo = directional_error(&albedo, &of(|g| g.albedo), 1e-2, 6, |albedo| {
            let albedo: Vec<_> = albedo.iter().map(|a| a.to_array()).collect();
            held.value(&Surface { albedo: Some(&albedo), ..surface })
        });
        assert!(positions < 0.02 && normals < 5e-3 && albedo < 1e-3, "{positions} {normals} {albedo}");
    }
}

#[test]
fn pull_back_of_crossings_to_positions() {
    for scene in scenes() {
        let target = &targets(&views(3, [64, 64]), &mut Random::new(1))[2];
        let frame = drawn(&scene, target);
        let mesh = connectivity(&scene);
        let projection = target.view.projection();
        let lit = light();
        let pulled = Pulled {
            projection: &projection,
            lamp: &Lamp::new(&lit),
            raster: &frame.raster,
            gradient: &frame.colours,
        };
        let mut random = Random::new(12);
        let upstream: Vec<f32> = frame.crossings.iter().map(|_| random.signed() as f32).collect();
        let mut gradient = vec![Vec3A::ZERO; scene.positions.len()];
        for ((silhouette, crossing), pull) in frame.crossings.iter().zip(&upstream) {
            let parts = pulled.edge(silhouette, *pull, pull * crossing.along);
            for (end, part) in mesh.edges[crossing.edge as usize].into_iter().zip(parts) {
                gradient[end as usize] += part;
            }
        }
        // Where each edge crosses the same line, by itself.
        let error = directional_error(&scene.positions, &gradient, 2e-4, 6, |positions| {
            let place = |crossing: &silhouette::Crossing| {
                let [a, b, ..] = mesh.edges[crossing.edge as usize];
                let [a, b] = [a, b].map(|end| {
                    let seen = target.view.pose.to_camera(positions[end as usize].as_dvec3());
                    target.view.intrinsics.pixel(seen.truncate() / seen.z) - 0.5
                });
                let line = [crossing.first / 64, crossing.first % 64][crossing.axis] as f64;
                let (u, v) = (crossing.axis, 1 - crossing.axis);
                a[u] + (b[u] - a[u]) * (line - a[v]) / (b[v] - a[v])
            };
            (frame.crossings.iter().zip(&upstream)).map(|((_, c), pull)| place(c) * f64::from(*pull)).sum()
        });
        assert!(frame.crossings.len() > 80 && error < 1e-2, "{} {error}", frame.crossings.len());
    }
}

/// E_p of pictures of many samples a pixel.
fn fine_loss(scene: &Scene, targets: &[Target]) -> f64 {
    let (mut sum, mut total) = (0.0, 0.0);
    for target in targets {
        let mut picture = supersampled(scene, target, 8);
        sum += loss::loss(&mut picture, &target.colours, target.weights.as_deref(), 1.0);
        total += 3.0 * target.weight();
    }
    sum / total
}

/// dE_p/dp, with the part through the normals.
fn whole_gradient(scene: &Scene, targets: &[Target]) -> Vec<Vec3A> {
    let mut renderer = Reference::new();
    renderer.prepare(MeshLayout::of(&scene.topology), targets).unwrap();
    let mut gradient = RenderGradient::default();
    let all: Vec<usize> = (0..targets.len()).collect();
    renderer.loss(&scene.surface(), &all, &mut gradient).unwrap();
    let RenderGradient { mut positions, normals, .. } = gradient;
    let (topology, moved) = (&scene.topology, &scene.positions);
    Normals::new(topology, moved).pull_back(topology, moved, &normals, &mut positions);
    positions
}

/// The error of the gradient along smooth fields of moves, relative to the slopes of supersampled pictures.
fn error_on_supersampled(scene: &Scene, targets: &[Target]) -> f64 {
    let gradient = whole_gradient(scene, targets);
    let mut random = Random::new(6);
    let (mut squares, mut errors) = (0.0, 0.0);
    for _ in 0..6 {
        let waves = [0; 3].map(|_| Vec3A::from_array([0; 3].map(|_| 3.0 * random.signed() as f32)));
        let direction = |p: &Vec3A| Vec3A::from_array(waves.map(|wave| (wave.dot(*p) + wave.x).sin()));
        let shifted = |step: f32| {
            let moved = scene.positions.iter().map(|p| *p + direction(p) * step).collect();
            fine_loss(&scene.moved(moved), targets)
        };
        let step = 5e-3;
        let numeric = (shifted(step) - shifted(-step)) / f64::from(2.0 * step);
        let slopes = scene.positions.iter().zip(&gradient).map(|(p, g)| f64::from(direction(p).dot(*g)));
        squares += numeric * numeric;
        errors += (numeric - slopes.sum::<f64>()).powi(2);
    }
    (errors / squares).sqrt()
}

#[test]
fn the_whole_gradient_is_that_of_supersampled_pictures() {
    for scene in scenes() {
        let shaded = targets(&views(3, [128, 128]), &mut Random::new(4));
        let silhouettes: Vec<Target> = shaded
            .iter()
            .map(|target| Target { light: Light::uniform([1.0; 3]), ..target.clone() })
            .collect();
        let white = Scene { albedo: vec![[1.0; 3]; scene.positions.len()], ..scene.clone() };
        let error = error_on_supersampled(&white, &silhouettes);
        assert!(error < 0.04, "silhouettes: {error}");
        // Colours change steeply along outlines, between where a pixel's centre sees them and the outline itself.
        let error = error_on_supersampled(&scene, &shaded);
        assert!(error < 0.2, "shaded: {error}");
    }
}

#[test]
fn outlines_are_placed_within_parts_of_a_pixel() {
    let radius = |scale: f32| {
        let sphere = Scene::bumpy(4);
        sphere.moved(sphere.positions.iter().map(|p| *p * scale).collect())
    };
    let mut target = targets(&views(1, [64, 64]), &mut Random::new(4)).remove(0);
    (target.light, target.background, target.weights) = (Light::uniform([1.0; 3]), [0.0; 3], None);
    let truth = Scene { albedo: vec![[1.0; 3]; 2562], ..radius(1.0) };
    target.colours = supersampled(&truth, &target, 16).iter().map(|colour| colour.to_array()).collect();
    // The sphere is about 22 pixels in radius.
    for off in [0.1, 0.2, 0.5, 1.5] {
        let slope = |scale: f32| -> f32 {
            let scene = Scene { albedo: truth.albedo.clone(), ..radius(scale) };
            let gradient = whole_gradient(&scene, std::slice::from_ref(&target));
            scene.positions.iter().zip(&gradient).map(|(p, g)| p.dot(*g)).sum()
        };
        let slopes = [slope(1.0 - off / 22.0), slope(1.0 + off / 22.0)];
        assert!(slopes[0] < 0.0 && slopes[1] > 0.0, "{off}: {slopes:?}");
    }
}

#[test]
fn the_same_bytes_whatever_the_threads() {
    let scene = Scene::eared();
    let targets = targets(&views(6, [40, 30]), &mut Random::new(4));
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut renderer = Reference::new();
            renderer.prepare(MeshLayout::of(&scene.topology), &targets).unwrap();
            let mut gradient = RenderGradient::default();
            let value = renderer.loss(&scene.surface(), &[5, 0, 3, 2], &mut gradient).unwrap();
            (value, gradient)
        })
    };
    assert_eq!(run(1), run(3));
}

//! Stage 1: the sphere template to one scan.

use glam::Vec3A;

use super::scan_surface::{ScanSurface, refresh};
use crate::energy::*;
use crate::mesh::{Icosphere, Midpoints, Normals, Topology, mean_edge_lengths};
use crate::numeric::{AdamUniform, Dissection, SolveBuffer};
use crate::reparam::Reparameterization;
use crate::spatial::SurfaceIndex;

#[derive(Debug, Clone)]
pub struct LevelSettings {
    pub level: u32,
    pub iterations: usize,
    pub lambda: f64,
    pub rate: f32,
    pub rate_end: f32,
    pub every: usize,
    pub samples: usize,
    pub kn: [f32; 2],
    pub wn: [f32; 2],
    pub uniform: [f32; 2],
    pub fold: [f32; 2],
    pub huber: f32,
    pub landmark: [f32; 2],
}

fn mix(range: [f32; 2], x: f32) -> f32 {
    range[0] + (range[1] - range[0]) * x
}

pub fn deform_level(
    scan: &ScanSurface,
    topology: &Topology,
    reparam: &Reparameterization,
    s: &LevelSettings,
    mut p: Vec<Vec3A>,
    landmarks: &[LandmarkPull],
    verbose: bool,
) -> Vec<Vec3A> {
    let n = p.len();
    let mut u = reparam.parameters(topology, &p);
    let mut adam = AdamUniform::new(n);
    let mut buffer = SolveBuffer::default();
    let mut normals = Normals::new(topology, &p);
    let mut index = SurfaceIndex::new(&p, &topology.triangles);
    let mut vm = vec![VertexMatch::default(); n];
    let mut sm = vec![SampleMatch::default(); s.samples];
    let mut gradient = Gradient::zero(topology);
    let mut vhint: Vec<u32> = vec![0; n];
    let mut times = [0f64; 5];
    for it in 0..s.iterations {
        let x = it as f32 / s.iterations as f32;
        let kn = mix(s.kn, x);
        let k2 = kn * kn;
        let t0 = std::time::Instant::now();
        p.copy_from_slice(&u);
        reparam.to_positions(&mut p, &mut buffer);
        normals.update(topology, &p);
        times[0] += t0.elapsed().as_secs_f64();
        if it % s.every == 0 {
            let t0 = std::time::Instant::now();
            let (pp, nn) = (&p, &normals.vertices);
            let hints = std::mem::take(&mut vhint);
            let found: Vec<_> = {
                use rayon::prelude::*;
                (0..n)
                    .into_par_iter()
                    .with_min_len(128)
                    .map(|i| scan.index.closest_oriented(pp[i], nn[i], k2, 0.0, f32::INFINITY, Some(hints[i])))
                    .collect()
            };
            vhint = hints;
            for (i, hit) in found.iter().enumerate() {
                vm[i] = match hit {
                    Some(hit) => {
                        vhint[i] = hit.triangle;
                        VertexMatch {
                            point: hit.point,
                            normal: scan.normal_at(hit),
                            weight: if scan.on_rim(hit) { 0.0 } else { 1.0 },
                        }
                    }
                    None => VertexMatch::default(),
                };
            }
            times[1] += t0.elapsed().as_secs_f64();
            let t0 = std::time::Instant::now();
            if it % (s.every * 40) == 0 {
                index = SurfaceIndex::new(&p, &topology.triangles);
            } else {
                index.refit(&p);
            }
            let offset = (it / s.every) * s.samples;
            refresh(&mut sm, |i, m| {
                let sample = scan.samples[(offset + i) % scan.samples.len()];
                *m = match index.closest_oriented(sample.point, sample.normal, k2, -0.3, f32::INFINITY, None) {
                    Some(hit) => SampleMatch {
                        triangle: hit.triangle,
                        weight: 1.0,
                        weights: hit.weights,
                        point: sample.point,
                        normal: sample.normal,
                    },
                    None => SampleMatch::default(),
                };
            });
            times[2] += t0.elapsed().as_secs_f64();
        }
        let t0 = std::time::Instant::now();
        gradient.clear(topology);
        let shape = Shape { topology, positions: &p, normals: &normals };
        let pull = if s.huber > 0.0 { Pull::Huber(s.huber) } else { Pull::Distance };
        let wn = mix(s.wn, x);
        let mean_area =
            normals.area_vectors.iter().map(|a| a.length()).sum::<f32>() / normals.area_vectors.len() as f32;
        let floor = 0.2 * mean_area;
        let mut e = [0.0; 6];
        e[0] = TemplateToScan { matches: &vm, pull }.add(shape, 1.0, &mut gradient);
        e[1] = ScanToTemplate { matches: &sm, pull }.add(shape, 1.0, &mut gradient);
        e[2] = VertexNormals { matches: &vm }.add(shape, wn, &mut gradient);
        e[3] = SampleNormals { matches: &sm, floor }.add(shape, wn, &mut gradient);
        let wu = mix(s.uniform, x);
        if wu > 0.0 {
            let lengths = mean_edge_lengths(topology, &p);
            let mean = lengths.iter().sum::<f32>() / n as f32;
            let desired = vec![mean; n];
            e[4] = Adaptation { lengths: &lengths, desired: &desired }.add(shape, wu, &mut gradient);
        }
        let wf = mix(s.fold, x);
        if wf > 0.0 {
            e[5] = Foldover { cosine: 0.0, floor }.add(shape, wf, &mut gradient);
        }
        let wl = mix(s.landmark, x);
        if !landmarks.is_empty() && wl > 0.0 {
            e[5] = Landmarks { pulls: landmarks }.add(shape, wl, &mut gradient);
        }
        times[3] += t0.elapsed().as_secs_f64();
        let t0 = std::time::Instant::now();
        let g = gradient.total(shape);
        reparam.pull_back(g, &mut buffer);
        let rate = s.rate * s.rate_end.powf(x);
        adam.step(&mut u, g, rate);
        times[4] += t0.elapsed().as_secs_f64();
        if verbose && (it % 50 == 0 || it + 1 == s.iterations) {
            println!("{} {it} {e:.5?}", s.level);
        }
    }
    if verbose {
        println!("times solve+normals {:.3} t2s {:.3} s2t {:.3} energies {:.3} back {:.3}", times[0], times[1], times[2], times[3], times[4]);
    }
    p.copy_from_slice(&u);
    reparam.to_positions(&mut p, &mut buffer);
    p
}

pub fn fit(scan: &ScanSurface, levels: &[LevelSettings], radius: f32, landmarks: &dyn Fn(u32) -> Vec<LandmarkPull>, verbose: bool) -> (Vec<Vec3A>, Vec<[u32; 3]>) {
    let mut p: Vec<Vec3A> = Vec::new();
    let mut triangles = Vec::new();
    for (k, s) in levels.iter().enumerate() {
        let sphere = Icosphere::new(s.level);
        let rest: Vec<Vec3A> = sphere.positions.iter().map(|p| p.as_vec3a()).collect();
        let topology = Topology::new(rest.len(), &sphere.triangles);
        if k == 0 {
            p = rest.iter().map(|p| *p * radius).collect();
        } else {
            let coarse = Icosphere::new(s.level - 1);
            let midpoints = Midpoints::of(coarse.positions.len(), &coarse.triangles);
            p = midpoints.subdivide(&p);
        }
        let dissection = Dissection::new(&topology, &rest);
        let reparam = Reparameterization::new(&topology, &dissection, s.lambda).expect("positive");
        p = deform_level(scan, &topology, &reparam, s, p, &landmarks(s.level), verbose);
        triangles = sphere.triangles;
    }
    (p, triangles)
}

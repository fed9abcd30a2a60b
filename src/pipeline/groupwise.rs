//! The stage of ours: the mean of the registered set is the template from which every member is registered again.

use glam::{DVec3, Mat3A, Vec3A};
use rayon::prelude::*;

use super::scan_surface::ScanSurface;
use crate::energy::LandmarkPull;
use crate::mesh::{Normals, Topology};
use crate::numeric::*;
use crate::spatial::SurfaceIndex;

/// Generalised Procrustes mean of positions sets [M][N,3].
pub fn mean_shape(members: &[Vec<DVec3>], quality: &[f64]) -> Vec<DVec3> {
    let total: f64 = quality.iter().sum();
    let n = members[0].len();
    let weights = vec![1.0; n];
    let mut reference = members[0].clone();
    for _ in 0..3 {
        let aligned: Vec<Vec<DVec3>> = members
            .par_iter()
            .map(|m| {
                let s = Similarity::between(m, &reference, &weights);
                m.iter().map(|p| s.apply(*p)).collect()
            })
            .collect();
        let mut mean = vec![DVec3::ZERO; n];
        for (a, q) in aligned.iter().zip(quality) {
            for (m, p) in mean.iter_mut().zip(a) {
                *m += *p * (q / total);
            }
        }
        let c = mean.iter().sum::<DVec3>() / n as f64;
        let r = mean.iter().map(|p| p.distance(c)).fold(0.0, f64::max);
        reference = mean.iter().map(|p| (*p - c) / r).collect();
    }
    reference
}

/// The rest shape and what is precomputed on it.
pub struct Rest {
    pub topology: Topology,
    pub positions: Vec<Vec3A>,
    pub weights: Vec<f64>, // cot per edge
    inverse_frames: Vec<Mat3A>,
    areas: Vec<f32>,
    pub dissection: Dissection,
}

fn frame(topology: &Topology, p: &[Vec3A], t: usize) -> Mat3A {
    let [a, b, c] = topology.triangles[t].map(|i| p[i as usize]);
    let (e, f) = (b - a, c - a);
    let n = e.cross(f);
    Mat3A::from_cols(e, f, n / n.length().max(1e-20).sqrt())
}

impl Rest {
    pub fn new(topology: Topology, positions: Vec<Vec3A>, dissection: Dissection) -> Self {
        let mut weights = vec![0.0; topology.edges.len()];
        for (k, (&[a, b], ts)) in topology.edges.iter().zip(&topology.edge_triangles).enumerate() {
            for &t in ts {
                let c = topology.triangles[t as usize].into_iter().find(|&c| c != a && c != b).unwrap_or(a);
                let (e, f) = (positions[a as usize] - positions[c as usize], positions[b as usize] - positions[c as usize]);
                let cot = f64::from(e.dot(f)) / f64::from(e.cross(f).length()).max(1e-12);
                weights[k] += 0.5 * cot;
            }
            weights[k] = weights[k].clamp(0.1, 3.0);
        }
        let inverse_frames: Vec<Mat3A> = (0..topology.triangles.len())
            .map(|t| {
                let f = frame(&topology, &positions, t);
                if f.determinant().abs() > 1e-20 { f.inverse() } else { Mat3A::ZERO }
            })
            .collect();
        let areas = topology
            .triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|i| positions[i as usize]);
                (b - a).cross(c - a).length()
            })
            .collect();
        Self { topology, positions, weights, inverse_frames, areas, dissection }
    }

    /// Per-vertex deformation gradients of p relative to rest, smoothed by the factor.
    pub fn gradients(&self, p: &[Vec3A], smooth: &SparseCholesky, buffer: &mut SolveBuffer) -> Vec<Mat3A> {
        let js: Vec<Mat3A> = (0..self.topology.triangles.len())
            .into_par_iter()
            .with_min_len(1024)
            .map(|t| frame(&self.topology, p, t) * self.inverse_frames[t])
            .collect();
        let n = p.len();
        let mut cols = [vec![Vec3A::ZERO; n], vec![Vec3A::ZERO; n], vec![Vec3A::ZERO; n]];
        for i in 0..n {
            let mut sum = Mat3A::ZERO;
            let mut w = 0.0;
            for fan in self.topology.fans.row(i) {
                let a = self.areas[fan[0] as usize];
                sum += js[fan[0] as usize] * a;
                w += a;
            }
            sum *= 1.0 / w.max(1e-20);
            cols[0][i] = sum.x_axis;
            cols[1][i] = sum.y_axis;
            cols[2][i] = sum.z_axis;
        }
        for c in &mut cols {
            smooth.solve(c, buffer);
        }
        (0..n).map(|i| Mat3A::from_cols(cols[0][i], cols[1][i], cols[2][i])).collect()
    }

    /// div: right-hand side sum_j c_ij J_ij (m_i - m_j).
    pub fn divergence(&self, js: &[Mat3A]) -> Vec<Vec3A> {
        let mut out = vec![Vec3A::ZERO; js.len()];
        for (k, &[a, b]) in self.topology.edges.iter().enumerate() {
            let (a, b) = (a as usize, b as usize);
            let m = self.positions[a] - self.positions[b];
            let v = (js[a] * m + js[b] * m) * (0.5 * self.weights[k] as f32);
            out[a] += v;
            out[b] -= v;
        }
        out
    }

    pub fn factor(&self, mu: f64, data: f64, landmarks: &[LandmarkPull], wl: f64) -> SparseCholesky {
        let mut m = SymmetricMatrix {
            diagonal: vec![data; self.positions.len()],
            edges: self.weights.iter().map(|w| -mu * w).collect(),
        };
        for (k, &[a, b]) in self.topology.edges.iter().enumerate() {
            m.diagonal[a as usize] += mu * self.weights[k];
            m.diagonal[b as usize] += mu * self.weights[k];
        }
        for l in landmarks {
            let c = self.topology.triangles[l.triangle as usize];
            for i in 0..3 {
                m.diagonal[c[i] as usize] += wl * f64::from(l.weights[i] * l.weights[i]);
                let (a, b) = (c[i].min(c[(i + 1) % 3]), c[i].max(c[(i + 1) % 3]));
                let e = self.topology.edges.binary_search(&[a, b]).unwrap();
                m.edges[e] += wl * f64::from(l.weights[i] * l.weights[(i + 1) % 3]);
            }
        }
        SparseCholesky::new(&self.topology, &m, &self.dissection).unwrap()
    }

    pub fn smoother(&self, lambda: f64) -> SparseCholesky {
        SparseCholesky::new(&self.topology, &SymmetricMatrix::diffusion(&self.topology, lambda), &self.dissection).unwrap()
    }
}

#[derive(Clone, Debug)]
pub struct Phase {
    pub iterations: usize,
    pub mu: f64,
    pub smooth: f64,
    pub landmark: f64,
    pub kn: f32,
    pub reach: f32,
    pub samples: usize,
    pub plane: f32,
    pub gate: f32,
    pub gate2: f32,
    pub reach2: f32,
    pub prox: f64,
    pub back: f32,
    pub far: f32,
    pub every: usize,
}

pub struct Factored {
    pub phase: Phase,
    smooth: SparseCholesky,
}

pub fn prepare(rest: &Rest, phases: &[Phase]) -> Vec<Factored> {
    phases
        .par_iter()
        .map(|ph| Factored {
            phase: ph.clone(),
            smooth: rest.smoother(ph.smooth),
        })
        .collect()
}

/// Register from the rest shape: start positions p.
pub fn refine(rest: &Rest, phases: &[Factored], scan: &ScanSurface, landmarks: &[LandmarkPull], mut p: Vec<Vec3A>, verbose: bool) -> Vec<Vec3A> {
    let topology = &rest.topology;
    let n = p.len();
    let mut buffer = SolveBuffer::default();
    let mut normals = Normals::new(topology, &p);
    let mut index = SurfaceIndex::new(&p, &topology.triangles);
    let mut vhint = vec![0u32; n];
    let mut step = 0;
    let edge_of: std::collections::HashMap<[u32; 2], usize> = topology.edges.iter().enumerate().map(|(i, e)| (*e, i)).collect();
    let te: Vec<[u32; 3]> = topology.triangles.iter().map(|t| [0, 1, 2].map(|k| { let (a, b) = (t[k], t[(k + 1) % 3]); edge_of[&[a.min(b), a.max(b)]] as u32 })).collect();
    for f in phases {
        let ph = &f.phase;
        let k2 = ph.kn * ph.kn;
        let reach = ph.reach * ph.reach;
        let wl = ph.landmark * ph.mu.max(1.0);
        let mut system: Option<SparseCholesky> = None;
        for it in 0..ph.iterations {
            normals.update(topology, &p);
            if it == 0 { index = SurfaceIndex::new(&p, &topology.triangles); } else { index.refit(&p); }
            let mut force = vec![Vec3A::ZERO; n];
            let build = it % ph.every == 0;
            let mut m = SymmetricMatrix { diagonal: vec![ph.prox; if build { n } else { 0 }], edges: vec![0.0; if build { topology.edges.len() } else { 0 }] };
            let hits: Vec<_> = (0..n)
                .into_par_iter()
                .with_min_len(128)
                .map(|i| scan.index.closest_oriented(p[i], normals.vertices[i], k2, ph.gate, reach, Some(vhint[i])))
                .collect();
            let mut d1 = 0.0;
            for (i, h) in hits.iter().enumerate() {
                if let Some(h) = h {
                    vhint[i] = h.triangle;
                    if !scan.on_rim(h) {
                        let nn = scan.normal_at(h);
                        let d = h.point - p[i];
                        d1 += d.length();
                        force[i] += nn * nn.dot(d) * ph.plane + d * (1.0 - ph.plane);
                        if build { m.diagonal[i] += 1.0; }
                    }
                }
            }
            let offset = step * ph.samples;
            let matches: Vec<_> = (0..ph.samples)
                .into_par_iter()
                .with_min_len(128)
                .map(|k| {
                    let s = scan.samples[(offset + k) % scan.samples.len()];
                    index.closest_oriented(s.point, s.normal, k2, ph.gate2, ph.reach2 * ph.reach2, None).map(|h| (h, s))
                })
                .collect();
            let per = n as f32 / ph.samples as f32 * ph.back;
            let mut d2 = 0.0;
            for (h, s) in matches.iter().flatten() {
                let d = s.point - h.point;
                d2 += d.length();
                let nn = s.normal;
                let far = (d.length() / ph.far).min(1.0);
                let plane = ph.plane * (1.0 - far);
                let d = nn * nn.dot(d) * plane + d * (1.0 - plane);
                let c = topology.triangles[h.triangle as usize];
                for k in 0..3 {
                    force[c[k] as usize] += d * (h.weights[k] * per);
                    if build {
                        m.diagonal[c[k] as usize] += f64::from(per * h.weights[k] * h.weights[k]);
                        m.edges[te[h.triangle as usize][k] as usize] += f64::from(per * h.weights[k] * h.weights[(k + 1) % 3]);
                    }
                }
            }
            let js = rest.gradients(&p, &f.smooth, &mut buffer);
            let div = rest.divergence(&js);
            let mu = ph.mu as f32;
            for i in 0..n { force[i] += div[i] * mu; }
            for (k, &[a, b]) in topology.edges.iter().enumerate() {
                let v = (p[a as usize] - p[b as usize]) * (mu * rest.weights[k] as f32);
                force[a as usize] -= v;
                force[b as usize] += v;
                if build {
                    let w = ph.mu * rest.weights[k];
                    m.diagonal[a as usize] += w;
                    m.diagonal[b as usize] += w;
                    m.edges[k] -= w;
                }
            }
            let mut dl = 0.0;
            for l in landmarks {
                let c = topology.triangles[l.triangle as usize];
                let now: Vec3A = c.iter().zip(l.weights).map(|(&i, w)| p[i as usize] * w).sum();
                dl += now.distance(l.target);
                for k in 0..3 {
                    force[c[k] as usize] += (l.target - now) * (l.weights[k] * wl as f32);
                    if build {
                        m.diagonal[c[k] as usize] += wl * f64::from(l.weights[k] * l.weights[k]);
                        m.edges[te[l.triangle as usize][k] as usize] += wl * f64::from(l.weights[k] * l.weights[(k + 1) % 3]);
                    }
                }
            }
            if build { system = Some(SparseCholesky::new(topology, &m, &rest.dissection).unwrap()); }
            system.as_ref().unwrap().solve(&mut force, &mut buffer);
            for (p, f) in p.iter_mut().zip(&force) { *p += *f; }
            step += 1;
            if verbose && (it + 1 == ph.iterations || it == 0) {
                println!("mu {} it {it}: t2s {:.5} s2t {:.5} lm {:.5}", ph.mu, d1 / n as f32, d2 / ph.samples as f32, dl / landmarks.len().max(1) as f32);
            }
        }
    }
    p
}

/// Start: the rest shape deformed by the smoothed deformation gradient towards q.
pub fn smooth_start(rest: &Rest, q: &[Vec3A], lambda: f64, keep: f64) -> Vec<Vec3A> {
    let mut buffer = SolveBuffer::default();
    let smooth = rest.smoother(lambda);
    let js = rest.gradients(q, &smooth, &mut buffer);
    let mut b = rest.divergence(&js);
    for (b, q) in b.iter_mut().zip(q) {
        *b += *q * keep as f32;
    }
    rest.factor(1.0, keep, &[], 0.0).solve(&mut b, &mut buffer);
    b
}

fn vertex_areas(topology: &Topology, normals: &Normals) -> Vec<f32> {
    (0..topology.vertex_count()).map(|i| topology.fans.row(i).iter().map(|f| normals.area_vectors[f[0] as usize].length()).sum::<f32>() / 6.0).collect()
}

/// Needed density: per-vertex length scale wanted on the mean (relative).
pub fn wanted_lengths(rest: &Rest, members: &[Vec<Vec3A>], smooth: &SparseCholesky, clip: f32, curve: f32) -> Vec<f32> {
    let topology = &rest.topology;
    let n = rest.positions.len();
    let base = vertex_areas(topology, &Normals::new(topology, &rest.positions));
    let mut wanted = vec![f32::MAX; n];
    let mut buffer = SolveBuffer::default();
    let mut ksum = vec![0f32; n];
    for m in members {
        let normals = Normals::new(topology, m);
        let areas = vertex_areas(topology, &normals);
        let mut ratio: Vec<f32> = areas.iter().zip(&base).map(|(a, b)| a / b.max(1e-12)).collect();
        let mut sorted = ratio.clone();
        sorted.sort_by(f32::total_cmp);
        let median = sorted[n / 2];
        ratio.iter_mut().for_each(|r| *r = (*r / median).clamp(0.01, 100.0).sqrt());
        smooth.solve_scalar(&mut ratio, &mut buffer);
        // curvature of the member: deviation of ring from the tangent plane relative to length
        for i in 0..n {
            let ring = topology.neighbours.row(i);
            let k = ring.iter().map(|&j| { let d = m[j as usize] - m[i]; (d.normalize_or_zero().dot(normals.vertices[i])).abs() }).sum::<f32>() / ring.len() as f32 / areas[i].max(1e-10).sqrt();
            ksum[i] += k * ratio[i];
        }
        for (w, r) in wanted.iter_mut().zip(&ratio) {
            *w = w.min(1.0 / r.max(0.05));
        }
    }
    smooth.solve_scalar(&mut ksum, &mut buffer);
    let mut ks = ksum.clone();
    ks.sort_by(f32::total_cmp);
    let km = ks[n / 2];
    wanted.iter().zip(&ksum).map(|(w, k)| w.clamp(1.0 / clip, 1.0) * (km / k.max(1e-9)).powf(curve).clamp(0.4, 1.6)).collect()
}

/// Slides the mean's vertices along its surface until edge lengths follow `wanted`; returns hits on the old mean.
pub fn relax(rest: &Rest, wanted: &[f32], iterations: usize, verbose: bool) -> Vec<crate::spatial::Hit> {
    let topology = &rest.topology;
    let n = rest.positions.len();
    let index = SurfaceIndex::new(&rest.positions, &topology.triangles);
    let mut p = rest.positions.clone();
    let mut normals = Normals::new(topology, &p);
    let mut hits: Vec<_> = (0..n).map(|i| index.closest(p[i])).collect();
    for it in 0..iterations {
        normals.update(topology, &p);
        let h: Vec<f32> = hits.iter().map(|h| topology.triangles[h.triangle as usize].iter().zip(h.weights).map(|(&i, w)| wanted[i as usize] * w).sum()).collect();
        hits = (0..n).into_par_iter().with_min_len(128).map(|i| {
            let mut sum = Vec3A::ZERO;
            let mut mass = 0.0;
            for &[t, a, b] in topology.fans.row(i) {
                let s = (h[i] + h[a as usize] + h[b as usize]) / 3.0;
                let w = normals.area_vectors[t as usize].length() / s.powi(4);
                sum += (p[i] + p[a as usize] + p[b as usize]) * (w / 3.0);
                mass += w;
            }
            let d = (sum / mass.max(1e-20) - p[i]) * 1.2;
            let nn = normals.vertices[i];
            let q = p[i] + d - nn * nn.dot(d);
            index.closest_oriented(q, nn, 1e-3, 0.0, f32::MAX, Some(hits[i].triangle)).unwrap_or_else(|| index.closest(q))
        }).collect();
        for (p, h) in p.iter_mut().zip(&hits) { *p = h.point; }
        if verbose && (it % 40 == 0 || it + 1 == iterations) {
            let lengths = crate::mesh::mean_edge_lengths(topology, &p);
            let c = lengths.iter().zip(&h).map(|(l, h)| l / h).sum::<f32>() / n as f32;
            let e: f32 = lengths.iter().zip(&h).map(|(l, h)| (l / (h * c) - 1.0).powi(2)).sum::<f32>() / n as f32;
            println!("relax {it} {e:.4}");
        }
    }
    hits
}

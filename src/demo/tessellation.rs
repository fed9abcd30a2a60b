use std::collections::BTreeMap;

use glam::{DQuat, DVec3};

/// A triangulation of a surface that is a smooth map from the unit sphere.
///
/// Its triangles are counter-clockwise on the sphere throughout, so it never folds over itself there.
#[derive(Debug, Clone)]
pub(super) struct Tessellation {
    /// Unit directions of the vertices `[N, 3]`.
    pub directions: Vec<DVec3>,
    /// Positions of the vertices `[N, 3]`.
    pub positions: Vec<DVec3>,
    /// Vertex indices of the triangles `[F, 3]`.
    pub triangles: Vec<[u32; 3]>,
}

/// What is to be triangulated.
pub(super) trait Surface {
    /// The point in a unit direction.
    fn point(&self, direction: DVec3) -> DVec3;
    /// The edge length wanted there.
    fn spacing(&self, direction: DVec3) -> f64;
}

/// Triangulates a surface: divides a turned icosahedron where edges are too long, then flips and relaxes them.
pub(super) fn tessellate(surface: &impl Surface, turn: DQuat) -> Tessellation {
    const FREQUENCY: u32 = 20;
    const DIVISIONS: usize = 8;
    let mut mesh = Tessellation::icosphere(surface, FREQUENCY, turn);
    for _ in 0..DIVISIONS {
        let divided = mesh.divide(surface);
        mesh.improve(surface, 1);
        if divided == 0 {
            break;
        }
    }
    mesh.improve(surface, 4);
    mesh
}

/// An edge and the triangles' corners that face it.
struct Edge {
    ends: [u32; 2],
    /// On the left and on the right: triangle and opposite vertex.
    sides: [(usize, u32); 2],
}

impl Tessellation {
    /// The surface on a geodesic sphere.
    pub fn icosphere(surface: &impl Surface, frequency: u32, turn: DQuat) -> Self {
        let (directions, triangles) = icosphere(frequency);
        let directions: Vec<_> = directions.iter().map(|&d| (turn * d).normalize()).collect();
        let positions = directions.iter().map(|&d| surface.point(d)).collect();
        Self { directions, positions, triangles }
    }

    /// Halves every edge that is too long; returns how many.
    fn divide(&mut self, surface: &impl Surface) -> usize {
        const TOO_LONG: f64 = 1.35;
        let mut middles = BTreeMap::new();
        for edge in self.edges() {
            let [a, b] = edge.ends;
            let direction = self.between(a, b);
            let position = surface.point(direction);
            // The way over the middle: a fold may bring far ends close together.
            let way = self.position(a).distance(position) + position.distance(self.position(b));
            if way > TOO_LONG * surface.spacing(direction) {
                middles.insert(edge.ends, self.directions.len() as u32);
                self.directions.push(direction);
                self.positions.push(position);
            }
        }
        let parts = |&triangle| self.parts(triangle, &middles);
        self.triangles = self.triangles.iter().flat_map(parts).collect();
        middles.len()
    }

    /// A triangle cut at the middles of those of its edges that have one.
    fn parts(&self, triangle: [u32; 3], middles: &BTreeMap<[u32; 2], u32>) -> Vec<[u32; 3]> {
        let turned = |by: usize| [triangle[by], triangle[(by + 1) % 3], triangle[(by + 2) % 3]];
        let middle = |a: u32, b: u32| middles.get(&[a.min(b), a.max(b)]).copied();
        for [a, b, c] in [0, 1, 2].map(turned) {
            match [middle(a, b), middle(b, c), middle(c, a)] {
                [None, None, None] => return vec![triangle],
                [Some(m), None, None] => return vec![[a, m, c], [m, b, c]],
                [Some(m), Some(n), None] => {
                    // Of the two ways to cut the remaining quadrilateral, along its shorter diagonal.
                    let across = self.position(a).distance(self.position(n))
                        < self.position(m).distance(self.position(c));
                    let rest = if across { [[a, m, n], [a, n, c]] } else { [[a, m, c], [m, n, c]] };
                    return vec![[m, b, n], rest[0], rest[1]];
                }
                [Some(m), Some(n), Some(o)] => return vec![[a, m, o], [m, b, n], [n, c, o], [m, n, o]],
                _ => {}
            }
        }
        unreachable!("one of the turns starts with the cut edges")
    }

    /// Flips edges and evens out lengths.
    fn improve(&mut self, surface: &impl Surface, rounds: usize) {
        for _ in 0..rounds {
            for _ in 0..3 {
                self.flip(surface);
            }
            self.relax(surface);
        }
        self.flip(surface);
    }

    /// Flips every edge whose opposite angles say so, no triangle twice.
    fn flip(&mut self, surface: &impl Surface) {
        let mut touched = vec![false; self.triangles.len()];
        for Edge { ends: [a, b], sides: [(left, c), (right, d)] } in self.edges() {
            if !touched[left] && !touched[right] && self.wants_flip(surface, [a, b], [c, d]) {
                self.triangles[left] = [a, d, c];
                self.triangles[right] = [d, b, c];
                [touched[left], touched[right]] = [true; 2];
            }
        }
    }

    fn wants_flip(&self, surface: &impl Surface, [a, b]: [u32; 2], [c, d]: [u32; 2]) -> bool {
        const COARSE: f64 = 0.12;
        let [pa, pb, pc, pd] = [a, b, c, d].map(|i| self.position(i));
        if !self.faces_out([a, d, c]) || !self.faces_out([d, b, c]) {
            return false;
        }
        if cotangent(pc, pa, pb) + cotangent(pd, pa, pb) >= -1e-9 {
            return false;
        }
        let off = |a: u32, b: u32| {
            let [pa, pb] = [a, b].map(|i| self.position(i));
            surface.point(self.between(a, b)).distance((pa + pb) / 2.0)
        };
        // Not across a fold, of which the positions know nothing.
        let new = off(c, d);
        new < COARSE * pc.distance(pd) || new < off(a, b)
    }

    /// Moves every vertex towards the middle of its neighbours, farther ones pulling harder.
    fn relax(&mut self, surface: &impl Surface) {
        const STEP: f64 = 0.6;
        let rings = self.rings();
        for (vertex, ring) in rings.iter().enumerate() {
            let [here, place] = [self.directions[vertex], self.positions[vertex]];
            let (mut pull, mut weights) = (DVec3::ZERO, 0.0);
            for &triangle in ring {
                for corner in
                    self.triangles[triangle].map(|i| i as usize).into_iter().filter(|&i| i != vertex)
                {
                    let weight = place.distance(self.positions[corner]);
                    pull += weight * (self.directions[corner] - here);
                    weights += weight;
                }
            }
            self.move_vertex(surface, vertex, (here + STEP * pull / weights).normalize(), ring);
        }
    }

    /// Moves a vertex on the sphere, unless that would fold one of the triangles around it.
    fn move_vertex(&mut self, surface: &impl Surface, vertex: usize, direction: DVec3, ring: &[usize]) {
        let before = std::mem::replace(&mut self.directions[vertex], direction);
        if ring.iter().all(|&triangle| self.faces_out(self.triangles[triangle])) {
            self.positions[vertex] = surface.point(direction);
        } else {
            self.directions[vertex] = before;
        }
    }

    /// Takes away what lies farther than `angle` radians from the top of the sphere, and leaves an even rim.
    pub fn cut(&mut self, surface: &impl Surface, angle: f64) {
        let rings = self.rings();
        for Edge { ends, .. } in self.edges() {
            let [a, b] = ends.map(|end| level(self.directions[end as usize]) - angle);
            if a * b < 0.0 {
                let nearer = ends[usize::from(b.abs() < a.abs())] as usize;
                self.move_vertex(surface, nearer, at_level(self.directions[nearer], angle), &rings[nearer]);
            }
        }
        let middle = |t: &[u32; 3]| t.iter().map(|&i| level(self.directions[i as usize])).sum::<f64>() / 3.0;
        self.triangles = self.triangles.iter().copied().filter(|triangle| middle(triangle) < angle).collect();
        self.drop_loose_vertices();
    }

    fn drop_loose_vertices(&mut self) {
        let mut used = vec![false; self.directions.len()];
        self.triangles.iter().flatten().for_each(|&i| used[i as usize] = true);
        let mut left = 0;
        let number = |&used: &bool| {
            left += u32::from(used);
            left.wrapping_sub(1)
        };
        let numbers: Vec<u32> = used.iter().map(number).collect();
        self.triangles.iter_mut().flatten().for_each(|i| *i = numbers[*i as usize]);
        let mut keep = used.iter();
        self.directions.retain(|_| *keep.next().expect("one for each"));
        let mut keep = used.iter();
        self.positions.retain(|_| *keep.next().expect("one for each"));
    }

    /// Every edge once, in the order of its ends.
    fn edges(&self) -> Vec<Edge> {
        let mut halves = Vec::with_capacity(self.triangles.len() * 3);
        for (index, &[a, b, c]) in self.triangles.iter().enumerate() {
            for (from, to, opposite) in [(a, b, c), (b, c, a), (c, a, b)] {
                halves.push(([from.min(to), from.max(to)], from > to, index, opposite));
            }
        }
        halves.sort_unstable();
        let edge = |pair: &[([u32; 2], bool, usize, u32)]| Edge {
            ends: pair[0].0,
            sides: [(pair[0].2, pair[0].3), (pair[1].2, pair[1].3)],
        };
        halves.chunks_exact(2).map(edge).collect()
    }

    /// The triangles around each vertex.
    fn rings(&self) -> Vec<Vec<usize>> {
        let mut rings = vec![Vec::with_capacity(7); self.directions.len()];
        for (index, triangle) in self.triangles.iter().enumerate() {
            triangle.iter().for_each(|&i| rings[i as usize].push(index));
        }
        rings
    }

    /// Whether a triangle is counter-clockwise on the sphere, and not too thin there.
    fn faces_out(&self, triangle: [u32; 3]) -> bool {
        let [a, b, c] = triangle.map(|i| self.directions[i as usize]);
        let normal = (b - a).cross(c - a);
        let longest = (b - a).length_squared().max((c - b).length_squared()).max((a - c).length_squared());
        normal.dot(a) > 0.02 * longest
    }

    fn position(&self, vertex: u32) -> DVec3 {
        self.positions[vertex as usize]
    }

    fn between(&self, a: u32, b: u32) -> DVec3 {
        (self.directions[a as usize] + self.directions[b as usize]).normalize()
    }
}

/// Radians from the top of the sphere.
fn level(direction: DVec3) -> f64 {
    direction.x.hypot(direction.z).atan2(direction.y)
}

/// The direction below or above `direction` at `angle` radians from the top of the sphere.
fn at_level(direction: DVec3, angle: f64) -> DVec3 {
    let (out, up) = angle.sin_cos();
    let around = DVec3::new(direction.x, 0.0, direction.z).normalize();
    around * out + DVec3::Y * up
}

/// Cotangent of the angle at `tip` towards `a` and `b`.
fn cotangent(tip: DVec3, a: DVec3, b: DVec3) -> f64 {
    let [a, b] = [a - tip, b - tip];
    a.dot(b) / a.cross(b).length().max(1e-12)
}

/// Directions and triangles of an icosahedron with every edge in `frequency` parts.
pub(super) fn icosphere(frequency: u32) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let golden = (1.0 + 5.0_f64.sqrt()) / 2.0;
    let corner = |index: usize| {
        let [sign, far] = [index & 1, index >> 1 & 1].map(|bit| 1.0 - 2.0 * bit as f64);
        let [x, y] = [sign, far * golden];
        [DVec3::new(x, y, 0.0), DVec3::new(0.0, x, y), DVec3::new(y, 0.0, x)][index >> 2]
    };
    let corners: Vec<_> = (0..12).map(corner).collect();
    let mut grid = Grid { frequency, directions: Vec::new(), known: BTreeMap::new() };
    let mut triangles = Vec::new();
    for a in 0..12 {
        for b in a + 1..12 {
            for c in a + 1..12 {
                let [p, q, r] = [a, b, c].map(|i| corners[i]);
                let near = [p - q, q - r, r - p].iter().all(|side| side.length_squared() < 4.1);
                // Each face once, counter-clockwise.
                if b != c && near && (q - p).cross(r - p).dot(p) > 0.0 {
                    grid.fill([a, b, c], [p, q, r], &mut triangles);
                }
            }
        }
    }
    (grid.directions, triangles)
}

/// The vertices of a divided icosahedron made so far, by what they lie between.
struct Grid {
    frequency: u32,
    directions: Vec<DVec3>,
    known: BTreeMap<Vec<(usize, u32)>, u32>,
}

impl Grid {
    fn fill(&mut self, ids: [usize; 3], corners: [DVec3; 3], triangles: &mut Vec<[u32; 3]>) {
        for i in 0..self.frequency {
            for j in 0..self.frequency - i {
                let [a, b, c] = [(i, j), (i + 1, j), (i, j + 1)].map(|at| self.vertex(ids, corners, at));
                triangles.push([a, b, c]);
                if i + j + 1 < self.frequency {
                    let d = self.vertex(ids, corners, (i + 1, j + 1));
                    triangles.push([b, d, c]);
                }
            }
        }
    }

    fn vertex(&mut self, ids: [usize; 3], corners: [DVec3; 3], (i, j): (u32, u32)) -> u32 {
        let parts = [self.frequency - i - j, i, j];
        let mut name: Vec<_> = ids.into_iter().zip(parts).filter(|&(_, part)| part > 0).collect();
        name.sort_unstable();
        *self.known.entry(name).or_insert_with(|| {
            let place: DVec3 =
                corners.iter().zip(parts).map(|(&corner, part)| corner * f64::from(part)).sum();
            self.directions.push(place.normalize());
            self.directions.len() as u32 - 1
        })
    }
}

use glam::{Vec3A, Vec4};

use super::boxes::{Bounds, Boxes};
use super::lanes::Lanes;
use super::packet::Packet;
use super::search::{Best, Waiting};
use super::tree::{Child, Target, Tree};
use super::triangle::{TrianglePoint, closest_on_triangle};

/// The nearest point of a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// The triangle it lies on.
    pub triangle: u32,
    /// Barycentric weights of the triangle's corners, as in [`TrianglePoint::weights`].
    pub weights: [f32; 3],
    /// The point itself.
    pub point: Vec3A,
    /// Its squared distance from the query.
    pub distance_squared: f32,
}

impl Hit {
    pub(super) fn new(triangle: u32, on: TrianglePoint) -> Self {
        let TrianglePoint { weights, point, distance_squared } = on;
        Self { triangle, weights, point, distance_squared }
    }
}

/// Exact nearest points on a set of triangles: a four-wide bounding volume hierarchy over packets of four triangles.
///
/// Positions are f32 in unit space; degenerate triangles count as their edges. Where several triangles are equally
/// near, which one is found depends on the input alone.
#[derive(Debug, Clone)]
pub struct SurfaceIndex {
    triangles: Vec<[u32; 3]>,
    /// For each triangle, four times its packet plus its lane.
    slots: Vec<u32>,
    packets: Vec<Packet>,
    /// Children of each node, nodes before their children.
    children: Vec<[Child; 4]>,
    /// The boxes of each node's children.
    boxes: Vec<Boxes>,
    /// The boxes of the unit normals under each node's children.
    normal_boxes: Vec<Boxes>,
}

impl SurfaceIndex {
    /// Builds the index of `triangles` `[F, 3]` on `positions` `[N]`.
    ///
    /// # Panics
    /// Without triangles, or with indices out of range.
    pub fn new(positions: &[Vec3A], triangles: &[[u32; 3]]) -> Self {
        assert!(!triangles.is_empty(), "a surface index needs a triangle");
        let Tree { nodes, packets } = Tree::new(positions, triangles);
        let mut slots = vec![0; triangles.len()];
        for (packet, Packet { triangles, .. }) in packets.iter().enumerate() {
            for lane in (0..4).rev() {
                slots[triangles[lane] as usize] = (4 * packet + lane) as u32;
            }
        }
        let boxes = vec![Boxes::empty(); nodes.len()];
        let normal_boxes = boxes.clone();
        let mut index =
            Self { triangles: triangles.to_vec(), slots, packets, children: nodes, boxes, normal_boxes };
        index.refit(positions);
        index
    }

    /// Moves the same triangles to other positions `[N]`, without rebuilding: answers stay exact, and become slower
    /// only if triangles that were close together part.
    ///
    /// # Panics
    /// With fewer positions than the triangles name.
    pub fn refit(&mut self, positions: &[Vec3A]) {
        for node in (0..self.children.len()).rev() {
            for lane in 0..4 {
                let child = self.children[node][lane];
                if child == Child::NONE {
                    continue;
                }
                let (extent, normals) = self.refit_child(child, positions);
                self.boxes[node].set(lane, extent);
                self.normal_boxes[node].set(lane, normals);
            }
        }
    }

    #[inline]
    fn refit_child(&mut self, child: Child, positions: &[Vec3A]) -> (Bounds, Bounds) {
        match child.target() {
            Target::Packet(packet) => self.packets[packet].place(positions, &self.triangles),
            Target::Node(node) => (self.boxes[node].union(), self.normal_boxes[node].union()),
        }
    }

    /// The triangles `[F, 3]`.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// The unit normal of a triangle, or zero if it is degenerate.
    pub fn triangle_normal(&self, triangle: u32) -> Vec3A {
        let (packet, lane) = self.place_of(triangle);
        packet.normal(lane)
    }

    /// The nearest point of one triangle.
    pub fn closest_on(&self, p: Vec3A, triangle: u32) -> Hit {
        let (packet, lane) = self.place_of(triangle);
        Hit::new(triangle, closest_on_triangle(p, packet.corners(lane)))
    }

    /// The nearest point of the surface.
    pub fn closest(&self, p: Vec3A) -> Hit {
        let best = self.nearest(p, Best { triangle: None, cost: f32::INFINITY });
        self.closest_on(p, best.triangle.unwrap_or(0))
    }

    /// The nearest point of the surface within a squared distance of `bound`, or else the nearest point of the
    /// triangle `hint`; the better the two are, the fewer triangles are visited.
    pub fn closest_below(&self, p: Vec3A, bound: f32, hint: u32) -> Hit {
        let near = self.closest_on(p, hint);
        let best = self.nearest(p, Best { triangle: None, cost: near.distance_squared.min(bound) });
        best.triangle.map_or(near, |triangle| self.closest_on(p, triangle))
    }

    fn nearest(&self, p: Vec3A, mut best: Best) -> Best {
        let p = Lanes::splat(p);
        let boxes = |node: usize| self.boxes[node].distance_squared(p);
        let packet = |packet: &Packet| packet.distance_squared(p);
        self.search(Child::ROOT, &boxes, &packet, &mut best);
        best
    }

    /// The point that minimises `|p - q|^2 + normal_weight |n - n_t|^2` over the triangles within a squared distance
    /// of `bound` whose unit normal has `n . n_t > min_cosine`; `None` if there are none.
    ///
    /// `n` is a unit vector. The distance reported is `|p - q|^2` alone. A degenerate triangle counts as standing
    /// square to every normal. A good `hint` spares visits, and wins where others are only as good.
    pub fn closest_oriented(
        &self,
        p: Vec3A,
        n: Vec3A,
        normal_weight: f32,
        min_cosine: f32,
        bound: f32,
        hint: Option<u32>,
    ) -> Option<Hit> {
        let query = Oriented::new(p, n, normal_weight, min_cosine, bound);
        let mut best = Best { triangle: None, cost: f32::INFINITY };
        if let Some(hint) = hint {
            let (packet, lane) = self.place_of(hint);
            let cost = query.packet_cost(packet)[lane];
            best = Best { triangle: (cost < f32::INFINITY).then_some(hint), cost };
        }
        let boxes = |node: usize| query.box_cost(&self.boxes[node], &self.normal_boxes[node]);
        self.search(Child::ROOT, &boxes, &|packet| query.packet_cost(packet), &mut best);
        best.triangle.map(|triangle| self.closest_on(p, triangle))
    }

    #[inline]
    fn place_of(&self, triangle: u32) -> (&Packet, usize) {
        let slot = self.slots[triangle as usize] as usize;
        (&self.packets[slot / 4], slot % 4)
    }

    /// Visits, nearest first, what may cost less than the best so far: `boxes` bounds the costs under a node's
    /// children from below, `packet` gives those of triangles.
    fn search<B, P>(&self, from: Child, boxes: &B, packet: &P, best: &mut Best)
    where
        B: Fn(usize) -> Vec4,
        P: Fn(&Packet) -> Vec4,
    {
        let mut waiting = Waiting::new(from);
        while let Some(child) = waiting.next_below(best.cost) {
            match child.target() {
                Target::Packet(at) => {
                    let members = &self.packets[at];
                    best.improve(packet(members), &members.triangles);
                }
                Target::Node(node) if waiting.has_room() => {
                    waiting.add_below(best.cost, boxes(node), &self.children[node]);
                }
                Target::Node(node) => {
                    for &child in self.children[node].iter().filter(|&&child| child != Child::NONE) {
                        self.search(child, boxes, packet, best);
                    }
                }
            }
        }
    }
}

/// A search in position and normal together; every field holds the same in all lanes.
pub(super) struct Oriented {
    p: Lanes,
    n: Lanes,
    normal_weight: Vec4,
    min_cosine: Vec4,
    bound: Vec4,
}

impl Oriented {
    #[inline]
    pub fn new(p: Vec3A, n: Vec3A, normal_weight: f32, min_cosine: f32, bound: f32) -> Self {
        Self {
            p: Lanes::splat(p),
            n: Lanes::splat(n),
            normal_weight: Vec4::splat(normal_weight),
            min_cosine: Vec4::splat(min_cosine),
            bound: Vec4::splat(bound),
        }
    }

    /// Costs of four triangles, infinite for those that do not qualify.
    #[inline]
    pub fn packet_cost(&self, packet: &Packet) -> Vec4 {
        let distance = packet.distance_squared(self.p);
        let cosine = packet.cosine(self.n);
        let qualifies = distance.cmple(self.bound) & cosine.cmpgt(self.min_cosine);
        let cost = distance + self.normal_weight * (2.0 - 2.0 * cosine);
        Vec4::select(qualifies, cost, Vec4::INFINITY)
    }

    /// Least costs under four children, infinite where nothing can qualify.
    #[inline]
    fn box_cost(&self, boxes: &Boxes, normal_boxes: &Boxes) -> Vec4 {
        let distance = boxes.distance_squared(self.p);
        let turn = normal_boxes.distance_squared(self.n);
        let qualifies = distance.cmple(self.bound) & turn.cmple(2.0 - 2.0 * self.min_cosine);
        Vec4::select(qualifies, distance + self.normal_weight * turn, Vec4::INFINITY)
    }
}

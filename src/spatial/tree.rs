use glam::Vec3A;
use obvhs::aabb::Aabb;
use obvhs::bvh2::{Bvh2, reinsertion::ReinsertionOptimizer};
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};
use rayon::prelude::*;

use super::packet::Packet;

/// Most triangles in a packet and most children of a node.
const WIDTH: usize = 4;
const PACKET: u32 = 1 << 31;
/// More triangles than these are parted into quarters, whose trees are built side by side.
const LARGE: usize = 1 << 18;

/// What a node of the tree points at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Child(u32);

/// A [`Child`] taken apart.
pub(super) enum Target {
    Node(usize),
    Packet(usize),
}

impl Child {
    /// A place with nothing in it.
    pub const NONE: Self = Self(u32::MAX);
    pub const ROOT: Self = Self(0);

    /// The same child of a tree that comes after so many nodes and packets.
    fn after(self, nodes: u32, packets: u32) -> Self {
        match self {
            Self::NONE => Self::NONE,
            Self(packet) if packet & PACKET != 0 => Self(packet + packets),
            Self(node) => Self(node + nodes),
        }
    }

    #[inline]
    pub fn target(self) -> Target {
        if self.0 & PACKET == 0 {
            Target::Node(self.0 as usize)
        } else {
            Target::Packet((self.0 ^ PACKET) as usize)
        }
    }
}

/// The shape of a four-wide bounding volume hierarchy: which triangles share a packet, which children a node.
///
/// Nodes stand before their children; the first is the root.
pub(super) struct Tree {
    pub nodes: Vec<[Child; WIDTH]>,
    pub packets: Vec<Packet>,
}

impl Tree {
    /// Groups triangles that lie close together.
    pub fn new(positions: &[Vec3A], triangles: &[[u32; 3]]) -> Self {
        let corners = |t: &[u32; 3]| t.map(|v| positions[v as usize]);
        let boxes: Vec<Aabb> = triangles.par_iter().map(|t| Aabb::from_points(&corners(t))).collect();
        Self::over(&boxes, &mut (0..triangles.len() as u32).collect::<Vec<u32>>())
    }

    /// Over some of the triangles with these boxes.
    fn over(boxes: &[Aabb], members: &mut [u32]) -> Self {
        if members.len() <= LARGE {
            return Self::grouped(&Binary::new(boxes, members));
        }
        let (left, right) = halves(boxes, members);
        let (left, right) = rayon::join(|| halves(boxes, left), || halves(boxes, right));
        let quarters = [left.0, left.1, right.0, right.1];
        Self::joined(
            &quarters.into_par_iter().map(|quarter| Self::over(boxes, quarter)).collect::<Vec<Self>>(),
        )
    }

    fn grouped(binary: &Binary) -> Self {
        // Packets are large: to move them as their number grows would take as long as to make them.
        let packets = Vec::with_capacity(binary.packets);
        let mut tree = Self { nodes: Vec::with_capacity(binary.packets / 2), packets };
        if binary.is_packet(0) {
            // A root that is a node spares the queries a special case.
            let packet = tree.add_packet(binary, 0);
            tree.nodes.push([packet, Child::NONE, Child::NONE, Child::NONE]);
        } else {
            tree.add_node(binary, 0);
        }
        tree
    }

    /// A tree of at most four.
    fn joined(parts: &[Self]) -> Self {
        let [nodes, packets] = [|part: &Self| part.nodes.len(), |part: &Self| part.packets.len()]
            .map(|count| parts.iter().map(count).sum::<usize>());
        let mut whole = Self { nodes: Vec::with_capacity(nodes + 1), packets: Vec::with_capacity(packets) };
        whole.nodes.push([Child::NONE; WIDTH]);
        for (lane, part) in parts.iter().enumerate() {
            let (node, packet) = (whole.nodes.len() as u32, whole.packets.len() as u32);
            whole.nodes[0][lane] = Child::ROOT.after(node, packet);
            let children = part.nodes.iter().map(|children| children.map(|child| child.after(node, packet)));
            whole.nodes.extend(children);
            whole.packets.extend_from_slice(&part.packets);
        }
        whole
    }

    fn add(&mut self, binary: &Binary, at: usize) -> Child {
        if binary.is_packet(at) { self.add_packet(binary, at) } else { self.add_node(binary, at) }
    }

    fn add_packet(&mut self, binary: &Binary, at: usize) -> Child {
        let (mut members, mut count) = ([0; WIDTH], 0);
        binary.collect_members(at, &mut members, &mut count);
        self.packets.push(Packet::of(&members[..count]));
        Child(PACKET | (self.packets.len() - 1) as u32)
    }

    fn add_node(&mut self, binary: &Binary, at: usize) -> Child {
        let node = self.nodes.len();
        self.nodes.push([Child::NONE; WIDTH]);
        let (members, count) = binary.widened(at);
        for (lane, &child) in members[..count].iter().enumerate() {
            self.nodes[node][lane] = self.add(binary, child);
        }
        Child(node as u32)
    }
}

/// Parts triangles at the median of their boxes' centres along the longest side of the box of these.
fn halves<'a>(boxes: &[Aabb], members: &'a mut [u32]) -> (&'a mut [u32], &'a mut [u32]) {
    let centre = |member: u32| boxes[member as usize].center();
    let mut extent = Aabb::empty();
    for &member in &*members {
        extent.extend(centre(member));
    }
    let axis = extent.largest_axis();
    let order = |a: &u32, b: &u32| centre(*a)[axis].total_cmp(&centre(*b)[axis]).then(a.cmp(b));
    let middle = members.len() / 2;
    members.select_nth_unstable_by(middle, order);
    members.split_at_mut(middle)
}

/// A binary hierarchy with one of the `members` in each leaf.
struct Binary<'a> {
    tree: Bvh2,
    members: &'a [u32],
    /// Number of triangles under each node.
    sizes: Vec<u32>,
    /// Number of packets that hold them.
    packets: usize,
}

impl<'a> Binary<'a> {
    fn new(boxes: &[Aabb], members: &'a [u32]) -> Self {
        let boxes: Vec<Aabb> = members.iter().map(|&member| boxes[member as usize]).collect();
        let order = (0..boxes.len() as u32).collect();
        let mut tree =
            PlocBuilder::new().build(PlocSearchDistance::Medium, &boxes, order, SortPrecision::U64, 3);
        ReinsertionOptimizer::default().run(&mut tree, 0.05, None);
        let sizes = vec![1; tree.nodes.len()];
        let mut binary = Self { tree, members, sizes, packets: 0 };
        binary.packets = binary.count(0);
        binary
    }

    /// Fills in the sizes of a node and of all below it; returns how many packets hold them.
    fn count(&mut self, at: usize) -> usize {
        let node = &self.tree.nodes[at];
        if node.is_leaf() {
            return 1;
        }
        let left = node.first_index as usize;
        let packets = self.count(left) + self.count(left + 1);
        self.sizes[at] = self.sizes[left] + self.sizes[left + 1];
        if self.is_packet(at) { 1 } else { packets }
    }

    fn is_packet(&self, at: usize) -> bool {
        self.sizes[at] as usize <= WIDTH
    }

    fn collect_members(&self, at: usize, members: &mut [u32; WIDTH], count: &mut usize) {
        let node = &self.tree.nodes[at];
        let first = node.first_index as usize;
        if node.is_leaf() {
            members[*count] = self.members[self.tree.primitive_indices[first] as usize];
            *count += 1;
        } else {
            self.collect_members(first, members, count);
            self.collect_members(first + 1, members, count);
        }
    }

    /// Up to four descendants that stand for a node, and how many: the largest box is opened until there are enough.
    fn widened(&self, at: usize) -> ([usize; WIDTH], usize) {
        let first = self.tree.nodes[at].first_index as usize;
        let (mut members, mut count) = ([first, first + 1, 0, 0], 2);
        while count < WIDTH {
            let openable = |&lane: &usize| !self.is_packet(members[lane]);
            let area = |lane: usize| self.tree.nodes[members[lane]].aabb().half_area();
            let Some(largest) = (0..count).filter(openable).max_by(|&a, &b| area(a).total_cmp(&area(b)))
            else {
                break;
            };
            let first = self.tree.nodes[members[largest]].first_index as usize;
            members.copy_within(largest + 1..count, largest);
            members[count - 1..=count].copy_from_slice(&[first, first + 1]);
            count += 1;
        }
        (members, count)
    }
}

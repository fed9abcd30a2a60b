use glam::Vec3A;
use obvhs::aabb::Aabb;
use obvhs::bvh2::{Bvh2, reinsertion::ReinsertionOptimizer};
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};

use super::packet::Packet;

/// Most triangles in a packet and most children of a node.
const WIDTH: usize = 4;
const PACKET: u32 = 1 << 31;

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
        let binary = binary_tree(positions, triangles);
        let sizes = subtree_sizes(&binary);
        let mut tree = Self { nodes: Vec::new(), packets: Vec::new() };
        if sizes[0] as usize <= WIDTH {
            // A root that is a node spares the queries a special case.
            let packet = tree.add_packet(&binary, 0);
            tree.nodes.push([packet, Child::NONE, Child::NONE, Child::NONE]);
        } else {
            tree.add_node(&binary, &sizes, 0);
        }
        tree
    }

    fn add(&mut self, binary: &Bvh2, sizes: &[u32], at: usize) -> Child {
        if sizes[at] as usize <= WIDTH {
            self.add_packet(binary, at)
        } else {
            self.add_node(binary, sizes, at)
        }
    }

    fn add_packet(&mut self, binary: &Bvh2, at: usize) -> Child {
        let mut members = Vec::with_capacity(WIDTH);
        collect_members(binary, at, &mut members);
        self.packets.push(Packet::of(&members));
        Child(PACKET | (self.packets.len() - 1) as u32)
    }

    fn add_node(&mut self, binary: &Bvh2, sizes: &[u32], at: usize) -> Child {
        let node = self.nodes.len();
        self.nodes.push([Child::NONE; WIDTH]);
        for (lane, child) in widened(binary, sizes, at).into_iter().enumerate() {
            self.nodes[node][lane] = self.add(binary, sizes, child);
        }
        Child(node as u32)
    }
}

/// A binary hierarchy with one triangle in each leaf.
fn binary_tree(positions: &[Vec3A], triangles: &[[u32; 3]]) -> Bvh2 {
    let boxes: Vec<Aabb> =
        triangles.iter().map(|t| Aabb::from_points(&t.map(|v| positions[v as usize]))).collect();
    let order = (0..triangles.len() as u32).collect();
    let mut binary =
        PlocBuilder::new().build(PlocSearchDistance::Medium, &boxes, order, SortPrecision::U64, 3);
    ReinsertionOptimizer::default().run(&mut binary, 0.05, None);
    binary.reorder_in_stack_traversal_order();
    binary
}

/// Number of triangles under each node of a hierarchy whose nodes stand before their children.
fn subtree_sizes(binary: &Bvh2) -> Vec<u32> {
    let mut sizes = vec![1; binary.nodes.len()];
    for (at, node) in binary.nodes.iter().enumerate().rev() {
        if !node.is_leaf() {
            let left = node.first_index as usize;
            sizes[at] = sizes[left] + sizes[left + 1];
        }
    }
    sizes
}

fn collect_members(binary: &Bvh2, at: usize, members: &mut Vec<u32>) {
    let node = &binary.nodes[at];
    let first = node.first_index as usize;
    if node.is_leaf() {
        members.push(binary.primitive_indices[first]);
    } else {
        collect_members(binary, first, members);
        collect_members(binary, first + 1, members);
    }
}

/// Up to four descendants that stand for a node: the largest box is opened until there are enough.
fn widened(binary: &Bvh2, sizes: &[u32], at: usize) -> Vec<usize> {
    let first = binary.nodes[at].first_index as usize;
    let mut members = vec![first, first + 1];
    while members.len() < WIDTH {
        let openable = |&at: &usize| sizes[at] as usize > WIDTH;
        let area = |&at: &usize| binary.nodes[at].aabb().half_area();
        let Some(largest) =
            members.iter().copied().filter(openable).max_by(|a, b| area(a).total_cmp(&area(b)))
        else {
            break;
        };
        let first = binary.nodes[largest].first_index as usize;
        members.retain(|&m| m != largest);
        members.extend([first, first + 1]);
    }
    members
}

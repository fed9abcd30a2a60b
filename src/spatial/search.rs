use glam::Vec4;

use super::tree::Child;

/// Children that can wait at a time; searches of meshes rarely have 30.
const ROOM: usize = 64;

/// The best triangle a search has met.
pub(super) struct Best {
    pub triangle: Option<u32>,
    pub cost: f32,
}

impl Best {
    /// Takes the first cheapest of four triangles if it costs less.
    #[inline]
    pub fn improve(&mut self, costs: Vec4, triangles: &[u32; 4]) {
        if !costs.cmplt(Vec4::splat(self.cost)).any() {
            return;
        }
        for (&triangle, cost) in triangles.iter().zip(costs.to_array()) {
            if cost < self.cost {
                *self = Self { triangle: Some(triangle), cost };
            }
        }
    }
}

/// What a search has still to visit, each with a lower bound of the costs under it: siblings by falling cost, the
/// latest on top.
pub(super) struct Waiting {
    children: [(f32, Child); ROOM],
    count: usize,
}

impl Waiting {
    /// Waits for one child alone.
    #[inline]
    pub fn new(first: Child) -> Self {
        Self { children: [(f32::NEG_INFINITY, first); ROOM], count: 1 }
    }

    /// Whether four more can wait.
    #[inline]
    pub fn has_room(&self) -> bool {
        self.count + 4 <= ROOM
    }

    /// Adds those of four siblings that may cost less than `limit`.
    #[inline]
    pub fn add_below(&mut self, limit: f32, costs: Vec4, siblings: &[Child; 4]) {
        let oldest = self.count;
        let mut promising = costs.cmplt(Vec4::splat(limit)).bitmask();
        let costs = costs.to_array();
        while promising != 0 {
            let lane = promising.trailing_zeros() as usize;
            promising &= promising - 1;
            let mut at = self.count;
            while at > oldest && self.children[at - 1].0 < costs[lane] {
                self.children[at] = self.children[at - 1];
                at -= 1;
            }
            self.children[at] = (costs[lane], siblings[lane]);
            self.count += 1;
        }
    }

    /// Takes the latest that may cost less than `limit`; drops those on the way.
    #[inline]
    pub fn next_below(&mut self, limit: f32) -> Option<Child> {
        while self.count > 0 {
            self.count -= 1;
            let (cost, child) = self.children[self.count];
            if cost < limit {
                return Some(child);
            }
        }
        None
    }
}

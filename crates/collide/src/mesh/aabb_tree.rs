//! A binary tree of boxes around triangles (BVH), used for closest points, winding numbers and
//! crossings.

use crate::{Aabb, Vec3};

/// Maximum number of triangles of a leaf.
const MAX_LEAF_TRIANGLES: usize = 4;

/// The tree, in pre-order.
#[derive(Clone, Debug)]
pub(crate) struct AabbTree {
    pub nodes: Vec<AabbNode>,
    /// The triangles in leaf order.
    pub ids: Vec<u32>,
}

/// One box.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AabbNode {
    pub bounds: Aabb,
    /// Leaf: a range of `ids`. Inner node (`count` is 0): the left child is the next node, the
    /// right one is `second`.
    pub first: u32,
    pub count: u32,
    pub second: u32,
}

impl AabbNode {
    /// Returns the range of a leaf; empty for an inner node.
    pub fn range(&self) -> std::ops::Range<usize> {
        self.first as usize..(self.first + self.count) as usize
    }
}

impl AabbTree {
    /// Builds the tree of at least one triangle. Nodes are halved along the longest side, so the
    /// depth is at most 32.
    pub fn new(corners: &[[Vec3; 3]]) -> AabbTree {
        let mut items: Vec<(Vec3, u32)> =
            corners.iter().enumerate().map(|(t, c)| (c.iter().sum::<Vec3>() / 3.0, t as u32)).collect();
        let mut nodes = Vec::new();
        split(corners, &mut items, 0, &mut nodes);
        AabbTree { nodes, ids: items.iter().map(|i| i.1).collect() }
    }
}

fn split(corners: &[[Vec3; 3]], items: &mut [(Vec3, u32)], first: usize, nodes: &mut Vec<AabbNode>) {
    let bounds = Aabb::around(items.iter().flat_map(|i| corners[i.1 as usize]));
    let index = nodes.len();
    nodes.push(AabbNode { bounds, first: first as u32, count: items.len() as u32, second: 0 });
    if items.len() <= MAX_LEAF_TRIANGLES {
        return;
    }
    let axis = (bounds.max - bounds.min).imax();
    let half = items.len() / 2;
    items.select_nth_unstable_by(half, |a, b| a.0[axis].total_cmp(&b.0[axis]).then(a.1.cmp(&b.1)));
    let (left, right) = items.split_at_mut(half);
    split(corners, left, first, nodes);
    nodes[index].count = 0;
    nodes[index].second = nodes.len() as u32;
    split(corners, right, first + half, nodes);
}

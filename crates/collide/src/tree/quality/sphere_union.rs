//! A union of spheres for point queries: a binary tree over the centers. Each node stores the box
//! of its centers and the largest radius. The distance of `p` from a sphere of the node is at least
//! `distance(p, box) − r_max`.

use crate::{Aabb, Vec3};

/// Maximum number of spheres of a leaf.
const MAX_LEAF_SPHERES: usize = 4;

/// A union of spheres.
pub(super) struct SphereUnion {
    spheres: Vec<(Vec3, f64)>,
    nodes: Vec<Node>,
}

struct Node {
    centers: Aabb,
    largest: f64,
    /// Leaf: range of spheres. Inner node (`count` 0): the left child is the next node, the right
    /// one is `second`.
    first: usize,
    count: usize,
    second: usize,
}

impl SphereUnion {
    /// Builds the union of at least one sphere, from centers and radii.
    pub fn new(mut spheres: Vec<(Vec3, f64)>) -> SphereUnion {
        let mut nodes = Vec::new();
        split(&mut spheres, 0, &mut nodes);
        SphereUnion { spheres, nodes }
    }

    /// Returns the minimum of `|p − c| − r` over the spheres: below 0 inside the union.
    pub fn distance(&self, p: &Vec3) -> f64 {
        let mut best = f64::INFINITY;
        self.search(0, p, &mut best);
        best
    }

    /// Returns whether some sphere contains `p` more than `depth` below its surface.
    pub fn contains(&self, p: &Vec3, depth: f64) -> bool {
        self.any_contains(0, p, depth)
    }

    fn search(&self, node: usize, p: &Vec3, best: &mut f64) {
        let here = &self.nodes[node];
        if here.count > 0 {
            let nearest = self.of_leaf(here).map(|(c, r)| (p - c).norm() - r).fold(f64::INFINITY, f64::min);
            *best = best.min(nearest);
            return;
        }
        let mut children = [node + 1, here.second].map(|c| (self.nodes[c].bound(p), c));
        if children[1].0 < children[0].0 {
            children.swap(0, 1);
        }
        for (bound, child) in children {
            if bound < *best {
                self.search(child, p, best);
            }
        }
    }

    fn any_contains(&self, node: usize, p: &Vec3, depth: f64) -> bool {
        let here = &self.nodes[node];
        if here.bound(p) >= -depth {
            return false;
        }
        if here.count > 0 {
            return self.of_leaf(here).any(|(c, r)| (p - c).norm() - r < -depth);
        }
        self.any_contains(node + 1, p, depth) || self.any_contains(here.second, p, depth)
    }

    fn of_leaf(&self, leaf: &Node) -> impl Iterator<Item = &(Vec3, f64)> {
        self.spheres[leaf.first..leaf.first + leaf.count].iter()
    }
}

impl Node {
    fn bound(&self, p: &Vec3) -> f64 {
        (p - p.sup(&self.centers.min).inf(&self.centers.max)).norm() - self.largest
    }
}

/// Builds nodes in pre-order, halved along the longest side of the box of the centers; the depth is
/// at most 64.
fn split(spheres: &mut [(Vec3, f64)], first: usize, nodes: &mut Vec<Node>) {
    let centers = Aabb::around(spheres.iter().map(|b| b.0));
    let largest = spheres.iter().map(|b| b.1).fold(0.0, f64::max);
    let index = nodes.len();
    nodes.push(Node { centers, largest, first, count: spheres.len(), second: 0 });
    if spheres.len() <= MAX_LEAF_SPHERES {
        return;
    }
    let axis = (centers.max - centers.min).imax();
    let half = spheres.len() / 2;
    spheres.select_nth_unstable_by(half, |a, b| a.0[axis].total_cmp(&b.0[axis]).then(a.1.total_cmp(&b.1)));
    let (left, right) = spheres.split_at_mut(half);
    split(left, first, nodes);
    nodes[index].count = 0;
    nodes[index].second = nodes.len();
    split(right, first + half, nodes);
}

//! A union of balls made ready for questions about points: a binary tree over the centres, each node with the box of its centres and its
//! greatest radius. A ball of the node is no nearer to `p` than `distance(p, box) − r_max`.

use crate::{Aabb, Vec3};

/// Balls per leaf.
const LEAF: usize = 4;

/// The union.
pub(super) struct BallUnion {
    balls: Vec<(Vec3, f64)>,
    nodes: Vec<Node>,
}

struct Node {
    centers: Aabb,
    largest: f64,
    /// Leaf: range of balls. Inner (`count` 0): the left child is the next node, the right one is `second`.
    first: usize,
    count: usize,
    second: usize,
}

impl BallUnion {
    /// Of at least one ball: centres and radii.
    pub fn new(mut balls: Vec<(Vec3, f64)>) -> BallUnion {
        let mut nodes = Vec::new();
        split(&mut balls, 0, &mut nodes);
        BallUnion { balls, nodes }
    }

    /// Least `|p − c| − r` over the balls: below 0 inside the union.
    pub fn distance(&self, p: &Vec3) -> f64 {
        let mut best = f64::INFINITY;
        self.search(0, p, &mut best);
        best
    }

    /// Whether some ball holds `p` more than `depth` below its surface.
    pub fn holds(&self, p: &Vec3, depth: f64) -> bool {
        self.any(0, p, depth)
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

    fn any(&self, node: usize, p: &Vec3, depth: f64) -> bool {
        let here = &self.nodes[node];
        if here.bound(p) >= -depth {
            return false;
        }
        if here.count > 0 {
            return self.of_leaf(here).any(|(c, r)| (p - c).norm() - r < -depth);
        }
        self.any(node + 1, p, depth) || self.any(here.second, p, depth)
    }

    fn of_leaf(&self, leaf: &Node) -> impl Iterator<Item = &(Vec3, f64)> {
        self.balls[leaf.first..leaf.first + leaf.count].iter()
    }
}

impl Node {
    fn bound(&self, p: &Vec3) -> f64 {
        (p - p.sup(&self.centers.min).inf(&self.centers.max)).norm() - self.largest
    }
}

/// Pre-order, halved along the longest side of the centres' box; depth at most 64 by halving.
fn split(balls: &mut [(Vec3, f64)], first: usize, nodes: &mut Vec<Node>) {
    let centers = Aabb::around(balls.iter().map(|b| b.0));
    let largest = balls.iter().map(|b| b.1).fold(0.0, f64::max);
    let index = nodes.len();
    nodes.push(Node { centers, largest, first, count: balls.len(), second: 0 });
    if balls.len() <= LEAF {
        return;
    }
    let axis = (centers.max - centers.min).imax();
    let half = balls.len() / 2;
    balls.select_nth_unstable_by(half, |a, b| a.0[axis].total_cmp(&b.0[axis]).then(a.1.total_cmp(&b.1)));
    let (left, right) = balls.split_at_mut(half);
    split(left, first, nodes);
    nodes[index].count = 0;
    nodes[index].second = nodes.len();
    split(right, first + half, nodes);
}

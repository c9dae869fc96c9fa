//! The hierarchy of groups: vertices with their edges, in bounding spheres.
//!
//! A vertex is stored with one leaf of the sphere tree that contains it. The vertices of a leaf are
//! halved into groups of a few. Every tree node and group has a bounding sphere of its own content.

use super::{Elements, Group, MAX_CHILDREN, Point};
use crate::tree::around_points;
use crate::{Aabb, SphereTree, Vec3};

/// A [`Group`] under construction, in pre-order; `end` is the end of its descendants.
struct GroupDraft {
    group: Group,
    end: usize,
}

/// Maximum number of vertices of a group without children.
const MAX_GROUP_POINTS: usize = 4;
/// Factor that rounds up to single precision.
const ROUND_UP: f64 = 1.0 + 1e-6;

impl Elements {
    /// Groups the vertices by the nodes of the sphere tree, and reorders them.
    pub(super) fn build_groups(&mut self, tree: &SphereTree) {
        let mut points: Vec<(u32, Point)> =
            std::mem::take(&mut self.points).into_iter().map(|p| (holding_node(tree, &p.at), p)).collect();
        points.sort_by_key(|p| (p.0, p.1.index));
        let held: Vec<[usize; 2]> = (0..tree.nodes().len() as u32)
            .map(|node| [node, node + 1].map(|n| points.partition_point(|p| p.0 < n)))
            .collect();
        let mut points: Vec<Point> = points.into_iter().map(|p| p.1).collect();
        let mut drafts = Vec::new();
        self.gather(tree, 0, &held, &mut points, &mut drafts);
        self.points = points;
        if let Some(first) = drafts.first() {
            self.groups.push(first.group);
            self.store_children(&drafts, 0, 0);
        }
    }

    /// Appends the groups of a tree node and its children; nothing if they are empty. `held` are
    /// ranges in `points`, per node.
    fn gather(
        &mut self,
        tree: &SphereTree,
        node: usize,
        held: &[[usize; 2]],
        points: &mut [Point],
        out: &mut Vec<GroupDraft>,
    ) {
        let mut below = Vec::new();
        let mut stack = vec![node];
        while let Some(n) = stack.pop() {
            below.push(held[n]);
            stack.extend(tree.nodes()[n].child_range());
        }
        let [first, last] = held[node];
        if below.iter().all(|[a, b]| a == b) {
            return;
        }
        if tree.nodes()[node].is_leaf() {
            return self.halve(points, first, last, out);
        }
        let group = self.group(points, &below, out);
        if first < last {
            self.halve(points, first, last, out);
        }
        for child in tree.nodes()[node].child_range() {
            self.gather(tree, child, held, points, out);
        }
        out[group].end = out.len();
    }

    /// Appends the groups of a range of vertices, which are reordered.
    fn halve(&mut self, points: &mut [Point], first: usize, last: usize, out: &mut Vec<GroupDraft>) {
        let group = self.group(points, &[[first, last]], out);
        if last - first <= MAX_GROUP_POINTS {
            let held = &mut out[group].group;
            (held.first, held.count, held.has_children) = (first as u32, (last - first) as u32, false);
        } else {
            let range = &mut points[first..last];
            let bounds = Aabb::around(range.iter().map(|p| p.at));
            let axis = (bounds.max - bounds.min).imax();
            let half = range.len() / 2;
            range.select_nth_unstable_by(half, |a, b| a.at[axis].total_cmp(&b.at[axis]).then(a.index.cmp(&b.index)));
            self.halve(points, first, first + half, out);
            self.halve(points, first + half, last, out);
        }
        out[group].end = out.len();
    }

    /// Appends a group around ranges of vertices. Returns its index.
    fn group(&mut self, points: &[Point], ranges: &[[usize; 2]], out: &mut Vec<GroupDraft>) -> usize {
        let all = &*self;
        let held = || ranges.iter().flat_map(|[a, b]| &points[*a..*b]);
        let ends = |fine: bool| held().flat_map(move |p| all.edges_of(p, fine).iter().map(|e| e.ends[1]).chain([p.at]));
        let middle = around_points(&ends(false).collect::<Vec<_>>()).center;
        let center: [f32; 3] = std::array::from_fn(|k| middle[k] as f32);
        let from = Vec3::from(center.map(f64::from));
        let reach =
            [false, true].map(|fine| (ends(fine).map(|p| (p - from).norm()).fold(0.0, f64::max) * ROUND_UP) as f32);
        out.push(GroupDraft { group: Group { center, reach, first: 0, count: 0, has_children: true }, end: 0 });
        out.len() - 1
    }

    /// Stores the children of a group adjacently, then theirs. Children with few children are
    /// replaced by them.
    fn store_children(&mut self, drafts: &[GroupDraft], from: usize, to: usize) {
        if !drafts[from].group.has_children {
            return;
        }
        let children = children_of(drafts, from);
        let first = self.groups.len();
        (self.groups[to].first, self.groups[to].count) = (first as u32, children.len() as u32);
        self.groups.extend(children.iter().map(|&n| drafts[n].group));
        for (n, &child) in children.iter().enumerate() {
            self.store_children(drafts, child, first + n);
        }
    }
}

/// Returns the children of a group; while there are few, the widest is replaced by its own
/// children.
fn children_of(drafts: &[GroupDraft], group: usize) -> Vec<usize> {
    let direct = |group: usize| -> Vec<usize> {
        std::iter::successors(Some(group + 1), |n| Some(drafts[*n].end).filter(|n| *n < drafts[group].end)).collect()
    };
    let mut children = direct(group);
    loop {
        let wider = |n: &usize| {
            children
                .iter()
                .filter(|m| drafts[**m].group.has_children)
                .all(|m| drafts[*m].group.reach[0] <= drafts[children[*n]].group.reach[0])
        };
        let Some(widest) = (0..children.len()).filter(|n| drafts[children[*n]].group.has_children).find(wider) else {
            return children;
        };
        let own = direct(children[widest]);
        if children.len() + own.len() - 1 > MAX_CHILDREN {
            return children;
        }
        children.splice(widest..=widest, own);
    }
}

/// Returns the smallest sphere, found top-down, that contains `p`; the root if rounding leaves
/// none.
fn holding_node(tree: &SphereTree, p: &Vec3) -> u32 {
    let nodes = tree.nodes();
    let holds = |n: usize| (p - nodes[n].center).norm() <= nodes[n].radius * (1.0 + 1e-9);
    let (mut best, mut stack) = (0, vec![0]);
    while let Some(n) = stack.pop() {
        if n > 0 && !holds(n) {
            continue;
        }
        let better = n > 0 && (nodes[n].level, -nodes[n].radius) > (nodes[best].level, -nodes[best].radius);
        if better {
            best = n;
        }
        stack.extend(nodes[n].child_range());
    }
    best as u32
}

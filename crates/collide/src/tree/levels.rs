//! A tree as a list of levels, each of which represents the solid: the form of tree files and of
//! the quality report.

use super::SphereTree;
use crate::Vec3;

/// One sphere of a level. A leaf above the level is repeated in it, as its own parent, once per
/// level.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LevelSphere {
    /// Mesh frame, meters.
    pub center: Vec3,
    /// Meters.
    pub radius: f64,
    /// Index into the level above; `None` in the first level.
    pub parent: Option<usize>,
    /// Index into [`SphereTree::nodes`].
    pub node: usize,
}

impl LevelSphere {
    /// Returns a sphere without a parent that belongs to no tree.
    pub fn new(center: Vec3, radius: f64) -> LevelSphere {
        LevelSphere { center, radius, parent: None, node: 0 }
    }
}

impl SphereTree {
    /// Returns the spheres of [`SphereTree::at_level`] for every level, starting at the root, with
    /// their parents. Spheres are ordered by parent, so the children of one sphere are adjacent.
    pub fn level_lists(&self) -> Vec<Vec<LevelSphere>> {
        let sphere = |node: usize, parent| LevelSphere {
            center: self.nodes[node].center,
            radius: self.nodes[node].radius,
            parent,
            node,
        };
        let mut lists = vec![vec![sphere(0, None)]];
        for _ in 1..self.levels() {
            let above = &lists[lists.len() - 1];
            let below = above.iter().enumerate().flat_map(|(parent, b)| {
                let leaf = self.nodes[b.node].is_leaf();
                let nodes = if leaf { b.node..b.node + 1 } else { self.nodes[b.node].child_range() };
                nodes.map(move |node| (node, parent))
            });
            let below = below.map(|(node, parent)| sphere(node, Some(parent))).collect();
            lists.push(below);
        }
        lists
    }
}

//! Binary encoding of a tree, for the cache of shapes.

use super::{SphereNode, SphereTree};
use crate::bytes::{Reader, Write};

/// Maximum number of levels of a tree that is read.
const MAX_LEVELS: u32 = 64;

impl SphereTree {
    pub(crate) fn write(&self, to: &mut Vec<u8>) {
        to.list(&self.nodes, |to, node| {
            to.vector(&node.center);
            to.number(node.radius);
            to.number(node.outward);
            to.u32(node.children);
        });
    }

    /// Returns `None` unless the bytes are a tree of nested spheres.
    pub(crate) fn read(from: &mut Reader) -> Option<SphereTree> {
        let mut nodes = from.list(read_node)?;
        // breadth first: the children of each node follow those of the node before it
        let mut next = 1.min(nodes.len());
        for n in 0..nodes.len() {
            let first = if nodes[n].children == 0 { 0 } else { next as u32 };
            let level = nodes[n].level + 1;
            let end = next + nodes[n].children as usize;
            if (nodes[n].children > 0 && next <= n) || level > MAX_LEVELS {
                return None;
            }
            nodes[n].first_child = first;
            nodes.get_mut(next..end)?.iter_mut().for_each(|child| child.level = level);
            next = end;
        }
        if nodes.is_empty() || next != nodes.len() {
            return None;
        }
        let tree = SphereTree::of_nodes(nodes);
        tree.check_nesting().is_ok().then_some(tree)
    }
}

fn read_node(from: &mut Reader) -> Option<SphereNode> {
    let (center, radius, outward) = (from.vector()?, from.number()?, from.number()?);
    let node = SphereNode { center, radius, outward, first_child: 0, children: from.u32()?, level: 0 };
    (radius >= 0.0).then_some(node)
}

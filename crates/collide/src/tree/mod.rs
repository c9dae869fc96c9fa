//! Sphere trees: a closed surface inside nested balls.
//!
//! Two promises are checked on every build and are an error if broken: every ball contains the balls of its children,
//! and the leaves cover the surface. A third number is stated: how far the balls reach beyond the solid.
//!
//! **Outward error.** A ball `(c, r)` whose centre lies `d` below the surface reaches at most `r − d` beyond it: on
//! the way from `c` to any outside point of the ball the surface is crossed, at `d` or later (`d` is negative for a
//! centre outside).
//!
//! Two trees whose balls are `g` apart have solids that are between `g` and `g + e₁ + e₂` apart, `e` their outward
//! errors: no contact is missed, and none is invented beyond `e₁ + e₂`.

mod ball;
mod builder;
mod bytes;
mod cache;
mod close;
mod covering;
mod cut;
mod enclose;
mod file;
mod grid;
mod hubbard;
mod levels;
mod medial;
mod octree;
mod quality;
mod regions;
mod settings;
mod simplex;
mod table;
mod verify;

pub use builder::{Progress, StageCount};
pub use cache::CachedTree;
pub use covering::Covering;
pub use cut::grow_to_cover;
pub use file::{MeshId, TreeFile, TreeFileError};
pub use levels::LevelBall;
pub use quality::{LevelQuality, QualitySettings};
pub use settings::{Builder, TreeSettings};
pub use table::align_columns;

use crate::{Aabb, MeshDistance, MeshError, TriMesh, Vec3};
use ball::Ball;
pub(crate) use ball::around_points;
use builder::{Cell, Job, TreeBuilder, go_on};

/// One ball of a tree, in the mesh's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SphereNode {
    /// Metres.
    pub center: Vec3,
    /// Metres.
    pub radius: f64,
    /// Upper bound of how far the ball reaches outside the solid, metres.
    pub outward: f64,
    /// Index of the first child; children are neighbours.
    pub first_child: u32,
    /// Number of children; 0 for a leaf.
    pub children: u32,
    /// 0 for the root.
    pub level: u32,
}

impl SphereNode {
    /// Whether the ball has no children.
    pub fn is_leaf(&self) -> bool {
        self.children == 0
    }

    /// Indices of the children.
    pub fn child_range(&self) -> std::ops::Range<usize> {
        self.first_child as usize..(self.first_child + self.children) as usize
    }
}

/// A tree of balls around a closed surface; flat, breadth first, the root first.
#[derive(Clone, Debug, PartialEq)]
pub struct SphereTree {
    nodes: Vec<SphereNode>,
    bounds: Aabb,
}

impl SphereTree {
    /// Builds and verifies a tree around a closed, outward-wound mesh (see [`TriMesh::check_closed`]).
    pub fn build(mesh: &TriMesh, settings: &TreeSettings) -> Result<SphereTree, MeshError> {
        Ok(SphereTree::build_watched(mesh, settings, &())?.0)
    }

    /// The same, told how far it is, and with what each stage did.
    pub fn build_watched(
        mesh: &TriMesh,
        settings: &TreeSettings,
        progress: &dyn Progress,
    ) -> Result<(SphereTree, Vec<StageCount>), MeshError> {
        settings.check()?;
        mesh.check_data()?;
        SphereTree::build_by(mesh, &MeshDistance::new(mesh), settings, progress)
    }

    /// The same of a mesh whose distance is there already.
    pub(crate) fn build_by(
        mesh: &TriMesh,
        distance: &MeshDistance,
        settings: &TreeSettings,
        progress: &dyn Progress,
    ) -> Result<(SphereTree, Vec<StageCount>), MeshError> {
        settings.check()?;
        let builder: &dyn TreeBuilder = match settings.builder {
            Builder::Octree => &octree::Octree,
            Builder::Medial => &medial::Medial,
            Builder::Hubbard => &hubbard::Hubbard,
            Builder::Grid => &grid::Grid,
        };
        go_on(progress)?;
        let built = builder.build(&Job { mesh, distance, settings, progress })?;
        go_on(progress)?;
        let tree = SphereTree::flatten(&built.root, distance, settings.builder != Builder::Octree, progress);
        go_on(progress)?;
        tree.check_nesting()?;
        tree.check_coverage_watched(mesh, progress)?;
        progress.at(1.0);
        Ok((tree, built.stages))
    }

    /// One ball around all vertices of a mesh whose data is right.
    pub(crate) fn ball(mesh: &TriMesh) -> SphereTree {
        let ball = around_points(&mesh.vertices);
        // no point of the ball is further from the surface than its other end
        let node = SphereNode { center: ball.center, radius: ball.radius, outward: 2.0 * ball.radius, ..empty_node(0) };
        SphereTree::of_nodes(vec![node])
    }

    /// All balls, breadth first; the root is the first.
    pub fn nodes(&self) -> &[SphereNode] {
        &self.nodes
    }

    /// The balls that have no children.
    pub fn leaves(&self) -> impl Iterator<Item = &SphereNode> {
        self.nodes.iter().filter(|n| n.is_leaf())
    }

    /// Number of levels; the root alone is one.
    pub fn levels(&self) -> u32 {
        self.nodes.last().map_or(0, |n| n.level + 1)
    }

    /// The balls that stand for the solid when looked at to `level`: those of that level and the leaves above it.
    pub fn at_level(&self, level: u32) -> impl Iterator<Item = &SphereNode> {
        self.nodes.iter().filter(move |n| n.level == level || (n.level < level && n.is_leaf()))
    }

    /// Upper bound of how far the leaves reach outside the solid, metres.
    pub fn outward_error(&self) -> f64 {
        self.leaves().map(|n| n.outward).fold(0.0, f64::max)
    }

    /// The same for [`SphereTree::at_level`].
    pub fn outward_error_at(&self, level: u32) -> f64 {
        self.at_level(level).map(|n| n.outward).fold(0.0, f64::max)
    }

    /// Box around all leaves, in the mesh's frame.
    pub fn bounds(&self) -> &Aabb {
        &self.bounds
    }

    /// Breadth first, so that children are neighbours; a cell with one child is replaced by it.
    fn flatten(root: &Cell, distance: &MeshDistance, deep: bool, progress: &dyn Progress) -> SphereTree {
        let mut nodes = vec![empty_node(0)];
        let mut cells = vec![skip_single(root)];
        let mut next = 0;
        while next < cells.len() {
            if let Cell::Inner(children) = cells[next] {
                nodes[next].first_child = cells.len() as u32;
                nodes[next].children = children.len() as u32;
                let level = nodes[next].level + 1;
                cells.extend(children.iter().map(skip_single));
                nodes.resize(cells.len(), empty_node(level));
            }
            next += 1;
        }
        for n in (0..nodes.len()).rev().take_while(|_| !progress.stopped()) {
            let ball = match cells[n] {
                Cell::Leaf(ball) => *ball,
                Cell::Inner(_) => {
                    let children: Vec<Ball> = nodes[nodes[n].child_range()]
                        .iter()
                        .map(|c| Ball { center: c.center, radius: c.radius })
                        .collect();
                    if deep { ball::deep_around(&children, distance) } else { enclose::smallest_around(&children) }
                }
            };
            nodes[n].center = ball.center;
            nodes[n].radius = ball.radius;
            nodes[n].outward = ball.outward(distance);
        }
        SphereTree::of_nodes(nodes)
    }

    /// Of nodes that are already a tree: breadth first, children neighbours.
    fn of_nodes(nodes: Vec<SphereNode>) -> SphereTree {
        let leaf_boxes = nodes
            .iter()
            .filter(|n| n.is_leaf())
            .flat_map(|n| [n.center.add_scalar(-n.radius), n.center.add_scalar(n.radius)]);
        SphereTree { bounds: Aabb::around(leaf_boxes), nodes }
    }
}

fn empty_node(level: u32) -> SphereNode {
    SphereNode { center: Vec3::zeros(), radius: 0.0, outward: 0.0, first_child: 0, children: 0, level }
}

fn skip_single(cell: &Cell) -> &Cell {
    match cell {
        Cell::Inner(children) if children.len() == 1 => skip_single(&children[0]),
        other => other,
    }
}

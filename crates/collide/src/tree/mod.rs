//! Sphere trees: nested spheres around a closed surface.
//!
//! Every build verifies two guarantees and fails if one is broken: every sphere contains the
//! spheres of its children, and the leaves cover the surface. It also states how far the spheres
//! extend beyond the solid.
//!
//! **Outward error.** A sphere `(c, r)` whose center lies `d` below the surface extends at most `r
//! − d` beyond the surface. The segment from `c` to any outside point of the sphere crosses the
//! surface at distance `d` or later (`d` is negative for a center outside).
//!
//! If the spheres of two trees are `g` apart, their solids are between `g` and `g + e₁ + e₂` apart,
//! where `e` are the outward errors. So no contact is missed, and contacts are invented by at most
//! `e₁ + e₂`.

mod builder;
mod bytes;
mod cache;
mod covering;
mod enclose;
mod file;
mod grid;
mod grow_to_cover;
mod hubbard;
mod levels;
mod medial;
mod nelder_mead;
mod octree;
mod quality;
mod regions;
mod select;
mod settings;
mod sphere;
mod table;
mod verify;

pub use builder::{Progress, StageCount};
pub use cache::CachedTree;
pub use covering::{CoveredShape, Covering, CoveringSphere, SurfacePiece};
pub use file::{MeshId, TreeFile, TreeFileError};
pub use levels::LevelSphere;
pub use quality::{LevelQuality, QualitySettings, SolidSamples};
pub use select::grow_to_cover;
pub use settings::{Builder, TreeSettings};
pub use table::align_columns;

use crate::{Aabb, MeshDistance, MeshError, TriMesh, Vec3};
use builder::{Cell, Job, TreeBuilder, check_stopped};
use rayon::prelude::*;
use sphere::Sphere;
pub(crate) use sphere::around_points;

/// One sphere of a tree, in the frame of the mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SphereNode {
    /// Meters.
    pub center: Vec3,
    /// Meters.
    pub radius: f64,
    /// Upper bound of how far the sphere extends outside the solid, meters.
    pub outward: f64,
    /// Index of the first child. Children are adjacent.
    pub first_child: u32,
    /// Number of children; 0 for a leaf.
    pub children: u32,
    /// 0 for the root.
    pub level: u32,
}

impl SphereNode {
    /// Returns whether the sphere has no children.
    pub fn is_leaf(&self) -> bool {
        self.children == 0
    }

    /// Returns the indices of the children.
    pub fn child_range(&self) -> std::ops::Range<usize> {
        self.first_child as usize..(self.first_child + self.children) as usize
    }
}

/// A tree of spheres around a closed surface: a flat array, breadth first, root first.
#[derive(Clone, Debug, PartialEq)]
pub struct SphereTree {
    nodes: Vec<SphereNode>,
    bounds: Aabb,
}

impl SphereTree {
    /// Builds and verifies a tree around a closed, outward-wound mesh (see
    /// [`TriMesh::check_closed`]).
    ///
    /// # Errors
    /// [`MeshError`] for settings out of range, invalid mesh data, and a tree that breaks a
    /// guarantee.
    pub fn build(mesh: &TriMesh, settings: &TreeSettings) -> Result<SphereTree, MeshError> {
        Ok(SphereTree::build_with_progress(mesh, settings, &())?.0)
    }

    /// Like [`SphereTree::build`], with progress reports. Also returns the counts of each stage.
    ///
    /// # Errors
    /// As [`SphereTree::build`]; [`MeshError::Stopped`] if `progress` requests it.
    pub fn build_with_progress(
        mesh: &TriMesh,
        settings: &TreeSettings,
        progress: &dyn Progress,
    ) -> Result<(SphereTree, Vec<StageCount>), MeshError> {
        settings.check()?;
        mesh.check_data()?;
        SphereTree::build_by(mesh, &MeshDistance::new(mesh), settings, progress)
    }

    /// Builds a tree with a distance that was computed before.
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
        check_stopped(progress)?;
        let built = builder.build(&Job { mesh, distance, settings, progress })?;
        check_stopped(progress)?;
        let tree = SphereTree::flatten(&built.root, distance, settings.builder != Builder::Octree, progress);
        check_stopped(progress)?;
        tree.check_nesting()?;
        tree.check_coverage_watched(mesh, progress)?;
        progress.report(1.0);
        Ok((tree, built.stages))
    }

    /// Returns a tree of one sphere around all vertices of a mesh with valid data.
    pub(crate) fn bounding_sphere(mesh: &TriMesh) -> SphereTree {
        let sphere = around_points(&mesh.vertices);
        // no point of the sphere is further from the surface than its diameter
        let node =
            SphereNode { center: sphere.center, radius: sphere.radius, outward: 2.0 * sphere.radius, ..empty_node(0) };
        SphereTree::of_nodes(vec![node])
    }

    /// Returns all spheres, breadth first, root first.
    pub fn nodes(&self) -> &[SphereNode] {
        &self.nodes
    }

    /// Returns the spheres without children.
    pub fn leaves(&self) -> impl Iterator<Item = &SphereNode> {
        self.nodes.iter().filter(|n| n.is_leaf())
    }

    /// Returns the number of levels; a root without children is one level.
    pub fn levels(&self) -> u32 {
        self.nodes.last().map_or(0, |n| n.level + 1)
    }

    /// Returns the spheres that represent the solid at `level`: those of that level and the leaves
    /// above it.
    pub fn at_level(&self, level: u32) -> impl Iterator<Item = &SphereNode> {
        self.nodes.iter().filter(move |n| n.level == level || (n.level < level && n.is_leaf()))
    }

    /// Returns an upper bound of how far the leaves extend outside the solid, meters.
    pub fn outward_error(&self) -> f64 {
        self.leaves().map(|n| n.outward).fold(0.0, f64::max)
    }

    /// Returns the same bound for the spheres of [`SphereTree::at_level`].
    pub fn outward_error_at(&self, level: u32) -> f64 {
        self.at_level(level).map(|n| n.outward).fold(0.0, f64::max)
    }

    /// Returns the box around all leaves, in the frame of the mesh.
    pub fn bounds(&self) -> &Aabb {
        &self.bounds
    }

    /// Stores the cells breadth first, so that children are adjacent. A cell with one child is
    /// replaced by that child.
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
        let outward = leaf_errors(&cells, distance, progress);
        for n in (0..nodes.len()).rev().take_while(|_| !progress.stopped()) {
            let sphere = match cells[n] {
                Cell::Leaf(sphere) => *sphere,
                Cell::Inner(_) => {
                    let children: Vec<Sphere> = nodes[nodes[n].child_range()]
                        .iter()
                        .map(|c| Sphere { center: c.center, radius: c.radius })
                        .collect();
                    if deep {
                        sphere::min_outward_enclosing(&children, distance)
                    } else {
                        enclose::smallest_around(&children)
                    }
                }
            };
            nodes[n].center = sphere.center;
            nodes[n].radius = sphere.radius;
            nodes[n].outward = outward[n].unwrap_or_else(|| sphere.outward(distance));
        }
        SphereTree::of_nodes(nodes)
    }

    /// Makes a tree of nodes that are in tree order: breadth first, children adjacent.
    fn of_nodes(nodes: Vec<SphereNode>) -> SphereTree {
        let leaf_boxes = nodes
            .iter()
            .filter(|n| n.is_leaf())
            .flat_map(|n| [n.center.add_scalar(-n.radius), n.center.add_scalar(n.radius)]);
        SphereTree { bounds: Aabb::around(leaf_boxes), nodes }
    }
}

/// Returns how far each leaf extends outside the solid, meters; `None` for other cells, and if the build is stopped.
fn leaf_errors(cells: &[&Cell], distance: &MeshDistance, progress: &dyn Progress) -> Vec<Option<f64>> {
    let outward = |cell: &&Cell| match cell {
        Cell::Leaf(sphere) if !progress.stopped() => Some(sphere.outward(distance)),
        _ => None,
    };
    cells.par_iter().map(outward).collect()
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

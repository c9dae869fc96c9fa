//! What the `surface` contact mode knows of a solid: its *elements* (points, edges, rims) and its signed *field*.
//!
//! Every contact is an element of one body against the field of the other:
//!
//! ```text
//! d_B(p)   signed distance of p from B's surface, negative inside, exact
//! gap      min over the elements x of A of d_B(x), and the other way round
//! ```
//!
//! Two triangle surfaces are closest at a vertex of one or at an edge of each; if they cross, an edge of one goes
//! through a face of the other. So vertices and edges of both bodies find every contact, and no point inside a face
//! needs to be sampled. An edge is searched for the least `d_B` along it (`narrow/surface/line.rs`). Of a finely
//! triangulated smooth surface only vertices are tested: see [`elements::Elements`] for the error that this leaves.

pub(crate) mod elements;
pub(crate) mod field;
pub(crate) mod primitive;
pub(crate) mod shells;

use crate::bytes::{Reader, Write};
use crate::mesh::edge_groups;
use crate::{SphereTree, TriMesh, Vec3};
use elements::{Elements, Group};
use field::{MeshField, is_convex};

/// Elements and field of a mesh; in the mesh's frame. What takes long to make can be kept ([`Surface::write`]).
#[derive(Clone, Debug)]
pub(crate) struct Surface {
    pub elements: Elements,
    pub field: MeshField,
}

impl Surface {
    /// Of a closed, outward-wound mesh and the tree around it.
    pub fn new(mesh: &TriMesh, tree: &SphereTree) -> Surface {
        let mesh = mesh.in_morton_order();
        let edges = edge_groups(&mesh);
        let (elements, searched) = Elements::new(&mesh, &edges, tree);
        let convex = is_convex(&mesh, &edges);
        Surface { elements, field: MeshField::new(mesh, &edges, searched, convex) }
    }

    /// The mesh in its order, how its points are grouped, and whether it is convex.
    pub fn write(&self, to: &mut Vec<u8>) {
        self.field.mesh().write(to);
        to.list(&self.elements.points, |to, point| to.u32(point.index));
        to.list(&self.elements.groups, |to, group| group.write(to));
        to.flag(self.field.is_convex());
    }

    pub fn read(from: &mut Reader) -> Option<Surface> {
        let mesh = TriMesh::read(from)?;
        let (order, groups) = (from.list(Reader::u32)?, from.list(Group::read)?);
        let convex = from.flag()?;
        let edges = edge_groups(&mesh);
        let (elements, searched) = Elements::from_groups(&mesh, &edges, &order, groups)?;
        Some(Surface { elements, field: MeshField::new(mesh, &edges, searched, convex) })
    }
}

/// Which feature of a body's surface is closest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Feature {
    /// A flat face.
    Face,
    /// A straight edge, or a curved surface around a straight axis, along this direction.
    Line(Vec3),
    /// An edge (its direction) that is itself among the body's elements.
    Edge(Vec3),
    /// A corner, or a surface around a point.
    Point,
}

/// What a field says of a point; in the field's frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Hit {
    /// Signed distance of the point from the part of the surface that is meant, meters: how deep it is below one that it faces, where another is nearer.
    pub distance: f64,
    /// Signed distance of the point from the whole surface, meters.
    pub nearest: f64,
    /// Outward unit normal: from the surface to the point, or back if it is inside.
    pub normal: Vec3,
    /// From the surface back along the normal to the core that carries it: a radius, or 0.
    pub core: f64,
    pub feature: Feature,
    /// Whether an element with the normals asked for can meet this part of the surface.
    pub facing: bool,
}

/// A normal of an element and one of the surface that it meets are at least this cosine apart from perpendicular: about 1°.
const FACING: f64 = 0.02;

/// Whether an element with these outward normals can touch a surface whose outward normal is `normal`: the corner of
/// a block on another of the same size meets its top and not its side. An element without normals (a core) meets all.
pub(crate) fn facing(normals: &[Vec3], normal: &Vec3) -> bool {
    normals.is_empty() || normals.iter().any(|n| n.dot(normal) < -FACING)
}

/// How squarely: the least cosine; less is better.
pub(crate) fn opposition(normals: &[Vec3], normal: &Vec3) -> f64 {
    normals.iter().map(|n| n.dot(normal)).fold(0.0, f64::min)
}

/// How far beside a face a corner still counts as above it, as a part of the body's size.
pub(crate) const OVERHANG: f64 = 1e-4;
/// The same for a place on an edge: rounding.
pub(crate) const TOUCHING: f64 = 1e-6;

/// Signed distance of a solid.
pub(crate) trait DistanceField {
    /// At most the signed distance at `p`; cheap.
    fn bound(&self, p: &Vec3) -> f64;
    /// The closest part of the surface that an element with `normals` can meet (`facing`), or the closest of all where
    /// there is none such.
    ///
    /// A point this far beside a face (`beside`, as a part of the body's size) still counts as above or below it: what stands flush with an
    /// edge keeps its contacts while it trembles.
    fn hit(&self, p: &Vec3, normals: &[Vec3], beside: f64) -> Hit;
    /// Whether the solid is convex, and so its signed distance a convex function.
    fn is_convex(&self) -> bool;
    /// Whether the surface is round about an axis, which has no edges to meet another axis with.
    fn is_round(&self) -> bool {
        false
    }
    /// Whether the surface is bent and its own elements do not find every edge that comes near it.
    fn is_curved(&self) -> bool {
        false
    }
    /// Whether the signed distance is linear: only points count.
    fn is_linear(&self) -> bool {
        false
    }
}

//! Data of the `surface` contact mode: the *elements* of a solid (points, edges, rims) and its
//! signed distance *field*.
//!
//! Every contact is an element of one body against the field of the other:
//!
//! ```text
//! d_B(p)   signed distance of p from B's surface, negative inside, exact
//! gap      min over the elements x of A of d_B(x), and vice versa
//! ```
//!
//! Two triangle surfaces are closest at a vertex of one or at an edge of each. If they cross, an
//! edge of one passes through a face of the other. So vertices and edges of both bodies find every
//! contact, and points inside faces need not be sampled. An edge is searched for the minimum of
//! `d_B` along it (`narrow/sdf_contact/line.rs`). On a finely triangulated smooth surface only
//! vertices are tested: see [`elements::Elements`] for the error.

pub(crate) mod curved;
pub(crate) mod elements;
pub(crate) mod field;
pub(crate) mod primitive;
pub(crate) mod shells;

use crate::bytes::{Reader, Write};
use crate::mesh::edge_groups;
use crate::{SphereTree, TriMesh, Vec3};
use elements::{Elements, Group};
use field::{MeshField, is_convex};

/// Elements and field of a mesh, in the mesh's frame. The parts that are slow to build can be
/// stored ([`Surface::write`]).
#[derive(Clone, Debug)]
pub(crate) struct Surface {
    pub elements: Elements,
    pub field: MeshField,
}

impl Surface {
    /// Builds the data of a closed, outward-wound mesh and its tree.
    pub fn new(mesh: &TriMesh, tree: &SphereTree) -> Surface {
        let mesh = mesh.in_morton_order();
        let edges = edge_groups(&mesh);
        let (elements, searched) = Elements::new(&mesh, &edges, tree);
        let convex = is_convex(&mesh, &edges);
        Surface { elements, field: MeshField::new(mesh, &edges, searched, convex) }
    }

    /// Writes the mesh in its order, the groups of its points, and whether it is convex.
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

/// The closest feature of a body's surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Feature {
    /// A flat face.
    Face,
    /// A straight edge, or a curved surface around a straight axis, along this direction.
    Line(Vec3),
    /// An edge among the body's elements, along this direction.
    Edge(Vec3),
    /// A corner, or a surface around a point.
    Point,
}

/// The result of a field query, in the field's frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Hit {
    /// Signed distance of the point from the matched part of the surface, meters. If another part
    /// is nearer, it is the depth below the part that the element faces.
    pub distance: f64,
    /// Signed distance of the point from the whole surface, meters.
    pub nearest: f64,
    /// Outward unit normal: from the surface to the point, or back if it is inside.
    pub normal: Vec3,
    /// Distance from the surface back along the normal to its core feature, meters, at least 0: the
    /// radius of a sphere, capsule or cylinder's side, 0 for a face, edge or corner. It becomes
    /// [`Contact::core_b`](crate::Contact::core_b) if the field is B's.
    pub core: f64,
    pub feature: Feature,
    /// Whether an element with the given normals can touch this part of the surface.
    pub facing: bool,
}

/// Smallest cosine between the negative normal of an element and the normal of a surface that it
/// can touch: about 1° from perpendicular.
pub(crate) const FACING: f64 = 0.02;

/// Returns whether an element with these outward normals can touch a surface with outward normal
/// `normal`. Example: the corner of a box on another box of the same size touches its top, not its
/// side. An element without normals (a core) touches all.
pub(crate) fn facing(normals: &[Vec3], normal: &Vec3) -> bool {
    normals.is_empty() || normals.iter().any(|n| n.dot(normal) < -FACING)
}

/// Returns the smallest cosine between the normals; less means more opposite.
pub(crate) fn opposition(normals: &[Vec3], normal: &Vec3) -> f64 {
    normals.iter().map(|n| n.dot(normal)).fold(0.0, f64::min)
}

/// Distance beside a face up to which a corner is treated as above it, as a fraction of the body's
/// size.
pub(crate) const OVERHANG: f64 = 1e-4;
/// The same distance for a place on an edge: rounding.
pub(crate) const TOUCHING: f64 = 1e-6;

/// Signed distance field of a solid, in the solid's own frame, meters: negative inside.
///
/// The provided methods describe the surface, so that queries can skip work. A polyhedron keeps
/// their answers; overrides are `RoundField` (sphere, capsule), `CylinderField` and
/// `HalfSpaceField`.
pub(crate) trait DistanceField {
    /// Returns a lower bound of the signed distance at `p`, meters; cheaper than
    /// [`hit`](Self::hit).
    fn bound(&self, p: &Vec3) -> f64;
    /// Returns the closest part of the surface that an element with `normals` can touch (`facing`),
    /// or the closest of all if there is none.
    ///
    /// A point up to `beside` (as a fraction of the body's size) beside a face is treated as above
    /// or below it. So a body that is flush with an edge keeps its contacts under small motions.
    fn hit(&self, p: &Vec3, normals: &[Vec3], beside: f64) -> Hit;
    /// Returns whether the solid is convex, which makes its signed distance a convex function.
    fn is_convex(&self) -> bool;
    /// Returns whether the surface is round about its local z axis, or about its center: sphere,
    /// capsule, cylinder.
    ///
    /// True has three effects. The axis of a cylinder is tested against this field as an edge with
    /// the cylinder's radius: two round sides have no edges that could find each other. Searches
    /// along an edge do not use the closed form for the distance from a straight edge or a corner.
    /// Directions of separation are refined numerically, since a round surface has no finite set of
    /// normals.
    ///
    /// Override it for a solid whose sides are curved and belong to no straight edge or corner.
    fn is_round(&self) -> bool {
        false
    }
    /// Returns whether the surface falls away from a tangent line, by `L²/8R` over a length `L`,
    /// and has no elements of its own that find the edges near it: the side of a cylinder.
    ///
    /// If true, all edges of a mesh are tested against this field, also those that its vertices
    /// replace elsewhere (see [`elements`]), and all its faces in deep overlaps. A sphere and a
    /// capsule answer false although they are curved: their core point and axis are elements, and
    /// find the edges of the mesh.
    fn is_curved(&self) -> bool {
        false
    }
    /// Returns whether searches end where the slope vanishes, and not already at a distance: on a surface
    /// that curves gently, places far apart have nearly the same distance.
    fn is_smooth(&self) -> bool {
        false
    }
    /// Returns whether the signed distance is a linear function of the point: a half-space. Then
    /// the points of the other body find all contacts, and its edges, axes and faces are not
    /// tested.
    fn is_linear(&self) -> bool {
        false
    }
}

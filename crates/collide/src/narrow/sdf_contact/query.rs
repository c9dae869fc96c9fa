//! The elements of one body against the field of the other: finds the elements within the margin
//! and their contacts.

use super::super::reduce::Collector;
use super::line_parts::Parts;
use super::support_plane::SupportPlane;
use super::tolerances::{FLAT_SLOPE, LEVEL_SLOPE, SLOPE_ROUNDING};
use super::{Body, BodyElements};
use crate::sdf::elements::{Edge, Elements, Group, MAX_CHILDREN, Point, Row};
use crate::sdf::field::{FrameMap, MeshField};
use crate::sdf::{DistanceField, Feature, Hit, OVERHANG};
use crate::{Contact, Mat3, NormalFrom, Pose, Vec3};
use arrayvec::ArrayVec;
use std::cell::{Cell, RefCell};
use std::collections::BTreeMap;

/// Normals of an element, in the frame of the field.
pub(super) type Normals = ArrayVec<Vec3, 12>;

/// A bound of the field at a point.
struct PointBound {
    /// Lower bound of the distance, meters.
    bound: f64,
    /// The normal, if it is the same for every element.
    up: Option<Vec3>,
}

/// Two edge contacts that differ by less are the same contact, found from both sides; as fractions
/// of the smaller body's radius.
const SAME_DEPTH: f64 = 1e-6;
const SAME_POINT: f64 = 1e-3;
/// Distance from the surface at which two extended faces still meet in an edge of it, as a fraction
/// of the smaller body's radius.
const RIDGE_TOLERANCE: f64 = 1e-4;

/// The elements of one body against the field of the other.
pub(super) struct Query<'a> {
    pub(super) pose: &'a Pose,
    pub(super) rotation: Mat3,
    pub(super) field: &'a dyn DistanceField,
    pub(super) mesh: Option<&'a MeshField>,
    /// A plane that bounds the body with the field, in the frame of the elements.
    plane: Option<SupportPlane>,
    /// Elements of the body with the field.
    pub(super) other: &'a BodyElements<'a>,
    pub(super) size: f64,
    /// Whether the body with the elements is a cylinder.
    pub(super) is_cylinder: bool,
    /// In the second query, whose field is A's: the pose of A in B.
    pub(super) second: Option<&'a Pose>,
    cache: &'a NearestCache,
    /// Rows of edges of the body with the elements, and the parts of those that were searched.
    pub(super) rows: &'a [Row],
    pub(super) parts_of_rows: RefCell<BTreeMap<u32, Parts>>,
    /// Map from the element's frame to the field of a mesh.
    frame_map: Option<FrameMap>,
    /// Smallest distance of all samples, minus their radius.
    min_distance: Cell<f64>,
}

/// Cache of the closest points of mesh vertices, by index: each vertex is the end of several edges.
pub(super) struct NearestCache {
    seen: RefCell<ArrayVec<(u32, Hit), CACHE_SIZE>>,
    /// Position in `seen` at which an index can be found.
    slots: [Cell<u16>; CACHE_SLOTS],
}

impl NearestCache {
    /// Returns an empty cache; inlined to avoid a move.
    #[inline(always)]
    pub(super) const fn new() -> NearestCache {
        NearestCache { seen: RefCell::new(ArrayVec::new_const()), slots: [const { Cell::new(0) }; CACHE_SLOTS] }
    }
}

/// Maximum number of cached points; the cache is cleared when it is full.
const CACHE_SIZE: usize = 192;
/// Number of slots; larger, so that few indices collide.
const CACHE_SLOTS: usize = 1024;

impl<'a> Query<'a> {
    /// Prepares the query of one body, at `pose` in the frame of the other.
    pub(super) fn new(
        [one, other]: [&'a Body<'a>; 2],
        pose: &'a Pose,
        size: f64,
        second: Option<&'a Pose>,
        cache: &'a NearestCache,
    ) -> Query<'a> {
        let rotation = *pose.rotation.to_rotation_matrix().matrix();
        let frame_map = other.mesh.and_then(|mesh| mesh.frame_map(&rotation, &pose.translation.vector, one.radius));
        Query {
            pose,
            rotation,
            field: other.field,
            mesh: other.mesh,
            plane: None,
            other: &other.elements,
            size,
            is_cylinder: matches!(one.elements, BodyElements::Cylinder { .. }),
            second,
            cache,
            rows: if let BodyElements::Mesh(elements) = &one.elements { &elements.rows } else { &[] },
            parts_of_rows: RefCell::default(),
            frame_map,
            min_distance: Cell::new(f64::INFINITY),
        }
    }

    /// Leaves out the elements above a plane that bounds the other body, given in the frame of the elements.
    pub(super) fn beside(self, plane: Option<SupportPlane>) -> Query<'a> {
        Query { plane, ..self }
    }

    pub(super) fn run(&self, elements: &BodyElements, found: &mut Collector) {
        match elements {
            BodyElements::Mesh(elements) => self.query_mesh(elements, found),
            BodyElements::Box(half) => self.query_box(half, found),
            BodyElements::Round { radius, half_length } => self.query_round(*radius, *half_length, found),
            BodyElements::Cylinder { radius, half_length } => self.cylinder(*radius, *half_length, found),
            BodyElements::Ellipsoid(half) => self.query_ellipsoid(half, found),
            BodyElements::Cone(cone) => self.query_cone(cone, found),
            BodyElements::Empty => {}
        }
    }

    /// Returns the smallest signed distance of all samples, whatever they face, meters.
    pub(super) fn min_distance(&self) -> f64 {
        self.min_distance.get()
    }

    /// Records the distance of a sample.
    pub(super) fn record(&self, hit: &Hit, radius: f64) {
        self.min_distance.set(self.min_distance.get().min(hit.nearest - radius));
    }

    pub(super) fn to_field(&self, local: &Vec3) -> Vec3 {
        self.rotation * local + self.pose.translation.vector
    }

    fn query_mesh(&self, elements: &Elements, found: &mut Collector) {
        let Some(all) = elements.groups.first() else { return };
        let bound = self.bound(all.center_single(), || all.center());
        if bound - all.reach(self.field.is_curved()) <= found.limit() {
            self.query_group(elements, all, bound, found);
        }
    }

    /// Queries a group that can be within the limit; `bound` is a lower bound of the distance at
    /// its center.
    ///
    /// Bounds of all children are computed before any child is entered, so that their memory
    /// accesses overlap.
    fn query_group(&self, elements: &Elements, group: &Group, bound: f64, found: &mut Collector) {
        for children in elements.children_of(group).chunks(MAX_CHILDREN) {
            let bounds: ArrayVec<f64, MAX_CHILDREN> = children
                .iter()
                .map(|child| match self.height(&child.center()) {
                    height if height - child.reach(self.field.is_curved()) > found.limit() => height,
                    height => self.bound(child.center_single(), || child.center()).max(height),
                })
                .collect();
            for (child, bound) in children.iter().zip(bounds) {
                if bound - child.reach(self.field.is_curved()) <= found.limit() {
                    self.query_group(elements, child, bound, found);
                }
            }
        }
        for point in elements.points_of(group) {
            self.query_vertex_and_edges(elements, point, bound - (point.at - group.center()).norm(), found);
        }
    }

    /// Returns the height of a point of the element above the plane that bounds the other body: a lower bound of its
    /// distance, meters.
    #[inline]
    fn height(&self, local: &Vec3) -> f64 {
        self.plane.as_ref().map_or(f64::NEG_INFINITY, |plane| plane.height(local))
    }

    /// Returns the height of the lower end of an edge.
    #[inline]
    pub(super) fn least_height(&self, ends: &[Vec3; 2]) -> f64 {
        self.height(&ends[0]).min(self.height(&ends[1]))
    }

    /// Returns a lower bound of the distance at a point of the element, given in single precision
    /// too.
    #[inline]
    pub(super) fn bound(&self, single: &[f32; 3], point: impl Fn() -> Vec3) -> f64 {
        match (self.mesh, &self.frame_map) {
            (Some(mesh), Some(frame_map)) => mesh.bound_mapped(frame_map, single),
            _ => self.field.bound(&self.to_field(&point())),
        }
    }

    /// Queries a point of a mesh and the edges stored with it; `bound` is a lower bound of the
    /// distance there.
    fn query_vertex_and_edges(&self, elements: &Elements, point: &Point, bound: f64, found: &mut Collector) {
        let (fine, only_points) = (self.field.is_curved(), self.field.is_linear());
        let height = self.height(&point.at);
        let bound = bound.max(height);
        let longest = if only_points { 0.0 } else { point.longest[usize::from(fine)] };
        if bound - longest > found.limit() {
            return;
        }
        let seen = match height > found.limit() {
            true => PointBound { bound: height, up: None },
            false => self.query_vertex(&self.to_field(&point.at), elements, point, found),
        };
        let bound = bound.max(seen.bound);
        if only_points || bound - longest > found.limit() {
            return;
        }
        // if the distance rises steeply from here, an edge has no contact except at its end (for an
        // edge of a smooth surface, if the distance rises at all); a long edge can come near
        // another part of the body
        let up = seen.up.map(|up| self.rotation.tr_mul(&up));
        let rises = |edge: &Edge| {
            let smooth = edge.end_tolerance > 0.0;
            let least = if smooth { -LEVEL_SLOPE } else { FLAT_SLOPE };
            self.is_one_piece(edge.length, smooth)
                && up.is_some_and(|up| up.dot(&(edge.ends[1] - edge.ends[0])) >= least * edge.length)
        };
        for edge in elements.edges_of(point, fine) {
            if bound - edge.length <= found.limit() && !rises(edge) && self.may_have_contact(edge, found) {
                self.edge(&edge.ends, 0.0, &edge.normals, edge.index, Some(edge), found);
            }
        }
    }

    fn query_box(&self, half: &Vec3, found: &mut Collector) {
        let signs = |corner: u32| Vec3::from_fn(|k, _| if corner >> k & 1 == 1 { 1.0 } else { -1.0 });
        for corner in 0..8 {
            let normals: Normals = (0..3).map(|k| self.rotation.column(k) * signs(corner)[k]).collect();
            let edge_directions: [Vec3; 3] = std::array::from_fn(|k| Vec3::ith(k, -signs(corner)[k]));
            self.point(
                &self.to_field(&signs(corner).component_mul(half)),
                0.0,
                &normals,
                &edge_directions,
                corner,
                found,
            );
        }
        if self.field.is_linear() {
            return;
        }
        for corner in 0..8 {
            for k in (0..3).filter(|&k| corner >> k & 1 == 0) {
                let ends = [corner, corner | 1 << k].map(|c| signs(c).component_mul(half));
                let normals = [1, 2].map(|n| Vec3::ith((k + n) % 3, signs(corner)[(k + n) % 3]));
                self.edge(&ends, 0.0, &normals, 3 * corner + k as u32, None, found);
            }
        }
    }

    fn query_round(&self, radius: f64, half_length: f64, found: &mut Collector) {
        let ends = [-half_length, half_length].map(|z| Vec3::z() * z);
        for (n, end) in ends.iter().enumerate().take(if half_length > 0.0 { 2 } else { 1 }) {
            self.core_point(&self.to_field(end), radius, n as u32, found);
        }
        if half_length > 0.0 && !self.field.is_linear() {
            self.edge(&ends, radius, &[], 0, None, found);
        }
    }

    /// Queries the end of a rounded body: all points of a mesh that it touches, the closest point
    /// of other bodies.
    fn core_point(&self, at: &Vec3, radius: f64, index: u32, found: &mut Collector) {
        let Some(mesh) = self.mesh else { return self.point(at, radius, &[], &[], index, found) };
        if self.field.bound(at) - radius > found.limit() {
            return;
        }
        let reach = (radius + found.limit()).max(0.0);
        mesh.minima(at, reach, &mut |name, hit| {
            self.record(&hit, radius);
            let feature = (3 << 60 | u64::from(index) << 59) ^ (name & ((1 << 59) - 1)) ^ (name >> 62 << 57);
            self.push(at, radius, &hit, point_normal(&hit), feature, found);
        });
    }

    /// Queries a point with its normals in the field's frame; `edge_directions` are in the
    /// element's frame.
    ///
    /// Directly above or below a face a point always counts. Near an edge or corner of the other
    /// body it counts only if it is closest there: if one of its edges leads closer, that edge or
    /// its face makes the contact.
    fn point(
        &self,
        at: &Vec3,
        radius: f64,
        normals: &[Vec3],
        edge_directions: &[Vec3],
        index: u32,
        found: &mut Collector,
    ) {
        if self.field.bound(at) - radius > found.limit() {
            return;
        }
        self.push_point(at, radius, self.field.hit(at, normals, OVERHANG), edge_directions, index, found);
    }

    /// Queries a vertex of a mesh.
    fn query_vertex(&self, at: &Vec3, elements: &Elements, point: &Point, found: &mut Collector) -> PointBound {
        let transformed = || -> Normals { elements.normals_of(point).iter().map(|n| self.rotation * n).collect() };
        let (hit, seen) = match self.mesh {
            Some(mesh) => {
                let nearest = match self.nearest_named(mesh, at, point.index, found.limit()) {
                    Ok(nearest) => nearest,
                    Err(bound) => return PointBound { bound, up: None },
                };
                // for closer points the result depends on the normals of the element
                let up = Some(nearest.normal).filter(|_| nearest.distance > mesh.touching());
                let seen = PointBound { bound: nearest.distance, up };
                if nearest.distance > found.limit() {
                    return seen;
                }
                (mesh.hit_from_nearest(at, nearest, &transformed(), OVERHANG), seen)
            }
            None => {
                let seen = PointBound { bound: self.field.bound(at), up: None };
                if seen.bound > found.limit() {
                    return seen;
                }
                (self.field.hit(at, &transformed(), OVERHANG), seen)
            }
        };
        let down = self.rotation.tr_mul(&hit.normal);
        // an edge that leads closer, over a face that this vertex does not touch first, or to an edge
        // of the other body, whose own search finds the contact
        let max_slope = f64::from(match hit.feature {
            Feature::Face => point.max_slope,
            Feature::Edge(_) => 0.0,
            _ if self.mesh.is_none() => 0.0,
            _ => point.max_slope,
        })
        .max(SLOPE_ROUNDING);
        let first = match max_slope.is_infinite() {
            true => hit.feature != Feature::Face || !elements.smooth_edge_leads(point, &down),
            false => elements.ring_of(point).all(|edge| down.dot(&edge) >= -max_slope),
        };
        let edges = if first { elements.edge_directions_of(point) } else { &[] };
        let hit = Hit { facing: hit.facing && first, ..hit };
        self.push_point(at, 0.0, hit, edges, point.index, found);
        seen
    }

    /// Returns the hit at a point, which can have an index in the cache.
    pub(super) fn hit_at(&self, at: &Vec3, name: Option<u32>, normals: &[Vec3], beside: f64) -> Hit {
        let (Some(mesh), Some(name)) = (self.mesh, name) else { return self.field.hit(at, normals, beside) };
        let nearest = self.nearest_named(mesh, at, name, f64::INFINITY).unwrap_or_else(|_| mesh.nearest(at));
        mesh.hit_from_nearest(at, nearest, normals, beside)
    }

    /// Returns the closest point of a mesh to an indexed vertex if it can be within `limit`;
    /// otherwise a lower bound.
    fn nearest_named(&self, mesh: &MeshField, at: &Vec3, name: u32, limit: f64) -> Result<Hit, f64> {
        let slot = &self.cache.slots[name as usize % CACHE_SLOTS];
        let mut seen = self.cache.seen.borrow_mut();
        if let Some((_, hit)) = seen.get(slot.get() as usize).filter(|s| s.0 == name) {
            return Ok(*hit);
        }
        let nearest = mesh.nearest_within(at, limit)?;
        if seen.is_full() {
            seen.clear();
        }
        slot.set(seen.len() as u16);
        seen.push((name, nearest));
        Ok(nearest)
    }

    fn push_point(
        &self,
        at: &Vec3,
        radius: f64,
        hit: Hit,
        edge_directions: &[Vec3],
        index: u32,
        found: &mut Collector,
    ) {
        self.record(&hit, radius);
        let down = self.rotation.tr_mul(&hit.normal);
        let closest =
            hit.feature == Feature::Face || edge_directions.iter().all(|edge| down.dot(edge) >= -SLOPE_ROUNDING);
        self.push_if(hit.facing && closest, at, radius, &hit, point_normal(&hit), u64::from(index), found);
    }

    pub(super) fn push(
        &self,
        at: &Vec3,
        radius: f64,
        hit: &Hit,
        normal_from: NormalFrom,
        feature: u64,
        found: &mut Collector,
    ) {
        self.push_if(true, at, radius, hit, normal_from, feature, found);
    }

    /// Adds the contact of a core point of the element and its hit. If it does not `fit`, it is
    /// stored as fallback.
    #[allow(clippy::too_many_arguments)]
    pub(super) fn push_if(
        &self,
        fits: bool,
        at: &Vec3,
        radius: f64,
        hit: &Hit,
        normal_from: NormalFrom,
        feature: u64,
        found: &mut Collector,
    ) {
        let gap = hit.distance - radius;
        if gap.is_nan() || gap > found.limit() {
            return;
        }
        let contact = self.contact(at, radius, hit, normal_from, feature);
        if fits {
            found.push(contact);
        } else {
            found.push_fallback(contact);
        }
    }

    /// Returns the contact, in B's frame, of a core point of the element and its hit.
    fn contact(&self, at: &Vec3, radius: f64, hit: &Hit, normal_from: NormalFrom, feature: u64) -> Contact {
        let gap = hit.distance - radius;
        let contact = Contact {
            point: at - hit.normal * (radius + 0.5 * gap),
            normal: hit.normal,
            gap,
            feature: feature << 1 | u64::from(self.second.is_some()),
            core_a: radius,
            core_b: hit.core,
            normal_from,
            shapes: [0; 2],
        };
        match self.second {
            None => contact,
            Some(pose) => transformed(contact, pose).flipped(),
        }
    }

    /// Returns whether a place to which two faces were extended, at a hit of a point inside, is no
    /// more than rounding outside the surface: the faces end where they meet.
    pub(super) fn is_surface(&self, at: &Vec3, hit: &Hit) -> bool {
        let place = at - hit.normal * hit.distance;
        let most = RIDGE_TOLERANCE * self.size;
        // the bound of a mesh may be far below its distance
        self.field.bound(&place) <= most && self.mesh.is_none_or(|mesh| mesh.nearest(&place).distance <= most)
    }

    /// Returns whether there is a contact of the same depth at nearly the same place.
    pub(super) fn is_duplicate(&self, at: &Vec3, radius: f64, hit: &Hit, found: &Collector) -> bool {
        let new = self.contact(at, radius, hit, NormalFrom::Edges, 0);
        found.contains_like(|c| {
            (c.gap - new.gap).abs() < SAME_DEPTH * self.size && (c.point - new.point).norm() < SAME_POINT * self.size
        })
    }
}

/// Returns the feature that determines the normal of a point's contact.
pub(super) fn point_normal(hit: &Hit) -> NormalFrom {
    match hit.feature {
        Feature::Face => NormalFrom::FaceOfB,
        Feature::Line(along) | Feature::Edge(along) => NormalFrom::LineOfB(along),
        Feature::Point => NormalFrom::CorePoints,
    }
}

/// Returns the contact in another frame.
fn transformed(contact: Contact, pose: &Pose) -> Contact {
    let normal_from = match contact.normal_from {
        NormalFrom::LineOfA(along) => NormalFrom::LineOfA(pose.rotation * along),
        NormalFrom::LineOfB(along) => NormalFrom::LineOfB(pose.rotation * along),
        other => other,
    };
    let point = (pose * nalgebra::Point3::from(contact.point)).coords;
    Contact { point, normal: pose.rotation * contact.normal, normal_from, ..contact }
}

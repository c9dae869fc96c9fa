//! Contacts at edges inside a surface that several shapes form together, where it is not one plane below the
//! whole body (`coplanar.rs`). The shapes are those of bodies that no force moves, or those of one compound or link, which
//! may move; in heaps of moving bodies all contacts stay.
//!
//! The narrow phase knows one pair at a time. For a body `A` on a box `B₁`, the edge of the next
//! box `B₂` is a corner that sticks out; in the surface of both together it does not exist. A
//! contact of `A` and `B₂` at the point `y` is removed if `A` can reach `y` only through `B₁`:
//!
//! ```text
//! d₁(y) ≤ tolerance                              y is on B₁, or inside
//! n₁·(y − y₁) ≤ flush                            y is not above the plane of the contact of A and B₁
//! d₂(q) ≥ lift − flush,  q = y raised along n₁ to the height `lift` above that plane      B₂ does not protrude there
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `d₁`, `d₂` | signed distances from `B₁` and `B₂` |
//! | `y₁`, `n₁` | point on `B₁` and normal of the nearest contact of `A` and `B₁`; the normal points to `A` |
//!
//! The contact with `B₁` must be the nearer one, so two never remove each other. Of contacts with one
//! normal, one that `B₂` has removed removes none of `B₂`'s either: of two supports at a seam, one
//! stays. The plane of `B₁` carries `A` across the seam. A wall that stands on `B₁` protrudes and
//! keeps its contacts, also those at its foot. So does a ramp of more than 4°, and a step higher than
//! `flush`.
//!
//! Each shape of a compound is a `B` of its own. A contact of two compounds is seen from both sides: either may be `A`.
//! Shapes may differ in what they meet, by their filters and by materials that ignore each other: the nearest contact is
//! one of a shape of `A` that meets the same others, so what `A` passes through hides nothing. Of the contacts of one
//! place with both sides of a seam one stays.

use crate::contact::coplanar::PlaneContacts;
use crate::contact::detect::{ContactConstraint, PartTable};
use crate::object::{FilteredPart, ShapeClass};
use tumble_collide::{Pose, Shape, SurfacePoint, Vec3, closest_point_within};

/// Height above the plane at which `B₂` must be absent, in drift tolerances.
pub(crate) const LIFT: f64 = 10.0;
/// Difference of height of flush surfaces, as a fraction of the lift: a ramp of 4° rises so much.
pub(crate) const FLUSH: f64 = 2e-3;
/// Distance by which the points of a contact may lie beside the surface, in bounding radii.
const MAX_OVERHANG: f64 = 2e-3;
/// Difference of equal normals.
const SAME_NORMAL: f64 = 1e-7;
/// Difference of the normals of contacts that support alike.
pub(crate) const LEVEL: f64 = 1e-3;
/// Difference of equal gaps, in drift tolerances.
const SAME_GAP: f64 = 1e-8;
/// Maximum number of contacts of a part that are compared; those of a part with more all stay.
const MAX_CONTACTS: usize = 256;

/// Working memory.
#[derive(Default)]
pub(crate) struct InternalEdges {
    /// Start of the entries of each part, and the entries: contacts of a moving part.
    starts: Vec<u32>,
    entries: Vec<Entry>,
    /// The nearest contact with each other shape, of the shapes of each class.
    nearest: Vec<Entry>,
    /// The contacts of a part, nearest first.
    order: Vec<Entry>,
    /// The shape whose surface has removed each contact.
    removed_by: Vec<Option<Side>>,
    /// Contacts with planes, which replace others.
    of_planes: Vec<ContactConstraint>,
}

/// The row of a part, and one of its shapes: the index of a part of a compound, 0 of all others.
pub(crate) type Side = [u32; 2];

/// A contact as one of its parts, `A`, sees it.
#[derive(Clone, Copy)]
pub(crate) struct Entry {
    pub contact: u32,
    /// The class of the shape of `A`; `None` if its shapes do not differ.
    pub class: Option<ShapeClass>,
    /// The row of the other part.
    pub other: u32,
    /// The row of the part that carries the other part, if forces move it: the shapes that it carries form one surface,
    /// and so do those of all parts that no force moves.
    pub surface: Option<u32>,
    /// Its shape.
    pub other_shape: u32,
    pub gap: f64,
    /// Unit normal, towards `A`.
    pub normal: Vec3,
    /// Point on the other part, m.
    pub point: Vec3,
}

impl Entry {
    /// Returns a contact as seen by its first or second part.
    fn new(contact: u32, constraint: &ContactConstraint, second: bool) -> Entry {
        let c = &constraint.contact;
        let (sign, other) = if second { (-1.0, constraint.a) } else { (1.0, constraint.b) };
        let (normal, other_shape) = (sign * c.normal, c.shapes[usize::from(!second)]);
        let point = c.point - normal * (0.5 * c.gap);
        Entry { contact, class: None, other, surface: None, other_shape, gap: c.gap, normal, point }
    }

    /// Returns the other shape.
    pub fn side(&self) -> Side {
        [self.other, self.other_shape]
    }
}

/// Inputs of the search.
pub(crate) struct Surroundings<'a> {
    pub table: PartTable<'a>,
    /// m.
    pub drift_tolerance: f64,
    /// Returns the margin of contacts of two parts, m.
    pub margin: &'a dyn Fn(u32, u32) -> f64,
}

impl Surroundings<'_> {
    /// Returns one shape of a part, at its pose.
    pub fn single(&self, [part, shape]: Side) -> Option<(&Shape, Pose)> {
        let pose = self.table.part_states[part as usize].pose;
        match self.table.part(part)?.shape {
            Shape::Compound(compound) => compound.placed().nth(shape as usize).map(|(shape, own)| (shape, pose * own)),
            whole => Some((whole, pose)),
        }
    }

    fn moves(&self, part: u32) -> bool {
        let (entry, part) = self.table.entry(part);
        entry.moves() && entry.object.collidable().is_some_and(|body| body.part_moves(part))
    }

    /// Returns the row of the part that carries a moving part, if it may carry several shapes.
    fn moving_surface(&self, row: u32) -> Option<u32> {
        let (entry, part) = self.table.entry(row);
        let body = entry.object.collidable()?;
        let several = body.parts() > 1 || matches!(body.shape(part), Some(Shape::Compound(_)));
        several.then(|| row - part as u32 + body.carrier(part) as u32)
    }

    /// Returns whether all contacts of a part with a moving one may be those with a face of it: it is not larger, or a
    /// query of its shape is cheap.
    fn may_stand_on(&self, part: u32, moving: u32) -> bool {
        let [part, moving] = [part, moving].map(|row| self.table.part(row).map(|part| part.shape));
        part.zip(moving).is_some_and(|(shape, moving)| {
            let radius = shape.bounding_radius();
            radius <= moving.bounding_radius() || radius.is_finite() && !shape.has_tree()
        })
    }

    /// Returns the point of a shape's surface that is closest to a point; `None` if it is more than
    /// `limit` away, m.
    pub fn closest(&self, side: Side, point: &Vec3, limit: f64) -> Option<SurfacePoint> {
        let (shape, pose) = self.single(side)?;
        let reach = shape.bounding_radius() + limit;
        if (point - pose.translation.vector).norm_squared() > reach * reach {
            return None;
        }
        closest_point_within(shape, &pose, point, limit)
    }

    /// Returns whether the contact `c` of `A` can only be reached through the part of `first`.
    fn is_internal(&self, c: &Entry, first: &Entry) -> bool {
        let (lift, tolerance) = (LIFT * self.drift_tolerance, self.drift_tolerance);
        // bodies that rest on both surfaces keep the contacts with both
        let same_normal = (c.normal - first.normal).norm_squared() < SAME_NORMAL * SAME_NORMAL;
        let nearer = if same_normal { SAME_GAP * tolerance } else { 0.0 };
        if (first.gap + nearer).total_cmp(&c.gap).then(first.contact.cmp(&c.contact)).is_ge() {
            return false;
        }
        // manifolds extend a little beyond a face; a point outside is moved to the surface
        let overhang = MAX_OVERHANG * self.single(c.side()).map_or(0.0, |(shape, _)| shape.bounding_radius());
        let height = |point: &Vec3| first.normal.dot(&(point - first.point));
        if height(&c.point) > overhang || self.closest(first.side(), &c.point, tolerance + overhang).is_none() {
            return false;
        }
        let Some(surface) = self.closest(c.side(), &c.point, f64::INFINITY) else { return false };
        let point = if surface.distance > 0.0 { surface.point } else { c.point };
        if height(&point) > FLUSH * lift || self.closest(first.side(), &point, tolerance).is_none() {
            return false;
        }
        let above = point + first.normal * (lift - height(&point));
        self.closest(c.side(), &above, (1.0 - FLUSH) * lift).is_none()
    }
}

impl InternalEdges {
    /// Removes the contacts at internal edges.
    pub fn remove(&mut self, around: &Surroundings, contacts: &mut Vec<ContactConstraint>) {
        if contacts.len() < 2 {
            return;
        }
        self.collect(around, contacts);
        self.removed_by.clear();
        self.removed_by.resize(contacts.len(), None);
        let (starts, mut entries) = (std::mem::take(&mut self.starts), std::mem::take(&mut self.entries));
        for (part, range) in starts.windows(2).enumerate() {
            let seen = &mut entries[range[0] as usize..range[1] as usize];
            seen.sort_by_key(|entry| entry.surface);
            for surface in seen.chunk_by(|x, y| x.surface == y.surface) {
                self.look_at(around, contacts, part as u32, surface);
            }
        }
        (self.starts, self.entries) = (starts, entries);
        if self.removed_by.iter().any(Option::is_some) {
            let mut removed = self.removed_by.iter();
            contacts.retain(|_| removed.next().is_none_or(Option::is_none));
            if !self.of_planes.is_empty() {
                contacts.append(&mut self.of_planes);
                contacts.sort_by_key(|contact| (contact.key.pair, contact.plane.is_some(), contact.key.feature));
            }
        }
    }

    /// Marks the contacts of a part with one surface that are to be removed, and adds those with planes.
    fn look_at(&mut self, around: &Surroundings, contacts: &[ContactConstraint], part: u32, entries: &[Entry]) {
        if entries.len() > MAX_CONTACTS || entries.iter().all(|e| e.side() == entries[0].side()) {
            return;
        }
        self.find_nearest(entries);
        let stands = entries[0].surface.is_none() || around.may_stand_on(part, entries[0].other);
        let found = stands.then(|| PlaneContacts::find(around, (entries, &self.nearest), contacts)).flatten();
        if let Some(plane) = found {
            let replaced = || entries.iter().filter(|e| plane.tiles.contains(&e.side()));
            // as seen from the other side, they may be contacts of a plane already
            if replaced().all(|e| self.removed_by[e.contact as usize].is_none()) {
                replaced().for_each(|e| self.removed_by[e.contact as usize] = Some(e.side()));
                self.of_planes.extend(plane.contacts);
            }
        }
        // nearer ones first, so it is known by whom they are removed
        self.order.clear();
        self.order.extend_from_slice(entries);
        self.order.sort_by(|x, y| x.gap.total_cmp(&y.gap).then(x.contact.cmp(&y.contact)));
        for c in &self.order {
            if self.removed_by[c.contact as usize].is_some() {
                continue;
            }
            let removed_by = |e: &Entry| self.removed_by[e.contact as usize];
            let internal = |first: &&Entry| {
                let level = (c.normal - first.normal).norm_squared() < LEVEL * LEVEL;
                let mutual = level && removed_by(first) == Some(c.side());
                first.side() != c.side() && first.class == c.class && !mutual && around.is_internal(c, first)
            };
            // the contact of that place with the other shape may be gone, for this one or as seen from the other side
            let stays = |first: &Entry| {
                let gone =
                    |e: &Entry, [by, shape]: Side| by == part || e.side() == first.side() && [by, shape] == c.side();
                let near = |e: &Entry| (c.point - e.point).norm_squared() <= around.drift_tolerance.powi(2);
                entries.iter().any(|e| removed_by(e).is_some_and(|by| gone(e, by)) && near(e))
            };
            let first = self.nearest.iter().find(|first| internal(first) && !stays(first));
            if let Some(by) = first.map(Entry::side) {
                self.removed_by[c.contact as usize] = Some(by);
            }
        }
    }

    /// Finds the nearest contact with each other shape, of the shapes of each class.
    fn find_nearest(&mut self, entries: &[Entry]) {
        self.nearest.clear();
        // contacts are ordered by pair
        for same in entries.chunk_by(|x, y| x.other == y.other) {
            let start = self.nearest.len();
            for entry in same {
                let alike = |known: &&mut Entry| known.class == entry.class && known.side() == entry.side();
                match self.nearest[start..].iter_mut().find(alike) {
                    Some(known) if known.gap.total_cmp(&entry.gap).is_gt() => *known = *entry,
                    Some(_) => {}
                    None => self.nearest.push(*entry),
                }
            }
        }
        self.nearest.sort_by(|x, y| x.gap.total_cmp(&y.gap).then(x.contact.cmp(&y.contact)));
    }

    /// Collects the contacts as each part sees them, by counting.
    fn collect(&mut self, around: &Surroundings, contacts: &[ContactConstraint]) {
        // the parts that see a contact, as its first or second one, and the surface
        let seen = |index: usize| {
            let constraint = &contacts[index];
            // the contacts of followed meshes belong to later poses
            let present = constraint.offset == Vec3::zeros();
            let parts = [constraint.a, constraint.b];
            let moves = parts.map(|part| present && around.moves(part));
            [0, 1].map(|k| {
                let surface = moves[1 - k].then(|| around.moving_surface(parts[1 - k]));
                let sees = surface.map_or(moves[k], |moving| moving.is_some());
                sees.then_some((parts[k], k == 1, surface.flatten()))
            })
        };
        let parts = around.table.owners.len();
        self.starts.clear();
        self.starts.resize(parts + 1, 0);
        for (part, ..) in (0..contacts.len()).flat_map(seen).flatten() {
            self.starts[part as usize] += 1;
        }
        // to the ends of the ranges
        let mut end = 0;
        for start in &mut self.starts[..parts] {
            end += *start;
            *start = end;
        }
        self.starts[parts] = end;
        let empty = Entry {
            contact: 0,
            class: None,
            other: 0,
            surface: None,
            other_shape: 0,
            gap: 0.0,
            normal: Vec3::zeros(),
            point: Vec3::zeros(),
        };
        self.entries.clear();
        self.entries.resize(end as usize, empty);
        // and from the last contact back to their starts
        for index in (0..contacts.len()).rev() {
            for (part, second, surface) in seen(index).into_iter().flatten() {
                self.starts[part as usize] -= 1;
                let entry = Entry::new(index as u32, &contacts[index], second);
                let shape = contacts[index].contact.shapes[usize::from(second)];
                let differing = around.table.part(part).filter(FilteredPart::differs);
                let class = differing.map(|part| part.class_of(shape));
                self.entries[self.starts[part as usize] as usize] = Entry { class, surface, ..entry };
            }
        }
    }
}

//! Coplanar faces: the tiles of a floor act on another body as one plane. The tiles are bodies that no force moves and
//! that have one velocity, or shapes of one compound or link, which may move; in heaps of moving bodies all contacts stay.
//!
//! The narrow phase knows one pair at a time. The side of a cylinder touches the tile below it along a line,
//! which ends at the seam, and the edge of the next tile along another; on the surface of both tiles
//! together there is one line. The contacts of a body `A` with the tiles `B` are replaced by those with the plane
//! if `A` can reach the tiles only through it:
//!
//! ```text
//! n₁·(x − y₁) ≤ flush    for all x of all B       no tile rises above the plane
//! gapᵢ ≥ −lift           for all contacts i       A is not below the plane
//! d(yᵢ) ≤ tolerance      for one of the B         each contact with the plane lies on a tile
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `B` | a tile |
//! | `y₁`, `n₁` | point on a tile of the nearest contact that gives such a plane, and normal of the tile there; it points to `A` |
//! | `yᵢ`, `gapᵢ` | point on the plane and gap of a contact of `A` with the plane |
//! | `d` | signed distance from a tile |
//!
//! Each contact with the plane belongs to the tile at its point, with the constants of that pair. A wall on the
//! floor rises above the plane, so its contacts stay as they are. At the end of a floor, where some contact with
//! the plane lies on no tile, all contacts stay.

use crate::contact::detect::ContactConstraint;
use crate::contact::internal_edges::{Entry, FLUSH, LEVEL, LIFT, Side, Surroundings};
use crate::contact::motion::Moved;
use crate::contact::time_of_impact::moving_pair;
use crate::object::FilteredPart;
use crate::object::collidable::Collidable;
use std::sync::Arc;
use tumble_collide::{Contact, Pose, Quat, Shape, Vec3};

/// The plane of several tiles, as the other side of a contact.
#[derive(Debug)]
pub(crate) struct FacePlane {
    /// Row of the part that it moves with.
    pub carrier: u32,
    /// Its pose in the frame of that part; z is its normal.
    pub pose: Pose,
    /// Whether it is side A of its contacts.
    pub is_a: bool,
}

impl FacePlane {
    /// Returns its side of its contacts, 0 for A.
    pub fn side(&self) -> usize {
        usize::from(!self.is_a)
    }
}

/// The shape of a [`FacePlane`].
pub(crate) static HALF_SPACE: Shape = Shape::HalfSpace;

/// Returns the rotation that turns a unit vector to z.
fn to_z(n: &Vec3) -> Quat {
    Quat::rotation_between(n, &Vec3::z())
        .unwrap_or_else(|| Quat::from_axis_angle(&Vec3::x_axis(), std::f64::consts::PI))
}

/// Contacts with a plane, and the tiles whose contacts they replace.
pub(crate) struct PlaneContacts {
    pub tiles: Vec<Side>,
    pub contacts: Vec<ContactConstraint>,
}

impl PlaneContacts {
    /// Returns the contacts of a part with the plane that tiles form; `None` if there is no such plane.
    /// `entries` are its contacts and `nearest` the nearest one with each tile.
    pub fn find(
        around: &Surroundings,
        (entries, nearest): (&[Entry], &[Entry]),
        constraints: &[ContactConstraint],
    ) -> Option<PlaneContacts> {
        nearest.iter().find_map(|first| {
            // at the edge of a tile the normal of a contact may be tilted by a little
            let first = &around.on_face(first);
            let tiles = tiles(around, first, (entries, nearest), constraints);
            if tiles.len() < 2 {
                return None;
            }
            let contacts = contacts(around, first, &tiles, constraints)?;
            Some(PlaneContacts { tiles: tiles.iter().map(Entry::side).collect(), contacts })
        })
    }
}

/// Returns whether the other part of an entry is side A of the contact.
fn is_a(entry: &Entry, constraints: &[ContactConstraint]) -> bool {
    constraints[entry.contact as usize].a == entry.other
}

/// Returns an entry of each tile that has a face in the plane of `first` and does not rise above it.
fn tiles(
    around: &Surroundings,
    first: &Entry,
    (entries, nearest): (&[Entry], &[Entry]),
    constraints: &[ContactConstraint],
) -> Vec<Entry> {
    let turn = to_z(&first.normal);
    let (height, tolerance) = ((turn * first.point).z, around.drift_tolerance);
    let velocity = |part: u32| {
        let state = &around.table.part_states[part as usize];
        (state.velocity_at(&first.point), state.angular_velocity)
    };
    let is_tile = |tile: &Entry| {
        let touches = |e: &Entry| ((turn * e.point).z - height).abs() <= tolerance;
        let is_near = entries.iter().any(|e| e.side() == tile.side() && touches(e));
        let is_level = || {
            // contacts with a compound inside a compound name the outer part
            let single = around.single(tile.side()).filter(|(shape, _)| !matches!(shape, Shape::Compound(_)));
            let top = single.map(|(shape, pose)| shape.tight_aabb(&(turn * pose)).max.z);
            top.is_some_and(|top| (top - height).abs() <= FLUSH * LIFT * tolerance)
        };
        is_near
            && around.has_two_sides(tile.other)
            && is_a(tile, constraints) == is_a(first, constraints)
            && (tile.surface.is_some() || velocity(tile.other) == velocity(first.other))
            && is_level()
    };
    let mut tiles: Vec<Entry> = nearest.iter().filter(|tile| is_tile(tile)).copied().collect();
    if !tiles.iter().any(|tile| tile.side() == first.side()) {
        tiles.clear();
    }
    tiles
}

/// Returns the contacts with the plane of `first`, each with one of the tiles; `None` if one is on no tile.
fn contacts(
    around: &Surroundings,
    first: &Entry,
    tiles: &[Entry],
    constraints: &[ContactConstraint],
) -> Option<Vec<ContactConstraint>> {
    let (tolerance, is_a) = (around.drift_tolerance, is_a(first, constraints));
    let in_world = Pose::from_parts(first.point.into(), to_z(&first.normal).inverse());
    let pose = around.table.part_states[first.other as usize].pose.inv_mul(&in_world);
    let plane = Arc::new(FacePlane { carrier: first.other, pose, is_a });
    let ContactConstraint { a, b, .. } = constraints[first.contact as usize];
    let pair = moving_pair(around.table, [a, b], Some(&plane))?;
    let mover = if is_a { b } else { a };
    if !around.is_uniform(mover) {
        return None;
    }
    let mut found = Vec::new();
    let margin = tiles.iter().map(|tile| (around.margin)(mover, tile.other)).fold(0.0, f64::max);
    pair.contacts_at(&pair.part_states.map(|state| state.pose), margin, &mut found);
    if found.is_empty() || found.iter().any(|contact| contact.gap < -LIFT * tolerance) {
        return None;
    }
    let on_tile = |contact: &Contact| {
        let away = if is_a { 0.5 } else { -0.5 } * contact.gap;
        let point = contact.point + away * contact.normal;
        let tile = tiles.iter().find(|tile| around.closest(tile.side(), &point, tolerance).is_some())?;
        let mut constraint = constraints[tile.contact as usize].clone();
        constraint.contact = *contact;
        constraint.contact.shapes[plane.side()] = tile.other_shape;
        constraint.key.feature = contact.feature;
        constraint.moved = Moved::default();
        constraint.frame = constraint.frame_at(contact.point, contact.normal);
        constraint.plane = Some(plane.clone());
        Some(constraint)
    };
    found.iter().map(on_tile).collect()
}

impl Surroundings<'_> {
    /// Returns a contact with point and normal of the face that it touches, if its normal is nearly that of the face.
    fn on_face(&self, entry: &Entry) -> Entry {
        let face = self.closest(entry.side(), &entry.point, self.drift_tolerance);
        let level = |normal: &Vec3| (normal - entry.normal).norm_squared() < LEVEL * LEVEL;
        match face.filter(|face| level(&face.normal)) {
            Some(face) => Entry { point: face.point, normal: face.normal, ..*entry },
            None => *entry,
        }
    }

    /// Returns whether a part collides on all sides by its shapes.
    fn has_two_sides(&self, part: u32) -> bool {
        let (entry, part) = self.table.entry(part);
        let sided = |body: &dyn Collidable| body.one_way(part).is_none() && body.intersect(part).is_none();
        entry.object.collidable().is_some_and(sided)
    }

    /// Returns whether all shapes of a part have one surface and collide with the same others, on all sides.
    fn is_uniform(&self, part: u32) -> bool {
        let uniform = |side: FilteredPart| {
            side.body.shape_materials(side.part).is_empty() && side.body.shape_filters(side.part).is_empty()
        };
        self.has_two_sides(part) && self.table.part(part).is_some_and(uniform)
    }
}

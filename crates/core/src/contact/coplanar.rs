//! Coplanar faces: the tiles of a floor act on a moving body as one plane. The bodies that form the plane do
//! not move against each other; in heaps of moving ones all contacts stay.
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
//! | `y₁`, `n₁` | point on a tile and normal of the nearest contact that gives such a plane; the normal points to `A` |
//! | `yᵢ`, `gapᵢ` | point on the plane and gap of a contact of `A` with the plane |
//! | `d` | signed distance from a tile |
//!
//! Each contact with the plane belongs to the tile at its point, with the constants of that pair. A wall on the
//! floor rises above the plane, so its contacts stay as they are. At the end of a floor, where some contact with
//! the plane lies on no tile, all contacts stay.

use crate::contact::detect::ContactConstraint;
use crate::contact::internal_edges::{Entry, FLUSH, LIFT, Surroundings};
use crate::contact::motion::Moved;
use crate::contact::time_of_impact::moving_pair;
use crate::object::part_state::PartState;
use std::sync::Arc;
use tumble_collide::{Pose, Quat, Shape, Vec3};

/// The plane of several parts, as the other side of a contact.
#[derive(Debug)]
pub(crate) struct FacePlane {
    /// Its normal is z of the frame.
    pub state: PartState,
    /// Whether it is side A of its contacts.
    pub is_a: bool,
}

/// The shape of a [`FacePlane`].
pub(crate) static HALF_SPACE: Shape = Shape::HalfSpace;

/// Returns the rotation that turns a unit vector to z.
fn to_z(n: &Vec3) -> Quat {
    Quat::rotation_between(n, &Vec3::z())
        .unwrap_or_else(|| Quat::from_axis_angle(&Vec3::x_axis(), std::f64::consts::PI))
}

/// Contacts with a plane, and the rows of the parts whose contacts they replace.
pub(crate) struct PlaneContacts {
    pub tiles: Vec<u32>,
    pub contacts: Vec<ContactConstraint>,
}

impl PlaneContacts {
    /// Returns the contacts of a part with the plane that other parts form; `None` if there is no such plane.
    /// `entries` are its contacts and `nearest` the nearest one with each other part.
    pub fn find(
        around: &Surroundings,
        (entries, nearest): (&[Entry], &[Entry]),
        constraints: &[ContactConstraint],
    ) -> Option<PlaneContacts> {
        nearest.iter().find_map(|first| {
            let tiles = tiles(around, first, (entries, nearest), constraints);
            if tiles.len() < 2 {
                return None;
            }
            let contacts = contacts(around, first, &tiles, constraints)?;
            Some(PlaneContacts { tiles: tiles.iter().map(|tile| tile.other).collect(), contacts })
        })
    }
}

/// Returns whether the other part of an entry is side A of the contact.
fn is_a(entry: &Entry, constraints: &[ContactConstraint]) -> bool {
    constraints[entry.contact as usize].a == entry.other
}

/// Returns an entry of each part that has a face in the plane of `first` and does not rise above it.
fn tiles(
    around: &Surroundings,
    first: &Entry,
    (entries, nearest): (&[Entry], &[Entry]),
    constraints: &[ContactConstraint],
) -> Vec<Entry> {
    let turn = to_z(&first.normal);
    let (height, tolerance) = ((turn * first.point).z, around.drift_tolerance);
    let velocity = |part: u32| {
        let state = &around.part_states[part as usize];
        (state.velocity_at(&first.point), state.angular_velocity)
    };
    let is_tile = |tile: &Entry| {
        let touches = |e: &Entry| ((turn * e.point).z - height).abs() <= tolerance;
        let is_near = entries.iter().any(|e| e.other == tile.other && touches(e));
        let is_level = || {
            let pose = turn * around.part_states[tile.other as usize].pose;
            // contacts with a compound name one of its shapes
            let single = around.shape(tile.other).filter(|shape| !matches!(shape, Shape::Compound(_)));
            let top = single.map(|shape| shape.tight_aabb(&pose).max.z);
            top.is_some_and(|top| (top - height).abs() <= FLUSH * LIFT * tolerance)
        };
        is_near
            && around.is_plain(tile.other)
            && is_a(tile, constraints) == is_a(first, constraints)
            && velocity(tile.other) == velocity(first.other)
            && is_level()
    };
    let mut tiles: Vec<Entry> = nearest.iter().filter(|tile| is_tile(tile)).copied().collect();
    if !tiles.iter().any(|tile| tile.other == first.other) {
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
    let plane = Arc::new(FacePlane { state: around.plane_state(first), is_a });
    let ContactConstraint { a, b, .. } = constraints[first.contact as usize];
    let pair = moving_pair(around.objects, around.owners, around.part_states, [a, b], Some(&plane))?;
    let mover = if is_a { b } else { a };
    if !around.is_plain(mover) {
        return None;
    }
    let mut found = Vec::new();
    let margin = tiles.iter().map(|tile| (around.margin)(mover, tile.other)).fold(0.0, f64::max);
    pair.contacts_at(&pair.part_states.map(|state| state.pose), margin, &mut found);
    if found.is_empty() || found.iter().any(|contact| contact.gap < -LIFT * tolerance) {
        return None;
    }
    let on_tile = |contact: &tumble_collide::Contact| {
        let away = if is_a { 0.5 } else { -0.5 } * contact.gap;
        let point = contact.point + away * contact.normal;
        let tile = tiles.iter().find(|tile| around.closest(tile.side(), &point, tolerance).is_some())?;
        let mut constraint = constraints[tile.contact as usize].clone();
        constraint.contact = *contact;
        constraint.key.feature = contact.feature;
        constraint.moved = Moved::default();
        constraint.frame = constraint.frame_at(contact.point, contact.normal);
        constraint.plane = Some(plane.clone());
        Some(constraint)
    };
    found.iter().map(on_tile).collect()
}

impl Surroundings<'_> {
    /// Returns whether a part has one surface that collides on all sides by its shape.
    fn is_plain(&self, part: u32) -> bool {
        let owner = &self.owners[part as usize];
        let part = owner.part as usize;
        self.objects.at(owner.place as usize).object.collidable().is_some_and(|body| {
            body.shape_materials(part).is_empty()
                && body.shape_filters(part).is_empty()
                && body.one_way(part).is_none()
                && body.intersect(part).is_none()
        })
    }

    /// Returns the state of the plane of a contact; it moves with the part that is touched.
    fn plane_state(&self, first: &Entry) -> PartState {
        let tile = &self.part_states[first.other as usize];
        let arm = first.point - tile.position();
        let velocity = tile.velocity_at(&first.point);
        PartState {
            pose: Pose::from_parts(first.point.into(), to_z(&first.normal).inverse()),
            velocity,
            acceleration: tile.acceleration_following(&first.point, &velocity),
            bias_acceleration: tile.bias_acceleration + tile.bias_angular_acceleration.cross(&arm),
            ..*tile
        }
    }
}

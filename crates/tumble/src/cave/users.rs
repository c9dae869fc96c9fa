//! The users in the world: where they look from, how keys move them, what their hands pull and their bodies push.
//!
//! Each user has at most one hand: the wand. While its first button is held, what the wand's ray meets first is pulled by a spring. A body, if asked for,
//! is an upright capsule from the cave's floor to the head that follows the head and yields to nothing.

use crate::failure::Failure;
use std::collections::BTreeMap;
use tumble::collide::{Pose, Shape, Vec3};
use tumble::core::{Mode, ObjectId, Pull, RigidBody, World, WorldError};
use tumble::net::sync::{Input, Viewer};

/// Walking, metres of the cave per second, and turning, rad/s, while a key is held.
const WALK_M_PER_S: f64 = 1.5;
const TURN_RAD_PER_S: f64 = 1.0;
/// Of the spring by which the wand pulls, rad/s.
const PULL_RAD_PER_S: f64 = 10.0;
/// Of a user's body, m.
const RADIUS_M: f64 = 0.25;
/// Input that was not renewed for so long counts no more, simulated s: who left lets go.
const STALE_S: f64 = 1.0;

/// Keys by their USB HID usage.
mod key {
    pub const A: u16 = 0x04;
    pub const D: u16 = 0x07;
    pub const E: u16 = 0x08;
    pub const Q: u16 = 0x14;
    pub const S: u16 = 0x16;
    pub const W: u16 = 0x1A;
    pub const RIGHT: u16 = 0x4F;
    pub const LEFT: u16 = 0x50;
    pub const DOWN: u16 = 0x51;
    pub const UP: u16 = 0x52;
}

/// All users.
pub struct Users {
    /// As it is published.
    pub viewer: Viewer,
    /// The newest input of each user, and when it came.
    inputs: BTreeMap<u16, (Input, f64)>,
    hands: BTreeMap<u16, Hand>,
    bodies: Vec<ObjectId>,
}

/// What a wand holds.
struct Hand {
    pull: Pull,
    /// From the wand's origin, along its ray, m.
    distance: f64,
}

impl Users {
    /// As the files place them; with bodies, if they are to push.
    pub fn new(viewer: Viewer, world: &mut World, push: bool) -> Result<Users, Failure> {
        let mut users = Users { viewer, inputs: BTreeMap::new(), hands: BTreeMap::new(), bodies: Vec::new() };
        for k in 0..if push { users.viewer.users.len() } else { 0 } {
            let (pose, half) = users.body_pose(k, users.half_length(k));
            let shape = Shape::capsule(RADIUS_M * users.viewer.scale, half).map_err(|e| Failure::run("a user's body", e))?;
            // not drawn: the user stands in it
            let body = RigidBody::fixture(format!("user {k}"), shape).at(pose).drawn_as(Vec::new());
            let id = world.add_boxed(Box::new(body), Mode::Kinematic).map_err(|e| Failure::run("a user's body", e))?;
            users.bodies.push(id);
        }
        Ok(users)
    }

    /// What a user did.
    pub fn take(&mut self, input: Input, time_s: f64) {
        let Some(user) = self.viewer.users.get_mut(input.user as usize) else { return };
        user.head = input.head.unwrap_or(user.head);
        user.input = input.sequence;
        self.inputs.insert(input.user, (input, time_s));
    }

    /// What users do to the world during the next step of `dt` seconds.
    pub fn act(&mut self, world: &mut World, dt: f64) -> Result<(), Failure> {
        let failed = |e: WorldError| Failure::run("what a user does", e);
        self.inputs.retain(|_, (_, since)| world.time() - *since < STALE_S);
        let held: Vec<u16> = self.inputs.values().flat_map(|(input, _)| input.keys.iter().copied()).collect();
        self.walk(&held, dt);
        self.hands.retain(|user, _| self.inputs.get(user).is_some_and(|(input, _)| input.buttons & 1 == 1));
        for (&user, (input, _)) in &self.inputs {
            let Some(wand) = input.wand.filter(|_| input.buttons & 1 == 1) else { continue };
            let (origin, direction) = (self.to_scene(&wand.translation.vector), self.viewer.cave.rotation * (wand.rotation * Vec3::y()));
            if !self.hands.contains_key(&user)
                && let Some(hand) = grasp(world, &origin, &direction)
            {
                self.hands.insert(user, hand);
            }
            if let Some(hand) = self.hands.get_mut(&user) {
                hand.pull.target = origin + direction * hand.distance;
                world.pull(&hand.pull).map_err(failed)?;
            }
        }
        for k in 0..self.bodies.len() {
            let (pose, _) = self.body_pose(k, self.half_length(k));
            world.move_to(self.bodies[k], pose).map_err(failed)?;
        }
        Ok(())
    }

    /// Keys move the whole cave: the users stay where they stand in it.
    fn walk(&mut self, held: &[u16], dt: f64) {
        let is = |keys: &[u16]| f64::from(u8::from(keys.iter().any(|k| held.contains(k))));
        let ahead = is(&[key::W, key::UP]) - is(&[key::S, key::DOWN]);
        let by = Vec3::new(is(&[key::D]) - is(&[key::A]), ahead, is(&[key::E]) - is(&[key::Q]));
        let turn = (is(&[key::LEFT]) - is(&[key::RIGHT])) * TURN_RAD_PER_S * dt;
        let cave = &mut self.viewer.cave;
        cave.translation.vector += cave.rotation * by * (WALK_M_PER_S * self.viewer.scale * dt);
        if turn != 0.0
            && let Some(user) = self.viewer.users.first()
        {
            // about the first user
            let eye = user.head.translation.vector * self.viewer.scale;
            let pivot = *cave * nalgebra::Point3::from(eye);
            cave.rotation = nalgebra::UnitQuaternion::from_axis_angle(&Vec3::z_axis(), turn) * cave.rotation;
            cave.renormalize();
            cave.translation.vector = pivot.coords - cave.rotation * eye;
        }
    }

    fn to_scene(&self, point: &Vec3) -> Vec3 {
        (self.viewer.cave * nalgebra::Point3::from(point * self.viewer.scale)).coords
    }

    /// Half the straight part of a user's capsule, from the floor to the head where that is high enough, m of the scene.
    fn half_length(&self, user: usize) -> f64 {
        let height = self.viewer.users[user].head.translation.z;
        (0.5 * height - RADIUS_M).max(0.01) * self.viewer.scale
    }

    /// Where a user's capsule is wanted, and half its straight part.
    fn body_pose(&self, user: usize, half: f64) -> (Pose, f64) {
        let mut at = self.viewer.users[user].head.translation.vector;
        at.z = half / self.viewer.scale + RADIUS_M;
        (Pose::from_parts(self.to_scene(&at).into(), self.viewer.cave.rotation), half)
    }
}

trait Renormalize {
    fn renormalize(&mut self);
}

impl Renormalize for Pose {
    /// Turns add up over days; the rotation stays one.
    fn renormalize(&mut self) {
        self.rotation.renormalize();
    }
}

/// Takes hold of the first thing on a ray, if it moves.
fn grasp(world: &World, origin: &Vec3, direction: &Vec3) -> Option<Hand> {
    let mut first: Option<(ObjectId, usize, f64)> = None;
    for &id in world.ids() {
        let Some(renderable) = world.object(id).and_then(|o| o.renderable()).filter(|_| world.status(id).is_some_and(|s| s.alive)) else { continue };
        for visual in renderable.visuals() {
            let Some(site) = world.site(id, visual.part) else { continue };
            let Some(distance) = visual.shape.ray(&(site.pose * visual.pose), origin, direction) else { continue };
            if first.is_none_or(|(_, _, nearest)| distance < nearest) {
                first = Some((id, visual.part, distance));
            }
        }
    }
    let (id, part, distance) = first?;
    let moves = world.status(id)?.moves() && world.object(id)?.collidable().is_some_and(|c| c.part_moves(part));
    let site = world.site(id, part).filter(|_| moves)?;
    let target = origin + direction * distance;
    let point = site.pose.rotation.inverse() * (target - site.position());
    Some(Hand { pull: Pull { id, part, point, target, frequency: PULL_RAD_PER_S }, distance })
}

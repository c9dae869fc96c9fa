//! The users in the world: heads, motion by keys and trackers, wands that pull bodies, colliders.
//!
//! Each user has at most one wand per device that sends its input. While its first button is held,
//! a spring pulls the first body on the wand's ray. The colliders are in
//! [`user_colliders`](super::user_colliders).

use super::user_colliders::{Hand, UserColliders};
use crate::failure::Failure;
use std::collections::BTreeMap;
use tumble::collide::{Pose, Vec3};
use tumble::dynamics::{ObjectId, PickForce, World, WorldError};
use tumble::net::sync::transport::FacetNumber;
use tumble::net::sync::{Input, Viewer};
use tumble::scene::cave::{Cave, Screen};

/// Speed of walking, meters of the cave per second, and of turning, rad/s, while a key is held.
const WALK_M_PER_S: f64 = 1.5;
const TURN_RAD_PER_S: f64 = 1.0;
/// Frequency of the wand's spring, rad/s.
pub(super) const PULL_RAD_PER_S: f64 = 10.0;
/// Source of the pace of walking; no facet and no other device has the number.
pub const PACE_SOURCE: FacetNumber = FacetNumber::MAX - 1;
/// Fastest pace, s of wall time per simulated s.
const MAX_PACE: f64 = 20.0;
/// Time after which an input that was not renewed expires, simulated s.
const INPUT_TIMEOUT_S: f64 = 1.0;
/// Minimum distance of an eye from the plane of a screen that is drawn for it, m.
const MIN_EYE_DISTANCE_M: f64 = 0.02;

/// Keys by USB HID usage.
pub mod key {
    pub const A: u16 = 0x04;
    pub const B: u16 = 0x05;
    pub const D: u16 = 0x07;
    pub const E: u16 = 0x08;
    pub const Q: u16 = 0x14;
    pub const S: u16 = 0x16;
    pub const V: u16 = 0x19;
    pub const W: u16 = 0x1A;
    pub const RIGHT: u16 = 0x4F;
    pub const LEFT: u16 = 0x50;
    pub const DOWN: u16 = 0x51;
    pub const UP: u16 = 0x52;
}

/// Keys that extend the left and the right hand.
const HAND_KEYS: [u16; 2] = [key::V, key::B];

/// Source of an input, and its user.
pub(super) type Device = (FacetNumber, u16);

/// All users of a run.
pub struct Users {
    /// The viewer that is published.
    pub viewer: Viewer,
    /// Head poses not applied, because an eye would be behind a screen or in it.
    pub heads_rejected: u64,
    /// Screens that are drawn for each user.
    screens: Vec<Vec<Screen>>,
    /// The newest input of each device, and its arrival.
    pub(super) inputs: BTreeMap<Device, (Input, f64)>,
    pub(super) held: BTreeMap<Device, Grabbed>,
    /// Keys held in the last step.
    pub(super) pressed: Vec<u16>,
    colliders: UserColliders,
    /// Time by which users walk, s per simulated s. Users live in wall time: where the simulation is
    /// slower, they walk more in each step.
    pub(super) pace: f64,
}

/// A body grabbed by a wand.
pub(super) struct Grabbed {
    pub pull: PickForce,
    /// Distance from the wand's origin along its ray, m.
    pub distance: f64,
}

impl Users {
    /// Places the users as the files define them; with `user_colliders` it adds their colliders.
    pub fn new(viewer: Viewer, cave: &Cave, world: &mut World, user_colliders: bool) -> Result<Users, Failure> {
        let drawn = |user: usize| {
            cave.facets.iter().filter(|f| f.user == user).map(|f| cave.screens[f.screen].clone()).collect()
        };
        let screens = (0..viewer.users.len()).map(drawn).collect();
        let colliders = if user_colliders { UserColliders::add(&viewer, world)? } else { UserColliders::default() };
        Ok(Users {
            viewer,
            heads_rejected: 0,
            screens,
            inputs: BTreeMap::new(),
            held: BTreeMap::new(),
            pressed: Vec::new(),
            colliders,
            pace: 1.0,
        })
    }

    /// Returns the pace as an input for [`take`](Self::take), by which recordings have it too: walking
    /// depends on the wall time, and a replay on the recording alone. `None` if nobody walks. `wall_s`
    /// is the wall time of a frame of `frame_s` simulated seconds.
    pub fn pace(&self, wall_s: f64, frame_s: f64) -> Option<Input> {
        let walks = |input: &Input| input.keys.iter().any(|key| !HAND_KEYS.contains(key));
        let sequence = ((wall_s / frame_s).clamp(1.0, MAX_PACE) * 1e6).round() as u64;
        let pace = Input { sequence, user: 0, head: None, wand: None, hands: [None; 2], buttons: 0, keys: Vec::new() };
        self.inputs.values().any(|(input, _)| walks(input)).then_some(pace)
    }

    /// Takes an input of a facet's window or another device, or the pace.
    pub fn take(&mut self, from: FacetNumber, input: Input, time_s: f64) {
        if from == PACE_SOURCE {
            self.pace = (input.sequence as f64 * 1e-6).clamp(1.0, MAX_PACE);
            return;
        }
        let Some(user) = self.viewer.users.get_mut(input.user as usize) else { return };
        if let Some(head) = input.head {
            let aside = 0.5 * user.interpupillary_m;
            let eyes = [-aside, 0.0, aside].map(|x| head * nalgebra::Point3::new(x, 0.0, 0.0));
            let screens = &self.screens[input.user as usize];
            let seen = screens.iter().all(|screen| eyes.iter().all(|eye| screen.distance_m(eye) >= MIN_EYE_DISTANCE_M));
            if seen { user.head = head } else { self.heads_rejected += 1 }
        }
        user.input = input.sequence;
        self.inputs.insert((from, input.user), (input, time_s));
    }

    /// Forgets all inputs: nothing is held or pressed. The users stay where they are.
    pub fn release(&mut self) {
        self.inputs.clear();
        self.held.clear();
        self.pressed.clear();
    }

    /// Applies the users' input for the next step of `dt` seconds.
    pub fn act(&mut self, world: &mut World, dt: f64) -> Result<(), Failure> {
        let failed = |e: WorldError| Failure::run("what a user does", e);
        self.inputs.retain(|_, (_, since)| world.time() - *since < INPUT_TIMEOUT_S);
        let keys: Vec<u16> = self.inputs.values().flat_map(|(input, _)| input.keys.iter().copied()).collect();
        for key in keys.iter().filter(|key| !self.pressed.contains(key)) {
            if let Some(name) = name_of(*key) {
                world.press(&name);
            }
        }
        self.pressed.clone_from(&keys);
        self.walk(&keys, dt * self.pace);
        self.held.retain(|device, _| self.inputs.get(device).is_some_and(|(input, _)| input.buttons & 1 == 1));
        for (&device, (input, _)) in &self.inputs {
            let Some(wand) = input.wand.filter(|_| input.buttons & 1 == 1) else { continue };
            let (origin, direction) =
                (self.to_scene(&wand.translation.vector), self.viewer.cave.rotation * (wand.rotation * Vec3::y()));
            if !self.held.contains_key(&device)
                && let Some(held) = grab(world, &self.colliders, &origin, &direction)
            {
                self.held.insert(device, held);
            }
            if let Some(held) = self.held.get_mut(&device) {
                held.pull.target = origin + direction * held.distance;
                held.pull.apply(world).map_err(failed)?;
            }
        }
        self.colliders.follow_users(&self.viewer, |user| self.hands(user), world, dt).map_err(failed)
    }

    /// Returns the targets of a user's hands: tracked, else by keys.
    fn hands(&self, user: usize) -> [Hand; 2] {
        let mut hands = [Hand::AtRest; 2];
        for (input, _) in self.inputs.values().filter(|(input, _)| input.user as usize == user) {
            for (side, hand) in hands.iter_mut().enumerate() {
                match input.hands[side] {
                    Some(pose) => *hand = Hand::Tracked(pose),
                    None if input.keys.contains(&HAND_KEYS[side]) && *hand == Hand::AtRest => *hand = Hand::Extended,
                    None => {}
                }
            }
        }
        hands
    }

    /// Moves the whole cave by keys; the users keep their place in it.
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
}

trait Renormalize {
    fn renormalize(&mut self);
}

impl Renormalize for Pose {
    /// Normalizes the rotation, because rounding errors of rotations accumulate.
    fn renormalize(&mut self) {
        self.rotation.renormalize();
    }
}

/// Grabs the first body on a ray if it can move. The users' colliders are ignored.
fn grab(world: &World, colliders: &UserColliders, origin: &Vec3, direction: &Vec3) -> Option<Grabbed> {
    let mut first: Option<(ObjectId, usize, f64)> = None;
    for &id in world.ids().iter().filter(|id| !colliders.contains(**id)) {
        let Some(renderable) =
            world.object(id).and_then(|o| o.renderable()).filter(|_| world.status(id).is_some_and(|s| s.enabled))
        else {
            continue;
        };
        for visual in renderable.visuals() {
            let Some(part_state) = world.part_state(id, visual.part) else { continue };
            let Some(distance) = visual.ray(&part_state.pose, origin, direction) else { continue };
            if first.is_none_or(|(_, _, nearest)| distance < nearest) {
                first = Some((id, visual.part, distance));
            }
        }
    }
    let (id, part, distance) = first?;
    let moves = world.status(id)?.moves() && world.object(id)?.collidable().is_some_and(|c| c.part_moves(part));
    let part_state = world.part_state(id, part).filter(|_| moves)?;
    let target = origin + direction * distance;
    let point = part_state.pose.rotation.inverse() * (target - part_state.position());
    Some(Grabbed { pull: PickForce { id, part, point, target, frequency: PULL_RAD_PER_S }, distance })
}

/// Returns the name of a key for scripted events from its USB HID usage: a letter, a digit or `enter`.
fn name_of(usage: u16) -> Option<String> {
    let shifted = |first: char, by: u16| char::from_u32(u32::from(first) + u32::from(by)).map(String::from);
    match usage {
        0x04..=0x1D => shifted('a', usage - 0x04),
        0x1E..=0x26 => shifted('1', usage - 0x1E),
        0x27 => Some("0".into()),
        0x28 => Some("enter".into()),
        _ => None,
    }
}

//! Sleep: islands that lie still are left out of the steps until something touches them (off unless [`Settings::sleep`](crate::Settings::sleep) says so).
//!
//! ```text
//! still(b, t)   = no point of b was further than `within` from where it was, since t₀ ≤ t − `after`
//! asleep(G)     ⇐ still(b) for all b of G, G a component of the graph of contacts and constraints among what moves
//! awake(G)      ⇐ a mover, or what is led, comes within a contact's margin of G · the forces on G change · somebody changes G or what it lies on
//! ```
//!
//! A frame in which something touches a sleeper, or in which the forces on it are others than when it fell asleep, is taken back and done again with the
//! whole island awake: no impulse ever meets a sleeper as if it were a wall. Who wakes starts from the contact forces it fell asleep with.
//!
//! | symbol | meaning |
//! |---|---|
//! | within, after | [`Sleep::within`], [`Sleep::after`] |
//! | G | a group: objects that fell asleep together, and wake together |
//!
//! What sleep costs in truth is the velocity that a sleeper had: at most `within/after`. Objects of kinds of their own sleep where they say so
//! ([`Integratable::may_sleep`](crate::Integratable::may_sleep)); beside a constraint that does not name its objects
//! ([`Constraint::partners`](crate::Constraint::partners)) nothing does.

use crate::detect::ContactKey;
use crate::object::Constraint;
use crate::part_state::{PartState, Wrench};
use crate::row_builder::constraints;
use crate::view::{Entry, Mode, ObjectId};
use crate::world::Core;
use serde::{Deserialize, Serialize};
use tumble_collide::Pose;

/// When islands fall asleep.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sleep {
    /// Simulated seconds that all of an island must have been still, above 0.
    pub after: f64,
    /// Metres that the furthest point of a body may have moved in that time, above 0.
    pub within: f64,
}

impl Default for Sleep {
    /// Half a second within a hundredth of a millimetre.
    fn default() -> Sleep {
        Sleep { after: 0.5, within: 1e-5 }
    }
}

/// Since when an object has been still, and where its parts were then: position and quaternion `x, y, z, w`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct RestTimer {
    pub since: f64,
    pub from: Vec<[f64; 7]>,
}

/// Objects that fell asleep together. Serials, ascending.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct SleepGroup {
    pub members: Vec<u32>,
    /// What they lie on or hang from that does not move, and where it was.
    pub watched: Vec<(u32, Vec<[f64; 7]>)>,
    /// Forces and torques on the members' parts and freedoms by others than themselves; `None` until the first frame asleep.
    pub load: Option<Vec<f64>>,
    /// Contact forces they fell asleep with.
    pub warm: Vec<(ContactKey, [f64; 3])>,
}

/// The groups, and what was stirred during the frame.
#[derive(Clone, Debug, Default)]
pub(crate) struct Sleepers {
    pub groups: Vec<SleepGroup>,
    pub wake_requests: Vec<u32>,
}

fn numbers(pose: &Pose) -> [f64; 7] {
    let (p, q) = (&pose.translation.vector, &pose.rotation.coords);
    [p.x, p.y, p.z, q.x, q.y, q.z, q.w]
}

fn poses(part_states: &[PartState]) -> Vec<[f64; 7]> {
    part_states.iter().map(|s| numbers(&s.pose)).collect()
}

fn at_rest(part_states: &[PartState]) -> bool {
    part_states.iter().all(|s| s.velocity.norm_squared() + s.angular_velocity.norm_squared() == 0.0)
}

/// How far the furthest point of a body of this bounding radius has come at most, metres: the way of its middle, and the chord of its turn.
fn moved(from: &[f64; 7], to: &[f64; 7], radius: f64) -> f64 {
    let way: f64 = (0..3).map(|i| (to[i] - from[i]).powi(2)).sum::<f64>().sqrt();
    // the chord of the quaternions is half the turn; q and −q are one orientation
    let chord = |sign: f64| (3..7).map(|i| (to[i] - sign * from[i]).powi(2)).sum::<f64>().sqrt();
    way + 2.0 * chord(1.0).min(chord(-1.0)) * radius
}

impl SleepGroup {
    /// Whether a snapshot may hold it.
    pub fn sound(&self) -> bool {
        let finite = |numbers: &[f64]| numbers.iter().all(|x| x.is_finite());
        let fine = self.load.iter().all(|load| finite(load))
            && self.warm.iter().all(|w| finite(&w.1))
            && self.watched.iter().flat_map(|w| &w.1).all(|p| finite(p));
        fine && !self.members.is_empty() && self.members.is_sorted_by(|a, b| a < b)
    }
}

impl Core {
    fn by_serial(&self, serial: u32) -> Option<ObjectId> {
        let order = &self.table.order;
        let place = order.binary_search_by_key(&serial, |&id| self.table.slots[id].serial).ok()?;
        Some(order[place])
    }

    /// Wakes whoever sleeps with the object or on it, and the object.
    pub(crate) fn wake(&mut self, id: ObjectId) {
        let Some(serial) = self.table.slots.get(id).map(|e| e.serial) else { return };
        self.wake_groups(|g| g.members.binary_search(&serial).is_ok() || g.watched.iter().any(|w| w.0 == serial));
    }

    /// Wakes everybody.
    pub(crate) fn wake_all(&mut self) {
        self.wake_groups(|_| true);
    }

    fn wake_groups(&mut self, mut which: impl FnMut(&SleepGroup) -> bool) {
        let (gone, kept) = std::mem::take(&mut self.sleepers.groups).into_iter().partition::<Vec<_>, _>(|g| which(g));
        self.sleepers.groups = kept;
        for group in gone {
            for id in group.members.iter().filter_map(|&s| self.by_serial(s)).collect::<Vec<_>>() {
                let entry = &mut self.table.slots[id];
                entry.asleep = false;
                entry.rest_timer =
                    RestTimer { since: self.time, from: poses(&self.part_states[entry.state_range.parts.clone()]) };
            }
            self.warm.add(group.warm);
        }
    }

    /// Before a frame: wakes those that are pushed, and those whose bed has moved, moves, or is gone.
    pub(crate) fn wake_disturbed(&mut self) {
        self.sleepers.wake_requests.clear();
        if self.sleepers.groups.is_empty() {
            return;
        }
        let disturbed: Vec<bool> = self.sleepers.groups.iter().map(|g| self.disturbed(g)).collect();
        let mut disturbed = disturbed.into_iter();
        self.wake_groups(|_| disturbed.next().unwrap_or(false));
    }

    fn disturbed(&self, group: &SleepGroup) -> bool {
        let pushed = |e: &Entry| self.pushed(e);
        let support = |(serial, from): &(u32, Vec<[f64; 7]>)| {
            let Some(e) = self.by_serial(*serial).map(|id| &self.table.slots[id]) else { return true };
            let part_states = &self.part_states[e.state_range.parts.clone()];
            e.moves() || !e.status.enabled || !at_rest(part_states) || poses(part_states) != *from
        };
        group.members.iter().filter_map(|&s| self.by_serial(s)).any(|id| pushed(&self.table.slots[id]))
            || group.watched.iter().any(support)
    }

    /// Whether a user pushes the object during this frame.
    fn pushed(&self, e: &Entry) -> bool {
        let generalized = self.applied_generalized[e.state_range.v.clone()].iter().any(|f| *f != 0.0);
        generalized || self.applied[e.state_range.parts.clone()].iter().any(|w| *w != Wrench::default())
    }

    /// After a frame: whether it stirred a sleeper, so that it must be done again. Notes the loads of those who sleep their first frame.
    pub(crate) fn needs_wake(&mut self) -> bool {
        for i in 0..self.sleepers.groups.len() {
            let load = self.load(&self.sleepers.groups[i]);
            let group = &mut self.sleepers.groups[i];
            if group.load.get_or_insert_with(|| load.clone()) != &load {
                self.sleepers.wake_requests.push(group.members[0]);
            }
        }
        !self.sleepers.wake_requests.is_empty()
    }

    fn load(&self, group: &SleepGroup) -> Vec<f64> {
        let mut load = Vec::new();
        for id in group.members.iter().filter_map(|&s| self.by_serial(s)) {
            let state_range = &self.table.slots[id].state_range;
            load.extend(self.forces.generalized.get(state_range.v.clone()).unwrap_or_default());
            let wrenches = self.forces.wrenches.get(state_range.parts.clone()).unwrap_or_default();
            load.extend(
                wrenches.iter().flat_map(|w| w.torque.iter().chain(w.force.iter()).copied().collect::<Vec<_>>()),
            );
        }
        load
    }

    /// Wakes those whom the frame stirred; the state is that before it again.
    pub(crate) fn wake_requested(&mut self) {
        let wake_requests = std::mem::take(&mut self.sleepers.wake_requests);
        self.wake_groups(|g| wake_requests.iter().any(|s| g.members.binary_search(s).is_ok()));
    }

    /// After a frame: the islands that have been still for long enough fall asleep.
    pub(crate) fn fall_asleep(&mut self) {
        let Some(sleep) = self.settings.sleep else { return };
        let ready = self.at_rest_for(&sleep);
        if !ready.contains(&true) {
            return;
        }
        let Some(bonds) = self.bonds() else { return };
        let place = |id: ObjectId| {
            self.table.order.binary_search_by_key(&self.table.slots[id].serial, |&o| self.table.slots[o].serial).ok()
        };
        let mut ready = ready;
        let mut parent: Vec<usize> = (0..ready.len()).collect();
        let mut supports: Vec<(usize, ObjectId)> = Vec::new();
        for [a, b] in bonds {
            let (Some(i), Some(j)) = (place(a), place(b)) else { continue };
            let (one, other) = (&self.table.slots[a], &self.table.slots[b]);
            match (one.moves(), other.moves()) {
                (true, true) => {
                    let (i, j) = (root(&parent, i), root(&parent, j));
                    parent[i.max(j)] = i.min(j);
                }
                (true, false) | (false, true) => {
                    let (mover, support) = if one.moves() { (i, b) } else { (j, a) };
                    ready[mover] &= at_rest(&self.part_states[self.table.slots[support].state_range.parts.clone()]);
                    supports.push((mover, support));
                }
                (false, false) => {}
            }
        }
        let roots: Vec<usize> = (0..parent.len()).map(|i| root(&parent, i)).collect();
        let mut calm = vec![true; parent.len()];
        for i in (0..parent.len()).filter(|&i| self.table.slots[self.table.order[i]].moves()) {
            calm[roots[i]] &= ready[i];
        }
        for r in (0..parent.len()).filter(|&r| roots[r] == r && calm[r] && ready[r]) {
            let members: Vec<usize> = (r..parent.len()).filter(|&i| roots[i] == r).collect();
            let watched =
                supports.iter().filter(|(mover, _)| roots[*mover] == r).map(|(_, support)| *support).collect();
            self.put_to_sleep(&members, watched);
        }
        self.integration().refresh();
    }

    /// Which objects, in their order, have been still for as long as `sleep` asks; begins anew for those that moved.
    fn at_rest_for(&mut self, sleep: &Sleep) -> Vec<bool> {
        let mut ready = Vec::with_capacity(self.table.order.len());
        for &id in &self.table.order {
            let entry = &self.table.slots[id];
            if !entry.moves() || !entry.object.integratable().is_some_and(|b| b.may_sleep()) {
                ready.push(false);
                continue;
            }
            let now = poses(&self.part_states[entry.state_range.parts.clone()]);
            let radius = |part: usize| {
                entry
                    .object
                    .collidable()
                    .and_then(|c| c.shape(part))
                    .map(|s| s.bounding_radius())
                    .filter(|r| r.is_finite())
                    .unwrap_or(0.0)
            };
            let far =
                |(part, (from, to)): (usize, (&[f64; 7], &[f64; 7]))| moved(from, to, radius(part)) > sleep.within;
            let from = &entry.rest_timer.from;
            let restless = from.len() != now.len() || self.pushed(entry) || from.iter().zip(&now).enumerate().any(far);
            ready.push(!restless && self.time - entry.rest_timer.since >= sleep.after);
            if restless {
                self.table.slots[id].rest_timer = RestTimer { since: self.time, from: now };
            }
        }
        ready
    }

    /// Pairs of objects that touch or are joined; `None` where a constraint does not say whom it joins.
    fn bonds(&self) -> Option<Vec<[ObjectId; 2]>> {
        let mut bonds: Vec<[ObjectId; 2]> = self.contacts.iter().map(|c| [c.a, c.b]).collect();
        let mut partners = Vec::new();
        for (_, _, constraint) in constraints(&self.table).filter(|(_, _, c): &(_, _, &dyn Constraint)| !c.on_itself())
        {
            partners.clear();
            if !constraint.partners(&mut partners) {
                return None;
            }
            partners.retain(|&id| self.table.slots.contains_key(id));
            bonds.extend(partners.windows(2).map(|w| [w[0], w[1]]));
        }
        Some(bonds)
    }

    fn put_to_sleep(&mut self, members: &[usize], watched: Vec<ObjectId>) {
        let mut group = SleepGroup::default();
        for &i in members {
            let id = self.table.order[i];
            let entry = &mut self.table.slots[id];
            entry.asleep = true;
            group.members.push(entry.serial);
            if let Some(body) = entry.object.integratable() {
                body.write_velocity(&mut self.x[entry.state_range.x.clone()], &vec![0.0; entry.state_range.v.len()]);
            }
        }
        let support = |id: &ObjectId| {
            let e = &self.table.slots[*id];
            (e.serial, poses(&self.part_states[e.state_range.parts.clone()]))
        };
        group.watched = watched.iter().map(support).collect();
        group.watched.sort_by_key(|w| w.0);
        group.watched.dedup_by_key(|w| w.0);
        let ours = |serial: &u32| group.members.binary_search(serial).is_ok();
        group.warm = self.warm.take(|key| ours(&key.pair[0]) || ours(&key.pair[2]));
        self.sleepers.groups.push(group);
    }
}

fn root(parent: &[usize], mut i: usize) -> usize {
    while parent[i] != i {
        i = parent[i];
    }
    i
}

impl Entry {
    /// Whether it comes towards others by itself: moved by forces, or led with a velocity.
    pub fn approaches(&self, part_states: &[PartState]) -> bool {
        self.moves()
            || (self.status.enabled
                && self.status.mode == Mode::Kinematic
                && !at_rest(&part_states[self.state_range.parts.clone()]))
    }
}

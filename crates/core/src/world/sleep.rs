//! Sleep: islands at rest are left out of the steps until they are disturbed. Off by default; see
//! [`Settings::sleep`](crate::Settings::sleep).
//!
//! ```text
//! still(b, t)   = no point of b was further than `within` from where it was, since t₀ ≤ t − `after`
//! asleep(G)     ⇐ still(b) for all b of G, G a component of the graph of contacts and constraints among moving objects
//! awake(G)      ⇐ a dynamic or moving kinematic object comes within a contact's margin of G · the forces on G change · G or a support of it is changed
//! ```
//!
//! A frame is rolled back and repeated with the whole island awake if an object touches it, or if
//! the forces on a sleeping object differ from those with which it fell asleep. So a sleeping
//! object never acts as a wall in an impact. An island wakes with the contact forces with which it
//! fell asleep.
//!
//! | symbol | meaning |
//! |---|---|
//! | within, after | [`Sleep::within`], [`Sleep::after`] |
//! | G | a group: objects that fell asleep together, and wake together |
//!
//! The error of sleep is the velocity that a sleeping object had: at most `within/after`. Objects
//! of other crates sleep if [`Integratable::may_sleep`](crate::Integratable::may_sleep) returns
//! true. No object sleeps while a constraint does not name its objects
//! ([`Constraint::partners`](crate::Constraint::partners)).

use crate::clone_by_field::clone_by_field;
use crate::contact::detect::ContactKey;
use crate::contact::warm_starts::{RowStart, WarmStart};
use crate::object::part_state::{PartState, Wrench};
use crate::world::Core;
use crate::world::view::{Entry, Mode, ObjectId};
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;
use tumble_collide::{Pose, Vec3};

/// Conditions under which islands fall asleep.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sleep {
    /// Simulated seconds for which a whole island must have been still, above 0.
    pub after: f64,
    /// Maximum displacement of any point of a body in that time, meters, above 0.
    pub within: f64,
}

impl Default for Sleep {
    /// Returns half a second and a hundredth of a millimeter.
    fn default() -> Sleep {
        Sleep { after: 0.5, within: 1e-5 }
    }
}

/// Time (s) since which an object has been still, and the poses of its parts then: position and
/// quaternion `x, y, z, w`.
#[derive(Debug, Default, Serialize, Deserialize)]
pub(crate) struct RestTimer {
    pub since: f64,
    pub from: Vec<[f64; 7]>,
}

clone_by_field!(RestTimer { since, from });

impl RestTimer {
    /// Returns whether all of its numbers are finite.
    pub fn is_finite(&self) -> bool {
        self.from.iter().flatten().chain([&self.since]).all(|x| x.is_finite())
    }
}

/// Objects that fell asleep together, by ascending serial numbers.
#[derive(Debug, Default, Serialize, Deserialize)]
pub(crate) struct SleepGroup {
    pub members: Vec<u32>,
    pub supports: Vec<Support>,
    /// External forces and torques on the members' parts and degrees of freedom; `None` until the
    /// first frame asleep.
    pub load: Option<Vec<f64>>,
    /// Contact forces with which they fell asleep.
    pub warm: Vec<WarmStart>,
    /// Forces of the constraints between them with which they fell asleep, by owner.
    pub rows: Vec<RowStart>,
}

clone_by_field!(SleepGroup { members, supports, load, warm, rows });

/// An object at rest on which members of a group lie or hang: its serial number, and the poses of
/// its parts as in [`RestTimer`].
#[derive(Debug, Default, Serialize, Deserialize)]
pub(crate) struct Support {
    pub serial: u32,
    pub poses: Vec<[f64; 7]>,
}

clone_by_field!(Support { serial, poses });

fn numbers(pose: &Pose) -> [f64; 7] {
    let (p, q) = (&pose.translation.vector, &pose.rotation.coords);
    [p.x, p.y, p.z, q.x, q.y, q.z, q.w]
}

fn poses(part_states: &[PartState]) -> impl Iterator<Item = [f64; 7]> {
    part_states.iter().map(|s| numbers(&s.pose))
}

fn write_poses(part_states: &[PartState], out: &mut Vec<[f64; 7]>) {
    out.clear();
    out.extend(poses(part_states));
}

fn at_rest(part_states: &[PartState]) -> bool {
    part_states.iter().all(|s| s.velocity.norm_squared() + s.angular_velocity.norm_squared() == 0.0)
}

/// Returns an upper bound of the displacement of any point of a body with this bounding radius,
/// meters: the displacement of its center, and the chord of its rotation.
fn moved(from: &[f64; 7], to: &[f64; 7], radius: f64) -> f64 {
    let way: f64 = (0..3).map(|i| (to[i] - from[i]).powi(2)).sum::<f64>().sqrt();
    // the chord of the quaternions is half the rotation; q and −q are one orientation
    let chord = |sign: f64| (3..7).map(|i| (to[i] - sign * from[i]).powi(2)).sum::<f64>().sqrt();
    way + 2.0 * chord(1.0).min(chord(-1.0)) * radius
}

impl SleepGroup {
    /// Returns whether it is valid in a snapshot.
    pub fn sound(&self) -> bool {
        let finite = |numbers: &[f64]| numbers.iter().all(|x| x.is_finite());
        let fine = self.load.iter().all(|load| finite(load))
            && self.warm.iter().all(WarmStart::is_finite)
            && self.rows.iter().all(|row| row.force.is_finite())
            && self.rows.is_sorted_by_key(|row| row.owner)
            && self.supports.iter().flat_map(|s| &s.poses).all(|p| finite(p));
        fine && !self.members.is_empty() && self.members.is_sorted_by(|a, b| a < b)
    }
}

impl Core {
    /// Returns the index of the object with a serial number.
    pub(crate) fn by_serial(&self, serial: u32) -> Option<usize> {
        self.state.objects.binary_search_by_key(&serial, |o| o.serial).ok()
    }

    /// Wakes the object, and all objects that sleep with it or on it.
    pub(crate) fn wake(&mut self, id: ObjectId) {
        let Some(place) = self.table.place(id) else { return };
        self.table.walk.unsettle(place);
        let mut ids = vec![id];
        if let Some(constraint) = self.table.placed[place].object.constraint() {
            constraint.partners(&mut ids);
        }
        let serials = ids.iter().filter_map(|id| Some(self.state.objects[self.table.place(*id)?].serial));
        let serials: Vec<u32> = serials.collect();
        self.wake_groups(|g| {
            serials
                .iter()
                .any(|serial| g.members.binary_search(serial).is_ok() || g.supports.iter().any(|s| s.serial == *serial))
        });
    }

    /// Wakes the objects that sleep where an object that does not move by itself has come: it touches nobody while others
    /// are not walked.
    pub(crate) fn wake_near(&mut self, id: ObjectId) {
        if self.state.groups.is_empty() {
            return;
        }
        let Some(place) = self.table.place(id) else { return };
        let balls = |place: usize| -> Vec<(Vec3, f64)> {
            let entry = self.objects().at(place);
            let Some(body) = entry.object.collidable().filter(|_| entry.status.enabled && entry.status.collidable)
            else {
                return Vec::new();
            };
            let states = self.derived.part_states[entry.state_range.parts.clone()].iter().enumerate();
            states.filter_map(|(part, s)| Some((s.position(), body.shape(part)?.bounding_radius()))).collect()
        };
        let own = balls(place);
        let meets = |serial: &u32| {
            let other = self.by_serial(*serial).map(balls).unwrap_or_default();
            other.iter().any(|(p, r)| own.iter().any(|(q, s)| (p - q).norm() <= r + s))
        };
        let met: Vec<u32> = if own.is_empty() {
            Vec::new()
        } else {
            self.state.groups.iter().filter(|g| g.members.iter().any(meets)).map(|g| g.members[0]).collect()
        };
        if !met.is_empty() {
            self.wake_groups(|g| met.contains(&g.members[0]));
        }
    }

    /// Wakes all objects.
    pub(crate) fn wake_all(&mut self) {
        self.wake_groups(|_| true);
    }

    fn wake_groups(&mut self, mut which: impl FnMut(&SleepGroup) -> bool) {
        let state = &mut self.state;
        for at in (0..state.groups.len()).rev() {
            if !which(&state.groups[at]) {
                continue;
            }
            let group = state.groups.remove(at);
            self.group_changes += 1;
            for serial in &group.members {
                let Ok(place) = state.objects.binary_search_by_key(serial, |o| o.serial) else { continue };
                self.table.walk.unsettle(place);
                let object = &mut state.objects[place];
                object.asleep = false;
                object.rest.since = state.time;
                write_poses(
                    &self.derived.part_states[self.table.placed[place].state_range.parts.clone()],
                    &mut object.rest.from,
                );
            }
            state.warm.add(group.warm);
        }
    }

    /// Before a frame: wakes groups with applied forces, and groups whose support has moved, moves,
    /// or is gone.
    pub(crate) fn wake_disturbed(&mut self) {
        self.open_groups();
        let groups = self.open_groups.iter().map(|&at| &self.state.groups[at as usize]);
        let disturbed: Vec<u32> = groups.filter(|g| self.disturbed(g)).map(|g| g.members[0]).collect();
        if !disturbed.is_empty() {
            self.wake_groups(|g| disturbed.contains(&g.members[0]));
        }
    }

    /// Lists the groups that a frame may disturb: all but those whose members and supports are settled.
    fn open_groups(&mut self) {
        let changes = [self.group_changes, self.table.walk.changes];
        if self.open_groups_of == Some(changes) {
            return;
        }
        self.open_groups_of = Some(changes);
        let mut open = std::mem::take(&mut self.open_groups);
        open.clear();
        let settled = |serial: u32| self.by_serial(serial).is_some_and(|place| self.table.walk.is_settled(place));
        let closed = |g: &SleepGroup| {
            g.load.is_some()
                && g.members.iter().all(|serial| settled(*serial))
                && g.supports.iter().all(|support| settled(support.serial))
        };
        open.extend((0..).zip(&self.state.groups).filter(|(_, g)| !closed(g)).map(|(at, _): (u32, _)| at));
        self.open_groups = open;
    }

    fn disturbed(&self, group: &SleepGroup) -> bool {
        let changed = |support: &Support| {
            let Some(e) = self.by_serial(support.serial).map(|place| self.objects().at(place)) else { return true };
            let part_states = &self.derived.part_states[e.state_range.parts.clone()];
            e.moves()
                || !e.status.enabled
                || !at_rest(part_states)
                || !poses(part_states).eq(support.poses.iter().copied())
        };
        group.members.iter().filter_map(|&s| self.by_serial(s)).any(|place| self.pushed(self.objects().at(place)))
            || group.supports.iter().any(changed)
    }

    /// Returns whether a force is applied to the object during this frame.
    fn pushed(&self, e: Entry) -> bool {
        let generalized = self.applied_generalized()[e.state_range.v.clone()].iter().any(|f| *f != 0.0);
        generalized || self.state.applied[e.state_range.parts.clone()].iter().any(|w| *w != Wrench::default())
    }

    /// After a frame: requests to wake the groups whose external forces have changed. Stores the
    /// forces on groups that sleep their first frame.
    pub(crate) fn request_wake_by_load(&mut self) {
        self.open_groups();
        for &at in &self.open_groups {
            let load = self.load(&self.state.groups[at as usize]);
            let group = &mut self.state.groups[at as usize];
            self.group_changes += u64::from(group.load.is_none());
            if group.load.get_or_insert_with(|| load.clone()) != &load {
                self.needs_wake.push(group.members[0]);
            }
        }
    }

    fn load(&self, group: &SleepGroup) -> Vec<f64> {
        let mut load = Vec::new();
        for place in group.members.iter().filter_map(|&s| self.by_serial(s)) {
            let state_range = &self.table.placed[place].state_range;
            if self.table.walk.is_settled(place) {
                // no force acts on it, and its degrees of freedom have no number in this frame
                load.resize(load.len() + state_range.v.len() + 6 * state_range.parts.len(), 0.0);
                continue;
            }
            load.extend(self.forces.generalized.get(state_range.v.clone()).unwrap_or_default());
            let wrenches = self.forces.wrenches.get(state_range.parts.clone()).unwrap_or_default();
            wrenches.iter().for_each(|w| load.extend(w.torque.iter().chain(w.force.iter())));
        }
        load
    }

    /// Wakes the groups that `needs_wake` names; the state is that before the frame.
    pub(crate) fn wake_requested(&mut self) {
        if self.needs_wake.is_empty() {
            return;
        }
        let requests = std::mem::take(&mut self.needs_wake);
        self.wake_groups(|g| requests.iter().any(|s| g.members.binary_search(s).is_ok()));
        self.needs_wake = requests;
    }

    /// After a frame: puts islands to sleep that have been still for long enough.
    pub(crate) fn fall_asleep(&mut self) {
        let Some(sleep) = self.settings.sleep else { return };
        let still = self.at_rest_for(&sleep);
        if still.is_empty() {
            return;
        }
        let (pairs, all_named) = self.connections();
        if !all_named {
            return;
        }
        let mut ready = vec![false; self.table.placed.len()];
        still.into_iter().for_each(|place| ready[place] = true);
        let mut supports: Vec<[usize; 2]> = Vec::new();
        for &[a, b] in &pairs {
            let (Some(i), Some(j)) = (self.table.place(a), self.table.place(b)) else { continue };
            let (first_moves, second_moves) = (self.objects().at(i).moves(), self.objects().at(j).moves());
            if first_moves != second_moves {
                let (mover, support) = if first_moves { (i, j) } else { (j, i) };
                ready[mover] &=
                    at_rest(&self.derived.part_states[self.table.placed[support].state_range.parts.clone()]);
                supports.push([mover, support]);
            }
        }
        let (island, count) = self.components(pairs, |e| e.moves());
        let mut members: Vec<Vec<usize>> = vec![Vec::new(); count];
        for entry in self.objects().iter().filter(|e| e.moves()) {
            members[island[entry.place] as usize].push(entry.place);
        }
        let number = |place: usize| island[place] as usize;
        let sleeps: Vec<bool> =
            members.iter().map(|members| !members.is_empty() && members.iter().all(|&place| ready[place])).collect();
        supports.sort_by_key(|[mover, _]| number(*mover));
        let mut warm = self.warm_of_islands(|place| Some(number(place)).filter(|island| sleeps[*island]));
        for (island, members) in members.iter().enumerate().filter(|(island, _)| sleeps[*island]) {
            let from = supports.partition_point(|[mover, _]| number(*mover) < island);
            let supports = supports[from..].iter().take_while(|[mover, _]| number(*mover) == island);
            let count = warm.partition_point(|(of, _)| *of == island);
            let warm = warm.drain(..count).map(|(_, start)| start).collect();
            self.put_to_sleep(members, supports.map(|[_, support]| *support).collect(), warm);
        }
        self.integration().refresh();
    }

    /// Returns the places of the objects that have been still for the time in `sleep`; restarts the
    /// timers of those that moved.
    fn at_rest_for(&mut self, sleep: &Sleep) -> Vec<usize> {
        let mut ready = Vec::new();
        for walked in 0..self.table.walk.places.len() {
            let place = self.table.walk.places[walked] as usize;
            let (entry, rest) = (self.objects().at(place), &self.state.objects[place].rest);
            if !entry.moves() || !entry.object.integratable().is_some_and(|b| b.may_sleep()) {
                continue;
            }
            let part_states = &self.derived.part_states[entry.state_range.parts.clone()];
            let radius = |part: usize| {
                let shape = entry.object.collidable().and_then(|c| c.shape(part));
                shape.map(|s| s.bounding_radius()).filter(|r| r.is_finite()).unwrap_or(0.0)
            };
            let far =
                |(part, (from, to)): (usize, (&[f64; 7], [f64; 7]))| moved(from, &to, radius(part)) > sleep.within;
            let restless = rest.from.len() != part_states.len()
                || self.pushed(entry)
                || rest.from.iter().zip(poses(part_states)).enumerate().any(far);
            if !restless && self.state.time - rest.since >= sleep.after {
                ready.push(place);
            }
            if restless {
                let rest = &mut self.state.objects[place].rest;
                rest.since = self.state.time;
                write_poses(part_states, &mut rest.from);
            }
        }
        ready
    }

    /// Takes the warm starts of contacts on members of islands that fall asleep, by the number of the island.
    fn warm_of_islands(&mut self, sleeping: impl Fn(usize) -> Option<usize>) -> VecDeque<(usize, WarmStart)> {
        let island = |key: &ContactKey| {
            let [a, b] = [key.pair[0], key.pair[2]].map(|serial| {
                let mover = self.by_serial(serial).filter(|&place| self.objects().at(place).moves());
                mover.and_then(&sleeping)
            });
            a.into_iter().chain(b).min()
        };
        let of: Vec<Option<usize>> = self.state.warm.keys().map(island).collect();
        let mut taken = self.state.warm.take(&of);
        taken.sort_by_key(|(island, _)| *island); // stable: their order stays
        taken.into()
    }

    fn put_to_sleep(&mut self, members: &[usize], mut supports: Vec<usize>, warm: Vec<WarmStart>) {
        let mut group = SleepGroup::default();
        for &place in members {
            let (placed, object) = (&self.table.placed[place], &mut self.state.objects[place]);
            object.asleep = true;
            group.members.push(object.serial);
            if let Some(body) = placed.object.integratable() {
                body.write_velocity(
                    &mut self.state.x[placed.state_range.x.clone()],
                    &vec![0.0; placed.state_range.v.len()],
                );
            }
        }
        supports.sort_unstable();
        supports.dedup();
        let support = |place: usize| Support {
            serial: self.state.objects[place].serial,
            poses: poses(&self.derived.part_states[self.table.placed[place].state_range.parts.clone()]).collect(),
        };
        group.supports = supports.into_iter().map(support).collect();
        group.warm = warm;
        group.rows = self.rows_between(members);
        self.state.groups.push(group);
        self.group_changes += 1;
    }

    /// Returns the forces of the constraints on any of these objects, in the last sub-step.
    fn rows_between(&self, members: &[usize]) -> Vec<RowStart> {
        let ours = |owner: u32| {
            let Some(place) = self.by_serial(owner) else { return false };
            let mut partners = Vec::new();
            let constraint = self.objects().at(place).object.constraint();
            constraint.into_iter().for_each(|constraint| _ = constraint.partners(&mut partners));
            let joined = partners.iter().filter_map(|id| self.table.place(*id));
            joined.chain([place]).any(|place| members.contains(&place))
        };
        self.state.warm.rows_by_owner().filter(|rows| ours(rows[0].owner)).flatten().copied().collect()
    }

    /// Returns the forces of the rows of an object's constraint: those of the last sub-step, or those with which
    /// its partners fell asleep.
    pub(crate) fn row_forces(&self, owner: u32) -> &[RowStart] {
        let last = self.state.warm.of_owner(owner);
        let asleep = || {
            self.state
                .groups
                .iter()
                .find_map(|g| g.rows.chunk_by(|a, b| a.owner == b.owner).find(|rows| rows[0].owner == owner))
        };
        if last.is_empty() { asleep().unwrap_or(last) } else { last }
    }
}

impl Entry<'_> {
    /// Returns whether it can move towards others: under forces, or kinematic with a velocity.
    pub fn approaches(&self, part_states: &[PartState]) -> bool {
        self.moves()
            || (self.status.enabled
                && self.status.mode == Mode::Kinematic
                && !at_rest(&part_states[self.state_range.parts.clone()]))
    }
}

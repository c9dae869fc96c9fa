//! Saving and restoring: everything that the next step reads, and nothing else.
//!
//! A snapshot is the state `X`, the switches, who sleeps and since when who is still, the sites' accelerations (objects may read them), the forces that users applied, the warm starts,
//! time and frame, and the adaptive integrator's inner step. Shapes, masses and settings are the scene's and are not in it: it is restored into
//! a world of the same objects, which is checked by their names and sizes. The sweep order of the broad phase is left out because its pairs come sorted: no result depends on it.

use super::World;
use crate::detect::WarmStarts;
use crate::part_state::Wrench;
use crate::sleep::{RestTimer, SleepGroup, Sleepers};
use crate::view::Status;
use serde::{Deserialize, Serialize};
use tumble_collide::Vec3;

/// Why a snapshot was refused. The world is unchanged.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SnapshotError {
    /// Not bytes that [`World::save`] wrote.
    #[error("not a snapshot of tumble, or cut off, or of another version: {0}")]
    Format(String),
    /// Another set of objects.
    #[error("the snapshot is of another world: object {index} is {theirs} there and {ours} here")]
    Objects {
        /// Place in the order of adding.
        index: usize,
        /// Name and size in the snapshot.
        theirs: String,
        /// Name and size here.
        ours: String,
    },
    /// A number in it is not finite.
    #[error("the snapshot holds a number that is not finite, or an orientation that is not of unit length")]
    NotFinite,
}

const MAGIC: [u8; 8] = *b"tumbleS3";
/// Objects that a world may have seen, at most; frames are capped by its square.
const MOST: u32 = 1 << 31;

#[derive(Serialize, Deserialize)]
struct Snapshot {
    magic: [u8; 8],
    time: f64,
    frame: u64,
    next_serial: u32,
    objects: Vec<Saved>,
    x: Vec<f64>,
    /// Angular, then linear acceleration of every site.
    accelerations: Vec<[f64; 6]>,
    /// Torque, then force on every site.
    applied: Vec<[f64; 6]>,
    applied_generalized: Vec<f64>,
    warm: WarmStarts,
    /// Inner step of the adaptive integrator, s.
    inner_step: f64,
    groups: Vec<SleepGroup>,
}

#[derive(Serialize, Deserialize, PartialEq)]
struct Saved {
    name: String,
    sizes: [u32; 3],
    serial: u32,
    status: Status,
    asleep: bool,
    rest_timer: RestTimer,
}

impl Saved {
    fn label(&self) -> String {
        format!("'{}' ({} state, {} freedoms, {} parts)", self.name, self.sizes[0], self.sizes[1], self.sizes[2])
    }
}

fn six(a: &Vec3, b: &Vec3) -> [f64; 6] {
    [a.x, a.y, a.z, b.x, b.y, b.z]
}

fn halves(v: &[f64; 6]) -> (Vec3, Vec3) {
    (Vec3::new(v[0], v[1], v[2]), Vec3::new(v[3], v[4], v[5]))
}

impl World {
    /// Everything that the next step reads, as bytes: the same bytes for the same state.
    pub fn save(&self) -> Vec<u8> {
        let c = &self.core;
        let snapshot = Snapshot {
            magic: MAGIC,
            time: c.time,
            frame: c.frame,
            next_serial: c.next_serial,
            objects: self.inventory(),
            x: c.x.to_vec(),
            accelerations: c.part_states.iter().map(|s| six(&s.angular_acceleration, &s.acceleration)).collect(),
            applied: c.applied.iter().map(|w| six(&w.torque, &w.force)).collect(),
            applied_generalized: c.applied_generalized.clone(),
            warm: c.warm.clone(),
            inner_step: c.inner_step,
            groups: c.sleepers.groups.clone(),
        };
        postcard::to_stdvec(&snapshot).unwrap_or_default() // writing plain numbers to memory cannot fail
    }

    /// Puts a saved state back. The world must hold the same objects in the same order.
    pub fn restore(&mut self, bytes: &[u8]) -> Result<(), SnapshotError> {
        let (saved, rest): (Snapshot, &[u8]) =
            postcard::take_from_bytes(bytes).map_err(|e| SnapshotError::Format(e.to_string()))?;
        if !rest.is_empty() {
            return Err(SnapshotError::Format(format!("{} bytes follow its end", rest.len())));
        }
        if saved.magic != MAGIC {
            return Err(SnapshotError::Format("the first eight bytes are not 'tumbleS3'".into()));
        }
        self.check(&saved)?;
        let core = &mut self.core;
        (core.time, core.frame, core.next_serial, core.warm) = (saved.time, saved.frame, saved.next_serial, saved.warm);
        core.inner_step = saved.inner_step;
        core.x.copy_from_slice(&saved.x);
        for (i, object) in saved.objects.iter().enumerate() {
            let entry = &mut core.table.slots[core.table.order[i]];
            (entry.status, entry.serial, entry.asleep) = (object.status, object.serial, object.asleep);
            entry.rest_timer.clone_from(&object.rest_timer);
            core.owners[entry.state_range.parts.clone()].iter_mut().for_each(|o| o.serial = object.serial);
        }
        for (part_state, a) in core.part_states.iter_mut().zip(&saved.accelerations) {
            (part_state.angular_acceleration, part_state.acceleration) = halves(a);
        }
        for (wrench, w) in core.applied.iter_mut().zip(&saved.applied) {
            let (torque, force) = halves(w);
            *wrench = Wrench { torque, force };
        }
        core.applied_generalized = saved.applied_generalized;
        core.sleepers = Sleepers { groups: saved.groups, wake_requests: Vec::new() };
        core.contacts.clear();
        core.clear_contact_forces();
        core.integration().refresh();
        Ok(())
    }

    fn inventory(&self) -> Vec<Saved> {
        let saved = |e: &crate::view::Entry| Saved {
            name: e.object.name().to_string(),
            sizes: [e.state_range.x.len() as u32, e.state_range.v.len() as u32, e.state_range.parts.len() as u32],
            serial: e.serial,
            status: e.status,
            asleep: e.asleep,
            rest_timer: e.rest_timer.clone(),
        };
        self.core.table.iter().map(saved).collect()
    }

    fn check(&self, saved: &Snapshot) -> Result<(), SnapshotError> {
        let ours = self.inventory();
        for index in 0..ours.len().max(saved.objects.len()) {
            let label = |list: &[Saved]| list.get(index).map_or("absent".to_string(), Saved::label);
            let (theirs, ours) = (label(&saved.objects), label(&ours));
            if theirs != ours {
                return Err(SnapshotError::Objects { index, theirs, ours });
            }
        }
        let c = &self.core;
        let sizes = |s: &Snapshot| [s.x.len(), s.accelerations.len(), s.applied.len(), s.applied_generalized.len()];
        if sizes(saved) != [c.x.len(), c.part_states.len(), c.part_states.len(), c.dof] {
            return Err(SnapshotError::Format("its tables have the wrong lengths".into()));
        }
        let numbers = saved
            .x
            .iter()
            .chain(&saved.applied_generalized)
            .chain(saved.accelerations.iter().flatten())
            .chain(saved.applied.iter().flatten());
        let steps = saved.time.is_finite() && saved.inner_step.is_finite() && saved.inner_step >= 0.0;
        let finite = steps && numbers.copied().all(f64::is_finite) && saved.warm.finite();
        let states = c
            .table
            .iter()
            .all(|e| e.object.integratable().is_none_or(|body| body.accepts(&saved.x[e.state_range.x.clone()])));
        if !(finite && states) {
            return Err(SnapshotError::NotFinite);
        }
        let mut members: Vec<u32> = saved.groups.iter().flat_map(|g| &g.members).copied().collect();
        members.sort_unstable();
        let rest_timer = saved
            .objects
            .iter()
            .flat_map(|o| o.rest_timer.from.iter().flatten().chain([&o.rest_timer.since]))
            .all(|x| x.is_finite());
        let asleep = saved.objects.iter().filter(|o| o.asleep).map(|o| o.serial);
        if !(rest_timer && saved.groups.iter().all(SleepGroup::sound) && asleep.eq(members)) {
            return Err(SnapshotError::Format("its sleepers do not add up".into()));
        }
        let counts = saved.objects.is_sorted_by(|a, b| a.serial < b.serial)
            && saved.objects.iter().all(|o| o.serial < saved.next_serial);
        if counts && saved.next_serial < MOST && saved.frame < MOST as u64 * MOST as u64 && saved.warm.in_order() {
            return Ok(());
        }
        Err(SnapshotError::Format("its counters or its contacts are out of order".into()))
    }
}

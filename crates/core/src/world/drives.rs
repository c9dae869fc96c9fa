//! The drives of a world in its snapshots: those of every object of which the program changed one since it was added.
//!
//! Drives are settings of objects, and no numbers of [`WorldState`](super::WorldState). The first access to an articulated body or a
//! loop joint by [`World::get_mut`] notes its drives. A snapshot has the drives of all noted objects that have others now; a
//! snapshot without those of an object stands for the noted ones.

use super::{SnapshotError, World};
use crate::articulated::{ArticulatedBody, DofSettings, Drive};
use crate::constraint::loop_joint::LoopJoint;
use crate::world::view::ObjectId;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::sync::Arc;

/// First bytes of the drives, behind the state.
const MAGIC: [u8; 8] = *b"tumbleD2";

/// The drives with which objects were added, of those that a program has changed.
#[derive(Clone, Debug, Default)]
pub(super) struct FirstDrives(BTreeMap<ObjectId, Arc<[Drive]>>);

/// A drive in a snapshot.
#[derive(Serialize, Deserialize)]
enum StoredDrive {
    None,
    Position([f64; 5]),
    Velocity([f64; 2]),
    /// The recorded motion with which the object was added: snapshots hold no motions.
    Added,
}

/// Drives of objects, by their index in the order of addition.
#[derive(Serialize, Deserialize)]
struct Stored {
    magic: [u8; 8],
    objects: Vec<(u32, Vec<StoredDrive>)>,
}

type Wanted = Vec<(ObjectId, Arc<[Drive]>)>;

impl World {
    /// Notes the drives of an object before they may be changed for the first time.
    pub(super) fn note_drives(&mut self, id: ObjectId) {
        if !self.first_drives.0.contains_key(&id) {
            let drives = self.drives_of(id);
            if !drives.is_empty() {
                self.first_drives.0.insert(id, drives.into());
            }
        }
    }

    /// Forgets the drives of an object that is removed.
    pub(super) fn forget_drives(&mut self, id: ObjectId) {
        self.first_drives.0.remove(&id);
    }

    /// Returns the drives of an articulated body or a loop joint; none of another object.
    fn drives_of(&self, id: ObjectId) -> Vec<Drive> {
        if let Some(body) = self.get::<ArticulatedBody>(id) {
            return body.dofs().iter().map(|dof| dof.drive.clone()).collect();
        }
        let Some(joint) = self.get::<LoopJoint>(id) else { return Vec::new() };
        (0..joint.kind().dofs()).filter_map(|k| joint.dof_at(k)).map(|dof| dof.drive.clone()).collect()
    }

    /// Appends the drives that are others than those with which their objects were added; nothing if there are none.
    pub(super) fn save_drives(&self, bytes: &mut Vec<u8>) {
        let changed = self.ids().iter().zip(0..).filter_map(|(id, place)| {
            let (first, drives) = (self.first_drives.0.get(id)?, self.drives_of(*id));
            (**first != drives[..]).then(|| (place, drives.iter().map(stored).collect()))
        });
        let objects: Vec<(u32, Vec<StoredDrive>)> = changed.collect();
        if !objects.is_empty() {
            // writing plain numbers to memory cannot fail
            bytes.extend(postcard::to_stdvec(&Stored { magic: MAGIC, objects }).unwrap_or_default());
        }
    }

    /// Returns the drives of a snapshot, which end it: those in the bytes, and the first ones of noted objects that are not in them.
    pub(super) fn read_drives(&self, bytes: &[u8]) -> Result<Wanted, SnapshotError> {
        let wrong = |what: String| SnapshotError::Format(what);
        let stored = match bytes.is_empty() {
            true => Stored { magic: MAGIC, objects: Vec::new() },
            false => postcard::take_from_bytes::<Stored>(bytes)
                .ok()
                .filter(|(stored, rest)| stored.magic == MAGIC && rest.is_empty())
                .map(|(stored, _)| stored)
                .ok_or_else(|| wrong(format!("{} bytes follow its end, which are no drives", bytes.len())))?,
        };
        let mut wanted: BTreeMap<ObjectId, Arc<[Drive]>> = self.first_drives.0.clone();
        for (place, drives) in stored.objects {
            let id = self.ids().get(place as usize).copied();
            let id = id.ok_or_else(|| wrong("its drives are of no object".into()))?;
            let first = self.first_drives.0.get(&id).cloned().unwrap_or_else(|| self.drives_of(id).into());
            if first.is_empty() || first.len() != drives.len() {
                return Err(wrong("its drives are of another object".into()));
            }
            let drives = drives.into_iter().zip(&*first).map(|(drive, first)| drive.drive(first));
            let drives: Option<Vec<Drive>> = drives.collect();
            let drives = drives.ok_or_else(|| wrong("its drives follow a motion that is not here".into()))?;
            self.fits(id, &drives).map_err(|why| wrong(format!("its drives are not valid: {why}")))?;
            wanted.insert(id, drives.into());
        }
        Ok(wanted.into_iter().filter(|(id, drives)| self.drives_of(*id) != **drives).collect())
    }

    /// Sets drives that fit their objects, which are noted.
    pub(super) fn set_drives(&mut self, wanted: Wanted) {
        for (id, drives) in wanted {
            if let Some(body) = self.get_mut::<ArticulatedBody>(id) {
                let _ = set_on_body(body, &drives); // they were checked
            } else if let Some(joint) = self.get_mut::<LoopJoint>(id) {
                let _ = set_on_joint(joint, &drives);
            }
        }
    }

    /// Checks that an object can have drives.
    fn fits(&self, id: ObjectId, drives: &[Drive]) -> Result<(), String> {
        if let Some(body) = self.get::<ArticulatedBody>(id) {
            return set_on_body(&mut body.clone(), drives);
        }
        self.get::<LoopJoint>(id).map_or(Ok(()), |joint| set_on_joint(&mut joint.clone(), drives))
    }

    /// Returns the drives with which objects were added, of those that a program has changed, by index in the order of addition.
    pub(crate) fn first_drives(&self) -> Vec<(u32, Vec<Drive>)> {
        let known = |(id, place): (&ObjectId, u32)| Some((place, self.first_drives.0.get(id)?.to_vec()));
        self.ids().iter().zip(0..).filter_map(known).collect()
    }

    /// Sets the drives with which an object was added; false if it has another number of them.
    pub(crate) fn set_first_drives(&mut self, id: ObjectId, drives: Vec<Drive>) -> bool {
        let fits = self.drives_of(id).len() == drives.len();
        if fits {
            self.first_drives.0.insert(id, drives.into());
        }
        fits
    }
}

fn set_on_body(body: &mut ArticulatedBody, drives: &[Drive]) -> Result<(), String> {
    for (index, drive) in drives.iter().enumerate() {
        let settings = DofSettings { drive: drive.clone(), ..body.dofs().get(index).cloned().unwrap_or_default() };
        body.set_dof(index, settings).map_err(|why| why.to_string())?;
    }
    Ok(())
}

fn set_on_joint(joint: &mut LoopJoint, drives: &[Drive]) -> Result<(), String> {
    for (k, drive) in drives.iter().enumerate() {
        let settings = DofSettings { drive: drive.clone(), ..joint.dof_at(k).cloned().unwrap_or_default() };
        joint.set_dof_at(k, settings).map_err(|why| why.to_string())?;
    }
    Ok(())
}

fn stored(drive: &Drive) -> StoredDrive {
    match drive {
        Drive::None => StoredDrive::None,
        Drive::Position { stiffness, damping, target, velocity, limit } => {
            StoredDrive::Position([*stiffness, *damping, *target, *velocity, *limit])
        }
        Drive::Velocity { target, limit } => StoredDrive::Velocity([*target, *limit]),
        Drive::Playback { .. } => StoredDrive::Added,
    }
}

impl StoredDrive {
    /// Returns the drive; `None` for a motion that the object did not have at first.
    fn drive(self, first: &Drive) -> Option<Drive> {
        Some(match self {
            StoredDrive::None => Drive::None,
            StoredDrive::Position([stiffness, damping, target, velocity, limit]) => {
                Drive::Position { stiffness, damping, target, velocity, limit }
            }
            StoredDrive::Velocity([target, limit]) => Drive::Velocity { target, limit },
            StoredDrive::Added => match first {
                Drive::Playback { .. } => first.clone(),
                _ => return None,
            },
        })
    }
}

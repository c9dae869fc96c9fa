//! Drives in `World.save`: those of every object of which the program changed one.
//!
//! | part | bytes |
//! |---|---|
//! | for each object: its index in the order of addition, number of drives | 4, 4 |
//! | for each drive: kind, then its numbers | 1, 8 each |
//! | length of the part above | 4 |
//! | `tumbleD1` | 8 |
//!
//! Little-endian. Kinds: 0 none, 1 position (stiffness, damping, target, velocity, limit), 2 velocity (target, limit),
//! 3 the recorded motion with which the object was added. A world in which no drive was changed has no such part, and its
//! objects get the drives with which they were added.

use crate::world::inner::Inner;
use std::collections::BTreeMap;
use tumble::dynamics::{ArticulatedBody, DofSettings, Drive, LoopJoint, ObjectId, SnapshotError, World};

const MAGIC: [u8; 8] = *b"tumbleD1";

/// The drives with which objects were added, of those of which the program changed one.
pub type Drives = BTreeMap<ObjectId, Vec<Drive>>;

/// Returns the drives of an articulated body or a loop joint; none of another object.
pub fn of(world: &World, id: ObjectId) -> Vec<Drive> {
    if let Some(body) = world.get::<ArticulatedBody>(id) {
        return body.dofs().iter().map(|dof| dof.drive.clone()).collect();
    }
    let Some(joint) = world.get::<LoopJoint>(id) else { return Vec::new() };
    (0..joint.kind().dofs()).filter_map(|k| joint.dof_at(k)).map(|dof| dof.drive.clone()).collect()
}

/// Sets the drives of an articulated body or a loop joint, where they differ.
fn set(world: &mut World, id: ObjectId, drives: &[Drive]) -> Result<(), SnapshotError> {
    if of(world, id) == drives {
        return Ok(());
    }
    let wrong = |why: String| SnapshotError::Format(format!("its drives are not valid: {why}"));
    if let Some(body) = world.get::<ArticulatedBody>(id) {
        let mut changed = body.clone();
        for (index, drive) in drives.iter().enumerate() {
            let settings = DofSettings { drive: drive.clone(), ..changed.dofs()[index].clone() };
            changed.set_dof(index, settings).map_err(|e| wrong(e.to_string()))?;
        }
        world.get_mut::<ArticulatedBody>(id).into_iter().for_each(|body| *body = changed.clone());
        return Ok(());
    }
    let Some(mut joint) = world.get::<LoopJoint>(id).cloned() else { return Ok(()) };
    for (k, drive) in drives.iter().enumerate() {
        let settings = joint.dof_at(k).cloned().unwrap_or_default();
        joint.set_dof_at(k, DofSettings { drive: drive.clone(), ..settings }).map_err(|e| wrong(e.to_string()))?;
    }
    world.get_mut::<LoopJoint>(id).into_iter().for_each(|known| *known = joint.clone());
    Ok(())
}

impl Inner {
    /// Notes the drives of an object before one is changed for the first time.
    pub fn note_drives(&mut self, id: ObjectId) {
        let world = &self.world;
        self.first_drives.entry(id).or_insert_with(|| of(world, id));
    }
}

/// Appends the drives of the objects of which the program changed one.
pub fn write(inner: &Inner, bytes: &mut Vec<u8>) {
    let first = bytes.len();
    for (place, id) in inner.world.ids().iter().enumerate() {
        if !inner.first_drives.contains_key(id) {
            continue;
        }
        let drives = of(&inner.world, *id);
        bytes.extend((place as u32).to_le_bytes());
        bytes.extend((drives.len() as u32).to_le_bytes());
        for drive in drives {
            let (kind, numbers) = match drive {
                Drive::None => (0, vec![]),
                Drive::Position { stiffness, damping, target, velocity, limit } => {
                    (1, vec![stiffness, damping, target, velocity, limit])
                }
                Drive::Velocity { target, limit } => (2, vec![target, limit]),
                Drive::Playback { .. } => (3, vec![]),
            };
            bytes.push(kind);
            bytes.extend(numbers.into_iter().flat_map(f64::to_le_bytes));
        }
    }
    let len = (bytes.len() - first) as u32;
    if len > 0 {
        bytes.extend(len.to_le_bytes());
        bytes.extend(MAGIC);
    }
}

/// Returns the bytes before the drives, and those of the drives.
pub fn split(bytes: &[u8]) -> Result<(&[u8], &[u8]), SnapshotError> {
    let Some(rest) = bytes.strip_suffix(&MAGIC) else { return Ok((bytes, &[])) };
    let cut = || SnapshotError::Format("its drives are cut off".into());
    let (rest, len) = rest.split_last_chunk::<4>().ok_or_else(cut)?;
    let at = rest.len().checked_sub(u32::from_le_bytes(*len) as usize).ok_or_else(cut)?;
    Ok(rest.split_at(at))
}

/// Restores drives: those in the bytes, and the first ones of objects that are not in them. On an error all stay.
pub fn read(inner: &mut Inner, bytes: &[u8]) -> Result<(), SnapshotError> {
    let given = parse(inner, bytes)?;
    let before: Drives = inner.first_drives.keys().chain(given.keys()).map(|id| (*id, of(&inner.world, *id))).collect();
    for id in given.keys() {
        inner.note_drives(*id);
    }
    let wanted: Vec<_> = inner.first_drives.iter().map(|(id, first)| (*id, given.get(id).unwrap_or(first))).collect();
    for (id, drives) in wanted {
        if let Err(error) = set(&mut inner.world, id, drives) {
            for (id, drives) in &before {
                set(&mut inner.world, *id, drives)?;
            }
            return Err(error);
        }
    }
    Ok(())
}

fn parse(inner: &Inner, mut bytes: &[u8]) -> Result<Drives, SnapshotError> {
    let wrong = |what: &str| SnapshotError::Format(format!("its drives {what}"));
    let cut = || wrong("are cut off");
    let mut all = Drives::new();
    while !bytes.is_empty() {
        let (place, rest) = bytes.split_first_chunk::<4>().ok_or_else(cut)?;
        let (count, rest) = rest.split_first_chunk::<4>().ok_or_else(cut)?;
        let id =
            *inner.world.ids().get(u32::from_le_bytes(*place) as usize).ok_or_else(|| wrong("are of no object"))?;
        let first = inner.first_drives.get(&id).cloned().unwrap_or_else(|| of(&inner.world, id));
        if first.is_empty() || first.len() != u32::from_le_bytes(*count) as usize {
            return Err(wrong("are of another body"));
        }
        bytes = rest;
        let mut drives = Vec::with_capacity(first.len());
        for first in first {
            let (kind, rest) = bytes.split_first().ok_or_else(cut)?;
            bytes = rest;
            let mut number = || {
                let (number, rest) = bytes.split_first_chunk::<8>().ok_or_else(cut)?;
                bytes = rest;
                Ok(f64::from_le_bytes(*number))
            };
            drives.push(match kind {
                0 => Drive::None,
                1 => Drive::Position {
                    stiffness: number()?,
                    damping: number()?,
                    target: number()?,
                    velocity: number()?,
                    limit: number()?,
                },
                2 => Drive::Velocity { target: number()?, limit: number()? },
                3 if matches!(first, Drive::Playback { .. }) => first,
                _ => return Err(wrong("are of another body")),
            });
        }
        all.insert(id, drives);
    }
    Ok(all)
}

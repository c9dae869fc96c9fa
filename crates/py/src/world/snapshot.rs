//! Format of `World.save`: the library's snapshot, which has the drives that the program changed, followed by the generalized
//! forces on articulated bodies.
//!
//! | part | bytes |
//! |---|---|
//! | snapshot of the library | any |
//! | for each body: its index in the order of addition, number of degrees of freedom, forces | 4, 4, 8 each |
//! | length of the part above | 4 |
//! | `tumbleT1` | 8 |
//!
//! Little-endian. Without such forces the last three parts are absent, and the bytes are those of
//! the command.

use crate::errors::Result;
use crate::world::inner::Inner;
use tumble::dynamics::{ObjectId, SnapshotError};

const MAGIC: [u8; 8] = *b"tumbleT1";
/// The last bytes of snapshots with drives of versions whose library had none.
const OLD_DRIVES: &[u8] = b"tumbleD1";

/// Returns the bytes of a world.
pub fn write(inner: &Inner) -> Vec<u8> {
    let mut bytes = inner.world.save();
    let first = bytes.len();
    for (place, id) in inner.world.ids().iter().enumerate() {
        let Some(forces) = inner.efforts.get(id).filter(|forces| forces.iter().any(|force| *force != 0.0)) else {
            continue;
        };
        bytes.extend((place as u32).to_le_bytes());
        bytes.extend((forces.len() as u32).to_le_bytes());
        bytes.extend(forces.iter().flat_map(|force| force.to_le_bytes()));
    }
    let len = (bytes.len() - first) as u32;
    if len > 0 {
        bytes.extend(len.to_le_bytes());
        bytes.extend(MAGIC);
    }
    bytes
}

/// Restores a world from its bytes. On an error it keeps its state.
pub fn read(inner: &mut Inner, bytes: &[u8]) -> Result<()> {
    if bytes.ends_with(OLD_DRIVES) {
        let why = "its drives are of an older version of tumble, which wrote 'tumbleD1' at the end";
        return Err(SnapshotError::Format(why.into()).into());
    }
    let (snapshot, forces) = split(bytes)?;
    let before = inner.world.save();
    inner.world.restore(snapshot)?;
    match efforts(inner, forces) {
        Ok(all) => inner.efforts = all.into_iter().collect(),
        Err(error) => {
            inner.world.restore(&before)?;
            return Err(error.into());
        }
    }
    Ok(())
}

/// Returns the snapshot and the bytes of the forces.
fn split(bytes: &[u8]) -> Result<(&[u8], &[u8]), SnapshotError> {
    let Some(rest) = bytes.strip_suffix(&MAGIC) else { return Ok((bytes, &[])) };
    let cut = || SnapshotError::Format("its generalized forces are cut off".into());
    let (rest, len) = rest.split_last_chunk::<4>().ok_or_else(cut)?;
    let at = rest.len().checked_sub(u32::from_le_bytes(*len) as usize).ok_or_else(cut)?;
    Ok(rest.split_at(at))
}

/// Returns the forces of each body and checks their number.
fn efforts(inner: &Inner, mut bytes: &[u8]) -> Result<Vec<(ObjectId, Vec<f64>)>, SnapshotError> {
    let wrong = |what: &str| SnapshotError::Format(format!("its generalized forces {what}"));
    let mut all = Vec::new();
    while !bytes.is_empty() {
        let (place, rest) = bytes.split_first_chunk::<4>().ok_or_else(|| wrong("are cut off"))?;
        let (count, rest) = rest.split_first_chunk::<4>().ok_or_else(|| wrong("are cut off"))?;
        let id = inner.world.ids().get(u32::from_le_bytes(*place) as usize).copied();
        let (id, robot) = id
            .and_then(|id| Some((id, inner.robots.get(&id)?)))
            .ok_or_else(|| wrong("are of a body that is not articulated"))?;
        let count = u32::from_le_bytes(*count) as usize;
        if count != robot.dof() || rest.len() < 8 * count {
            return Err(wrong("have the wrong length"));
        }
        let (own, rest) = rest.split_at(8 * count);
        let forces: Vec<f64> = own.as_chunks::<8>().0.iter().map(|chunk| f64::from_le_bytes(*chunk)).collect();
        if forces.iter().any(|force| !force.is_finite()) {
            return Err(SnapshotError::NotFinite);
        }
        all.push((id, forces));
        bytes = rest;
    }
    Ok(all)
}

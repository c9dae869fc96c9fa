//! The users' state as bytes, for nodes that join a run in progress.
//!
//! ```text
//! size u32, Viewer | heads rejected u64 | pace f64
//! count u16 | count times: source u16, since f64, size u16, Input
//! count u16 | count times: pressed key u16
//! count u16 | count times: source u16, user u16, index of the object u32, part u32, point 3 f64, distance f64
//! ```

use super::users::{Device, Grabbed, PULL_RAD_PER_S, Users};
use std::collections::BTreeMap;
use tumble::collide::Vec3;
use tumble::dynamics::{PickForce, World};
use tumble::net::sync::{Input, Viewer};

/// State of the users that was read and not applied yet.
pub struct SavedUsers {
    viewer: Viewer,
    heads_rejected: u64,
    pace: f64,
    inputs: BTreeMap<Device, (Input, f64)>,
    pressed: Vec<u16>,
    held: BTreeMap<Device, Grabbed>,
}

impl Users {
    /// Appends the state.
    pub fn write(&self, world: &World, out: &mut Vec<u8>) {
        sized(out, |out| self.viewer.write(out));
        out.extend(self.heads_rejected.to_le_bytes());
        out.extend(self.pace.to_le_bytes());
        out.extend((self.inputs.len() as u16).to_le_bytes());
        for ((source, _), (input, since)) in &self.inputs {
            out.extend(source.to_le_bytes());
            out.extend(since.to_le_bytes());
            sized(out, |out| input.write(out));
        }
        out.extend((self.pressed.len() as u16).to_le_bytes());
        self.pressed.iter().for_each(|key| out.extend(key.to_le_bytes()));
        out.extend((self.held.len() as u16).to_le_bytes());
        for ((source, user), Grabbed { pull, distance }) in &self.held {
            let index = world.ids().iter().position(|id| *id == pull.id).unwrap_or(usize::MAX) as u32;
            out.extend(source.to_le_bytes());
            out.extend(user.to_le_bytes());
            out.extend(index.to_le_bytes());
            out.extend((pull.part as u32).to_le_bytes());
            pull.point.iter().chain([distance]).for_each(|x| out.extend(x.to_le_bytes()));
        }
    }

    /// Reads the state, and returns it with the bytes that follow it. `None` if it is damaged.
    pub fn parse<'a>(&self, world: &World, bytes: &'a [u8]) -> Option<(SavedUsers, &'a [u8])> {
        let mut rest = Bytes(bytes);
        let size = rest.u32()?;
        let viewer = Viewer::read(rest.take(size as usize)?).ok()?;
        let (heads_rejected, pace) = (u64::from_le_bytes(rest.array()?), rest.f64()?);
        let mut inputs = BTreeMap::new();
        for _ in 0..rest.u16()? {
            let (source, since, size) = (rest.u16()?, rest.f64()?, rest.u32()?);
            let input = Input::read(rest.take(size as usize)?).ok()?;
            inputs.insert((source, input.user), (input, since));
        }
        let mut pressed = Vec::new();
        for _ in 0..rest.u16()? {
            pressed.push(rest.u16()?);
        }
        let mut held = BTreeMap::new();
        for _ in 0..rest.u16()? {
            let (device, index, part) = ((rest.u16()?, rest.u16()?), rest.u32()?, rest.u32()? as usize);
            let (point, distance) = (Vec3::new(rest.f64()?, rest.f64()?, rest.f64()?), rest.f64()?);
            // an object that was removed is let go
            let Some(&id) = world.ids().get(index as usize) else { continue };
            world.part_state(id, part)?;
            let pull = PickForce { id, part, point, target: point, frequency: PULL_RAD_PER_S };
            held.insert(device, Grabbed { pull, distance });
        }
        let same_users = viewer.users.len() == self.viewer.users.len();
        same_users.then_some((SavedUsers { viewer, heads_rejected, pace, inputs, pressed, held }, rest.0))
    }

    /// Applies a state.
    pub fn set(&mut self, saved: SavedUsers) {
        let SavedUsers { viewer, heads_rejected, pace, inputs, pressed, held } = saved;
        (self.viewer, self.heads_rejected, self.pace) = (viewer, heads_rejected, pace);
        (self.inputs, self.pressed, self.held) = (inputs, pressed, held);
    }
}

/// Appends bytes after their number.
fn sized(out: &mut Vec<u8>, write: impl FnOnce(&mut Vec<u8>)) {
    let start = out.len();
    out.extend([0; 4]);
    write(out);
    let size = (out.len() - start - 4) as u32;
    out[start..start + 4].copy_from_slice(&size.to_le_bytes());
}

/// Reader that never reads beyond the bytes there.
struct Bytes<'a>(&'a [u8]);

impl<'a> Bytes<'a> {
    fn take(&mut self, n: usize) -> Option<&'a [u8]> {
        let (head, rest) = self.0.split_at_checked(n)?;
        self.0 = rest;
        Some(head)
    }

    fn array<const N: usize>(&mut self) -> Option<[u8; N]> {
        self.take(N)?.try_into().ok()
    }

    fn u16(&mut self) -> Option<u16> {
        self.array().map(u16::from_le_bytes)
    }

    fn u32(&mut self) -> Option<u32> {
        self.array().map(u32::from_le_bytes)
    }

    fn f64(&mut self) -> Option<f64> {
        self.array().map(f64::from_le_bytes).filter(|x| x.is_finite())
    }
}

//! Nodes that step the world by themselves (`--compute everywhere`). The bits are the same on every
//! node, so the inputs of a frame are all that travels.
//!
//! ```text
//! STEP     hash before [16] | steps u32 | count u16 | count times: source u16, size u16, INPUT payload
//! WORLD    hash before [16] | hash [16] | bytes of Simulation::save
//! DIFFERS  count u32 | count times: hash of an object u64
//! ```
//!
//! `hash before` is the server's hash of the frame before, zeros if there is none. A node compares it
//! with its own; if they differ it sends the hashes of its objects (DIFFERS), and the server names the
//! first one that is another. The hash of a frame is
//!
//! ```text
//! object   XXH3-64 over name, flags (enabled, collidable, asleep), mode and the numbers in X
//! frame    XXH3-128 over frame number, time, number of objects, all object hashes, the viewer
//! ```
//!
//! Numbers outside of X, such as warm starts, show in X one frame later.

use super::input::Input;
use super::table::MAX_OBJECTS;
use super::transport::FacetNumber;
use super::viewer::Viewer;
use super::wire::{ByteReader, Hash, MessageError};
use tumble_core::{ObjectId, World};
use xxhash_rust::xxh3::{xxh3_64, xxh3_128};

/// Maximum number of inputs of one frame; a frame with more is sent as a world.
pub const MAX_FRAME_INPUTS: usize = 1024;
/// Maximum number of steps of one frame.
pub const MAX_FRAME_STEPS: u32 = 1 << 20;

/// A world that steps, with all that acts on it. Equal simulations that get equal inputs stay equal
/// in every bit.
pub trait Simulation: Send {
    /// Returns the world.
    fn world(&self) -> &World;
    /// Returns the users' heads and the cave's place in the scene.
    fn viewer(&self) -> &Viewer;
    /// Applies the inputs in their order, then steps.
    ///
    /// # Errors
    /// The reason for which a step failed.
    fn advance(&mut self, frame: &FrameInputs) -> Result<(), String>;
    /// Returns everything that the next frame reads, as bytes.
    fn save(&self) -> Vec<u8>;
    /// Restores the bytes of [`save`](Self::save) of a simulation of the same scene. The bytes may
    /// come from elsewhere.
    ///
    /// # Errors
    /// The reason for which the bytes do not fit. The simulation is then unchanged.
    fn restore(&mut self, bytes: &[u8]) -> Result<(), String>;
}

/// Everything that acts on a world in one frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FrameInputs {
    /// Number of steps of the scene.
    pub steps: u32,
    /// Inputs by source, in the order in which they take effect before the steps.
    pub inputs: Vec<(FacetNumber, Input)>,
}

/// Payload of STEP.
#[derive(Clone, Debug, PartialEq)]
pub struct Step {
    /// The server's hash of the frame before; zeros if there is none.
    pub before: Hash,
    /// The inputs of the frame.
    pub inputs: FrameInputs,
}

impl Step {
    /// Appends the payload.
    pub fn write(&self, out: &mut Vec<u8>) {
        out.extend(self.before);
        out.extend(self.inputs.steps.to_le_bytes());
        let inputs = &self.inputs.inputs[..self.inputs.inputs.len().min(MAX_FRAME_INPUTS)];
        out.extend((inputs.len() as u16).to_le_bytes());
        for (source, input) in inputs {
            out.extend(source.to_le_bytes());
            let start = out.len();
            out.extend([0; 2]);
            input.write(out);
            let size = (out.len() - start - 2) as u16; // an input has at most 308 bytes
            out[start..start + 2].copy_from_slice(&size.to_le_bytes());
        }
    }

    /// Reads the payload.
    ///
    /// # Errors
    /// [`MessageError::Malformed`].
    pub fn read(payload: &[u8]) -> Result<Step, MessageError> {
        let mut rest = ByteReader(payload);
        let (before, steps, count) = (rest.array()?, rest.u32()?, rest.u16()? as usize);
        if count > MAX_FRAME_INPUTS || steps > MAX_FRAME_STEPS {
            return Err(MessageError::Malformed("more than 1024 inputs, or 1048576 steps, in a frame"));
        }
        let input = |_| {
            let (source, size) = (rest.u16()?, rest.u16()?);
            Ok((source, Input::read(rest.take(size.into())?)?))
        };
        let inputs = (0..count).map(input).collect::<Result<_, MessageError>>()?;
        rest.end()?;
        Ok(Step { before, inputs: FrameInputs { steps, inputs } })
    }
}

/// Payload of WORLD.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SavedWorld<'a> {
    /// The server's hash of the frame before; zeros if there is none.
    pub before: Hash,
    /// The server's hash of this frame.
    pub hash: Hash,
    /// Bytes of [`Simulation::save`].
    pub bytes: &'a [u8],
}

impl<'a> SavedWorld<'a> {
    /// Appends the payload.
    pub fn write(&self, out: &mut Vec<u8>) {
        out.extend(self.before);
        out.extend(self.hash);
        out.extend(self.bytes);
    }

    /// Reads the payload.
    ///
    /// # Errors
    /// [`MessageError::Malformed`].
    pub fn read(payload: &'a [u8]) -> Result<SavedWorld<'a>, MessageError> {
        let mut rest = ByteReader(payload);
        Ok(SavedWorld { before: rest.array()?, hash: rest.array()?, bytes: rest.0 })
    }
}

/// Payload of DIFFERS: the hashes of a node's objects.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ObjectHashes(pub Vec<u64>);

impl ObjectHashes {
    /// Appends the payload.
    pub fn write(&self, out: &mut Vec<u8>) {
        out.extend((self.0.len() as u32).to_le_bytes());
        self.0.iter().for_each(|hash| out.extend(hash.to_le_bytes()));
    }

    /// Reads the payload.
    ///
    /// # Errors
    /// [`MessageError::Malformed`].
    pub fn read(payload: &[u8]) -> Result<ObjectHashes, MessageError> {
        let mut rest = ByteReader(payload);
        let count = rest.u32()? as usize;
        if count > MAX_OBJECTS || rest.0.len() != 8 * count {
            return Err(MessageError::Malformed("more than 100000 hashes, or a wrong number of bytes"));
        }
        (0..count).map(|_| rest.u64()).collect::<Result<_, _>>().map(ObjectHashes)
    }
}

/// Hashes of a frame: of each object, and of all.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StateHashes {
    /// Number of the frame.
    pub frame: u64,
    /// Hash of the frame.
    pub hash: Hash,
    /// Hashes of the objects in the order of the world.
    pub objects: ObjectHashes,
}

impl StateHashes {
    /// Computes the hashes of a frame.
    pub fn of(frame: u64, world: &World, viewer: &Viewer) -> StateHashes {
        let mut bytes = Vec::new();
        let objects: Vec<u64> = world.ids().iter().map(|&id| object_hash(world, id, &mut bytes)).collect();
        bytes.clear();
        bytes.extend(frame.to_le_bytes());
        bytes.extend(world.time().to_bits().to_le_bytes());
        ObjectHashes(objects.clone()).write(&mut bytes);
        viewer.write(&mut bytes);
        StateHashes { frame, hash: xxh3_128(&bytes).to_le_bytes(), objects: ObjectHashes(objects) }
    }

    /// Returns the index of the first object whose hash is another one in `theirs`. `None` if all are
    /// the same, so that time or viewer differ.
    pub fn first_difference(&self, theirs: &ObjectHashes) -> Option<usize> {
        let (ours, theirs) = (&self.objects.0, &theirs.0);
        let common = ours.iter().zip(theirs).position(|(a, b)| a != b);
        common.or_else(|| (ours.len() != theirs.len()).then_some(ours.len().min(theirs.len())))
    }
}

fn object_hash(world: &World, id: ObjectId, bytes: &mut Vec<u8>) -> u64 {
    bytes.clear();
    bytes.extend(world.name(id).unwrap_or_default().as_bytes());
    if let Some(status) = world.status(id) {
        bytes.extend([status.enabled.into(), status.collidable.into(), world.asleep(id).into(), status.mode as u8]);
    }
    world.state_of(id).unwrap_or_default().iter().for_each(|x| bytes.extend(x.to_bits().to_le_bytes()));
    xxh3_64(bytes)
}

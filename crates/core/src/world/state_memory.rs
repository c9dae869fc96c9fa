//! The memory of the state `X`. Its address changes only when an object is added or removed.
//!
//! A program that shares the state without copying it, as the Python module does, needs memory that
//! is not moved or freed under a reader. The world therefore writes the numbers in place. When an
//! object is added or removed they move to new memory, and [holds](StateMemory::hold) keep the old
//! one.

use super::World;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::ops::{Deref, DerefMut, Range};
use std::sync::{Arc, Mutex, PoisonError};

/// A hold on the memory of a state, which is not freed as long as the hold lives.
#[derive(Debug, Default)]
pub struct StateMemoryHold {
    /// The memory, after the world has left it.
    left: Mutex<Vec<f64>>,
}

/// The numbers of the state, the hold on their memory, and that memory while it is frozen. A clone
/// has memory of its own without a hold; `clone_from` writes to the present memory.
#[derive(Debug, Default)]
pub(crate) struct StateVector {
    numbers: Vec<f64>,
    hold: Option<Arc<StateMemoryHold>>,
    aside: Option<Vec<f64>>,
}

impl Deref for StateVector {
    type Target = [f64];
    fn deref(&self) -> &[f64] {
        &self.numbers
    }
}

impl DerefMut for StateVector {
    fn deref_mut(&mut self) -> &mut [f64] {
        &mut self.numbers
    }
}

impl Drop for StateVector {
    fn drop(&mut self) {
        self.leave(0);
    }
}

impl Clone for StateVector {
    fn clone(&self) -> StateVector {
        StateVector { numbers: self.numbers.clone(), hold: None, aside: None }
    }

    fn clone_from(&mut self, from: &StateVector) {
        self.resize(from.len());
        self.numbers.copy_from_slice(from);
    }
}

impl Serialize for StateVector {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.numbers.serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for StateVector {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<StateVector, D::Error> {
        Ok(StateVector { numbers: Vec::deserialize(deserializer)?, hold: None, aside: None })
    }
}

impl StateVector {
    /// Changes the length at the end; new numbers are zero.
    pub fn resize(&mut self, len: usize) {
        if len != self.numbers.len() {
            self.leave(len);
            self.numbers.resize(len, 0.0);
        }
    }

    /// Removes a range.
    pub fn cut(&mut self, range: Range<usize>) {
        if !range.is_empty() {
            self.leave(self.numbers.len());
            self.numbers.drain(range);
        }
    }

    /// Moves to new memory with a capacity of `room` numbers if the present memory is held.
    fn leave(&mut self, room: usize) {
        let Some(hold) = self.hold.take().filter(|hold| Arc::strong_count(hold) > 1) else {
            self.aside = None;
            return;
        };
        let mut fresh = Vec::with_capacity(room);
        if room > 0 {
            fresh.extend_from_slice(&self.numbers);
        }
        let now = std::mem::replace(&mut self.numbers, fresh);
        *hold.left.lock().unwrap_or_else(PoisonError::into_inner) = self.aside.take().unwrap_or(now);
    }
}

/// Access to the memory of a world's state.
pub struct StateMemory<'w>(&'w mut StateVector);

impl World {
    /// Gives access to the memory of the state, for programs that share it without copying it.
    pub fn state_memory(&mut self) -> StateMemory<'_> {
        StateMemory(&mut self.core.state.x)
    }
}

impl StateMemory<'_> {
    /// Keeps the memory in place: the world writes there until an object is added or removed or the
    /// world is dropped. From then on the memory keeps its last numbers as long as the hold lives.
    /// Calls between two such changes return the same hold.
    pub fn hold(&mut self) -> Arc<StateMemoryHold> {
        self.0.hold.get_or_insert_default().clone()
    }

    /// Returns the address of the state and its length. The address stays valid under a
    /// [`hold`](Self::hold). A reader must not read while a call changes the world.
    pub fn address(&mut self) -> (*const f64, usize) {
        let shown = self.0.aside.as_mut().unwrap_or(&mut self.0.numbers);
        (shown.as_mut_ptr(), shown.len())
    }

    /// Keeps the held memory as it is and works on a copy until [`thaw`](Self::thaw). Readers see
    /// the present state meanwhile.
    pub fn freeze(&mut self) {
        if self.0.hold.is_some() && self.0.aside.is_none() {
            let copy = self.0.numbers.clone();
            self.0.aside = Some(std::mem::replace(&mut self.0.numbers, copy));
        }
    }

    /// Writes the state to the held memory and works there again.
    pub fn thaw(&mut self) {
        if let Some(mut shown) = self.0.aside.take() {
            shown.copy_from_slice(&self.0.numbers);
            self.0.numbers = shown;
        }
    }
}

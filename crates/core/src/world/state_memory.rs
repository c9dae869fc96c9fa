//! The memory of the flat state `X`: one place from one addition or removal of an object to the next.
//!
//! A program that shows the state to others without copying it, as the Python module does, needs memory that neither moves nor goes away
//! under a reader. So the numbers are only written in place. When an object is added or removed they move to new memory, and
//! [holds](StateMemory::hold) keep the old one.

use super::World;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::ops::{Deref, DerefMut, Range};
use std::sync::{Arc, Mutex, PoisonError};

/// A hold on the memory of a state: while it lives that memory is not given back.
#[derive(Debug, Default)]
pub struct StateMemoryHold {
    /// The memory, after the world has left it.
    left: Mutex<Vec<f64>>,
}

/// The numbers of the state, the hold on their memory, and that memory while it is put aside. A clone has memory of its own that
/// nobody holds; `clone_from` writes into the memory that is there.
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
    /// Makes room at the end, filled with zeros, or cuts it off.
    pub fn resize(&mut self, len: usize) {
        if len != self.numbers.len() {
            self.leave(len);
            self.numbers.resize(len, 0.0);
        }
    }

    /// Takes a stretch out.
    pub fn cut(&mut self, range: Range<usize>) {
        if !range.is_empty() {
            self.leave(self.numbers.len());
            self.numbers.drain(range);
        }
    }

    /// Moves to new memory with room for `room` numbers, if anybody holds this one.
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
    /// Lends the memory of the state, for programs that show it without copying it.
    pub fn state_memory(&mut self) -> StateMemory<'_> {
        StateMemory(&mut self.core.state.x)
    }
}

impl StateMemory<'_> {
    /// Keeps the memory in place: every call that moves something writes there, until an object is added or removed or the world is dropped.
    /// From then on the memory keeps its last numbers for as long as the hold lives. Calls at the same state return the same hold.
    pub fn hold(&mut self) -> Arc<StateMemoryHold> {
        self.0.hold.get_or_insert_default().clone()
    }

    /// Returns the address of the state and its count of numbers. It stays valid under a [`hold`](Self::hold). A reader must make sure that
    /// no call changes the world meanwhile.
    pub fn address(&mut self) -> (*const f64, usize) {
        let shown = self.0.aside.as_mut().unwrap_or(&mut self.0.numbers);
        (shown.as_mut_ptr(), shown.len())
    }

    /// Leaves the held memory as it is and works on a copy until [`thaw`](Self::thaw), so that readers see the present state meanwhile.
    pub fn freeze(&mut self) {
        if self.0.hold.is_some() && self.0.aside.is_none() {
            let copy = self.0.numbers.clone();
            self.0.aside = Some(std::mem::replace(&mut self.0.numbers, copy));
        }
    }

    /// Writes the state to the held memory, and works there again.
    pub fn thaw(&mut self) {
        if let Some(mut shown) = self.0.aside.take() {
            shown.copy_from_slice(&self.0.numbers);
            self.0.numbers = shown;
        }
    }
}

//! Where the flat state `X` lies in memory: in one place, from one coming or going of an object to the next.
//!
//! Who shows the state to others without copying it, as the Python module does, wants memory that neither moves nor goes away under a reader.
//! So the numbers are only ever written where they are; when an object comes or goes they move to new memory, and the old is left to those who
//! [hold](World::hold_state_memory) it. There is no way to put another vector in their place.

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

impl World {
    /// Keeps the memory that the state lies in: it stays there, and is written there by every call that moves something, until an object is added or
    /// removed or the world is dropped; then it stays as it was last for as long as the hold lives. Calls of the same state give the same hold.
    pub fn hold_state_memory(&mut self) -> Arc<StateMemoryHold> {
        self.core.state.x.hold.get_or_insert_default().clone()
    }

    /// Where the state lies, and how many numbers it has; see [`hold_state_memory`](Self::hold_state_memory). Who reads through it has to see to it that no call
    /// changes the world meanwhile.
    pub fn state_address(&mut self) -> (*const f64, usize) {
        let x = &mut self.core.state.x;
        let shown = x.aside.as_mut().unwrap_or(&mut x.numbers);
        (shown.as_mut_ptr(), shown.len())
    }

    /// Leaves the held memory as it is, and works on a copy until [`thaw_state_memory`](Self::thaw_state_memory): readers then see the state as it was.
    pub fn freeze_state_memory(&mut self) {
        let x = &mut self.core.state.x;
        if x.hold.is_some() && x.aside.is_none() {
            let copy = x.numbers.clone();
            x.aside = Some(std::mem::replace(&mut x.numbers, copy));
        }
    }

    /// Writes the state to the memory that was put aside, and works there again.
    pub fn thaw_state_memory(&mut self) {
        let x = &mut self.core.state.x;
        if let Some(mut shown) = x.aside.take() {
            shown.copy_from_slice(&x.numbers);
            x.numbers = shown;
        }
    }
}

//! Memory that a force uses again in every step: pages that the system takes back and gives again cost as much as a
//! fifth of the forces of a flock.

use std::fmt;
use std::sync::{Mutex, PoisonError};

/// Working memory. Nothing depends on its content, so a copy begins without any.
#[derive(Default)]
pub(crate) struct Kept<T>(Mutex<T>);

impl<T> Kept<T> {
    /// Lends the memory; waits while another thread uses it.
    pub fn lend<R>(&self, work: impl FnOnce(&mut T) -> R) -> R {
        work(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl<T: Default> Clone for Kept<T> {
    fn clone(&self) -> Kept<T> {
        Kept::default()
    }
}

impl<T> fmt::Debug for Kept<T> {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("Kept")
    }
}

//! The trait of objects with a state that the world advances once per frame.

use super::Object;
use super::part_state::{PartState, StateRange};
use crate::settings::Settings;
use crate::threads::Threads;
use crate::world::view::{ObjectId, WorldView};
use tumble_collide::Vec3;

/// A state that follows the world: it is advanced once per frame, after everything else has moved.
/// Particles have one; a controller that remembers what it saw has one too.
///
/// The state is a part of `X`, so it is saved, forked and rolled back with the world. It has no degrees
/// of freedom: no integrator, solver or contact knows it. An object that is
/// [`Integratable`](super::Integratable) has its state there, and `len` and `write_initial` of this trait are not called.
///
/// A frame that fails, or that wakes a sleeper, is rolled back with what this trait wrote.
pub trait FrameState: Object {
    /// Returns the length of its range of the state `X`.
    fn len(&self) -> usize;
    /// Writes the state at time 0; zeros by default.
    fn write_initial(&self, x: &mut [f64]) {
        x.fill(0.0);
    }
    /// Returns whether `x`, of the right length, is an admissible state: finite, by default.
    fn accepts(&self, x: &[f64]) -> bool {
        x.iter().all(|x| x.is_finite())
    }
    /// Returns whether the state is empty.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }
    /// Advances its own range `x` of the state by a frame, and appends the impulses that it gives to bodies.
    /// It depends on its arguments alone. Objects take turns in the order in which they were added;
    /// the impulses act after the last one.
    fn advance(&self, me: &StateRange, frame: &Frame, x: &mut [f64], out: &mut Vec<FrameImpulse>);
}

/// A frame that the world has just stepped.
pub struct Frame<'a> {
    /// Length of the frame, s: that of the settings, which `view.time - start` is up to rounding.
    pub dt: f64,
    /// Time at its start, s: to the bit that at the end of the frame before.
    pub start: f64,
    /// The settings of the world.
    pub settings: &'a Settings,
    /// The world at its end. The object's own range of `view.x` is that at its start.
    pub view: WorldView<'a>,
    /// The part states at its start.
    pub before: &'a [PartState],
    pub(crate) threads: &'a Threads,
}

/// An impulse on a part of a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameImpulse {
    /// The body.
    pub id: ObjectId,
    /// Its part.
    pub part: usize,
    /// Impulse, N·s, world axes.
    pub impulse: Vec3,
    /// World point that it acts at, m.
    pub point: Vec3,
}

impl Frame<'_> {
    /// Cuts an array of records of `record` numbers each into pieces of at least `least` records, and calls
    /// `work` with the number of the first record and the records of each piece, on several threads if the world has
    /// them. Returns the results in the order of the pieces. Their number depends on that of the threads, so results
    /// that are joined must not.
    pub fn each_piece<R: Send>(
        &self,
        x: &mut [f64],
        record: usize,
        least: usize,
        work: impl Fn(usize, &mut [f64]) -> R + Sync,
    ) -> Vec<R> {
        self.threads.each_piece(x, record, least, work)
    }
}

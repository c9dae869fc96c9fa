//! The trait of objects that are synchronized over a network (thesis §IV.A.6), and a range of the
//! state as bytes: little-endian `f64`, exact.

use super::part_state::StateRange;
use crate::world::view::WorldView;

/// Can be synchronized over a network: one side writes a message, the other applies it. The frame
/// around the message (names, sizes, time) is not part of it.
pub trait NetSync {
    /// Appends the data that another process needs to show this object as it is in the view.
    fn get_data(&self, me: &StateRange, view: &WorldView, out: &mut Vec<u8>);
    /// Applies such data to the object's range `x` of a state. `data` comes from outside and is not
    /// trusted: on an error `x` is unchanged.
    ///
    /// # Errors
    /// [`SyncError`] states what is wrong with the data.
    fn read_data(&self, data: &[u8], x: &mut [f64]) -> Result<(), SyncError>;
}

/// The reason why a message was not applied.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SyncError {
    /// The length is wrong.
    #[error("the message has {got} bytes; this object's has {expected}")]
    Length {
        /// Bytes in the message.
        got: usize,
        /// Bytes that it must have.
        expected: usize,
    },
    /// A number is not finite, or a quaternion is not of unit length.
    #[error("the message holds a number that is not finite, or an orientation that is not of unit length")]
    Value,
}

/// Appends the numbers.
pub(crate) fn write_state(x: &[f64], out: &mut Vec<u8>) {
    out.extend(x.iter().flat_map(|x| x.to_le_bytes()));
}

/// Reads `x.len()` numbers that must be a valid state. On an error `x` is unchanged.
///
/// # Errors
/// [`SyncError::Length`] or [`SyncError::Value`].
pub(crate) fn read_state(data: &[u8], x: &mut [f64], accepts: impl Fn(&[f64]) -> bool) -> Result<(), SyncError> {
    let expected = 8 * x.len();
    if data.len() != expected {
        return Err(SyncError::Length { got: data.len(), expected });
    }
    let (numbers, _) = data.as_chunks::<8>();
    let state: Vec<f64> = numbers.iter().map(|b| f64::from_le_bytes(*b)).collect();
    if !accepts(&state) {
        return Err(SyncError::Value);
    }
    x.copy_from_slice(&state);
    Ok(())
}

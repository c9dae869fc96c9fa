//! An object's range of the state as bytes: little-endian `f64`, exact.

use crate::object::SyncError;

/// Appends the numbers.
pub(crate) fn write_state(x: &[f64], out: &mut Vec<u8>) {
    out.extend(x.iter().flat_map(|x| x.to_le_bytes()));
}

/// Reads `x.len()` numbers that must be a valid state. On an error `x` is unchanged.
///
/// # Errors
/// [`SyncError::Length`] or [`SyncError::Value`].
pub(crate) fn read_state(data: &[u8], x: &mut [f64], accepts: impl Fn(&[f64]) -> bool) -> Result<(), SyncError> {
    let wanted = 8 * x.len();
    if data.len() != wanted {
        return Err(SyncError::Length { got: data.len(), wanted });
    }
    let (numbers, _) = data.as_chunks::<8>();
    let state: Vec<f64> = numbers.iter().map(|b| f64::from_le_bytes(*b)).collect();
    if !accepts(&state) {
        return Err(SyncError::Value);
    }
    x.copy_from_slice(&state);
    Ok(())
}

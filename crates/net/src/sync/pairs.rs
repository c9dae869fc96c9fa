//! Lists of pairs of parts in a STATE message: the mechanism behind [`contacts`](super::contacts) and
//! [`touching`](super::touching).
//!
//! ```text
//! count u32 | count times: a pair
//! ```
//!
//! Objects are indices of the object table. Pairs with an object that is not in it are left out.

use super::wire::{ByteReader, MessageError};
use std::collections::BTreeMap;
use tumble_core::{ObjectId, World};

/// Appends a list. `put` appends a pair, whose objects have these places in the table.
pub(super) fn put_pairs<T>(
    out: &mut Vec<u8>,
    pairs: impl IntoIterator<Item = T>,
    index: &BTreeMap<ObjectId, u32>,
    objects: impl Fn(&T) -> [ObjectId; 2],
    mut put: impl FnMut(&mut Vec<u8>, T, [u32; 2]),
) {
    let start = out.len();
    out.extend([0; 4]);
    let mut count = 0u32;
    for pair in pairs {
        let [a, b] = objects(&pair).map(|id| index.get(&id));
        let (Some(a), Some(b)) = (a, b) else { continue };
        put(out, pair, [*a, *b]);
        count += 1;
    }
    out[start..start + 4].copy_from_slice(&count.to_le_bytes());
}

/// Reads parts of objects in pairs.
pub(super) struct Parts<'a> {
    /// The objects of the table; the viewer has none.
    pub ids: &'a [Option<ObjectId>],
    pub world: &'a World,
    /// The error for a part that the world does not have.
    pub unknown: MessageError,
}

impl Parts<'_> {
    /// Reads object and part.
    ///
    /// # Errors
    /// [`MessageError::Malformed`].
    pub fn read(&self, rest: &mut ByteReader<'_>) -> Result<(ObjectId, usize), MessageError> {
        let (object, part) = (rest.u32()? as usize, rest.u32()? as usize);
        let id = self.ids.get(object).copied().flatten();
        let id = id.filter(|&id| self.world.part_state(id, part).is_some());
        id.map(|id| (id, part)).ok_or_else(|| self.unknown.clone())
    }
}

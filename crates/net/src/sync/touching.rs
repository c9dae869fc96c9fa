//! Pairs that touch in a STATE message, for `World::touching` in a facet.
//!
//! ```text
//! count u32 | count times: sensor u8, object a u32, part u32, object b u32, part u32
//! ```
//!
//! They are sent with the events, all or none: the count `0xffff_ffff` is that of a frame without them. `sensor` is 1 if a, or a shape of
//! it, is a sensor. Objects are indices of the object table.

use super::pairs::{Parts, put_pairs};
use super::wire::{ByteReader, MessageError};
use std::collections::BTreeMap;
use tumble_core::{ObjectId, TouchingPair, World};

/// Maximum number of pairs in a message; more are not sent.
pub const MAX_TOUCHING: usize = 65_536;

const UNKNOWN: u32 = u32::MAX;

/// Appends the pairs of a world, if it knows them and they are `wanted` and not too many. `index` has the place of each object in the table.
pub(crate) fn put_touching(out: &mut Vec<u8>, world: &World, wanted: bool, index: &BTreeMap<ObjectId, u32>) {
    let pairs = if wanted && world.knows_touching() { Some(world.touching_pairs()) } else { None };
    let Some(pairs) = pairs.filter(|pairs| pairs.len() <= MAX_TOUCHING) else {
        return out.extend(UNKNOWN.to_le_bytes());
    };
    put_pairs(
        out,
        pairs,
        index,
        |pair| pair.sides.map(|(id, _)| id),
        |out, TouchingPair { sides: [(_, part_a), (_, part_b)], sensor }, [a, b]| {
            out.push(u8::from(sensor));
            out.extend([a, part_a as u32, b, part_b as u32].iter().flat_map(|i| i.to_le_bytes()));
        },
    );
}

/// Reads the pairs of a message; `None` if it has none. `ids` are the objects of the table; the viewer has none.
///
/// # Errors
/// [`MessageError::Malformed`].
pub(crate) fn get_touching(
    rest: &mut ByteReader<'_>,
    ids: &[Option<ObjectId>],
    world: &World,
) -> Result<Option<Vec<TouchingPair>>, MessageError> {
    let count = match rest.u32()? {
        UNKNOWN => return Ok(None),
        count if count as usize > MAX_TOUCHING => return Err(MessageError::Malformed("more than 65536 pairs")),
        count => count,
    };
    let parts = Parts { ids, world, unknown: MessageError::Malformed("a pair of an unknown part") };
    let mut pairs = Vec::new();
    for _ in 0..count {
        let sensor = match rest.u8()? {
            flag @ (0 | 1) => flag == 1,
            _ => return Err(MessageError::Malformed("an unknown flag of a pair")),
        };
        pairs.push(TouchingPair { sides: [parts.read(rest)?, parts.read(rest)?], sensor });
    }
    Ok(Some(pairs))
}

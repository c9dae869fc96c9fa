//! Pairs that touch in a STATE message, for `World::touching` in a facet.
//!
//! ```text
//! count u32 | count times: sensor u8, object a u32, part u32, object b u32, part u32
//! ```
//!
//! They are sent with the events, all or none: the count `0xffff_ffff` is that of a frame without them. `sensor` is 1 if a, or a shape of
//! it, is a sensor. Objects are indices of the object table.

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
    let start = out.len();
    out.extend([0; 4]);
    let mut count = 0u32;
    for TouchingPair { sides: [(a, part_a), (b, part_b)], sensor } in pairs {
        let (Some(a), Some(b)) = (index.get(&a), index.get(&b)) else { continue };
        out.push(u8::from(sensor));
        out.extend([*a, part_a as u32, *b, part_b as u32].iter().flat_map(|i| i.to_le_bytes()));
        count += 1;
    }
    out[start..start + 4].copy_from_slice(&count.to_le_bytes());
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
    let mut pairs = Vec::new();
    for _ in 0..count {
        let sensor = match rest.u8()? {
            flag @ (0 | 1) => flag == 1,
            _ => return Err(MessageError::Malformed("an unknown flag of a pair")),
        };
        pairs.push(TouchingPair { sides: [side(rest, ids, world)?, side(rest, ids, world)?], sensor });
    }
    Ok(Some(pairs))
}

fn side(rest: &mut ByteReader<'_>, ids: &[Option<ObjectId>], world: &World) -> Result<(ObjectId, usize), MessageError> {
    let (object, part) = (rest.u32()? as usize, rest.u32()? as usize);
    let id = ids.get(object).copied().flatten().filter(|&id| world.part_state(id, part).is_some());
    id.map(|id| (id, part)).ok_or(MessageError::Malformed("a pair of an unknown part"))
}

//! Contacts in a STATE message, for overlays of facets.
//!
//! ```text
//! count u32 | count times: object a u32, part u32, shape u32, object b u32, part u32, shape u32, point 3 f32, normal 3 f32, depth f32, force 3 f32
//! ```
//!
//! Objects are indices of the object table; the normal points from b to a, and the force acts on a
//! (N, m, world axes). A shape is the index of a compound's part, 0 for all others. Contacts with objects that are not in the table are left out. A facet shows
//! them and computes nothing with them.

use super::pairs::{Parts, put_pairs};
use super::wire::{ByteReader, MessageError};
use std::collections::BTreeMap;
use tumble_collide::Vec3;
use tumble_core::{ContactPoint, ObjectId, World};

/// Maximum number of contacts in a message: those with the largest forces.
pub const MAX_CONTACTS: usize = 256;

/// Appends these contacts. `index` has the place of each object in the table.
pub(crate) fn put_contacts<'a>(
    out: &mut Vec<u8>,
    contacts: impl IntoIterator<Item = &'a ContactPoint>,
    index: &BTreeMap<ObjectId, u32>,
) {
    put_pairs(
        out,
        contacts,
        index,
        |c| [c.a, c.b],
        |out, c, [a, b]| {
            let sides = [a, c.part_a as u32, c.shape_a as u32, b, c.part_b as u32, c.shape_b as u32];
            out.extend(sides.iter().flat_map(|i| i.to_le_bytes()));
            let numbers = c.point.iter().chain(&c.normal).chain([&c.depth]).chain(&c.force);
            out.extend(numbers.flat_map(|x| (*x as f32).to_le_bytes()));
        },
    );
}

/// Reads the contacts of a message. `ids` are the objects of the table; the viewer has none.
///
/// # Errors
/// [`MessageError::Malformed`].
pub(crate) fn get_contacts(
    rest: &mut ByteReader<'_>,
    ids: &[Option<ObjectId>],
    world: &World,
) -> Result<Vec<ContactPoint>, MessageError> {
    let count = rest.u32()? as usize;
    if count > MAX_CONTACTS {
        return Err(MessageError::Malformed("more than 256 contacts"));
    }
    let parts = Parts { ids, world, unknown: MessageError::Malformed("a contact of an unknown part") };
    let side = |rest: &mut ByteReader<'_>| {
        let (id, part) = parts.read(rest)?;
        Ok::<_, MessageError>((id, part, rest.u32()? as usize))
    };
    let mut contacts = Vec::with_capacity(count);
    for _ in 0..count {
        let sides = [side(rest)?, side(rest)?];
        let (point, normal, depth, force) = (vector(rest)?, vector(rest)?, number(rest)?, vector(rest)?);
        contacts.push(ContactPoint::shown(sides, point, normal, depth, force));
    }
    Ok(contacts)
}

fn number(rest: &mut ByteReader<'_>) -> Result<f64, MessageError> {
    let x = f32::from_le_bytes(rest.array()?);
    if x.is_finite() { Ok(x.into()) } else { Err(MessageError::Malformed("a number that is not finite")) }
}

fn vector(rest: &mut ByteReader<'_>) -> Result<Vec3, MessageError> {
    Ok(Vec3::new(number(rest)?, number(rest)?, number(rest)?))
}

//! Memory that a decoded protobuf message will need, computed before decoding.
//!
//! Two bytes on the wire encode an empty submessage that needs hundreds of bytes in memory, and
//! compression makes the two bytes nearly free. This scan of the wire format (Protocol Buffers,
//! "Encoding") allocates nothing:
//!
//! ```text
//! message = (key value)*,   key = varint (number · 8 + wire type)
//! wire type 0: varint, 1: 8 bytes, 2: varint length and bytes, 5: 4 bytes
//! ```

use super::bytes::{Fields, Problem};
use super::{MAX_ENTITIES, MAX_SCENE_MEMORY};
use foxglove::messages as fox;

/// Numbers of the fields of `foxglove.SceneUpdate`, and of its messages, that hold lists of lists.
const ENTITIES: u64 = 2;
const LINES: u64 = 11;
const TRIANGLES: u64 = 12;

/// Refuses a `foxglove.SceneUpdate` that would need more than [`MAX_SCENE_MEMORY`].
pub(crate) fn check_scene(message: &[u8]) -> Result<(), Problem> {
    let mut memory = message.len() as u64;
    each_field(message, |number, entity| {
        memory += size_of::<fox::SceneEntity>() as u64;
        if number != ENTITIES {
            return Ok(());
        }
        each_field(entity, |number, primitive| {
            memory += MAX_PRIMITIVE_BYTES;
            if number == LINES || number == TRIANGLES {
                each_field(primitive, |_, _| {
                    memory += size_of::<fox::Color>() as u64;
                    Ok(())
                })?;
            }
            Ok(())
        })
    })?;
    if memory > MAX_SCENE_MEMORY {
        return Err(format!("the scene would take {memory} bytes of memory, at most {MAX_SCENE_MEMORY} are allowed"));
    }
    Ok(())
}

/// Refuses a `foxglove.FrameTransforms` with more than [`MAX_ENTITIES`] transforms.
pub(crate) fn check_transforms(message: &[u8]) -> Result<(), Problem> {
    let mut count = 0;
    each_field(message, |_, _| {
        count += 1;
        Ok(())
    })?;
    if count > MAX_ENTITIES { Err(format!("{count} transforms, at most {MAX_ENTITIES} are read")) } else { Ok(()) }
}

/// Maximum size of one element of an entity's lists.
const MAX_PRIMITIVE_BYTES: u64 = {
    let sizes = [
        size_of::<fox::ArrowPrimitive>(),
        size_of::<fox::CubePrimitive>(),
        size_of::<fox::SpherePrimitive>(),
        size_of::<fox::CylinderPrimitive>(),
        size_of::<fox::LinePrimitive>(),
        size_of::<fox::TriangleListPrimitive>(),
        size_of::<fox::TextPrimitive>(),
        size_of::<fox::ModelPrimitive>(),
        size_of::<fox::KeyValuePair>(),
    ];
    let (mut largest, mut k) = (0, 0);
    while k < sizes.len() {
        largest = if sizes[k] > largest { sizes[k] } else { largest };
        k += 1;
    }
    largest as u64
};

/// Calls `visit` with the number and the content of every length-delimited field.
fn each_field<'a>(
    message: &'a [u8],
    mut visit: impl FnMut(u64, &'a [u8]) -> Result<(), Problem>,
) -> Result<(), Problem> {
    let mut rest = Fields(message);
    while !rest.0.is_empty() {
        let key = varint(&mut rest)?;
        match key & 7 {
            0 => drop(varint(&mut rest)?),
            1 => drop(rest.take(8, "a protobuf field")?),
            2 => {
                let length = varint(&mut rest)?;
                visit(key >> 3, rest.take(length, "a protobuf field")?)?;
            }
            5 => drop(rest.take(4, "a protobuf field")?),
            other => return Err(format!("protobuf wire type {other}")),
        }
    }
    Ok(())
}

/// Reads a varint: seven bits per byte, least significant first; the top bit is set if more bytes
/// follow. At most ten bytes.
fn varint(rest: &mut Fields) -> Result<u64, Problem> {
    let mut value = 0;
    for k in 0..10 {
        let byte = rest.u8("a protobuf number")?;
        value |= u64::from(byte & 0x7f) << (7 * k);
        if byte < 0x80 {
            return Ok(value);
        }
    }
    Err("a protobuf number of more than ten bytes".into())
}

//! Clouds of spheres as bytes: particles of objects that the scene file does not have.
//!
//! | bytes | content |
//! |---|---|
//! | 4 | number of spheres, `u32` |
//! | 4 | 1 if the cloud is transparent, 2 if spheres have colors of their own, or their sum: `u32` |
//! | 16 of each | center, m, world axes, and radius, m: four `f32` |
//! | 4 of each, unless the second number is 0 | color, sRGB, and opacity: four bytes, 255 for 1 |
//!
//! All numbers are little-endian. A message has at most [`MOST`] spheres, 640 KiB. Of more, each second, third and so on is sent, in
//! the order in which the object gives them.

use super::wire::MessageError;
use tumble_collide::Vec3;
use tumble_core::{Cloud, CloudSphere, ObjectId, World};

/// Most spheres of a message.
pub(super) const MOST: usize = 32_768;

/// Bits of the second number.
const TRANSPARENT: u32 = 1;
const COLORS: u32 = 2;

/// The spheres of a message.
#[derive(Clone, Default)]
pub(crate) struct Spheres {
    pub transparent: bool,
    pub spheres: Vec<CloudSphere>,
}

/// Returns the cloud of an object, if it has one.
pub(super) fn cloud_of(world: &World, id: ObjectId) -> Option<Cloud<'_>> {
    world.object(id)?.renderable()?.cloud(world.state_of(id)?)
}

/// Appends the spheres of an object.
pub(super) fn put_cloud(world: &World, id: ObjectId, out: &mut Vec<u8>) {
    let cloud = cloud_of(world, id);
    let transparent = cloud.as_ref().is_some_and(|cloud| cloud.transparent);
    let spheres: Vec<CloudSphere> = cloud.map_or_else(Vec::new, |cloud| cloud.spheres.collect());
    let sent: Vec<&CloudSphere> = spheres.iter().step_by(spheres.len().div_ceil(MOST).max(1)).collect();
    let colors = !sent.is_empty() && sent.iter().all(|sphere| sphere.color.is_some());
    let kind = if transparent { TRANSPARENT } else { 0 } | if colors { COLORS } else { 0 };
    out.extend([sent.len() as u32, kind].into_iter().flat_map(u32::to_le_bytes));
    for sphere in &sent {
        let center = [0, 1, 2].map(|k| (sphere.center[k] as f32).clamp(f32::MIN, f32::MAX));
        let radius = (sphere.radius as f32).clamp(f32::MIN_POSITIVE, f32::MAX);
        out.extend(center.into_iter().chain([radius]).flat_map(f32::to_le_bytes));
    }
    if kind != 0 {
        let byte = |share: f32| (255.0 * share.clamp(0.0, 1.0)).round() as u8;
        for sphere in &sent {
            out.extend(sphere.color.unwrap_or_default().map(byte).into_iter().chain([byte(sphere.opacity as f32)]));
        }
    }
}

/// Reads spheres.
pub(super) fn get_cloud(body: &[u8]) -> Result<Spheres, MessageError> {
    let wrong = MessageError::Malformed("a wrong number of spheres");
    let (count, rest) = body.split_first_chunk().ok_or(MessageError::Malformed("unexpected end"))?;
    let (kind, rest) = rest.split_first_chunk().ok_or(MessageError::Malformed("unexpected end"))?;
    let (count, kind) = (u32::from_le_bytes(*count) as usize, u32::from_le_bytes(*kind));
    if kind > TRANSPARENT | COLORS {
        return Err(MessageError::Malformed("a cloud of an unknown kind"));
    }
    let each = if kind == 0 { 16 } else { 20 };
    if count > MOST || rest.len() != each * count {
        return Err(wrong);
    }
    let (places, looks) = rest.split_at(16 * count);
    let mut looks = looks.as_chunks::<4>().0.iter();
    let mut sphere = |bytes: &[u8; 16]| {
        let [x, y, z, radius] = [0, 4, 8, 12].map(|k| f32::from_le_bytes([0, 1, 2, 3].map(|j| bytes[k + j])).into());
        let mut sphere = CloudSphere::new(Vec3::new(x, y, z), radius);
        if let Some([r, g, b, opacity]) = looks.next() {
            sphere.color = (kind & COLORS != 0).then_some([r, g, b].map(|byte| f32::from(*byte) / 255.0));
            sphere.opacity = f64::from(*opacity) / 255.0;
        }
        let fine = sphere.center.iter().all(|x| x.is_finite()) && radius > 0.0 && radius.is_finite();
        fine.then_some(sphere).ok_or(MessageError::Malformed("a sphere that is none"))
    };
    let spheres = places.as_chunks::<16>().0.iter().map(&mut sphere).collect::<Result<_, _>>()?;
    Ok(Spheres { transparent: kind & TRANSPARENT != 0, spheres })
}

//! Clouds of spheres as bytes: particles of objects that the scene file does not have.
//!
//! | bytes | content |
//! |---|---|
//! | 4 | number of spheres, `u32` |
//! | 16 of each | center, m, world axes, and radius, m: four `f32` |
//!
//! All numbers are little-endian. A message has at most [`MOST`] spheres, 512 KiB. Of more, each second, third and so on is sent, in
//! the order in which the object gives them.

use super::wire::MessageError;
use tumble_collide::Vec3;
use tumble_core::{Cloud, ObjectId, World};

/// Most spheres of a message.
pub(super) const MOST: usize = 32_768;

/// Center, m, and radius, m.
pub(super) type Sphere = (Vec3, f64);

/// Returns the cloud of an object, if it has one.
pub(super) fn cloud_of(world: &World, id: ObjectId) -> Option<Cloud<'_>> {
    world.object(id)?.renderable()?.cloud(world.state_of(id)?)
}

/// Appends the spheres of an object.
pub(super) fn put_cloud(world: &World, id: ObjectId, out: &mut Vec<u8>) {
    let spheres: Vec<Sphere> = cloud_of(world, id).map_or_else(Vec::new, |cloud| cloud.spheres.collect());
    let sent = || spheres.iter().step_by(spheres.len().div_ceil(MOST).max(1));
    out.extend((sent().count() as u32).to_le_bytes());
    for (center, radius) in sent() {
        let center = [0, 1, 2].map(|k| (center[k] as f32).clamp(f32::MIN, f32::MAX));
        let radius = (*radius as f32).clamp(f32::MIN_POSITIVE, f32::MAX);
        out.extend(center.into_iter().chain([radius]).flat_map(f32::to_le_bytes));
    }
}

/// Reads spheres.
pub(super) fn get_cloud(body: &[u8]) -> Result<Vec<Sphere>, MessageError> {
    let (count, rest) = body.split_first_chunk().ok_or(MessageError::Malformed("unexpected end"))?;
    let (spheres, rest) = rest.as_chunks::<16>();
    if u32::from_le_bytes(*count) as usize != spheres.len() || spheres.len() > MOST || !rest.is_empty() {
        return Err(MessageError::Malformed("a wrong number of spheres"));
    }
    let sphere = |bytes: &[u8; 16]| {
        let [x, y, z, radius] = [0, 4, 8, 12].map(|k| f32::from_le_bytes([0, 1, 2, 3].map(|j| bytes[k + j])).into());
        let sphere: Sphere = (Vec3::new(x, y, z), radius);
        let fine = sphere.0.iter().all(|x| x.is_finite()) && radius > 0.0 && radius.is_finite();
        fine.then_some(sphere).ok_or(MessageError::Malformed("a sphere that is none"))
    };
    spheres.iter().map(sphere).collect()
}

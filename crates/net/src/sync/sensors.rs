//! Measuring sensors that a program adds, in the table of SNAPSHOT: what a facet needs to show their readings and to make their images.
//!
//! ```text
//! kind u8 | cutoff f64 | noise: deviation f64, bias walk f64, quantization f64, delay u32, seed u64 | site
//! site: object u32, then part u32 unless it is the world, and a frame of 7 f64 (position, quaternion x y z w) | optics of a camera: width u32, height u32, angle f64
//! ```
//!
//! A kind is the index in [`SensorKind::NAMES`]. An object is an index of the object table before the sensor, `0xffff_ffff` the world, and
//! `0xffff_fffe` what a facet does not have, such as a joint; nothing follows it. Readings come with every frame, so a facet does not need
//! reference and volume.

use super::wire::{ByteReader, MessageError, put_f64};
use nalgebra::{Quaternion, UnitQuaternion};
use std::collections::BTreeMap;
use tumble_collide::{Pose, Vec3};
use tumble_core::{Anchor, ObjectId, Optics, Sensor, SensorError, SensorKind, SensorNoise, SensorPlace, World};

const WORLD: u32 = u32::MAX;
const ELSEWHERE: u32 = u32::MAX - 1;
/// Most numbers of the state of one sensor that a program adds, and most of all of them. Larger ones are not sent.
const MAX_NUMBERS: [usize; 2] = [1 << 16, 1 << 20];

/// Returns the sensor of a world that a program added, if it is sent: its object is there, and its numbers are not too many.
pub(crate) fn sent(world: &World, id: ObjectId) -> Option<&Sensor> {
    let sensor = world.get::<Sensor>(id)?;
    let there = sensor.place().object().is_none_or(|on| world.object(on).is_some());
    let fits = world.state_of(id).is_some_and(|x| x.len() <= MAX_NUMBERS[0]);
    Some(sensor).filter(|_| there && fits)
}

/// Appends a sensor. `index` has the place of each object in the table.
pub(crate) fn put_sensor(out: &mut Vec<u8>, sensor: &Sensor, index: &BTreeMap<ObjectId, u32>) {
    out.push(sensor.kind() as u8);
    let SensorNoise { deviation, bias_walk, quantization, delay, seed } = *sensor.noise();
    put_f64(out, &[sensor.cutoff(), deviation, bias_walk, quantization]);
    out.extend(delay.to_le_bytes());
    out.extend(seed.to_le_bytes());
    let site = match sensor.place() {
        SensorPlace::Site(Anchor { part: None, frame, .. }) => Some((None, frame)),
        SensorPlace::Site(Anchor { part: Some((id, part)), frame, .. }) => {
            index.get(id).map(|index| (Some([*index, *part as u32]), frame))
        }
        _ => None,
    };
    match site {
        None => out.extend(ELSEWHERE.to_le_bytes()),
        Some((part, frame)) => {
            match part {
                None => out.extend(WORLD.to_le_bytes()),
                Some(part) => out.extend(part.iter().flat_map(|i| i.to_le_bytes())),
            }
            put_f64(out, frame.translation.vector.as_slice());
            put_f64(out, frame.rotation.coords.as_slice());
        }
    }
    if sensor.kind().is_camera() {
        let Optics { resolution: [width, height], vertical_fov } = *sensor.optics();
        out.extend([width, height].iter().flat_map(|n| n.to_le_bytes()));
        put_f64(out, &[vertical_fov]);
    }
}

/// Reads a sensor. `find` returns an object of the table before it, `numbers` those of the sensors that were read before.
///
/// # Errors
/// [`MessageError::Malformed`], [`MessageError::Unfit`].
pub(crate) fn get_sensor(
    data: &[u8],
    name: &str,
    find: impl Fn(usize) -> Option<ObjectId>,
    world: &World,
    numbers: &mut usize,
) -> Result<Sensor, MessageError> {
    let mut rest = ByteReader(data);
    let kind = SensorKind::ALL.get(rest.u8()? as usize).copied();
    let kind = kind.ok_or(MessageError::Malformed("an unknown kind of sensor"))?;
    let cutoff = f64::from_le_bytes(rest.array()?);
    let [deviation, bias_walk, quantization] = [rest.f64()?, rest.f64()?, rest.f64()?];
    let noise = SensorNoise { deviation, bias_walk, quantization, delay: rest.u32()?, seed: rest.u64()? };
    let site = match rest.u32()? {
        ELSEWHERE => None,
        WORLD => Some(Anchor::world(frame(&mut rest)?)),
        object => {
            let (id, part) = (find(object as usize), rest.u32()? as usize);
            let id = id.filter(|id| world.part_state(*id, part).is_some());
            let id = id.ok_or(MessageError::Malformed("a sensor on an unknown part"))?;
            Some(Anchor::on(id, part, frame(&mut rest)?))
        }
    };
    let optics = match kind.is_camera() {
        true => Some(Optics { resolution: [rest.u32()?, rest.u32()?], vertical_fov: rest.f64()? }),
        false => None,
    };
    rest.end()?;
    let made = || -> Result<Sensor, SensorError> {
        let sensor = Sensor::shown(name, kind, site).with_cutoff(cutoff)?.with_noise(noise)?;
        optics.map_or(Ok(sensor.clone()), |optics| sensor.with_optics(optics))
    };
    let sensor = made().map_err(|why| MessageError::Unfit(why.to_string()))?;
    let count = tumble_core::FrameState::len(&sensor);
    *numbers = numbers.saturating_add(count);
    match count <= MAX_NUMBERS[0] && *numbers <= MAX_NUMBERS[1] {
        true => Ok(sensor),
        false => Err(MessageError::Malformed("sensors with too many numbers")),
    }
}

fn frame(rest: &mut ByteReader<'_>) -> Result<Pose, MessageError> {
    let [x, y, z, i, j, k, w] = rest.f64s()?;
    let turn = Quaternion::new(w, i, j, k);
    if (turn.norm() - 1.0).abs() > 1e-6 {
        return Err(MessageError::Malformed("a rotation that is not of length 1"));
    }
    Ok(Pose::from_parts(Vec3::new(x, y, z).into(), UnitQuaternion::new_unchecked(turn)))
}

//! `[[sensor]]`: a measuring sensor on a body, a link, a loop joint or the world.

use std::collections::BTreeMap;

use tumble_core::collide::Pose;
use tumble_core::{MAX_DELAY, SensorKind, SensorNoise};

use crate::parse::body::read_name;
use crate::parse::bound::Bound;
use crate::parse::fields::{Fields, Names};
use crate::parse::loop_joint::{LoopJointSpec, PartSpec, Parts};
use crate::parse::rotation;
use crate::parse::shape::ShapeSpec;

/// The thing that a sensor is on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SensorPlaceSpec {
    /// The world.
    World,
    /// A body or a link. Kinds that read a joint read that which moves the link.
    Part(PartSpec),
    /// A loop joint, by its index in [`SceneFile::loop_joints`](crate::SceneFile::loop_joints).
    LoopJoint(usize),
}

/// One measuring sensor, all references resolved.
#[derive(Clone, Debug, PartialEq)]
pub struct SensorSpec {
    /// Unique in the scene, bodies and joints included.
    pub name: String,
    /// Quantity that it reads.
    pub kind: SensorKind,
    /// The thing that it is on.
    pub on: SensorPlaceSpec,
    /// The site in the frame of the body or link, or in the world.
    pub site: Pose,
    /// Body or link against which positions and velocities are read; `None` for the world.
    pub relative_to: Option<PartSpec>,
    /// Volume of a touch sensor in the frame of the site. Default: the whole link or body.
    pub volume: Option<ShapeSpec>,
    /// Largest absolute value of a reading, in its unit. Default infinite.
    pub cutoff: f64,
    /// Errors of the sensor. Default none.
    pub noise: SensorNoise,
}

const KINDS: Names<SensorKind> = &{
    let mut kinds = [("", SensorKind::Accelerometer); SensorKind::ALL.len()];
    let mut k = 0;
    while k < kinds.len() {
        kinds[k] = (SensorKind::NAMES[k], SensorKind::ALL[k]);
        k += 1;
    }
    kinds
};

impl SensorSpec {
    pub(crate) fn read(mut f: Fields<'_>, parts: &impl Parts, joints: &[LoopJointSpec]) -> Option<SensorSpec> {
        let name = read_name(&mut f).unwrap_or_default();
        let Some(kind) = f.choice("type", KINDS) else {
            f.give_up();
            return None;
        };
        let on = f.optional_text("on");
        let relative_to = if kind.has_reference() { f.optional_text("relative_to") } else { None };
        let site = if kind.reads_dof() { Pose::identity() } else { rotation::read_pose(&mut f) };
        let volume = if kind == SensorKind::Touch { read_volume(&mut f) } else { None };
        let oriented = kind == SensorKind::Orientation;
        let cutoff = if oriented { f64::INFINITY } else { f.number_or("cutoff", Bound::POSITIVE, f64::INFINITY) };
        let noise = SensorNoise {
            deviation: f.number_or("deviation", Bound::NOT_NEGATIVE, 0.0),
            bias_walk: f.number_or("bias_walk", Bound::NOT_NEGATIVE, 0.0),
            quantization: if oriented { 0.0 } else { f.number_or("quantization", Bound::NOT_NEGATIVE, 0.0) },
            delay: f.integer_or("delay", 0..=MAX_DELAY, 0),
            seed: u64::from(f.integer_or("seed", 0..=u32::MAX, 0)),
        };
        let place = match on {
            None if kind.reads_dof() || kind.reads_joint() || kind == SensorKind::Touch => {
                f.missing("on", "the name of a body, \"OBJECT/LINK\" or a loop joint");
                None
            }
            None => Some(SensorPlaceSpec::World),
            Some((name, value)) => {
                let joint = joints.iter().position(|joint| joint.name == name).map(SensorPlaceSpec::LoopJoint);
                let found = parts.part(name).map(SensorPlaceSpec::Part).or(joint);
                if found.is_none() {
                    let names = parts.names();
                    let known = names.iter().chain(joints.iter().map(|joint| &joint.name)).map(String::as_str);
                    f.unknown_name("on", value, name, known.collect());
                }
                found
            }
        };
        let reference = relative_to.and_then(|(name, value)| {
            let found = parts.part(name);
            if found.is_none() {
                f.unknown_name("relative_to", value, name, parts.names().iter().map(String::as_str).collect());
            }
            found
        });
        f.finish();
        Some(SensorSpec { name, kind, on: place?, site, relative_to: reference, volume, cutoff, noise })
    }
}

/// Reads `volume`, a shape without a mesh.
fn read_volume(f: &mut Fields<'_>) -> Option<ShapeSpec> {
    let value = f.value("volume")?;
    let example = "{ type = \"sphere\", radius_m = 0.05 }";
    let mut own = Fields::of(f.log, value, format!("the volume of {}", f.what), example)?;
    let shape = ShapeSpec::read_part(&mut own, &BTreeMap::new());
    own.finish();
    shape
}

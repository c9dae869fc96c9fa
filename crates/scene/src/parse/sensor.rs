//! `[[sensor]]`: a measuring sensor on a body, a link, a loop joint or the world.

use tumble_core::collide::Pose;
use tumble_core::{MAX_DELAY, MAX_DELAYED_PIXELS, Optics, SensorKind, SensorNoise};

use crate::parse::body::{Library, read_name};
use crate::parse::bound::Bound;
use crate::parse::fields::{Fields, Names};
use crate::parse::joint::JointSpec;
use crate::parse::loop_joint::{LoopJointSpec, PartSpec, Parts};
use crate::parse::rotation;
use crate::parse::shape::{ShapeContext, ShapeSpec};

/// The thing that a sensor is on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SensorPlaceSpec {
    /// The world.
    World,
    /// A body or a link. Kinds that read a joint read that which moves the link; positions, velocities and drives are those of a
    /// joint of its own.
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
    /// Resolution and angle of view of a camera.
    pub optics: Option<Optics>,
    /// Whether it is read. Default true.
    pub enabled: bool,
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
    pub(crate) fn read(
        mut f: Fields<'_>,
        library: &Library<'_>,
        parts: &impl Parts,
        joints: &[LoopJointSpec],
    ) -> Option<SensorSpec> {
        let name = read_name(&mut f).unwrap_or_default();
        let Some(kind) = f.choice("type", KINDS) else {
            f.give_up();
            return None;
        };
        let on = f.optional_text("on");
        let relative_to = if kind.has_reference() { f.optional_text("relative_to") } else { None };
        let site = if kind.reads_dof() { Pose::identity() } else { rotation::read_pose(&mut f) };
        let volume = if kind == SensorKind::Touch { read_volume(&mut f, library) } else { None };
        let oriented = kind == SensorKind::Orientation;
        let cutoff = if oriented { f64::INFINITY } else { f.number_or("cutoff", Bound::POSITIVE, f64::INFINITY) };
        let optics = kind.is_camera().then(|| read_optics(&mut f));
        let (noisy, scaled) = (kind.has_noise(), !oriented && kind.has_noise());
        let number =
            |f: &mut Fields<'_>, key, read: bool| if read { f.number_or(key, Bound::NOT_NEGATIVE, 0.0) } else { 0.0 };
        let noise = SensorNoise {
            deviation: number(&mut f, "deviation", noisy),
            bias_walk: number(&mut f, "bias_walk", noisy),
            quantization: number(&mut f, "quantization", scaled),
            delay: f.integer_or("delay", 0..=MAX_DELAY, 0),
            seed: f.seed(),
        };
        if let (Some(Optics { resolution: [width, height], .. }), Some(value)) = (optics, f.value("delay"))
            && u64::from(width) * u64::from(height) * u64::from(noise.delay) > MAX_DELAYED_PIXELS
        {
            f.wrong("delay", value, "steps whose images have at most 4194304 pixels in all");
        }
        let enabled = f.flag_or("enabled", true);
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
                if let Some(expected) = found.and_then(|place| unreadable(kind, place, parts, joints)) {
                    f.wrong("on", value, expected);
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
        Some(SensorSpec {
            name,
            kind,
            on: place?,
            site,
            relative_to: reference,
            volume,
            cutoff,
            noise,
            optics,
            enabled,
        })
    }
}

/// Returns what a sensor of that kind may be on, if it cannot be on this.
fn unreadable(
    kind: SensorKind,
    place: SensorPlaceSpec,
    parts: &impl Parts,
    joints: &[LoopJointSpec],
) -> Option<&'static str> {
    let (dof, joint) = (kind.reads_dof(), kind.reads_joint());
    match place {
        SensorPlaceSpec::Part(part) if dof && !parts.own_joint(&part).is_some_and(JointSpec::is_single) => {
            Some("a link with a revolute or prismatic joint, or a loop joint with a position")
        }
        SensorPlaceSpec::Part(part) if joint && parts.moving_joint(&part).is_none() => {
            Some("a link of an articulated body that a joint moves, or a loop joint")
        }
        SensorPlaceSpec::LoopJoint(at) if dof && !joints[at].kind.has_position() => {
            Some("a loop joint with a position, not one of this type, or a link with a revolute or prismatic joint")
        }
        SensorPlaceSpec::LoopJoint(_) if !dof && !joint => Some("a body or a link: this type of sensor reads a site"),
        _ => None,
    }
}

/// Reads `resolution` and `vertical_fov_deg` of a camera.
fn read_optics(f: &mut Fields<'_>) -> Optics {
    const EXPECTED: &str = "the pixels in a row and the rows, whole numbers above 0 with a product of at most 16777216";
    let usual = Optics::default();
    let mut resolution = usual.resolution;
    if let Some(value) = f.value("resolution") {
        let problems = f.log.count();
        let given: [f64; 2] = f.as_vector("resolution", value, Bound::ANY);
        let whole = given.iter().all(|n| n.fract() == 0.0 && *n >= 1.0) && given[0] * given[1] <= 16_777_216.0;
        match whole {
            true => resolution = given.map(|n| n as u32),
            false if f.log.count() == problems => f.wrong("resolution", value, EXPECTED),
            false => {}
        }
    }
    const DEGREES: Bound = Bound::new(1e-3, 179.3, "an angle from 0.001 to 179.3 degrees");
    const RADIANS: Bound = Bound::new(1e-5, 3.13, "an angle from 0.00001 to 3.13 radians");
    let degrees = f.optional_number("vertical_fov_deg", DEGREES).map(f64::to_radians);
    let vertical_fov = f.optional_number("vertical_fov_rad", RADIANS).or(degrees).unwrap_or(usual.vertical_fov);
    Optics { resolution, vertical_fov }
}

/// Reads `volume`.
fn read_volume(f: &mut Fields<'_>, library: &Library<'_>) -> Option<ShapeSpec> {
    let value = f.value("volume")?;
    let example = "{ type = \"sphere\", radius_m = 0.05 }";
    let mut own = Fields::of(f.log, value, format!("the volume of {}", f.what), example)?;
    let shape = ShapeSpec::read_part(&mut own, ShapeContext::of_meshes(&library.meshes));
    own.finish();
    shape
}

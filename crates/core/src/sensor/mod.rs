//! Measuring sensors: objects that write a reading of the world at the end of every frame.
//!
//! | quantity | what is read |
//! |---|---|
//! | poses, velocities, joint positions, distances | the value at the end of the frame |
//! | accelerations | the change of the velocity over the frame, divided by its length |
//! | forces, torques, touch | the impulse over the frame, divided by its length |
//!
//! Contacts and joints act by impulses, so an acceleration or a force at one moment does not exist when something
//! strikes. The mean over the frame always does, and its sum over frames is the change of the velocity, to rounding. A mean has the
//! axes of the site at the middle of the frame, so it agrees to second order in `dt` with the value there.
//!
//! A reading, the noise generator, the bias and the delayed readings are numbers of the state `X`: they are saved, forked and
//! restored with the world.
//!
//! | symbol | meaning |
//! |---|---|
//! | site | A frame fixed to a part, or to the world: [`Anchor`] |
//! | reference | The frame against which positions and velocities are read; the world by default |

pub(crate) mod balance;
mod camera;
mod kind;
pub(crate) mod loads;
pub(crate) mod measure;
mod noise;

pub use camera::{Optics, SensorImage};
pub use kind::SensorKind;
pub use noise::SensorNoise;

use crate::constraint::loop_joint::Anchor;
use crate::object::frame_state::{Frame, FrameImpulse};
use crate::object::net_sync::{read_state, write_state};
use crate::object::part_state::StateRange;
use crate::object::{FrameState, NetSync, Object, SyncError};
use crate::titled::titled;
use crate::world::view::{ObjectId, WorldView};
use tumble_collide::Shape;

/// Maximum delay of a reading, frames.
pub const MAX_DELAY: u32 = 10_000;
/// Maximum number of pixels that a camera keeps for its delay: pixels of an image times frames of the delay.
pub const MAX_DELAYED_PIXELS: u64 = 1 << 22;

/// An invalid constant of a sensor.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SensorError {
    /// A constant is out of its range.
    #[error("{}: {what} is {value}; it must be {expected}", titled("sensor", name))]
    Range {
        /// Sensor.
        name: String,
        /// The constant.
        what: &'static str,
        /// Value given.
        value: f64,
        /// Admissible range.
        expected: &'static str,
    },
    /// The kind of sensor does not have the setting, or cannot be at that place.
    #[error("{} of kind '{kind}': {why}", titled("sensor", name))]
    Kind {
        /// Sensor.
        name: String,
        /// Name of its kind.
        kind: &'static str,
        /// The fault.
        why: &'static str,
    },
}

/// The thing that a sensor is fixed to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SensorPlace {
    /// A frame fixed to a part or to the world.
    Site(Anchor),
    /// A loop joint.
    LoopJoint(ObjectId),
    /// A degree of freedom of an articulated body: its index in `v`.
    Dof(ObjectId, usize),
}

impl SensorPlace {
    /// Returns the object that it is on; `None` for the world.
    pub fn object(&self) -> Option<ObjectId> {
        match self {
            SensorPlace::Site(anchor) => anchor.part.map(|(id, _)| id),
            SensorPlace::LoopJoint(id) | SensorPlace::Dof(id, _) => Some(*id),
        }
    }
}

/// A measuring sensor.
///
/// ```
/// use tumble_core::prelude::*;
/// use tumble_core::{Anchor, Sensor, SensorKind};
/// let mut world = World::default();
/// world.add(RigidBody::fixed(Shape::half_space()))?;
/// let block = world.add(RigidBody::new(Shape::cuboid(Vec3::new(1.0, 1.0, 1.0))?).with_pose(Pose::translation(0.0, 0.0, 0.5)))?;
/// let imu = world.add(Sensor::new("imu", SensorKind::Accelerometer, Anchor::on(block, 0, Pose::identity()))?)?;
/// world.step()?;
/// let reading = world.reading(imu).expect("it was not removed");
/// assert!((reading[2] - 9.81).abs() < 1e-9); // what holds the block pushes upwards
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Sensor {
    name: String,
    kind: SensorKind,
    place: SensorPlace,
    reference: Option<Anchor>,
    volume: Option<Shape>,
    cutoff: f64,
    noise: SensorNoise,
    optics: Optics,
}

impl Sensor {
    /// Makes a sensor at a site. `Force` and `Torque` read the joint that moves the link of the site.
    ///
    /// # Errors
    /// [`SensorError::Kind`] for a kind that reads a joint's position, velocity or drive.
    pub fn new(name: impl Into<String>, kind: SensorKind, site: Anchor) -> Result<Sensor, SensorError> {
        Sensor::at(name.into(), kind, SensorPlace::Site(site))
    }

    /// Makes a sensor of a loop joint: force, torque, position, velocity or drive force.
    ///
    /// # Errors
    /// [`SensorError::Kind`] for another kind.
    pub fn of_joint(name: impl Into<String>, kind: SensorKind, joint: ObjectId) -> Result<Sensor, SensorError> {
        Sensor::at(name.into(), kind, SensorPlace::LoopJoint(joint))
    }

    /// Makes a sensor of a revolute or prismatic joint of an articulated body: position, velocity or drive force.
    /// `dof` is the index of its degree of freedom in `v`.
    ///
    /// # Errors
    /// [`SensorError::Kind`] for another kind.
    pub fn of_dof(
        name: impl Into<String>,
        kind: SensorKind,
        body: ObjectId,
        dof: usize,
    ) -> Result<Sensor, SensorError> {
        Sensor::at(name.into(), kind, SensorPlace::Dof(body, dof))
    }

    /// Makes a sensor at a place of any kind.
    ///
    /// # Errors
    /// [`SensorError::Kind`] if the kind does not go with the place.
    pub fn at(name: String, kind: SensorKind, place: SensorPlace) -> Result<Sensor, SensorError> {
        let why = match place {
            SensorPlace::Site(Anchor { part: None, .. }) if kind.needs_body() => Some("it must be on a body"),
            SensorPlace::Site(_) if kind.reads_dof() => Some("it reads a joint, not a site"),
            SensorPlace::LoopJoint(_) if !kind.reads_dof() && !kind.reads_joint() => Some("it reads a site"),
            SensorPlace::Dof(..) if !kind.reads_dof() => Some("it reads a site or a loop joint"),
            _ => None,
        };
        if let Some(why) = why {
            return Err(SensorError::Kind { name, kind: kind.name(), why });
        }
        let noise = SensorNoise::default();
        Ok(Sensor {
            name,
            kind,
            place,
            reference: None,
            volume: None,
            cutoff: f64::INFINITY,
            noise,
            optics: Optics::default(),
        })
    }

    /// Makes a sensor of a world that shows another one, for [`Replica::add_sensor`](crate::Replica::add_sensor): its readings come from
    /// there, so its place may be one that this world does not have. `site` is where a camera looks from; without one it looks from the
    /// origin of the world.
    pub fn shown(name: impl Into<String>, kind: SensorKind, site: Option<Anchor>) -> Sensor {
        let place = SensorPlace::Site(site.unwrap_or_else(|| Anchor::world(tumble_collide::Pose::identity())));
        let (noise, optics) = (SensorNoise::default(), Optics::default());
        Sensor { name: name.into(), kind, place, reference: None, volume: None, cutoff: f64::INFINITY, noise, optics }
    }

    /// Sets the frame against which a position, an orientation or a velocity is read.
    ///
    /// # Errors
    /// [`SensorError::Kind`] for another kind.
    pub fn relative_to(mut self, reference: Anchor) -> Result<Sensor, SensorError> {
        if !self.kind.has_reference() {
            return Err(self.wrong("only positions, orientations and velocities have a reference"));
        }
        self.reference = Some(reference);
        Ok(self)
    }

    /// Sets the volume of a touch sensor: contacts outside are not counted. Its frame is the site.
    ///
    /// # Errors
    /// [`SensorError::Kind`] for another kind.
    pub fn with_volume(mut self, volume: Shape) -> Result<Sensor, SensorError> {
        if self.kind != SensorKind::Touch {
            return Err(self.wrong("only touch sensors have a volume"));
        }
        self.volume = Some(volume);
        Ok(self)
    }

    /// Sets the largest absolute value of every number of a reading, in its unit; infinite for none. Of a camera of any kind it is the
    /// largest depth that it sees, m: what is farther is no hit.
    ///
    /// # Errors
    /// [`SensorError::Range`] for a number that is not above 0, [`SensorError::Kind`] for orientations.
    pub fn with_cutoff(mut self, cutoff: f64) -> Result<Sensor, SensorError> {
        if self.kind == SensorKind::Orientation && cutoff.is_finite() {
            return Err(self.wrong("an orientation has no cutoff"));
        }
        if cutoff.is_nan() || cutoff <= 0.0 {
            let expected = "above 0; infinite for none";
            return Err(SensorError::Range { name: self.name, what: "the cutoff", value: cutoff, expected });
        }
        self.cutoff = cutoff;
        Ok(self)
    }

    /// Sets the errors of the sensor.
    ///
    /// # Errors
    /// [`SensorError::Range`] for a constant out of its range, [`SensorError::Kind`] for a quantization of orientations.
    pub fn with_noise(mut self, noise: SensorNoise) -> Result<Sensor, SensorError> {
        if let Some((what, value, expected)) = noise.range_error() {
            return Err(SensorError::Range { name: self.name, what, value, expected });
        }
        if self.kind == SensorKind::Orientation && noise.quantization > 0.0 {
            return Err(self.wrong("an orientation has no quantization"));
        }
        let SensorNoise { delay, seed, .. } = noise;
        if !self.kind.has_noise() && noise != (SensorNoise { delay, seed, ..SensorNoise::default() }) {
            return Err(self.wrong("a segmentation has no noise: its numbers are names of parts; it may have a delay"));
        }
        self.noise = noise;
        self.with_kept_images()
    }

    /// Checks that the images that a camera keeps for its delay are not too many.
    fn with_kept_images(self) -> Result<Sensor, SensorError> {
        let [width, height] = self.optics.resolution.map(u64::from);
        let kept = width * height * u64::from(self.noise.delay);
        if self.kind.is_camera() && kept > MAX_DELAYED_PIXELS {
            let expected = "at most 4194304: a smaller resolution or a shorter delay";
            let what = "the number of pixels that its delay keeps";
            return Err(SensorError::Range { name: self.name, what, value: kept as f64, expected });
        }
        Ok(self)
    }

    /// Returns the places of its numbers in its range of `X`.
    pub(crate) fn layout(&self) -> noise::Layout {
        let [width, height] = self.optics.resolution.map(|n| n as usize);
        self.noise.layout(self.kind, width * height)
    }

    /// Sets resolution and angle of view of a camera.
    ///
    /// # Errors
    /// [`SensorError::Range`] for a constant out of its range, [`SensorError::Kind`] for another kind.
    pub fn with_optics(mut self, optics: Optics) -> Result<Sensor, SensorError> {
        if !self.kind.is_camera() {
            return Err(self.wrong("only cameras have a resolution and an angle of view"));
        }
        if let Some((what, value, expected)) = optics.range_error() {
            return Err(SensorError::Range { name: self.name, what, value, expected });
        }
        self.optics = optics;
        self.with_kept_images()
    }

    /// Sets its name.
    pub(crate) fn set_name(&mut self, name: &str) {
        self.name = name.into();
    }

    fn wrong(&self, why: &'static str) -> SensorError {
        SensorError::Kind { name: self.name.clone(), kind: self.kind.name(), why }
    }

    /// Returns the quantity that it reads.
    pub fn kind(&self) -> SensorKind {
        self.kind
    }

    /// Returns the thing that it is fixed to.
    pub fn place(&self) -> &SensorPlace {
        &self.place
    }

    /// Returns the frame against which it reads; `None` for the world.
    pub fn reference(&self) -> Option<&Anchor> {
        self.reference.as_ref()
    }

    /// Returns the volume of a touch sensor; `None` for the whole part.
    pub fn volume(&self) -> Option<&Shape> {
        self.volume.as_ref()
    }

    /// Returns the largest absolute value of a reading; infinite for none.
    pub fn cutoff(&self) -> f64 {
        self.cutoff
    }

    /// Returns resolution and angle of view of a camera.
    pub fn optics(&self) -> &Optics {
        &self.optics
    }

    /// Returns the errors of the sensor.
    pub fn noise(&self) -> &SensorNoise {
        &self.noise
    }
}

impl Object for Sensor {
    fn name(&self) -> &str {
        &self.name
    }

    fn frame_state(&self) -> Option<&dyn FrameState> {
        Some(self)
    }

    fn attached_to(&self, other: ObjectId) -> bool {
        self.place.object() == Some(other) || self.reference.is_some_and(|reference| reference.is_on(other))
    }

    /// All its numbers are sent: a facet reads what the server reads, to the bit.
    fn net_sync(&self) -> Option<&dyn NetSync> {
        (self.len() > 0).then_some(self as &dyn NetSync)
    }
}

impl NetSync for Sensor {
    fn get_data(&self, me: &StateRange, view: &WorldView, out: &mut Vec<u8>) {
        write_state(&view.x[me.x.clone()], out);
    }

    fn read_data(&self, data: &[u8], x: &mut [f64]) -> Result<(), SyncError> {
        read_state(data, x, |x| self.accepts(x))
    }
}

impl FrameState for Sensor {
    fn len(&self) -> usize {
        self.layout().len()
    }

    fn accepts(&self, x: &[f64]) -> bool {
        x.iter().all(|x| x.is_finite()) && self.layout().generator_is_sound(x)
    }

    /// Does nothing: the world takes all readings after the last impulse of the frame.
    fn advance(&self, _: &StateRange, _: &Frame, _: &mut [f64], _: &mut Vec<FrameImpulse>) {}
}

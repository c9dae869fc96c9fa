//! Sources of particles.

use super::random::Random;
use crate::error::{BehaviorError, check};
use crate::fields::check_vector;
use std::f64::consts::PI;
use tumble_collide::{Pose, Quat, Vec3};
use tumble_core::{Frame, ObjectId, PartState};

/// A source of particles: a burst at its start, and a stream from then on. Fields may be changed before it is given to a
/// system, which checks them.
#[derive(Clone, Debug, PartialEq)]
pub struct Emitter {
    /// Place of the source, m, and the axis of its cone, z; in the frame of the mount.
    pub pose: Pose,
    /// The part of a body that carries it; `None` for the world. A source whose body was removed is silent.
    pub mount: Option<(ObjectId, usize)>,
    /// Radius of a ball around the place, in which particles begin, m, at least 0.
    pub radius: f64,
    /// Least and greatest speed over the mount, m/s, at least 0.
    pub speed: [f64; 2],
    /// Half the angle of the cone of velocities, rad, 0 to π; π for all directions.
    pub half_angle: f64,
    /// Least and greatest lifetime, s, above 0.
    pub lifetime: [f64; 2],
    /// Number of particles at the start. They leave in pairs: of an even number each second one has the
    /// opposite velocity over the mount, if the cone is the whole sphere.
    pub burst: u32,
    /// Particles per second after the start, at least 0.
    pub rate: f64,
    /// Time of the start, s.
    pub start: f64,
    /// Time of the end of the stream, s; may be infinite.
    pub end: f64,
}

impl Default for Emitter {
    /// A silent source at the origin: all directions, 1 m/s, 1 s of life.
    fn default() -> Emitter {
        Emitter {
            pose: Pose::identity(),
            mount: None,
            radius: 0.0,
            speed: [1.0; 2],
            half_angle: PI,
            lifetime: [1.0; 2],
            burst: 0,
            rate: 0.0,
            start: 0.0,
            end: f64::INFINITY,
        }
    }
}

impl Emitter {
    /// Makes a burst of particles in all directions at a time.
    pub fn burst(point: Vec3, count: u32, time: f64) -> Emitter {
        let pose = Pose::from_parts(point.into(), Quat::identity());
        Emitter { pose, burst: count, start: time, ..Emitter::default() }
    }

    /// Makes a stream of particles per second from time 0 on.
    pub fn stream(pose: Pose, rate: f64) -> Emitter {
        Emitter { pose, rate, ..Emitter::default() }
    }

    pub(super) fn validate(&self) -> Result<(), BehaviorError> {
        check_vector("the place of an emitter", &self.pose.translation.vector)?;
        let rotation = self.pose.rotation.coords;
        rotation.iter().try_for_each(|q| check("the axis of an emitter", *q, true, "finite"))?;
        check("the half angle of an emitter", self.half_angle, (0.0..=PI).contains(&self.half_angle), "0 to π")?;
        check("the radius of an emitter", self.radius, self.radius >= 0.0, "at least 0")?;
        check("the rate of an emitter", self.rate, (0.0..=1e9).contains(&self.rate), "0 to 1e9")?;
        check("the start of an emitter", self.start, true, "finite")?;
        for (what, [least, most], above) in
            [("the speed of an emitter", self.speed, 0.0), ("the lifetime of an emitter", self.lifetime, 1e-9)]
        {
            check(what, least, least >= above, "at least 0, and a lifetime above 0")?;
            check(what, most, most >= least, "at least its least value")?;
        }
        if self.end.is_nan() {
            check("the end of an emitter", self.end, false, "a number")?;
        }
        Ok(())
    }

    /// Returns how many particles have left up to a time, s.
    fn count(&self, time: f64) -> u64 {
        if time < self.start {
            return 0;
        }
        let streamed = (self.rate * (time.min(self.end) - self.start)).max(0.0).floor();
        u64::from(self.burst) + if streamed.is_finite() { streamed as u64 } else { 0 }
    }

    /// Returns the numbers of the particles that leave after `from` and up to `to`, s. The first frame of a
    /// world includes what leaves at its start.
    pub(super) fn between(&self, from: f64, to: f64, first: bool) -> std::ops::Range<u64> {
        (if first { 0 } else { self.count(from) })..self.count(to)
    }

    /// Returns the time at which a particle leaves, s.
    fn time(&self, number: u64) -> f64 {
        match number.checked_sub(u64::from(self.burst)) {
            Some(streamed) => self.start + (streamed + 1) as f64 / self.rate,
            None => self.start,
        }
    }

    /// Returns a particle that leaves in a frame: the record without its serial number, the time within the frame,
    /// s, and its velocity over the mount, m/s. `None` without a mount that it should have.
    pub(super) fn birth(&self, number: u64, random: Random, twin: Random, frame: &Frame) -> Option<Birth> {
        let after = (self.time(number) - frame.start).clamp(0.0, frame.dt);
        let (pose, carrier) = self.carrier(frame, after / frame.dt)?;
        let paired = self.half_angle >= PI && number < u64::from(self.burst & !1);
        let (draw, sign) = if paired && number % 2 == 1 { (twin, -1.0) } else { (random, 1.0) };
        let between = |[least, most]: [f64; 2], k: u64| least + (most - least) * draw.uniform(k);
        let direction = sign * draw.within_cone(self.half_angle, 0);
        let offset = self.radius * nalgebra::ComplexField::cbrt(random.uniform(6)) * random.within_cone(PI, 4);
        let pose = pose * self.pose;
        let position = pose.transform_point(&offset.into()).coords;
        let relative = pose.rotation * (between(self.speed, 2) * direction);
        let velocity = relative + carrier.map_or_else(Vec3::zeros, |state| state.velocity_at(&position));
        Some(Birth { position, velocity, relative, life: between(self.lifetime, 3), after })
    }

    /// Returns the pose of the mount at a share of the frame, and its state at the end.
    fn carrier<'a>(&self, frame: &'a Frame, share: f64) -> Option<(Pose, Option<&'a PartState>)> {
        let Some((id, part)) = self.mount else { return Some((Pose::identity(), None)) };
        let row = frame.view.state_range(id)?.parts.clone().nth(part)?;
        let (before, after) = (&frame.before[row], &frame.view.part_states[row]);
        Some((super::obstacles::between(&before.pose, &after.pose, share), Some(after)))
    }
}

/// A particle as it leaves its source.
pub(super) struct Birth {
    pub position: Vec3,
    pub velocity: Vec3,
    /// Velocity over the mount.
    pub relative: Vec3,
    pub life: f64,
    /// Time after the start of the frame, s.
    pub after: f64,
}

//! Particles: sparks, smoke, drops, dust. Thousands of points that fly, collide with everything in the world, and die.
//!
//! A particle is no body: it has no contact row, and particles do not meet each other. The system is one object
//! whose state are all its particles, advanced once per frame after the bodies
//! ([`FrameState`](tumble_core::FrameState)). It is saved, forked and rolled back with the world.
//!
//! The state has a header of two numbers, and nine of each particle:
//!
//! | numbers | meaning |
//! |---|---|
//! | serial | serial number of the next particle |
//! | started | 1 after the first frame |
//! | `x`, `v` | position, m; velocity, m/s |
//! | life | time that is left, s; 0 or less of a free place |
//! | serial | serial number of the particle |
//! | lifetime | time from its birth to its end, s |

mod cells;
mod drawn;
mod emitter;
mod first_contact;
mod flight;
pub(crate) mod obstacles;
mod path;
mod random;

pub use drawn::ParticleLook;
pub use emitter::Emitter;

use crate::error::{BehaviorError, check};
use crate::fields::check_vector;
use crate::record;
use flight::{Flight, Memory};
use obstacles::Obstacles;
use path::Air;
use random::Random;
use tumble_collide::Vec3;
use tumble_core::archive::{ObjectIndices, ObjectRecord};
use tumble_core::{
    CollisionGroup, Frame, FrameImpulse, FrameState, Material, NetSync, Object, ObjectId, Renderable, StateRange,
    World, WorldError,
};

/// Length of the header and of a record.
const HEADER: usize = 2;
const RECORD: usize = 9;
/// Most particles of a system.
const MOST: usize = 10_000_000;
/// Least number of particles on a thread.
const PIECE: usize = 1024;

/// Constants of the particles of a system, SI units.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct ParticleSettings {
    /// Most particles that live at once, 1 to 10 million; more are not born.
    pub capacity: usize,
    /// Seed of the random numbers.
    pub seed: u64,
    /// Mass of a particle, kg, above 0.
    pub mass: f64,
    /// Radius of a particle, m, at least 0.
    pub radius: f64,
    /// Restitution and friction; its other constants have no effect.
    pub material: Material,
    /// Factor of gravity; negative for smoke that rises.
    pub gravity_scale: f64,
    /// Linear drag per mass, 1/s, at least 0.
    pub linear_drag: f64,
    /// Quadratic drag per mass, 1/m, at least 0: `½·ρ·C·A/m`.
    pub quadratic_drag: f64,
    /// Velocity of the air, m/s.
    pub wind: Vec3,
    /// Whether particles collide with bodies.
    pub collidable: bool,
    /// Collision group, and the groups that particles collide with.
    pub group: CollisionGroup,
    /// One bit per group.
    pub mask: u64,
    /// Whether bodies get the momentum that particles lose, and mounts the recoil. A particle is born with
    /// the velocity of its mount, whose mass stays.
    pub two_way: bool,
}

impl Default for ParticleSettings {
    /// Up to 10,000 particles of 1 g and 1 cm without drag, that collide one way.
    fn default() -> ParticleSettings {
        ParticleSettings {
            capacity: 10_000,
            seed: 0,
            mass: 1e-3,
            radius: 0.01,
            material: Material::default(),
            gravity_scale: 1.0,
            linear_drag: 0.0,
            quadratic_drag: 0.0,
            wind: Vec3::zeros(),
            collidable: true,
            group: CollisionGroup::default(),
            mask: u64::MAX,
            two_way: false,
        }
    }
}

/// A system of particles.
///
/// ```
/// # use tumble_core::prelude::*;
/// # let mut world = World::default();
/// use tumble_behaviors::{Emitter, ParticleSettings, ParticleSystem};
/// let sparks = ParticleSettings { linear_drag: 0.5, two_way: true, ..ParticleSettings::default() };
/// let sparks = ParticleSystem::new("sparks", sparks)?.with_emitter(Emitter::burst(Vec3::new(0.0, 0.0, 1.0), 500, 0.0))?;
/// let sparks = world.add(sparks)?;
/// world.step()?;
/// assert_eq!(ParticleSystem::particles(&world, sparks).unwrap().count(), 500);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct ParticleSystem {
    name: String,
    settings: ParticleSettings,
    emitters: Vec<Emitter>,
    look: ParticleLook,
}

/// A particle that lives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Particle {
    /// Position, m.
    pub position: Vec3,
    /// Velocity, m/s.
    pub velocity: Vec3,
    /// Time that is left, s.
    pub life: f64,
    /// Time from its birth to its end, s.
    pub lifetime: f64,
    /// Its number, in the order of birth in its system.
    pub serial: u64,
}

impl ParticleSystem {
    /// Makes a system without sources.
    ///
    /// # Errors
    /// [`BehaviorError::Range`] names the constant that is out of its range.
    pub fn new(name: impl Into<String>, settings: ParticleSettings) -> Result<ParticleSystem, BehaviorError> {
        let s = &settings;
        let capacity = s.capacity as f64;
        check("the capacity", capacity, (1..=MOST).contains(&s.capacity), "1 to 10 million")?;
        check("the mass of a particle", s.mass, s.mass > 0.0, "above 0")?;
        for (what, value) in [
            ("the radius of a particle", s.radius),
            ("the linear drag", s.linear_drag),
            ("the quadratic drag", s.quadratic_drag),
            ("the friction", s.material.friction),
        ] {
            check(what, value, value >= 0.0, "at least 0")?;
        }
        check("the restitution", s.material.restitution, (0.0..=1.0).contains(&s.material.restitution), "0 to 1")?;
        check("the gravity scale", s.gravity_scale, true, "finite")?;
        check_vector("the velocity of the air", &s.wind)?;
        Ok(ParticleSystem { name: name.into(), settings, emitters: Vec::new(), look: ParticleLook::default() })
    }

    /// Adds a source.
    ///
    /// # Errors
    /// [`BehaviorError::Range`] names the constant that is out of its range.
    pub fn with_emitter(mut self, emitter: Emitter) -> Result<ParticleSystem, BehaviorError> {
        emitter.validate()?;
        self.emitters.push(emitter);
        Ok(self)
    }

    /// Returns the constants.
    pub fn settings(&self) -> &ParticleSettings {
        &self.settings
    }

    /// Returns the particles of a system that live, in the order of their places; `None` if the id is of another
    /// object.
    pub fn particles(world: &World, system: ObjectId) -> Option<impl Iterator<Item = Particle> + '_> {
        world.get::<ParticleSystem>(system)?;
        let records = world.state_of(system)?[HEADER..].chunks_exact(RECORD);
        Some(records.filter(|record| record[6] > 0.0).map(|record| Particle {
            position: Vec3::from_column_slice(&record[..3]),
            velocity: Vec3::from_column_slice(&record[3..6]),
            life: record[6],
            lifetime: record[8],
            serial: record[7] as u64,
        }))
    }

    /// Adds a particle between two steps: position, m, velocity, m/s, lifetime, s, above 0. Returns its serial
    /// number; `None` if all places are taken.
    ///
    /// # Errors
    /// [`WorldError::Stale`] if the id is of no system; [`WorldError::BadState`] if a number is not finite, or the lifetime
    /// is not above 0.
    pub fn spawn(
        world: &mut World,
        system: ObjectId,
        position: Vec3,
        velocity: Vec3,
        life: f64,
    ) -> Result<Option<u64>, WorldError> {
        world.get::<ParticleSystem>(system).ok_or(WorldError::Stale)?;
        let mut x = world.state_of(system).ok_or(WorldError::Stale)?.to_vec();
        let (header, records) = x.split_at_mut(HEADER);
        let Some(record) = records.chunks_exact_mut(RECORD).find(|record| record[6] <= 0.0) else { return Ok(None) };
        if !(life > 0.0 && life.is_finite()) {
            return Err(WorldError::BadState(world.name(system).unwrap_or_default().to_string()));
        }
        let serial = header[0];
        write(record, &position, &velocity, [life; 2], serial);
        header[0] += 1.0;
        world.write_state_of(system, &x)?;
        Ok(Some(serial as u64))
    }

    /// Lets the particles fly that leave their sources in this frame. Particles without a place are lost.
    fn bear(&self, flight: &Flight, header: &mut [f64], records: &mut [f64], memory: &mut Memory) {
        let (frame, begin) = (flight.frame, flight.frame.start);
        let mut free = records.chunks_exact_mut(RECORD).filter(|record| record[6] <= 0.0);
        for emitter in &self.emitters {
            // what leaves at the very start of the first frame is not left out
            let first = header[1] == 0.0 && emitter.start >= begin;
            let numbers = emitter.between(begin, frame.view.time, first);
            let serials = header[0];
            header[0] += (numbers.end - numbers.start.min(numbers.end)) as f64;
            for (number, k) in numbers.zip(0u64..) {
                let Some(record) = free.next() else { break };
                let serial = serials + k as f64;
                let random = |serial: f64| Random::new(self.settings.seed, serial.max(0.0) as u64);
                let Some(birth) = emitter.birth(number, random(serial), random(serial - 1.0), frame) else { break };
                let (mut x, mut v) = (birth.position, birth.velocity);
                flight.fly(&mut x, &mut v, birth.after, memory);
                write(record, &x, &v, [birth.life - (frame.dt - birth.after), birth.life], serial);
                if let (true, Some((id, part))) = (self.settings.two_way, emitter.mount) {
                    let impulse = -self.settings.mass * birth.relative;
                    memory.impulses.push(FrameImpulse { id, part, impulse, point: birth.position });
                }
            }
        }
    }
}

/// Writes the record of a particle, with the time that is left and its lifetime, s.
fn write(record: &mut [f64], x: &Vec3, v: &Vec3, [life, lifetime]: [f64; 2], serial: f64) {
    record[..3].copy_from_slice(x.as_slice());
    record[3..6].copy_from_slice(v.as_slice());
    (record[6], record[7], record[8]) = (life, serial, lifetime);
}

impl Object for ParticleSystem {
    fn record(&self, indices: &ObjectIndices) -> Option<ObjectRecord> {
        record::particles(self, indices)
    }
    fn name(&self) -> &str {
        &self.name
    }
    fn frame_state(&self) -> Option<&dyn FrameState> {
        Some(self)
    }
    fn renderable(&self) -> Option<&dyn Renderable> {
        Some(self)
    }
    fn net_sync(&self) -> Option<&dyn NetSync> {
        Some(self)
    }
}

impl FrameState for ParticleSystem {
    fn len(&self) -> usize {
        HEADER + RECORD * self.settings.capacity
    }

    fn advance(&self, _me: &StateRange, frame: &Frame, x: &mut [f64], out: &mut Vec<FrameImpulse>) {
        let s = &self.settings;
        let mask = if s.collidable { s.mask } else { 0 };
        let obstacles = Obstacles::new(frame, s.radius, s.group, mask);
        let gravity = s.gravity_scale * frame.view.gravity;
        let air = Air::new(gravity, s.wind, [s.linear_drag, s.quadratic_drag], frame.dt);
        let (radius, mass, material, two_way) = (s.radius, s.mass, s.material, s.two_way);
        let flight = Flight { frame, obstacles: &obstacles, air, radius, mass, material, two_way };
        let (header, records) = x.split_at_mut(HEADER);
        let impulses = frame.each_piece(records, RECORD, PIECE, |_, records| {
            let mut memory = Memory::default();
            for record in records.chunks_exact_mut(RECORD).filter(|record| record[6] > 0.0) {
                record[6] -= frame.dt;
                if record[6] > 0.0 {
                    let (mut x, mut v) =
                        (Vec3::from_column_slice(&record[..3]), Vec3::from_column_slice(&record[3..6]));
                    flight.fly(&mut x, &mut v, 0.0, &mut memory);
                    record[..3].copy_from_slice(x.as_slice());
                    record[3..6].copy_from_slice(v.as_slice());
                }
            }
            memory.impulses
        });
        let mut memory = Memory::default();
        memory.impulses = impulses.concat();
        self.bear(&flight, header, records, &mut memory);
        header[1] = 1.0;
        out.append(&mut memory.impulses);
    }
}

//! The bytes of particles, obstacles and constants on the device, in both precisions.
//!
//! The order of all fields is the same. In single precision a place is three integers, nothing, and three rests (see `particles_single.wgsl`);
//! in double precision it is three numbers (`particles_double.wgsl`). Four numbers are one row, as shaders align vectors.

use super::{FARTHEST, FreeParticle, FreeParticles, Obstacle, ObstacleShape, Precision, check};
use crate::RenderError;
use nalgebra::Vector3;

/// Unit of the integers of single precision, m and m/s.
const UNIT: f64 = 1.0 / 16.0;

/// Writes and reads the bytes of one precision.
#[derive(Clone, Copy)]
pub(super) struct Layout(pub Precision);

/// Bytes that grow.
struct Bytes {
    bytes: Vec<u8>,
    precision: Precision,
}

impl Layout {
    /// Returns the text of the device's program.
    pub fn program(self) -> String {
        let numbers = match self.0 {
            Precision::Single => include_str!("../../shaders/particles_single.wgsl"),
            Precision::Double => include_str!("../../shaders/particles_double.wgsl"),
        };
        format!("{numbers}{}", include_str!("../../shaders/particles.wgsl"))
    }

    /// Returns what the device has to offer for it.
    pub fn features(self) -> wgpu::Features {
        match self.0 {
            Precision::Single => wgpu::Features::empty(),
            Precision::Double => wgpu::Features::SHADER_F64,
        }
    }

    /// Returns the size of a particle: two places, each with a number after it.
    pub fn particle_size(self) -> usize {
        64
    }

    /// Returns the constants, with the numbers of particles and obstacles, for a number of frames.
    pub fn settings(self, constants: &FreeParticles, [particles, obstacles]: [u32; 2], frames: u32) -> Vec<u8> {
        let z = constants.linear_drag * constants.dt;
        let one = if z == 0.0 { 1.0 } else { -(-z).exp_m1() / z };
        let two = match z {
            0.0..1e-3 => 0.5 - z * (1.0 / 6.0 - z * (1.0 / 24.0 - z * (1.0 / 120.0 - z / 720.0))),
            _ => (1.0 - one) / z,
        };
        let mut bytes = self.bytes();
        bytes.vector(&constants.gravity).number(constants.dt).vector(&constants.wind).number(constants.linear_drag);
        bytes.number(constants.quadratic_drag).number(constants.radius).number(one).number(two);
        bytes.words(&[particles, obstacles, frames, 0]);
        bytes.rows()
    }

    /// Returns the bytes of at least one obstacle: a buffer is not empty.
    pub fn obstacles(self, obstacles: &[Obstacle]) -> Result<Vec<u8>, RenderError> {
        let mut bytes = self.bytes();
        obstacles.iter().try_for_each(|obstacle| bytes.obstacle(obstacle))?;
        if obstacles.is_empty() {
            bytes.obstacle(&Obstacle {
                shape: ObstacleShape::HalfSpace,
                pose: nalgebra::Isometry3::identity(),
                restitution: 0.0,
                friction: 0.0,
            })?;
        }
        Ok(bytes.bytes)
    }

    /// Returns the bytes of at least one particle, with frames of `dt` seconds.
    pub fn particles(self, particles: &[FreeParticle], dt: f64) -> Result<Vec<u8>, RenderError> {
        let mut bytes = self.bytes();
        bytes.bytes.reserve(self.particle_size() * particles.len());
        particles.iter().try_for_each(|particle| bytes.particle(particle, dt))?;
        bytes.bytes.resize(bytes.bytes.len().max(self.particle_size()), 0);
        Ok(bytes.bytes)
    }

    /// Returns position and velocity of a particle.
    pub fn read(self, bytes: &[u8]) -> [Vector3<f64>; 2] {
        let half = bytes.len() / 2;
        [&bytes[..half], &bytes[half..]].map(|bytes| match self.0 {
            Precision::Single => {
                let whole: [i32; 3] = bytemuck::pod_read_unaligned(&bytes[..12]);
                let rest: [f32; 3] = bytemuck::pod_read_unaligned(&bytes[16..28]);
                UNIT * Vector3::from(whole).map(f64::from) + Vector3::from(rest).map(f64::from)
            }
            Precision::Double => Vector3::from(bytemuck::pod_read_unaligned::<[f64; 3]>(&bytes[..24])),
        })
    }

    fn bytes(self) -> Bytes {
        Bytes { bytes: Vec::new(), precision: self.0 }
    }
}

impl Bytes {
    fn words(&mut self, words: &[u32]) -> &mut Self {
        self.bytes.extend_from_slice(bytemuck::cast_slice(words));
        self
    }

    fn number(&mut self, x: f64) -> &mut Self {
        match self.precision {
            Precision::Single => self.bytes.extend_from_slice(&(x as f32).to_ne_bytes()),
            Precision::Double => self.bytes.extend_from_slice(&x.to_ne_bytes()),
        }
        self
    }

    fn vector(&mut self, v: &Vector3<f64>) -> &mut Self {
        v.iter().for_each(|x| _ = self.number(*x));
        self
    }

    /// Adds an integer in the space of a number.
    fn integer(&mut self, n: u32) -> &mut Self {
        match self.precision {
            Precision::Single => self.words(&[n]),
            Precision::Double => self.words(&[n, 0]),
        }
    }

    /// Adds a position or a velocity.
    fn place(&mut self, what: &'static str, x: &Vector3<f64>) -> Result<&mut Self, RenderError> {
        x.iter().try_for_each(|x| check(what, *x, x.abs() <= FARTHEST, "at most 1e6"))?;
        if self.precision == Precision::Double {
            return Ok(self.vector(x));
        }
        let whole = x.map(|x| (x / UNIT).round());
        self.bytes.extend_from_slice(bytemuck::cast_slice(&[whole.x as i32, whole.y as i32, whole.z as i32, 0]));
        Ok(self.vector(&(x - UNIT * whole)))
    }

    fn particle(&mut self, particle: &FreeParticle, dt: f64) -> Result<(), RenderError> {
        check("the life of a particle", particle.life, true, "finite")?;
        // it moves in a frame at whose end it still lives
        let frames = ((particle.life / dt).ceil() - 1.0).clamp(0.0, f64::from(u32::MAX)) as u32;
        self.place("a coordinate of a particle", &particle.position)?.integer(frames);
        self.place("a velocity of a particle", &particle.velocity)?.integer(0);
        Ok(())
    }

    fn obstacle(&mut self, obstacle: &Obstacle) -> Result<(), RenderError> {
        let (restitution, friction) = (obstacle.restitution, obstacle.friction);
        check("the restitution of an obstacle", restitution, (0.0..=1.0).contains(&restitution), "0 to 1")?;
        check("the friction of an obstacle", friction, friction >= 0.0, "at least 0")?;
        let axes = obstacle.pose.rotation.to_rotation_matrix();
        let axis = |k: usize| axes.matrix().column(k).into_owned();
        let (kind, radius, half, x_axis) = match obstacle.shape {
            ObstacleShape::HalfSpace => (0, 0.0, Vector3::zeros(), axis(2)),
            ObstacleShape::Sphere(radius) => (1, radius, Vector3::zeros(), axis(0)),
            ObstacleShape::Box(size) => (2, 0.0, 0.5 * size, axis(0)),
        };
        for size in half.iter().copied().chain([radius]) {
            check("a size of an obstacle", size, size >= 0.0, "at least 0")?;
        }
        self.place("a coordinate of an obstacle", &obstacle.pose.translation.vector)?.number(radius);
        self.vector(&x_axis).number(restitution).vector(&axis(1)).number(friction);
        self.vector(&axis(2)).integer(kind).vector(&half).integer(0);
        Ok(())
    }

    /// Returns the bytes, in whole rows.
    fn rows(self) -> Vec<u8> {
        let row = if self.precision == Precision::Single { 16 } else { 32 };
        let mut bytes = self.bytes;
        bytes.resize(bytes.len().next_multiple_of(row), 0);
        bytes
    }
}

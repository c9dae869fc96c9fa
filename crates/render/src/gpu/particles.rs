//! Free particles on the graphics device: gravity, wind, drag, and collisions with things that do not move.
//!
//! ```text
//! v(t) = v₀ + a₀·t·φ₁(γt)     x(t) = x₀ + v₀·t + a₀·t²·φ₂(γt)     a₀ = g + γ·(w − v₀)
//! impact   u_n' = −e·u_n,   |Δu_t| = min(μ·(1 + e)·|u_n|, |u_t|)
//! X = (n, r):  x = n/16 + r,  |r| ≤ 1/32
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `x`, `v` | position, velocity |
//! | `g`, `w`, `γ` | gravity; velocity of the air; drag per mass and speed, that in the middle of a step |
//! | `φ₁`, `φ₂` | `(1 − e^{−z})/z`, `(z − 1 + e^{−z})/z²` |
//! | `u`, `e`, `μ` | velocity over the surface; restitution and friction |
//! | `n`, `r` | an integer and a rest in `f32`, for each coordinate |
//!
//! The laws are those of the particle systems of `tumble-behaviors`. The device computes in `f32`, whose sums lose a
//! part in 10⁷ of the whole in each frame. So positions and velocities are an integer and a small rest: a frame
//! loses a part in 10⁷ of its change alone, and places of impacts are measured from the obstacle. A compensated sum would do as
//! well, but compilers of shaders may simplify it away; integers they must keep.

use super::targets::wait;
use super::{Gpu, first_adapter};
use crate::RenderError;
use bytemuck::{Pod, Zeroable};
use nalgebra::{Isometry3, Vector3};
use std::num::NonZeroU64;

/// Most particles, and most obstacles.
pub const MAX_PARTICLES: usize = 1_000_000;
/// Most obstacles of particles.
pub const MAX_OBSTACLES: usize = 256;
/// Farthest coordinate of a particle, m, and largest speed, m/s.
const FARTHEST: f64 = 1e6;
/// Unit of the integers, m and m/s.
const UNIT: f64 = 1.0 / 16.0;
/// Most frames of one dispatch: drivers stop work that takes seconds.
const FRAMES: u32 = 16;
/// Particles of a workgroup, and most workgroups along x.
const GROUP: u32 = 64;
const GROUPS: u32 = 4096;

/// Constants of free particles, SI units.
#[derive(Clone, Debug, PartialEq)]
pub struct FreeParticles {
    /// Length of a frame, s, above 0.
    pub dt: f64,
    /// Gravity, m/s².
    pub gravity: Vector3<f64>,
    /// Velocity of the air, m/s.
    pub wind: Vector3<f64>,
    /// Linear drag per mass, 1/s, at least 0.
    pub linear_drag: f64,
    /// Quadratic drag per mass, 1/m, at least 0.
    pub quadratic_drag: f64,
    /// Radius of a particle, m, at least 0.
    pub radius: f64,
}

impl Default for FreeParticles {
    /// Particles of 1 cm without drag under gravity, at 60 Hz.
    fn default() -> FreeParticles {
        let gravity = Vector3::new(0.0, 0.0, -9.81);
        let (wind, linear_drag, quadratic_drag, radius) = (Vector3::zeros(), 0.0, 0.0, 0.01);
        FreeParticles { dt: 1.0 / 60.0, gravity, wind, linear_drag, quadratic_drag, radius }
    }
}

/// A particle on the device.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FreeParticle {
    /// Position, m.
    pub position: Vector3<f64>,
    /// Velocity, m/s.
    pub velocity: Vector3<f64>,
    /// Time that is left, s; at 0 or less it does not move.
    pub life: f64,
}

/// The shape of an [`Obstacle`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ObstacleShape {
    /// Everything below the xy-plane of its pose.
    HalfSpace,
    /// A sphere of a radius, m.
    Sphere(f64),
    /// A box with full edge lengths, m.
    Box(Vector3<f64>),
}

/// A thing that does not move, and that particles collide with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Obstacle {
    /// Its shape.
    pub shape: ObstacleShape,
    /// Its pose in the world.
    pub pose: Isometry3<f64>,
    /// Restitution of the pair, 0 to 1.
    pub restitution: f64,
    /// Coefficient of friction of the pair, at least 0.
    pub friction: f64,
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct RawParticle {
    place: [i32; 3],
    frames: u32,
    place_rest: [f32; 3],
    pad_0: u32,
    speed: [i32; 3],
    pad_1: u32,
    speed_rest: [f32; 3],
    pad_2: u32,
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct RawObstacle {
    place: [i32; 3],
    kind: u32,
    place_rest: [f32; 3],
    radius: f32,
    x_axis: [f32; 3],
    restitution: f32,
    y_axis: [f32; 3],
    friction: f32,
    z_axis: [f32; 3],
    pad_0: u32,
    half: [f32; 3],
    pad_1: u32,
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct RawSettings {
    gravity: [f32; 3],
    dt: f32,
    wind: [f32; 3],
    linear: f32,
    quadratic: f32,
    radius: f32,
    one: f32,
    two: f32,
    count: u32,
    obstacles: u32,
    frames: u32,
    pad: u32,
}

/// Free particles on a graphics device of their own.
///
/// ```no_run
/// use nalgebra::{Isometry3, Vector3};
/// use tumble_render::{FreeParticle, FreeParticles, GpuParticles, Obstacle, ObstacleShape};
/// let ground = Obstacle { shape: ObstacleShape::HalfSpace, pose: Isometry3::identity(), restitution: 0.4, friction: 0.5 };
/// let spark = FreeParticle { position: Vector3::new(0.0, 0.0, 2.0), velocity: Vector3::x(), life: 10.0 };
/// let mut sparks = GpuParticles::new(&FreeParticles::default(), &[ground], &vec![spark; 100_000])?;
/// sparks.advance(600)?;
/// println!("{}", sparks.read()?[0].position);
/// # Ok::<(), tumble_render::RenderError>(())
/// ```
pub struct GpuParticles {
    gpu: Gpu,
    pipeline: wgpu::ComputePipeline,
    bindings: wgpu::BindGroup,
    uniform: wgpu::Buffer,
    particles: wgpu::Buffer,
    settings: RawSettings,
    /// Life of each particle at the start, s.
    lives: Vec<f64>,
    dt: f64,
    /// Frames so far.
    frames: u64,
}

impl GpuParticles {
    /// Finds an adapter and gives it particles.
    ///
    /// # Errors
    /// [`RenderError::Particles`] names a number that is out of its range; [`RenderError::TooMany`];
    /// [`RenderError::NoAdapter`] if the machine has no adapter, and [`RenderError::Device`] if it fails.
    pub fn new(
        constants: &FreeParticles,
        obstacles: &[Obstacle],
        particles: &[FreeParticle],
    ) -> Result<GpuParticles, RenderError> {
        constants.validate()?;
        for (what, count, cap) in
            [("obstacles", obstacles.len(), MAX_OBSTACLES), ("particles", particles.len(), MAX_PARTICLES)]
        {
            if count > cap {
                return Err(RenderError::TooMany { what, count, cap });
            }
        }
        let mut raw = obstacles.iter().map(Obstacle::raw).collect::<Result<Vec<_>, _>>()?;
        raw.resize(raw.len().max(1), RawObstacle::zeroed()); // a buffer is not empty
        let mut flying = particles.iter().map(|p| p.raw(constants.dt)).collect::<Result<Vec<_>, _>>()?;
        flying.resize(flying.len().max(1), RawParticle::zeroed());
        let gpu = pollster::block_on(Gpu::open(pollster::block_on(first_adapter())?))?;
        let buffer = |label: &str, bytes: &[u8], usage: wgpu::BufferUsages| {
            let size = bytes.len() as u64;
            let usage = usage | wgpu::BufferUsages::COPY_DST;
            let descriptor = wgpu::BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: false };
            let buffer = gpu.device.create_buffer(&descriptor);
            gpu.queue.write_buffer(&buffer, 0, bytes);
            buffer
        };
        let settings = constants.raw(particles.len(), obstacles.len());
        let uniform = buffer("particle settings", bytemuck::bytes_of(&settings), wgpu::BufferUsages::UNIFORM);
        let walls = buffer("obstacles", bytemuck::cast_slice(&raw), wgpu::BufferUsages::STORAGE);
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC;
        let flying = buffer("particles", bytemuck::cast_slice(&flying), usage);
        let (pipeline, bindings) = program(&gpu.device, [&uniform, &walls, &flying]);
        gpu.complaint()?;
        let lives = particles.iter().map(|particle| particle.life).collect();
        let dt = constants.dt;
        Ok(GpuParticles { gpu, pipeline, bindings, uniform, particles: flying, settings, lives, dt, frames: 0 })
    }

    /// The adapter in use: its name, kind and interface.
    pub fn adapter(&self) -> &str {
        self.gpu.adapter.as_str()
    }

    /// Advances all particles by a number of frames, and waits for the device.
    ///
    /// # Errors
    /// [`RenderError::Device`] if the device fails.
    pub fn advance(&mut self, frames: u32) -> Result<(), RenderError> {
        let groups = self.settings.count.div_ceil(GROUP);
        let (x, y) = (groups.clamp(1, GROUPS), groups.div_ceil(GROUPS).max(1));
        let mut left = frames;
        while left > 0 {
            self.settings.frames = left.min(FRAMES);
            left -= self.settings.frames;
            self.gpu.queue.write_buffer(&self.uniform, 0, bytemuck::bytes_of(&self.settings));
            let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
            {
                let mut pass = encoder.begin_compute_pass(&Default::default());
                pass.set_pipeline(&self.pipeline);
                pass.set_bind_group(0, &self.bindings, &[]);
                pass.dispatch_workgroups(x, y, 1);
            }
            self.gpu.queue.submit([encoder.finish()]);
            wait(&self.gpu)?;
        }
        self.frames += u64::from(frames);
        Ok(())
    }

    /// Copies all particles from the device, in the order in which they were given.
    ///
    /// # Errors
    /// [`RenderError::Device`] if the device fails.
    pub fn read(&self) -> Result<Vec<FreeParticle>, RenderError> {
        let gpu = &self.gpu;
        let usage = wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ;
        let size = self.particles.size();
        let descriptor =
            wgpu::BufferDescriptor { label: Some("particles read"), size, usage, mapped_at_creation: false };
        let copy = gpu.device.create_buffer(&descriptor);
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        encoder.copy_buffer_to_buffer(&self.particles, 0, &copy, 0, size);
        gpu.queue.submit([encoder.finish()]);
        let (sender, receiver) = std::sync::mpsc::channel();
        copy.map_async(wgpu::MapMode::Read, .., move |r| {
            let _ = sender.send(r); // the receiver waits below
        });
        wait(gpu)?;
        receiver.recv().map_err(|e| gpu.failed(e.to_string()))?.map_err(|e| gpu.failed(e.to_string()))?;
        let bytes = copy.get_mapped_range(..).map_err(|e| gpu.failed(e.to_string()))?;
        let passed = self.frames as f64 * self.dt;
        let raw = bytes.chunks_exact(size_of::<RawParticle>()).map(bytemuck::pod_read_unaligned::<RawParticle>);
        Ok(raw.zip(&self.lives).map(|(raw, life)| raw.particle(life - passed)).collect())
    }
}

/// Makes the program and binds its buffers: constants, obstacles, particles.
fn program(device: &wgpu::Device, buffers: [&wgpu::Buffer; 3]) -> (wgpu::ComputePipeline, wgpu::BindGroup) {
    let kinds = [
        wgpu::BufferBindingType::Uniform,
        wgpu::BufferBindingType::Storage { read_only: true },
        wgpu::BufferBindingType::Storage { read_only: false },
    ];
    let entries: Vec<wgpu::BindGroupLayoutEntry> = (0..)
        .zip(kinds)
        .map(|(binding, ty)| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty: wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None::<NonZeroU64> },
            count: None,
        })
        .collect();
    let label = Some("particles");
    let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label, entries: &entries });
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label,
        source: wgpu::ShaderSource::Wgsl(include_str!("../shaders/particles.wgsl").into()),
    });
    let descriptor =
        wgpu::PipelineLayoutDescriptor { label, bind_group_layouts: &[Some(&layout)], ..Default::default() };
    let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label,
        layout: Some(&device.create_pipeline_layout(&descriptor)),
        module: &module,
        entry_point: Some("advance"),
        compilation_options: Default::default(),
        cache: None,
    });
    let entries: Vec<wgpu::BindGroupEntry> = (0..)
        .zip(buffers)
        .map(|(binding, buffer)| wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() })
        .collect();
    let bindings = device.create_bind_group(&wgpu::BindGroupDescriptor { label, layout: &layout, entries: &entries });
    (pipeline, bindings)
}

/// Returns an error unless a number fits.
fn check(what: &'static str, value: f64, fits: bool, range: &'static str) -> Result<(), RenderError> {
    if value.is_finite() && fits { Ok(()) } else { Err(RenderError::Particles { what, value, range }) }
}

/// Divides coordinates into integers and rests.
fn divide(what: &'static str, x: &Vector3<f64>) -> Result<([i32; 3], [f32; 3]), RenderError> {
    x.iter().try_for_each(|x| check(what, *x, x.abs() <= FARTHEST, "at most 1e6"))?;
    let whole = x.map(|x| (x / UNIT).round());
    Ok((whole.map(|n| n as i32).into(), (x - UNIT * whole).map(|r| r as f32).into()))
}

fn floats(v: &Vector3<f64>) -> [f32; 3] {
    v.map(|x| x as f32).into()
}

impl FreeParticles {
    fn validate(&self) -> Result<(), RenderError> {
        check("the length of a frame", self.dt, self.dt > 0.0, "above 0")?;
        for (what, value) in [
            ("the linear drag of particles", self.linear_drag),
            ("the quadratic drag of particles", self.quadratic_drag),
            ("the radius of particles", self.radius),
        ] {
            check(what, value, value >= 0.0, "at least 0")?;
        }
        let vectors = self.gravity.iter().chain(self.wind.iter());
        vectors.copied().try_for_each(|x| check("gravity or wind of particles", x, x.abs() <= FARTHEST, "at most 1e6"))
    }

    fn raw(&self, count: usize, obstacles: usize) -> RawSettings {
        let z = self.linear_drag * self.dt;
        let one = if z == 0.0 { 1.0 } else { -(-z).exp_m1() / z };
        let two = match z {
            0.0..1e-3 => 0.5 - z / 6.0 + z * z / 24.0,
            _ => (1.0 - one) / z,
        };
        RawSettings {
            gravity: floats(&self.gravity),
            dt: self.dt as f32,
            wind: floats(&self.wind),
            linear: self.linear_drag as f32,
            quadratic: self.quadratic_drag as f32,
            radius: self.radius as f32,
            one: one as f32,
            two: two as f32,
            count: count as u32,
            obstacles: obstacles as u32,
            frames: 0,
            pad: 0,
        }
    }
}

impl FreeParticle {
    fn raw(&self, dt: f64) -> Result<RawParticle, RenderError> {
        let (place, place_rest) = divide("a coordinate of a particle", &self.position)?;
        let (speed, speed_rest) = divide("a velocity of a particle", &self.velocity)?;
        check("the life of a particle", self.life, true, "finite")?;
        // it moves in a frame at whose end it still lives
        let frames = ((self.life / dt).ceil() - 1.0).clamp(0.0, f64::from(u32::MAX)) as u32;
        Ok(RawParticle { place, frames, place_rest, pad_0: 0, speed, pad_1: 0, speed_rest, pad_2: 0 })
    }
}

impl RawParticle {
    fn particle(&self, life: f64) -> FreeParticle {
        let join = |whole: [i32; 3], rest: [f32; 3]| {
            UNIT * Vector3::from(whole).map(f64::from) + Vector3::from(rest).map(f64::from)
        };
        let (position, velocity) = (join(self.place, self.place_rest), join(self.speed, self.speed_rest));
        FreeParticle { position, velocity, life }
    }
}

impl Obstacle {
    fn raw(&self) -> Result<RawObstacle, RenderError> {
        check("the restitution of an obstacle", self.restitution, (0.0..=1.0).contains(&self.restitution), "0 to 1")?;
        check("the friction of an obstacle", self.friction, self.friction >= 0.0, "at least 0")?;
        let (place, place_rest) = divide("a coordinate of an obstacle", &self.pose.translation.vector)?;
        let axes = self.pose.rotation.to_rotation_matrix();
        let axis = |k: usize| floats(&axes.matrix().column(k).into_owned());
        let (kind, radius, half, x_axis) = match self.shape {
            ObstacleShape::HalfSpace => (0, 0.0, Vector3::zeros(), axis(2)),
            ObstacleShape::Sphere(radius) => (1, radius, Vector3::zeros(), axis(0)),
            ObstacleShape::Box(size) => (2, 0.0, 0.5 * size, axis(0)),
        };
        for size in half.iter().copied().chain([radius]) {
            check("a size of an obstacle", size, size >= 0.0, "at least 0")?;
        }
        Ok(RawObstacle {
            place,
            kind,
            place_rest,
            radius: radius as f32,
            x_axis,
            restitution: self.restitution as f32,
            y_axis: axis(1),
            friction: self.friction as f32,
            z_axis: axis(2),
            pad_0: 0,
            half: floats(&half),
            pad_1: 0,
        })
    }
}

//! Free particles on the graphics device: gravity, wind, drag, and collisions with things that do not move.
//!
//! ```text
//! v(t) = v₀ + a₀·t·φ₁(γt)     x(t) = x₀ + v₀·t + a₀·t²·φ₂(γt)     a₀ = g + γ·(w − v₀)
//! impact   u_n' = −e·u_n,   |Δu_t| = min(μ·(1 + e)·|u_n|, |u_t|)
//! X = (n, r):  x = n/16 + r,  |r| ≤ 1/32          in single precision
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
//! The laws are those of the particle systems of `tumble-behaviors`. In single precision a sum loses a
//! part in 10⁷ of the whole in each frame. So positions and velocities are an integer and a small rest: a frame
//! loses a part in 10⁷ of its change alone, and places of impacts are measured from the obstacle. A compensated sum would do as
//! well, but compilers of shaders may simplify it away; integers they must keep. In double precision
//! ([`Precision::Double`]) the numbers are those of the processor. One program serves both: `particles.wgsl` after the text of its numbers.

mod layout;

use super::targets::wait;
use super::{Gpu, first_adapter};
use crate::RenderError;
use layout::Layout;
use nalgebra::{Isometry3, Vector3};
use std::num::NonZeroU64;

/// Most particles, and most obstacles.
pub const MAX_PARTICLES: usize = 1_000_000;
/// Most obstacles of particles.
pub const MAX_OBSTACLES: usize = 256;
/// Farthest coordinate of a particle, m, and largest speed, m/s.
const FARTHEST: f64 = 1e6;
/// Most frames of one dispatch: drivers stop work that takes seconds.
const FRAMES: u32 = 16;
/// Particles of a workgroup, and most workgroups along x.
const GROUP: u32 = 64;
const GROUPS: u32 = 4096;

/// The numbers that the device computes with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Precision {
    /// `f32`: any device, at full speed. Sums lose nothing, but where obstacles part neighbors, differences of rounding grow.
    #[default]
    Single,
    /// `f64`: the paths of the processor. Vulkan alone has it, on software drivers and on many cards; on cards for games it is many times
    /// slower.
    Double,
}

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
    /// The numbers of the device.
    pub precision: Precision,
}

impl Default for FreeParticles {
    /// Particles of 1 cm without drag under gravity, at 60 Hz, in single precision.
    fn default() -> FreeParticles {
        let gravity = Vector3::new(0.0, 0.0, -9.81);
        let (wind, linear_drag, quadratic_drag, radius) = (Vector3::zeros(), 0.0, 0.0, 0.01);
        let precision = Precision::Single;
        FreeParticles { dt: 1.0 / 60.0, gravity, wind, linear_drag, quadratic_drag, radius, precision }
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
    layout: Layout,
    constants: FreeParticles,
    /// Numbers of particles and of obstacles.
    counts: [u32; 2],
    /// Life of each particle at the start, s.
    lives: Vec<f64>,
    /// Frames so far.
    frames: u64,
}

impl GpuParticles {
    /// Finds an adapter and gives it particles.
    ///
    /// # Errors
    /// [`RenderError::Particles`] names a number that is out of its range; [`RenderError::TooMany`];
    /// [`RenderError::NoAdapter`] if the machine has no adapter, and [`RenderError::Device`] if it fails or has no double precision
    /// where that is asked for.
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
        let layout = Layout(constants.precision);
        // a buffer is not empty
        let walls = layout.obstacles(obstacles)?;
        let flying = layout.particles(particles, constants.dt)?;
        let adapter = pollster::block_on(first_adapter())?;
        let gpu = pollster::block_on(Gpu::open_with(adapter, layout.features()))?;
        let buffer = |label: &str, bytes: &[u8], usage: wgpu::BufferUsages| {
            let size = bytes.len() as u64;
            let usage = usage | wgpu::BufferUsages::COPY_DST;
            let descriptor = wgpu::BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: false };
            let buffer = gpu.device.create_buffer(&descriptor);
            gpu.queue.write_buffer(&buffer, 0, bytes);
            buffer
        };
        let counts = [particles.len() as u32, obstacles.len() as u32];
        let uniform = buffer("particle settings", &layout.settings(constants, counts, 0), wgpu::BufferUsages::UNIFORM);
        let walls = buffer("obstacles", &walls, wgpu::BufferUsages::STORAGE);
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC;
        let flying = buffer("particles", &flying, usage);
        let (pipeline, bindings) = program(&gpu.device, layout.program(), [&uniform, &walls, &flying]);
        gpu.complaint()?;
        let lives = particles.iter().map(|particle| particle.life).collect();
        let constants = constants.clone();
        let particles = flying;
        Ok(GpuParticles { gpu, pipeline, bindings, uniform, particles, layout, constants, counts, lives, frames: 0 })
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
        let groups = self.counts[0].div_ceil(GROUP);
        let (x, y) = (groups.clamp(1, GROUPS), groups.div_ceil(GROUPS).max(1));
        let mut left = frames;
        while left > 0 {
            let now = left.min(FRAMES);
            left -= now;
            let settings = self.layout.settings(&self.constants, self.counts, now);
            self.gpu.queue.write_buffer(&self.uniform, 0, &settings);
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
        let passed = self.frames as f64 * self.constants.dt;
        let read = bytes.chunks_exact(self.layout.particle_size()).map(|bytes| self.layout.read(bytes));
        let flying = read.zip(&self.lives);
        Ok(flying
            .map(|([position, velocity], life)| FreeParticle { position, velocity, life: life - passed })
            .collect())
    }
}

/// Makes the program and binds its buffers: constants, obstacles, particles.
fn program(
    device: &wgpu::Device,
    text: String,
    buffers: [&wgpu::Buffer; 3],
) -> (wgpu::ComputePipeline, wgpu::BindGroup) {
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
    let module = device
        .create_shader_module(wgpu::ShaderModuleDescriptor { label, source: wgpu::ShaderSource::Wgsl(text.into()) });
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
}

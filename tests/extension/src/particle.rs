//! A point mass: three degrees of freedom, momentum `P`, no rotation.
//!
//! | symbol | meaning |
//! |---|---|
//! | `X = [x, P]` | position (m) and momentum (N·s), 6 numbers |
//! | `v = P/m` | generalized velocity, 3 numbers |
//! | `L = √m·1` | `M = LᵀL = m·1`, so `u = √m·v`, `Y = Jᵀ/√m` |

use tumble_core::collide::{Pose, Shape, Vec3};
use tumble_core::{
    Cache, Collidable, CollisionGroup, Energy, ForceSlice, Forces, Integratable, Material, Momentum, Object, PartState,
    StateRange, StateSizes, WorldView,
};

/// A point mass that collides as a sphere and never turns.
#[derive(Clone)]
pub struct Particle {
    name: String,
    mass: f64,
    shape: Shape,
    /// Surface constants.
    pub material: Material,
    /// Position at time 0, m.
    pub position: Vec3,
    /// Velocity at time 0, m/s.
    pub velocity: Vec3,
}

impl Particle {
    /// A particle of `mass` kg (above 0) with a sphere of the given shape around it, at rest at the origin.
    pub fn new(name: impl Into<String>, mass: f64, shape: Shape) -> Particle {
        Particle {
            name: name.into(),
            mass,
            shape,
            material: Material::default(),
            position: Vec3::zeros(),
            velocity: Vec3::zeros(),
        }
    }

    /// Sets position (m) and velocity (m/s) at time 0.
    pub fn at(mut self, position: Vec3, velocity: Vec3) -> Particle {
        (self.position, self.velocity) = (position, velocity);
        self
    }

    /// Sets the constants of the surface.
    pub fn with_material(mut self, material: Material) -> Particle {
        self.material = material;
        self
    }
}

fn vec3(x: &[f64]) -> Vec3 {
    Vec3::new(x[0], x[1], x[2])
}

fn scaled(from: &[f64], factor: f64, to: &mut [f64]) {
    to.iter_mut().zip(from).for_each(|(to, from)| *to = factor * from);
}

impl Object for Particle {
    fn name(&self) -> &str {
        &self.name
    }

    fn fork(&self) -> Box<dyn Object> {
        Box::new(self.clone())
    }

    fn refresh(&self, x: &[f64], _cache: &mut Cache, part_states: &mut [PartState]) {
        part_states[0].pose = Pose::translation(x[0], x[1], x[2]);
        part_states[0].velocity = vec3(&x[3..]) / self.mass;
    }

    fn integratable(&self) -> Option<&dyn Integratable> {
        Some(self)
    }

    fn collidable(&self) -> Option<&dyn Collidable> {
        Some(self)
    }
}

impl Integratable for Particle {
    fn state_sizes(&self) -> StateSizes {
        StateSizes { x: 6, dof: 3, parts: 1 }
    }

    fn write_initial(&self, x: &mut [f64]) {
        x[..3].copy_from_slice(self.position.as_slice());
        scaled(self.velocity.as_slice(), self.mass, &mut x[3..]);
    }

    fn accumulate_forces(&self, me: &StateRange, view: &WorldView, out: &mut Forces) {
        out.wrenches[me.parts.start].force += self.mass * view.gravity;
    }

    fn velocity(&self, x: &[f64], v: &mut [f64]) {
        scaled(&x[3..], 1.0 / self.mass, v);
    }

    fn write_velocity(&self, x: &mut [f64], v: &[f64]) {
        scaled(v, self.mass, &mut x[3..]);
    }

    fn derivative(&self, _cache: &mut Cache, _x: &[f64], f: &ForceSlice, dp: &mut [f64]) {
        (0..3).for_each(|k| dp[k] = f.wrenches[0].force[k] + f.generalized[k]);
    }

    fn accelerations(&self, _cache: &mut Cache, _x: &[f64], dp: &[f64], part_states: &mut [PartState]) {
        part_states[0].acceleration = vec3(dp) / self.mass;
    }

    fn kick(&self, x: &mut [f64], dp: &[f64], h: f64) {
        (0..3).for_each(|k| x[3 + k] += h * dp[k]);
    }

    fn free_motion(&self, _cache: &mut Cache, x: &mut [f64], h: f64) {
        (0..3).for_each(|k| x[k] += h * x[3 + k] / self.mass);
    }

    fn integrate_positions(&self, x: &mut [f64], v: &[f64], h: f64) {
        (0..3).for_each(|k| x[k] += h * v[k]);
    }

    fn mul_l(&self, _cache: &mut Cache, v: &[f64], u: &mut [f64]) {
        scaled(v, self.mass.sqrt(), u);
    }

    fn solve_l(&self, _cache: &mut Cache, u: &[f64], v: &mut [f64]) {
        scaled(u, 1.0 / self.mass.sqrt(), v);
    }

    fn solve_lt(&self, _cache: &mut Cache, j: &[f64], y: &mut [f64]) {
        scaled(j, 1.0 / self.mass.sqrt(), y);
    }

    fn mul_lt(&self, _cache: &mut Cache, du: &[f64], dp: &mut [f64]) {
        scaled(du, self.mass.sqrt(), dp);
    }

    fn energy(&self, x: &[f64], gravity: &Vec3) -> Energy {
        Energy {
            kinetic: 0.5 * vec3(&x[3..]).norm_squared() / self.mass,
            potential: -self.mass * gravity.dot(&vec3(x)),
        }
    }

    fn momentum(&self, x: &[f64]) -> Momentum {
        let p = vec3(&x[3..]);
        Momentum { linear: p, angular: vec3(x).cross(&p) }
    }
}

impl Collidable for Particle {
    fn parts(&self) -> usize {
        1
    }

    fn shape(&self, _part: usize) -> Option<&Shape> {
        Some(&self.shape)
    }

    fn material(&self, _part: usize) -> Material {
        self.material
    }

    fn collision_group(&self, _part: usize) -> CollisionGroup {
        CollisionGroup::default()
    }

    fn collides_with(&self, _part: usize, _other: CollisionGroup) -> bool {
        true
    }

    fn test_impulse(
        &self,
        _cache: &mut Cache,
        _part: usize,
        _part_state: &PartState,
        _point: &Vec3,
        axes: &[Vec3],
        sign: f64,
        y: &mut [f64],
    ) {
        let scale = sign / self.mass.sqrt();
        for (axis, y) in axes.iter().zip(y.chunks_exact_mut(3)) {
            (0..3).for_each(|k| y[k] += scale * axis[k]);
        }
    }
}

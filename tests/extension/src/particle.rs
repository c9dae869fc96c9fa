//! A point mass: state `X = [x, v]`, no rotation, `M = m·1`, so `L = √m·1`.

use tumble_core::collide::{Pose, Shape, Vec3};
use tumble_core::{Cache, Collidable, Integratable, Material, Object, PartPoint, PartState, StateSizes};

/// A point mass that collides as a sphere and never rotates.
#[derive(Clone)]
pub struct Particle {
    /// Mass, kg, above 0.
    pub mass: f64,
    /// Shape around the point.
    pub shape: Shape,
    /// Surface constants.
    pub material: Material,
    /// Position (m) and velocity (m/s) at time 0.
    pub start: [f64; 6],
}

impl Object for Particle {
    fn refresh(&self, x: &[f64], _cache: &mut Cache, part_states: &mut [PartState]) {
        part_states[0].pose = Pose::translation(x[0], x[1], x[2]);
        part_states[0].velocity = Vec3::new(x[3], x[4], x[5]);
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
        x.copy_from_slice(&self.start);
    }
    fn part_mass(&self, _part: usize) -> f64 {
        self.mass
    }
    fn jacobian(&self, _cache: &mut Cache, at: &PartPoint, j: &mut [f64]) {
        j.iter_mut().zip(at.axes.iter().flatten()).for_each(|(j, axis)| *j += axis);
    }
    fn mul_l(&self, _cache: &mut Cache, v: &[f64], u: &mut [f64]) {
        (0..3).for_each(|k| u[k] = self.mass.sqrt() * v[k]);
    }
    fn solve_l(&self, _cache: &mut Cache, u: &[f64], v: &mut [f64]) {
        (0..3).for_each(|k| v[k] = u[k] / self.mass.sqrt());
    }
    fn solve_lt(&self, _cache: &mut Cache, j: &[f64], y: &mut [f64]) {
        (0..3).for_each(|k| y[k] = j[k] / self.mass.sqrt());
    }
    fn mul_lt(&self, _cache: &mut Cache, u: &[f64], j: &mut [f64]) {
        (0..3).for_each(|k| j[k] = self.mass.sqrt() * u[k]);
    }
}

impl Collidable for Particle {
    fn shape(&self, _part: usize) -> Option<&Shape> {
        Some(&self.shape)
    }
    fn material(&self, _part: usize) -> Material {
        self.material
    }
}

//! Buoyancy: the weight of the fluid that a body displaces (Archimedes), and the drag of the fluid.
//!
//! ```text
//! F = −ρ·V·g                   at c
//! F = −γ·ρ·V·(v(c) − w)        at c          τ = −γ·ρ·V·⅖·(3·V/4π)^{2/3}·ω
//! U = ρ·|g|·V·d
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `V`, `c`, `d` | volume below the surface ([`submerged`]), its center, and the depth of that |
//! | `ρ`, `g` | density of the fluid; gravity of the world |
//! | `v(c)`, `ω` | velocity of the body at that center; its angular velocity |
//! | `w` | velocity of the fluid |
//! | `γ` | drag per mass of displaced fluid |
//!
//! The surface is a plane across gravity that stays flat, and fluid moves without inertia: no waves, no added mass.
//! The torque of the drag is that on a ball of the displaced volume. Drag is constant over a step
//! `h`: keep `γ·h·ρ·V/m` below 1.

use super::{Targets, check_vector, submerged};
use crate::error::{BehaviorError, check};
use crate::record;
use nalgebra::ComplexField;
use std::f64::consts::PI;
use tumble_collide::Vec3;
use tumble_core::archive::{ObjectIndices, ObjectRecord};
use tumble_core::{ForceGenerator, Forces, Object, StateRange, WorldView};

/// A fluid below a horizontal surface, without walls or ground.
///
/// ```
/// # use tumble_core::prelude::*;
/// use tumble_behaviors::{Buoyancy, DragLaw, Wind};
/// let mut world = World::default();
/// let ball = world.add(RigidBody::new(Shape::sphere(0.2)?).with_mass(16.755))?; // half of what it displaces
/// world.add(Buoyancy::new("water", Vec3::zeros(), 1000.0)?.with_drag(2.0, Vec3::zeros())?)?;
/// world.add(Wind::new("wind", Vec3::new(3.0, 0.0, 0.0), DragLaw::Quadratic { density: 1.2, coefficient: 0.47 })?)?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Buoyancy {
    name: String,
    pub(crate) surface: Vec3,
    pub(crate) density: f64,
    pub(crate) drag: f64,
    pub(crate) current: Vec3,
    pub(crate) targets: Targets,
}

impl Buoyancy {
    /// Returns a point of the surface, m.
    pub fn surface(&self) -> Vec3 {
        self.surface
    }
    /// Returns the density, kg/m³.
    pub fn density(&self) -> f64 {
        self.density
    }
    /// Returns the drag per mass of displaced fluid, 1/s.
    pub fn drag(&self) -> f64 {
        self.drag
    }
    /// Returns the velocity of the fluid, m/s.
    pub fn current(&self) -> Vec3 {
        self.current
    }
    /// Returns the bodies that it acts on.
    pub fn targets(&self) -> &Targets {
        &self.targets
    }

    /// Makes a fluid at rest: a point of its surface, m, and its density, kg/m³, at least 0; 1000 of
    /// water.
    ///
    /// # Errors
    /// [`BehaviorError::Range`] names the constant that is out of its range.
    pub fn new(name: impl Into<String>, surface: Vec3, density: f64) -> Result<Buoyancy, BehaviorError> {
        check_vector("the surface of a fluid", &surface)?;
        check("the density of a fluid", density, density >= 0.0, "at least 0")?;
        let (name, drag, current) = (name.into(), 0.0, Vec3::zeros());
        Ok(Buoyancy { name, surface, density, drag, current, targets: Targets::All })
    }
    /// Sets the drag per mass of displaced fluid, 1/s, at least 0 (0 by default), and the velocity of the
    /// fluid, m/s.
    ///
    /// # Errors
    /// [`BehaviorError::Range`] names the constant that is out of its range.
    pub fn with_drag(self, drag: f64, current: Vec3) -> Result<Buoyancy, BehaviorError> {
        check("the drag of a fluid", drag, drag >= 0.0, "at least 0")?;
        check_vector("the current of a fluid", &current)?;
        Ok(Buoyancy { drag, current, ..self })
    }
    /// Sets the bodies that it acts on.
    pub fn with_targets(self, targets: Targets) -> Buoyancy {
        Buoyancy { targets, ..self }
    }
}

impl Object for Buoyancy {
    fn record(&self, indices: &ObjectIndices) -> Option<ObjectRecord> {
        record::buoyancy(self, indices)
    }
    fn name(&self) -> &str {
        &self.name
    }
    fn force(&self) -> Option<&dyn ForceGenerator> {
        Some(self)
    }
}

impl ForceGenerator for Buoyancy {
    fn apply(&self, _me: &StateRange, view: &WorldView, out: &mut Forces) {
        let Some(up) = (-view.gravity).try_normalize(0.0) else { return };
        self.targets.each(view, |target| {
            let Some(shape) = target.shape else { return };
            let below = submerged(shape, &target.state.pose, &self.surface, &up);
            let mass = self.density * below.volume;
            if mass > 0.0 {
                let slip = target.state.velocity_at(&below.center) - self.current;
                let force = -mass * view.gravity - self.drag * mass * slip;
                out.add_at(target.row, target.state, force, &below.center);
                let gyration = 0.4 * ComplexField::powf(0.75 * below.volume / PI, 2.0 / 3.0);
                out.wrenches[target.row].torque -= self.drag * mass * gyration * target.state.angular_velocity;
            }
        });
    }
    fn potential(&self, view: &WorldView) -> f64 {
        let Some(up) = (-view.gravity).try_normalize(0.0) else { return 0.0 };
        let mut sum = 0.0;
        self.targets.each(view, |target| {
            let Some(shape) = target.shape else { return };
            let below = submerged(shape, &target.state.pose, &self.surface, &up);
            if below.volume > 0.0 {
                sum += self.density * view.gravity.norm() * below.volume * (self.surface - below.center).dot(&up);
            }
        });
        sum
    }
}

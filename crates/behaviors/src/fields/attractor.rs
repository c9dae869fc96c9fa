//! A point that attracts masses, as a planet does.
//!
//! ```text
//! F = −m·μ·r/(|r|² + ε²)^{3/2}          U = −m·μ/(|r|² + ε²)^{1/2}
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `m`, `r` | mass of a part; its center of mass relative to the point |
//! | `μ` | strength: the constant of gravitation times the mass of the point |
//! | `ε` | softening length (Plummer): no force is above `m·μ·0.385/ε²` |

use super::{Targets, check_vector};
use crate::error::{BehaviorError, check};
use crate::record;
use tumble_collide::Vec3;
use tumble_core::archive::{ObjectIndices, ObjectRecord};
use tumble_core::{ForceGenerator, Forces, Object, StateRange, WorldView};

/// A point attractor. Each mass is pulled as a point at its center of mass.
#[derive(Clone, Debug)]
pub struct Attractor {
    name: String,
    pub(crate) center: Vec3,
    pub(crate) strength: f64,
    pub(crate) softening: f64,
    pub(crate) targets: Targets,
}

impl Attractor {
    /// Returns the point, m.
    pub fn center(&self) -> Vec3 {
        self.center
    }
    /// Returns the strength, m³/s².
    pub fn strength(&self) -> f64 {
        self.strength
    }
    /// Returns the softening length, m.
    pub fn softening(&self) -> f64 {
        self.softening
    }
    /// Returns the bodies that it acts on.
    pub fn targets(&self) -> &Targets {
        &self.targets
    }

    /// Makes an attractor at a point, m, of a strength `μ`, m³/s²; a negative one repels.
    /// `softening` is a length, m, at least 0. With 0 the force at the point itself is 0, and close to
    /// it without bound.
    ///
    /// # Errors
    /// [`BehaviorError::Range`] names the constant that is out of its range.
    pub fn new(
        name: impl Into<String>,
        center: Vec3,
        strength: f64,
        softening: f64,
    ) -> Result<Attractor, BehaviorError> {
        check_vector("the center of an attractor", &center)?;
        check("the strength of an attractor", strength, true, "finite")?;
        check("the softening of an attractor", softening, softening >= 0.0, "at least 0")?;
        Ok(Attractor { name: name.into(), center, strength, softening, targets: Targets::All })
    }
    /// Sets the bodies that it acts on.
    pub fn with_targets(self, targets: Targets) -> Attractor {
        Attractor { targets, ..self }
    }
    /// Returns the softened distance of a point, m.
    fn distance(&self, point: &Vec3) -> f64 {
        ((point - self.center).norm_squared() + self.softening * self.softening).sqrt()
    }
}

impl Object for Attractor {
    fn record(&self, indices: &ObjectIndices) -> Option<ObjectRecord> {
        record::attractor(self, indices)
    }
    fn name(&self) -> &str {
        &self.name
    }
    fn force(&self) -> Option<&dyn ForceGenerator> {
        Some(self)
    }
}

impl ForceGenerator for Attractor {
    fn apply(&self, _me: &StateRange, view: &WorldView, out: &mut Forces) {
        self.targets.each(view, |target| {
            let distance = self.distance(&target.center);
            if target.mass > 0.0 && distance > 0.0 {
                let pull = target.mass * self.strength / distance.powi(3) * (self.center - target.center);
                out.add_at(target.row, target.state, pull, &target.center);
            }
        });
    }
    fn potential(&self, view: &WorldView) -> f64 {
        let mut sum = 0.0;
        self.targets.each(view, |target| {
            let distance = self.distance(&target.center);
            if target.mass > 0.0 && distance > 0.0 {
                sum -= target.mass * self.strength / distance;
            }
        });
        sum
    }
}

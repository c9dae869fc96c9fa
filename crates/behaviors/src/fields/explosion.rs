//! An explosion: a spherical wave that hits all bodies at one time and decays.
//!
//! ```text
//! s = min(1, A/(4π·r²))          J = I·s·r/|r|          F(t) = J/τ·exp(−(t − t₀)/τ)  for t₀ ≤ t ≤ t₀ + 40·τ
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `I` | momentum that the explosion has in all directions together, N·s |
//! | `r` | middle of a shape relative to the center |
//! | `A`, `s` | area of its silhouette towards the center ([`silhouette`]); share of the sphere that it covers |
//! | `J` | impulse on a body that does not move meanwhile |
//! | `t₀`, `τ` | time of the explosion; time constant of its decay |
//!
//! A closed shell around the center takes all of `I`; momentum is conserved as far as the shares are
//! symmetric. Nothing shields a body from the wave, which is everywhere at once. The forces act at
//! the middles of shapes. [`Explosion::strike`] gives the impulses at once instead, exactly.
//!
//! A step `h` takes the force at its middle. From a `t₀` between two steps the sum is
//! `J·x/sinh x` with `x = h/(2·τ)`, an error of second order. A pulse shorter than a few steps is not
//! resolved: use `strike`.

use super::{Target, Targets, check_vector, silhouette};
use crate::error::{BehaviorError, check};
use crate::record;
use nalgebra::ComplexField;
use std::f64::consts::PI;
use tumble_collide::Vec3;
use tumble_core::archive::{ObjectIndices, ObjectRecord};
use tumble_core::{ForceGenerator, Forces, Object, StateRange, World, WorldError, WorldView};

/// Age, in time constants, from which there is no force: what is left, 4e-18 of the momentum, is below rounding, and
/// would keep islands awake.
const LASTS: f64 = 40.0;

/// An explosion at a time.
#[derive(Clone, Debug)]
pub struct Explosion {
    name: String,
    pub(crate) center: Vec3,
    pub(crate) impulse: f64,
    pub(crate) time: f64,
    pub(crate) decay: f64,
    pub(crate) targets: Targets,
}

impl Explosion {
    /// Returns the point, m.
    pub fn center(&self) -> Vec3 {
        self.center
    }
    /// Returns the momentum in all directions together, N·s.
    pub fn impulse(&self) -> f64 {
        self.impulse
    }
    /// Returns the time of its start, s.
    pub fn time(&self) -> f64 {
        self.time
    }
    /// Returns the time constant of its pulse, s.
    pub fn decay(&self) -> f64 {
        self.decay
    }
    /// Returns the bodies that it acts on.
    pub fn targets(&self) -> &Targets {
        &self.targets
    }

    /// Makes an explosion at a point, m, of a total momentum, N·s, at least 0. It begins at `time`,
    /// s, and decays with the time constant `decay`, s, above 0.
    ///
    /// # Errors
    /// [`BehaviorError::Range`] names the constant that is out of its range.
    pub fn new(
        name: impl Into<String>,
        center: Vec3,
        impulse: f64,
        time: f64,
        decay: f64,
    ) -> Result<Explosion, BehaviorError> {
        check_vector("the center of an explosion", &center)?;
        check("the impulse of an explosion", impulse, impulse >= 0.0, "at least 0")?;
        check("the time of an explosion", time, true, "finite")?;
        check("the decay of an explosion", decay, decay > 0.0, "above 0")?;
        Ok(Explosion { name: name.into(), center, impulse, time, decay, targets: Targets::All })
    }
    /// Sets the bodies that it acts on.
    pub fn with_targets(self, targets: Targets) -> Explosion {
        Explosion { targets, ..self }
    }

    /// Applies the whole impulses to the bodies of a world at once. The explosion need not be an object of
    /// the world; its time and decay have no effect.
    ///
    /// # Errors
    /// As [`World::apply_impulse`].
    pub fn strike(&self, world: &mut World) -> Result<(), WorldError> {
        let mut struck = Vec::new();
        self.targets.each(&world.view(), |target| {
            let impulse = self.on(target).filter(|impulse| *impulse != Vec3::zeros());
            struck.extend(impulse.map(|impulse| (target.id, target.part, impulse, target.state.position())));
        });
        for (id, part, impulse, point) in struck {
            world.apply_impulse(id, part, impulse, &point)?;
        }
        Ok(())
    }

    /// Returns the impulse on a part, N·s; `None` without a shape.
    fn on(&self, target: &Target) -> Option<Vec3> {
        let arm = target.state.position() - self.center;
        let along = target.state.pose.rotation.inverse_transform_vector(&arm);
        let area = silhouette(target.shape?, &along);
        let share = (area / (4.0 * PI * arm.norm_squared())).min(1.0);
        Some(self.impulse * share * arm.try_normalize(0.0)?)
    }
}

impl Object for Explosion {
    fn record(&self, indices: &ObjectIndices) -> Option<ObjectRecord> {
        record::explosion(self, indices)
    }
    fn name(&self) -> &str {
        &self.name
    }
    fn force(&self) -> Option<&dyn ForceGenerator> {
        Some(self)
    }
}

impl ForceGenerator for Explosion {
    fn apply(&self, _me: &StateRange, view: &WorldView, out: &mut Forces) {
        let age = (view.time - self.time) / self.decay;
        if !(0.0..=LASTS).contains(&age) {
            return;
        }
        let strength = ComplexField::exp(-age) / self.decay;
        self.targets.each(view, |target| {
            if let Some(impulse) = self.on(target) {
                out.wrenches[target.row].force += strength * impulse;
            }
        });
    }
}

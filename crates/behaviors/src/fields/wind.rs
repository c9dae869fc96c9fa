//! Wind: the drag of moving air, or of any fluid at rest, on bodies.
//!
//! ```text
//! u = w − v                 F = c·u                    linear
//!                           F = ½·ρ·C·A(u)·|u|·u       quadratic
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `w`, `v`, `u` | velocity of the air, of the middle of the shape, and of the air relative to it |
//! | `c` | drag per speed, N·s/m |
//! | `ρ`, `C` | density of the air; drag coefficient |
//! | `A(u)` | area of the silhouette along `u` ([`silhouette`]) |
//!
//! The force acts at the origin of the shape's part, its middle, and gives no torque there. It is
//! constant over a step `h`: the terminal velocity is exact at any `h`, and the way to it is stable
//! while `h·∂F/∂v < 2·m`.

use super::{Targets, check_vector, silhouette};
use crate::error::{BehaviorError, check};
use crate::record;
use tumble_collide::Vec3;
use tumble_core::archive::{ObjectIndices, ObjectRecord};
use tumble_core::{ForceGenerator, Forces, Object, StateRange, WorldView};

/// How drag depends on speed.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub enum DragLaw {
    /// In proportion to the speed: slow motion in a viscous fluid. The same for every body.
    Linear {
        /// Drag per speed, N·s/m, at least 0. Of a small ball: `6π·viscosity·radius` (Stokes).
        coefficient: f64,
    },
    /// In proportion to the square of the speed and to the silhouette of the shape.
    Quadratic {
        /// Density of the air, kg/m³, at least 0; 1.2 at sea level.
        density: f64,
        /// Drag coefficient, at least 0; about 0.47 of a ball, 1.1 of a box.
        coefficient: f64,
    },
}

/// A uniform wind. Parts without a shape feel none; half-spaces, which have no silhouette, only the linear law.
#[derive(Clone, Debug)]
pub struct Wind {
    name: String,
    pub(crate) velocity: Vec3,
    pub(crate) law: DragLaw,
    pub(crate) targets: Targets,
}

impl Wind {
    /// Returns the velocity of the air, m/s.
    pub fn velocity(&self) -> Vec3 {
        self.velocity
    }
    /// Returns the law of the drag.
    pub fn law(&self) -> DragLaw {
        self.law
    }
    /// Returns the bodies that it acts on.
    pub fn targets(&self) -> &Targets {
        &self.targets
    }

    /// Makes a wind of a velocity, m/s, world axes; zero for air at rest.
    ///
    /// # Errors
    /// [`BehaviorError::Range`] names the constant that is out of its range.
    pub fn new(name: impl Into<String>, velocity: Vec3, law: DragLaw) -> Result<Wind, BehaviorError> {
        check_vector("the velocity of a wind", &velocity)?;
        let (density, coefficient) = match law {
            DragLaw::Linear { coefficient } => (0.0, coefficient),
            DragLaw::Quadratic { density, coefficient } => (density, coefficient),
        };
        check("the density of a wind", density, density >= 0.0, "at least 0")?;
        check("the drag coefficient of a wind", coefficient, coefficient >= 0.0, "at least 0")?;
        Ok(Wind { name: name.into(), velocity, law, targets: Targets::All })
    }
    /// Sets the bodies that it acts on.
    pub fn with_targets(self, targets: Targets) -> Wind {
        Wind { targets, ..self }
    }
    /// Changes the velocity from the next step on, m/s.
    ///
    /// # Errors
    /// [`BehaviorError::Range`] if it is not finite; it then stays as it is.
    pub fn set_velocity(&mut self, velocity: Vec3) -> Result<(), BehaviorError> {
        check_vector("the velocity of a wind", &velocity)?;
        self.velocity = velocity;
        Ok(())
    }
}

impl Object for Wind {
    fn record(&self, indices: &ObjectIndices) -> Option<ObjectRecord> {
        record::wind(self, indices)
    }
    fn name(&self) -> &str {
        &self.name
    }
    fn force(&self) -> Option<&dyn ForceGenerator> {
        Some(self)
    }
}

impl ForceGenerator for Wind {
    fn apply(&self, _me: &StateRange, view: &WorldView, out: &mut Forces) {
        self.targets.each(view, |target| {
            let Some(shape) = target.shape else { return };
            let u = self.velocity - target.state.velocity;
            out.wrenches[target.row].force += match self.law {
                DragLaw::Linear { coefficient } => coefficient * u,
                DragLaw::Quadratic { density, coefficient } => {
                    let area = silhouette(shape, &target.state.pose.rotation.inverse_transform_vector(&u));
                    0.5 * density * coefficient * area * u.norm() * u
                }
            };
        });
    }
}

//! Lift and drag on oriented surfaces: wings, sails, fins, blades.
//!
//! ```text
//! u = w − v(p),   sin α = u·n/|u|          F = ½·ρ·A·|u|·(C_α·(u·n)·n + C₀·u)
//!
//! lift  C_L = C_α·sin α·cos α              drag  C_D = C₀ + C_α·sin²α
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `p`, `n`, `A` | middle, unit normal and area of a panel, fixed to a part |
//! | `w`, `u` | velocity of the air; that relative to the panel |
//! | `α` | angle of attack |
//! | `C_α` | slope of the lift at small angles: 2π of a thin airfoil, less of a short one |
//! | `C₀` | drag coefficient along the panel |
//! | `ρ` | density of the air |
//!
//! Pressure acts across the panel, so lift and the drag that it induces come from one force along
//! `n`, which is bounded at any angle: there is no abrupt stall. Forces act at `p`, with their torque.
//! They are constant over a step `h`: keep `h·½·ρ·A·|u|·C_α` below the mass.

use super::check_vector;
use crate::error::{BehaviorError, check};
use crate::record;
use tumble_collide::Vec3;
use tumble_core::archive::{ObjectIndices, ObjectRecord};
use tumble_core::{ForceGenerator, Forces, Object, ObjectId, StateRange, WorldView};

/// A flat surface on a part of a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Panel {
    /// The body.
    pub id: ObjectId,
    /// Its part: 0 of a rigid body, the number of a link.
    pub part: usize,
    /// Middle of the panel in the frame of the part, m.
    pub point: Vec3,
    /// Normal in the frame of the part, of any length above 0; its sign does not matter.
    pub normal: Vec3,
    /// Area, m², at least 0.
    pub area: f64,
    /// Slope of the lift `C_α`, 1/rad, at least 0; 2π of a thin airfoil.
    pub lift_slope: f64,
    /// Drag coefficient along the panel `C₀`, at least 0.
    pub drag: f64,
}

/// Panels in air of one density and velocity. Panels of removed bodies are ignored.
#[derive(Clone, Debug)]
pub struct Panels {
    name: String,
    pub(crate) density: f64,
    pub(crate) wind: Vec3,
    pub(crate) panels: Vec<Panel>,
}

impl Panels {
    /// Returns the density of the air, kg/m³.
    pub fn density(&self) -> f64 {
        self.density
    }
    /// Returns the velocity of the air, m/s.
    pub fn wind(&self) -> Vec3 {
        self.wind
    }
    /// Returns the panels.
    pub fn panels(&self) -> &[Panel] {
        &self.panels
    }

    /// Makes panels in air of a density, kg/m³, at least 0, and a velocity, m/s.
    ///
    /// # Errors
    /// [`BehaviorError::Range`] names the constant that is out of its range.
    pub fn new(
        name: impl Into<String>,
        density: f64,
        wind: Vec3,
        panels: impl IntoIterator<Item = Panel>,
    ) -> Result<Panels, BehaviorError> {
        check("the density of air", density, density >= 0.0, "at least 0")?;
        check_vector("the velocity of air", &wind)?;
        let panels: Vec<Panel> = panels.into_iter().collect();
        for panel in &panels {
            check_vector("the point of a panel", &panel.point)?;
            check_vector("the normal of a panel", &panel.normal)?;
            check("the length of the normal of a panel", panel.normal.norm(), panel.normal.norm() > 0.0, "above 0")?;
            for (what, value) in [
                ("the area of a panel", panel.area),
                ("the lift slope of a panel", panel.lift_slope),
                ("the drag of a panel", panel.drag),
            ] {
                check(what, value, value >= 0.0, "at least 0")?;
            }
        }
        Ok(Panels { name: name.into(), density, wind, panels })
    }
}

impl Panel {
    /// Returns the force for air of a density, kg/m³, that moves with `u`, m/s, relative to a panel
    /// with the unit normal `n`; N.
    fn force(&self, density: f64, u: &Vec3, n: &Vec3) -> Vec3 {
        0.5 * density * self.area * u.norm() * (self.lift_slope * u.dot(n) * n + self.drag * u)
    }
}

impl Object for Panels {
    fn record(&self, indices: &ObjectIndices) -> Option<ObjectRecord> {
        record::panels(self, indices)
    }
    fn name(&self) -> &str {
        &self.name
    }
    fn force(&self) -> Option<&dyn ForceGenerator> {
        Some(self)
    }
}

impl ForceGenerator for Panels {
    fn apply(&self, _me: &StateRange, view: &WorldView, out: &mut Forces) {
        for panel in self.panels.iter().filter(|panel| view.status(panel.id).is_some_and(|status| status.moves())) {
            let (Some(range), Some(state)) = (view.state_range(panel.id), view.part_state(panel.id, panel.part)) else {
                continue;
            };
            let point = state.pose.transform_point(&panel.point.into()).coords;
            let normal = (state.pose.rotation * panel.normal).normalize();
            let force = panel.force(self.density, &(self.wind - state.velocity_at(&point)), &normal);
            out.add_at(range.parts.start + panel.part, state, force, &point);
        }
    }
}

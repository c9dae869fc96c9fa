//! Derivatives of the dynamics of articulated bodies.

use crate::arrays::convert::array;
use crate::errors::Result;
use crate::keywords::{self, Unknown};
use crate::objects::articulation::{Array, Articulation, Given};
use crate::objects::binding::Which;
use crate::objects::joints::result;
use pyo3::prelude::*;

#[pymethods]
impl Articulation {
    /// Returns the derivatives of ``inverse_dynamics``: by ``q``, by ``qd`` and by ``qdd``, which is the
    /// mass matrix; shape (3, dof, dof) or (batch, 3, dof, dof).
    ///
    /// Arguments as in ``inverse_dynamics``. Row ``i``, column ``k`` is that of force ``i`` by number
    /// ``k``. Positions change along velocities: column ``k`` by ``q`` is the slope along unit velocity
    /// ``k``, also of spherical joints and floating roots.
    #[pyo3(signature = (q=None, qd=None, qdd=None, **unknown), text_signature = "($self, q=None, qd=None, qdd=None)")]
    fn inverse_dynamics_derivatives<'py>(
        &self,
        py: Python<'py>,
        q: Given<'_, 'py>,
        qd: Given<'_, 'py>,
        qdd: Given<'_, 'py>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<Array<'py>> {
        keywords::check(unknown, "Articulation.inverse_dynamics_derivatives")?;
        let dof = self.robot.dof();
        let still = array(py, &vec![0.0; dof]).into_any();
        let mut rows =
            self.rows(&[(Which::Q, "q", q), (Which::Qd, "qd", qd), (Which::Tau, "qdd", Some(qdd.unwrap_or(&still)))])?;
        let gravity = self.spot.gravity()?;
        let robot = self.present()?;
        let out = py.detach(|| robot.inverse_dynamics_derivatives(&gravity, &mut rows))?;
        result(py, &rows, out, &[3, dof, dof])
    }

    /// Returns the derivatives of ``forward_dynamics``: by ``q``, by ``qd`` and by ``tau``, which is the
    /// inverse of the mass matrix; shape (3, dof, dof) or (batch, 3, dof, dof).
    ///
    /// Arguments as in ``forward_dynamics``, rows and columns as in ``inverse_dynamics_derivatives``. A
    /// singular mass matrix raises ``InvalidValueError``.
    #[pyo3(signature = (q=None, qd=None, tau=None, **unknown), text_signature = "($self, q=None, qd=None, tau=None)")]
    fn forward_dynamics_derivatives<'py>(
        &self,
        py: Python<'py>,
        q: Given<'_, 'py>,
        qd: Given<'_, 'py>,
        tau: Given<'_, 'py>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<Array<'py>> {
        keywords::check(unknown, "Articulation.forward_dynamics_derivatives")?;
        let dof = self.robot.dof();
        let mut rows = self.rows(&[(Which::Q, "q", q), (Which::Qd, "qd", qd), (Which::Tau, "tau", tau)])?;
        let gravity = self.spot.gravity()?;
        let robot = self.present()?;
        let out = py.detach(|| robot.forward_dynamics_derivatives(&gravity, &mut rows))?;
        result(py, &rows, out, &[3, dof, dof])
    }
}

//! Surface constants of single shapes of a body, the parts of a compound.

use crate::arrays::convert::{array, some};
use crate::errors::Result;
use crate::objects::body::RigidBody;
use pyo3::prelude::*;
use pyo3::types::PyDict;

#[pymethods]
impl RigidBody {
    /// Returns the surface constants of one shape: a dict by the names of ``set_shape_material``.
    ///
    /// shape: index of the part of a ``Compound``, as ``shapes`` of contacts has it.
    fn shape_material<'py>(&self, py: Python<'py>, shape: usize) -> Result<Bound<'py, PyDict>> {
        let m = self.constant(|body| body.shape_material(shape))?;
        let constants = PyDict::new(py);
        let numbers = [
            ("friction", m.friction),
            ("restitution", m.restitution),
            ("static_friction", m.static_friction),
            ("stribeck_speed", m.stribeck_speed),
            ("rolling_friction", m.rolling_friction),
            ("torsional_friction", m.torsional_friction),
            ("tangential_restitution", m.tangential_restitution),
            ("adhesion", m.adhesion),
        ];
        numbers.iter().try_for_each(|(name, value)| constants.set_item(name, value))?;
        constants.set_item("friction_scale", array(py, m.friction_scale.as_slice()))?;
        constants.set_item("surface_velocity", array(py, m.surface_velocity.as_slice()))?;
        Ok(constants)
    }

    /// Sets surface constants of one shape, the part of a ``Compound``, by the names of the properties of the body.
    ///
    /// shape: index of the part. Constants that are not given stay as they are, for a shape without its own those of
    /// the body at this time. Without any, the shape has those of the body again.
    #[pyo3(signature = (shape, *, friction=None, restitution=None, static_friction=None, stribeck_speed=None, friction_scale=None, rolling_friction=None,
        torsional_friction=None, tangential_restitution=None, adhesion=None, surface_velocity=None))]
    #[allow(clippy::too_many_arguments, reason = "Python's keyword arguments")]
    fn set_shape_material(
        &self,
        py: Python<'_>,
        shape: usize,
        friction: Option<f64>,
        restitution: Option<f64>,
        static_friction: Option<f64>,
        stribeck_speed: Option<f64>,
        friction_scale: Option<&Bound<'_, PyAny>>,
        rolling_friction: Option<f64>,
        torsional_friction: Option<f64>,
        tangential_restitution: Option<f64>,
        adhesion: Option<f64>,
        surface_velocity: Option<&Bound<'_, PyAny>>,
    ) -> Result<()> {
        let scale = friction_scale.map(|value| some::<3>(value, "friction_scale")).transpose()?;
        let velocity = surface_velocity.map(|value| some::<3>(value, "surface_velocity")).transpose()?;
        self.change(py, |body| {
            let mut m = body.shape_material(shape);
            let numbers = [
                (&mut m.friction, friction),
                (&mut m.restitution, restitution),
                (&mut m.static_friction, static_friction),
                (&mut m.stribeck_speed, stribeck_speed),
                (&mut m.rolling_friction, rolling_friction),
                (&mut m.torsional_friction, torsional_friction),
                (&mut m.tangential_restitution, tangential_restitution),
                (&mut m.adhesion, adhesion),
            ];
            let mut given = scale.is_some() || velocity.is_some();
            for (to, value) in numbers {
                given |= value.is_some();
                value.iter().for_each(|value| *to = *value);
            }
            scale.iter().for_each(|scale| m.friction_scale = (*scale).into());
            velocity.iter().for_each(|velocity| m.surface_velocity = (*velocity).into());
            body.set_shape_material(shape, given.then_some(m));
        })
    }
}

//! Collision group, mask and sensor of single shapes of a compound body.

use crate::errors::Result;
use crate::objects::body::RigidBody;
use crate::objects::shape_material::Which;
use crate::world::query;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tumble::dynamics::ShapeFilter;

#[pymethods]
impl RigidBody {
    /// Returns what one shape collides with: a dict by the names of ``set_shape_filter``, with the mask as the bits of an integer.
    ///
    /// shape: name, or index of the part of a ``Compound``, as ``shapes`` of contacts has it.
    fn shape_filter<'py>(&self, py: Python<'py>, shape: Which) -> Result<Bound<'py, PyDict>> {
        let shape = self.numbered(shape)?;
        let ShapeFilter { group, mask, sensor } = self.constant(|body| body.shape_filter(shape))?;
        let filter = PyDict::new(py);
        filter.set_item("group", group.bit().trailing_zeros())?;
        filter.set_item("mask", mask)?;
        filter.set_item("sensor", sensor)?;
        Ok(filter)
    }

    /// Sets collision group, mask and sensor of one shape, the part of a ``Compound``, by the names of the properties of the body. A sensor has
    /// no contacts; ``events`` reports the bodies that overlap it, with its number.
    ///
    /// shape: name or index of the part. What is not given stays as it is, for a shape without its own as the body has it at
    /// this time. Without any, the shape is as the body again.
    #[pyo3(signature = (shape, *, group=None, mask=None, sensor=None))]
    fn set_shape_filter(
        &self,
        py: Python<'_>,
        shape: Which,
        group: Option<u8>,
        mask: Option<&Bound<'_, PyAny>>,
        sensor: Option<bool>,
    ) -> Result<()> {
        let shape = self.numbered(shape)?;
        let given = group.is_some() || mask.is_some() || sensor.is_some();
        let (group, mask) =
            (group.map(query::group).transpose()?, mask.map(|mask| query::mask(Some(mask))).transpose()?);
        self.change(py, |body| {
            let own = body.shape_filter(shape);
            let filter = ShapeFilter {
                group: group.unwrap_or(own.group),
                mask: mask.unwrap_or(own.mask),
                sensor: sensor.unwrap_or(own.sensor),
            };
            body.set_shape_filter(shape, given.then_some(filter));
        })
    }
}

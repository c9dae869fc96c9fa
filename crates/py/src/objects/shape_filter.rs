//! Collision group, mask and sensor of single shapes of a compound body and of the links of an articulation.

use crate::arrays::whole;
use crate::errors::{Error, Result};
use crate::keywords::{self, Unknown};
use crate::objects::articulation::Articulation;
use crate::objects::body::RigidBody;
use crate::objects::shape_material::Which;
use crate::world::query;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tumble::collide::Shape;
use tumble::dynamics::{ArticulatedBody, CollisionGroup, ShapeFilter};

/// Parts of a filter that a program gives.
struct Given {
    group: Option<CollisionGroup>,
    mask: Option<u64>,
    sensor: Option<bool>,
}

impl Given {
    fn new(group: Option<u8>, mask: Option<&Bound<'_, PyAny>>, sensor: Option<bool>) -> Result<Given> {
        let mask = mask.map(|mask| query::mask(Some(mask))).transpose()?;
        Ok(Given { group: group.map(query::group).transpose()?, mask, sensor })
    }

    /// Returns a filter with what is given; `None` if nothing is.
    fn over(&self, own: ShapeFilter) -> Option<ShapeFilter> {
        let given = self.group.is_some() || self.mask.is_some() || self.sensor.is_some();
        let Given { group, mask, sensor } = self;
        given.then(|| ShapeFilter {
            group: group.unwrap_or(own.group),
            mask: mask.unwrap_or(own.mask),
            sensor: sensor.unwrap_or(own.sensor),
        })
    }
}

fn as_dict(py: Python<'_>, ShapeFilter { group, mask, sensor }: ShapeFilter) -> Result<Bound<'_, PyDict>> {
    let filter = PyDict::new(py);
    filter.set_item("group", group.bit().trailing_zeros())?;
    filter.set_item("mask", mask)?;
    filter.set_item("sensor", sensor)?;
    Ok(filter)
}

impl RigidBody {
    /// Returns the index of a part of its compound.
    fn part_of_compound(&self, shape: Which) -> Result<usize> {
        let shape = self.numbered(shape)?;
        let count = self.constant(|body| if let Shape::Compound(c) = body.shape() { c.parts().len() } else { 0 })?;
        match shape < count {
            true => Ok(shape),
            false => {
                Err(Error::value(format!("shape: there is no part {shape}; the body has a compound of {count} parts")))
            }
        }
    }
}

#[pymethods]
impl RigidBody {
    /// Returns what one shape collides with: a dict by the names of ``set_shape_filter``, with the mask as the bits of an integer.
    ///
    /// shape: name, or index of the part of a ``Compound``, as ``shapes`` of contacts has it.
    #[pyo3(signature = (shape, **unknown), text_signature = "($self, shape)")]
    fn shape_filter<'py>(
        &self,
        py: Python<'py>,
        shape: Which,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<Bound<'py, PyDict>> {
        keywords::check(unknown, "RigidBody.shape_filter")?;
        let shape = self.part_of_compound(shape)?;
        as_dict(py, self.constant(|body| body.shape_filter(shape))?)
    }

    /// Sets collision group, mask and sensor of one shape, the part of a ``Compound``, by the names of the properties of the body. A sensor has
    /// no contacts; ``events`` reports the bodies that overlap it, with its number.
    ///
    /// shape: name or index of the part. What is not given stays as it is, for a shape without its own as the body has it at
    /// this time. Without any, the shape is as the body again.
    #[pyo3(signature = (shape, *, group=None, mask=None, sensor=None, **unknown), text_signature = "($self, shape, *, group=None, mask=None, sensor=None)")]
    fn set_shape_filter(
        &self,
        py: Python<'_>,
        shape: Which,
        #[pyo3(from_py_with = whole::group)] group: Option<u8>,
        mask: Option<&Bound<'_, PyAny>>,
        sensor: Option<bool>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<()> {
        keywords::check(unknown, "RigidBody.set_shape_filter")?;
        let (shape, given) = (self.part_of_compound(shape)?, Given::new(group, mask, sensor)?);
        self.change(py, |body| body.set_shape_filter(shape, given.over(body.shape_filter(shape))))
    }
}

#[pymethods]
impl Articulation {
    /// Returns what one shape of a link collides with: a dict by the names of ``set_shape_filter``, with the mask as the bits of an
    /// integer.
    ///
    /// shape: name, or number as ``shapes`` of contacts has it.
    #[pyo3(signature = (link, shape, **unknown), text_signature = "($self, link, shape)")]
    fn shape_filter<'py>(
        &self,
        py: Python<'py>,
        link: &str,
        shape: Which,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<Bound<'py, PyDict>> {
        keywords::check(unknown, "Articulation.shape_filter")?;
        let (part, shape) = self.of_link(link, shape)?;
        let found = self.of_body(|body| body.shape_filter(part, shape))?;
        as_dict(py, found.unwrap_or_default())
    }

    /// Sets collision group, mask and sensor of one shape of a link of a body in a world, by the names of
    /// ``RigidBody.set_shape_filter``.
    ///
    /// shape: name, or number as ``shapes`` of contacts has it. What is not given stays as it is. Without any, a part of a
    /// ``Compound`` is as the compound again.
    #[pyo3(signature = (link, shape, *, group=None, mask=None, sensor=None, **unknown), text_signature = "($self, link, shape, *, group=None, mask=None, sensor=None)")]
    #[allow(clippy::too_many_arguments, reason = "Python's keyword arguments")]
    fn set_shape_filter(
        &self,
        py: Python<'_>,
        link: &str,
        shape: Which,
        #[pyo3(from_py_with = whole::group)] group: Option<u8>,
        mask: Option<&Bound<'_, PyAny>>,
        sensor: Option<bool>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<()> {
        keywords::check(unknown, "Articulation.set_shape_filter")?;
        let given = Given::new(group, mask, sensor)?;
        let (place, (part, shape)) = (self.in_world()?, self.of_link(link, shape)?);
        place.write(py, |inner| {
            let body = inner.world.get_mut::<ArticulatedBody>(place.id).ok_or_else(|| place.removed())?;
            let filter = body.shape_filter(part, shape).and_then(|own| given.over(own));
            Ok(body.set_shape_filter(part, shape, filter)?)
        })
    }
}

//! Poses and velocities of all bodies as arrays.

use crate::arrays::convert::{Numbers, numbers, shown, unit};
use crate::errors::{Error, Result};
use crate::objects::place::body_ids;
use crate::world::inner::Inner;
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use tumble::collide::{Pose, Vec3};
use tumble::dynamics::{BodyView, Mode, ObjectId, RigidBody as Rigid, WorldError};

/// A quantity of all bodies.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Bulk {
    Positions,
    Orientations,
    Velocities,
    AngularVelocities,
}

impl Bulk {
    fn name(self) -> &'static str {
        match self {
            Bulk::Positions => "positions",
            Bulk::Orientations => "orientations",
            Bulk::Velocities => "velocities",
            Bulk::AngularVelocities => "angular_velocities",
        }
    }

    /// Returns how many numbers a body has.
    pub fn width(self) -> usize {
        if self == Bulk::Orientations { 4 } else { 3 }
    }

    fn of(self, body: &BodyView<'_>, out: &mut Vec<f64>) {
        match self {
            Bulk::Positions => out.extend_from_slice(body.position().as_slice()),
            Bulk::Orientations => out.extend_from_slice(body.pose().rotation.coords.as_slice()),
            Bulk::Velocities => out.extend_from_slice(body.velocity().as_slice()),
            Bulk::AngularVelocities => out.extend_from_slice(body.angular_velocity().as_slice()),
        }
    }

    /// Writes the numbers of one body.
    fn write(self, inner: &mut Inner, id: ObjectId, row: &[f64]) -> Result<()> {
        let world = &mut inner.world;
        let body = world.body(id)?;
        let (pose, velocity, angular) = (body.pose(), body.velocity(), body.angular_velocity());
        match self {
            Bulk::Positions => {
                world.set_pose(id, Pose::from_parts(Vec3::from_column_slice(row).into(), pose.rotation))?
            }
            Bulk::Orientations => world.set_pose(id, Pose::from_parts(pose.translation, unit(row)))?,
            Bulk::Velocities => world.set_velocity(id, Vec3::from_column_slice(row), angular)?,
            Bulk::AngularVelocities => world.set_velocity(id, velocity, Vec3::from_column_slice(row))?,
        }
        Ok(())
    }
}

/// Returns a quantity of all bodies in rows.
pub fn get(inner: &Inner, bulk: Bulk) -> Result<Vec<f64>> {
    let mut out = Vec::new();
    for id in body_ids(&inner.world) {
        bulk.of(&inner.world.body(id)?, &mut out);
    }
    Ok(out)
}

/// Returns rows as an array. It is read-only: a row that is written into a copy would change nothing.
pub fn array(py: Python<'_>, bulk: Bulk, rows: Vec<f64>) -> Result<Bound<'_, PyArray2<f64>>> {
    let shape = [rows.len() / bulk.width(), bulk.width()];
    let array = PyArray1::from_vec(py, rows).reshape(shape)?;
    array.call_method1("setflags", (false,))?;
    Ok(array)
}

/// Writes a quantity of all bodies, or nothing on an error. Rows that stay as they are wake nothing.
pub fn set(inner: &mut Inner, bulk: Bulk, value: Numbers) -> Result<()> {
    let (ids, width, name) = (body_ids(&inner.world), bulk.width(), bulk.name());
    let Numbers { shape, data } = value;
    if shape != [ids.len(), width] {
        let (n, shape) = (ids.len(), shown(&shape));
        return Err(Error::value(format!("{name}: expected shape ({n}, {width}), got {shape}")));
    }
    let before = get(inner, bulk)?;
    let rows = || ids.iter().zip(data.chunks_exact(width)).zip(before.chunks_exact(width));
    let changed =
        || rows().enumerate().filter(|(_, ((_, row), before))| row != before).map(|(k, ((id, row), _))| (k, *id, row));
    for (k, id, row) in changed() {
        if inner.world.get::<Rigid>(id).is_none() {
            let body = inner.world.name(id).unwrap_or_default();
            return Err(Error::value(format!("{name}: '{body}' is an articulation; set its q and qd instead")));
        }
        let fixed = inner.world.status(id).is_some_and(|status| status.mode == Mode::Static);
        if fixed && matches!(bulk, Bulk::Velocities | Bulk::AngularVelocities) && row.iter().any(|x| *x != 0.0) {
            return Err(WorldError::Static(inner.world.name(id).unwrap_or_default().into()).into());
        }
        let norm = row.iter().map(|x| x * x).sum::<f64>().sqrt();
        if bulk == Bulk::Orientations && (norm - 1.0).abs() > 1e-6 {
            return Err(Error::value(format!("{name}: row {k} has length {norm}; a quaternion has 1")));
        }
    }
    changed().try_for_each(|(_, id, row)| bulk.write(inner, id, row))
}

/// Converts an argument.
pub fn rows(bulk: Bulk, value: &Bound<'_, PyAny>) -> Result<Numbers> {
    numbers(value, bulk.name())
}

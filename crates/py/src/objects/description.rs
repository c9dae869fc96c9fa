//! Descriptions of articulated bodies from paths and pickles.

use crate::arrays::convert::{array, path};
use crate::errors::{Error, Result, caught};
use crate::objects::articulation::Articulation;
use crate::objects::binding::{Binding, Now, Which, locked};
use crate::objects::builder::ArticulationBuilder;
use crate::objects::robot::Robot;
use crate::pool;
use crate::world::pickling::read_body;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::pybacked::PyBackedBytes;
use std::collections::BTreeMap;
use std::path::PathBuf;
use tumble::collide::{Pose, Vec3};
use tumble::dynamics::ArticulatedBody;
use tumble::scene::FileKind;

impl Articulation {
    /// Returns the body to add to a world, in the state of the description, and notes about its
    /// files.
    pub fn body(
        &self,
        py: Python<'_>,
        base: Pose,
        name: Option<&str>,
    ) -> Result<(ArticulatedBody, Robot, Vec<String>)> {
        let Binding::Free { source, now } = &self.spot else {
            return Err(Error::value(format!(
                "'{}' is already in a world; add the description that it was made from",
                self.name
            )));
        };
        let (body, notes) = py.detach(|| pool::run(|| source.body()))?;
        let body = body.with_pose(base).with_name(name.unwrap_or(&self.name));
        let Now { mut q, qd, .. } = locked(now).clone();
        // The pose of a floating root is relative to the base.
        let model = body.model();
        for link in model.links().iter().filter(|link| link.joint == tumble::dynamics::Joint::Floating) {
            let own = Pose::from_parts(
                Vec3::from_column_slice(&q[link.q..link.q + 3]).into(),
                crate::arrays::convert::unit(&q[link.q + 3..link.q + 7]),
            );
            q[link.q..link.q + 7].copy_from_slice(&crate::arrays::convert::pose_numbers(&(base * own)));
        }
        let body = body.with_positions(&q)?.with_velocities(&qd)?;
        let robot = Robot { model: body.model().clone(), base, joints: self.robot.joints.clone() };
        Ok((body, robot, notes))
    }
}

/// Unpickles a description. Its file is read again.
#[pyfunction]
pub fn _unpickle_articulation(
    py: Python<'_>,
    file: PathBuf,
    floating: bool,
    packages: BTreeMap<String, PathBuf>,
    words: [String; 2],
    velocity_limits: bool,
    numbers: [Vec<f64>; 4],
) -> Result<Articulation> {
    let file = file.into_pyobject(py)?.into_any();
    let [missing, collision] = words;
    let description =
        Articulation::from_urdf(py, &file, floating, Some(packages), &missing, &collision, velocity_limits, None)?;
    with_numbers(py, description, numbers)
}

/// Unpickles a description of a body made by a program.
#[pyfunction]
pub fn _unpickle_built_articulation(
    py: Python<'_>,
    data: PyBackedBytes,
    numbers: [Vec<f64>; 4],
) -> Result<Articulation> {
    with_numbers(py, Articulation::described(caught(|| read_body(&data))?), numbers)
}

fn with_numbers(py: Python<'_>, description: Articulation, numbers: [Vec<f64>; 4]) -> Result<Articulation> {
    let [gravity, q, qd, tau] = numbers.map(|row| array(py, &row).into_any());
    description.set_gravity(&gravity)?;
    for (which, row) in [(Which::Q, q), (Which::Qd, qd), (Which::Tau, tau)] {
        description.spot.set(py, which, &description.robot, &row)?;
    }
    Ok(description)
}

/// Returns the error for pickling a handle.
pub fn alone(name: &str) -> Error {
    PyTypeError::new_err(format!(
        "cannot pickle a handle of '{name}' by itself; pickle its world and look up the body there by name"
    ))
    .into()
}

/// Returns a description, also of a builder or of the path of a URDF, a model of MuJoCo or an SDF file.
pub fn described<'py>(value: &Bound<'py, PyAny>) -> Result<Bound<'py, Articulation>> {
    if let Ok(own) = value.cast::<Articulation>() {
        return Ok(own.clone());
    }
    if let Ok(builder) = value.cast::<ArticulationBuilder>() {
        return Ok(Bound::new(value.py(), builder.get().description()?)?);
    }
    let py = value.py();
    let read = match FileKind::of(&path(value)?) {
        Ok(FileKind::Mjcf) => Articulation::from_mjcf(py, value, None, "error", "hull", None)?,
        Ok(FileKind::Sdformat) => Articulation::from_sdformat(py, value, None, "error", "exact", None)?,
        _ => Articulation::from_urdf(py, value, false, None, "error", "exact", false, None)?,
    };
    Ok(Bound::new(py, read)?)
}

//! Storage of an articulated body's state: a description has its own numbers, a handle refers to
//! those of a world.

use crate::arrays::convert::{Numbers, numbers, shown};
use crate::errors::{Error, Result, caught};
use crate::objects::place::Place;
use crate::objects::robot::Robot;
use pyo3::prelude::*;
use std::path::PathBuf;
use std::sync::{Mutex, MutexGuard};
use tumble::collide::Vec3;
use tumble::dynamics::{ArticulatedBody, DofSettings};
use tumble::scene::urdf::{self, UrdfOptions};

/// A description by itself, or a body in a world.
#[allow(clippy::large_enum_variant, reason = "each is the inside of one Python object")]
pub enum Binding {
    Free { source: Source, now: Mutex<Now> },
    Placed(Place),
}

/// Source of a description.
#[derive(Clone)]
#[allow(clippy::large_enum_variant, reason = "each is the inside of one Python object")]
pub enum Source {
    /// A file. Its shapes are read when it is added to a world.
    File { file: PathBuf, options: UrdfOptions, dofs: Vec<DofSettings> },
    /// A body made by a program.
    Built(Box<ArticulatedBody>),
}

/// The state of a description.
#[derive(Clone)]
pub struct Now {
    pub gravity: Vec3,
    pub q: Vec<f64>,
    pub qd: Vec<f64>,
    pub tau: Vec<f64>,
}

/// Selects one array of the state.
#[derive(Clone, Copy)]
pub enum Which {
    Q,
    Qd,
    Tau,
}

impl Which {
    fn name(self) -> &'static str {
        match self {
            Which::Q => "q",
            Which::Qd => "qd",
            Which::Tau => "tau",
        }
    }

    fn of(self, now: &mut Now) -> &mut Vec<f64> {
        match self {
            Which::Q => &mut now.q,
            Which::Qd => &mut now.qd,
            Which::Tau => &mut now.tau,
        }
    }

    /// Returns the length of the array.
    pub fn width(self, robot: &Robot) -> usize {
        if matches!(self, Which::Q) { robot.positions() } else { robot.dof() }
    }
}

impl Source {
    /// Returns the body with its shapes, and notes about its files.
    pub fn body(&self) -> Result<(ArticulatedBody, Vec<String>)> {
        match self {
            Source::File { file, options, .. } => caught(|| Ok(urdf::load(file, options)?)),
            Source::Built(body) => Ok((body.as_ref().clone(), Vec::new())),
        }
    }

    fn dofs(&self) -> &[DofSettings] {
        match self {
            Source::File { dofs, .. } => dofs,
            Source::Built(body) => body.dofs(),
        }
    }
}

impl Binding {
    /// Returns the generalized forces that act from the first frame on.
    pub fn efforts(&self) -> Option<Vec<f64>> {
        match self {
            Binding::Free { now, .. } => Some(locked(now).tau.clone()).filter(|tau| tau.iter().any(|t| *t != 0.0)),
            Binding::Placed(_) => None,
        }
    }

    /// Returns gravity, m/s².
    pub fn gravity(&self) -> Result<Vec3> {
        match self {
            Binding::Free { now, .. } => Ok(locked(now).gravity),
            Binding::Placed(place) => {
                place.read(|inner| inner.world.status(place.id).map(|_| inner.world.settings().gravity))
            }
        }
    }

    /// Returns the present numbers.
    pub fn get(&self, which: Which, robot: &Robot) -> Result<Vec<f64>> {
        let (positions, dof) = (robot.positions(), robot.dof());
        match self {
            Binding::Free { now, .. } => Ok(which.of(&mut locked(now)).clone()),
            Binding::Placed(place) => place.read(|inner| {
                let x = inner.world.state_of(place.id)?;
                Some(match which {
                    Which::Q => x[..positions].to_vec(),
                    Which::Qd => x[positions..].to_vec(),
                    Which::Tau => inner.efforts.get(&place.id).cloned().unwrap_or_else(|| vec![0.0; dof]),
                })
            }),
        }
    }

    /// Sets the numbers, whose count must be right.
    pub fn set(&self, py: Python<'_>, which: Which, robot: &Robot, value: &Bound<'_, PyAny>) -> Result<()> {
        let (name, width) = (which.name(), which.width(robot));
        let Numbers { shape, data } = numbers(value, name)?;
        if shape != [width] {
            return Err(Error::value(format!("{name}: expected shape ({width},), got {}", shown(&shape))));
        }
        let data = if matches!(which, Which::Q) { crate::objects::robot::settled(robot, data)? } else { data };
        match self {
            Binding::Free { now, .. } => {
                *which.of(&mut locked(now)) = data;
                Ok(())
            }
            Binding::Placed(place) => place.write(py, |inner| {
                let mut x = inner.world.state_of(place.id).ok_or_else(|| place.removed())?.to_vec();
                match which {
                    Which::Q => x[..width].copy_from_slice(&data),
                    Which::Qd => {
                        let first = x.len() - width;
                        x[first..].copy_from_slice(&data);
                    }
                    Which::Tau => {
                        inner.efforts.insert(place.id, data);
                        return Ok(());
                    }
                }
                Ok(inner.world.write_state_of(place.id, &x)?)
            }),
        }
    }

    /// Returns the settings of its degrees of freedom.
    pub fn dofs(&self) -> Result<Vec<DofSettings>> {
        match self {
            Binding::Free { source, .. } => Ok(source.dofs().to_vec()),
            Binding::Placed(place) => {
                place.read(|inner| Some(inner.world.get::<ArticulatedBody>(place.id)?.dofs().to_vec()))
            }
        }
    }
}

/// Locks the state of a description.
pub fn locked(now: &Mutex<Now>) -> MutexGuard<'_, Now> {
    now.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
}

/// Returns the initial state of a body.
pub fn start(body: &ArticulatedBody) -> Vec<f64> {
    use tumble::dynamics::Object;
    let Some(own) = body.integratable() else { return Vec::new() };
    let mut x = vec![0.0; own.state_sizes().x];
    own.write_initial(&mut x);
    x
}

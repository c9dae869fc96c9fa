//! Where an articulated body is: a description by itself, which keeps its numbers, or one in a world, whose numbers are the world's.

use crate::body::Place;
use crate::convert::{Numbers, numbers, shown};
use crate::errors::{Error, Result, caught};
use crate::robot::Robot;
use pyo3::prelude::*;
use std::path::PathBuf;
use std::sync::{Mutex, MutexGuard};
use tumble::collide::Vec3;
use tumble::dynamics::{ArticulatedBody, DofSettings};
use tumble::scene::urdf::{self, UrdfOptions};

/// A description by itself, or one in a world.
#[allow(clippy::large_enum_variant, reason = "each is the inside of one Python object")]
pub enum Spot {
    Free { source: Source, now: Mutex<Now> },
    Placed(Place),
}

/// Where a description comes from; its shapes are read when it is put into a world.
#[derive(Clone)]
pub struct Source {
    pub file: PathBuf,
    pub options: UrdfOptions,
    pub freedoms: Vec<DofSettings>,
}

/// The numbers of a description.
#[derive(Clone)]
pub struct Now {
    pub gravity: Vec3,
    pub q: Vec<f64>,
    pub qd: Vec<f64>,
    pub tau: Vec<f64>,
}

/// Which of the numbers.
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

    /// How many numbers there are.
    pub fn width(self, robot: &Robot) -> usize {
        if matches!(self, Which::Q) { robot.positions() } else { robot.dof() }
    }
}

impl Source {
    /// The body with its shapes, and what is to be said of its files.
    pub fn body(&self) -> Result<(ArticulatedBody, Vec<String>)> {
        caught(|| Ok(urdf::load(&self.file, &self.options)?))
    }
}

impl Spot {
    /// Forces that act on it from the first frame on.
    pub fn efforts(&self) -> Option<Vec<f64>> {
        match self {
            Spot::Free { now, .. } => Some(locked(now).tau.clone()).filter(|tau| tau.iter().any(|t| *t != 0.0)),
            Spot::Placed(_) => None,
        }
    }

    /// Gravity there, m/s².
    pub fn gravity(&self) -> Result<Vec3> {
        match self {
            Spot::Free { now, .. } => Ok(locked(now).gravity),
            Spot::Placed(place) => {
                place.read(|inner| inner.world.status(place.id).map(|_| inner.world.settings().gravity))
            }
        }
    }

    /// Numbers as they are now.
    pub fn get(&self, which: Which, robot: &Robot) -> Result<Vec<f64>> {
        let (positions, dof) = (robot.positions(), robot.dof());
        match self {
            Spot::Free { now, .. } => Ok(which.of(&mut locked(now)).clone()),
            Spot::Placed(place) => place.read(|inner| {
                let x = inner.world.state_of(place.id)?;
                Some(match which {
                    Which::Q => x[..positions].to_vec(),
                    Which::Qd => x[positions..].to_vec(),
                    Which::Tau => inner.efforts.get(&place.id).cloned().unwrap_or_else(|| vec![0.0; dof]),
                })
            }),
        }
    }

    /// Sets numbers, which must be as many as there are.
    pub fn set(&self, py: Python<'_>, which: Which, robot: &Robot, value: &Bound<'_, PyAny>) -> Result<()> {
        let (name, width) = (which.name(), which.width(robot));
        let Numbers { shape, data } = numbers(value, name)?;
        if shape != [width] {
            return Err(Error::value(format!("{name}: wanted shape ({width},), and got {}", shown(&shape))));
        }
        let data = if matches!(which, Which::Q) { crate::robot::settled(robot, data)? } else { data };
        match self {
            Spot::Free { now, .. } => {
                *which.of(&mut locked(now)) = data;
                Ok(())
            }
            Spot::Placed(place) => place.write(py, |inner| {
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

    /// Limits and drives of its freedoms.
    pub fn freedoms(&self) -> Result<Vec<DofSettings>> {
        match self {
            Spot::Free { source, .. } => Ok(source.freedoms.clone()),
            Spot::Placed(place) => {
                place.read(|inner| Some(inner.world.get::<ArticulatedBody>(place.id)?.dofs().to_vec()))
            }
        }
    }
}

/// The numbers of a description.
pub fn locked(now: &Mutex<Now>) -> MutexGuard<'_, Now> {
    now.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
}

/// The state that a body starts in.
pub fn start(body: &ArticulatedBody) -> Vec<f64> {
    use tumble::dynamics::Object;
    let Some(own) = body.integratable() else { return Vec::new() };
    let mut x = vec![0.0; own.state_sizes().x];
    own.write_initial(&mut x);
    x
}

//! Shared parts of the methods of articulations: lookup of joints and links by name, arguments and
//! results of the algorithms.

use crate::arrays::convert::{Numbers, bounds, numbers, shown, vec3};
use crate::errors::{Error, Result};
use crate::objects::articulation::Articulation;
use crate::objects::binding::Which;
use crate::objects::place::Place;
use crate::objects::robot::Rows;
use crate::world::inner::Inner;
use numpy::{IxDyn, PyArray1, PyArrayDyn, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tumble::collide::Vec3;
use tumble::dynamics::{ArticulatedBody, DofSettings, Drive, Playback};

impl Articulation {
    /// Returns the arguments of an algorithm. Omitted ones have their current values.
    pub fn rows(&self, arguments: &[(Which, &'static str, Option<&Bound<'_, PyAny>>)]) -> Result<Rows> {
        let read = |&(which, name, value): &(Which, &'static str, Option<&Bound<'_, PyAny>>)| {
            let width = which.width(&self.robot);
            let numbers = match value {
                Some(value) => numbers(value, name)?,
                None => Numbers { shape: vec![width], data: self.spot.get(which, &self.robot)? },
            };
            Ok((name, numbers, width))
        };
        Rows::new(arguments.iter().map(read).collect::<Result<Vec<_>>>()?)
    }

    pub fn in_world(&self) -> Result<&Place> {
        self.place().ok_or_else(|| {
            Error::value(format!(
                "'{}' is not in a world; World.add_articulation returns a handle of a body in a world",
                self.name
            ))
        })
    }

    /// Returns the first degree of freedom of a revolute, prismatic or spherical joint and their number, by the name of the joint.
    pub fn dofs_of(&self, joint: &str) -> Result<(usize, usize)> {
        let number = self.robot.joints.iter().position(|name| name == joint).ok_or_else(|| {
            let names: Vec<&str> = self.robot.joints.iter().map(String::as_str).take(12).collect();
            Error::Name(format!("there is no joint named '{joint}'; there are {}", names.join(", ")))
        })?;
        let link = &self.robot.model.links()[number];
        match link.joint.dof() {
            count @ (1 | 3) => Ok((link.v, count)),
            count => Err(Error::value(format!(
                "joint '{joint}' has {count} degrees of freedom; drives need a revolute, prismatic or spherical joint"
            ))),
        }
    }

    /// Sets one setting of all degrees of freedom of a body in a world: a number for all, or shape (dof,). An
    /// invalid value changes nothing.
    pub fn change_dofs(
        &self,
        py: Python<'_>,
        (name, value): (&str, &Bound<'_, PyAny>),
        with: impl Fn(DofSettings, f64) -> DofSettings,
    ) -> Result<()> {
        let (place, each) = (self.in_world()?, self.of_each_dof((name, value))?);
        place.write(py, |inner| {
            let body = inner.world.get_mut::<ArticulatedBody>(place.id).ok_or_else(|| place.removed())?;
            let mut changed = body.clone();
            for (index, value) in each.into_iter().enumerate() {
                let settings = with(changed.dofs()[index].clone(), value);
                changed.set_dof(index, settings)?;
            }
            *body = changed;
            Ok(())
        })
    }

    /// Converts a number for all degrees of freedom, or one for each.
    pub(super) fn of_each_dof(&self, (name, value): (&str, &Bound<'_, PyAny>)) -> Result<Vec<f64>> {
        let dof = self.robot.dof();
        let may_be_infinite = ["effort", "max_velocity", "max_force"].contains(&name);
        let Numbers { shape, data } = if may_be_infinite { bounds(value, name) } else { numbers(value, name) }?;
        match shape.as_slice() {
            [] => Ok(vec![data[0]; dof]),
            [n] if *n == dof => Ok(data),
            _ => Err(Error::value(format!("{name}: expected a number or shape ({dof},), got {}", shown(&shape)))),
        }
    }

    /// Returns the part that carries a frame.
    pub fn part(&self, link: &str) -> Result<usize> {
        let links = self.robot.model.links().len();
        Ok(self.robot.frame(link)?.link.unwrap_or(links))
    }

    /// Applies something at a point of a link, by default the origin of its frame.
    pub fn push(
        &self,
        py: Python<'_>,
        link: &str,
        point: Option<&Bound<'_, PyAny>>,
        apply: impl FnOnce(&mut Inner, &Place, usize, Vec3) -> Result<()>,
    ) -> Result<()> {
        let (place, part) = (self.in_world()?, self.part(link)?);
        let point = point.map(|p| vec3(p, "point")).transpose()?;
        let frame = self.robot.frame(link)?.pose;
        place.write(py, |inner| {
            let part_state = inner.world.part_state(place.id, part).ok_or_else(|| place.removed())?;
            let at = point.unwrap_or((part_state.pose * frame).translation.vector);
            apply(inner, place, part, at)
        })
    }
}

/// Returns results in the shape that their arguments require.
pub fn result<'py>(
    py: Python<'py>,
    rows: &Rows,
    data: Vec<f64>,
    shape: &[usize],
) -> Result<Bound<'py, PyArrayDyn<f64>>> {
    let shape: Vec<usize> = rows.batch.iter().chain(shape).copied().collect();
    Ok(PyArray1::from_vec(py, data).reshape(IxDyn(&shape))?)
}

/// Returns the drive for a target, a velocity and gains.
pub fn drive(target: Option<f64>, velocity: Option<f64>, stiffness: f64, damping: f64, limit: f64) -> Result<Drive> {
    let stiff = stiffness != 0.0 || damping != 0.0;
    Ok(match (target, velocity) {
        (None, None) if !stiff => Drive::None,
        (Some(_), _) if !stiff => {
            return Err(Error::value("target: a drive to a position needs a stiffness or a damping above 0"));
        }
        (None, Some(target)) if !stiff => Drive::Velocity { target, limit },
        _ => Drive::Position {
            stiffness,
            damping,
            target: target.unwrap_or(0.0),
            velocity: velocity.unwrap_or(0.0),
            limit,
        },
    })
}

/// Returns the drive of a dict with the arguments of ``set_drive``; `effort` is the default of its limit.
pub fn drive_of(given: &Bound<'_, PyDict>, effort: f64) -> Result<Drive> {
    drive_at(given, effort, 0, 1)
}

/// Returns the number of an argument for degree of freedom `k` of `count`: a number is for all of them.
pub fn component(name: &str, value: &Bound<'_, PyAny>, k: usize, count: usize) -> Result<f64> {
    let Numbers { shape, data } = numbers(value, name)?;
    match shape.as_slice() {
        [] => Ok(data[0]),
        [n] if *n == count && count > 1 => Ok(data[k]),
        _ if count == 1 => Err(Error::value(format!("{name}: expected a number, got {}", shown(&shape)))),
        _ => Err(Error::value(format!(
            "{name}: expected a number, or shape ({count},) with one for each degree of freedom, got {}",
            shown(&shape)
        ))),
    }
}

/// Names of a drive that follows a motion; all other ones but `max_force` are those of a motor.
const OF_MOTION: [&str; 3] = ["times", "values", "repeat"];

/// Returns the drive of degree of freedom `k` of `count`: target, velocity and values of a motion may have a number for each.
pub fn drive_at(given: &Bound<'_, PyDict>, effort: f64, k: usize, count: usize) -> Result<Drive> {
    const KEYS: [&str; 5] = ["target", "velocity", "stiffness", "damping", "max_force"];
    let mut values = [None; 5];
    for (key, value) in given {
        let key: String = key.extract()?;
        let Some(index) = KEYS.iter().position(|known| *known == key) else {
            if OF_MOTION.contains(&key.as_str()) {
                continue;
            }
            let all = KEYS.iter().chain(&OF_MOTION).copied().collect::<Vec<_>>().join(", ");
            return Err(Error::value(format!("drive: `{key}` is not known; there are {all}")));
        };
        values[index] = match (index, value.is_none()) {
            (_, true) => None,
            (0 | 1, _) => Some(component(KEYS[index], &value, k, count)?),
            _ => value.extract()?,
        };
    }
    let limit = values[4].unwrap_or(effort);
    if let Some(motion) = motion_at(given, k, count)? {
        if let Some(index) = (0..4).find(|index| values[*index].is_some()) {
            let key = KEYS[index];
            return Err(Error::value(format!(
                "drive: `{key}` does not go with `times`: the motion says where the joint is"
            )));
        }
        return Ok(Drive::Playback { motion: motion.into(), limit });
    }
    let [target, velocity, stiffness, damping, _] = values;
    drive(target, velocity, stiffness.unwrap_or(0.0), damping.unwrap_or(0.0), limit)
}

/// Returns the motion that a drive follows; `None` without one.
fn motion_at(given: &Bound<'_, PyDict>, k: usize, count: usize) -> Result<Option<Playback>> {
    let get = |key: &str| Ok::<_, Error>(given.get_item(key)?.filter(|value| !value.is_none()));
    let [times, values, repeat] = [get("times")?, get("values")?, get("repeat")?];
    let (times, values) = match (times, values) {
        (Some(times), Some(values)) => (numbers(&times, "times")?, numbers(&values, "values")?),
        (None, None) if repeat.is_none() => return Ok(None),
        _ => return Err(Error::value("drive: a motion needs `times` and `values`")),
    };
    let rows = times.data.len();
    let column = match values.shape.as_slice() {
        [n] if *n == rows => values.data,
        [n, each] if *n == rows && *each == count => values.data.iter().skip(k).step_by(count).copied().collect(),
        shape => {
            let more = if count > 1 { format!(" or ({rows}, {count})") } else { String::new() };
            return Err(Error::value(format!(
                "values: expected shape ({rows},){more}, as `times`, got {}",
                shown(shape)
            )));
        }
    };
    let repeats = repeat.map_or(Ok(false), |repeat| repeat.extract::<bool>())?;
    let motion = if repeats { Playback::repeating(times.data, column) } else { Playback::new(times.data, column) };
    motion.map(Some).map_err(|why| Error::value(format!("drive: {why}")))
}

//! Joints of a world: how they are added and found.

use crate::arrays::convert::{Numbers, direction, direction_or, numbers, shown, vec3};
use crate::choices::meaning;
use crate::errors::{Error, Result};
use crate::objects::builder::pair;
use crate::objects::joint::Joint;
use crate::objects::joint_dof;
use crate::objects::joints::{component, drive_at};
use crate::objects::place::Place;
use crate::world::inner::Inner;
use crate::world::shared::Shared;
use crate::world::target::target;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::Arc;
use tumble::collide::Vec3;
use tumble::dynamics::{DofSettings, Drive, JointPlace, LoopJoint, LoopJointError, LoopJointKind, ObjectId, Spring};

/// The arguments of ``add_joint``.
pub struct Arguments<'a, 'py> {
    pub kind: &'a str,
    pub sides: [Option<&'a Bound<'py, PyAny>>; 2],
    pub points: [Option<&'a Bound<'py, PyAny>>; 2],
    pub axes: [Option<&'a Bound<'py, PyAny>>; 2],
    pub limits: Option<&'a Bound<'py, PyAny>>,
    pub drive: Option<&'a Bound<'py, PyDict>>,
    pub breaking: [Option<f64>; 2],
    pub name: &'a str,
    pub length: Option<f64>,
    pub stiffness: f64,
    pub rest: Option<&'a Bound<'py, PyAny>>,
    pub damping: f64,
    pub friction: f64,
    pub teeth: Option<[i32; 2]>,
    pub radius: Option<f64>,
    pub pitch: Option<f64>,
    pub ratio: f64,
    pub ground: Option<&'a Bound<'py, PyAny>>,
    pub cone: Option<f64>,
    pub max_velocity: Option<f64>,
    pub effort: Option<f64>,
    pub armature: f64,
    pub twist_limits: Option<&'a Bound<'py, PyAny>>,
    pub dofs: Option<Vec<Bound<'py, PyDict>>>,
    pub angle: Option<f64>,
}

impl Arguments<'_, '_> {
    /// Returns the names of the arguments that have another value than by default, of those that not all kinds have.
    fn parameters(&self) -> Vec<&'static str> {
        let given = [
            ("second_point", self.points[1].is_some()),
            ("second_axis", self.axes[1].is_some()),
            ("length", self.length.is_some()),
            ("teeth", self.teeth.is_some()),
            ("radius", self.radius.is_some()),
            ("pitch", self.pitch.is_some()),
            ("ratio", self.ratio != 1.0),
            ("ground", self.ground.is_some()),
            ("cone", self.cone.is_some()),
            ("twist_limits", self.twist_limits.is_some()),
            ("limits", self.limits.is_some()),
            ("drive", self.drive.is_some()),
            ("stiffness", self.stiffness != 0.0),
            ("rest", self.rest.is_some()),
            ("damping", self.damping != 0.0),
            ("friction", self.friction != 0.0),
            ("max_velocity", self.max_velocity.is_some()),
            ("effort", self.effort.is_some()),
            ("armature", self.armature != 0.0),
            ("dofs", self.dofs.is_some()),
            ("angle", self.angle.is_some()),
        ];
        given.into_iter().filter(|(_, given)| *given).map(|(name, _)| name).collect()
    }
}

/// Adds a joint and returns its handle.
pub fn add(shared: &Arc<Shared>, py: Python<'_>, given: &Arguments<'_, '_>) -> Result<Joint> {
    if given.kind == "mimic" {
        return Err(Error::value("kind: `mimic` couples coordinates and is made by World.add_mimic"));
    }
    let kind = meaning("kind", given.kind, LoopJointKind::NAMES)?;
    if kind == LoopJointKind::Spherical && given.limits.is_some() {
        return Err(Error::value("limits: a spherical joint has a cone and twist_limits"));
    }
    if let Some(parameter) = given.parameters().into_iter().find(|parameter| !kind.has(parameter)) {
        return Err(LoopJointError::Parameter { name: given.name.into(), kind, parameter }.into());
    }
    let [a, b] = given.sides.map(|value| value.map(|value| side(shared, value)).transpose());
    let (a, b) = (a?, b?);
    let effort = given.effort.unwrap_or(f64::INFINITY);
    // of a spherical joint, targets and rest positions may have a number for each degree of freedom
    let count = if kind == LoopJointKind::Spherical { 3 } else { 1 };
    let settings = |k: usize| -> Result<(Drive, Option<f64>)> {
        let drive = given.drive.map_or(Ok(Drive::None), |drive| drive_at(drive, effort, k, count))?;
        Ok((drive, given.rest.map(|rest| component("rest", rest, k, count)).transpose()?))
    };
    let settings = (0..count).map(settings).collect::<Result<Vec<_>>>()?;
    let limits = given.limits.map(pair).transpose()?;
    let twist_limits = given.twist_limits.map(pair).transpose()?;
    let points = [("point", given.points[0], a), ("second_point", given.points[1], b)].map(|(name, point, side)| {
        if let Some(point) = point {
            return vec3(point, name).map(Some);
        }
        shared.read(|inner| Ok(side.and_then(|(id, part)| center(inner, id, part))))
    });
    let [first, second] = points;
    let (first, second) = (first?, second?);
    let point = first.or(second).ok_or_else(|| Error::value("a: expected a body on one side at least"))?;
    if kind.has_length() && second.is_none() {
        return Err(Error::value("second_point: expected the point of the world at which the joint ends"));
    }
    if kind == LoopJointKind::Universal && given.axes[1].is_none() {
        return Err(Error::value("second_axis: expected the axis of a universal joint that is fixed to b"));
    }
    let missing = |what: &str| Err(Error::value(format!("{what}: a {} needs it", kind.name())));
    match kind {
        LoopJointKind::Gear if given.teeth.is_none() => return missing("teeth"),
        LoopJointKind::Rack if given.radius.is_none() => return missing("radius"),
        LoopJointKind::Rack if given.axes[1].is_none() => return missing("second_axis"),
        LoopJointKind::Screw if given.pitch.is_none() => return missing("pitch"),
        LoopJointKind::Pulley if given.ground.is_none() => return missing("ground"),
        _ => {}
    }
    let place = JointPlace {
        ground: given.ground.map_or(Ok(Default::default()), points_of)?,
        point,
        second_point: second.filter(|_| kind.has_length()),
        axis: direction_or(given.axes[0], "axis", Vec3::z())?,
        second_axis: given.axes[1].map(|axis| direction(axis, "second_axis")).transpose()?,
    };
    let added = shared.write(py, |inner| {
        let mut joint = LoopJoint::joining(given.name, kind, &inner.world, a, b, place)?;
        let mut constants = *joint.transmission();
        constants.ratio = given.ratio;
        constants.teeth = given.teeth.unwrap_or(constants.teeth);
        constants.radius = given.radius.unwrap_or(constants.radius);
        constants.pitch = given.pitch.unwrap_or(constants.pitch);
        joint.set_transmission(constants)?;
        if let Some(length) = given.length {
            joint.set_length(length)?;
        }
        let at_rest = if kind.has_length() { joint.length() } else { 0.0 };
        let springs = given.stiffness != 0.0 || given.rest.is_some() || kind == LoopJointKind::Spring;
        let (damping, friction) = (given.damping, given.friction);
        let max_velocity = given.max_velocity.unwrap_or(f64::INFINITY);
        let dof = |(drive, rest): &(Drive, Option<f64>)| {
            let rest = rest.unwrap_or(at_rest);
            let spring = springs.then_some(Spring { stiffness: given.stiffness, rest });
            let drive = drive.clone();
            DofSettings { limits, damping, friction, spring, drive, max_velocity, effort, ..DofSettings::default() }
        };
        joint.set_dof(dof(&settings[0]))?;
        for (k, own) in settings.iter().enumerate().skip(1).filter(|(_, own)| **own != settings[0]) {
            joint.set_dof_at(k, dof(own))?;
        }
        joint.set_armature(given.armature)?;
        joint.set_cone(given.cone)?;
        joint.set_twist_limits(twist_limits)?;
        for (k, dof) in given.dofs.iter().flatten().enumerate() {
            joint_dof::set(&mut joint, k, dof)?;
        }
        let [force, torque] = given.breaking.map(|most| most.unwrap_or(f64::INFINITY));
        joint.set_breaking(force, torque)?;
        if given.angle.is_some_and(|angle| !angle.is_finite() || !kind.counts_turns(limits)) {
            let expected =
                "angle: expected a number, of a revolute joint with limits more than 3π/2 apart or on one side";
            return Err(Error::value(expected));
        }
        let id = inner.world.add(joint)?;
        if let Some(angle) = given.angle {
            inner.world.set_turn(id, angle)?;
        }
        let name = inner.world.name(id).unwrap_or_default().into();
        Ok(Place { shared: shared.clone(), id, name })
    })?;
    Joint::new(py, added)
}

/// Converts the two points of a pulley.
fn points_of(value: &Bound<'_, PyAny>) -> Result<[Vec3; 2]> {
    let Numbers { shape, data } = numbers(value, "ground")?;
    match shape.as_slice() {
        [2, 3] => Ok([Vec3::from_column_slice(&data[..3]), Vec3::from_column_slice(&data[3..])]),
        _ => Err(Error::value(format!("ground: expected two points, shape (2, 3), got {}", shown(&shape)))),
    }
}

/// Returns the center of mass of a rigid body, or the origin of a link.
fn center(inner: &Inner, id: ObjectId, part: usize) -> Option<Vec3> {
    let state = if part == 0 { inner.world.center_state(id) } else { inner.world.part_state(id, part).copied() };
    state.map(|state| state.position())
}

/// Returns the object and the part that an argument names.
fn side(shared: &Arc<Shared>, value: &Bound<'_, PyAny>) -> Result<(ObjectId, usize)> {
    let target = target(shared, value)?;
    shared.read(|inner| {
        let Some((body, link)) = target.link(inner)? else { return Ok((target.id, 0)) };
        let moving = body.model().frame(link).and_then(|frame| frame.link);
        Ok((target.id, moving.unwrap_or(body.model().links().len())))
    })
}

/// Returns the handles of all joints of a world, in the order of their addition.
pub fn all(shared: &Arc<Shared>, py: Python<'_>) -> Result<Vec<Joint>> {
    let places = shared.read(|inner| {
        let ids = inner.world.ids().iter().filter(|id| inner.world.get::<LoopJoint>(**id).is_some());
        Ok(ids.map(|id| (*id, inner.world.name(*id).unwrap_or_default().into())).collect::<Vec<(ObjectId, Arc<str>)>>())
    })?;
    places.into_iter().map(|(id, name)| Joint::new(py, Place { shared: shared.clone(), id, name })).collect()
}

/// Returns the names of the first joints of a world.
pub fn names(inner: &Inner) -> Vec<&str> {
    let ids = inner.world.ids().iter().filter(|id| inner.world.get::<LoopJoint>(**id).is_some());
    ids.filter_map(|id| inner.world.name(*id)).take(8).collect()
}

/// Returns the place of the joint of that name.
pub fn place_by_name(shared: &Arc<Shared>, name: &str) -> Result<Place> {
    shared.read(|inner| {
        let id = inner.world.find(name).filter(|id| inner.world.get::<LoopJoint>(*id).is_some());
        match id {
            Some(id) => Ok(Place { shared: shared.clone(), id, name: name.into() }),
            None => {
                let names = names(inner);
                let known =
                    if names.is_empty() { "it has none".into() } else { format!("there are {}", names.join(", ")) };
                Err(Error::Name(format!("the world has no joint named '{name}'; {known}")))
            }
        }
    })
}

/// Returns the place of a joint of this world, given as a handle or by name; `None` for anything else.
pub fn place_of(shared: &Arc<Shared>, value: &Bound<'_, PyAny>) -> Result<Option<Place>> {
    if let Ok(joint) = value.cast::<Joint>() {
        let place = joint.get().place.clone();
        return match Arc::ptr_eq(&place.shared, shared) {
            true => place.status().map(|_| Some(place)),
            false => Err(Error::value(format!("'{}' belongs to another world", place.name))),
        };
    }
    Ok(value.extract::<String>().ok().and_then(|name| place_by_name(shared, &name).ok()))
}

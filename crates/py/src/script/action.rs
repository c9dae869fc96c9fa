//! Actions of events in Python.

use crate::arrays::convert::{Numbers, numbers, pose, some, unit, vec3, vec3_or};
use crate::arrays::whole;
use crate::choices::meaning;
use crate::errors::{Error, Result};
use crate::keywords::{self, Unknown};
use crate::script::{Given, part_of};
use crate::world::shared::Shared;
use pyo3::prelude::*;
use pyo3::types::PyString;
use std::sync::Arc;
use tumble::collide::{Pose, Vec3};
use tumble::dynamics::{
    Action as Deed, ArticulatedBody, CameraChange, Ends, Keyframe, LightChange, ObjectId, Smoothness, Spline, Subject,
    World as Core,
};

const SMOOTHNESS: &[(&str, Smoothness)] = &[("c1", Smoothness::C1), ("c2", Smoothness::C2)];
const ENDS: &[(&str, Ends)] = &[("rest", Ends::Rest), ("free", Ends::Free), ("loop", Ends::Loop)];

/// A deed of an event of ``World.add_event``; made by one of its static methods.
///
/// Objects are handles or names; a link is ``"ARTICULATION/LINK"``. Instead of a body, ``"other"`` is the body that made the event fire: the
/// visitor of a sensor, or the second side of a contact. SI units and world axes. An action on an object that was removed does nothing.
#[pyclass(frozen, module = "tumble")]
pub struct Action {
    deed: Deed<Given>,
}

fn subject(body: &Bound<'_, PyAny>) -> Subject<Given> {
    let other = body.is_instance_of::<PyString>() && body.extract::<String>().is_ok_and(|name| name == "other");
    if other { Subject::Other } else { Subject::Part(body.clone().unbind(), 0) }
}

fn color(value: &Bound<'_, PyAny>) -> Result<[f64; 3]> {
    some::<3>(value, "color")
}

#[pymethods]
impl Action {
    /// Spawns a body of a template at a pose with a velocity of its center of mass, m/s, and an angular velocity, rad/s. source: a body that
    /// throws it: all of them are relative to it and to its motion.
    #[staticmethod]
    #[pyo3(signature = (template, position=None, orientation=None, velocity=None, angular_velocity=None, *, source=None, **unknown), text_signature = "(template, position=None, orientation=None, velocity=None, angular_velocity=None, *, source=None)")]
    fn spawn(
        template: Given,
        position: Option<&Bound<'_, PyAny>>,
        orientation: Option<&Bound<'_, PyAny>>,
        velocity: Option<&Bound<'_, PyAny>>,
        angular_velocity: Option<&Bound<'_, PyAny>>,
        source: Option<Given>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<Action> {
        keywords::check(unknown, "Action.spawn")?;
        let deed = Deed::Spawn {
            template,
            pose: pose(position, orientation)?,
            velocity: vec3_or(velocity, "velocity", Vec3::zeros())?,
            angular_velocity: vec3_or(angular_velocity, "angular_velocity", Vec3::zeros())?,
            from: source,
        };
        Ok(Action { deed })
    }

    /// An impulse at once, N·s, shape (3,). point: of the frame of the body, m, by default its center of mass.
    #[staticmethod]
    #[pyo3(signature = (body, impulse, *, point=None, **unknown), text_signature = "(body, impulse, *, point=None)")]
    fn push(
        body: &Bound<'_, PyAny>,
        impulse: &Bound<'_, PyAny>,
        point: Option<&Bound<'_, PyAny>>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<Action> {
        keywords::check(unknown, "Action.push")?;
        let point = point.map(|point| vec3(point, "point")).transpose()?;
        Ok(Action { deed: Deed::Push { body: subject(body), impulse: vec3(impulse, "impulse")?, point } })
    }

    /// A constant force at the center of mass, N, and a torque, N·m, for a duration, s.
    #[staticmethod]
    #[pyo3(signature = (body, force=None, torque=None, *, duration, **unknown), text_signature = "(body, force=None, torque=None, *, duration)")]
    fn force(
        body: &Bound<'_, PyAny>,
        force: Option<&Bound<'_, PyAny>>,
        torque: Option<&Bound<'_, PyAny>>,
        duration: f64,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<Action> {
        keywords::check(unknown, "Action.force")?;
        let (force, torque) = (vec3_or(force, "force", Vec3::zeros())?, vec3_or(torque, "torque", Vec3::zeros())?);
        Ok(Action { deed: Deed::Force { body: subject(body), force, torque, duration } })
    }

    /// Sets the velocity of a rigid body, m/s, and its angular velocity, rad/s.
    #[staticmethod]
    #[pyo3(signature = (body, velocity=None, angular_velocity=None, **unknown), text_signature = "(body, velocity=None, angular_velocity=None)")]
    fn set_velocity(
        body: &Bound<'_, PyAny>,
        velocity: Option<&Bound<'_, PyAny>>,
        angular_velocity: Option<&Bound<'_, PyAny>>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<Action> {
        keywords::check(unknown, "Action.set_velocity")?;
        let velocity = vec3_or(velocity, "velocity", Vec3::zeros())?;
        let angular_velocity = vec3_or(angular_velocity, "angular_velocity", Vec3::zeros())?;
        Ok(Action { deed: Deed::SetVelocity { body: subject(body), velocity, angular_velocity } })
    }

    /// Disables a body. A body of a template can be spawned again.
    #[staticmethod]
    #[pyo3(signature = (body, **unknown), text_signature = "(body)")]
    fn remove(body: &Bound<'_, PyAny>, unknown: Option<Unknown<'_, '_>>) -> Result<Action> {
        keywords::check(unknown, "Action.remove")?;
        Ok(Action { deed: Deed::Remove(subject(body)) })
    }

    /// Enables a body, a joint or an event.
    #[staticmethod]
    #[pyo3(signature = (object, **unknown), text_signature = "(object)")]
    fn enable(object: Given, unknown: Option<Unknown<'_, '_>>) -> Result<Action> {
        keywords::check(unknown, "Action.enable")?;
        Ok(Action { deed: Deed::Enable(object) })
    }

    /// Disables a body, a joint or an event.
    #[staticmethod]
    #[pyo3(signature = (object, **unknown), text_signature = "(object)")]
    fn disable(object: Given, unknown: Option<Unknown<'_, '_>>) -> Result<Action> {
        keywords::check(unknown, "Action.disable")?;
        Ok(Action { deed: Deed::Disable(object) })
    }

    /// Enables a joint of ``World.add_joint``. here: joins its sides where they are at that moment.
    #[staticmethod]
    #[pyo3(signature = (joint, *, here=false, **unknown), text_signature = "(joint, *, here=False)")]
    fn attach(joint: Given, here: bool, unknown: Option<Unknown<'_, '_>>) -> Result<Action> {
        keywords::check(unknown, "Action.attach")?;
        Ok(Action { deed: Deed::Attach { joint, here } })
    }

    /// Disables a joint.
    #[staticmethod]
    #[pyo3(signature = (joint, **unknown), text_signature = "(joint)")]
    fn detach(joint: Given, unknown: Option<Unknown<'_, '_>>) -> Result<Action> {
        keywords::check(unknown, "Action.detach")?;
        Ok(Action { deed: Deed::Disable(joint) })
    }

    /// Gives a body another color, sRGB, each 0 to 1.
    #[staticmethod]
    #[pyo3(signature = (body, color, **unknown), text_signature = "(body, color)")]
    fn recolor(body: &Bound<'_, PyAny>, color: &Bound<'_, PyAny>, unknown: Option<Unknown<'_, '_>>) -> Result<Action> {
        keywords::check(unknown, "Action.recolor")?;
        let color = self::color(color)?.map(|share| share as f32);
        Ok(Action { deed: Deed::Recolor { body: subject(body), color } })
    }

    /// Moves a kinematic rigid body along a path through n keyframes. times: since the firing, shape (n,), s, rising. positions: shape (n, 3), m.
    /// orientations: shape (n, 4), by default none. smoothness: ``"c1"`` or ``"c2"``; ends: ``"rest"``, ``"free"`` or ``"loop"``.
    #[staticmethod]
    #[pyo3(signature = (body, times, positions, orientations=None, *, smoothness="c2", ends="rest", **unknown), text_signature = "(body, times, positions, orientations=None, *, smoothness='c2', ends='rest')")]
    fn move_along(
        body: Given,
        times: &Bound<'_, PyAny>,
        positions: &Bound<'_, PyAny>,
        orientations: Option<&Bound<'_, PyAny>>,
        smoothness: &str,
        ends: &str,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<Action> {
        keywords::check(unknown, "Action.move_along")?;
        let (times, positions) = (numbers(times, "times")?, numbers(positions, "positions")?);
        let n = times.data.len();
        rows(&positions, "positions", n, 3)?;
        let orientations = orientations.map(|given| numbers(given, "orientations")).transpose()?;
        orientations.iter().try_for_each(|given| rows(given, "orientations", n, 4))?;
        let frame = |k: usize| {
            let p = Vec3::from_column_slice(&positions.data[3 * k..3 * k + 3]);
            let turn = orientations.as_ref().map(|given| unit(&given.data[4 * k..4 * k + 4])).unwrap_or_default();
            Keyframe { time: times.data[k], pose: Pose::from_parts(p.into(), turn) }
        };
        let frames: Vec<Keyframe> = (0..n).map(frame).collect();
        let (smoothness, ends) = (meaning("smoothness", smoothness, SMOOTHNESS)?, meaning("ends", ends, ENDS)?);
        let path = Spline::new(frames, smoothness, ends).map_err(|e| Error::value(format!("the path: {e}")))?;
        Ok(Action { deed: Deed::MoveAlong { body, path: Arc::new(path) } })
    }

    /// Sets the target of a drive, rad, m, rad/s or m/s as the drive has it. joint: a joint of ``World.add_joint``, or
    /// ``"ARTICULATION/LINK"`` for the joint that moves the link. dof: the degree of freedom of that joint, from 0, in the order of
    /// ``Joint.dofs``; of a spherical joint a component of its rotation vector.
    #[staticmethod]
    #[pyo3(signature = (joint, target, *, dof=0, **unknown), text_signature = "(joint, target, *, dof=0)")]
    fn drive(
        joint: Given,
        target: f64,
        #[pyo3(from_py_with = whole::dof)] dof: usize,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<Action> {
        keywords::check(unknown, "Action.drive")?;
        Ok(Action { deed: Deed::Drive { body: joint, dof, target, original: None } })
    }

    /// Looks from a camera by its name, or from an eye at a target, m; vertical_fov: rad.
    #[staticmethod]
    #[pyo3(signature = (name=None, *, eye=None, target=None, vertical_fov=0.6981317007977318, **unknown), text_signature = "(name=None, *, eye=None, target=None, vertical_fov=0.6981317007977318)")]
    fn camera(
        name: Option<String>,
        eye: Option<&Bound<'_, PyAny>>,
        target: Option<&Bound<'_, PyAny>>,
        vertical_fov: f64,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<Action> {
        keywords::check(unknown, "Action.camera")?;
        let change = match (name, eye, target) {
            (Some(name), None, None) => CameraChange::Named(name),
            (None, Some(eye), Some(target)) => {
                CameraChange::LookAt { eye: vec3(eye, "eye")?, target: vec3(target, "target")?, vertical_fov }
            }
            _ => return Err(Error::value("expected the name of a camera, or an eye and a target")),
        };
        Ok(Action { deed: Deed::Camera(change) })
    }

    /// Changes a light of the scene. number: from 1. intensity: at least 0. color: sRGB, each 0 to 1.
    #[staticmethod]
    #[pyo3(signature = (number, *, intensity=None, color=None, **unknown), text_signature = "(number, *, intensity=None, color=None)")]
    fn light(
        #[pyo3(from_py_with = whole::number)] number: usize,
        intensity: Option<f64>,
        color: Option<&Bound<'_, PyAny>>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<Action> {
        keywords::check(unknown, "Action.light")?;
        let light = number.checked_sub(1).ok_or_else(|| Error::value("number: expected 1 for the first light"))?;
        let color = color.map(self::color).transpose()?;
        Ok(Action { deed: Deed::Light(LightChange { light, intensity, color }) })
    }

    fn __repr__(&self) -> String {
        let kind = match self.deed {
            Deed::Spawn { .. } => "spawn",
            Deed::Push { .. } => "push",
            Deed::Force { .. } => "force",
            Deed::SetVelocity { .. } => "set_velocity",
            Deed::Remove(_) => "remove",
            Deed::Enable(_) => "enable",
            Deed::Disable(_) => "disable",
            Deed::Attach { .. } => "attach",
            Deed::Recolor { .. } => "recolor",
            Deed::MoveAlong { .. } => "move_along",
            Deed::Drive { .. } => "drive",
            Deed::Camera(_) => "camera",
            Deed::Light(_) => "light",
        };
        format!("<tumble.Action: {kind}>")
    }
}

fn rows(given: &Numbers, what: &str, n: usize, width: usize) -> Result<()> {
    match given.shape == [n, width] {
        true => Ok(()),
        false => Err(Error::value(format!("{what}: expected shape ({n}, {width}), a row for each time"))),
    }
}

impl Action {
    /// Returns the action of a world.
    pub fn resolved(&self, py: Python<'_>, world: &Core, shared: Option<&Arc<Shared>>) -> Result<Deed> {
        let mut wrong = None;
        let found: Deed<(ObjectId, usize, Option<String>)> = self.deed.map(&mut |given: &Given| {
            let given = given.bind(py);
            let link = given.extract::<(Bound<'_, PyAny>, String)>().ok().map(|(_, link)| format!("/{link}"));
            let name = given.extract::<String>().ok().or(link);
            match part_of(world, shared, given) {
                Ok((id, part)) => (id, part, name),
                Err(why) => {
                    wrong.get_or_insert(why);
                    (ObjectId::default(), 0, name)
                }
            }
        });
        if let Some(wrong) = wrong {
            return Err(wrong);
        }
        let mut deed = found.map(&mut |(id, ..)| *id);
        if let (Some(Subject::Part((_, part, _), _)), Some(Subject::Part(_, to))) =
            (found.subject(), deed.subject_mut())
        {
            *to = *part;
        }
        if let (Deed::Drive { body: (id, _, name), .. }, Deed::Drive { dof, .. }) = (&found, &mut deed) {
            let link = name.as_ref().and_then(|name| Some(name.rsplit_once('/')?.1));
            let model = world.get::<ArticulatedBody>(*id).map(|body| body.model());
            if let Some((model, link)) = model.zip(link) {
                let moving = model.link(link).map(|number| &model.links()[number]);
                match moving.filter(|moving| *dof < moving.joint.dof()) {
                    Some(moving) => *dof += moving.v,
                    None => {
                        return Err(Error::value(format!(
                            "dof: link '{link}' has no degree of freedom {dof} of its joint"
                        )));
                    }
                }
            }
        }
        Ok(deed)
    }
}

//! The entries of `do` of an event.

use std::sync::Arc;

use tumble_core::collide::Vec3;
use tumble_core::{Action, CameraChange, Ends, Keyframe, LightChange, Mode, Smoothness, Spline, Subject};

use crate::parse::appearance::read_color;
use crate::parse::bound::Bound;
use crate::parse::event::{ObjectKind, ObjectNames};
use crate::parse::fields::{Fields, Names};
use crate::parse::rotation;
use crate::parse::view::CameraSpec;

/// The keys that say what is done, of which an entry has one.
const WHAT: [&str; 14] = [
    "spawn",
    "push",
    "force",
    "set_velocity",
    "remove",
    "enable",
    "disable",
    "attach",
    "detach",
    "recolor",
    "move_along",
    "drive",
    "camera",
    "light",
];

/// Largest number of keyframes of a path.
const MAX_KEYFRAMES: usize = 10_000;

const SMOOTHNESS: Names<Smoothness> = &[("c1", Smoothness::C1), ("c2", Smoothness::C2)];
const ENDS: Names<Ends> = &[("rest", Ends::Rest), ("free", Ends::Free), ("loop", Ends::Loop)];

/// Reads one entry. `others` says whether the trigger has an other body, and whether it is one of a list.
pub(crate) fn read_action(
    mut f: Fields<'_>,
    names: &ObjectNames,
    others: (bool, bool),
    lights: usize,
) -> Option<Action<String>> {
    let given: Vec<&'static str> = WHAT.into_iter().filter(|key| f.value(key).is_some()).collect();
    let &[key] = given.as_slice() else {
        let message = match given.is_empty() {
            true => format!("{} does not say what is done", f.what),
            false => format!("{} has {} actions", f.what, given.len()),
        };
        f.log.report(
            f.span.clone(),
            message,
            format!("expected one of {}", WHAT.map(|key| format!("`{key}`")).join(", ")),
        );
        return None;
    };
    let problems = f.log.count();
    let action = match key {
        "spawn" => read_spawn(&mut f, names),
        "push" => read_push(&mut f, names, others),
        "force" => read_force(&mut f, names, others),
        "set_velocity" => read_who(&mut f, key, names, others).map(|body| {
            let [velocity, angular_velocity] = read_velocities(&mut f);
            Action::SetVelocity { body, velocity, angular_velocity }
        }),
        "remove" => read_who(&mut f, key, names, others).map(Action::Remove),
        "enable" => read_object(&mut f, key, names).map(Action::Enable),
        "disable" => read_object(&mut f, key, names).map(Action::Disable),
        "attach" => {
            let here = f.flag_or("here", false);
            read_joint(&mut f, key, names).map(|joint| Action::Attach { joint, here })
        }
        "detach" => read_joint(&mut f, key, names).map(Action::Disable),
        "recolor" => {
            let body = read_who(&mut f, key, names, (others.0, true));
            if let (Some(Subject::Other), false, Some(value)) = (&body, others.1, f.value("recolor")) {
                f.wrong("recolor", value, "a trigger that names the bodies, if the other one is recolored");
            }
            let _ = f.required("color", "three numbers from 0 to 1, such as [1, 0, 0]");
            let color = read_color(&mut f, "color", [1.0; 3]).map(|c| c as f32);
            body.map(|body| Action::Recolor { body, color })
        }
        "move_along" => read_move(&mut f, names),
        "drive" => {
            let in_degrees = f.value("target_deg").is_some();
            let dof = read_dof(&mut f);
            let right = |kind| match kind {
                ObjectKind::Link { driven, turns, .. } | ObjectKind::Joint { driven, turns, .. } => {
                    driven[dof] && (turns[dof] || !in_degrees)
                }
                _ => false,
            };
            let expected = match in_degrees {
                false => {
                    "the name of a loop joint, or \"OBJECT/LINK\", with a `drive` to a position or velocity on that degree of \
                     freedom: `dof`, by default 0"
                }
                true => {
                    "the name of a loop joint, or \"OBJECT/LINK\", that turns and has a `drive`, for a `target_deg`"
                }
            };
            let body = names.read(&mut f, "drive", right, expected);
            let target = read_target(&mut f);
            body.map(|body| Action::Drive { body, dof, target, original: None })
        }
        "camera" => read_camera(&mut f),
        _ => read_light(&mut f, lights),
    };
    let log = f.log;
    f.finish();
    action.filter(|_| log.count() == problems)
}

/// Reads the number of a degree of freedom of a joint, from 0.
fn read_dof(f: &mut Fields<'_>) -> usize {
    f.integer_or("dof", 0..=2, 0) as usize
}

fn read_who(
    f: &mut Fields<'_>,
    key: &'static str,
    names: &ObjectNames,
    others: (bool, bool),
) -> Option<Subject<String>> {
    const EXPECTED: &str = "the name of a body, \"OBJECT/LINK\", or \"other\"";
    let (name, value) = f.text(key, EXPECTED)?;
    if name == "other" {
        if !others.0 {
            f.wrong(key, value, "the name of a body: `when` has no other one");
        }
        return Some(Subject::Other);
    }
    names.check(f, key, value, name, ObjectKind::is_body, EXPECTED).map(|name| Subject::Part(name, 0))
}

fn read_object(f: &mut Fields<'_>, key: &'static str, names: &ObjectNames) -> Option<String> {
    names.read(
        f,
        key,
        ObjectKind::is_object,
        "the name of a body, a joint, a sensor, a behavior, or an event above this one",
    )
}

fn read_joint(f: &mut Fields<'_>, key: &'static str, names: &ObjectNames) -> Option<String> {
    names.read(f, key, |kind| matches!(kind, ObjectKind::Joint { .. }), "the name of a loop joint")
}

fn read_velocities(f: &mut Fields<'_>) -> [Vec3; 2] {
    ["velocity_m_per_s", "angular_velocity_rad_per_s"].map(|key| Vec3::from(f.vector_or(key, Bound::ANY, [0.0; 3])))
}

fn read_spawn(f: &mut Fields<'_>, names: &ObjectNames) -> Option<Action<String>> {
    let right = |kind| matches!(kind, ObjectKind::Template(_));
    let template = names.read(f, "spawn", right, "the name of a template");
    let rigid = |kind| matches!(kind, ObjectKind::Body { .. });
    let from = match f.optional_text("from") {
        Some((name, value)) => names.check(f, "from", value, name, rigid, "the name of a body"),
        None => None,
    };
    let pose = rotation::read_pose(f);
    let [velocity, angular_velocity] = read_velocities(f);
    Some(Action::Spawn { template: template?, pose, velocity, angular_velocity, from })
}

fn read_push(f: &mut Fields<'_>, names: &ObjectNames, others: (bool, bool)) -> Option<Action<String>> {
    let body = read_who(f, "push", names, others);
    if let (Some(value), None) = (f.value("force_n"), f.value("impulse_n_s")) {
        f.wrong("force_n", value, "`impulse_n_s`, or `force = \"BODY\"` instead of `push`");
        return None;
    }
    let impulse = Vec3::from(f.vector("impulse_n_s", Bound::ANY));
    let point = f.optional_vector("point_m", Bound::ANY).map(Vec3::from);
    Some(Action::Push { body: body?, impulse, point })
}

fn read_force(f: &mut Fields<'_>, names: &ObjectNames, others: (bool, bool)) -> Option<Action<String>> {
    let body = read_who(f, "force", names, others);
    let force = Vec3::from(f.vector_or("force_n", Bound::ANY, [0.0; 3]));
    let torque = Vec3::from(f.vector_or("torque_n_m", Bound::ANY, [0.0; 3]));
    let duration = f.number("duration_s", Bound::POSITIVE);
    Some(Action::Force { body: body?, force, torque, duration })
}

fn read_move(f: &mut Fields<'_>, names: &ObjectNames) -> Option<Action<String>> {
    let right = |kind| matches!(kind, ObjectKind::Body { mode: Mode::Kinematic, .. });
    let body = names.read(f, "move_along", right, "the name of a body with mode = \"kinematic\"");
    let smoothness = f.choice_or("smoothness", SMOOTHNESS, Smoothness::C2);
    let ends = f.choice_or("ends", ENDS, Ends::Rest);
    let problems = f.log.count();
    if f.value("keyframes").is_none() {
        f.missing("keyframes", "at least two poses, such as [{ time_s = 0, position_m = [0, 0, 0] }, …]");
        return None;
    }
    let keyframes = f.tables("keyframes", MAX_KEYFRAMES).into_iter().map(|mut keyframe| {
        let read =
            Keyframe { time: keyframe.number("time_s", Bound::NOT_NEGATIVE), pose: rotation::read_pose(&mut keyframe) };
        keyframe.finish();
        read
    });
    let keyframes: Vec<Keyframe> = keyframes.collect();
    if f.log.count() > problems {
        return None;
    }
    match Spline::new(keyframes, smoothness, ends) {
        Ok(path) => Some(Action::MoveAlong { body: body?, path: Arc::new(path) }),
        Err(why) => {
            let place = f.value("keyframes").map_or(f.span.clone(), |value| value.span());
            let (fault, expected) = match why.to_string().split_once("; ") {
                Some((fault, expected)) => (fault.to_owned(), expected.to_owned()),
                None => (why.to_string(), "expected poses and ascending times".to_owned()),
            };
            f.log.report(place, format!("`keyframes` of {}: {fault}", f.what), expected);
            None
        }
    }
}

/// Reads the target of a drive: a number for all kinds, or degrees for a position that is an angle.
fn read_target(f: &mut Fields<'_>) -> f64 {
    match f.optional_number("target_deg", Bound::ANY) {
        Some(degrees) => degrees.to_radians(),
        None => f.number("target", Bound::ANY),
    }
}

fn read_camera(f: &mut Fields<'_>) -> Option<Action<String>> {
    const EXPECTED: &str = "the name of a camera, or { eye_m = [4, -4, 3], target_m = [0, 0, 0] }";
    let value = f.value("camera")?;
    if let Some(name) = value.get_ref().as_str() {
        return Some(Action::Camera(CameraChange::Named(name.into())));
    }
    if value.get_ref().as_table().is_none() {
        f.wrong("camera", value, EXPECTED);
        return None;
    }
    let camera = CameraSpec::read(Fields::of(f.log, value, format!("`camera` of {}", f.what), EXPECTED)?);
    Some(Action::Camera(CameraChange::LookAt {
        eye: Vec3::from(camera.eye_m),
        target: Vec3::from(camera.target_m),
        vertical_fov: camera.vertical_fov_deg.to_radians(),
    }))
}

fn read_light(f: &mut Fields<'_>, lights: usize) -> Option<Action<String>> {
    let value = f.value("light")?;
    let light = f.as_integer("light", value, 1..=lights.max(1) as u32) as usize - 1;
    let intensity = f.optional_number("intensity", Bound::NOT_NEGATIVE);
    let color = f.value("color").is_some().then(|| read_color(f, "color", [1.0; 3]));
    if intensity.is_none() && color.is_none() {
        f.missing("intensity", "`intensity`, `color` or both");
    }
    Some(Action::Light(LightChange { light, intensity, color }))
}

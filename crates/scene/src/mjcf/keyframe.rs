//! `<keyframe>`: the state that the model starts in, if one is chosen.

use nalgebra::{Quaternion, Unit};
use tumble_core::collide::{Pose, Quat, Vec3};

use super::joint::Kind;
use super::scene::{Assembly, Place};
use super::schema;
use super::source::XmlNode;
use crate::parse::bound::Bound;
use crate::xml::Element;

/// Largest number of numbers of a keyframe.
const MAX_NUMBERS: usize = 1_000_000;

/// Sets the initial state to that of the chosen keyframe. Returns its controls.
pub(super) fn apply(root: &XmlNode<'_>, assembly: &mut Assembly<'_, '_>) -> Option<Vec<f64>> {
    let reader = assembly.reader;
    let keys: Vec<&Element<'_, '_>> =
        root.all("keyframe").flat_map(|section| section.all("key")).map(|key| &key.element).collect();
    keys.iter().for_each(|key| schema::KEY.check(key, &reader.notes));
    let Some(chosen) = reader.options.keyframe.as_deref() else {
        if let Some(key) = keys.first() {
            reader.notes.add(
                key,
                "keyframes are not used unless one is chosen; the model starts in its reference configuration",
            );
        }
        return None;
    };
    let by_number = || chosen.parse::<usize>().ok().and_then(|number| keys.get(number));
    let Some(key) = keys.iter().find(|key| key.text("name") == Some(chosen)).or_else(by_number) else {
        let names: Vec<&str> = keys.iter().filter_map(|key| key.text("name")).take(12).collect();
        let expected = match names.is_empty() {
            true if keys.is_empty() => "expected none: the model has no keyframes".to_owned(),
            true => format!("expected a number below {}, that of the keyframes without names", keys.len()),
            false => format!("expected one of {}", names.join(", ")),
        };
        root.element.problem(format_args!("has no keyframe \"{}\"", super::defaults::cleaned(chosen)), expected);
        return None;
    };
    let numbers = |name: &str, count: usize| {
        key.text(name)?;
        let list = key.list(name, MAX_NUMBERS, Bound::ANY)?;
        if list.len() != count {
            key.wrong(name, format_args!("{count} numbers, as many as the model has"));
            return None;
        }
        Some(list)
    };
    let sizes = |joint: &super::joint::JointItem<'_>| match joint.kind {
        Kind::Free => (7, 6),
        Kind::Ball => (4, 3),
        _ => (1, 1),
    };
    let joints = || assembly.bodies.iter().flat_map(|body| &body.joints);
    let (positions, velocities) = joints().map(sizes).fold((0, 0), |sum, size| (sum.0 + size.0, sum.1 + size.1));
    let (qpos, qvel) = (numbers("qpos", positions), numbers("qvel", velocities));
    let (mut at, mut rate) = (0, 0);
    for body in 0..assembly.bodies.len() {
        for k in 0..assembly.bodies[body].joints.len() {
            let (count, rates) = sizes(&assembly.bodies[body].joints[k]);
            let q = qpos.as_ref().map(|q| &q[at..at + count]);
            let v = qvel.as_ref().map(|v| &v[rate..rate + rates]);
            set(assembly, (body, k), q, v);
            (at, rate) = (at + count, rate + rates);
        }
    }
    key.text("ctrl")?;
    key.list("ctrl", MAX_NUMBERS, Bound::ANY)
}

/// Sets position and velocity of one joint, in MuJoCo's notation.
fn set(assembly: &mut Assembly<'_, '_>, (body, k): (usize, usize), q: Option<&[f64]>, v: Option<&[f64]>) {
    let kind = assembly.bodies[body].joints[k].kind;
    let pose = match (kind, q) {
        (Kind::Free, Some(q)) => Some(Pose::from_parts(Vec3::new(q[0], q[1], q[2]).into(), rotation(&q[3..]))),
        _ => None,
    };
    if let Place::Rigid(index) = assembly.places[body] {
        let center = Vec3::from(assembly.scene.bodies[index].center_m.unwrap_or_default());
        let spec = &mut assembly.scene.bodies[index];
        if let Some(pose) = pose {
            spec.position_m = pose.translation.vector.into();
            spec.orientation_xyzw = xyzw(&pose.rotation);
        }
        if let Some(v) = v {
            let turn = crate::parse::rotation::pose([0.0; 3], spec.orientation_xyzw).rotation;
            let spin = turn * Vec3::new(v[3], v[4], v[5]);
            spec.angular_velocity_rad_per_s = spin.into();
            spec.velocity_m_per_s = (Vec3::new(v[0], v[1], v[2]) + spin.cross(&(turn * center))).into();
        }
        return;
    }
    let Some(&(tree, link)) = assembly.joints[body].get(k) else { return };
    let link = &mut assembly.scene.articulated[tree].links[link];
    if let Some(pose) = pose {
        link.placement = pose;
    }
    match (kind, q) {
        (Kind::Ball, Some(q)) => link.joint.position = xyzw(&rotation(q)).to_vec(),
        (Kind::Free, _) | (_, None) => {}
        (_, Some(q)) => link.joint.position = q.to_vec(),
    }
    if let Some(v) = v {
        link.joint.velocity = match kind {
            Kind::Free => {
                let spin = link.placement.rotation * Vec3::new(v[3], v[4], v[5]);
                vec![spin.x, spin.y, spin.z, v[0], v[1], v[2]]
            }
            _ => v.to_vec(),
        };
    }
}

fn rotation(wxyz: &[f64]) -> Quat {
    Unit::try_new(Quaternion::new(wxyz[0], wxyz[1], wxyz[2], wxyz[3]), 1e-10).unwrap_or_else(Quat::identity)
}

fn xyzw(rotation: &Quat) -> [f64; 4] {
    rotation.coords.into()
}

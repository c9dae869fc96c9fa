//! `<equality>`: loop joints, and couplings of joints.

use nalgebra::{Quaternion, Unit};
use tumble_core::LoopJointKind;
use tumble_core::collide::{Pose, Vec3};

use super::defaults::Item;
use super::names::find;
use super::scene::Assembly;
use super::schema;
use super::source::XmlNode;
use crate::parse::joint::MimicSpec;
use crate::parse::loop_joint::{LoopDofSpec, LoopJointSpec};
use crate::parse::mimic::{JointMimicSpec, JointSideSpec};
use crate::xml::Element;

/// Reads all equality constraints.
pub(super) fn read<'a>(root: &XmlNode<'a>, assembly: &mut Assembly<'_, 'a>) {
    let reader = assembly.reader;
    for XmlNode { element, .. } in root.all("equality").flat_map(|section| &section.children) {
        let item = reader.classes.item(*element, 0);
        if !matches!(element.tag(), "connect" | "weld" | "joint") {
            reader
                .notes
                .add(element, format!("<{}> of <equality> is left out", super::defaults::cleaned(element.tag())));
            continue;
        }
        schema::EQUALITY.check(element, &reader.notes);
        if !reader.equality || !item.flag("active", true) {
            reader.notes.add(element, "equality constraints that are not active are left out");
            continue;
        }
        match element.tag() {
            "joint" => couple(&item, assembly),
            _ => join(&item, assembly),
        }
    }
}

/// Adds a loop joint of two bodies. Its frames come from sites, from `relpose`, or from the reference configuration,
/// whatever the state at time 0 is, as in MuJoCo.
fn join(item: &Item<'_>, assembly: &mut Assembly<'_, '_>) {
    let (element, names) = (item.own(), assembly.names);
    let by_sites = element.text("site1").is_some() || element.text("site2").is_some();
    let ends = if by_sites {
        let sites = ["site1", "site2"].map(|side| find(element, side, &names.sites, false));
        let [Some(a), Some(b)] = sites else { return };
        [a, b].map(|(body, k)| (body, assembly.bodies[body].sites[k].pose))
    } else {
        let a = find(element, "body1", &names.bodies, false);
        let b = if element.text("body2").is_some() { find(element, "body2", &names.bodies, false) } else { Some(0) };
        let (Some(a), Some(b)) = (a, b) else { return };
        let Some([frame_a, frame_b]) = frames(item, assembly.poses[a].inverse() * assembly.poses[b]) else { return };
        [(a, frame_a), (b, frame_b)]
    };
    if ends.iter().all(|(body, _)| assembly.is_held(*body)) {
        let why = "equality constraints between bodies that are fixed or mocap are left out";
        return assembly.reader.notes.add(element, why);
    }
    let ends = ends.map(|(body, frame)| assembly.placed(body, &frame));
    let ((a, frame_a), (b, frame_b)) = match ends {
        [(Some(a), frame_a), b] if Some(a) != b.0 => ((a, frame_a), b),
        [fixed @ (None, _), (Some(b), frame_b)] => ((b, frame_b), fixed),
        _ => {
            return assembly.reader.notes.add(element, "equality constraints within one body are left out");
        }
    };
    let number = assembly.scene.loop_joints.len();
    let name = item.name().unwrap_or_else(|| format!("equality{number}"));
    let kind = if element.tag() == "weld" { LoopJointKind::Fixed } else { LoopJointKind::Spherical };
    let name = assembly.taken.unique(name);
    assembly.scene.loop_joints.push(LoopJointSpec {
        name,
        kind,
        a: Some(a),
        b,
        anchors: Some([frame_a, frame_b]),
        references: [Pose::identity(); 2],
        position_m: [0.0; 3],
        second_position_m: None,
        axis: Vec3::z().into(),
        second_axis: None,
        ground_m: [[0.0; 3]; 2],
        teeth: [1; 2],
        radius_m: 1.0,
        pitch_m: 1.0,
        ratio: 1.0,
        length_m: None,
        dofs: vec![LoopDofSpec::default(); kind.dofs()],
        cone_rad: None,
        twist_limits_rad: None,
        angle_rad: None,
        breaking_force_n: f64::INFINITY,
        breaking_torque_n_m: f64::INFINITY,
        enabled: true,
    });
}

/// Returns the frames of a joint in both bodies. `reference` is the pose of the second in the first in the reference
/// configuration. The `anchor` of a `<connect>` is a point of the first body, that of a `<weld>` a point of the second.
/// The position of `relpose` is a point of the first body: that of the weld.
fn frames(item: &Item<'_>, reference: Pose) -> Option<[Pose; 2]> {
    let anchor: Option<[f64; 3]> = item.numbers("anchor");
    let at = |p: [f64; 3]| Pose::translation(p[0], p[1], p[2]);
    if item.own().tag() == "connect" {
        if anchor.is_none() {
            item.own().problem("has no `anchor`", "expected three numbers, a point in the frame of body1");
        }
        let frame = at(anchor?);
        return Some([frame, reference.inverse() * frame]);
    }
    let given: Option<[f64; 7]> = item.numbers("relpose");
    // a quaternion of zeros stands for the reference configuration
    let relative = given.and_then(|p| {
        let turn = Unit::try_new(Quaternion::new(p[3], p[4], p[5], p[6]), 1e-10)?;
        Some(Pose::from_parts(Vec3::new(p[0], p[1], p[2]).into(), turn))
    });
    let frame = at(anchor.unwrap_or_default());
    Some([relative.unwrap_or(reference * frame), frame])
}

/// Couples a joint to another, `q₁ − ref₁ = a₀ + a₁(q₂ − ref₂)`, or holds it.
fn couple(item: &Item<'_>, assembly: &mut Assembly<'_, '_>) {
    let (element, reader) = (item.own(), assembly.reader);
    let Some(first) = single(element, "joint1", assembly, false) else { return };
    let second = single(element, "joint2", assembly, true);
    if second.is_none() && element.text("joint2").is_some() {
        return;
    }
    let polynomial = item.list("polycoef", 5).unwrap_or_else(|| vec![0.0, 1.0]);
    let coefficient = |k: usize| polynomial.get(k).copied().unwrap_or(0.0);
    let Some(second) = second else {
        // Equal limits hold the joint.
        let at = first.reference + coefficient(0);
        assembly.scene.articulated[first.tree].links[first.link].joint.dof.limits = Some([at; 2]);
        return;
    };
    if (2..5).any(|k| coefficient(k) != 0.0) {
        return reader.notes.add(element, "couplings of joints that are not linear are left out");
    }
    let multiplier = coefficient(1);
    let offset = first.reference + coefficient(0) - multiplier * second.reference;
    if (first.tree, first.link) == (second.tree, second.link) {
        return reader.notes.add(element, "a coupling of a joint to itself is left out");
    }
    if first.tree != second.tree {
        if multiplier == 0.0 {
            return reader.notes.add(element, "a coupling of two articulated bodies with the ratio 0 is left out");
        }
        let [joint, of] = [first, second].map(|joint| JointSideSpec::Link(joint.tree, joint.link));
        let number = assembly.scene.mimics.len();
        let name = assembly.taken.unique(item.name().unwrap_or_else(|| format!("mimic{number}")));
        return assembly.scene.mimics.push(JointMimicSpec { name, joint, of, multiplier, offset, enabled: true });
    }
    let joint = &mut assembly.scene.articulated[first.tree].links[first.link].joint;
    if joint.mimic.is_some() {
        return reader.notes.add(element, "a second coupling of one joint is left out");
    }
    joint.mimic = Some(MimicSpec { link: second.link, multiplier, offset });
}

/// A hinge or slide joint of an articulated body.
#[derive(Clone, Copy)]
pub(super) struct Single {
    pub(super) tree: usize,
    pub(super) link: usize,
    pub(super) reference: f64,
}

/// Returns the hinge or slide joint that an attribute names.
pub(super) fn single(
    element: &Element<'_, '_>,
    attribute: &str,
    assembly: &Assembly<'_, '_>,
    optional: bool,
) -> Option<Single> {
    let (body, k) = find(element, attribute, &assembly.names.joints, optional)?;
    let joint = &assembly.bodies[body].joints[k];
    if !joint.is_single() {
        assembly.reader.notes.add(element, "couplings, actuators and sensors of ball and free joints are left out");
        return None;
    }
    let (tree, link) = *assembly.joints[body].get(k)?;
    Some(Single { tree, link, reference: joint.reference })
}

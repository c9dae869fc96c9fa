//! `<equality>`: loop joints, and couplings of joints.

use tumble_core::LoopJointKind;
use tumble_core::articulated::DofSettings;
use tumble_core::collide::{Pose, Vec3};

use super::defaults::Item;
use super::names::find;
use super::scene::{Assembly, Place};
use super::schema;
use super::source::XmlNode;
use crate::parse::joint::MimicSpec;
use crate::parse::loop_joint::{LoopJointSpec, PartSpec};
use crate::parse::mimic::{JointMimicSpec, JointSideSpec};
use crate::xml::Element;

/// Reads all equality constraints.
pub(super) fn read<'a>(root: &XmlNode<'a>, assembly: &mut Assembly<'_, 'a>) {
    let reader = assembly.reader;
    let starts = assembly.starts();
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
            _ => join(&item, &starts, assembly),
        }
    }
}

/// Adds a loop joint that holds two bodies as they are at time 0.
fn join(item: &Item<'_>, starts: &[Vec<Pose>], assembly: &mut Assembly<'_, '_>) {
    let (element, reader, names) = (item.own(), assembly.reader, assembly.names);
    let by_sites = element.text("site1").is_some() || element.text("site2").is_some();
    let (bodies, point) = if by_sites {
        let sites = ["site1", "site2"].map(|side| find(element, side, &names.sites, false));
        let [Some(a), Some(b)] = sites else { return };
        ([a.0, b.0], assembly.start_pose(a.0, starts) * assembly.bodies[a.0].sites[a.1].pose)
    } else {
        let a = find(element, "body1", &names.bodies, false);
        let b = if element.text("body2").is_some() { find(element, "body2", &names.bodies, false) } else { Some(0) };
        let (Some(a), Some(b)) = (a, b) else { return };
        let anchor = item.numbers("anchor");
        if anchor.is_none() && element.tag() == "connect" {
            return element.problem("has no `anchor`", "expected three numbers, a point in the frame of body1");
        }
        let local = Pose::translation(
            anchor.map_or(0.0, |p: [f64; 3]| p[0]),
            anchor.map_or(0.0, |p| p[1]),
            anchor.map_or(0.0, |p| p[2]),
        );
        ([a, b], assembly.start_pose(a, starts) * local)
    };
    if item.text("relpose").is_some() {
        reader.notes.add(element, "`relpose` is left out: the bodies are held as they are at the start");
    }
    let parts = bodies.map(|body| part(&assembly.places[body]));
    let (a, b) = match parts {
        [Some(a), b] if Some(a) != b => (a, b),
        [None, Some(b)] => (b, None),
        _ => {
            return reader
                .notes
                .add(element, "equality constraints within one body, or between fixed bodies, are left out");
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
        anchors: None,
        references: [Pose::identity(); 2],
        position_m: point.translation.vector.into(),
        second_position_m: None,
        axis: Vec3::z().into(),
        second_axis: None,
        ground_m: [[0.0; 3]; 2],
        teeth: [1; 2],
        radius_m: 1.0,
        pitch_m: 1.0,
        ratio: 1.0,
        length_m: None,
        dof: DofSettings::default(),
        holds_start: false,
        breaking_force_n: f64::INFINITY,
        breaking_torque_n_m: f64::INFINITY,
        enabled: true,
    });
}

fn part(place: &Place) -> Option<PartSpec> {
    match *place {
        Place::World => None,
        Place::Rigid(index) => Some(PartSpec::Body(index)),
        Place::Link(tree, link) => Some(PartSpec::Link(tree, link)),
    }
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

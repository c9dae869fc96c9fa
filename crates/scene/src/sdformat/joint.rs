//! `<joint>`: type, axes, limits, damping, friction and springs.

use tumble_core::Joint;
use tumble_core::articulated::{DofSettings, Spring};
use tumble_core::collide::{Pose, Vec3};

use super::frames::Frames;
use super::value::{child_text, flag, note, note_others, number, numbers, open_number};
use crate::notes::NoteList;
use crate::parse::bound::Bound;
use crate::xml::Element;

/// The joint types of SDF that are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Fixed,
    Revolute,
    Continuous,
    Prismatic,
    Ball,
    /// Two revolute joints through one point: `universal` and `revolute2`.
    Universal,
}

const KINDS: [(&str, Kind); 7] = [
    ("fixed", Kind::Fixed),
    ("revolute", Kind::Revolute),
    ("continuous", Kind::Continuous),
    ("prismatic", Kind::Prismatic),
    ("ball", Kind::Ball),
    ("universal", Kind::Universal),
    ("revolute2", Kind::Universal),
];
const EXPECTED: &str = "expected revolute, continuous, prismatic, fixed, ball, universal or revolute2";

/// A joint as its element describes it.
pub(super) struct JointElement<'a, 'd> {
    pub(super) name: String,
    pub(super) element: Element<'a, 'd>,
    pub(super) kind: Kind,
    /// Names of links; the parent may be `world`.
    pub(super) parent: &'a str,
    pub(super) child: &'a str,
    /// Pose of the joint's frame in the child link.
    pub(super) frame: Pose,
    /// One axis, or two of a universal joint.
    pub(super) axes: Vec<Axis<'a, 'd>>,
}

/// An axis with its settings.
pub(super) struct Axis<'a, 'd> {
    /// Unit, in the axes of the joint.
    pub(super) direction: Vec3,
    pub(super) dof: DofSettings,
    /// `<mimic>`: its element, the joint that is followed, ratio and offset.
    pub(super) mimic: Option<(Element<'a, 'd>, &'a str, f64, f64)>,
}

impl<'a, 'd> JointElement<'a, 'd> {
    pub(super) fn read(
        element: Element<'a, 'd>,
        frames: &mut Frames<'a, 'd>,
        notes: &mut NoteList,
    ) -> Option<JointElement<'a, 'd>> {
        let name = element.text("name")?.to_owned();
        note_others(&element, &["parent", "child", "pose", "axis", "axis2"], notes);
        let end = |tag| element.required(tag, &format!("<{tag}>NAME OF A LINK</{tag}>")).map(|_| ());
        let (_, _) = (end("parent")?, end("child")?);
        // frames stand for the links that carry them; a name that is neither is reported with the tree
        let link = |tag| {
            let name = child_text(&element, tag).unwrap_or("");
            frames.link_of(name).unwrap_or(name)
        };
        let [parent, child] = ["parent", "child"].map(link);
        let typed = element.required_text("type", EXPECTED)?;
        let Some((_, kind)) = KINDS.iter().find(|(word, _)| *word == typed) else {
            element.wrong("type", EXPECTED.trim_start_matches("expected "));
            return None;
        };
        let (joint, base) = (frames.pose(&name), frames.pose(child));
        let frame = base.zip(joint).map_or(Pose::identity(), |(child, joint)| child.inverse() * joint);
        let tags: &[&'static str] = match kind {
            Kind::Fixed | Kind::Ball => &[],
            Kind::Universal => &["axis", "axis2"],
            _ => &["axis"],
        };
        let limited = matches!(kind, Kind::Revolute | Kind::Prismatic | Kind::Universal);
        let axes = tags.iter().filter_map(|tag| {
            let axis = element.required(tag, &format!("<{tag}> with <xyz>"))?;
            Some(Axis::read(&axis, &name, limited, frames, notes))
        });
        let axes: Vec<Axis<'a, 'd>> = axes.collect();
        (axes.len() == tags.len()).then_some(JointElement { name, element, kind: *kind, parent, child, frame, axes })
    }

    /// Returns the joint of the engine about or along an axis.
    pub(super) fn joint(&self, direction: Vec3) -> Joint {
        match self.kind {
            Kind::Fixed => Joint::Fixed,
            Kind::Ball => Joint::Spherical,
            Kind::Prismatic => Joint::Prismatic { axis: direction },
            Kind::Revolute | Kind::Continuous | Kind::Universal => Joint::Revolute { axis: direction },
        }
    }
}

impl<'a, 'd> Axis<'a, 'd> {
    /// Reads `<axis>`; `joint` is the name of the joint.
    fn read(
        axis: &Element<'a, 'd>,
        joint: &str,
        limited: bool,
        frames: &mut Frames<'a, 'd>,
        notes: &mut NoteList,
    ) -> Axis<'a, 'd> {
        note_others(axis, &["xyz", "limit", "dynamics", "mimic", "use_parent_model_frame", "initial_position"], notes);
        if let Some(start) = axis.child("initial_position") {
            note(&start, "initial positions are left out", notes);
        }
        let mut direction = Vec3::z();
        if let Some(xyz) = axis.child("xyz") {
            let given = Vec3::from(numbers(&xyz, Bound::ANY).unwrap_or([0.0, 0.0, 1.0]));
            direction = given.try_normalize(1e-9).unwrap_or_else(|| {
                super::value::wrong(&xyz, "a direction: three numbers, not all 0");
                Vec3::z()
            });
            // a word of SDF before 1.7; axes of SDF before 1.5 are so without it
            let old = flag(axis, "use_parent_model_frame", frames.axes_in_model).then_some(super::frames::MODEL);
            if let Some(frame) = xyz.text("expressed_in").filter(|frame| !frame.is_empty()).or(old) {
                match (frames.pose(frame), frames.pose(joint)) {
                    (Some(frame), Some(joint)) => direction = joint.rotation.inverse() * frame.rotation * direction,
                    (None, _) => drop(frames.unknown(&xyz, frame)),
                    _ => {}
                }
            }
        }
        Axis { direction, dof: read_settings(axis, limited, notes), mimic: read_mimic(axis, notes) }
    }
}

fn read_settings(axis: &Element<'_, '_>, limited: bool, notes: &mut NoteList) -> DofSettings {
    let mut dof = DofSettings::default();
    if let Some(limit) = axis.child("limit") {
        note_others(&limit, &["lower", "upper", "effort", "velocity"], notes);
        let [lower, upper] = [("lower", f64::NEG_INFINITY), ("upper", f64::INFINITY)]
            .map(|(tag, default)| open_number(&limit, tag, default));
        if lower > upper {
            limit.problem(format_args!("has `lower` {lower} above `upper` {upper}"), "expected `lower` first");
        } else if limited && (lower.is_finite() || upper.is_finite()) {
            dof.limits = Some([lower, upper]);
        }
        // -1 is the format's word for no limit
        dof.effort = Some(open_number(&limit, "effort", f64::INFINITY)).filter(|x| *x >= 0.0).unwrap_or(f64::INFINITY);
        if let Some(velocity) = limit.child("velocity").filter(|_| open_number(&limit, "velocity", -1.0) > 0.0) {
            note(&velocity, "limits of velocities are left out", notes);
        }
    }
    if let Some(dynamics) = axis.child("dynamics") {
        note_others(&dynamics, &["damping", "friction", "spring_reference", "spring_stiffness"], notes);
        dof.damping = number(&dynamics, "damping", Bound::NOT_NEGATIVE, 0.0);
        dof.friction = number(&dynamics, "friction", Bound::NOT_NEGATIVE, 0.0);
        let stiffness = number(&dynamics, "spring_stiffness", Bound::NOT_NEGATIVE, 0.0);
        let rest = number(&dynamics, "spring_reference", Bound::ANY, 0.0);
        dof.spring = (stiffness > 0.0).then_some(Spring { stiffness, rest });
    }
    dof
}

/// Reads `<mimic>`: `q = multiplier·(q_of − reference) + offset`.
fn read_mimic<'a, 'd>(axis: &Element<'a, 'd>, notes: &mut NoteList) -> Option<(Element<'a, 'd>, &'a str, f64, f64)> {
    let mimic = axis.child("mimic")?;
    note_others(&mimic, &["multiplier", "offset", "reference"], notes);
    let of = mimic.required_text("joint", "the name of the joint that it follows")?;
    if mimic.text("axis").is_some_and(|axis| axis != "axis") {
        note(&mimic, "a joint that follows a second axis follows nothing", notes);
        return None;
    }
    let [multiplier, offset, reference] = [("multiplier", 1.0), ("offset", 0.0), ("reference", 0.0)]
        .map(|(tag, default)| number(&mimic, tag, Bound::ANY, default));
    Some((mimic, of, multiplier, offset - multiplier * reference))
}

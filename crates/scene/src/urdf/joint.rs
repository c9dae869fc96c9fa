//! `<joint>`: type, axis, limits, damping and friction.

use std::collections::BTreeMap;
use std::ops::Range;

use tumble_core::Joint;
use tumble_core::articulated::DofSettings;
use tumble_core::collide::{Pose, Vec3};

use super::link::read_origin;
use crate::parse::bound::Bound;
use crate::parse::joint::JointSpec;
use crate::xml::Element;

/// The joint types of a URDF. `spherical` is not in its specification, but some files have it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Kind {
    Fixed,
    Revolute,
    Continuous,
    Prismatic,
    Spherical,
    Floating,
    Planar,
}

const KINDS: &[(&str, Kind)] = &[
    ("fixed", Kind::Fixed),
    ("revolute", Kind::Revolute),
    ("continuous", Kind::Continuous),
    ("prismatic", Kind::Prismatic),
    ("spherical", Kind::Spherical),
    ("floating", Kind::Floating),
    ("planar", Kind::Planar),
];

/// A joint as its element describes it.
pub(crate) struct JointElement {
    pub(crate) name: String,
    pub(crate) span: Range<usize>,
    pub(crate) kind: Kind,
    /// Indices of links.
    pub(crate) parent: usize,
    pub(crate) child: usize,
    pub(crate) placement: Pose,
    /// Unit axis; the normal of a planar joint.
    pub(crate) axis: Vec3,
    pub(crate) dof: DofSettings,
    pub(crate) speed: Option<f64>,
    pub(crate) mimic: Option<Mimic>,
}

/// `<mimic>`: the name of the joint followed, ratio and offset.
pub(crate) struct Mimic {
    pub(crate) joint: String,
    pub(crate) multiplier: f64,
    pub(crate) offset: f64,
    pub(crate) span: Range<usize>,
}

impl JointElement {
    pub(crate) fn read(joint: &Element<'_, '_>, links: &BTreeMap<String, usize>) -> Option<JointElement> {
        let name = joint.required_text("name", "a unique name");
        let kind = read_kind(joint);
        let [parent, child] = ["parent", "child"].map(|end| read_end(joint, end, links));
        let axis = read_axis(joint);
        let (dof, speed) = read_limits(joint, kind?);
        let mimic = joint.child("mimic").and_then(|mimic| {
            Some(Mimic {
                joint: mimic.required_text("joint", "the name of the joint that it follows")?.to_owned(),
                multiplier: mimic.number("multiplier", Bound::ANY).unwrap_or(1.0),
                offset: mimic.number("offset", Bound::ANY).unwrap_or(0.0),
                span: mimic.span(),
            })
        });
        let placement = read_origin(joint);
        let (name, span) = (name?.to_owned(), joint.span());
        Some(JointElement {
            name,
            span,
            kind: kind?,
            parent: parent?,
            child: child?,
            placement,
            axis,
            dof,
            speed,
            mimic,
        })
    }

    /// Returns a joint with at most one degree of freedom; `None` for types that are made of
    /// several joints.
    pub(crate) fn spec(&self) -> Option<JointSpec> {
        let axis = self.axis;
        let kind = match self.kind {
            Kind::Fixed => Joint::Fixed,
            Kind::Revolute | Kind::Continuous => Joint::Revolute { axis },
            Kind::Prismatic => Joint::Prismatic { axis },
            Kind::Spherical => Joint::Spherical,
            Kind::Floating | Kind::Planar => return None,
        };
        Some(self.with_effects(JointSpec::new(&self.name, kind)))
    }

    /// Returns the joint with the limits, damping, friction, effort and speed of this element.
    pub(crate) fn with_effects(&self, joint: JointSpec) -> JointSpec {
        let dof = if joint.kind == Joint::Fixed { DofSettings::default() } else { self.dof.clone() };
        JointSpec { dof, speed: self.speed, ..joint }
    }
}

fn read_kind(joint: &Element<'_, '_>) -> Option<Kind> {
    let expected = "revolute, continuous, prismatic, fixed, floating, planar or spherical";
    let typed = joint.required_text("type", expected)?;
    let kind = KINDS.iter().find(|(name, _)| *name == typed).map(|(_, kind)| *kind);
    if kind.is_none() {
        joint.wrong("type", expected);
    }
    kind
}

/// Reads `<parent link>` or `<child link>`.
fn read_end(joint: &Element<'_, '_>, end: &'static str, links: &BTreeMap<String, usize>) -> Option<usize> {
    let element = joint.required(end, &format!("<{end} link=\"NAME\"/>"))?;
    let name = element.required_text("link", "the name of a link")?;
    let found = links.get(name).copied();
    if found.is_none() {
        let near = crate::parse::suggest::nearest(name, links.keys().map(String::as_str));
        element.wrong(
            "link",
            near.map_or("the name of a link of this file".into(), |near| {
                format!("the name of a link; did you mean \"{near}\"?")
            }),
        );
    }
    found
}

/// Reads `<axis xyz>` as a unit vector; x if it is absent.
fn read_axis(joint: &Element<'_, '_>) -> Vec3 {
    let Some(axis) = joint.child("axis") else { return Vec3::x() };
    let xyz = Vec3::from(axis.numbers("xyz", Bound::ANY).unwrap_or([1.0, 0.0, 0.0]));
    match xyz.try_normalize(1e-9) {
        Some(unit) => unit,
        // Not finite: already reported.
        None if xyz.iter().any(|x| !x.is_finite()) => Vec3::x(),
        // Files often write a zero axis for joints that have none.
        None if matches!(joint.text("type"), Some("fixed" | "floating" | "spherical")) => Vec3::x(),
        None => {
            axis.wrong("xyz", "a direction: three numbers, not all 0");
            Vec3::x()
        }
    }
}

/// Reads `<limit>` and `<dynamics>`: limits, damping, friction, effort, speed.
fn read_limits(joint: &Element<'_, '_>, kind: Kind) -> (DofSettings, Option<f64>) {
    let bounded = matches!(kind, Kind::Revolute | Kind::Prismatic);
    let limit = match bounded {
        true => joint.required(
            "limit",
            "<limit lower upper effort velocity/>, or type=\"continuous\" for a revolute joint without limits",
        ),
        false => joint.child("limit"),
    };
    let [lower, upper] =
        ["lower", "upper"].map(|end| limit.and_then(|l| l.text(end).and_then(|_| l.open_number(end))).unwrap_or(0.0));
    if let Some(limit) = limit.filter(|_| lower > upper) {
        limit.wrong("lower", format_args!("at most `upper`, {upper}"));
    }
    // Many files write 0 or a negative number for an unknown value.
    let most = |name: &str| {
        limit.and_then(|l| l.text(name).and_then(|_| l.open_number(name))).filter(|x| *x > 0.0 && x.is_finite())
    };
    let dynamics = joint.child("dynamics");
    let constant = |name: &str| dynamics.and_then(|d| d.number(name, Bound::NOT_NEGATIVE)).unwrap_or(0.0);
    let open = lower == f64::NEG_INFINITY && upper == f64::INFINITY;
    let limits = (bounded && limit.is_some() && !open).then_some([lower, upper]);
    let [damping, friction] = ["damping", "friction"].map(constant);
    let effort = most("effort").unwrap_or(f64::INFINITY);
    (DofSettings { limits, damping, friction, effort, ..DofSettings::default() }, most("velocity"))
}

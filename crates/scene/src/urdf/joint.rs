//! `<joint>`: how its child moves against its parent, its limits and what resists it.

use std::collections::BTreeMap;
use std::ops::Range;

use tumble_core::Joint;
use tumble_core::articulated::DofSettings;
use tumble_core::collide::{Pose, Vec3};

use super::link::read_origin;
use super::xml::Element;
use crate::bound::Bound;
use crate::joint::JointSpec;

/// The kinds of joints of a URDF. `spherical` is not in its specification, but some write it.
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

/// A joint as its element says.
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
    pub(crate) freedom: DofSettings,
    pub(crate) effort: Option<f64>,
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
        let name = joint.required_text("name", "a name of its own");
        let kind = read_kind(joint);
        let [parent, child] = ["parent", "child"].map(|end| read_end(joint, end, links));
        let axis = read_axis(joint);
        let (freedom, effort, speed) = read_limits(joint, kind?);
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
            freedom,
            effort,
            speed,
            mimic,
        })
    }

    /// The joint with one or no degree of freedom of its own; `None` for those that are made of several.
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

    /// A joint with this one's constants.
    pub(crate) fn with_effects(&self, joint: JointSpec) -> JointSpec {
        let freedom = if joint.kind == Joint::Fixed { DofSettings::default() } else { self.freedom.clone() };
        JointSpec { freedom, effort: self.effort, speed: self.speed, ..joint }
    }
}

fn read_kind(joint: &Element<'_, '_>) -> Option<Kind> {
    let wanted = "revolute, continuous, prismatic, fixed, floating, planar or spherical";
    let typed = joint.required_text("type", wanted)?;
    let kind = KINDS.iter().find(|(name, _)| *name == typed).map(|(_, kind)| *kind);
    if kind.is_none() {
        joint.wrong("type", wanted);
    }
    kind
}

/// `<parent link>` or `<child link>`.
fn read_end(joint: &Element<'_, '_>, end: &'static str, links: &BTreeMap<String, usize>) -> Option<usize> {
    let element = joint.required(end, &format!("<{end} link=\"NAME\"/>"))?;
    let name = element.required_text("link", "the name of a link")?;
    let found = links.get(name).copied();
    if found.is_none() {
        let near = crate::suggest::nearest(name, links.keys().map(String::as_str));
        element.wrong(
            "link",
            near.map_or("the name of a link of this file".into(), |near| {
                format!("the name of a link; did you mean \"{near}\"?")
            }),
        );
    }
    found
}

/// `<axis xyz>`, made unit; x where it is not there.
fn read_axis(joint: &Element<'_, '_>) -> Vec3 {
    let Some(axis) = joint.child("axis") else { return Vec3::x() };
    let xyz = Vec3::from(axis.numbers("xyz", Bound::ANY).unwrap_or([1.0, 0.0, 0.0]));
    match xyz.try_normalize(1e-9) {
        Some(unit) => unit,
        // told already where it is not finite
        None if xyz.iter().any(|x| !x.is_finite()) => Vec3::x(),
        // the axis of a joint that has none is often written as zero
        None if matches!(joint.text("type"), Some("fixed" | "floating" | "spherical")) => Vec3::x(),
        None => {
            axis.wrong("xyz", "a direction: three numbers, not all 0");
            Vec3::x()
        }
    }
}

/// `<limit>` and `<dynamics>`: what acts, effort, speed.
fn read_limits(joint: &Element<'_, '_>, kind: Kind) -> (DofSettings, Option<f64>, Option<f64>) {
    let bounded = matches!(kind, Kind::Revolute | Kind::Prismatic);
    let limit = match bounded {
        true => joint.required(
            "limit",
            "<limit lower upper effort velocity/>, or type=\"continuous\" for a hinge without limits",
        ),
        false => joint.child("limit"),
    };
    let [lower, upper] =
        ["lower", "upper"].map(|end| limit.and_then(|l| l.text(end).and_then(|_| l.open_number(end))).unwrap_or(0.0));
    if let Some(limit) = limit.filter(|_| lower > upper) {
        limit.wrong("lower", format_args!("at most `upper`, {upper}"));
    }
    // 0 and negative numbers stand for "not known" in many files
    let most = |name: &str| {
        limit.and_then(|l| l.text(name).and_then(|_| l.open_number(name))).filter(|x| *x > 0.0 && x.is_finite())
    };
    let dynamics = joint.child("dynamics");
    let constant = |name: &str| dynamics.and_then(|d| d.number(name, Bound::NOT_NEGATIVE)).unwrap_or(0.0);
    let open = lower == f64::NEG_INFINITY && upper == f64::INFINITY;
    let limits = (bounded && limit.is_some() && !open).then_some([lower, upper]);
    (
        DofSettings { limits, damping: constant("damping"), friction: constant("friction"), ..DofSettings::default() },
        most("effort"),
        most("velocity"),
    )
}

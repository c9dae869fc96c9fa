//! `<joint>` and `<freejoint>`: one joint of a body, which may have several.

use tumble_core::Joint;
use tumble_core::articulated::{DofSettings, Spring};
use tumble_core::collide::{Pose, Vec3};

use super::Reader;
use super::schema;
use crate::parse::bound::Bound;
use crate::xml::Element;

/// The type of a joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Free,
    Ball,
    Slide,
    Hinge,
}

const KINDS: &[(&str, Kind)] =
    &[("free", Kind::Free), ("ball", Kind::Ball), ("slide", Kind::Slide), ("hinge", Kind::Hinge)];

/// A joint of a body.
pub(super) struct JointItem<'a> {
    pub(super) name: Option<String>,
    pub(super) element: Element<'a, 'a>,
    pub(super) kind: Kind,
    /// Its origin in the frame of the body, m.
    pub(super) anchor: Vec3,
    /// Unit axis in the frame of the body.
    pub(super) axis: Vec3,
    /// Limits, spring, damping and dry friction.
    pub(super) dof: DofSettings,
    /// Largest rotation of a ball joint, rad.
    pub(super) ball_range: Option<f64>,
    pub(super) armature: f64,
    /// Position in the reference configuration, rad or m.
    pub(super) reference: f64,
    /// Rest position of its spring, rad or m.
    pub(super) spring_rest: f64,
    /// Time constant and damping ratio, from which stiffness and damping follow.
    pub(super) spring_damper: Option<[f64; 2]>,
    /// Largest and least force of all actuators, N·m or N.
    pub(super) actuator_range: Option<[f64; 2]>,
}

impl<'a> JointItem<'a> {
    /// Reads a joint; `frame` is its `<frame>` in the body.
    pub(super) fn read(element: Element<'a, 'a>, class: usize, frame: &Pose, reader: &Reader<'a>) -> JointItem<'a> {
        if element.tag() == "freejoint" {
            schema::FREEJOINT.check(&element, &reader.notes);
            return JointItem::free(element);
        }
        schema::JOINT.check(&element, &reader.notes);
        let item = reader.classes.item(element, class);
        let kind = item.word("type", KINDS).unwrap_or(Kind::Hinge);
        if kind == Kind::Free {
            let joint = JointItem::free(element);
            let [friction, armature] =
                ["frictionloss", "armature"].map(|name| item.number(name, Bound::NOT_NEGATIVE, 0.0));
            let [stiffness, damping] = ["stiffness", "damping"].map(|name| item.first_coefficient(name, &reader.notes));
            if stiffness > 0.0 || armature > 0.0 {
                reader.notes.add(&element, "stiffness and armature of free joints are left out");
            }
            let dof = DofSettings { damping, friction, ..DofSettings::default() };
            return JointItem { dof, ..joint };
        }
        let axis = Vec3::from(item.numbers("axis").unwrap_or([0.0, 0.0, 1.0]));
        let axis = axis.try_normalize(1e-10).unwrap_or_else(|| {
            if let Some(element) = item.at("axis").filter(|_| kind != Kind::Ball && axis.iter().all(|x| x.is_finite()))
            {
                element.wrong("axis", "a direction: three numbers, not all 0");
            }
            Vec3::z()
        });
        let turn = |x: f64| if kind == Kind::Hinge { reader.compiler.angle(x) } else { x };
        let number = |name: &str| item.number(name, Bound::NOT_NEGATIVE, 0.0);
        let first = |name: &str| item.first_coefficient(name, &reader.notes);
        let single = kind != Kind::Ball;
        let limited = item.limited("limited", "range", reader.compiler.autolimits);
        let is_dropped = !limited && !reader.compiler.autolimits;
        if is_dropped && item.text("range").is_some() && item.text("limited").is_none() {
            reader.notes.add(&element, "a range without `limited` has no effect, since `autolimits` is false");
        }
        let limits = match limited && single && reader.limits {
            true => read_range(&item, "range").map(|range| range.map(turn)),
            false => None,
        };
        // MuJoCo bounds the whole rotation: that is at least the swing and at least the twist
        let ball_range = (limited && !single && reader.limits).then(|| read_range(&item, "range")).flatten();
        // no rotation is above π
        let ball_range = ball_range.map(|[_, most]| reader.compiler.angle(most).min(std::f64::consts::PI));
        if ball_range.is_some() {
            reader
                .notes
                .add(&element, "the limit of a ball joint's rotation becomes one of its swing, and one of its twist");
        }
        let rest = turn(item.number("springref", Bound::ANY, 0.0));
        let stiffness = if reader.springs { first("stiffness") } else { 0.0 };
        let dof = DofSettings {
            limits,
            damping: if reader.dampers { first("damping") } else { 0.0 },
            friction: if reader.friction { number("frictionloss") } else { 0.0 },
            spring: (stiffness > 0.0).then_some(Spring { stiffness, rest: if single { rest } else { 0.0 } }),
            ..DofSettings::default()
        };
        let clamped = item.limited("actuatorfrclimited", "actuatorfrcrange", reader.compiler.autolimits);
        JointItem {
            name: item.name(),
            element,
            kind,
            anchor: frame.transform_point(&Vec3::from(item.numbers("pos").unwrap_or([0.0; 3])).into()).coords,
            axis: frame.rotation * axis,
            dof,
            ball_range,
            armature: number("armature"),
            reference: if single { turn(item.number("ref", Bound::ANY, 0.0)) } else { 0.0 },
            spring_rest: rest,
            spring_damper: item.numbers("springdamper").filter(|pair| single && pair.iter().all(|x| *x > 0.0)),
            actuator_range: if clamped { read_range(&item, "actuatorfrcrange") } else { None },
        }
    }

    fn free(element: Element<'a, 'a>) -> JointItem<'a> {
        JointItem {
            name: element.text("name").map(super::defaults::cleaned),
            element,
            kind: Kind::Free,
            anchor: Vec3::zeros(),
            axis: Vec3::z(),
            dof: DofSettings::default(),
            ball_range: None,
            armature: 0.0,
            reference: 0.0,
            spring_rest: 0.0,
            spring_damper: None,
            actuator_range: None,
        }
    }

    /// Returns the joint of the engine.
    pub(super) fn joint(&self) -> Joint {
        match self.kind {
            Kind::Free => Joint::Floating,
            Kind::Ball => Joint::Spherical,
            Kind::Slide => Joint::Prismatic { axis: self.axis },
            Kind::Hinge => Joint::Revolute { axis: self.axis },
        }
    }

    /// Returns whether it has one degree of freedom.
    pub(super) fn is_single(&self) -> bool {
        matches!(self.kind, Kind::Slide | Kind::Hinge)
    }
}

/// Reads two numbers in order, if present and valid.
pub(super) fn read_range(item: &super::defaults::Item<'_>, name: &str) -> Option<[f64; 2]> {
    let element = item.at(name)?;
    let [low, high] = element.numbers(name, Bound::ANY)?;
    if low > high {
        element.wrong(name, "two numbers, the lower first");
    }
    Some([low, high])
}

//! `[[loop_joint]]`: a joint between two parts of any objects. It may close a loop.

use tumble_core::articulated::{DofSettings, Spring};
use tumble_core::collide::{Pose, Vec3};
use tumble_core::{Joint, LoopJointKind};

use crate::parse::ball_joint::{TWIST, check_twist, read_cone};
use crate::parse::body::read_name;
use crate::parse::bound::Bound;
use crate::parse::fields::{Fields, Value};
use crate::parse::joint::{JointSpec, number, read_limits};
use crate::parse::rotation;
use std::f64::consts::TAU;

/// A part of an object in the description.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PartSpec {
    /// A body, by its index in [`SceneFile::bodies`](crate::SceneFile::bodies).
    Body(usize),
    /// A link of an articulated body, by both indices.
    Link(usize, usize),
}

/// One loop joint, all references resolved. It joins its sides as they stand at time 0.
#[derive(Clone, Debug, PartialEq)]
pub struct LoopJointSpec {
    /// Unique in the scene, bodies included.
    pub name: String,
    /// Which motion it leaves free.
    pub kind: LoopJointKind,
    /// One side; `None`, only with `anchors`, is the world.
    pub a: Option<PartSpec>,
    /// The other side; `None` is the world.
    pub b: Option<PartSpec>,
    /// Frames of the joint in the frames of its two bodies or links, or in the world; instead of
    /// positions and axes.
    pub anchors: Option<[Pose; 2]>,
    /// Frames in the world at which gears and racks have position 0, with `anchors`.
    pub references: [Pose; 2],
    /// Position of the joint, world axes at time 0, m; for kinds with a length its end on `a`.
    pub position_m: [f64; 3],
    /// Its end on `b` for kinds with a length, world axes at time 0, m.
    pub second_position_m: Option<[f64; 3]>,
    /// Unit axis of kinds that have one, world axes at time 0.
    pub axis: [f64; 3],
    /// Axis of a universal joint that is fixed to `b`, axis of the second gear, direction of a rack; world
    /// axes at time 0.
    pub second_axis: Option<[f64; 3]>,
    /// Points of the world over which the rope of a pulley runs, m.
    pub ground_m: [[f64; 3]; 2],
    /// Numbers of teeth of two gears, not 0; negative for inner teeth.
    pub teeth: [i32; 2],
    /// Displacement of a rack per radian of its pinion, m, not 0.
    pub radius_m: f64,
    /// Displacement of a screw per turn, m, not 0.
    pub pitch_m: f64,
    /// Weight of the side of `b` in the length of a pulley. Default 1.
    pub ratio: f64,
    /// Length of a distance, a rope, a spring or a pulley, m. Default: that at time 0.
    pub length_m: Option<f64>,
    /// Settings of its degrees of freedom, in the order of [`LoopJointKind::dofs`].
    pub dofs: Vec<LoopDofSpec>,
    /// Largest swing of a spherical joint, rad.
    pub cone_rad: Option<f64>,
    /// Limits of the twist of a spherical joint, rad.
    pub twist_limits_rad: Option<[f64; 2]>,
    /// Angle at time 0 of a revolute joint that counts its turns, rad: of its frames, that nearest to this number. Default: within
    /// half a turn of the middle of its limits.
    pub angle_rad: Option<f64>,
    /// Force above which it breaks, N. Default infinite.
    pub breaking_force_n: f64,
    /// Torque above which it breaks, N·m. Default infinite.
    pub breaking_torque_n_m: f64,
    /// Takes part in the simulation; a broken joint does not. Default true.
    pub enabled: bool,
}

/// One degree of freedom of a loop joint.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LoopDofSpec {
    /// Limits, damping, friction, spring, drive, effort and velocity limit.
    pub settings: DofSettings,
    /// Inertia of its rotor, kg·m² or kg, at least 0.
    pub armature: f64,
    /// Whether a position drive without a target holds the initial position.
    pub(crate) holds_start: bool,
}

/// Looks up the parts that a loop joint or a pair names.
pub(crate) trait Parts {
    /// Returns the part of that name: `body`, or `object/link`.
    fn part(&self, name: &str) -> Option<PartSpec>;
    /// Returns the joint that moves a link, that of its carrier for a fixed one; `None` for a body and a link on the base.
    fn moving_joint(&self, part: &PartSpec) -> Option<&JointSpec>;
    /// Returns the joint between a link and its parent; `None` for a body.
    fn own_joint(&self, part: &PartSpec) -> Option<&JointSpec>;
    /// Returns the index of the articulated body of that name.
    fn articulated(&self, name: &str) -> Option<usize>;
    /// Returns whether the root of an articulated body floats.
    fn floats(&self, articulated: usize) -> bool;
    /// Returns all names, for messages.
    fn names(&self) -> Vec<String>;

    /// Returns the sides that `a` and `b` name; reports an unknown name and two equal sides.
    /// `expected` says what `b` may be.
    fn sides<T: Copy + PartialEq>(
        &self,
        f: &Fields<'_>,
        [a, b]: [Option<(&str, &Value<'_>)>; 2],
        find: impl Fn(&str) -> Option<T>,
        expected: &str,
    ) -> [Option<T>; 2] {
        let side = |key: &str, given: Option<(&str, &Value<'_>)>| {
            let (name, value) = given?;
            let found = find(name);
            if found.is_none() {
                f.unknown_name(key, value, name, self.names().iter().map(String::as_str).collect());
            }
            found
        };
        let sides = [side("a", a), side("b", b)];
        if let ([Some(first), Some(second)], Some((_, value))) = (sides, b)
            && first == second
        {
            f.wrong("b", value, expected);
        }
        sides
    }
}

impl LoopJointSpec {
    pub(crate) fn read(mut f: Fields<'_>, parts: &impl Parts) -> Option<LoopJointSpec> {
        let name = read_name(&mut f).unwrap_or_default();
        let Some(kind) = f.choice("type", LoopJointKind::NAMES) else {
            f.give_up();
            return None;
        };
        let (anchors, references) = (read_frames(&mut f, ["anchor_a", "anchor_b"]), ["reference_a", "reference_b"]);
        let references = anchors.and_then(|_| read_frames(&mut f, references));
        let (referred, references) = (references.is_some(), references.unwrap_or([Pose::identity(); 2]));
        let placed = anchors.is_none();
        let b = f.optional_text("b");
        let a = match f.optional_text("a") {
            None if placed || b.is_none() => f.text("a", "the name of a body, or \"OBJECT/LINK\""),
            a => a,
        };
        let position_m = if placed { f.vector("position_m", Bound::ANY) } else { [0.0; 3] };
        let second_position_m = (placed && kind.has_length()).then(|| f.vector("second_position_m", Bound::ANY));
        let axis = match kind {
            LoopJointKind::Spherical if placed => f.direction_or("axis", [0.0, 0.0, 1.0]),
            _ if placed && kind.has_axis() => f.direction("axis"),
            _ => [0.0, 0.0, 1.0],
        };
        let second_axis = match kind {
            _ if !placed => None,
            LoopJointKind::Universal | LoopJointKind::Rack => Some(f.direction("second_axis")),
            LoopJointKind::Planar | LoopJointKind::Spherical => {
                let x = f.value("second_axis").map(|value| f.as_direction("second_axis", value));
                if let (Some(true), Some(value)) = (x.map(|x| x == [0.0; 3]), f.value("second_axis")) {
                    f.wrong("second_axis", value, "a direction: a vector that is not zero");
                }
                x
            }
            LoopJointKind::Gear => Some(f.direction_or("second_axis", axis)),
            _ => None,
        };
        let pulley = kind == LoopJointKind::Pulley;
        let ground_m = ["ground_position_m", "second_ground_position_m"]
            .map(|key| if pulley { f.vector(key, Bound::ANY) } else { [0.0; 3] });
        let ratio = if pulley { f.number_or("ratio", Bound::POSITIVE, 1.0) } else { 1.0 };
        let teeth = if kind == LoopJointKind::Gear { read_teeth(&mut f) } else { [1; 2] };
        let radius_m = if kind == LoopJointKind::Rack { read_not_zero(&mut f, "radius_m") } else { 1.0 };
        let pitch_m = if kind == LoopJointKind::Screw { read_not_zero(&mut f, "pitch_m") } else { 1.0 };
        let length_m = match kind.has_length() {
            true if placed || (pulley && referred) => f.optional_number("length_m", Bound::NOT_NEGATIVE),
            true => Some(f.number("length_m", Bound::NOT_NEGATIVE)),
            false => None,
        };
        let spherical = kind == LoopJointKind::Spherical;
        let cone_rad = spherical.then(|| read_cone(&mut f)).flatten();
        let twist = spherical.then(|| read_limits(&mut f, TWIST));
        let twist_limits_rad = twist.flatten().flatten();
        if spherical {
            check_twist(&mut f);
        }
        let dofs = read_dofs(&mut f, kind, Vec3::from(axis));
        let length = length_m.or_else(|| length_at_start(kind, position_m, second_position_m?, ground_m, ratio));
        let limits = dofs.first().and_then(|dof| dof.settings.limits);
        if let (Some(limits), Some(length), Some(value)) = (limits, length, f.value("limits_m"))
            && kind.limits_fault(limits, length).is_some()
        {
            let keeps = if kind == LoopJointKind::Distance { "keeps" } else { "allows at most" };
            f.wrong(
                "limits_m",
                value,
                format!("limits from 0 that allow the length which the joint {keeps}, {length} m"),
            );
        }
        let angle_rad = read_turn(&mut f, kind, limits);
        let breaking_force_n = f.number_or("breaking_force_n", Bound::POSITIVE, f64::INFINITY);
        let breaking_torque_n_m = f.number_or("breaking_torque_n_m", Bound::POSITIVE, f64::INFINITY);
        let enabled = f.flag_or("enabled", true);
        let expected = "a part other than `a`; or no `b`, which is the world";
        let sides = parts.sides(&f, [a, b], |name| parts.part(name), expected);
        refuse_foreign(&mut f, kind);
        f.finish();
        Some(LoopJointSpec {
            name,
            kind,
            a: if a.is_some() { Some(sides[0]?) } else { None },
            b: sides[1],
            anchors,
            references,
            position_m,
            second_position_m,
            axis,
            second_axis,
            ground_m,
            teeth,
            radius_m,
            pitch_m,
            ratio,
            length_m,
            dofs,
            cone_rad,
            twist_limits_rad,
            angle_rad,
            breaking_force_n,
            breaking_torque_n_m,
            enabled,
        })
    }
}

/// Reads the angle at time 0 of a joint that counts its turns.
fn read_turn(f: &mut Fields<'_>, kind: LoopJointKind, limits: Option<[f64; 2]>) -> Option<f64> {
    if kind != LoopJointKind::Revolute {
        return None;
    }
    let angle = number(f, ("angle_rad", Some("angle_deg")))?;
    let counts = kind.counts_turns(limits);
    let key = if f.value("angle_rad").is_some() { "angle_rad" } else { "angle_deg" };
    if let (false, Some(value)) = (counts, f.value(key)) {
        f.wrong(key, value, "none: a joint counts turns if its limits are more than 3π/2 apart, or on one side");
    }
    Some(angle)
}

/// Returns the length of a joint that has that of its placement, m.
fn length_at_start(kind: LoopJointKind, a: [f64; 3], b: [f64; 3], ground: [[f64; 3]; 2], ratio: f64) -> Option<f64> {
    let distance = |a: [f64; 3], b: [f64; 3]| (Vec3::from(a) - Vec3::from(b)).norm();
    match kind {
        LoopJointKind::Pulley => Some(distance(a, ground[0]) + ratio * distance(b, ground[1])),
        _ => kind.has_length().then(|| distance(a, b)),
    }
}

/// Reads two poses, if either key is present; an absent one is the identity.
fn read_frames(f: &mut Fields<'_>, keys: [&'static str; 2]) -> Option<[Pose; 2]> {
    let frames = keys.map(|key| {
        let mut table = f.table(key, "{ position_m = [0, 0, 1] }")?;
        let pose = rotation::read_pose(&mut table);
        table.finish();
        Some(pose)
    });
    frames.iter().any(Option::is_some).then(|| frames.map(|frame| frame.unwrap_or_else(Pose::identity)))
}

/// Reads the settings of the degrees of freedom of a joint: the keys of the joint are those of the first one, of a
/// spherical joint those of all, and each table `dof` has those of one of them.
fn read_dofs(f: &mut Fields<'_>, kind: LoopJointKind, axis: Vec3) -> Vec<LoopDofSpec> {
    let count = kind.dofs();
    let spherical = kind == LoopJointKind::Spherical;
    let of = |k: usize| match kind.turns_at(k) {
        _ if spherical => JointSpec::new("", Joint::Spherical),
        true => JointSpec::new("", Joint::Revolute { axis }),
        false => JointSpec::new("", Joint::Prismatic { axis }),
    };
    let mut joints: Vec<JointSpec> = (0..count).map(of).collect();
    if kind == LoopJointKind::Spring {
        let stiffness = f.number("stiffness_n_per_m", Bound::NOT_NEGATIVE);
        joints[0].dof.spring = Some(Spring { stiffness, rest: 0.0 });
    }
    let springs = kind != LoopJointKind::Spring;
    if let Some(first) = joints.first_mut() {
        first.read_loop_dof(f, springs, kind.has_length(), spherical);
        check_angle(f, kind, 0);
    }
    if spherical {
        let first = joints[0].clone();
        let own = |k: usize| first.dofs.get(k).unwrap_or(&first.dof).clone();
        joints = (0..count).map(|k| JointSpec { dof: own(k), dofs: Vec::new(), ..first.clone() }).collect();
    }
    let tables = if count > 1 { f.tables("dof", count) } else { Vec::new() };
    for ((k, joint), mut table) in joints.iter_mut().enumerate().zip(tables) {
        joint.read_loop_dof(&mut table, springs, kind.has_length(), false);
        check_angle(&mut table, kind, k);
        table.finish();
    }
    let spec = |JointSpec { dof, armature, holds_start, .. }| LoopDofSpec { settings: dof, armature, holds_start };
    joints.into_iter().map(spec).collect()
}

/// Reports limits of an angle that its joint cannot follow.
fn check_angle(f: &mut Fields<'_>, kind: LoopJointKind, k: usize) {
    if kind == LoopJointKind::Spherical || !kind.turns_at(k) {
        return;
    }
    let revolute = kind == LoopJointKind::Revolute;
    let expected = match revolute {
        true => "limits at most 2π (360°) apart, or -inf or inf on one side: a revolute joint counts turns only there",
        false => "limits at most 3π/2 (270°) apart: only a revolute joint follows its angle",
    };
    for (key, turn) in [("limits_rad", TAU), ("limits_deg", 360.0)] {
        let Some(value) = f.value(key) else { continue };
        if value.get_ref().as_bool() == Some(false) {
            continue;
        }
        let problems = f.log.count();
        let [lower, upper]: [f64; 2] = f.as_vector(key, value, Bound::LIMIT);
        let span = upper - lower;
        let fine = if revolute { span.is_infinite() || span <= turn + 1e-9 } else { span <= 0.75 * turn };
        if f.log.count() == problems && lower <= upper && !fine {
            f.wrong(key, value, expected);
        }
    }
}

/// Keys that not all kinds have, with the names of their parameters in [`LoopJointKind::has`].
const OF_SOME_KINDS: [(&str, &str); 30] = [
    ("second_position_m", "second_point"),
    ("second_axis", "second_axis"),
    ("length_m", "length"),
    ("teeth", "teeth"),
    ("radius_m", "radius"),
    ("pitch_m", "pitch"),
    ("ratio", "ratio"),
    ("ground_position_m", "ground"),
    ("second_ground_position_m", "ground"),
    ("cone_rad", "cone"),
    ("cone_deg", "cone"),
    ("twist_limits_rad", "twist_limits"),
    ("twist_limits_deg", "twist_limits"),
    ("angle_rad", "angle"),
    ("angle_deg", "angle"),
    ("limits_rad", "limits"),
    ("limits_deg", "limits"),
    ("limits_m", "limits"),
    ("drive", "drive"),
    ("spring", "stiffness"),
    ("damping_n_m_s_per_rad", "damping"),
    ("damping_n_s_per_m", "damping"),
    ("friction_n_m", "friction"),
    ("friction_n", "friction"),
    ("max_velocity_rad_per_s", "max_velocity"),
    ("max_velocity_m_per_s", "max_velocity"),
    ("effort_n_m", "effort"),
    ("effort_n", "effort"),
    ("armature_kg_m2", "armature"),
    ("armature_kg", "armature"),
];

/// Reports keys that joints of a kind do not have.
fn refuse_foreign(f: &mut Fields<'_>, kind: LoopJointKind) {
    for (key, parameter) in OF_SOME_KINDS.into_iter().filter(|(_, parameter)| !kind.has(parameter)) {
        let Some(value) = f.unread(key) else { continue };
        if (kind, parameter) == (LoopJointKind::Spherical, "limits") {
            f.wrong(key, value, "`cone_rad` and `twist_limits_rad`: a spherical joint has these instead");
            continue;
        }
        let types = LoopJointKind::names_with(parameter).join(", ");
        f.wrong(key, value, format!("no `{key}` of type \"{}\"; types with it: {types}", kind.name()));
    }
}

/// Reads the numbers of teeth of two gears.
fn read_teeth(f: &mut Fields<'_>) -> [i32; 2] {
    const EXPECTED: &str = "two whole numbers of teeth, such as [20, 45]; negative for inner teeth";
    let Some(value) = f.required("teeth", EXPECTED) else { return [1; 2] };
    let problems = f.log.count();
    let teeth: [f64; 2] = f.as_vector("teeth", value, Bound::ANY);
    if teeth.iter().any(|n| n.fract() != 0.0 || *n == 0.0 || n.abs() > 1e6) && f.log.count() == problems {
        f.wrong("teeth", value, EXPECTED);
    }
    teeth.map(|n| n as i32)
}

/// Reads a required number other than 0.
fn read_not_zero(f: &mut Fields<'_>, key: &'static str) -> f64 {
    let Some(value) = f.required(key, "a number of meters other than 0") else { return 1.0 };
    let problems = f.log.count();
    let number = f.as_number(key, value, Bound::ANY);
    if number == 0.0 && f.log.count() == problems {
        f.wrong(key, value, "a number of meters other than 0");
    }
    number
}

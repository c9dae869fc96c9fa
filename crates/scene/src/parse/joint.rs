//! The joint of a link: its type, initial state, limits, damping, friction, spring and drive. Keys
//! have units, so those of a revolute joint differ from those of a prismatic one.

use std::sync::Arc;

use tumble_core::Joint;
use tumble_core::articulated::{DofSettings, Drive, Playback, Spring};
use tumble_core::collide::Vec3;

use crate::parse::bound::Bound;
use crate::parse::fields::{Fields, Names, Value};
use crate::parse::rotation;

/// Largest number of samples of a recorded motion.
const MAX_SAMPLES: usize = 100_000;

/// A joint at time 0.
#[derive(Clone, Debug, PartialEq)]
pub struct JointSpec {
    /// The name: its own, in a scene without one that of the link it moves.
    pub name: String,
    /// The type of joint; its axis has unit length.
    pub kind: Joint,
    /// Settings of each of its degrees of freedom, of those without settings in `dofs`.
    pub dof: DofSettings,
    /// Settings of the three degrees of freedom of a spherical joint, if they differ; otherwise empty.
    pub dofs: Vec<DofSettings>,
    /// The joint whose position this one follows.
    pub mimic: Option<MimicSpec>,
    /// Position numbers at time 0, as defined by [`Joint`].
    pub position: Vec<f64>,
    /// Velocity numbers at time 0.
    pub velocity: Vec<f64>,
    /// Cone of a spherical joint: 0, 1 or 2 for axis x, y or z of its frame, and half angle, rad.
    pub cone: Option<(usize, f64)>,
    /// Limits of the twist of a spherical joint: 0, 1 or 2 for axis x, y or z of the link, and the limits, rad.
    pub twist_limits: Option<(usize, [f64; 2])>,
    /// Inertia of its rotor, kg·m² or kg, at least 0; 0 unless it has one degree of freedom.
    pub armature: f64,
    /// Largest speed that a URDF states, rad/s or m/s. It is the velocity limit if its options ask for that.
    pub speed: Option<f64>,
    /// Whether a position drive without a target holds the initial position.
    pub(crate) holds_start: bool,
    /// The same of each of `dofs`.
    pub(crate) dofs_hold_start: Vec<bool>,
}

/// `q = multiplier·q_of + offset`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MimicSpec {
    /// Index of the link whose joint is followed.
    pub link: usize,
    /// Ratio.
    pub multiplier: f64,
    /// rad or m.
    pub offset: f64,
}

#[derive(Clone, Copy)]
enum Kind {
    Fixed,
    Revolute,
    Prismatic,
    Spherical,
}

const KINDS: Names<Kind> = &[
    ("revolute", Kind::Revolute),
    ("prismatic", Kind::Prismatic),
    ("spherical", Kind::Spherical),
    ("fixed", Kind::Fixed),
];

#[derive(Clone, Copy)]
enum DriveKind {
    Position,
    Velocity,
    Playback,
}

const DRIVE_KINDS: Names<DriveKind> =
    &[("position", DriveKind::Position), ("velocity", DriveKind::Velocity), ("playback", DriveKind::Playback)];

/// A key in SI units, and for angles the key in degrees.
pub(crate) type Key = (&'static str, Option<&'static str>);

/// The keys of a joint with one degree of freedom.
struct JointKeys {
    start: Key,
    rate: &'static str,
    limits: Key,
    damping: &'static str,
    friction: &'static str,
    max_velocity: &'static str,
    effort: &'static str,
    armature: &'static str,
    stiffness: &'static str,
    rest: Key,
    target: Key,
    target_rate: &'static str,
    limit: &'static str,
    values: Key,
    offset: Key,
}

const REVOLUTE_KEYS: JointKeys = JointKeys {
    start: ("angle_rad", Some("angle_deg")),
    rate: "rate_rad_per_s",
    limits: ("limits_rad", Some("limits_deg")),
    damping: "damping_n_m_s_per_rad",
    friction: "friction_n_m",
    max_velocity: "max_velocity_rad_per_s",
    effort: "effort_n_m",
    armature: "armature_kg_m2",
    stiffness: "stiffness_n_m_per_rad",
    rest: ("rest_rad", Some("rest_deg")),
    target: ("target_rad", Some("target_deg")),
    target_rate: "target_rad_per_s",
    limit: "max_torque_n_m",
    values: ("values_rad", Some("values_deg")),
    offset: ("offset_rad", Some("offset_deg")),
};

const PRISMATIC_KEYS: JointKeys = JointKeys {
    start: ("displacement_m", None),
    rate: "rate_m_per_s",
    limits: ("limits_m", None),
    damping: "damping_n_s_per_m",
    friction: "friction_n",
    max_velocity: "max_velocity_m_per_s",
    effort: "effort_n",
    armature: "armature_kg",
    stiffness: "stiffness_n_per_m",
    rest: ("rest_m", None),
    target: ("target_m", None),
    target_rate: "target_m_per_s",
    limit: "max_force_n",
    values: ("values_m", None),
    offset: ("offset_m", None),
};

impl JointSpec {
    /// Returns a joint of that type at rest, without limits, damping, friction, spring and drive.
    pub fn new(name: impl Into<String>, kind: Joint) -> JointSpec {
        let mut position = vec![0.0; kind.positions()];
        if let Some(k) = kind.quaternion() {
            position[k + 3] = 1.0;
        }
        let velocity = vec![0.0; kind.dof()];
        let dof = DofSettings::default();
        JointSpec {
            name: name.into(),
            kind,
            dof,
            dofs: Vec::new(),
            mimic: None,
            position,
            velocity,
            cone: None,
            twist_limits: None,
            armature: 0.0,
            speed: None,
            holds_start: false,
            dofs_hold_start: Vec::new(),
        }
    }

    /// Returns whether the joint has exactly one degree of freedom.
    pub fn is_single(&self) -> bool {
        self.kind.dof() == 1
    }

    fn keys(&self) -> &'static JointKeys {
        if matches!(self.kind, Joint::Prismatic { .. }) { &PRISMATIC_KEYS } else { &REVOLUTE_KEYS }
    }

    /// Reads `joint`, its axis and its settings from the table of a link.
    pub(crate) fn read(f: &mut Fields<'_>, name: &str) -> Option<JointSpec> {
        let kind = f.choice("joint", KINDS)?;
        let axis = |f: &mut Fields<'_>| Vec3::from(f.direction("axis"));
        let kind = match kind {
            Kind::Fixed => Joint::Fixed,
            Kind::Revolute => Joint::Revolute { axis: axis(f) },
            Kind::Prismatic => Joint::Prismatic { axis: axis(f) },
            Kind::Spherical => Joint::Spherical,
        };
        let own = f.optional_text("joint_name").map(|(own, _)| own);
        let mut joint = JointSpec::new(own.unwrap_or(name), kind);
        joint.read_effects(f);
        Some(joint)
    }

    /// Reads the initial state and the settings. Keys that are absent change nothing.
    pub(crate) fn read_effects(&mut self, f: &mut Fields<'_>) {
        let keys = self.keys();
        match self.kind {
            Joint::Spherical => {
                self.read_settings(f, true, true);
                self.armature = f.number_or(keys.armature, Bound::NOT_NEGATIVE, self.armature);
                self.read_swing_and_twist(f);
                self.read_spherical_start(f);
                self.read_own_dofs(f);
            }
            _ if self.is_single() => {
                if let Some(position) = number(f, keys.start) {
                    self.position = vec![position];
                }
                self.velocity[0] = f.number_or(keys.rate, Bound::ANY, self.velocity[0]);
                self.armature = f.number_or(keys.armature, Bound::NOT_NEGATIVE, self.armature);
                self.read_settings(f, true, false);
            }
            _ if self.kind.dof() > 0 => self.read_resistance(f, keys),
            _ => {}
        }
    }

    fn read_resistance(&mut self, f: &mut Fields<'_>, keys: &'static JointKeys) {
        if let Some(damping) = f.optional_number(keys.damping, Bound::NOT_NEGATIVE) {
            self.each(|_, dof| dof.damping = damping);
        }
        if let Some(friction) = f.optional_number(keys.friction, Bound::NOT_NEGATIVE) {
            self.each(|_, dof| dof.friction = friction);
        }
        if let Some(most) = f.optional_number(keys.max_velocity, Bound::POSITIVE) {
            self.each(|_, dof| dof.max_velocity = most);
        }
    }

    /// Changes the settings of each degree of freedom, by its number.
    fn each(&mut self, change: impl Fn(usize, &mut DofSettings)) {
        change(0, &mut self.dof);
        self.dofs.iter_mut().enumerate().for_each(|(k, dof)| change(k, dof));
    }

    /// Gives each degree of freedom settings of its own if the components of a vector differ.
    fn part_by(&mut self, [x, y, z]: [f64; 3]) {
        if self.dofs.is_empty() && (x != y || x != z) {
            self.dofs = vec![self.dof.clone(); 3];
        }
    }

    /// Reads the settings of a degree of freedom of a loop joint: its spring if `springs`, its armature unless it is a
    /// length. With `vectors` they are those of all axes of a spherical joint. Keys that are absent change nothing.
    pub(crate) fn read_loop_dof(&mut self, f: &mut Fields<'_>, springs: bool, length: bool, vectors: bool) {
        if !length {
            self.armature = f.number_or(self.keys().armature, Bound::NOT_NEGATIVE, self.armature);
        }
        self.read_settings(f, springs, vectors);
    }

    /// Returns the settings of each of its degrees of freedom.
    pub(crate) fn dofs(&self) -> Vec<DofSettings> {
        let of = |k: usize| {
            let own = self.dofs.get(k).unwrap_or(&self.dof);
            let cone = self.cone.filter(|(axis, _)| *axis == k).map(|(_, cone)| [0.0, cone]);
            let twist_limits = self.twist_limits.filter(|(axis, _)| *axis == k).map(|(_, limits)| limits);
            DofSettings { limits: own.limits.or(cone), twist_limits: own.twist_limits.or(twist_limits), ..own.clone() }
        };
        (0..self.kind.dof()).map(of).collect()
    }

    fn read_spherical_start(&mut self, f: &mut Fields<'_>) {
        if let Some(q) = rotation::axis_angle(f, "initial_rotation") {
            self.position = q.to_vec();
        }
        if let Some(w) = f.optional_vector::<3>("angular_velocity_rad_per_s", Bound::ANY) {
            self.velocity = w.to_vec();
        }
    }

    /// Reads the settings of a joint with one degree of freedom, or those of a degree of freedom of a spherical one without limits;
    /// its spring if `springs`. With `vectors` they are those of all axes of a spherical joint, and rest positions and targets may have
    /// one number for each. Keys that are absent change nothing.
    pub(crate) fn read_settings(&mut self, f: &mut Fields<'_>, springs: bool, vectors: bool) {
        let keys = self.keys();
        self.read_resistance(f, keys);
        if let Some(limits) = self.is_single().then(|| read_limits(f, keys.limits)).flatten() {
            self.dof.limits = limits;
        }
        if let Some(effort) = f.optional_number(keys.effort, Bound::POSITIVE) {
            self.each(|_, dof| dof.effort = effort);
        }
        let example = format!("{{ {} = 10 }}", keys.stiffness);
        if let Some(mut spring) = springs.then(|| f.table("spring", &example)).flatten() {
            let stiffness = spring.number(keys.stiffness, Bound::NOT_NEGATIVE);
            let rest = components(&mut spring, keys.rest, vectors).unwrap_or([0.0; 3]);
            spring.finish();
            self.part_by(rest);
            self.each(|k, dof| dof.spring = Some(Spring { stiffness, rest: rest[k] }));
        }
        if let Some(drive) = f.table("drive", &format!("{{ type = \"position\", {} = 100 }}", keys.stiffness)) {
            self.read_drive(drive, keys, vectors);
        }
    }

    fn read_drive(&mut self, mut f: Fields<'_>, keys: &'static JointKeys, vectors: bool) {
        let Some(motor) = f.choice("type", DRIVE_KINDS) else { return f.give_up() };
        let most = self.dof.effort;
        self.holds_start = false;
        self.dofs_hold_start.clear();
        match motor {
            DriveKind::Position => {
                let stiffness = f.number_or(keys.stiffness, Bound::NOT_NEGATIVE, 0.0);
                let damping = f.number_or(keys.damping, Bound::NOT_NEGATIVE, 0.0);
                if stiffness + damping == 0.0 {
                    let message = format!("{} has no stiffness and no damping", f.what);
                    f.log.report(
                        f.span.clone(),
                        message,
                        format!("expected `{}` or `{}` greater than 0", keys.stiffness, keys.damping),
                    );
                }
                let target = components(&mut f, keys.target, vectors);
                self.holds_start = target.is_none();
                let target = target.unwrap_or([0.0; 3]);
                let velocity = components(&mut f, (keys.target_rate, None), vectors).unwrap_or([0.0; 3]);
                let limit = read_most(&mut f, keys.limit, most);
                self.part_by(target);
                self.part_by(velocity);
                self.each(|k, dof| {
                    let (target, velocity) = (target[k], velocity[k]);
                    dof.drive = Drive::Position { stiffness, damping, target, velocity, limit };
                });
            }
            DriveKind::Velocity => {
                let target = match components(&mut f, (keys.target_rate, None), vectors) {
                    Some(target) => target,
                    None => [f.number(keys.target_rate, Bound::ANY); 3],
                };
                let limit = read_most(&mut f, keys.limit, most);
                self.part_by(target);
                self.each(|k, dof| dof.drive = Drive::Velocity { target: target[k], limit });
            }
            DriveKind::Playback => {
                let limit = read_most(&mut f, keys.limit, most);
                let drive = read_playback(&mut f, keys.values)
                    .map(|motion| Drive::Playback { motion: Arc::new(motion), limit })
                    .unwrap_or_default();
                self.each(|_, dof| dof.drive = drive.clone());
            }
        }
        f.finish();
    }

    /// Reads `mimic`. Returns the name of the joint to follow and its place in the file; the index
    /// of its link is filled in later.
    pub(crate) fn read_mimic<'a>(&mut self, f: &mut Fields<'a>) -> Option<(&'a str, &'a Value<'a>)> {
        if !self.is_single() {
            return None;
        }
        let mut mimic = f.table("mimic", "{ joint = \"NAME\", multiplier = 1 }")?;
        let of = mimic.text("joint", "the name of the link whose joint it follows");
        let multiplier = mimic.number_or("multiplier", Bound::ANY, 1.0);
        let offset = self.read_offset(&mut mimic);
        mimic.finish();
        self.mimic = Some(MimicSpec { link: usize::MAX, multiplier, offset });
        of
    }

    /// Reads the offset of a coupling, rad or m; 0 without one.
    pub(crate) fn read_offset(&self, f: &mut Fields<'_>) -> f64 {
        number(f, self.keys().offset).unwrap_or(0.0)
    }

    /// Sets the target of a position drive without a target to the position at time 0, of a spherical joint to the rotation vector.
    pub(crate) fn settle(&mut self) {
        if self.kind == Joint::Spherical {
            return self.settle_rotation();
        }
        if let (true, Drive::Position { target, .. }, Some(start)) =
            (self.holds_start, &mut self.dof.drive, self.position.first())
        {
            *target = *start;
        }
    }
}

/// Reads a number in SI units or degrees, if either key is present.
pub(crate) fn number(f: &mut Fields<'_>, (si, degrees): Key) -> Option<f64> {
    let given = f.optional_number(si, Bound::ANY);
    let turned = degrees.and_then(|key| f.optional_number(key, Bound::ANY)).map(f64::to_radians);
    one_of(f, (si, degrees), given, turned)
}

/// Reads one number for all axes or, of a spherical joint as a whole, one for each: in SI units or degrees, if either key is present.
fn components(f: &mut Fields<'_>, (si, degrees): Key, vectors: bool) -> Option<[f64; 3]> {
    let read = |f: &mut Fields<'_>, key: &'static str| {
        let value = f.value(key)?;
        Some(match vectors && value.get_ref().is_array() {
            true => f.as_vector(key, value, Bound::ANY),
            false => [f.as_number(key, value, Bound::ANY); 3],
        })
    };
    let given = read(f, si);
    let turned = degrees.and_then(|key| read(f, key)).map(|angles| angles.map(f64::to_radians));
    one_of(f, (si, degrees), given, turned)
}

/// Reads the largest force of a drive; `false` is none.
fn read_most(f: &mut Fields<'_>, key: &'static str, default: f64) -> f64 {
    match f.value(key) {
        Some(value) if value.get_ref().as_bool() == Some(false) => f64::INFINITY,
        Some(value) => f.as_number(key, value, Bound::NOT_NEGATIVE),
        None => default,
    }
}

/// Returns the value of the one of two alternative keys that is present. Both at once are a
/// problem.
fn one_of<T>(f: &Fields<'_>, (si, degrees): Key, given: Option<T>, turned: Option<T>) -> Option<T> {
    if given.is_some() && turned.is_some() {
        let message = format!("{} has both `{si}` and `{}`", f.what, degrees.unwrap_or_default());
        f.log.report(f.span.clone(), message, "expected one of them");
    }
    given.or(turned)
}

/// Reads limits. `Some(None)` if the file says `false`: no limits.
pub(crate) fn read_limits(f: &mut Fields<'_>, key: Key) -> Option<Option<[f64; 2]>> {
    let mut read = |key: &'static str, scale: f64| {
        let value = f.value(key)?;
        if value.get_ref().as_bool() == Some(false) {
            return Some(None);
        }
        let problems = f.log.count();
        let limits: [f64; 2] = f.as_vector(key, value, Bound::LIMIT);
        let [lower, upper] = limits;
        if f.log.count() == problems && (lower > upper || lower == f64::INFINITY || upper == f64::NEG_INFINITY) {
            f.wrong(key, value, "[lower, upper], the lower first, -inf and inf for none on a side; or false for none");
        }
        Some(Some(limits.map(|x| x * scale)))
    };
    let given = read(key.0, 1.0);
    let turned = key.1.and_then(|key| read(key, std::f64::consts::PI / 180.0));
    one_of(f, key, given, turned)
}

fn read_playback(f: &mut Fields<'_>, key: Key) -> Option<Playback> {
    let problems = f.log.count();
    let times = f.optional_numbers("times_s", Bound::ANY, MAX_SAMPLES);
    let given = f.optional_numbers(key.0, Bound::ANY, MAX_SAMPLES);
    let turned = key.1.and_then(|key| f.optional_numbers(key, Bound::ANY, MAX_SAMPLES));
    let turned = turned.map(|values| values.into_iter().map(f64::to_radians).collect());
    let values = one_of(f, key, given, turned);
    let repeat = f.flag_or("repeat", false);
    if times.is_none() {
        f.missing("times_s", "a list of increasing times");
    }
    if values.is_none() {
        f.missing(key.0, "a list of positions, one for each time");
    }
    if f.log.count() > problems {
        return None;
    }
    let motion = if repeat { Playback::repeating(times?, values?) } else { Playback::new(times?, values?) };
    motion
        .map_err(|error| {
            let message = error.to_string();
            let (wrong, expected) = message.split_once("; ").unwrap_or((message.as_str(), "expected increasing times"));
            f.log.report(f.span.clone(), format!("{}: {wrong}", f.what), expected);
        })
        .ok()
}

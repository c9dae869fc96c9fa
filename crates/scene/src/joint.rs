//! The joint of a link: how it moves and what acts on it. Keys name their units, and those of a hinge are not those of a slider.

use std::sync::Arc;

use tumble_core::Joint;
use tumble_core::articulated::{DofSettings, Drive, Playback, Spring};
use tumble_core::collide::Vec3;

use crate::bound::Bound;
use crate::fields::{Fields, Names, Value};
use crate::rotation;

/// Most samples of a recorded motion.
const MOST_SAMPLES: usize = 100_000;

/// One joint at the start.
#[derive(Clone, Debug, PartialEq)]
pub struct JointSpec {
    /// Name: in a scene that of the link it moves, in a URDF its own.
    pub name: String,
    /// How the link moves; the axis is of unit length.
    pub kind: Joint,
    /// What acts on each of its degrees of freedom.
    pub freedom: DofSettings,
    /// The joint that this one follows.
    pub mimic: Option<MimicSpec>,
    /// Its position numbers at time 0, as [`Joint`] says.
    pub position: Vec<f64>,
    /// Its velocity numbers at time 0.
    pub velocity: Vec<f64>,
    /// Greatest torque or force that its motor has, N·m or N, where a file says so: the limit of a drive that names none.
    pub effort: Option<f64>,
    /// Greatest speed that its file allows, rad/s or m/s. Kept, not enforced.
    pub speed: Option<f64>,
    /// Whether a position drive without a target holds the starting position.
    pub(crate) holds_start: bool,
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
enum Motor {
    Position,
    Velocity,
    Playback,
}

const MOTORS: Names<Motor> =
    &[("position", Motor::Position), ("velocity", Motor::Velocity), ("playback", Motor::Playback)];

/// A key in SI units, and for angles the same in degrees.
type Key = (&'static str, Option<&'static str>);

/// What the keys of a joint with one degree of freedom are called.
struct Words {
    start: Key,
    rate: &'static str,
    limits: Key,
    damping: &'static str,
    friction: &'static str,
    stiffness: &'static str,
    rest: Key,
    target: Key,
    target_rate: &'static str,
    limit: &'static str,
    values: Key,
    offset: Key,
}

const TURN: Words = Words {
    start: ("angle_rad", Some("angle_deg")),
    rate: "rate_rad_per_s",
    limits: ("limits_rad", Some("limits_deg")),
    damping: "damping_n_m_s_per_rad",
    friction: "friction_n_m",
    stiffness: "stiffness_n_m_per_rad",
    rest: ("rest_rad", Some("rest_deg")),
    target: ("target_rad", Some("target_deg")),
    target_rate: "target_rad_per_s",
    limit: "limit_n_m",
    values: ("values_rad", Some("values_deg")),
    offset: ("offset_rad", Some("offset_deg")),
};

const SLIDE: Words = Words {
    start: ("displacement_m", None),
    rate: "rate_m_per_s",
    limits: ("limits_m", None),
    damping: "damping_n_s_per_m",
    friction: "friction_n",
    stiffness: "stiffness_n_per_m",
    rest: ("rest_m", None),
    target: ("target_m", None),
    target_rate: "target_m_per_s",
    limit: "limit_n",
    values: ("values_m", None),
    offset: ("offset_m", None),
};

impl JointSpec {
    /// A joint of that kind at rest, with nothing acting on it.
    pub fn new(name: impl Into<String>, kind: Joint) -> JointSpec {
        let mut position = vec![0.0; kind.positions()];
        if let Some(k) = kind.quaternion() {
            position[k + 3] = 1.0;
        }
        let velocity = vec![0.0; kind.dof()];
        let freedom = DofSettings::default();
        JointSpec {
            name: name.into(),
            kind,
            freedom,
            mimic: None,
            position,
            velocity,
            effort: None,
            speed: None,
            holds_start: false,
        }
    }

    /// Whether it has one degree of freedom, with a position of its own.
    pub fn is_single(&self) -> bool {
        self.kind.dof() == 1
    }

    fn words(&self) -> &'static Words {
        if matches!(self.kind, Joint::Prismatic { .. }) { &SLIDE } else { &TURN }
    }

    /// Reads `joint`, its axis and all that acts on it from the table of a link.
    pub(crate) fn read(f: &mut Fields<'_>, name: &str) -> Option<JointSpec> {
        let kind = f.choice("joint", KINDS)?;
        let axis = |f: &mut Fields<'_>| Vec3::from(f.direction("axis"));
        let kind = match kind {
            Kind::Fixed => Joint::Fixed,
            Kind::Revolute => Joint::Revolute { axis: axis(f) },
            Kind::Prismatic => Joint::Prismatic { axis: axis(f) },
            Kind::Spherical => Joint::Spherical,
        };
        let mut joint = JointSpec::new(name, kind);
        joint.read_effects(f);
        Some(joint)
    }

    /// Reads where the joint starts and what acts on it; what is not there stays.
    pub(crate) fn read_effects(&mut self, f: &mut Fields<'_>) {
        let words = self.words();
        if self.kind.dof() > 0 {
            self.freedom.damping = f.number_or(words.damping, Bound::NOT_NEGATIVE, self.freedom.damping);
            self.freedom.friction = f.number_or(words.friction, Bound::NOT_NEGATIVE, self.freedom.friction);
        }
        match self.kind {
            Joint::Spherical => self.read_spherical_start(f),
            _ if self.is_single() => self.read_single(f, words),
            _ => {}
        }
    }

    fn read_spherical_start(&mut self, f: &mut Fields<'_>) {
        if let Some(q) = rotation::axis_angle(f, "turned") {
            self.position = q.to_vec();
        }
        if let Some(w) = f.optional_vector::<3>("angular_velocity_rad_per_s", Bound::ANY) {
            self.velocity = w.to_vec();
        }
    }

    fn read_single(&mut self, f: &mut Fields<'_>, words: &'static Words) {
        if let Some(position) = number(f, words.start) {
            self.position = vec![position];
        }
        self.velocity[0] = f.number_or(words.rate, Bound::ANY, self.velocity[0]);
        if let Some(limits) = read_limits(f, words.limits) {
            self.freedom.limits = limits;
        }
        let example = format!("{{ {} = 10 }}", words.stiffness);
        if let Some(mut spring) = f.table("spring", &example) {
            let stiffness = spring.number(words.stiffness, Bound::NOT_NEGATIVE);
            let rest = number(&mut spring, words.rest).unwrap_or(0.0);
            spring.finish();
            self.freedom.spring = Some(Spring { stiffness, rest });
        }
        if let Some(drive) = f.table("drive", &format!("{{ type = \"position\", {} = 100 }}", words.stiffness)) {
            self.read_drive(drive, words);
        }
    }

    fn read_drive(&mut self, mut f: Fields<'_>, words: &'static Words) {
        let Some(motor) = f.choice("type", MOTORS) else { return f.give_up() };
        let most = self.effort.unwrap_or(f64::INFINITY);
        self.holds_start = false;
        let drive = match motor {
            Motor::Position => {
                let stiffness = f.number_or(words.stiffness, Bound::NOT_NEGATIVE, 0.0);
                let damping = f.number_or(words.damping, Bound::NOT_NEGATIVE, 0.0);
                if stiffness + damping == 0.0 {
                    let message = format!("{} has no stiffness and no damping", f.what);
                    f.log.report(
                        f.span.clone(),
                        message,
                        format!("wanted `{}` or `{}` greater than 0", words.stiffness, words.damping),
                    );
                }
                let target = number(&mut f, words.target);
                self.holds_start = target.is_none();
                let velocity = f.number_or(words.target_rate, Bound::ANY, 0.0);
                Some(Drive::Position {
                    stiffness,
                    damping,
                    target: target.unwrap_or(0.0),
                    velocity,
                    limit: f.number_or(words.limit, Bound::NOT_NEGATIVE, most),
                })
            }
            Motor::Velocity => {
                let target = f.number(words.target_rate, Bound::ANY);
                Some(Drive::Velocity { target, limit: f.number_or(words.limit, Bound::NOT_NEGATIVE, most) })
            }
            Motor::Playback => {
                let limit = f.number_or(words.limit, Bound::NOT_NEGATIVE, most);
                read_playback(&mut f, words.values).map(|motion| Drive::Playback { motion: Arc::new(motion), limit })
            }
        };
        f.finish();
        self.freedom.drive = drive.unwrap_or_default();
    }

    /// Reads `mimic`: which joint this one follows, by name and as it stands in the file. The index of its link is filled in later.
    pub(crate) fn read_mimic<'a>(&mut self, f: &mut Fields<'a>) -> Option<(&'a str, &'a Value<'a>)> {
        if !self.is_single() {
            return None;
        }
        let mut mimic = f.table("mimic", "{ joint = \"NAME\", multiplier = 1 }")?;
        let of = mimic.text("joint", "the name of the link whose joint it follows");
        let multiplier = mimic.number_or("multiplier", Bound::ANY, 1.0);
        let offset = number(&mut mimic, self.words().offset).unwrap_or(0.0);
        mimic.finish();
        self.mimic = Some(MimicSpec { link: usize::MAX, multiplier, offset });
        of
    }

    /// Lets a position drive without a target hold the position at time 0.
    pub(crate) fn settle(&mut self) {
        if let (true, Drive::Position { target, .. }, Some(start)) =
            (self.holds_start, &mut self.freedom.drive, self.position.first())
        {
            *target = *start;
        }
    }
}

/// A number in SI units or degrees, if either key is there.
fn number(f: &mut Fields<'_>, (si, degrees): Key) -> Option<f64> {
    let given = f.optional_number(si, Bound::ANY);
    let turned = degrees.and_then(|key| f.optional_number(key, Bound::ANY)).map(f64::to_radians);
    one_of(f, (si, degrees), given, turned)
}

/// One of two ways to say the same; both is a problem.
fn one_of<T>(f: &Fields<'_>, (si, degrees): Key, given: Option<T>, turned: Option<T>) -> Option<T> {
    if given.is_some() && turned.is_some() {
        let message = format!("{} has both `{si}` and `{}`", f.what, degrees.unwrap_or_default());
        f.log.report(f.span.clone(), message, "wanted one of them");
    }
    given.or(turned)
}

/// `Some(None)` where the file says `false`: no limits.
fn read_limits(f: &mut Fields<'_>, key: Key) -> Option<Option<[f64; 2]>> {
    let mut read = |key: &'static str, scale: f64| {
        let value = f.value(key)?;
        if value.get_ref().as_bool() == Some(false) {
            return Some(None);
        }
        let problems = f.log.count();
        let limits: [f64; 2] = f.as_vector(key, value, Bound::ANY);
        if limits[0] > limits[1] && f.log.count() == problems {
            f.wrong(key, value, "[lower, upper], the lower first; or false for none");
        }
        Some(Some(limits.map(|x| x * scale)))
    };
    let given = read(key.0, 1.0);
    let turned = key.1.and_then(|key| read(key, std::f64::consts::PI / 180.0));
    one_of(f, key, given, turned)
}

fn read_playback(f: &mut Fields<'_>, key: Key) -> Option<Playback> {
    let problems = f.log.count();
    let times = f.optional_numbers("times_s", Bound::ANY, MOST_SAMPLES);
    let given = f.optional_numbers(key.0, Bound::ANY, MOST_SAMPLES);
    let turned = key.1.and_then(|key| f.optional_numbers(key, Bound::ANY, MOST_SAMPLES));
    let turned = turned.map(|values| values.into_iter().map(f64::to_radians).collect());
    let values = one_of(f, key, given, turned);
    let repeat = f.flag_or("repeat", false);
    if times.is_none() {
        f.missing("times_s", "a list of times that rise");
    }
    if values.is_none() {
        f.missing(key.0, "a list of as many positions as there are times");
    }
    if f.log.count() > problems {
        return None;
    }
    let motion = if repeat { Playback::repeating(times?, values?) } else { Playback::new(times?, values?) };
    motion
        .map_err(|error| {
            let told = error.to_string();
            let (wrong, wanted) = told.split_once("; ").unwrap_or((told.as_str(), "wanted times that rise"));
            f.log.report(f.span.clone(), format!("{}: {wrong}", f.what), wanted);
        })
        .ok()
}

//! `<actuator>`: affine actuators of joints and fixed tendons.
//!
//! With the length `l = m·q` of an actuator and its control `u`,
//!
//! ```text
//! f = g·u + b₀ + b₁·l + b₂·l̇        τ = m·f
//! ```
//!
//! All actuators of one joint that have a `b₁` or `b₂` below 0 become one drive of the joint: stiffness
//! `K = −Σ b₁m²`, damping `D = −Σ b₂m²`, target `Σ m(g·u + b₀)/K`.
//!
//! | symbol | meaning |
//! |---|---|
//! | `q`, `τ` | position and generalized force of the joint |
//! | `m` | moment arm: the gear, times the coefficient of a tendon |
//! | `f` | force of the actuator, within its range |
//! | `g`, `b` | gain and bias |

use std::collections::BTreeMap;

use tumble_core::articulated::Drive;

use super::defaults::{Item, cleaned};
use super::equality::single;
use super::gains::{DefaultGains, Form, Gains};
use super::inertia::Inertias;
use super::joint::read_range;
use super::notes::Ledger;
use super::scene::Assembly;
use super::schema;
use super::source::XmlNode;
use crate::parse::bound::Bound;
use crate::xml::Element;

/// An affine actuator of an articulated body.
#[derive(Clone, Debug, PartialEq)]
pub struct ActuatorSpec {
    /// The name; may be empty.
    pub name: String,
    /// Index into [`SceneFile::articulated`](crate::SceneFile::articulated).
    pub articulated: usize,
    /// Links whose joints it acts on, by their indices, and the moment arm of each: generalized force
    /// per unit of its force.
    pub moments: Vec<(usize, f64)>,
    /// Force per unit of control.
    pub gain: f64,
    /// Force at control 0: constant, per length, per rate of the length.
    pub bias: [f64; 3],
    /// Range that controls are clamped to.
    pub control_range: Option<[f64; 2]>,
    /// Range that the force is clamped to.
    pub force_range: Option<[f64; 2]>,
    /// Control at time 0.
    pub control: f64,
    /// Whether the drive of its joint includes it. Otherwise nothing applies its force unless the
    /// user does.
    pub driven: bool,
}

impl ActuatorSpec {
    /// Returns the force at a length, its rate and a control; the length is the sum of the moment
    /// arms times the positions of the joints.
    pub fn force(&self, length: f64, rate: f64, control: f64) -> f64 {
        let within = |range: Option<[f64; 2]>, x: f64| range.map_or(x, |[low, high]| x.max(low).min(high));
        let [constant, per_length, per_rate] = self.bias;
        let control = within(self.control_range, control);
        within(self.force_range, self.gain * control + constant + per_length * length + per_rate * rate)
    }
}

/// The law of an actuator.
struct Law {
    gain: f64,
    bias: [f64; 3],
    /// Fraction of critical damping instead of `bias[2]`.
    damping_ratio: Option<f64>,
}

/// A joint of a tendon, and its coefficient.
type Arm = (super::equality::Single, f64);

/// Reads all actuators. `controls` are those at time 0.
pub(super) fn read<'a>(root: &XmlNode<'a>, controls: Option<&[f64]>, assembly: &mut Assembly<'_, 'a>) {
    let reader = assembly.reader;
    let tendons = read_tendons(root, assembly);
    let defaults = DefaultGains::of(&reader.classes);
    let mut inertias = Inertias::default();
    let mut drives: BTreeMap<(usize, usize), Vec<usize>> = BTreeMap::new();
    let mut elements = Vec::new();
    for (number, node) in root.all("actuator").flat_map(|section| &section.children).enumerate() {
        let element = node.element;
        let item = reader.classes.item(element, 0);
        let Some(mut spec) = read_one(&item, &tendons, &defaults, &mut inertias, assembly) else { continue };
        let start = controls.and_then(|controls| controls.get(number)).copied().unwrap_or(0.0);
        spec.control = spec.control_range.map_or(start, |[low, high]| start.max(low).min(high));
        let index = assembly.scene.actuators.len();
        if let [(link, _)] = spec.moments[..] {
            drives.entry((spec.articulated, link)).or_default().push(index);
        } else if spec.bias[1] != 0.0 || spec.bias[2] != 0.0 {
            reader.notes.add(&element, "actuators with feedback on tendons over several joints have no drive");
        }
        elements.push(element);
        assembly.scene.actuators.push(spec);
    }
    for ((tree, link), group) in drives {
        drive(tree, link, &group, &elements, assembly);
    }
    for (spec, element) in assembly.scene.actuators.iter().zip(&elements) {
        if !spec.driven && spec.control != 0.0 && spec.gain != 0.0 {
            reader.notes.add(element, "the control of a motor at the start is left out");
        }
        if !spec.driven && spec.bias[0] != 0.0 {
            reader.notes.add(element, "the constant force of an actuator without stiffness and damping is left out");
        }
    }
}

/// Reads fixed tendons: their joints with coefficients.
fn read_tendons(root: &XmlNode<'_>, assembly: &Assembly<'_, '_>) -> BTreeMap<String, Vec<Arm>> {
    let notes = &assembly.reader.notes;
    let mut tendons = BTreeMap::new();
    for node in root.all("tendon").flat_map(|section| &section.children) {
        let element = &node.element;
        let item = assembly.reader.classes.item(*element, 0);
        let passive = ["stiffness", "damping", "frictionloss", "limited", "range", "armature", "springlength"];
        if item.at_any(&passive).is_some() {
            notes.add(element, "springs, damping, friction, limits and armature of tendons are left out");
        }
        if element.tag() != "fixed" {
            notes.add(element, format!("<{}> tendons are left out", cleaned(element.tag())));
            continue;
        }
        let arms: Vec<Option<Arm>> = node
            .all("joint")
            .map(|joint| {
                let coefficient = joint.element.number("coef", Bound::ANY).unwrap_or(1.0);
                Some((single(&joint.element, "joint", assembly, false)?, coefficient))
            })
            .collect();
        let arms: Option<Vec<Arm>> = arms.into_iter().collect();
        if let (Some(name), Some(arms)) = (element.text("name"), arms) {
            tendons.insert(name.to_owned(), arms);
        }
    }
    tendons
}

fn read_one<'a>(
    item: &Item<'a>,
    tendons: &BTreeMap<String, Vec<Arm>>,
    defaults: &DefaultGains<'a>,
    inertias: &mut Inertias,
    assembly: &mut Assembly<'_, 'a>,
) -> Option<ActuatorSpec> {
    let (element, reader) = (item.own(), assembly.reader);
    let notes = &reader.notes;
    let tag = element.tag();
    if !matches!(tag, "general" | "motor" | "position" | "velocity") {
        notes.add(element, format!("<{}> actuators are left out", cleaned(tag)));
        return None;
    }
    schema::ACTUATOR.check(element, notes);
    if !reader.actuation {
        notes.add(element, "actuators are disabled");
        return None;
    }
    let arms: Vec<Arm> = match (item.at("joint").or(item.at("jointinparent")), item.text("tendon")) {
        (Some(at), _) => {
            let attribute = if at.text("joint").is_some() { "joint" } else { "jointinparent" };
            vec![(single(at, attribute, assembly, false)?, 1.0)]
        }
        (None, Some(name)) => match tendons.get(name) {
            Some(arms) => arms.clone(),
            None => {
                notes.add(element, "actuators of tendons that are left out are left out");
                return None;
            }
        },
        (None, None) => {
            notes.add(element, "actuators of sites, bodies and cranks are left out");
            return None;
        }
    };
    let (first, _) = arms.first()?;
    let tree = first.tree;
    if arms.iter().any(|(joint, _)| joint.tree != tree) {
        notes.add(element, "actuators of tendons across articulated bodies are left out");
        return None;
    }
    let gains = defaults.read(element, reader.classes.class_of(element));
    let law = law_of(&gains, element, notes)?;
    let gear = item.list("gear", 6).map_or(1.0, |gear| gear[0]);
    let moments: Vec<(usize, f64)> = arms.iter().map(|(joint, coefficient)| (joint.link, gear * coefficient)).collect();
    let mut spec = ActuatorSpec {
        name: item.name().unwrap_or_default(),
        articulated: tree,
        moments,
        gain: law.gain,
        bias: law.bias,
        control_range: control_range(item, gains.inherited_range, &arms, assembly),
        force_range: ranged(item, "forcelimited", "forcerange", assembly),
        control: 0.0,
        driven: false,
    };
    if let (Some(ratio), Some(inertia)) = (law.damping_ratio, inertias.of(&spec.moments, tree, assembly)) {
        spec.bias[2] = -2.0 * ratio * (spec.gain * inertia).max(0.0).sqrt();
    }
    add_rotor(item, &spec, assembly);
    Some(spec)
}

/// Returns the law of an actuator. `None` if the force is not affine.
fn law_of(gains: &Gains<'_>, element: &Element<'_, '_>, notes: &Ledger) -> Option<Law> {
    if gains.delayed {
        notes.add(element, schema::ACTIVATION);
    }
    let [gain, per_length, per_rate] = gains.gain;
    let is_constant = match gains.gain_form {
        Form::Constant => true,
        Form::Affine => per_length == 0.0 && per_rate == 0.0,
        Form::Other => false,
    };
    let bias = match gains.bias_form {
        Form::Constant => Some([0.0; 3]),
        Form::Affine => Some(gains.bias),
        Form::Other => None,
    };
    let (true, Some(mut bias)) = (is_constant, bias) else {
        notes.add(element, "actuators whose force is not affine (muscles and the like) are left out");
        return None;
    };
    let is_ratio = gains.gain_form == Form::Constant && bias[2] > 0.0 && bias[1] == -gain;
    let damping_ratio = is_ratio.then(|| std::mem::take(&mut bias[2]));
    Some(Law { gain, bias, damping_ratio })
}

fn ranged(item: &Item<'_>, limited: &str, range: &str, assembly: &Assembly<'_, '_>) -> Option<[f64; 2]> {
    let applies = item.limited(limited, range, assembly.reader.compiler.autolimits);
    applies.then(|| read_range(item, range)).flatten()
}

/// Returns the range of controls: its own, or this fraction of that of its joint.
fn control_range(item: &Item<'_>, inherited: f64, arms: &[Arm], assembly: &Assembly<'_, '_>) -> Option<[f64; 2]> {
    if inherited > 0.0
        && let [(joint, _)] = arms
        && let Some([low, high]) = assembly.scene.articulated[joint.tree].links[joint.link].joint.dof.limits
    {
        let (middle, half) = (0.5 * (low + high), 0.5 * (high - low) * inherited);
        return Some([middle - half, middle + half]);
    }
    ranged(item, "ctrllimited", "ctrlrange", assembly)
}

/// Adds the armature and the damping of an actuator to its joint.
fn add_rotor(item: &Item<'_>, spec: &ActuatorSpec, assembly: &mut Assembly<'_, '_>) {
    let damping = item.first_coefficient("damping", &assembly.reader.notes);
    let own = [item.number("armature", Bound::NOT_NEGATIVE, 0.0), damping];
    if own == [0.0; 2] {
        return;
    }
    let [(link, arm)] = spec.moments[..] else {
        return assembly.reader.notes.add(item.own(), "armature and damping of tendon actuators are left out");
    };
    let joint = &mut assembly.scene.articulated[spec.articulated].links[link].joint;
    joint.armature += own[0] * arm * arm;
    joint.dof.damping += own[1] * arm * arm;
}

/// Makes the drive of a joint from its actuators with feedback.
fn drive(tree: usize, link: usize, group: &[usize], elements: &[Element<'_, '_>], assembly: &mut Assembly<'_, '_>) {
    let notes = &assembly.reader.notes;
    let (mut stiffness, mut damping, mut force, mut most) = (0.0, 0.0, 0.0, 0.0);
    for &index in group {
        let spec = &assembly.scene.actuators[index];
        let arm = spec.moments[0].1;
        stiffness -= spec.bias[1] * arm * arm;
        damping -= spec.bias[2] * arm * arm;
        force += arm * (spec.gain * spec.control + spec.bias[0]);
        most += match spec.force_range {
            Some([low, high]) => arm.abs() * high.max(-low),
            None => f64::INFINITY,
        };
        if spec.force_range.is_some_and(|[low, high]| (high + low).abs() > 1e-9 * high.abs()) {
            notes.add(&elements[index], "a range of forces that is not symmetric counts as its larger side in drives");
        }
    }
    if stiffness == 0.0 && damping == 0.0 {
        return;
    }
    if stiffness < 0.0 || damping < 0.0 {
        return notes.add(&elements[group[0]], "actuators with positive feedback have no drive");
    }
    let joint = &mut assembly.scene.articulated[tree].links[link].joint;
    joint.dof.drive = Drive::Position {
        stiffness,
        damping,
        target: if stiffness > 0.0 { force / stiffness } else { 0.0 },
        velocity: if stiffness > 0.0 { 0.0 } else { force / damping },
        limit: most.min(joint.dof.effort),
    };
    group.iter().for_each(|&index| assembly.scene.actuators[index].driven = true);
}

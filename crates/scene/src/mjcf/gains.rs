//! Gain and bias of actuators. All kinds of actuators share these numbers, and their defaults:
//!
//! | kind | gain `g` | bias `b₀`, `b₁`, `b₂` |
//! |---|---|---|
//! | `general` | `gainprm`, else the default | `biasprm`, else the default |
//! | `motor` | 1 | 0, 0, 0 |
//! | `position` | `kp`, else the gain of the default | 0, −g, −`kv` or `dampratio`, else `b₂` of the default |
//! | `velocity` | `kv`, else the gain of the default | 0, 0, −g |
//!
//! An actuator takes its defaults from the nearest class whose last actuator is of its own kind, or a `general` one with
//! a fixed gain; a `general` one takes those of its own class. A `b₂` above 0 together with `b₁ = −g` is a damping ratio.

use super::defaults::Classes;
use crate::parse::bound::Bound;
use crate::xml::Element;

/// How gain or bias depend on the state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Form {
    /// A constant gain, or no bias.
    Constant,
    Affine,
    Other,
}

/// Gain and bias of an actuator, and of the actuators of a default class.
#[derive(Clone, Copy, Debug)]
pub(super) struct Gains<'a> {
    /// Tag of the element that set them last.
    tag: &'a str,
    pub(super) gain: [f64; 3],
    pub(super) bias: [f64; 3],
    pub(super) gain_form: Form,
    pub(super) bias_form: Form,
    /// Whether the force follows the control with a delay.
    pub(super) delayed: bool,
    /// Range of controls as a fraction of that of the joint; 0 for a range of its own.
    pub(super) inherited_range: f64,
}

impl Default for Gains<'_> {
    fn default() -> Self {
        Gains {
            tag: "",
            gain: [1.0, 0.0, 0.0],
            bias: [0.0; 3],
            gain_form: Form::Constant,
            bias_form: Form::Constant,
            delayed: false,
            inherited_range: 0.0,
        }
    }
}

/// The defaults of actuators of all classes.
pub(super) struct DefaultGains<'a> {
    of_class: Vec<Gains<'a>>,
    parents: Vec<Option<usize>>,
}

impl<'a> DefaultGains<'a> {
    /// Reads the defaults of actuators of all classes. A class comes after its parent.
    pub(super) fn of(classes: &Classes<'a>) -> DefaultGains<'a> {
        let mut defaults = DefaultGains { of_class: Vec::new(), parents: Vec::new() };
        for (class, (parent, actuators)) in classes.actuators().enumerate() {
            let inherited = parent.map_or_else(Gains::default, |parent: usize| defaults.of_class[parent]);
            defaults.of_class.push(inherited);
            defaults.parents.push(parent);
            for element in actuators {
                defaults.of_class[class] = defaults.read(element, class);
            }
        }
        defaults
    }

    /// Reads an actuator of a class.
    pub(super) fn read(&self, element: &Element<'a, 'a>, class: usize) -> Gains<'a> {
        let tag = element.tag();
        let number = |name: &str| element.number(name, Bound::NOT_NEGATIVE);
        let base = self.base(tag, class);
        let read = match tag {
            "general" => {
                let mut read = base;
                overwrite(&mut read.gain, element, "gainprm");
                overwrite(&mut read.bias, element, "biasprm");
                read.gain_form = element.text("gaintype").map_or(base.gain_form, |word| form(word, "fixed"));
                read.bias_form = element.text("biastype").map_or(base.bias_form, |word| form(word, "none"));
                read.delayed = element.text("dyntype").map_or(base.delayed, |word| word != "none");
                read
            }
            "motor" => Gains::default(),
            "position" => {
                let (kp, kv, ratio) = (number("kp").unwrap_or(base.gain[0]), number("kv"), number("dampratio"));
                if kv.is_some() && ratio.is_some() {
                    element.problem("has `kv` and `dampratio`", "expected one of them");
                }
                let damping = ratio.or(kv.map(|kv| -kv)).unwrap_or(base.bias[2]);
                let delayed = element.text("timeconst").map_or(base.delayed && base.tag == tag, |_| true);
                let inherited_range = number("inheritrange").unwrap_or(base.inherited_range);
                let bias_form = Form::Affine;
                let (gain, bias) = ([kp, 0.0, 0.0], [0.0, -kp, damping]);
                Gains { gain, bias, bias_form, delayed, inherited_range, ..Gains::default() }
            }
            "velocity" => {
                let kv = number("kv").unwrap_or(base.gain[0]);
                let (gain, bias) = ([kv, 0.0, 0.0], [0.0, 0.0, -kv]);
                Gains { gain, bias, bias_form: Form::Affine, ..Gains::default() }
            }
            _ => Gains { gain_form: Form::Other, bias_form: Form::Other, ..Gains::default() },
        };
        Gains { tag, ..read }
    }

    /// Returns the defaults of an actuator with this tag in a class.
    fn base(&self, tag: &str, class: usize) -> Gains<'a> {
        let mut at = Some(class);
        while let Some(class) = at {
            let own = self.of_class[class];
            if tag == "general" || own.tag == tag || (own.tag == "general" && own.gain_form == Form::Constant) {
                return own;
            }
            at = self.parents[class];
        }
        Gains::default()
    }
}

/// Overwrites the first numbers by those of an attribute.
fn overwrite(numbers: &mut [f64; 3], element: &Element<'_, '_>, name: &str) {
    for (number, given) in numbers.iter_mut().zip(element.list(name, 10, Bound::ANY).unwrap_or_default()) {
        *number = given;
    }
}

fn form(word: &str, constant: &str) -> Form {
    match word {
        _ if word == constant => Form::Constant,
        "affine" => Form::Affine,
        _ => Form::Other,
    }
}

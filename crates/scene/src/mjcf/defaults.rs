//! Default classes, and elements together with the defaults that apply to them.

use std::collections::BTreeMap;

use super::notes::Ledger;
use super::schema::{self, Attributes};
use super::source::XmlNode;
use crate::parse::bound::Bound;
use crate::parse::suggest::nearest;
use crate::xml::Element;

/// The default classes of a model. Class 0 is the global one.
pub(super) struct Classes<'a> {
    all: Vec<Class<'a>>,
    names: BTreeMap<String, usize>,
    /// Number of defaults.
    count: usize,
}

struct Class<'a> {
    parent: Option<usize>,
    /// The defaults, in the order of the file.
    elements: Vec<Element<'a, 'a>>,
}

/// Largest number of defaults of a model.
const MAX_DEFAULTS: usize = 2_000;

/// Tags that share one set of defaults in MuJoCo.
const ACTUATORS: &[&str] = &[
    "general",
    "motor",
    "position",
    "velocity",
    "intvelocity",
    "damper",
    "cylinder",
    "muscle",
    "adhesion",
    "orientation",
    "pid",
    "dcmotor",
    "plugin",
];

impl<'a> Classes<'a> {
    /// Reads all sections `<default>`.
    pub(super) fn read(root: &XmlNode<'a>, notes: &Ledger) -> Classes<'a> {
        let mut classes =
            Classes { all: vec![Class { parent: None, elements: Vec::new() }], names: BTreeMap::new(), count: 0 };
        classes.names.insert("main".into(), 0);
        for section in root.all("default") {
            if let Some(name) = section.element.text("class") {
                classes.names.insert(name.to_owned(), 0);
            }
            classes.fill(section, 0, notes);
        }
        classes
    }

    fn fill(&mut self, section: &XmlNode<'a>, class: usize, notes: &Ledger) {
        for child in &section.children {
            let element = child.element;
            if child.tag() != "default" {
                if let Some(attributes) = attributes_of(child.tag()) {
                    attributes.check(&element, notes);
                }
                self.count += 1;
                if self.count == MAX_DEFAULTS {
                    element.problem("is one default too many", format!("expected at most {MAX_DEFAULTS}"));
                } else if self.count < MAX_DEFAULTS {
                    self.all[class].elements.push(element);
                }
                continue;
            }
            let Some(name) = element.required_text("class", "the name of the class") else { continue };
            if self.names.contains_key(name) {
                element.wrong("class", "a name that no other class has");
                continue;
            }
            self.all.push(Class { parent: Some(class), elements: Vec::new() });
            let number = self.all.len() - 1;
            self.names.insert(name.to_owned(), number);
            self.fill(child, number, notes);
        }
    }

    /// Returns the class that an attribute names, if it is present and known.
    pub(super) fn named(&self, element: &Element<'_, '_>, attribute: &str) -> Option<usize> {
        let name = element.text(attribute)?;
        let found = self.names.get(name).copied();
        if found.is_none() {
            let near = nearest(name, self.names.keys().map(String::as_str));
            element.wrong(
                attribute,
                near.map_or("the name of a default class".to_owned(), |near| {
                    format!("the name of a default class; did you mean \"{near}\"?")
                }),
            );
        }
        found
    }

    /// Returns the parent of each class, and its defaults of actuators. A class comes after its parent.
    pub(super) fn actuators(&self) -> impl Iterator<Item = (Option<usize>, impl Iterator<Item = &Element<'a, 'a>>)> {
        let is_actuator = |element: &&Element<'_, '_>| ACTUATORS.contains(&element.tag());
        self.all.iter().map(move |class| (class.parent, class.elements.iter().filter(is_actuator)))
    }

    /// Returns the class that an element names, or class 0.
    pub(super) fn class_of(&self, element: &Element<'_, '_>) -> usize {
        element.text("class").and_then(|name| self.names.get(name)).copied().unwrap_or(0)
    }

    /// Returns an element with its defaults: those of its class, else of `around`.
    pub(super) fn item(&self, element: Element<'a, 'a>, around: usize) -> Item<'a> {
        let tag = element.tag();
        let shared: &[&str] = match tag {
            _ if ACTUATORS.contains(&tag) => ACTUATORS,
            "connect" | "weld" => &["equality"],
            "fixed" | "spatial" => &["tendon"],
            _ => &[],
        };
        let mut chain = vec![element];
        let mut at = Some(self.named(&element, "class").unwrap_or(around));
        while let Some(class) = at.map(|class| &self.all[class]) {
            let fits = |default: &&Element<'_, '_>| default.tag() == tag || shared.contains(&default.tag());
            chain.extend(class.elements.iter().rev().filter(fits));
            at = class.parent;
        }
        Item { chain }
    }
}

fn attributes_of(tag: &str) -> Option<&'static Attributes> {
    Some(match tag {
        "joint" => &schema::JOINT,
        "geom" => &schema::GEOM,
        "site" => &schema::SITE,
        "camera" => &schema::CAMERA,
        "light" => &schema::LIGHT,
        "mesh" => &schema::MESH,
        "material" => &schema::MATERIAL,
        "pair" => &schema::PAIR,
        "equality" => &schema::EQUALITY,
        "general" | "motor" | "position" | "velocity" => &schema::ACTUATOR,
        _ => return None,
    })
}

/// An element with the defaults that apply to it.
pub(super) struct Item<'a> {
    /// The element, then its defaults, the nearest first.
    chain: Vec<Element<'a, 'a>>,
}

impl<'a> Item<'a> {
    /// Returns the element itself.
    pub(super) fn own(&self) -> &Element<'a, 'a> {
        &self.chain[0]
    }

    /// Returns the element or default that has an attribute.
    pub(super) fn at(&self, name: &str) -> Option<&Element<'a, 'a>> {
        self.chain.iter().find(|element| element.text(name).is_some())
    }

    /// Returns the nearest element or default that has one of several attributes.
    pub(super) fn at_any(&self, names: &[&str]) -> Option<&Element<'a, 'a>> {
        self.chain.iter().find(|element| names.iter().any(|name| element.text(name).is_some()))
    }

    /// Returns an attribute, if present.
    pub(super) fn text(&self, name: &str) -> Option<&'a str> {
        self.at(name)?.text(name)
    }

    /// Returns a number in `bound`, or `default` if it is absent or wrong.
    pub(super) fn number(&self, name: &str, bound: Bound, default: f64) -> f64 {
        self.at(name).and_then(|element| element.number(name, bound)).unwrap_or(default)
    }

    /// Returns the first coefficient of a polynomial, a number of at least 0; 0 if it is absent or wrong. The others are
    /// left out with a note.
    pub(super) fn first_coefficient(&self, name: &str, notes: &Ledger) -> f64 {
        let Some(element) = self.at(name) else { return 0.0 };
        let coefficients = element.list(name, 3, Bound::ANY).unwrap_or_default();
        let Some((first, others)) = coefficients.split_first() else { return 0.0 };
        if others.iter().any(|x| *x != 0.0) {
            let why = "the second and third numbers of `stiffness` and `damping` are left out: forces are linear here";
            notes.add(element, why);
        }
        if *first < 0.0 {
            element.wrong(name, format_args!("{} as the first number", Bound::NOT_NEGATIVE.expected()));
        }
        first.max(0.0)
    }

    /// Returns `N` numbers, if present; NaN if they are wrong.
    pub(super) fn numbers<const N: usize>(&self, name: &str) -> Option<[f64; N]> {
        self.at(name)?.numbers(name, Bound::ANY)
    }

    /// Returns one to `most` numbers, if present and valid.
    pub(super) fn list(&self, name: &str, most: usize) -> Option<Vec<f64>> {
        self.at(name)?.list(name, most, Bound::ANY)
    }

    /// Returns the meaning of a word, if present and valid.
    pub(super) fn word<T: Copy>(&self, name: &str, words: &[(&'static str, T)]) -> Option<T> {
        self.at(name)?.word(name, words)
    }

    /// Returns a flag, or `default` if it is absent or wrong.
    pub(super) fn flag(&self, name: &str, default: bool) -> bool {
        self.word(name, FLAGS).unwrap_or(default)
    }

    /// Returns whether a range applies: as the flag `name` says, and with `auto` if the range is
    /// present and its two numbers differ.
    pub(super) fn limited(&self, name: &str, range: &str, autolimits: bool) -> bool {
        match self.word(name, LIMITED).unwrap_or(None) {
            Some(limited) => limited,
            None => autolimits && self.text(range).is_some_and(|text| !is_empty_range(text)),
        }
    }

    /// Returns a name without control characters, if there is one.
    pub(super) fn name(&self) -> Option<String> {
        self.own().text("name").map(cleaned).filter(|name| !name.is_empty())
    }
}

/// Returns whether a text is two equal numbers.
fn is_empty_range(text: &str) -> bool {
    let numbers: Vec<Option<f64>> = text.split_whitespace().map(|word| word.parse().ok()).collect();
    matches!(numbers[..], [Some(low), Some(high)] if low == high)
}

/// Returns a name without control characters.
pub(super) fn cleaned(name: &str) -> String {
    name.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}

pub(super) const FLAGS: &[(&str, bool)] = &[("true", true), ("false", false)];
const LIMITED: &[(&str, Option<bool>)] = &[("true", Some(true)), ("false", Some(false)), ("auto", None)];

//! Names of a model: those that its elements refer to, and unique names for all objects and links.

use std::collections::{BTreeMap, BTreeSet};

use super::source::XmlNode;
use super::tree::Body;
use crate::parse::suggest::nearest;
use crate::xml::Element;

/// Number of names that are searched for one that is meant.
const MAX_NEAR: usize = 2_000;

/// Places of the elements by their names.
#[derive(Default)]
pub(super) struct Names {
    pub(super) bodies: BTreeMap<String, usize>,
    /// Body and number in it.
    pub(super) geoms: BTreeMap<String, (usize, usize)>,
    pub(super) joints: BTreeMap<String, (usize, usize)>,
    pub(super) sites: BTreeMap<String, (usize, usize)>,
}

impl Names {
    /// Collects all names; a name that is used twice is a problem.
    pub(super) fn of(bodies: &[Body<'_>]) -> Names {
        let mut names = Names::default();
        names.bodies.insert("world".into(), 0);
        for (number, body) in bodies.iter().enumerate() {
            if let Some(name) = &body.name {
                note(&mut names.bodies, name, number, &body.element, |at| &bodies[at].element);
            }
            for (k, geom) in body.geoms.iter().enumerate() {
                let first = |(number, k): (usize, usize)| &bodies[number].geoms[k].element;
                geom.name.iter().for_each(|name| note(&mut names.geoms, name, (number, k), &geom.element, first));
            }
            for (k, joint) in body.joints.iter().enumerate() {
                let first = |(number, k): (usize, usize)| &bodies[number].joints[k].element;
                joint.name.iter().for_each(|name| note(&mut names.joints, name, (number, k), &joint.element, first));
            }
            for (k, site) in body.sites.iter().enumerate() {
                let first = |(number, k): (usize, usize)| &bodies[number].sites[k].element;
                site.name.iter().for_each(|name| note(&mut names.sites, name, (number, k), &site.element, first));
            }
        }
        names
    }
}

/// Returns the sites that `<equality>` names and nothing else. They are places of joints, and no frames of their own.
pub(super) fn joint_ends(root: &XmlNode<'_>) -> BTreeSet<String> {
    const NAMING: [&str; 7] = ["site", "refsite", "sidesite", "cranksite", "slidersite", "objname", "refname"];
    let (mut ends, mut others) = (BTreeSet::new(), BTreeSet::new());
    let mut open: Vec<(&XmlNode<'_>, bool)> = root.children.iter().map(|node| (node, false)).collect();
    while let Some((node, joins)) = open.pop() {
        let joins = joins || node.tag() == "equality";
        let (names, keys) = if joins { (&mut ends, &["site1", "site2"][..]) } else { (&mut others, &NAMING[..]) };
        names.extend(keys.iter().filter_map(|key| node.element.text(key)).map(str::to_owned));
        if node.tag() != "worldbody" {
            open.extend(node.children.iter().map(|child| (child, joins)));
        }
    }
    &ends - &others
}

/// Adds a name. `element_of` returns the element of an earlier one.
fn note<'b, 'x: 'b, T: Copy>(
    names: &mut BTreeMap<String, T>,
    name: &str,
    at: T,
    element: &Element<'_, '_>,
    element_of: impl Fn(T) -> &'b Element<'x, 'x>,
) {
    if let Some(first) = names.get(name) {
        let message = format!("has a name that is used before, at {}", element_of(*first).place());
        return element.problem(message, "expected a unique name");
    }
    names.insert(name.to_owned(), at);
}

/// Returns what an attribute names. A name that is unknown is a problem, and so is no name unless
/// `optional`.
pub(super) fn find<T: Copy>(
    element: &Element<'_, '_>,
    attribute: &str,
    names: &BTreeMap<String, T>,
    optional: bool,
) -> Option<T> {
    let what = format!("the name of a {}", attribute.trim_end_matches(|c: char| c.is_ascii_digit()));
    let name = if optional { element.text(attribute)? } else { element.required_text(attribute, &what)? };
    let found = names.get(name).copied();
    if found.is_none() {
        let near = nearest(name, names.keys().take(MAX_NEAR).map(String::as_str));
        element.wrong(attribute, near.map_or(what.clone(), |near| format!("{what}; did you mean \"{near}\"?")));
    }
    found
}

/// Names that are taken.
#[derive(Default)]
pub(super) struct Taken {
    names: BTreeSet<String>,
    /// Next number to be tried for each name.
    next: BTreeMap<String, usize>,
}

impl Taken {
    /// Returns the name if it is free, else the name with the first number that is free.
    pub(super) fn unique(&mut self, name: String) -> String {
        if self.names.insert(name.clone()) {
            return name;
        }
        let next = self.next.entry(name.clone()).or_insert(2);
        loop {
            let tried = format!("{name}_{next}");
            *next += 1;
            if self.names.insert(tried.clone()) {
                return tried;
            }
        }
    }
}

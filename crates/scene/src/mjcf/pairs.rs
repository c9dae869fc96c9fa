//! `<contact>`: pairs with a friction of their own, and pairs that do not collide.

use super::names::find;
use super::scene::{Assembly, Place};
use super::schema;
use super::source::XmlNode;
use crate::parse::bound::Bound;
use crate::parse::pair::{PairSideSpec, PairSpec};
use crate::xml::Element;

/// Largest number of pairs of a scene.
const MAX_PAIRS: usize = 100_000;

/// Reads all pairs and exclusions.
pub(super) fn read<'a>(root: &XmlNode<'a>, assembly: &mut Assembly<'_, 'a>) {
    let notes = &assembly.reader.notes;
    for XmlNode { element, .. } in root.all("contact").flat_map(|section| &section.children) {
        match element.tag() {
            "exclude" => {
                schema::EXCLUDE.check(element, notes);
                exclude(element, assembly);
            }
            "pair" => {
                schema::PAIR.check(element, notes);
                pair(element, assembly);
            }
            tag => notes.add(element, format!("<{}> of <contact> is left out", super::defaults::cleaned(tag))),
        }
    }
}

fn exclude(element: &Element<'_, '_>, assembly: &mut Assembly<'_, '_>) {
    let [a, b] = ["body1", "body2"].map(|side| find(element, side, &assembly.names.bodies, false));
    let (Some(a), Some(b)) = (a, b) else { return };
    match [assembly.places[a], assembly.places[b]] {
        [Place::Link(tree, a), Place::Link(other, b)] if tree == other => {
            assembly.scene.articulated[tree].exclude_collisions.push([a, b]);
        }
        // Fixed bodies do not collide with each other.
        [Place::World, Place::World] => {}
        _ => {
            let sides = [a, b].map(|body| sides_of(body, assembly));
            for (first, second) in sides[0].iter().flat_map(|a| sides[1].iter().map(move |b| (*a, *b))) {
                add(element, assembly, [first, second], None, false);
            }
        }
    }
}

/// Returns all objects and links of a body that have shapes.
fn sides_of(body: usize, assembly: &Assembly<'_, '_>) -> Vec<PairSideSpec> {
    match assembly.places[body] {
        Place::World => assembly.statics[body].iter().map(|(_, index)| PairSideSpec::Body(*index)).collect(),
        Place::Rigid(index) => vec![PairSideSpec::Body(index)],
        Place::Link(tree, link) => vec![PairSideSpec::Link(tree, link)],
    }
}

fn pair(element: &Element<'_, '_>, assembly: &mut Assembly<'_, '_>) {
    let item = assembly.reader.classes.item(*element, 0);
    let [a, b] = ["geom1", "geom2"].map(|side| find(element, side, &assembly.names.geoms, false));
    let (Some(a), Some(b)) = (a, b) else { return };
    let condim = item.number("condim", Bound::ANY, 3.0);
    let own = item.list("friction", 5).map(|friction| friction[0].clamp(0.0, 100.0));
    let friction = if condim <= 1.0 { Some(0.0) } else { own };
    let sides = [a, b].map(|(body, geom)| match assembly.places[body] {
        Place::World => {
            let found = assembly.statics[body].iter().find(|(k, _)| *k == geom);
            found.map(|(_, index)| PairSideSpec::Body(*index))
        }
        _ => {
            if assembly.bodies[body].geoms.len() > 1 {
                let note = "a pair of geoms holds for all geoms of their bodies";
                assembly.reader.notes.add(element, note);
            }
            sides_of(body, assembly).first().copied()
        }
    });
    let [Some(a), Some(b)] = sides else {
        return assembly.reader.notes.add(element, "a pair with a geom that is left out is left out");
    };
    // Groups decide whether the other geoms of the two bodies collide; a pair always does.
    add(element, assembly, [a, b], friction, true);
}

fn add(
    element: &Element<'_, '_>,
    assembly: &mut Assembly<'_, '_>,
    mut sides: [PairSideSpec; 2],
    friction: Option<f64>,
    collides: bool,
) {
    sides.sort_unstable();
    if sides[0] == sides[1] {
        return;
    }
    if assembly.scene.pairs.len() >= MAX_PAIRS {
        return assembly.reader.notes.add(element, format!("pairs after the first {MAX_PAIRS} are left out"));
    }
    assembly.scene.pairs.push(PairSpec { sides, restitution: None, friction, collides: Some(collides) });
}

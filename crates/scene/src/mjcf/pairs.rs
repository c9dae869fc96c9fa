//! `<contact>`: pairs with a friction of their own, and pairs that do not collide.

use tumble_core::Material;

use super::Reader;
use super::defaults::Item;
use super::geom::Geom;
use super::names::{Names, find};
use super::scene::{Assembly, Place};
use super::schema;
use super::shapes::{Partners, do_bits_meet};
use super::source::XmlNode;
use super::tree::Body;
use crate::parse::bound::Bound;
use crate::parse::pair::{PairSideSpec, PairSpec};
use crate::xml::Element;

/// Largest number of pairs of a scene.
const MAX_PAIRS: usize = 100_000;
/// Friction of a pair that gives fewer numbers: two sliding, one torsional (m), two rolling (m).
const PAIR_FRICTION: [f64; 5] = [1.0, 1.0, 0.005, 0.0001, 0.0001];

/// Frictions of a pair; `None` where those of its geoms hold.
#[derive(Clone, Copy, Default)]
struct PairFriction {
    sliding: Option<f64>,
    /// m.
    rolling: Option<f64>,
    /// m.
    torsional: Option<f64>,
}

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
        _ if assembly.is_held(a) && assembly.is_held(b) => {}
        _ => {
            let sides = [a, b].map(|body| sides_of(body, assembly));
            for (first, second) in sides[0].iter().flat_map(|a| sides[1].iter().map(move |b| (*a, *b))) {
                add(element, assembly, [first, second], PairFriction::default(), false);
            }
        }
    }
}

/// Returns all objects and links of a body that have shapes.
fn sides_of(body: usize, assembly: &Assembly<'_, '_>) -> Vec<PairSideSpec> {
    match assembly.places[body] {
        Place::World => assembly.statics[body].iter().map(|(_, index)| PairSideSpec::Body(*index)).collect(),
        Place::Rigid(index) | Place::Kinematic(index, _) => vec![PairSideSpec::Body(index)],
        Place::Link(tree, link) => vec![PairSideSpec::Link(tree, link)],
    }
}

fn pair(element: &Element<'_, '_>, assembly: &mut Assembly<'_, '_>) {
    let item = assembly.reader.classes.item(*element, 0);
    let [a, b] = ["geom1", "geom2"].map(|side| find(element, side, &assembly.names.geoms, false));
    let (Some(a), Some(b)) = (a, b) else { return };
    if a.0 == b.0 || are_joined(a.0, b.0, assembly) {
        let note = "a pair of geoms of one body, or of bodies that a joint connects, is left out: they never collide";
        return assembly.reader.notes.add(element, note);
    }
    let friction = read_friction(&item, [a, b].map(|(body, geom)| &assembly.bodies[body].geoms[geom]), assembly);
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

/// Returns the frictions of a pair.
fn read_friction(item: &Item<'_>, geoms: [&Geom<'_>; 2], assembly: &Assembly<'_, '_>) -> PairFriction {
    let notes = &assembly.reader.notes;
    let condim = item.number("condim", Bound::ANY, 3.0);
    let given = item.list("friction", 5).map(|list| list.into_iter().map(|x| x.clamp(0.0, 100.0)).collect::<Vec<_>>());
    let larger = |k: usize| geoms[0].friction[k].max(geoms[1].friction[k]);
    // two sliding, one torsional, two rolling
    let wanted = |k: usize, of_geoms: usize| {
        let own = given.as_ref().and_then(|list| list.get(k)).copied();
        own.unwrap_or_else(|| if given.is_some() { PAIR_FRICTION[k] } else { larger(of_geoms) })
    };
    if condim > 1.0 && given.as_ref().is_some_and(|list| list.get(1).is_some_and(|second| *second != list[0])) {
        notes.add(item.own(), "the second sliding friction of a pair is left out: the first holds in all directions");
    }
    let surfaces = geoms.map(|geom| assembly.groups.surface(geom).contact);
    let torsional = if condim > 3.0 { wanted(2, 1) } else { 0.0 };
    let rolling = if condim > 4.0 { [wanted(3, 2), wanted(4, 2)] } else { [0.0; 2] };
    let held = |of: fn(&Material) -> f64| of(&surfaces[0]).max(of(&surfaces[1]));
    if rolling[1] != rolling[0] {
        notes.add(item.own(), "the second rolling friction of a pair is left out: the first holds in all directions");
    }
    let sliding = match condim {
        _ if condim <= 1.0 => Some(0.0),
        _ if geoms.iter().all(|geom| geom.dimensions <= 1.0) => Some(wanted(0, 0)),
        _ => given.as_ref().map(|list| list[0]),
    };
    let own = |value: f64, held: f64| (value != held).then_some(value);
    PairFriction {
        sliding,
        rolling: own(rolling[0], held(|m| m.rolling_friction)),
        torsional: own(torsional, held(|m| m.torsional_friction)),
    }
}

/// Returns whether two bodies move as one, or one of them is on the other by a joint.
fn are_joined(a: usize, b: usize, assembly: &Assembly<'_, '_>) -> bool {
    let bodies = assembly.bodies;
    // the body that moves, of those that are fixed to each other
    let carrier = |mut body: usize| {
        while body != 0 && bodies[body].joints.is_empty() {
            body = bodies[body].parent;
        }
        body
    };
    let (a, b) = (carrier(a), carrier(b));
    let on = |upper: usize, lower: usize| lower != 0 && upper != 0 && carrier(bodies[upper].parent) == lower;
    a == b || on(a, b) || on(b, a)
}

/// Returns the geoms that collide by a pair alone, since `contype` and `conaffinity` keep them apart.
pub(super) fn partners(root: &XmlNode<'_>, bodies: &[Body<'_>], names: &Names, reader: &Reader<'_>) -> Partners {
    let mut partners = Partners::new();
    if !reader.contacts {
        return partners;
    }
    for pair in root.all("contact").flat_map(|section| section.all("pair")) {
        let [a, b] = ["geom1", "geom2"].map(|side| {
            let name = pair.element.text(side)?;
            let (body, geom) = *names.geoms.get(name)?;
            Some((name, body, bodies[body].geoms[geom].bits))
        });
        let (Some((first, a, bits)), Some((second, b, others))) = (a, b) else { continue };
        if a != b && !do_bits_meet(bits, others) {
            for [name, other] in [[first, second], [second, first]] {
                partners.entry(name.to_owned()).or_default().insert(other.to_owned());
            }
        }
    }
    partners
}

fn add(
    element: &Element<'_, '_>,
    assembly: &mut Assembly<'_, '_>,
    mut sides: [PairSideSpec; 2],
    friction: PairFriction,
    collides: bool,
) {
    sides.sort_unstable();
    if sides[0] == sides[1] {
        return;
    }
    if assembly.scene.pairs.len() >= MAX_PAIRS {
        return assembly.reader.notes.add(element, format!("pairs after the first {MAX_PAIRS} are left out"));
    }
    let PairFriction { sliding, rolling, torsional } = friction;
    assembly.scene.pairs.push(PairSpec {
        friction: sliding,
        rolling_friction: rolling,
        torsional_friction: torsional,
        collides: Some(collides),
        ..PairSpec::new(sides)
    });
}

//! `[[pair]]`: restitution and frictions of two bodies or two materials, which override the
//! combination rules of `[world]`, and whether they collide.

use std::collections::BTreeMap;

use crate::parse::body::Library;
use crate::parse::bound::Bound;
use crate::parse::fields::{Fields, Value};
use crate::parse::loop_joint::{PartSpec, Parts};
use crate::parse::material::{FRICTION, RESTITUTION};

/// One side of a pair.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum PairSideSpec {
    /// A body, by its index in [`SceneFile::bodies`](crate::SceneFile::bodies).
    Body(usize),
    /// A whole articulated body, by its index.
    Articulated(usize),
    /// A link of an articulated body and the links that are fixed to it, by both indices.
    Link(usize, usize),
    /// All shapes of a material, by its index in
    /// [`SceneFile::materials`](crate::SceneFile::materials).
    Material(usize),
}

/// Contact constants of a pair with all references resolved. The order of the sides has no meaning.
#[derive(Clone, Debug, PartialEq)]
pub struct PairSpec {
    /// Two bodies (or links), or two materials.
    pub sides: [PairSideSpec; 2],
    /// 0 to 1; `None` for the combination rule.
    pub restitution: Option<f64>,
    /// 0 to 100; `None` for the combination rule.
    pub friction: Option<f64>,
    /// m, at least 0; `None` for the larger one of both surfaces.
    pub rolling_friction: Option<f64>,
    /// m, at least 0; `None` for the larger one of both surfaces.
    pub torsional_friction: Option<f64>,
    /// Whether the two collide; `None` if their groups decide.
    pub collides: Option<bool>,
}

impl PairSpec {
    /// Returns a pair without constants of its own.
    pub fn new(sides: [PairSideSpec; 2]) -> PairSpec {
        let (rolling_friction, torsional_friction) = (None, None);
        PairSpec { sides, restitution: None, friction: None, rolling_friction, torsional_friction, collides: None }
    }

    /// Reads a pair. Returns `None`, with the problem recorded, if a side is unknown. `lines` has
    /// the line of each earlier pair.
    pub(crate) fn read(
        mut f: Fields<'_>,
        library: &Library<'_>,
        parts: &impl Parts,
        lines: &mut BTreeMap<[PairSideSpec; 2], usize>,
    ) -> Option<PairSpec> {
        let sides = match f.value("materials") {
            Some(value) => read_materials(&f, value, library),
            None => read_bodies(&mut f, parts),
        };
        let restitution = f.optional_number("restitution", RESTITUTION);
        let friction = f.optional_number("friction", FRICTION);
        let rolling_friction = f.optional_number("rolling_friction_m", Bound::NOT_NEGATIVE);
        let torsional_friction = f.optional_number("torsional_friction_m", Bound::NOT_NEGATIVE);
        let collides = f.value("collides").is_some().then(|| f.flag_or("collides", true));
        let numbers = [restitution, friction, rolling_friction, torsional_friction];
        if numbers.iter().all(Option::is_none) && collides.is_none() {
            let expected = "`restitution`, `friction`, `rolling_friction_m`, `torsional_friction_m`, `collides` or several of them";
            f.missing("friction", expected);
        }
        let (log, what, span) = (f.log, f.what.clone(), f.span.clone());
        f.finish();
        let mut sides = sides?;
        sides.sort_unstable();
        if let Some(line) = lines.insert(sides, log.line(span.start)) {
            let message = format!("{what} names the same two as the pair at line {line}");
            log.report(span, message, "expected each pair once");
        }
        Some(PairSpec { sides, restitution, friction, rolling_friction, torsional_friction, collides })
    }
}

fn read_materials(f: &Fields<'_>, value: &Value<'_>, library: &Library<'_>) -> Option<[PairSideSpec; 2]> {
    let names = value.get_ref().as_array().filter(|items| items.len() == 2);
    let Some(names) = names else {
        f.wrong("materials", value, "the names of two materials, such as [\"rubber\", \"ice\"]");
        return None;
    };
    let find = |item: &Value<'_>| {
        let name = item.get_ref().as_str().unwrap_or_default();
        let found = library.material_names.get(name).copied();
        if found.is_none() {
            match library.material_names.is_empty() {
                true => f.wrong("materials", item, "the NAME of a table [materials.NAME]; the scene has none"),
                false => f.unknown_name("materials", item, name, library.material_names.keys().copied().collect()),
            }
        }
        found.map(PairSideSpec::Material)
    };
    let sides = [find(&names[0]), find(&names[1])];
    Some([sides[0]?, sides[1]?])
}

fn read_bodies(f: &mut Fields<'_>, parts: &impl Parts) -> Option<[PairSideSpec; 2]> {
    let expected = "the name of a body, or \"OBJECT/LINK\"; or instead of `a` and `b` two `materials`";
    let (a, b) = (f.text("a", expected), f.text("b", expected));
    let [a, b] = parts.sides(f, [a, b], |name| side_of(parts, name), "a body other than `a`");
    Some([a?, b?])
}

fn side_of(parts: &impl Parts, name: &str) -> Option<PairSideSpec> {
    match parts.part(name) {
        Some(PartSpec::Body(body)) => Some(PairSideSpec::Body(body)),
        Some(PartSpec::Link(spec, link)) => Some(PairSideSpec::Link(spec, link)),
        None => parts.articulated(name).map(PairSideSpec::Articulated),
    }
}

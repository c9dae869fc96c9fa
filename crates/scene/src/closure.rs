//! `[[closure]]`: a joint between any two parts of any two objects, which closes a loop.

use crate::body::read_name;
use crate::bound::Bound;
use crate::fields::{Fields, Names};

/// What a closure holds together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ClosureKind {
    /// A point: a ball joint.
    Point,
    /// A point and an axis.
    Hinge,
    /// Everything.
    Weld,
    /// All but the way along an axis.
    Slider,
}

const KINDS: Names<ClosureKind> = &[
    ("point", ClosureKind::Point),
    ("hinge", ClosureKind::Hinge),
    ("weld", ClosureKind::Weld),
    ("slider", ClosureKind::Slider),
];

/// A part of an object, by place in the description.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PartSpec {
    /// A body, by its index in [`SceneFile::bodies`](crate::SceneFile::bodies).
    Body(usize),
    /// A link of an articulated body, by both indices.
    Link(usize, usize),
}

/// One closure, all references resolved. It joins its sides as they stand at time 0.
#[derive(Clone, Debug, PartialEq)]
pub struct ClosureSpec {
    /// Unique in the scene, bodies included.
    pub name: String,
    /// What is held.
    pub kind: ClosureKind,
    /// One side.
    pub a: PartSpec,
    /// The other; `None` is the world.
    pub b: Option<PartSpec>,
    /// Where, world axes at time 0, m.
    pub position_m: [f64; 3],
    /// Unit axis of a hinge or slider, world axes at time 0.
    pub axis: [f64; 3],
}

/// Who can be a side of a closure.
pub(crate) trait Parts {
    /// The part of that name: `body`, or `object/link`.
    fn part(&self, name: &str) -> Option<PartSpec>;
    /// The index of the articulated body of that name.
    fn articulated(&self, name: &str) -> Option<usize>;
    /// Names, for messages.
    fn names(&self) -> Vec<String>;
}

impl ClosureSpec {
    pub(crate) fn read(mut f: Fields<'_>, parts: &impl Parts) -> Option<ClosureSpec> {
        let name = read_name(&mut f).unwrap_or_default();
        let Some(kind) = f.choice("type", KINDS) else {
            f.give_up();
            return None;
        };
        let a = f.text("a", "the name of a body, or \"OBJECT/LINK\"");
        let b = f.optional_text("b");
        let position_m = f.vector("position_m", Bound::ANY);
        let axis = match kind {
            ClosureKind::Hinge | ClosureKind::Slider => f.direction("axis"),
            ClosureKind::Point | ClosureKind::Weld => [0.0, 0.0, 1.0],
        };
        let find = |key: &str, side: Option<(&str, &crate::fields::Value<'_>)>| {
            let (name, value) = side?;
            let found = parts.part(name);
            if found.is_none() {
                f.unknown_name(key, value, name, parts.names().iter().map(String::as_str).collect());
            }
            found
        };
        let sides = [find("a", a), find("b", b)];
        if let ([Some(first), Some(second)], Some((_, value))) = (sides, b)
            && first == second
        {
            f.wrong("b", value, "a part other than `a`; or no `b`, which is the world");
        }
        f.finish();
        Some(ClosureSpec { name, kind, a: sides[0]?, b: sides[1], position_m, axis })
    }
}

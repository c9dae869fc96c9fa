//! `[[loop_joint]]`: a joint between two parts of any objects. It may close a loop.

use crate::parse::body::read_name;
use crate::parse::bound::Bound;
use crate::parse::fields::{Fields, Names, Value};

/// Which relative motion a loop joint removes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LoopJointKind {
    /// Holds a point: three rotations are free.
    Spherical,
    /// Holds a point and an axis: the rotation about the axis is free.
    Revolute,
    /// Holds position and orientation.
    Fixed,
    /// Holds all but the translation along an axis.
    Prismatic,
}

const KINDS: Names<LoopJointKind> = &[
    ("spherical", LoopJointKind::Spherical),
    ("revolute", LoopJointKind::Revolute),
    ("fixed", LoopJointKind::Fixed),
    ("prismatic", LoopJointKind::Prismatic),
];

/// A part of an object in the description.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PartSpec {
    /// A body, by its index in [`SceneFile::bodies`](crate::SceneFile::bodies).
    Body(usize),
    /// A link of an articulated body, by both indices.
    Link(usize, usize),
}

/// One loop joint, all references resolved. It joins its sides as they stand at time 0.
#[derive(Clone, Debug, PartialEq)]
pub struct LoopJointSpec {
    /// Unique in the scene, bodies included.
    pub name: String,
    /// Which motion it removes.
    pub kind: LoopJointKind,
    /// One side.
    pub a: PartSpec,
    /// The other side; `None` is the world.
    pub b: Option<PartSpec>,
    /// Position of the joint, world axes at time 0, m.
    pub position_m: [f64; 3],
    /// Unit axis of a revolute or prismatic joint, world axes at time 0.
    pub axis: [f64; 3],
}

/// Looks up the parts that a loop joint or a pair names.
pub(crate) trait Parts {
    /// Returns the part of that name: `body`, or `object/link`.
    fn part(&self, name: &str) -> Option<PartSpec>;
    /// Returns the index of the articulated body of that name.
    fn articulated(&self, name: &str) -> Option<usize>;
    /// Returns all names, for messages.
    fn names(&self) -> Vec<String>;

    /// Returns the sides that `a` and `b` name; reports an unknown name and two equal sides.
    /// `expected` says what `b` may be.
    fn sides<T: Copy + PartialEq>(
        &self,
        f: &Fields<'_>,
        [a, b]: [Option<(&str, &Value<'_>)>; 2],
        find: impl Fn(&str) -> Option<T>,
        expected: &str,
    ) -> [Option<T>; 2] {
        let side = |key: &str, given: Option<(&str, &Value<'_>)>| {
            let (name, value) = given?;
            let found = find(name);
            if found.is_none() {
                f.unknown_name(key, value, name, self.names().iter().map(String::as_str).collect());
            }
            found
        };
        let sides = [side("a", a), side("b", b)];
        if let ([Some(first), Some(second)], Some((_, value))) = (sides, b)
            && first == second
        {
            f.wrong("b", value, expected);
        }
        sides
    }
}

impl LoopJointSpec {
    pub(crate) fn read(mut f: Fields<'_>, parts: &impl Parts) -> Option<LoopJointSpec> {
        let name = read_name(&mut f).unwrap_or_default();
        let Some(kind) = f.choice("type", KINDS) else {
            f.give_up();
            return None;
        };
        let a = f.text("a", "the name of a body, or \"OBJECT/LINK\"");
        let b = f.optional_text("b");
        let position_m = f.vector("position_m", Bound::ANY);
        let axis = match kind {
            LoopJointKind::Revolute | LoopJointKind::Prismatic => f.direction("axis"),
            LoopJointKind::Spherical | LoopJointKind::Fixed => [0.0, 0.0, 1.0],
        };
        let expected = "a part other than `a`; or no `b`, which is the world";
        let sides = parts.sides(&f, [a, b], |name| parts.part(name), expected);
        f.finish();
        Some(LoopJointSpec { name, kind, a: sides[0]?, b: sides[1], position_m, axis })
    }
}

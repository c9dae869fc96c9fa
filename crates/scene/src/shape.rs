//! `shape = { type = … }`: what a body is for collisions, in body axes.

use std::collections::BTreeMap;

use crate::bound::Bound;
use crate::fields::{Fields, Names};

/// The shape of a body, its own axes through its own origin.
#[derive(Clone, Debug, PartialEq)]
pub enum ShapeSpec {
    /// A ball about the origin.
    Sphere {
        /// Metres.
        radius_m: f64,
    },
    /// A box about the origin.
    Box {
        /// Whole edges along x, y and z, metres.
        size_m: [f64; 3],
    },
    /// All points within `radius_m` of a piece of the z axis about the origin.
    Capsule {
        /// Metres.
        radius_m: f64,
        /// Length of that piece: the straight part, without the two caps, metres.
        length_m: f64,
    },
    /// A cylinder along z about the origin.
    Cylinder {
        /// Metres.
        radius_m: f64,
        /// Whole length, metres.
        length_m: f64,
    },
    /// All of space at and below z = 0.
    HalfSpace,
    /// A mesh, its vertices as they stand in its source.
    Mesh {
        /// Index into [`SceneFile::meshes`](crate::SceneFile::meshes).
        mesh: usize,
    },
}

#[derive(Clone, Copy)]
enum Kind {
    Sphere,
    Box,
    Capsule,
    Cylinder,
    HalfSpace,
    Mesh,
}

const KINDS: Names<Kind> = &[
    ("sphere", Kind::Sphere),
    ("box", Kind::Box),
    ("capsule", Kind::Capsule),
    ("cylinder", Kind::Cylinder),
    ("half_space", Kind::HalfSpace),
    ("mesh", Kind::Mesh),
];

impl ShapeSpec {
    /// Reads the key `shape` of a body.
    pub(crate) fn read(body: &mut Fields<'_>, meshes: &BTreeMap<&str, Option<usize>>) -> Option<ShapeSpec> {
        let example = "{ type = \"sphere\", radius_m = 0.5 }";
        let value = body.required("shape", &format!("a shape, such as {example}"))?;
        let mut f = Fields::of(body.log, value, format!("the shape of {}", body.what), example)?;
        let Some(kind) = f.choice("type", KINDS) else {
            f.give_up();
            return None;
        };
        let shape = ShapeSpec::of_kind(&mut f, kind, meshes);
        f.finish();
        shape
    }

    /// Reads a table that is a shape and holds other keys besides; does not finish it.
    pub(crate) fn read_part(f: &mut Fields<'_>, meshes: &BTreeMap<&str, Option<usize>>) -> Option<ShapeSpec> {
        let kind = f.choice("type", KINDS)?;
        ShapeSpec::of_kind(f, kind, meshes)
    }

    fn of_kind(f: &mut Fields<'_>, kind: Kind, meshes: &BTreeMap<&str, Option<usize>>) -> Option<ShapeSpec> {
        match kind {
            Kind::Sphere => Some(ShapeSpec::Sphere { radius_m: f.number("radius_m", Bound::POSITIVE) }),
            Kind::Box => Some(ShapeSpec::Box { size_m: f.vector("size_m", Bound::POSITIVE) }),
            Kind::Capsule => Some(ShapeSpec::Capsule {
                radius_m: f.number("radius_m", Bound::POSITIVE),
                length_m: f.number("length_m", Bound::POSITIVE),
            }),
            Kind::Cylinder => Some(ShapeSpec::Cylinder {
                radius_m: f.number("radius_m", Bound::POSITIVE),
                length_m: f.number("length_m", Bound::POSITIVE),
            }),
            Kind::HalfSpace => Some(ShapeSpec::HalfSpace),
            Kind::Mesh => read_mesh(f, meshes),
        }
    }
}

/// The mesh named by `mesh`; `None` if there is no such mesh or it is itself wrong.
fn read_mesh(f: &mut Fields<'_>, meshes: &BTreeMap<&str, Option<usize>>) -> Option<ShapeSpec> {
    let (name, value) = f.text("mesh", "the NAME of a table [meshes.NAME]")?;
    match meshes.get(name) {
        Some(index) => index.map(|mesh| ShapeSpec::Mesh { mesh }),
        None if meshes.is_empty() => {
            f.wrong("mesh", value, "the NAME of a table [meshes.NAME], and the scene has none");
            None
        }
        None => {
            f.unknown_name("mesh", value, name, meshes.keys().copied().collect());
            None
        }
    }
}

//! `shape = { type = … }`: the collision shape of a body, in body axes.

use std::collections::BTreeMap;

use crate::parse::bound::Bound;
use crate::parse::fields::{Fields, Names};

/// The shape of a body in its own axes and about its own origin.
#[derive(Clone, Debug, PartialEq)]
pub enum ShapeSpec {
    /// A sphere about the origin.
    Sphere {
        /// Meters.
        radius_m: f64,
    },
    /// A box about the origin.
    Box {
        /// Full edge lengths along x, y and z, meters.
        size_m: [f64; 3],
    },
    /// All points within `radius_m` of a segment of the z axis about the origin.
    Capsule {
        /// Meters.
        radius_m: f64,
        /// Length of the segment: the straight part, without the two caps, meters.
        length_m: f64,
    },
    /// A cylinder along z about the origin.
    Cylinder {
        /// Meters.
        radius_m: f64,
        /// Full length, meters.
        length_m: f64,
    },
    /// All points at and below z = 0.
    HalfSpace,
    /// A mesh with the vertices of its source.
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

    /// Reads a shape from a table that has other keys as well. Does not finish the table.
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

/// Returns the mesh named by `mesh`; `None` if there is no such mesh or it is itself wrong.
fn read_mesh(f: &mut Fields<'_>, meshes: &BTreeMap<&str, Option<usize>>) -> Option<ShapeSpec> {
    let (name, value) = f.text("mesh", "the NAME of a table [meshes.NAME]")?;
    match meshes.get(name) {
        Some(index) => index.map(|mesh| ShapeSpec::Mesh { mesh }),
        None if meshes.is_empty() => {
            f.wrong("mesh", value, "the NAME of a table [meshes.NAME]; the scene has none");
            None
        }
        None => {
            f.unknown_name("mesh", value, name, meshes.keys().copied().collect());
            None
        }
    }
}

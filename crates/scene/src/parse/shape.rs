//! `shape = { type = … }`: the collision shape of a body, in body axes.

use std::collections::BTreeMap;

use tumble_core::collide::{Pose, Shape, ShapeError};
use tumble_core::{CollisionGroup, Material, ShapeFilter};

use crate::parse::body::{Library, read_group, read_mask, read_material};
use crate::parse::bound::Bound;
use crate::parse::fields::{Fields, Names};
use crate::parse::material::{has_contact, read_contact};
use crate::parse::rotation;

/// Maximum number of parts of a compound.
const MAX_PARTS: usize = 4096;

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
    /// A box with rounded edges and corners about the origin.
    RoundedBox {
        /// Full edge lengths along x, y and z, meters.
        size_m: [f64; 3],
        /// Radius of edges and corners, meters.
        rounding_m: f64,
    },
    /// A cylinder with rounded rims along z about the origin.
    RoundedCylinder {
        /// Meters.
        radius_m: f64,
        /// Full length, meters.
        length_m: f64,
        /// Radius of the rims, meters.
        rounding_m: f64,
    },
    /// An ellipsoid about the origin.
    Ellipsoid {
        /// Full axes along x, y and z, meters.
        size_m: [f64; 3],
    },
    /// A cone along z with its tip up, about its center of mass.
    Cone {
        /// Radius of the base, meters.
        radius_m: f64,
        /// From base to tip, meters.
        height_m: f64,
    },
    /// All points at and below z = 0; `plane` is another name of it.
    HalfSpace,
    /// A mesh with the vertices of its source.
    Mesh {
        /// Index into [`SceneFile::meshes`](crate::SceneFile::meshes).
        mesh: usize,
    },
    /// Several shapes of one body.
    Compound {
        /// At least one.
        parts: Vec<CompoundPartSpec>,
    },
}

/// A part of a compound.
#[derive(Clone, Debug, PartialEq)]
pub struct CompoundPartSpec {
    /// The shape; no half-space.
    pub shape: ShapeSpec,
    /// Pose of its origin and axes in the frame of the compound.
    pub pose: Pose,
    /// Density, kg/m³; all parts have one or none has.
    pub density_kg_per_m3: Option<f64>,
    /// Surface constants of its own. Default: those of the body.
    pub surface: Option<PartSurface>,
    /// Its group, mask and sensor. Default: those of its body.
    pub filter: PartFilter,
    /// Name, unlike those of all other shapes of the body or link; none for a compound.
    pub name: Option<String>,
}

impl CompoundPartSpec {
    /// Returns its name, or those of its parts.
    fn names(&self) -> Vec<Option<&str>> {
        match &self.shape {
            inner @ ShapeSpec::Compound { .. } => inner.names(),
            _ => vec![self.name.as_deref()],
        }
    }
}

/// Surface constants of a part of a compound.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PartSurface {
    /// Index into [`SceneFile::materials`](crate::SceneFile::materials): the part's own, else that of its body.
    pub material: Option<usize>,
    /// Contact constants: the part's own, else those of the material that it names, else its body's.
    pub contact: Material,
}

/// Group, mask and sensor of a part of a compound, as far as they are not those of its body or link.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PartFilter {
    /// Its collision group.
    pub group: Option<CollisionGroup>,
    /// Groups that it collides with, one bit each.
    pub mask: Option<u64>,
    /// Whether it has no contacts, and the world reports the bodies that overlap it.
    pub sensor: Option<bool>,
}

impl PartFilter {
    /// Returns this filter with what it lacks from another one.
    fn or(self, other: PartFilter) -> PartFilter {
        PartFilter {
            group: self.group.or(other.group),
            mask: self.mask.or(other.mask),
            sensor: self.sensor.or(other.sensor),
        }
    }

    /// Returns the filter of a part of a body with the filter `body`; `None` if it has none of its own.
    pub(crate) fn of_part(self, body: ShapeFilter) -> Option<ShapeFilter> {
        (self != PartFilter::default()).then(|| ShapeFilter {
            group: self.group.unwrap_or(body.group),
            mask: self.mask.unwrap_or(body.mask),
            sensor: self.sensor.unwrap_or(body.sensor),
        })
    }

    fn read(f: &mut Fields<'_>) -> PartFilter {
        let given = |f: &Fields<'_>, key: &str| f.entries().any(|(name, ..)| name == key);
        let [group, mask, sensor] = ["group", "mask", "sensor"].map(|key| given(f, key));
        PartFilter {
            group: group.then(|| read_group(f, CollisionGroup::default())),
            mask: mask.then(|| read_mask(f, u64::MAX)),
            sensor: sensor.then(|| f.flag_or("sensor", false)),
        }
    }
}

/// Meshes and materials that a shape refers to.
#[derive(Clone, Copy)]
pub(crate) struct ShapeContext<'a> {
    pub meshes: &'a BTreeMap<&'a str, Option<usize>>,
    /// Materials of the scene, and the surface of the body; `None` where parts have no surfaces of their own.
    pub surface: Option<(&'a Library<'a>, PartSurface)>,
}

impl<'a> ShapeContext<'a> {
    /// Returns the context of a shape whose parts have no surfaces of their own.
    pub fn of_meshes(meshes: &'a BTreeMap<&'a str, Option<usize>>) -> ShapeContext<'a> {
        ShapeContext { meshes, surface: None }
    }
}

#[derive(Clone, Copy)]
enum Kind {
    Sphere,
    Box,
    Capsule,
    Cylinder,
    Ellipsoid,
    Cone,
    HalfSpace,
    Mesh,
    Compound,
}

const KINDS: Names<Kind> = &[
    ("sphere", Kind::Sphere),
    ("box", Kind::Box),
    ("capsule", Kind::Capsule),
    ("cylinder", Kind::Cylinder),
    ("ellipsoid", Kind::Ellipsoid),
    ("cone", Kind::Cone),
    ("half_space", Kind::HalfSpace),
    ("plane", Kind::HalfSpace),
    ("mesh", Kind::Mesh),
    ("compound", Kind::Compound),
];

impl ShapeSpec {
    /// Reads the key `shape` of a body, with the name of the shape.
    pub(crate) fn read(body: &mut Fields<'_>, context: ShapeContext<'_>) -> Option<(ShapeSpec, Option<String>)> {
        let example = "{ type = \"sphere\", radius_m = 0.5 }";
        let value = body.required("shape", &format!("a shape, such as {example}"))?;
        let mut f = Fields::of(body.log, value, format!("the shape of {}", body.what), example)?;
        let Some(kind) = f.choice("type", KINDS) else {
            f.give_up();
            return None;
        };
        let name = read_shape_name(&mut f, matches!(kind, Kind::Compound));
        let shape = ShapeSpec::of_kind(&mut f, kind, context);
        f.finish();
        shape.map(|shape| (shape, name))
    }

    /// Reads a shape from a table that has other keys as well. Does not finish the table.
    pub(crate) fn read_part(f: &mut Fields<'_>, context: ShapeContext<'_>) -> Option<ShapeSpec> {
        let kind = f.choice("type", KINDS)?;
        ShapeSpec::of_kind(f, kind, context)
    }

    fn of_kind(f: &mut Fields<'_>, kind: Kind, context: ShapeContext<'_>) -> Option<ShapeSpec> {
        match kind {
            Kind::Sphere => Some(ShapeSpec::Sphere { radius_m: f.number("radius_m", Bound::POSITIVE) }),
            Kind::Box => {
                let size_m: [f64; 3] = f.vector("size_m", Bound::POSITIVE);
                let rounding = read_rounding(f, |rounding| Shape::rounded_cuboid(size_m.into(), rounding));
                Some(
                    rounding
                        .map_or(ShapeSpec::Box { size_m }, |rounding_m| ShapeSpec::RoundedBox { size_m, rounding_m }),
                )
            }
            Kind::Ellipsoid => {
                let size_m: [f64; 3] = f.vector("size_m", Bound::POSITIVE);
                check(f, "size_m", Shape::ellipsoid(size_m.into()));
                Some(ShapeSpec::Ellipsoid { size_m })
            }
            Kind::Cone => {
                let (radius_m, height_m) =
                    (f.number("radius_m", Bound::POSITIVE), f.number("height_m", Bound::POSITIVE));
                check(f, "height_m", Shape::cone(radius_m, height_m));
                Some(ShapeSpec::Cone { radius_m, height_m })
            }
            Kind::Capsule => Some(ShapeSpec::Capsule {
                radius_m: f.number("radius_m", Bound::POSITIVE),
                length_m: f.number("length_m", Bound::POSITIVE),
            }),
            Kind::Cylinder => {
                let (radius_m, length_m) =
                    (f.number("radius_m", Bound::POSITIVE), f.number("length_m", Bound::POSITIVE));
                let rounding = read_rounding(f, |rounding| Shape::rounded_cylinder(radius_m, length_m, rounding));
                Some(match rounding {
                    Some(rounding_m) => ShapeSpec::RoundedCylinder { radius_m, length_m, rounding_m },
                    None => ShapeSpec::Cylinder { radius_m, length_m },
                })
            }
            Kind::HalfSpace => Some(ShapeSpec::HalfSpace),
            Kind::Mesh => read_mesh(f, context.meshes),
            Kind::Compound => read_compound(f, context),
        }
    }

    /// Returns whether it is a compound.
    pub(crate) fn is_compound(&self) -> bool {
        matches!(self, ShapeSpec::Compound { .. })
    }

    /// Returns whether the shape has densities of its own.
    pub(crate) fn has_density(&self) -> bool {
        let has = |part: &CompoundPartSpec| part.density_kg_per_m3.is_some() || part.shape.has_density();
        matches!(self, ShapeSpec::Compound { parts } if parts.iter().any(has))
    }

    /// Returns the surface of each part of a compound, with the parts of compounds in it one by one, as
    /// [`Shape::compound`] makes them.
    pub(crate) fn surfaces(&self) -> Vec<Option<PartSurface>> {
        let ShapeSpec::Compound { parts } = self else { return vec![None] };
        let of_part = |part: &CompoundPartSpec| {
            let own = part.surface;
            part.shape.surfaces().into_iter().map(move |inner| inner.or(own))
        };
        parts.iter().flat_map(of_part).collect()
    }

    /// Returns what each part of a compound collides with, one by one like [`surfaces`](Self::surfaces).
    pub(crate) fn filters(&self) -> Vec<PartFilter> {
        let ShapeSpec::Compound { parts } = self else { return vec![PartFilter::default()] };
        let of_part = |part: &CompoundPartSpec| {
            let own = part.filter;
            part.shape.filters().into_iter().map(move |inner| inner.or(own))
        };
        parts.iter().flat_map(of_part).collect()
    }

    /// Returns the names of its parts, one by one like [`surfaces`](Self::surfaces).
    fn names(&self) -> Vec<Option<&str>> {
        let ShapeSpec::Compound { parts } = self else { return vec![None] };
        parts.iter().flat_map(CompoundPartSpec::names).collect()
    }

    /// Adds `by` to the indices of its meshes.
    pub fn shift_meshes(&mut self, by: usize) {
        match self {
            ShapeSpec::Mesh { mesh } => *mesh += by,
            ShapeSpec::Compound { parts } => parts.iter_mut().for_each(|part| part.shape.shift_meshes(by)),
            _ => {}
        }
    }
}

/// Returns the key `rounding_m` of a shape that `make` makes, if it is there and not 0.
fn read_rounding(f: &mut Fields<'_>, make: impl Fn(f64) -> Result<Shape, ShapeError>) -> Option<f64> {
    let rounding = f.optional_number("rounding_m", Bound::NOT_NEGATIVE).filter(|rounding| *rounding != 0.0)?;
    check(f, "rounding_m", make(rounding));
    Some(rounding)
}

/// Reports a value that cannot be a shape; numbers that are wrong themselves have been reported.
fn check(f: &mut Fields<'_>, key: &'static str, made: Result<Shape, ShapeError>) {
    if let Err(why @ (ShapeError::Rounding { rounding: x, .. } | ShapeError::Aspect { smallest: x, .. })) = made
        && x.is_finite()
        && let Some(value) = f.value(key)
    {
        f.wrong(key, value, format!("other sizes: {why}"));
    }
}

/// Returns the compound of the list `parts`; `None` if a part is wrong.
fn read_compound(f: &mut Fields<'_>, context: ShapeContext<'_>) -> Option<ShapeSpec> {
    let example = "{ type = \"sphere\", radius_m = 0.5, position_m = [1, 0, 0] }";
    let expected = format!("a list of shapes, such as [{example}]");
    let given = f.required("parts", &expected)?;
    let values = f.list("parts", MAX_PARTS, &expected);
    if values.is_empty() {
        if given.get_ref().as_array().is_some_and(|items| items.is_empty()) {
            f.wrong("parts", given, expected);
        }
        return None;
    }
    let (what, count) = (f.what.clone(), values.len());
    let named = |n: usize| format!("part {} of {what}", n + 1);
    let (mut parts, mut names) = (Vec::with_capacity(count), ShapeNames::default());
    for (n, value) in values.into_iter().enumerate() {
        let Some(mut part) = Fields::of(f.log, value, named(n), example) else { continue };
        let surface = read_surface(&mut part, context);
        let base = context.surface.map(|(library, body)| (library, surface.unwrap_or(body)));
        let Some(shape) = ShapeSpec::read_part(&mut part, ShapeContext { surface: base, ..context }) else {
            part.give_up();
            continue;
        };
        if shape == ShapeSpec::HalfSpace {
            let message = format!("{} is a half-space, which is unbounded", part.what);
            let expected = "expected a shape of finite size; make the half-space a static [[body]]";
            part.log.report(part.span.clone(), message, expected);
        }
        let name = read_shape_name(&mut part, shape.is_compound());
        names.check(&part, name.as_deref(), &shape);
        let pose = rotation::read_pose(&mut part);
        let density_kg_per_m3 = part.optional_number("density_kg_per_m3", Bound::POSITIVE);
        // as the surfaces: only what collides has them
        let filter = context.surface.map_or(PartFilter::default(), |_| PartFilter::read(&mut part));
        part.finish();
        parts.push(CompoundPartSpec { shape, pose, density_kg_per_m3, surface, filter, name });
    }
    let own = |part: &CompoundPartSpec| part.density_kg_per_m3.is_some() || part.shape.has_density();
    if let Some(n) = parts.iter().position(|part| own(part) != own(&parts[0])) {
        let message = format!("{} has {} density, unlike part 1", named(n), if own(&parts[n]) { "a" } else { "no" });
        f.log.report(f.span.clone(), message, "expected a density for all parts, or for none");
    }
    (parts.len() == count).then_some(ShapeSpec::Compound { parts })
}

/// Reads the surface of a part of a compound; `None` if it has no key of one.
fn read_surface(f: &mut Fields<'_>, context: ShapeContext<'_>) -> Option<PartSurface> {
    let (library, body) = context.surface?;
    let own = has_contact(f);
    let named = read_material(f, library);
    let base = named.map_or(body.contact, |index| library.materials[index].contact);
    let surface = PartSurface { material: named.or(body.material), contact: read_contact(f, &base) };
    (own || named.is_some()).then_some(surface)
}

/// Reads the name of a shape.
pub(crate) fn read_shape_name(f: &mut Fields<'_>, is_compound: bool) -> Option<String> {
    let (name, value) = f.optional_text("name")?;
    if name.is_empty() || name.chars().any(char::is_control) {
        f.wrong("name", value, "a name that is not empty and has no control characters");
    } else if is_compound {
        f.wrong("name", value, "no name for a compound, but one for each of its parts");
    }
    Some(name.to_owned())
}

/// The names of the shapes of one body or link, each with the shape that has it.
#[derive(Default)]
pub(crate) struct ShapeNames(BTreeMap<String, String>);

impl ShapeNames {
    /// Reports each name of a shape, or of its parts, that an earlier shape has.
    pub(crate) fn check(&mut self, f: &Fields<'_>, name: Option<&str>, shape: &ShapeSpec) {
        for name in name.into_iter().chain(shape.names().into_iter().flatten()) {
            match self.0.get(name) {
                Some(first) => {
                    let message = format!("{} has the name \"{name}\" of {first}", f.what);
                    f.log.report(f.span.clone(), message, "expected different names of the shapes of a body or link");
                }
                None => drop(self.0.insert(name.to_owned(), f.what.clone())),
            }
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

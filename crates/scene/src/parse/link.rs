//! `[[articulated.link]]`: a link with its joint, shapes and mass.

use std::path::PathBuf;
use std::sync::Arc;

use toml::de::DeValue;
use tumble_core::articulated::LinkMass;
use tumble_core::collide::{ContactMode, Mat3, Pose, TriMesh, Vec3};
use tumble_core::{CollisionGroup, Joint, Material};

use crate::parse::appearance::{AppearanceSpec, Color, as_color};
use crate::parse::body::{Library, MassSpec, read_direction, read_group, read_mask, read_material, read_name};
use crate::parse::bound::Bound;
use crate::parse::fields::{Fields, Value};
use crate::parse::joint::JointSpec;
use crate::parse::material::read_contact;
use crate::parse::mesh::read_path;
use crate::parse::mount::Mounts;
use crate::parse::rotation;
use crate::parse::shape::{PartSurface, ShapeContext, ShapeNames, ShapeSpec, read_shape_name};
use crate::parse::world::CONTACTS;

/// Largest number of shapes of one link.
const MAX_SHAPES: usize = 1000;

/// A link at time 0 with all references resolved.
#[derive(Clone, Debug, PartialEq)]
pub struct LinkSpec {
    /// Unique in its body.
    pub name: String,
    /// Index of the parent link, always an earlier one; `None` for the base.
    pub parent: Option<usize>,
    /// The joint's frame in the frame of the parent link, or of the base.
    pub placement: Pose,
    /// The joint that connects it to its parent.
    pub joint: JointSpec,
    /// Its mass.
    pub mass: LinkMassSpec,
    /// Collision shapes and visuals.
    pub shapes: Vec<LinkShape>,
    /// The camera and the light attached to the link, in axes of the link.
    pub mounts: Mounts,
}

impl LinkSpec {
    /// Returns the mass that the file gives in numbers; no mass if it comes from shapes.
    pub(crate) fn given_mass(&self) -> LinkMass {
        match self.mass {
            LinkMassSpec::Given(mass) => mass,
            LinkMassSpec::OfShapes | LinkMassSpec::Spread(_) => LinkMass::none(),
        }
    }

    /// Returns whether the link has any mass or inertia.
    pub(crate) fn has_mass(&self) -> bool {
        match &self.mass {
            LinkMassSpec::OfShapes => self.shapes.iter().any(|shape| shape.mass.is_some()),
            LinkMassSpec::Spread(_) => true,
            LinkMassSpec::Given(mass) => mass.mass > 0.0 || mass.inertia.amax() > 0.0,
        }
    }
}

/// The mass of a link.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LinkMassSpec {
    /// The sum of the masses of its shapes; none without shapes.
    OfShapes,
    /// Distributed over the volumes of all its shapes.
    Spread(MassSpec),
    /// Mass, center of mass and inertia in numbers, link frame.
    Given(LinkMass),
}

/// A shape on a link.
#[derive(Clone, Debug, PartialEq)]
pub struct LinkShape {
    /// Pose of the shape's own axes in the link's frame.
    pub pose: Pose,
    /// The geometry.
    pub geometry: Geometry,
    /// The mass of the shape itself, if given.
    pub mass: Option<MassSpec>,
    /// Surface and appearance.
    pub surface: Surface,
    /// Takes part in contacts.
    pub collidable: bool,
    /// Is drawn.
    pub visible: bool,
    /// Name, unlike those of all other shapes of the link; none for a compound, whose parts have names.
    pub name: Option<String>,
    /// Direction, of any length above 0, in the shape's own axes, of a shape that collides on one side only.
    pub one_way: Option<[f64; 3]>,
    /// Is a sensor: it has no contacts, and the world reports the bodies that overlap it.
    pub sensor: bool,
}

/// The geometry of a shape on a link.
#[derive(Clone, Debug, PartialEq)]
pub enum Geometry {
    /// A shape of the scene.
    Shape(ShapeSpec),
    /// A mesh file, as URDF names them.
    File {
        /// A mesh that existed when the file that names it was read.
        path: PathBuf,
        /// Meters per unit along x, y and z; a negative number mirrors.
        scale: [f64; 3],
        /// File and line that name the mesh.
        place: String,
        /// Whether its convex hull collides instead of the mesh.
        hull: bool,
        /// Whether an unreadable mesh is an error. Otherwise it is left out.
        required: bool,
    },
    /// A closed mesh that was read or made with the file that names it.
    Solid {
        /// The name; each has one mesh.
        name: String,
        /// Closed and wound outwards, meters.
        mesh: Arc<TriMesh>,
    },
}

/// Contact constants and appearance of a shape.
#[derive(Clone, Debug, PartialEq)]
pub struct Surface {
    /// Index into [`SceneFile::materials`](crate::SceneFile::materials), if a material is named.
    pub material: Option<usize>,
    /// Contact constants.
    pub contact: Material,
    /// Contact mode of meshes and cylinders.
    pub contacts: ContactMode,
    /// Collision group.
    pub group: CollisionGroup,
    /// Groups that it collides with, one bit each.
    pub mask: u64,
    /// Appearance.
    pub appearance: AppearanceSpec,
}

impl Default for Surface {
    fn default() -> Surface {
        Surface {
            material: None,
            contact: Material::default(),
            contacts: ContactMode::default(),
            group: CollisionGroup::default(),
            mask: u64::MAX,
            appearance: AppearanceSpec::default(),
        }
    }
}

impl Surface {
    /// Reads the surface keys. Absent keys are taken from the named material, else from `base`.
    pub(crate) fn read(f: &mut Fields<'_>, library: &Library<'_>, base: &Surface) -> Surface {
        let material = read_material(f, library);
        let named = material.map(|index| &library.materials[index]);
        let (contact, appearance) = named.map_or((&base.contact, &base.appearance), |m| (&m.contact, &m.appearance));
        Surface {
            material: material.or(base.material),
            contact: read_contact(f, contact),
            contacts: f.choice_or("contacts", CONTACTS, base.contacts),
            group: read_group(f, base.group),
            mask: read_mask(f, base.mask),
            appearance: AppearanceSpec::read(f, appearance),
        }
    }
}

/// The links of one table `[[articulated.link]]`: one link, or a chain of `count` equal ones.
pub(crate) struct LinkRow<'a> {
    pub(crate) link: LinkSpec,
    /// Number of links, each attached to the one before.
    pub(crate) count: usize,
    /// Placement of each link but the first in the one before it.
    pub(crate) next: Pose,
    pub(crate) colors: Vec<Color>,
    /// The joint that its joint follows.
    pub(crate) mimic: Option<(&'a str, &'a Value<'a>)>,
}

/// Defaults that links take from their body.
pub(crate) struct Inherited<'l, 's> {
    pub(crate) library: &'l Library<'l>,
    pub(crate) surface: &'s Surface,
    pub(crate) collidable: bool,
    pub(crate) visible: bool,
    /// Whether a link without a parent floats.
    pub(crate) floating: bool,
    /// Number of links that may still be added.
    pub(crate) room: usize,
}

impl<'a> LinkRow<'a> {
    /// Reads a link. `names` has the names of all earlier links.
    pub(crate) fn read(f: &mut Fields<'a>, from: &Inherited<'_, '_>, names: &[&str]) -> Option<LinkRow<'a>> {
        let name = read_name(f).unwrap_or_default();
        let parent = read_parent(f, names);
        let placement = rotation::read_pose(f);
        let floats = from.floating && parent.is_none();
        let joint = if floats { read_floating(f, &name) } else { JointSpec::read(f, &name) };
        let surface = Surface::read(f, from.library, from.surface);
        let from = Inherited {
            surface: &surface,
            library: from.library,
            floating: from.floating,
            room: from.room,
            collidable: f.flag_or("collidable", from.collidable),
            visible: f.flag_or("visible", from.visible),
        };
        let mut shapes = read_shapes(f, &from);
        let mounts = Mounts::read(f);
        let mass = read_mass(f, &shapes);
        if mass == LinkMassSpec::OfShapes {
            let solid = |shape: &&mut LinkShape| matches!(shape.geometry, Geometry::Shape(_));
            shapes.iter_mut().filter(solid).for_each(|shape| shape.mass = shape.mass.or(Some(MassSpec::Usual)));
        }
        let (count, next, colors) = read_repeat(f, from.room);
        let mut joint = joint?;
        let mimic = joint.read_mimic(f);
        Some(LinkRow {
            link: LinkSpec { name, parent, placement, joint, mass, shapes, mounts },
            count,
            next,
            colors,
            mimic,
        })
    }

    /// Appends the links: `name`, or `name_1` to `name_n`.
    pub(crate) fn append_to(self, links: &mut Vec<LinkSpec>) {
        for k in 0..self.count {
            let mut link = self.link.clone();
            if self.count > 1 {
                link.name = format!("{}_{}", self.link.name, k + 1);
                link.joint.name.clone_from(&link.name);
            }
            if k > 0 {
                (link.parent, link.placement) = (Some(links.len() - 1), self.next);
            }
            if !self.colors.is_empty() {
                link.shapes.iter_mut().for_each(|s| s.surface.appearance.color = self.colors[k % self.colors.len()]);
            }
            links.push(link);
        }
    }
}

fn read_floating(f: &mut Fields<'_>, name: &str) -> Option<JointSpec> {
    if let Some(value) = f.value("joint") {
        f.wrong("joint", value, "no joint, since the root of a floating body has none; or floating = false");
        JointSpec::read(f, name);
    }
    Some(JointSpec::new(name, Joint::Floating))
}

fn read_parent(f: &mut Fields<'_>, names: &[&str]) -> Option<usize> {
    let (name, value) = f.optional_text("parent")?;
    let found = names.iter().position(|other| *other == name);
    match found {
        Some(_) => {}
        None if names.is_empty() => {
            f.wrong("parent", value, "no parent for the first link, which is attached to the base")
        }
        None => f.unknown_name("parent", value, name, names.to_vec()),
    }
    found
}

fn read_shapes(f: &mut Fields<'_>, from: &Inherited<'_, '_>) -> Vec<LinkShape> {
    let what = f.what.clone();
    let example = "{ type = \"sphere\", radius_m = 0.5 }";
    let single = f.value("shape");
    let several = f.list("shapes", MAX_SHAPES, &format!("a list of shapes, such as [{example}]"));
    if single.is_some() && f.value("shapes").is_some() {
        f.log.report(f.span.clone(), format!("{what} has both `shape` and `shapes`"), "expected one of them");
    }
    let all = single.into_iter().map(|value| (value, format!("the shape of {what}")));
    let all =
        all.chain(several.into_iter().enumerate().map(|(n, value)| (value, format!("shape {} of {what}", n + 1))));
    let mut names = ShapeNames::default();
    all.filter_map(|(value, what)| LinkShape::read(Fields::of(f.log, value, what, example)?, from, &mut names))
        .collect()
}

impl LinkShape {
    fn read(mut f: Fields<'_>, from: &Inherited<'_, '_>, names: &mut ShapeNames) -> Option<LinkShape> {
        if f.value("type").and_then(|value| value.get_ref().as_str()) == Some("visual_mesh") {
            return LinkShape::read_visual(f, from);
        }
        let surface = Surface::read(&mut f, from.library, from.surface);
        let of_parts = PartSurface { material: surface.material, contact: surface.contact };
        let context = ShapeContext { meshes: &from.library.meshes, surface: Some((from.library, of_parts)) };
        let Some(shape) = ShapeSpec::read_part(&mut f, context) else {
            f.give_up();
            return None;
        };
        if shape == ShapeSpec::HalfSpace {
            let message = format!("{} is a half-space, which is unbounded", f.what);
            f.log.report(
                f.span.clone(),
                message,
                "expected a shape of finite size; make the half-space a static [[body]]",
            );
        }
        let name = read_shape_name(&mut f, shape.is_compound());
        names.check(&f, name.as_deref(), &shape);
        let mass = f.optional_number("mass_kg", Bound::POSITIVE).map(MassSpec::Mass);
        let density = f.optional_number("density_kg_per_m3", Bound::POSITIVE).map(MassSpec::Density);
        if mass.is_some() && density.is_some() {
            let message = format!("{} has both `mass_kg` and `density_kg_per_m3`", f.what);
            f.log.report(f.span.clone(), message, "expected one of them");
        }
        let read = LinkShape {
            pose: rotation::read_pose(&mut f),
            geometry: Geometry::Shape(shape),
            mass: mass.or(density),
            surface,
            collidable: f.flag_or("collidable", from.collidable),
            visible: f.flag_or("visible", from.visible),
            name,
            one_way: read_direction(&mut f, "one_way"),
            sensor: f.flag_or("sensor", false),
        };
        f.finish();
        Some(read)
    }
}

impl LinkShape {
    /// Reads a mesh that is only drawn, from its file.
    fn read_visual(mut f: Fields<'_>, from: &Inherited<'_, '_>) -> Option<LinkShape> {
        let folder = f.log.folder().to_path_buf();
        let scale = f.number_or("scale", Bound::POSITIVE, 1.0);
        let path = read_path(&mut f, &folder);
        let (pose, surface) = (rotation::read_pose(&mut f), Surface::read(&mut f, from.library, from.surface));
        let visible = f.flag_or("visible", from.visible);
        let place = f.what.clone();
        f.finish();
        let geometry = Geometry::File { path: path?, scale: [scale; 3], place, hull: false, required: true };
        let (name, one_way) = (None, None);
        Some(LinkShape {
            pose,
            geometry,
            mass: None,
            surface,
            collidable: false,
            visible,
            name,
            one_way,
            sensor: false,
        })
    }
}

fn read_mass(f: &mut Fields<'_>, shapes: &[LinkShape]) -> LinkMassSpec {
    let mass = f.optional_number("mass_kg", Bound::NOT_NEGATIVE);
    let density = f.optional_number("density_kg_per_m3", Bound::POSITIVE);
    let center = f.optional_vector::<3>("center_m", Bound::ANY);
    let inertia = read_inertia(f);
    let solid = |shape: &&LinkShape| matches!(shape.geometry, Geometry::Shape(_));
    let (own, solids) = (shapes.iter().filter(|s| s.mass.is_some()).count(), shapes.iter().filter(solid).count());
    let given = mass.is_some() || density.is_some() || center.is_some() || inertia.is_some();
    let contradiction =
        |message: &str, expected: &str| f.log.report(f.span.clone(), format!("{} {message}", f.what), expected);
    if given && own > 0 {
        contradiction("has a mass, and its shapes have masses", "expected the mass of the link, or that of each shape");
    } else if mass.is_some() && density.is_some() {
        contradiction("has both `mass_kg` and `density_kg_per_m3`", "expected one of them");
    } else if (center.is_some() || inertia.is_some()) && mass.is_none() {
        contradiction("has `center_m` or `inertia_kg_m2` but no `mass_kg`", "expected `mass_kg` with them");
    } else if inertia.is_none() && center.is_some() && solids > 0 {
        contradiction(
            "has `center_m` but no `inertia_kg_m2`",
            "expected both, or neither: the mass is then distributed over the shapes",
        );
    } else if density.is_some() && solids == 0 {
        contradiction(
            "has a density but no shape",
            "expected a shape, or `mass_kg` with `center_m` and `inertia_kg_m2`",
        );
    }
    match (mass, density) {
        (Some(mass), _) if inertia.is_some() || solids == 0 || mass == 0.0 => {
            let center = Vec3::from(center.unwrap_or_default());
            LinkMassSpec::Given(LinkMass { mass, center, inertia: inertia.unwrap_or_default() })
        }
        (Some(mass), _) => LinkMassSpec::Spread(MassSpec::Mass(mass)),
        (None, Some(density)) => LinkMassSpec::Spread(MassSpec::Density(density)),
        (None, None) => LinkMassSpec::OfShapes,
    }
}

/// Reads `inertia_kg_m2`: `[xx, yy, zz]` or `[xx, yy, zz, xy, xz, yz]` about the center of mass.
pub(crate) fn read_inertia(f: &mut Fields<'_>) -> Option<Mat3> {
    let value = f.value("inertia_kg_m2")?;
    let problems = f.log.count();
    let long = matches!(value.get_ref(), DeValue::Array(items) if items.len() == 6);
    let [xx, yy, zz, xy, xz, yz]: [f64; 6] = match long {
        true => f.as_vector("inertia_kg_m2", value, Bound::ANY),
        false => {
            let [xx, yy, zz] = f.as_vector("inertia_kg_m2", value, Bound::ANY);
            [xx, yy, zz, 0.0, 0.0, 0.0]
        }
    };
    let inertia = Mat3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
    if f.log.count() == problems
        && let Some(why) = inertia_fault(&inertia)
    {
        f.wrong("inertia_kg_m2", value, why);
    }
    Some(inertia)
}

/// Returns why a symmetric matrix cannot be an inertia about a center of mass: a principal moment
/// is negative, or one is greater than the sum of the others.
pub(crate) fn inertia_fault(inertia: &Mat3) -> Option<InertiaFault> {
    let mut moments: Vec<f64> = inertia.symmetric_eigenvalues().iter().copied().collect();
    moments.sort_by(f64::total_cmp);
    let size = inertia.amax();
    let [a, b, c] = [moments[0], moments[1], moments[2]];
    if a < -1e-9 * size && a < -1e-12 {
        return Some(InertiaFault::Negative(a));
    }
    (c > a + b + 1e-6 * size && c > a + b + 1e-9).then_some(InertiaFault::Triangle([a, b, c]))
}

/// Why a matrix is not an inertia.
#[derive(Debug)]
pub(crate) enum InertiaFault {
    /// The smallest principal moment.
    Negative(f64),
    /// All principal moments, the smallest first.
    Triangle([f64; 3]),
}

impl std::fmt::Display for InertiaFault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            InertiaFault::Negative(a) => write!(f, "principal moments of at least 0; the smallest is {a:.6e} kg·m²"),
            InertiaFault::Triangle([a, b, c]) => {
                write!(
                    f,
                    "no principal moment greater than the sum of the others; they are {a:.6e}, {b:.6e} and {c:.6e} kg·m²"
                )
            }
        }
    }
}

/// Reads `repeat`: count, placement of each next link, and colors that the links take in turn.
fn read_repeat(f: &mut Fields<'_>, room: usize) -> (usize, Pose, Vec<Color>) {
    let Some(mut repeat) = f.table("repeat", "{ count = 10, position_m = [0, 0, -0.1] }") else {
        return (1, Pose::identity(), Vec::new());
    };
    let most = room.clamp(1, 10_000) as u32;
    let count = match repeat.required("count", "how many links there are") {
        Some(value) => repeat.as_integer("count", value, 1..=most) as usize,
        None => 1,
    };
    let next = rotation::read_pose(&mut repeat);
    let colors = repeat.list("colors", 1000, "a list of colors, which the links take in turn");
    let colors = colors.into_iter().map(|value| as_color(&repeat, "colors", value)).collect();
    repeat.finish();
    (count, next, colors)
}

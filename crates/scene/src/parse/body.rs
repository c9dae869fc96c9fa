//! `[[body]]`: one rigid body.

use std::collections::BTreeMap;

use tumble_core::collide::ContactMode;
use tumble_core::collide::Mat3;
use tumble_core::{CollisionGroup, LockedAxes, Material, Mode};

use crate::parse::appearance::AppearanceSpec;
use crate::parse::bound::Bound;
use crate::parse::fields::{Fields, Names};
use crate::parse::link::read_inertia;
use crate::parse::material::{MaterialSpec, read_contact, read_sound};
use crate::parse::mount::Mounts;
use crate::parse::rotation;
use crate::parse::shape::{PartSurface, ShapeContext, ShapeSpec};
use crate::parse::world::CONTACTS;

pub(crate) const MODES: Names<Mode> =
    &[("dynamic", Mode::Dynamic), ("static", Mode::Static), ("kinematic", Mode::Kinematic)];

/// Numbers of collision groups.
pub(crate) const GROUPS: std::ops::RangeInclusive<u32> = 0..=63;

/// The mass of a body or shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MassSpec {
    /// Total mass with uniform density, kg.
    Mass(f64),
    /// Density, kg/m³.
    Density(f64),
    /// The densities of the parts of a compound, and that of water, 1000 kg/m³, of other shapes.
    Usual,
}

/// A rigid body at time 0 with all references resolved and all defaults filled in.
#[derive(Clone, Debug, PartialEq)]
pub struct BodySpec {
    /// Unique in the scene; of any length.
    pub name: String,
    /// Default `dynamic`.
    pub mode: Mode,
    /// The shape in body axes.
    pub shape: ShapeSpec,
    /// Name of the shape; none for a compound, whose parts have names.
    pub shape_name: Option<String>,
    /// Present for every dynamic body.
    pub mass: Option<MassSpec>,
    /// Position of the origin of the *shape*, world axes, m. The center of mass of a mesh or a
    /// profile may be elsewhere: at `position_m` + R·(its position in the shape).
    pub position_m: [f64; 3],
    /// Body axes to world axes, unit quaternion `[x, y, z, w]`.
    pub orientation_xyzw: [f64; 4],
    /// Velocity of the center of mass, world axes, m/s.
    pub velocity_m_per_s: [f64; 3],
    /// World axes, rad/s.
    pub angular_velocity_rad_per_s: [f64; 3],
    /// Index into [`SceneFile::materials`](crate::SceneFile::materials), if the body names a
    /// material.
    pub material: Option<usize>,
    /// Contact constants: the body's own, else its material's, else the default ones.
    pub contact: Material,
    /// Contact mode of a mesh or cylinder. Default: that of the world.
    pub contacts: ContactMode,
    /// Center of mass in the shape's frame, m. Default: that of the uniform shape.
    pub center_m: Option<[f64; 3]>,
    /// Inertia about the center of mass, body axes, kg·m². Default: that of the uniform shape.
    pub inertia_kg_m2: Option<Mat3>,
    /// Factor of the world's gravity. Default 1.
    pub gravity_scale: f64,
    /// Axes of the world along which it does not move, or about which it does not turn. Default none.
    pub locked: LockedAxes,
    /// Rate at which velocity decays, 1/s: `dv/dt = −c v`. Default 0.
    pub linear_damping_per_s: f64,
    /// Rate at which angular velocity decays, 1/s. Default 0.
    pub angular_damping_per_s: f64,
    /// Takes part in contacts. Default true.
    pub collidable: bool,
    /// Collision group, 0 to 63. Default 0.
    pub group: CollisionGroup,
    /// Groups that it collides with, one bit each. Default all.
    pub mask: u64,
    /// Is a sensor: it has no contacts, and the world reports the bodies that overlap it. Default
    /// false.
    pub sensor: bool,
    /// Direction, in the shape's frame, of a body that collides on one side only. Default none.
    pub one_way: Option<[f64; 3]>,
    /// Takes part in the simulation. Default true.
    pub enabled: bool,
    /// Is drawn. Default true.
    pub visible: bool,
    /// How it sounds: the name of a material of `tumble::sound`, its own, else that of its material. Default by density.
    pub sound: Option<String>,
    /// Appearance of the body: that of its material with the body's own keys on top.
    pub appearance: AppearanceSpec,
    /// The camera and the light attached to the body, in axes of the shape.
    pub mounts: Mounts,
}

/// Meshes and materials by name. A name without an index belongs to an entry that is itself wrong.
pub(crate) struct Library<'a> {
    pub(crate) meshes: BTreeMap<&'a str, Option<usize>>,
    pub(crate) material_names: BTreeMap<&'a str, usize>,
    pub(crate) materials: &'a [MaterialSpec],
    /// Default contact mode, from `[world]`.
    pub(crate) contacts: ContactMode,
}

impl BodySpec {
    /// Reads all keys of a body. Does not finish the table, since a grid has more keys.
    pub(crate) fn read(f: &mut Fields<'_>, library: &Library<'_>) -> Option<BodySpec> {
        let name = read_name(f);
        let mode = read_mode(f);
        let material = read_material(f, library);
        let base = material.map(|index| &library.materials[index]);
        let contact = read_contact(f, &base.map_or_else(Material::default, |m| m.contact));
        let surface = PartSurface { material, contact };
        let context = ShapeContext { meshes: &library.meshes, surface: Some((library, surface)) };
        let (shape, shape_name) = ShapeSpec::read(f, context).map_or((None, None), |(shape, name)| (Some(shape), name));
        let mass = read_mass(f, mode);
        let appearance = base.map_or_else(AppearanceSpec::default, |m| m.appearance.clone());
        let [linear, angular] = read_velocities(f, mode);
        let body = BodySpec {
            name: name.unwrap_or_default(),
            mode,
            shape: shape.clone().unwrap_or(ShapeSpec::HalfSpace),
            shape_name,
            mass,
            position_m: f.vector_or("position_m", Bound::ANY, [0.0; 3]),
            orientation_xyzw: rotation::read(f),
            velocity_m_per_s: linear,
            angular_velocity_rad_per_s: angular,
            material,
            contact,
            contacts: f.choice_or("contacts", CONTACTS, library.contacts),
            center_m: f.optional_vector("center_m", Bound::ANY),
            inertia_kg_m2: read_inertia(f),
            gravity_scale: f.number_or("gravity_scale", Bound::ANY, 1.0),
            locked: read_all_locked(f),
            linear_damping_per_s: f.number_or("linear_damping_per_s", Bound::NOT_NEGATIVE, 0.0),
            angular_damping_per_s: f.number_or("angular_damping_per_s", Bound::NOT_NEGATIVE, 0.0),
            collidable: f.flag_or("collidable", true),
            group: read_group(f, CollisionGroup::default()),
            mask: read_mask(f, u64::MAX),
            sensor: f.flag_or("sensor", false),
            one_way: read_direction(f, "one_way"),
            enabled: f.flag_or("enabled", true),
            visible: f.flag_or("visible", true),
            sound: read_sound(f),
            appearance: AppearanceSpec::read(f, &appearance),
            mounts: Mounts::read(f),
        };
        let shape = shape?;
        if (body.center_m.is_some() || body.inertia_kg_m2.is_some()) && mass.is_none() {
            let message = format!("{} has `center_m` or `inertia_kg_m2` but no mass", f.what);
            f.log.report(f.span.clone(), message, "expected `mass_kg` or `density_kg_per_m3` with them");
        }
        check_half_space(f, &shape, mode);
        Some(BodySpec { shape, ..body })
    }
}

pub(crate) fn read_name(f: &mut Fields<'_>) -> Option<String> {
    let (name, value) = f.text("name", "a unique name")?;
    f.what = format!(
        "{} \"{}\"",
        f.what.split(' ').next().unwrap_or("body"),
        f.log.quote(value.span()).trim_matches(['"', '\''])
    );
    let expected = "a name that is not empty and has no control characters";
    if name.is_empty() || name.chars().any(char::is_control) {
        f.wrong("name", value, expected);
    }
    Some(name.to_owned())
}

/// Reads a collision group.
pub(crate) fn read_group(f: &mut Fields<'_>, default: CollisionGroup) -> CollisionGroup {
    let default = default.bit().trailing_zeros();
    CollisionGroup::new(f.integer_or("group", GROUPS, default) as u8).unwrap_or_default()
}

/// Reads the groups of a mask as one bit each.
pub(crate) fn read_mask(f: &mut Fields<'_>, default: u64) -> u64 {
    let Some(value) = f.value("mask") else { return default };
    let Some(groups) = value.get_ref().as_array() else {
        f.wrong("mask", value, "a list of collision groups, such as [0, 3]");
        return u64::MAX;
    };
    groups.iter().fold(0, |mask, group| mask | 1 << f.as_integer("mask", group, GROUPS))
}

/// Reads a direction of any length above 0.
pub(crate) fn read_direction(f: &mut Fields<'_>, key: &'static str) -> Option<[f64; 3]> {
    let value = f.value(key)?;
    let direction = f.as_direction(key, value);
    if direction == [0.0; 3] {
        f.wrong(key, value, "a direction, such as [0, 0, 1]");
    }
    Some(direction)
}

/// Reads the names of locked axes.
fn read_locked(f: &mut Fields<'_>) -> LockedAxes {
    let Some(value) = f.value("locked") else { return LockedAxes::default() };
    let expected = "a list of \"x\", \"y\", \"z\", \"rotation_x\", \"rotation_y\" and \"rotation_z\"";
    let names: Option<Vec<&str>> =
        value.get_ref().as_array().and_then(|items| items.iter().map(|item| item.get_ref().as_str()).collect());
    match names.map(LockedAxes::of_names) {
        Some(Ok(locked)) => return locked,
        Some(Err(_)) => f.wrong("locked", value, expected),
        None => f.wrong("locked", value, expected),
    }
    LockedAxes::default()
}

/// Reads the locked axes: those of `locked`, and all rotations of a body that is `non_spinning`.
fn read_all_locked(f: &mut Fields<'_>) -> LockedAxes {
    let locked = read_locked(f);
    if f.flag_or("non_spinning", false) { LockedAxes { rotation: [true; 3], ..locked } } else { locked }
}

/// Reads the mode. A wrong value counts as kinematic, the mode that requires no other key.
pub(crate) fn read_mode(f: &mut Fields<'_>) -> Mode {
    match f.value("mode") {
        Some(value) => f.as_choice("mode", value, MODES).unwrap_or(Mode::Kinematic),
        None => Mode::Dynamic,
    }
}

/// Reads the mass; a dynamic body without one, and a compound with densities, have the usual one.
fn read_mass(f: &mut Fields<'_>, mode: Mode) -> Option<MassSpec> {
    let mass = f.optional_number("mass_kg", Bound::POSITIVE);
    let density = f.optional_number("density_kg_per_m3", Bound::POSITIVE);
    match (mass, density) {
        (Some(_), Some(_)) => {
            let message = format!("{} has both `mass_kg` and `density_kg_per_m3`", f.what);
            f.log.report(f.span.clone(), message, "expected one of them");
            None
        }
        (Some(mass), None) => Some(MassSpec::Mass(mass)),
        (None, Some(density)) => Some(MassSpec::Density(density)),
        (None, None) => (mode == Mode::Dynamic).then_some(MassSpec::Usual),
    }
}

pub(crate) fn read_material(f: &mut Fields<'_>, library: &Library<'_>) -> Option<usize> {
    let (name, value) = f.optional_text("material")?;
    let found = library.material_names.get(name).copied();
    if found.is_none() {
        match library.material_names.is_empty() {
            true => f.wrong("material", value, "the NAME of a table [materials.NAME]; the scene has none"),
            false => f.unknown_name("material", value, name, library.material_names.keys().copied().collect()),
        }
    }
    found
}

/// Reads linear and angular velocity. A static body may not have any.
fn read_velocities(f: &mut Fields<'_>, mode: Mode) -> [[f64; 3]; 2] {
    ["velocity_m_per_s", "angular_velocity_rad_per_s"].map(|key| {
        let Some(value) = f.value(key) else {
            return [0.0; 3];
        };
        let velocity = f.as_vector(key, value, Bound::ANY);
        if mode == Mode::Static && velocity != [0.0; 3] {
            f.wrong(
                key,
                value,
                "no velocity for a static body; a body with mode = \"kinematic\" moves at a prescribed velocity",
            );
        }
        velocity
    })
}

fn check_half_space(f: &Fields<'_>, shape: &ShapeSpec, mode: Mode) {
    if *shape == ShapeSpec::HalfSpace && mode == Mode::Dynamic {
        let message = format!("{} is a dynamic half-space, which has no finite mass", f.what);
        f.log.report(f.span.clone(), message, "expected mode = \"static\" or \"kinematic\"");
    }
}

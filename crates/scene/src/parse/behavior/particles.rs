//! `[[particle_system]]` with its `[[particle_system.emitter]]`.

use tumble_behaviors::{Emitter, ParticleSettings};
use tumble_core::collide::{Pose, Quat, Vec3};
use tumble_core::{CollisionGroup, Material};

use super::part;
use crate::parse::appearance::{AppearanceSpec, as_color};
use crate::parse::body::{GROUPS, Library, read_mask, read_material, read_name};
use crate::parse::bound::Bound;
use crate::parse::fields::Fields;
use crate::parse::loop_joint::{PartSpec, Parts};
use crate::parse::material::read_contact;

/// Largest number of particles and of emitters of a system.
const MOST: u32 = 1_000_000;
const MOST_EMITTERS: usize = 1_000;
const ANGLE: Bound = Bound::new(0.0, 180.0, "an angle from 0 to 180 degrees");

/// A system of particles.
#[derive(Clone, Debug, PartialEq)]
pub struct ParticleSystemSpec {
    /// Unique in the scene.
    pub name: String,
    /// Constants of the particles.
    pub settings: ParticleSettings,
    /// Sources; each `mount` is `None`.
    pub emitters: Vec<EmitterSpec>,
    /// Radius in pictures, m. Default: that of the particles.
    pub drawn_radius_m: Option<f64>,
    /// Time before its end in which a particle shrinks to nothing, s. Default 0.
    pub fade_s: f64,
    /// Opacity at birth and at the end, each 0 to 1. Default: solid.
    pub opacity: Option<[f64; 2]>,
    /// Factor of the drawn radius at birth and at the end. Default 1.
    pub scale: [f64; 2],
    /// Color at the end, sRGB, each 0 to 1. Default: the appearance's.
    pub end_color: Option<[f64; 3]>,
    /// Appearance of the particles.
    pub appearance: AppearanceSpec,
    /// Whether it takes part in the simulation. Default true.
    pub enabled: bool,
}

/// A source of particles.
#[derive(Clone, Debug, PartialEq)]
pub struct EmitterSpec {
    /// The source without its mount.
    pub emitter: Emitter,
    /// The part that carries it; `None` for the world.
    pub mount: Option<PartSpec>,
}

impl ParticleSystemSpec {
    pub(crate) fn read(f: &mut Fields<'_>, library: &Library<'_>, parts: &impl Parts) -> ParticleSystemSpec {
        let name = read_name(f).unwrap_or_default();
        let usual = ParticleSettings::default();
        let base = read_material(f, library).map(|index| &library.materials[index]);
        let contact = read_contact(f, &base.map_or_else(Material::default, |material| material.contact));
        let appearance = base.map_or_else(AppearanceSpec::default, |material| material.appearance.clone());
        let settings = ParticleSettings {
            capacity: f.integer_or("capacity", 1..=MOST, usual.capacity as u32) as usize,
            seed: f.seed(),
            mass: f.number_or("mass_kg", Bound::POSITIVE, usual.mass),
            radius: f.number_or("radius_m", Bound::NOT_NEGATIVE, usual.radius),
            material: contact,
            gravity_scale: f.number_or("gravity_scale", Bound::ANY, usual.gravity_scale),
            linear_drag: f.number_or("linear_drag_per_s", Bound::NOT_NEGATIVE, usual.linear_drag),
            quadratic_drag: f.number_or("quadratic_drag_per_m", Bound::NOT_NEGATIVE, usual.quadratic_drag),
            wind: Vec3::from(f.vector_or("wind_m_per_s", Bound::ANY, [0.0; 3])),
            collidable: f.flag_or("collidable", usual.collidable),
            group: CollisionGroup::new(f.integer_or("group", GROUPS, 0) as u8).unwrap_or_default(),
            mask: read_mask(f, u64::MAX),
            two_way: f.flag_or("two_way", usual.two_way),
        };
        let emitters = f.tables("emitter", MOST_EMITTERS);
        ParticleSystemSpec {
            name,
            settings,
            emitters: emitters.into_iter().map(|table| EmitterSpec::read(table, parts)).collect(),
            drawn_radius_m: f.optional_number("drawn_radius_m", Bound::POSITIVE),
            fade_s: f.number_or("fade_s", Bound::NOT_NEGATIVE, 0.0),
            opacity: over_life(f, "opacity", Bound::UNIT),
            scale: over_life(f, "scale", Bound::NOT_NEGATIVE).unwrap_or([1.0; 2]),
            end_color: f.value("end_color").map(|value| as_color(f, "end_color", value)),
            appearance: AppearanceSpec::read(f, &appearance),
            enabled: f.flag_or("enabled", true),
        }
    }
}

impl EmitterSpec {
    fn read(mut f: Fields<'_>, parts: &impl Parts) -> EmitterSpec {
        let usual = Emitter::default();
        let position = Vec3::from(f.vector_or("position_m", Bound::ANY, [0.0; 3]));
        let axis = Vec3::from(f.direction_or("axis", [0.0, 0.0, 1.0]));
        let mount = part(&mut f, "body", parts);
        let emitter = Emitter {
            pose: Pose::from_parts(position.into(), turn_z_to(&axis)),
            mount: None,
            radius: f.number_or("radius_m", Bound::NOT_NEGATIVE, usual.radius),
            speed: range(&mut f, "speed_m_per_s", Bound::NOT_NEGATIVE, usual.speed),
            half_angle: f.number_or("half_angle_deg", ANGLE, 180.0).to_radians().min(usual.half_angle),
            lifetime: range(&mut f, "lifetime_s", Bound::POSITIVE, usual.lifetime),
            burst: f.integer_or("burst", 0..=MOST, usual.burst),
            rate: f.number_or("rate_per_s", Bound::new(0.0, 1e9, "a number from 0 to 1e9"), usual.rate),
            start: f.number_or("start_s", Bound::ANY, usual.start),
            end: f.number_or("end_s", Bound::ANY, usual.end),
        };
        f.finish();
        EmitterSpec { emitter, mount }
    }
}

/// Returns the shortest rotation from the z axis to a unit vector: half a turn about x for −z.
fn turn_z_to(axis: &Vec3) -> Quat {
    let mut turn = Quat::identity().into_inner();
    let w = 1.0 + axis.z;
    let [x, y, w] = if w < 1e-12 { [1.0, 0.0, 0.0] } else { [-axis.y, axis.x, w] };
    turn.coords.copy_from_slice(&[x, y, 0.0, w]);
    Quat::new_normalize(turn)
}

/// Reads one number, or the one at the birth of a particle and the one at its end.
fn over_life(f: &mut Fields<'_>, key: &'static str, bound: Bound) -> Option<[f64; 2]> {
    let value = f.value(key)?;
    Some(match value.get_ref().as_array() {
        None => [f.as_number(key, value, bound); 2],
        Some(_) => f.as_vector(key, value, bound),
    })
}

/// Reads one number, or the least and the greatest of a range.
fn range(f: &mut Fields<'_>, key: &'static str, bound: Bound, usual: [f64; 2]) -> [f64; 2] {
    let Some(value) = f.value(key) else { return usual };
    if value.get_ref().as_array().is_none() {
        return [f.as_number(key, value, bound); 2];
    }
    let problems = f.log.count();
    let [least, most]: [f64; 2] = f.as_vector(key, value, bound);
    if least > most && f.log.count() == problems {
        f.wrong(key, value, "one number, or the least and the greatest one, in this order");
    }
    [least, most]
}

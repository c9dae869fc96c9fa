//! `[materials.NAME]`: contact constants and appearance of a surface.

use crate::parse::appearance::AppearanceSpec;
use crate::parse::bound::Bound;
use crate::parse::fields::{Fields, Names};
use tumble_core::Material;
use tumble_core::collide::Vec3;

/// Range of coefficients of friction.
pub(crate) const FRICTION: Bound = Bound::new(0.0, 100.0, "a friction coefficient from 0 to 100");
/// Range of coefficients of restitution.
pub(crate) const RESTITUTION: Bound = Bound::new(0.0, 1.0, "a restitution from 0 (no bounce) to 1 (no loss)");

/// Range of factors of friction.
const SCALE: Bound = Bound::new(1e-3, 1e3, "a factor of friction from 1e-3 to 1e3");

/// The keys of contact constants, and how each passes from one material to another.
type Pass = fn(&mut Material, &Material);
const CONTACT_KEYS: [(&str, Pass); 10] = [
    ("friction", |to, from| to.friction = from.friction),
    ("restitution", |to, from| to.restitution = from.restitution),
    ("static_friction", |to, from| to.static_friction = from.static_friction),
    ("stribeck_speed_m_per_s", |to, from| to.stribeck_speed = from.stribeck_speed),
    ("friction_scale", |to, from| to.friction_scale = from.friction_scale),
    ("rolling_friction_m", |to, from| to.rolling_friction = from.rolling_friction),
    ("torsional_friction_m", |to, from| to.torsional_friction = from.torsional_friction),
    ("tangential_restitution", |to, from| to.tangential_restitution = from.tangential_restitution),
    ("adhesion_n", |to, from| to.adhesion = from.adhesion),
    ("surface_velocity_m_per_s", |to, from| to.surface_velocity = from.surface_velocity),
];

/// Reads the contact constants; absent keys are those of `base`.
pub(crate) fn read_contact(f: &mut Fields<'_>, base: &Material) -> Material {
    Material {
        friction: f.number_or("friction", FRICTION, base.friction),
        restitution: f.number_or("restitution", RESTITUTION, base.restitution),
        static_friction: f.number_or("static_friction", FRICTION, base.static_friction),
        stribeck_speed: f.number_or("stribeck_speed_m_per_s", Bound::POSITIVE, base.stribeck_speed),
        friction_scale: Vec3::from(f.vector_or("friction_scale", SCALE, base.friction_scale.into())),
        rolling_friction: f.number_or("rolling_friction_m", Bound::NOT_NEGATIVE, base.rolling_friction),
        torsional_friction: f.number_or("torsional_friction_m", Bound::NOT_NEGATIVE, base.torsional_friction),
        tangential_restitution: f.number_or("tangential_restitution", Bound::UNIT, base.tangential_restitution),
        adhesion: f.number_or("adhesion_n", Bound::NOT_NEGATIVE, base.adhesion),
        surface_velocity: Vec3::from(f.vector_or("surface_velocity_m_per_s", Bound::ANY, base.surface_velocity.into())),
        id: base.id,
    }
}

/// Returns whether the table has a contact constant.
pub(crate) fn has_contact(f: &mut Fields<'_>) -> bool {
    CONTACT_KEYS.iter().any(|(key, _)| f.value(key).is_some())
}

/// Copies the contact constants that the table gives, which have been read to `new`.
pub(crate) fn overlay_contact(f: &mut Fields<'_>, own: &mut Material, new: &Material) {
    for (key, pass) in CONTACT_KEYS {
        if f.value(key).is_some() {
            pass(own, new);
        }
    }
}

/// A named material.
#[derive(Clone, Debug, PartialEq)]
pub struct MaterialSpec {
    /// The NAME of `[materials.NAME]`.
    pub name: String,
    /// Contact constants; combined with those of the other body.
    pub contact: Material,
    /// How bodies of this material sound.
    pub sound: Option<String>,
    /// Appearance of bodies of this material.
    pub appearance: AppearanceSpec,
}

impl MaterialSpec {
    pub(crate) fn read(name: &str, mut f: Fields<'_>) -> Self {
        let material = MaterialSpec {
            name: name.to_owned(),
            contact: read_contact(&mut f, &Material::default()),
            sound: read_sound(&mut f),
            appearance: AppearanceSpec::read(&mut f, &AppearanceSpec::default()),
        };
        f.finish();
        material
    }
}

/// Names of materials that sound.
const SOUNDS: Names<&str> = &[
    ("wood", "wood"),
    ("rubber", "rubber"),
    ("plastic", "plastic"),
    ("glass", "glass"),
    ("stone", "stone"),
    ("steel", "steel"),
];

/// Reads `sound`.
pub(crate) fn read_sound(f: &mut Fields<'_>) -> Option<String> {
    f.optional_choice("sound", SOUNDS).map(str::to_owned)
}

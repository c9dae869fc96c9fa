//! Contact constants, appearance, cameras and lights as keys.

use std::path::Path;

use tumble_core::collide::{Pose, Vec3};
use tumble_core::{Appearance, CameraMount, CollisionGroup, LightMount, Material, Spread};

use super::text::Table;
use crate::parse::appearance::{AppearanceSpec, Pattern};

/// Returns the contact constants that differ from those of `base`. The number of the material is
/// written by the caller.
pub(super) fn contact(material: &Material, base: &Material) -> Table {
    // without `..`, so that a new constant is an error here
    let Material {
        restitution,
        friction,
        static_friction,
        stribeck_speed,
        friction_scale,
        rolling_friction,
        torsional_friction,
        tangential_restitution,
        adhesion,
        surface_velocity,
        id: _,
    } = *material;
    let mut t = Table::default();
    t.put_unless(base.friction, "friction", friction);
    t.put_unless(base.restitution, "restitution", restitution);
    t.put_unless(base.static_friction, "static_friction", static_friction);
    t.put_unless(base.stribeck_speed, "stribeck_speed_m_per_s", stribeck_speed);
    t.put_unless(base.friction_scale, "friction_scale", friction_scale);
    t.put_unless(base.rolling_friction, "rolling_friction_m", rolling_friction);
    t.put_unless(base.torsional_friction, "torsional_friction_m", torsional_friction);
    t.put_unless(base.tangential_restitution, "tangential_restitution", tangential_restitution);
    t.put_unless(base.adhesion, "adhesion_n", adhesion);
    t.put_unless(base.surface_velocity, "surface_velocity_m_per_s", surface_velocity);
    t
}

/// Returns group and mask, where they are not the default ones.
pub(super) fn groups(group: CollisionGroup, mask: u64) -> Table {
    let mut t = Table::default();
    t.put_unless(0, "group", group.bit().trailing_zeros());
    if mask != u64::MAX {
        t.put("mask", (0..64).filter(|group| mask & (1 << group) != 0).collect::<Vec<u32>>());
    }
    t
}

/// Returns the keys of an appearance that differ from those of `base`. `center` is the origin of the
/// geometry in the axes of the description, m.
pub(super) fn appearance(given: &Appearance, center: &Vec3, base: &AppearanceSpec) -> Table {
    let Appearance { color, roughness, metallic, shader, properties, texture, detail } = given;
    let property = |name: &str| properties.iter().find(|(n, _)| n == name).map(|(_, value)| *value);
    let plain = AppearanceSpec::default();
    let second = ["second_r", "second_g", "second_b"].map(property);
    let mut t = Table::default();
    t.put_unless(base.color.map(|c| c as f32), "color", *color);
    if let [Some(r), Some(g), Some(b)] = second {
        t.put_unless(base.second_color, "second_color", [r, g, b]);
    }
    t.put_unless(base.pattern.name(), "pattern", shader.as_str());
    t.put_unless(base.pattern_scale_m, "pattern_scale_m", property("scale_m").unwrap_or(plain.pattern_scale_m));
    let offset = property("offset_m").map_or(plain.pattern_offset_m, |offset| offset + center.z);
    t.put_unless(base.pattern_offset_m, "pattern_offset_m", offset);
    t.put_unless(base.roughness as f32, "roughness", *roughness);
    t.put_unless(base.metallic as f32, "metallic", *metallic);
    t.put_unless(base.clearcoat, "clearcoat", property("clearcoat").unwrap_or(plain.clearcoat));
    t.put_unless(base.glow, "glow", property("glow").map_or(plain.glow, |glow| glow != 0.0));
    match texture {
        Some(texture) if base.texture.as_deref() != Some(texture) => t.put("texture", absolute(texture)),
        _ => {}
    }
    t.put_unless(base.detail.words(), "detail", detail.words());
    t
}

/// Returns the keys of the appearance of a material or of the ground.
pub(super) fn appearance_spec(spec: &AppearanceSpec, base: &AppearanceSpec) -> Table {
    let AppearanceSpec {
        color,
        second_color,
        pattern,
        pattern_scale_m,
        pattern_offset_m,
        roughness,
        metallic,
        clearcoat,
        glow,
        texture,
        detail,
    } = spec;
    let mut t = Table::default();
    t.put_unless(base.color, "color", *color);
    t.put_unless(base.second_color, "second_color", *second_color);
    t.put_unless(base.pattern.name(), "pattern", pattern.name());
    t.put_unless(base.pattern_scale_m, "pattern_scale_m", *pattern_scale_m);
    t.put_unless(base.pattern_offset_m, "pattern_offset_m", *pattern_offset_m);
    t.put_unless(base.roughness, "roughness", *roughness);
    t.put_unless(base.metallic, "metallic", *metallic);
    t.put_unless(base.clearcoat, "clearcoat", *clearcoat);
    t.put_unless(base.glow, "glow", *glow);
    texture.iter().for_each(|texture| t.put("texture", absolute(texture)));
    t.put_unless(base.detail.words(), "detail", detail.words());
    t
}

/// Returns whether a shader is a pattern of scene files.
pub(super) fn is_pattern(shader: &str) -> bool {
    Pattern::NAMES.iter().any(|(name, _)| *name == shader)
}

/// Returns a path that holds in any folder.
fn absolute(path: &Path) -> String {
    std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf()).display().to_string()
}

/// Returns a camera as a table; `center` is the origin of its part in the axes of the description.
pub(super) fn camera(mount: &CameraMount, center: &Vec3) -> Table {
    let CameraMount { name: _, part: _, pose, vertical_fov, near, far } = mount;
    let mut t = placed(pose, center);
    t.put("forward", pose.rotation * Vec3::x());
    t.put("up", pose.rotation * Vec3::z());
    t.put("vertical_fov_deg", vertical_fov.to_degrees());
    t.put("near_m", *near);
    t.put("far_m", *far);
    t
}

/// Returns a light as a table.
pub(super) fn light(mount: &LightMount, center: &Vec3) -> Table {
    let LightMount { part: _, pose, spread, color, intensity, casts_shadow } = mount;
    let mut t = match spread {
        Spread::Directional => {
            let mut t = Table::of("type", "directional");
            t.put("direction", pose.rotation * Vec3::x());
            t
        }
        Spread::Point { radius } => {
            let mut t = Table::of("type", "point");
            t.extend(placed(pose, center));
            t.put("radius_m", *radius);
            t
        }
    };
    t.put("color", *color);
    t.put("intensity", *intensity);
    t.put("casts_shadow", *casts_shadow);
    t
}

fn placed(pose: &Pose, center: &Vec3) -> Table {
    Table::of("position_m", pose.translation.vector + center)
}

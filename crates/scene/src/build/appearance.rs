//! Materials and appearances of the scene as the world knows them.

use tumble_core::Appearance;
use tumble_core::collide::Vec3;

use crate::parse::appearance::AppearanceSpec;

/// Returns the world's id of a material; 0 for none.
pub(crate) fn material_id(material: Option<usize>) -> u32 {
    material.map_or(0, |index| index as u32 + 1)
}

/// Converts an appearance to body axes, whose origin is the center of mass.
pub(crate) fn appearance(appearance: &AppearanceSpec, center: &Vec3) -> Appearance {
    let [r, g, b] = appearance.second_color;
    let named = [
        ("second_r", r),
        ("second_g", g),
        ("second_b", b),
        ("scale_m", appearance.pattern_scale_m),
        ("offset_m", appearance.pattern_offset_m - center.z),
        ("clearcoat", appearance.clearcoat),
        ("glow", f64::from(u8::from(appearance.glow))),
    ];
    Appearance {
        color: appearance.color.map(|c| c as f32),
        roughness: appearance.roughness as f32,
        metallic: appearance.metallic as f32,
        shader: appearance.pattern.name().into(),
        properties: named
            .into_iter()
            .filter(|(name, _)| *name != "glow" || appearance.glow)
            .map(|(name, value)| (name.to_string(), value))
            .collect(),
        texture: appearance.texture.as_deref().map(Into::into),
        detail: appearance.detail,
    }
}

//! Materials and appearances of the scene as the world knows them.

use tumble_core::Appearance;
use tumble_core::collide::Vec3;

use crate::parse::appearance::{AppearanceSpec, Pattern};

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

impl AppearanceSpec {
    /// Returns the appearance of a body whose center of mass is at `center`, m, in the frame of its shape.
    pub fn in_body(&self, center: &Vec3) -> Appearance {
        appearance(self, center)
    }

    /// Returns the description of an appearance: the inverse of [`AppearanceSpec::in_body`]. A pattern of another
    /// program is `plain`.
    pub fn of_body(given: &Appearance, center: &Vec3) -> AppearanceSpec {
        let plain = AppearanceSpec::default();
        let property = |name: &str| given.properties.iter().find(|(key, _)| key == name).map(|(_, value)| *value);
        let [r, g, b] = plain.second_color;
        // the shortest number that is stored as the same
        let number = |x: f32| x.to_string().parse().unwrap_or(f64::from(x));
        AppearanceSpec {
            color: given.color.map(number),
            second_color: [("second_r", r), ("second_g", g), ("second_b", b)]
                .map(|(name, usual)| property(name).unwrap_or(usual)),
            pattern: Pattern::by_name(&given.shader).unwrap_or(plain.pattern),
            pattern_scale_m: property("scale_m").unwrap_or(plain.pattern_scale_m),
            pattern_offset_m: property("offset_m").map_or(plain.pattern_offset_m, |offset| offset + center.z),
            roughness: number(given.roughness),
            metallic: number(given.metallic),
            clearcoat: property("clearcoat").unwrap_or(plain.clearcoat),
            glow: property("glow").is_some_and(|glow| glow != 0.0),
            texture: given.texture.as_deref().map(Into::into),
            detail: given.detail,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tumble_core::Detail;

    #[test]
    fn an_appearance_comes_back_as_it_was_described() {
        let center = Vec3::new(0.1, 0.2, 0.5);
        let spec = AppearanceSpec {
            color: [0.1, 0.2, 0.3],
            second_color: [0.4, 0.5, 0.6],
            pattern: Pattern::Rings,
            pattern_scale_m: 0.02,
            pattern_offset_m: 0.25,
            roughness: 0.7,
            metallic: 0.9,
            clearcoat: 0.3,
            glow: true,
            texture: Some("bricks.png".into()),
            detail: Detail::Wireframe,
        };
        assert_eq!(AppearanceSpec::of_body(&spec.in_body(&center), &center), spec);
        assert_eq!(
            AppearanceSpec::of_body(&AppearanceSpec::default().in_body(&center), &center),
            AppearanceSpec::default()
        );
    }
}

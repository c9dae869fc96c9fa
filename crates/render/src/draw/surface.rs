//! Materials from the appearance of objects and of scene files.

use crate::{Material, Pattern, Shader};
use tumble_core::Appearance;

/// The material of an object's appearance. A billiard ball's number is the one at the end of the
/// body's name (`ball_12`); without a number the spots stay blank.
pub(super) fn of_appearance(appearance: &Appearance, name: &str) -> Material {
    let mut numbers = Numbers { second: [1.0; 3], scale_m: 0.1, offset_m: 0.0, name };
    let (mut clearcoat, mut shader) = (0.0, Shader::Lit);
    // the first of equal names counts
    for (key, value) in appearance.properties.iter().rev() {
        let value = *value as f32;
        match key.as_str() {
            "second_r" => numbers.second[0] = value,
            "second_g" => numbers.second[1] = value,
            "second_b" => numbers.second[2] = value,
            "scale_m" => numbers.scale_m = value,
            "offset_m" => numbers.offset_m = value,
            "clearcoat" => clearcoat = value,
            "glow" if value != 0.0 => shader = Shader::Unlit,
            _ => {}
        }
    }
    Material {
        color: appearance.color,
        roughness: appearance.roughness,
        metallic: appearance.metallic,
        clearcoat,
        shader,
        pattern: pattern(&appearance.shader, &numbers),
        ..Material::default()
    }
}

/// The material of an appearance in a scene file.
pub(super) fn of_spec(appearance: &tumble_scene::AppearanceSpec) -> Material {
    let numbers = Numbers {
        second: appearance.second_color.map(|c| c as f32),
        scale_m: appearance.pattern_scale_m as f32,
        offset_m: appearance.pattern_offset_m as f32,
        name: "",
    };
    Material {
        color: appearance.color.map(|c| c as f32),
        roughness: appearance.roughness as f32,
        metallic: appearance.metallic as f32,
        clearcoat: appearance.clearcoat as f32,
        shader: if appearance.glow { Shader::Unlit } else { Shader::Lit },
        pattern: pattern(appearance.pattern.name(), &numbers),
        ..Material::default()
    }
}

struct Numbers<'a> {
    second: [f32; 3],
    scale_m: f32,
    offset_m: f32,
    name: &'a str,
}

fn pattern(name: &str, n: &Numbers) -> Pattern {
    match name {
        "checker" => Pattern::Checker { other: n.second, size_m: n.scale_m },
        "grid" => Pattern::Grid { line: n.second, size_m: n.scale_m, width_m: 0.02 * n.scale_m },
        "solid_ball" => Pattern::Ball { number: number(n.name), stripe: false },
        "striped_ball" => Pattern::Ball { number: number(n.name), stripe: true },
        "wood" => Pattern::Wood { dark: n.second, ring_m: 0.3 * n.scale_m, board_m: n.scale_m },
        "felt" => Pattern::Felt { thread_m: 0.1 * n.scale_m },
        "rings" => Pattern::Rings { other: n.second, from_m: n.offset_m, to_m: n.offset_m + n.scale_m },
        "marble" => Pattern::Marble { vein: n.second, size_m: n.scale_m },
        _ => Pattern::Plain,
    }
}

fn number(name: &str) -> u8 {
    let digits = name.len() - name.trim_end_matches(|c: char| c.is_ascii_digit()).len();
    name[name.len() - digits..].parse().ok().filter(|n| *n < 100).unwrap_or(0)
}

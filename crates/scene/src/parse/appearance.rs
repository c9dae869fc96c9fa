//! The appearance of a surface: colors, pattern, gloss. It has no effect on motion.

use crate::build::textures::check_texture;
use crate::parse::bound::Bound;
use crate::parse::fields::{Fields, Names, Value};
use std::path::PathBuf;
use tumble_core::Detail;

/// Red, green and blue from 0 to 1, sRGB (as on a screen, not linear light).
pub type Color = [f64; 3];

/// A pattern drawn over the surface in body axes, which makes rotation visible.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Pattern {
    /// One color.
    Plain,
    /// Squares of the two colors.
    Checker,
    /// Lines of the second color on the first.
    Grid,
    /// A billiard ball of one color with spots of the second.
    SolidBall,
    /// A billiard ball of the second color with a band of the first.
    StripedBall,
    /// Grain along the body's x axis.
    Wood,
    /// The nap of a billiard cloth.
    Felt,
    /// Two rings of the second color around the shape's z axis, as on the neck of a bowling pin.
    Rings,
    /// Veins of the second color, as in a bowling ball.
    Marble,
}

impl Pattern {
    pub(crate) const NAMES: Names<Self> = &[
        ("plain", Pattern::Plain),
        ("checker", Pattern::Checker),
        ("grid", Pattern::Grid),
        ("solid_ball", Pattern::SolidBall),
        ("striped_ball", Pattern::StripedBall),
        ("wood", Pattern::Wood),
        ("felt", Pattern::Felt),
        ("rings", Pattern::Rings),
        ("marble", Pattern::Marble),
    ];
}

impl Pattern {
    /// Returns the pattern of a name in files.
    pub fn by_name(name: &str) -> Option<Pattern> {
        Pattern::NAMES.iter().find(|(known, _)| *known == name).map(|(_, pattern)| *pattern)
    }

    /// Returns the names in files.
    pub fn names() -> impl Iterator<Item = &'static str> {
        Pattern::NAMES.iter().map(|(name, _)| *name)
    }

    /// Returns its name in files, which is also the name of its shader.
    pub fn name(self) -> &'static str {
        Pattern::NAMES.iter().find(|(_, pattern)| *pattern == self).map_or("plain", |(name, _)| *name)
    }
}

/// The appearance of a surface.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct AppearanceSpec {
    /// Main color. Default a light gray.
    pub color: Color,
    /// The other color of a pattern. Default white.
    pub second_color: Color,
    /// Default `plain`.
    pub pattern: Pattern,
    /// Size of a cell of the pattern (a square, a board, the width of a ring), meters. Default 0.1.
    pub pattern_scale_m: f64,
    /// Start of the pattern along the shape's z axis (the lower edge of `rings`), meters. Default
    /// 0.
    pub pattern_offset_m: f64,
    /// 0 mirror-like to 1 dull. Default 0.5.
    pub roughness: f64,
    /// 0 dielectric to 1 metal. Default 0.
    pub metallic: f64,
    /// Strength of a clear coat, 0 to 1. Default 0.
    pub clearcoat: f64,
    /// Whether the surface shows its colors as they are, without light and shadow: sparks, flames, lamps. Default false.
    pub glow: bool,
    /// A PNG image over the main color, which then tints it. It repeats every `pattern_scale_m`,
    /// and covers a sphere once. In the file relative to the folder of the scene; here the path as
    /// it is opened.
    pub texture: Option<PathBuf>,
    /// Level of detail. Default full.
    pub detail: Detail,
}

impl Default for AppearanceSpec {
    fn default() -> Self {
        AppearanceSpec {
            color: [0.72, 0.72, 0.74],
            second_color: [1.0, 1.0, 1.0],
            pattern: Pattern::Plain,
            pattern_scale_m: 0.1,
            pattern_offset_m: 0.0,
            roughness: 0.5,
            metallic: 0.0,
            clearcoat: 0.0,
            glow: false,
            texture: None,
            detail: Detail::Full,
        }
    }
}

impl AppearanceSpec {
    /// Reads the appearance keys. Absent keys are taken from `base`.
    pub(crate) fn read(f: &mut Fields<'_>, base: &AppearanceSpec) -> AppearanceSpec {
        AppearanceSpec {
            color: read_color(f, "color", base.color),
            second_color: read_color(f, "second_color", base.second_color),
            pattern: f.choice_or("pattern", Pattern::NAMES, base.pattern),
            pattern_scale_m: f.number_or("pattern_scale_m", Bound::POSITIVE, base.pattern_scale_m),
            pattern_offset_m: f.number_or("pattern_offset_m", Bound::ANY, base.pattern_offset_m),
            roughness: f.number_or("roughness", Bound::UNIT, base.roughness),
            metallic: f.number_or("metallic", Bound::UNIT, base.metallic),
            clearcoat: f.number_or("clearcoat", Bound::UNIT, base.clearcoat),
            glow: f.flag_or("glow", base.glow),
            texture: read_texture(f).or_else(|| base.texture.clone()),
            detail: read_detail(f, base.detail),
        }
    }
}

/// Reads the file of a texture, which must be a PNG.
fn read_texture(f: &mut Fields<'_>) -> Option<PathBuf> {
    let (file, value) = f.optional_text("texture")?;
    let path = f.log.folder().join(file);
    if !path.is_file() {
        f.wrong("texture", value, format!("a PNG file; there is none at {}", path.display()));
    } else if let Err(why) = check_texture(&path) {
        f.wrong("texture", value, format!("a PNG file; {}: {why}", path.display()));
    }
    Some(path)
}

fn read_detail(f: &mut Fields<'_>, default: Detail) -> Detail {
    let Some((words, value)) = f.optional_text("detail") else { return default };
    words.parse().unwrap_or_else(|expected: String| {
        f.wrong("detail", value, expected);
        default
    })
}

/// Reads a color, or returns `default` if the key is absent.
pub(crate) fn read_color(f: &mut Fields<'_>, key: &'static str, default: Color) -> Color {
    match f.value(key) {
        Some(value) => as_color(f, key, value),
        None => default,
    }
}

/// Returns a value as a color: `"#rrggbb"` or `[r, g, b]` from 0 to 1.
pub(crate) fn as_color(f: &Fields<'_>, key: &str, value: &Value<'_>) -> Color {
    match value.get_ref().as_str() {
        Some(text) => hex_color(text).unwrap_or_else(|| {
            f.wrong(key, value, "a color: \"#rrggbb\", or [r, g, b] with numbers from 0 to 1");
            [f64::NAN; 3]
        }),
        None => f.as_vector(key, value, Bound::UNIT),
    }
}

/// Returns a value as a pattern.
pub(crate) fn as_pattern<'a>(f: &Fields<'a>, key: &str, value: &'a Value<'a>) -> Pattern {
    f.as_choice(key, value, Pattern::NAMES).unwrap_or(Pattern::Plain)
}

fn hex_color(text: &str) -> Option<Color> {
    let digits = text.strip_prefix('#').filter(|d| d.len() == 6 && d.bytes().all(|b| b.is_ascii_hexdigit()))?;
    let number = u32::from_str_radix(digits, 16).ok()?;
    Some([16, 8, 0].map(|shift| f64::from((number >> shift) & 0xff) / 255.0))
}

#[cfg(test)]
mod tests {
    use super::hex_color;

    #[test]
    fn hex_colors() {
        assert_eq!(hex_color("#ff8000"), Some([1.0, 128.0 / 255.0, 0.0]));
        assert_eq!(hex_color("#ff80"), None);
        assert_eq!(hex_color("ff8000"), None);
        assert_eq!(hex_color("#+12345"), None);
        assert_eq!(hex_color("#é1234"), None);
    }
}

//! Materials: a physically based base and a procedural pattern. Patterns are evaluated in the
//! object's own frame, so a rolling sphere shows its rotation.

/// The material of a surface. All colors are sRGB, 0 to 1, as color pickers give them. They become
/// linear once, on the way to the GPU.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// Base color: diffuse reflection of a dielectric, or mirror color of a metal.
    pub color: [f32; 3],
    /// 0 is a mirror, 1 is chalk.
    pub roughness: f32,
    /// 0 for plastic, wood, cloth and stone; 1 for metal.
    pub metallic: f32,
    /// Strength of a thin, smooth clear coat over the surface, 0 to 1: billiard balls, varnished
    /// wood.
    pub clearcoat: f32,
    /// Procedural pattern over the base color.
    pub pattern: Pattern,
    /// How light is applied.
    pub shader: Shader,
    /// Texture over the base color, which then tints it; most materials have none.
    pub texture: Option<Texture>,
}

/// A texture on a surface: wrapped around a sphere like a map of the earth, projected from three
/// sides onto other shapes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Texture {
    /// Index in [`crate::DrawList::textures`].
    pub id: usize,
    /// Side of the square that the texture covers once, m. On a sphere it goes around once.
    pub repeat_m: f32,
}

/// How light is applied to a surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Shader {
    /// Physically based (GGX) with shadows and ambient light.
    #[default]
    Lit,
    /// The color itself: no light, no tone mapping.
    Unlit,
}

/// A procedural pattern in the object's frame, m; for a sphere from its center.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Pattern {
    /// One color.
    #[default]
    Plain,
    /// A three-dimensional checkerboard of cubes of side `size_m`, alternating with `other`.
    Checker {
        /// The second color.
        other: [f32; 3],
        /// Side of a cube.
        size_m: f32,
    },
    /// Lines of color `line`, `width_m` wide, every `size_m` along object x and y; every tenth line
    /// is stronger.
    Grid {
        /// Color of the lines.
        line: [f32; 3],
        /// Distance of the lines.
        size_m: f32,
        /// Width of a line.
        width_m: f32,
    },
    /// A billiard ball: white spots with the number around ±x; with `stripe`, `color` is a band
    /// around the z axis on white. Number 0 leaves the spots out; without `stripe` it is a plain
    /// cue ball with a red dot at each end of the three axes.
    Ball {
        /// 0 to 99.
        number: u8,
        /// Whether it is striped, as 9 to 15 are in the standard set.
        stripe: bool,
    },
    /// Wood: grain along object x, `dark` in the late wood. With `board_m` above 0 it has boards of
    /// that width along y (parquet, lanes).
    Wood {
        /// Color of the dark grain.
        dark: [f32; 3],
        /// Distance of the growth rings.
        ring_m: f32,
        /// Width of a board; 0 for one piece.
        board_m: f32,
    },
    /// Woven cloth: a fine weave of `thread_m` and a soft sheen at grazing angles.
    Felt {
        /// Distance of the threads.
        thread_m: f32,
    },
    /// Marble: irregular veins of color `vein`, about `size_m` apart (bowling balls).
    Marble {
        /// Color of the veins.
        vein: [f32; 3],
        /// Distance of the veins.
        size_m: f32,
    },
    /// Two rings of color `other` around the z axis (the stripes of a pin's neck). The first is
    /// from `from_m` to `to_m`; the second has the same width and begins half a width above it.
    Rings {
        /// Color of the rings.
        other: [f32; 3],
        /// Height of the lower edge of the lower ring.
        from_m: f32,
        /// Height of the upper edge of the lower ring.
        to_m: f32,
    },
}

impl Pattern {
    /// The pattern's name in the text form of a draw list.
    pub fn name(&self) -> &'static str {
        match self {
            Pattern::Plain => "plain",
            Pattern::Checker { .. } => "checker",
            Pattern::Grid { .. } => "grid",
            Pattern::Ball { .. } => "billiard_ball",
            Pattern::Wood { .. } => "wood",
            Pattern::Felt { .. } => "felt",
            Pattern::Rings { .. } => "rings",
            Pattern::Marble { .. } => "marble",
        }
    }

    /// Returns the pattern's number in the shaders, three color components (sRGB) and two lengths.
    pub(crate) fn packed(&self) -> (u32, [f32; 3], [f32; 2]) {
        match *self {
            Pattern::Plain => (0, [0.0; 3], [0.0; 2]),
            Pattern::Checker { other, size_m } => (1, other, [size_m, 0.0]),
            Pattern::Grid { line, size_m, width_m } => (2, line, [size_m, width_m]),
            Pattern::Ball { number, stripe } => (3, [0.0; 3], [f32::from(number), f32::from(u8::from(stripe))]),
            Pattern::Wood { dark, ring_m, board_m } => (4, dark, [ring_m, board_m]),
            Pattern::Felt { thread_m } => (5, [0.0; 3], [thread_m, 0.0]),
            Pattern::Rings { other, from_m, to_m } => (6, other, [from_m, to_m]),
            Pattern::Marble { vein, size_m } => (7, vein, [size_m, 0.0]),
        }
    }
}

impl Default for Material {
    fn default() -> Self {
        Material::plastic([0.8, 0.8, 0.8])
    }
}

/// The colors of the standard set of billiard balls, 1 to 8; 9 to 15 repeat 1 to 7 as stripes.
/// Index 0 is the cue ball.
const BALL_COLORS: [[f32; 3]; 9] = [
    [0.96, 0.94, 0.88],
    [0.98, 0.74, 0.04],
    [0.05, 0.22, 0.62],
    [0.82, 0.08, 0.07],
    [0.30, 0.10, 0.45],
    [0.96, 0.40, 0.05],
    [0.02, 0.38, 0.20],
    [0.45, 0.06, 0.08],
    [0.03, 0.03, 0.035],
];

impl Material {
    /// Satin plastic.
    pub fn plastic(color: [f32; 3]) -> Self {
        Material {
            color,
            roughness: 0.45,
            metallic: 0.0,
            clearcoat: 0.0,
            pattern: Pattern::Plain,
            shader: Shader::Lit,
            texture: None,
        }
    }

    /// Matte, like chalk.
    pub fn matte(color: [f32; 3]) -> Self {
        Material { roughness: 0.9, ..Material::plastic(color) }
    }

    /// Polished, with a clear coat.
    pub fn glossy(color: [f32; 3]) -> Self {
        Material { roughness: 0.25, clearcoat: 1.0, ..Material::plastic(color) }
    }

    /// Brushed metal.
    pub fn metal(color: [f32; 3]) -> Self {
        Material { roughness: 0.3, metallic: 1.0, ..Material::plastic(color) }
    }

    /// A color without light.
    pub fn unlit(color: [f32; 3]) -> Self {
        Material { shader: Shader::Unlit, ..Material::plastic(color) }
    }

    /// A billiard ball of the standard set: 0 is the cue ball, 1 to 8 solid, 9 to 15 striped; the
    /// colors repeat beyond.
    pub fn billiard_ball(number: u8) -> Self {
        let stripe = number > 8;
        let color = BALL_COLORS[if stripe { (usize::from(number) - 9) % 7 + 1 } else { usize::from(number) }];
        Material::glossy(color).with_pattern(Pattern::Ball { number, stripe })
    }

    /// Light varnished maple in boards of 27 mm (a bowling lane has 39 of them).
    pub fn lane_wood() -> Self {
        Material { roughness: 0.35, clearcoat: 0.7, ..Material::plastic([0.80, 0.61, 0.41]) }
            .with_pattern(Pattern::Wood { dark: [0.58, 0.38, 0.21], ring_m: 0.005, board_m: 0.027 })
    }

    /// Dark oiled walnut, one piece.
    pub fn walnut() -> Self {
        Material { roughness: 0.5, clearcoat: 0.2, ..Material::plastic([0.42, 0.25, 0.14]) }
            .with_pattern(Pattern::Wood { dark: [0.20, 0.10, 0.05], ring_m: 0.012, board_m: 0.0 })
    }

    /// Green billiard cloth.
    pub fn felt() -> Self {
        Material::matte([0.04, 0.31, 0.19]).with_pattern(Pattern::Felt { thread_m: 0.0015 })
    }

    /// A bowling pin of standard size (38.1 cm, its base at object z = −`base_m`): white lacquer,
    /// two red rings on the neck.
    pub fn bowling_pin(base_m: f32) -> Self {
        Material::glossy([0.95, 0.93, 0.89]).with_pattern(Pattern::Rings {
            other: [0.75, 0.05, 0.06],
            from_m: 0.268 - base_m,
            to_m: 0.280 - base_m,
        })
    }

    /// A gray checkerboard.
    pub fn checker(size_m: f32) -> Self {
        Material { roughness: 0.7, ..Material::plastic([0.55, 0.56, 0.58]) }
            .with_pattern(Pattern::Checker { other: [0.40, 0.41, 0.43], size_m })
    }

    /// The surface number that selects a pipeline: the pattern's number, plus 100 without light,
    /// plus 1000 with a clear coat, plus 10000 with a texture.
    pub(crate) fn surface(&self) -> u32 {
        let unlit = self.shader == Shader::Unlit;
        self.pattern.packed().0
            + if unlit { 100 } else { 0 }
            + if self.clearcoat > 0.0 && !unlit { 1000 } else { 0 }
            + if self.texture.is_some() { 10_000 } else { 0 }
    }

    /// Sets the pattern.
    #[must_use]
    pub fn with_pattern(mut self, pattern: Pattern) -> Self {
        self.pattern = pattern;
        self
    }

    /// The names that [`Material::preset`] knows, in alphabetical order.
    pub const PRESETS: [&'static str; 9] =
        ["checker", "felt", "glossy", "lane", "matte", "metal", "plastic", "unlit", "walnut"];

    /// Returns a preset by its name in scene files; `color` (sRGB) replaces the preset's own.
    /// Returns `None` for an unknown name.
    pub fn preset(name: &str, color: Option<[f32; 3]>) -> Option<Self> {
        let neutral = color.unwrap_or([0.8, 0.8, 0.8]);
        let mut material = match name {
            "checker" => Material::checker(0.5),
            "felt" => Material::felt(),
            "glossy" => Material::glossy(neutral),
            "lane" => Material::lane_wood(),
            "matte" => Material::matte(neutral),
            "metal" => Material::metal(neutral),
            "plastic" => Material::plastic(neutral),
            "unlit" => Material::unlit(neutral),
            "walnut" => Material::walnut(),
            _ => return None,
        };
        if let Some(color) = color {
            material.color = color;
        }
        Some(material)
    }
}

/// Converts one sRGB component to linear light (IEC 61966-2-1).
pub(crate) fn linear(c: f32) -> f32 {
    if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
}

/// Converts an sRGB color to linear light.
pub(crate) fn linear3(c: [f32; 3]) -> [f32; 3] {
    c.map(linear)
}

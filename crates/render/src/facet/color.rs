//! The color of a projector: white point, black level, transfer curve, and a table of colors.
//!
//! ```text
//! light of a projector on the wall:   P = b + (1 − b) t          for the code c with t = transfer(c)
//! wanted on the wall:                 W = B + (1 − B) g L        the same everywhere
//! (1 − b) t_i = s_i (1 − B) g L + m_i (B − b)                    Σ s_i = 1,  Σ m_i (B − b) = B − n b
//! ```
//!
//! Where `n` projectors overlap, `Σ P_i = n b + (1 − B) g L + B − n b = W`: the picture shows no seam, and
//! black does not either.
//!
//! | symbol | meaning |
//! |---|---|
//! | L, t | wanted light and light of a projector, linear, 0 to 1 |
//! | b, B | `black` of the projector, `floor` of the wall: shares of a projector's full light |
//! | g | `white`: the gain of each color |
//! | s, m | shares of light (`blend_file`) and of lift (`black_file`), 0 to 1 by pixel; 1 without a file |
//!
//! The transfer is sRGB or `t = c^gamma`. The table maps codes to codes, after everything else.

use super::blend::encoded;
use super::lut::ColorTable;
use crate::material::linear;
use crate::{Image, RenderError};
use tumble_scene::cave::Facet;

/// The colors of one projector, as numbers for pixels.
#[derive(Clone, Debug, PartialEq)]
pub struct ProjectorColor {
    /// `(1 − B) g / (1 − b)`.
    pub(crate) gain: [f32; 3],
    /// `(B − b) / (1 − b)`.
    pub(crate) lift: [f32; 3],
    /// 1 / gamma; 0 for sRGB.
    pub(crate) inverse_gamma: f32,
    pub(crate) table: Option<ColorTable>,
}

impl ProjectorColor {
    /// Returns the color of a facet and reads its table. `None` if the facet changes no color.
    ///
    /// # Errors
    /// [`RenderError::File`] for a table that cannot be read.
    pub fn load(facet: &Facet) -> Result<Option<ProjectorColor>, RenderError> {
        let Some(color) = &facet.color else { return Ok(None) };
        let table = color.lut_file.as_deref().map(ColorTable::load).transpose()?;
        let each = |f: &dyn Fn(f64, f64, f64) -> f64| -> [f32; 3] {
            std::array::from_fn(|k| f(color.black[k], color.floor[k], color.white[k]) as f32)
        };
        Ok(Some(ProjectorColor {
            gain: each(&|b, floor, g| (1.0 - floor) * g / (1.0 - b)),
            lift: each(&|b, floor, _| (floor - b) / (1.0 - b)),
            inverse_gamma: color.gamma.map_or(0.0, |gamma| 1.0 / gamma as f32),
            table,
        }))
    }

    /// Returns the code, 0 to 1, that makes a projector show linear light: `share` of it, and
    /// `lift_share` of the lift.
    pub fn code(&self, light: [f32; 3], share: [f32; 3], lift_share: f32) -> [f32; 3] {
        let code = std::array::from_fn(|k| {
            let t = (light[k] * share[k] * self.gain[k] + self.lift[k] * lift_share).clamp(0.0, 1.0);
            if self.inverse_gamma > 0.0 { t.powf(self.inverse_gamma) } else { encoded_exactly(t) }
        });
        self.table.as_ref().map_or(code, |table| table.color(code)).map(|c| c.clamp(0.0, 1.0))
    }

    /// Changes a picture as [`ProjectorColor::code`] says, with all of its light and lift: the
    /// reference for the device.
    pub fn apply(&self, image: &mut Image) {
        for pixel in image.rgba.chunks_exact_mut(4) {
            let light = std::array::from_fn(|k| linear(f32::from(pixel[k]) / 255.0));
            let code = self.code(light, [1.0; 3], 1.0);
            (0..3).for_each(|k| pixel[k] = (255.0 * code[k]).round() as u8);
        }
    }
}

/// Converts linear light to an sRGB code, 0 to 1.
fn encoded_exactly(light: f32) -> f32 {
    if light <= 0.003_130_8 { 12.92 * light } else { 1.055 * light.powf(1.0 / 2.4) - 0.055 }
}

/// Blends and colors a picture in memory: the reference for the device.
pub(crate) fn apply(image: &mut Image, shares: Option<&[[f32; 4]]>, color: Option<&ProjectorColor>) {
    for (i, pixel) in image.rgba.chunks_exact_mut(4).enumerate() {
        let [r, g, b, lift] = shares.map_or([1.0; 4], |shares| shares[i]);
        let light: [f32; 3] = std::array::from_fn(|k| linear(f32::from(pixel[k]) / 255.0));
        match color {
            Some(color) => {
                let code = color.code(light, [r, g, b], lift);
                (0..3).for_each(|k| pixel[k] = (255.0 * code[k]).round() as u8);
            }
            None => {
                let shares = [r, g, b];
                (0..3).for_each(|k| pixel[k] = encoded(light[k] * shares[k]));
            }
        }
    }
}

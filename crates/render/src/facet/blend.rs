//! Edge blending: projectors that overlap share the light.

use crate::material::linear;
use crate::{Image, MAX_SIDE, RenderError};
use std::path::Path;

/// The fraction of its light that each pixel keeps.
#[derive(Clone, Debug, PartialEq)]
pub struct Blend {
    width: u32,
    /// Three fractions (red, green, blue) per pixel, 0 to 1, rows from the top.
    shares: Vec<[f32; 3]>,
}

impl Blend {
    /// Reads a PNG, gray or in color, of the size of one eye's picture. A value `m` of 0 to 255
    /// keeps `m / 255` of the light; alpha is not used.
    ///
    /// # Errors
    /// [`RenderError::File`] if it cannot be read or has another size.
    pub fn load(path: &Path, [width, height]: [u32; 2]) -> Result<Blend, RenderError> {
        let fail = |reason: String| RenderError::File { path: path.display().to_string(), reason };
        let file = tumble_scene::open_file(path).map_err(|e| fail(format!("the blend mask cannot be read: {e}")))?;
        let mut decoder = png::Decoder::new(std::io::BufReader::new(file));
        decoder.set_transformations(png::Transformations::EXPAND | png::Transformations::STRIP_16);
        let mut reader = decoder.read_info().map_err(|e| fail(format!("the blend mask is no PNG: {e}")))?;
        let (w, h) = (reader.info().width, reader.info().height);
        if (w, h) != (width, height) || w > MAX_SIDE || h > MAX_SIDE {
            return Err(fail(format!(
                "the blend mask is {w} x {h} pixels, and the facet's picture {width} x {height}"
            )));
        }
        let size = reader.output_buffer_size().ok_or_else(|| fail("the blend mask is too large".into()))?;
        let mut bytes = vec![0; size];
        let info = reader.next_frame(&mut bytes).map_err(|e| fail(format!("the blend mask is damaged: {e}")))?;
        let samples = info.color_type.samples();
        let share = |byte: u8| f32::from(byte) / 255.0;
        let pixel = |p: &[u8]| if samples < 3 { [share(p[0]); 3] } else { [share(p[0]), share(p[1]), share(p[2])] };
        let shares = bytes[..info.buffer_size()].chunks_exact(samples).map(pixel).collect();
        Ok(Blend { width, shares })
    }

    /// The fractions as bytes, 255 for all of the light.
    pub(crate) fn bytes(&self) -> Vec<[u8; 3]> {
        self.shares.iter().map(|shares| shares.map(|s| (255.0 * s).round() as u8)).collect()
    }

    /// Darkens a picture of the mask's size.
    pub fn apply(&self, image: &mut Image) {
        if image.width != self.width {
            return;
        }
        for (pixel, shares) in image.rgba.chunks_exact_mut(4).zip(&self.shares) {
            for k in 0..3 {
                pixel[k] = encoded(linear(f32::from(pixel[k]) / 255.0) * shares[k]);
            }
        }
    }
}

/// Converts linear light to an sRGB byte.
pub(crate) fn encoded(light: f32) -> u8 {
    let c = if light <= 0.003_130_8 { 12.92 * light } else { 1.055 * light.powf(1.0 / 2.4) - 0.055 };
    (255.0 * c.clamp(0.0, 1.0)).round() as u8
}

//! Edge blending: projectors that overlap share the light.

use crate::material::linear;
use crate::{Image, MAX_SIDE, RenderError};
use std::path::Path;

/// A fraction for each pixel and color: of the light that it keeps, or of the lift of black.
#[derive(Clone, Debug, PartialEq)]
pub struct Blend {
    /// Three fractions (red, green, blue) per pixel, 0 to 1, rows from the top.
    shares: Vec<[f32; 3]>,
}

impl Blend {
    /// Reads a PNG, gray or in color, of the size of one eye's picture. A value `m` of 0 to 255
    /// keeps `m / 255` of the light, in 16 bits `m / 65535`; alpha is not used.
    ///
    /// # Errors
    /// [`RenderError::File`] if it cannot be read or has another size.
    pub fn load(path: &Path, size_px: [u32; 2]) -> Result<Blend, RenderError> {
        let fail = |reason: String| RenderError::File { path: path.display().to_string(), reason };
        let file = tumble_scene::open_file(path).map_err(|e| fail(format!("the blend mask cannot be read: {e}")))?;
        Blend::read(std::io::BufReader::new(file), size_px).map_err(fail)
    }

    /// Reads a PNG as [`Blend::load`] does.
    ///
    /// # Errors
    /// The fault.
    pub fn read(from: impl std::io::BufRead + std::io::Seek, [width, height]: [u32; 2]) -> Result<Blend, String> {
        let mut decoder = png::Decoder::new(from);
        decoder.set_transformations(png::Transformations::EXPAND);
        let mut reader = decoder.read_info().map_err(|e| format!("the blend mask is no PNG: {e}"))?;
        let (w, h) = (reader.info().width, reader.info().height);
        if (w, h) != (width, height) || w > MAX_SIDE || h > MAX_SIDE {
            return Err(format!("the blend mask is {w} x {h} pixels, and the facet's picture {width} x {height}"));
        }
        let size = reader.output_buffer_size().ok_or("the blend mask is too large")?;
        let mut bytes = vec![0; size];
        let info = reader.next_frame(&mut bytes).map_err(|e| format!("the blend mask is damaged: {e}"))?;
        let bytes = &bytes[..info.buffer_size()];
        let values: Vec<f32> = match info.bit_depth {
            png::BitDepth::Sixteen => {
                bytes.chunks_exact(2).map(|two| f32::from(u16::from_be_bytes([two[0], two[1]])) / 65535.0).collect()
            }
            _ => bytes.iter().map(|byte| f32::from(*byte) / 255.0).collect(),
        };
        let samples = info.color_type.samples();
        let pixel = |p: &[f32]| if samples < 3 { [p[0]; 3] } else { [p[0], p[1], p[2]] };
        Ok(Blend { shares: values.chunks_exact(samples).map(pixel).collect() })
    }

    /// Returns fractions of red, green and blue, rows from the top, as the bytes of a PNG of 16 bits.
    ///
    /// # Errors
    /// [`RenderError::Png`] for as many fractions as the size does not have.
    pub fn png(shares: &[[f32; 3]], [width, height]: [u32; 2]) -> Result<Vec<u8>, RenderError> {
        let failed = |e: png::EncodingError| RenderError::Png(e.to_string());
        let mut out = Vec::new();
        let mut encoder = png::Encoder::new(&mut out, width, height);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Sixteen);
        let mut writer = encoder.write_header().map_err(failed)?;
        let word = |share: &f32| ((65535.0 * share.clamp(0.0, 1.0)).round() as u16).to_be_bytes();
        let bytes: Vec<u8> = shares.iter().flatten().flat_map(word).collect();
        writer.write_image_data(&bytes).map_err(failed)?;
        writer.finish().map_err(failed)?;
        Ok(out)
    }

    /// The fractions of red, green and blue by pixel, rows from the top.
    pub fn shares(&self) -> &[[f32; 3]] {
        &self.shares
    }

    /// Darkens a picture of the mask's size.
    pub fn apply(&self, image: &mut Image) {
        for (pixel, shares) in image.rgba.chunks_exact_mut(4).zip(&self.shares) {
            for k in 0..3 {
                pixel[k] = encoded(linear(f32::from(pixel[k]) / 255.0) * shares[k]);
            }
        }
    }
}

/// Returns shares of light and, as the fourth number, of lift by pixel; `None` without masks.
pub(crate) fn masks(blend: Option<&Blend>, black: Option<&Blend>) -> Option<Vec<[f32; 4]>> {
    let pixels = blend.or(black)?.shares.len();
    let at = |mask: Option<&Blend>, i: usize| mask.map_or([1.0; 3], |mask| mask.shares[i]);
    Some(
        (0..pixels)
            .map(|i| {
                let ([r, g, b], [lift, ..]) = (at(blend, i), at(black, i));
                [r, g, b, lift]
            })
            .collect(),
    )
}

/// Converts linear light to an sRGB byte.
pub(crate) fn encoded(light: f32) -> u8 {
    let c = if light <= 0.003_130_8 { 12.92 * light } else { 1.055 * light.powf(1.0 / 2.4) - 0.055 };
    (255.0 * c.clamp(0.0, 1.0)).round() as u8
}

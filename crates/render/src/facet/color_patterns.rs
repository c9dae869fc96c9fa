//! Calibration pictures for the color of projectors.

use super::blend::encoded;
use super::canvas::{fill_rect, put};
use crate::Image;

/// Shares of light of the bands.
const BANDS: [f32; 5] = [0.0, 0.1, 0.25, 0.5, 1.0];
/// Pixels between lines of a color.
const SPACING_PX: u32 = 16;

/// Ramps of gray, red, green and blue over all codes; then the darkest and the brightest 32 codes.
pub(super) fn ramps(image: &mut Image) {
    let (w, h) = (i64::from(image.width), i64::from(image.height));
    let row = |i: i64| (h * i / 6, h * (i + 1) / 6 - h * i / 6);
    for x in 0..w {
        let level = (255 * x / (w - 1).max(1)) as u8;
        for (i, mask) in [[1, 1, 1], [1, 0, 0], [0, 1, 0], [0, 0, 1]].iter().enumerate() {
            let (top, height) = row(i as i64);
            fill_rect(image, x, top, 1, height, [level * mask[0], level * mask[1], level * mask[2], 255]);
        }
        let step = (32 * x / w) as u8;
        for (i, level) in [(4, step), (5, 224 + step)] {
            let (top, height) = row(i);
            fill_rect(image, x, top, 1, height, [level, level, level, 255]);
        }
    }
}

/// Bands of light, the darkest at the top.
pub(super) fn bands(image: &mut Image) {
    let (w, h) = (i64::from(image.width), i64::from(image.height));
    let count = BANDS.len() as i64;
    for (i, light) in BANDS.iter().enumerate() {
        let (top, bottom) = (h * i as i64 / count, h * (i as i64 + 1) / count);
        let level = encoded(*light);
        fill_rect(image, 0, top, w, bottom - top, [level, level, level, 255]);
    }
}

/// Upright and level lines, four to a period: white, red, green, blue.
pub(super) fn convergence(image: &mut Image) {
    let colors = [[255, 255, 255, 255], [255, 0, 0, 255], [0, 255, 0, 255], [0, 0, 255, 255]];
    let line = |at: u32| at.is_multiple_of(SPACING_PX).then(|| colors[(at / SPACING_PX % 4) as usize]);
    for y in 0..image.height {
        for x in 0..image.width {
            if let Some(color) = line(x).or_else(|| line(y)) {
                put(image, x.into(), y.into(), color);
            }
        }
    }
}

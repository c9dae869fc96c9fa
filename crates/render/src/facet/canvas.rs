//! Filled rectangles in pictures, for calibration patterns, text and slider panels.

use crate::Image;

/// Sets a pixel, `x` to the right and `y` down from the top left corner; pixels outside the picture
/// are ignored.
pub(super) fn put(image: &mut Image, x: i64, y: i64, color: [u8; 4]) {
    if (0..i64::from(image.width)).contains(&x) && (0..i64::from(image.height)).contains(&y) {
        let at = 4 * (y as usize * image.width as usize + x as usize);
        image.rgba[at..at + 4].copy_from_slice(&color);
    }
}

/// Fills the rectangle of `w` x `h` pixels with its top left corner at `(x, y)`, clipped to the
/// picture.
pub(crate) fn fill_rect(image: &mut Image, x: i64, y: i64, w: i64, h: i64, color: [u8; 4]) {
    let rows = y.max(0)..(y + h).min(i64::from(image.height));
    for row in rows {
        (x.max(0)..(x + w).min(i64::from(image.width))).for_each(|column| put(image, column, row, color));
    }
}

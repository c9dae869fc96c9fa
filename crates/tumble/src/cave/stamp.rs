//! `--stamp`: the number of a frame in its picture, for people and for programs.
//!
//! In the upper left corner of the finished picture: 64 squares in two rows of 32, bit 63 first, white for 1 and black for 0, each of side
//! `max(2, width / 64)` pixels, with the number in figures below them.

use tumble::render::{Image, caption};

/// Squares in a row.
pub const COLUMNS: u32 = 32;

/// Side of a square in a picture of this width, pixels.
pub fn side_px(width: u32) -> u32 {
    (width / 64).max(2)
}

/// Draws it.
pub fn stamp(image: &mut Image, frame: u64) {
    let side = side_px(image.width);
    for k in 0..64 {
        let value = if frame >> (63 - k) & 1 == 1 { 255 } else { 0 };
        let (x, y) = (k % COLUMNS * side, k / COLUMNS * side);
        (0..side * side).for_each(|p| put(image, x + p % side, y + p / side, [value, value, value, 255]));
    }
    let text = caption(&[frame.to_string()], (image.width / 256).clamp(1, 8));
    for y in 0..text.height {
        for x in 0..text.width {
            // solid: what is below shall not show
            text.pixel(x, y).into_iter().for_each(|[r, g, b, _]| put(image, x, 2 * side + y, [r, g, b, 255]));
        }
    }
}

fn put(image: &mut Image, x: u32, y: u32, pixel: [u8; 4]) {
    if x < image.width && y < image.height {
        let at = 4 * (y as usize * image.width as usize + x as usize);
        image.rgba[at..at + 4].copy_from_slice(&pixel);
    }
}

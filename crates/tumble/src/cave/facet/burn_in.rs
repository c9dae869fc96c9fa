//! `--burn-in`: the frame number in the picture, for people and for programs.
//!
//! It occupies the upper left corner of the finished picture: 64 squares in two rows of 32, bit 63
//! first, white for 1 and black for 0. Each square has side `max(2, width / 64)` pixels. The number
//! in digits is below them.

use tumble::render::{Image, caption};

/// Number of squares in a row.
pub const COLUMNS: u32 = 32;

/// Returns the side of a square in a picture of this width, pixels.
pub fn side_px(width: u32) -> u32 {
    (width / 64).max(2)
}

/// Draws the number into a picture.
pub fn burn_in(image: &mut Image, frame: u64) {
    let strip = strip(image.width, frame);
    for y in 0..strip.height {
        for x in 0..strip.width {
            strip.pixel(x, y).into_iter().filter(|pixel| pixel[3] > 0).for_each(|pixel| put(image, x, y, pixel));
        }
    }
}

/// Returns the number as an image of its own, for a picture of this width.
pub fn strip(picture_width: u32, frame: u64) -> Image {
    let side = side_px(picture_width);
    let text = caption(&[frame.to_string()], (picture_width / 256).clamp(1, 8));
    let (width, height) = ((COLUMNS * side).max(text.width), 2 * side + text.height);
    let mut strip = Image { width, height, rgba: vec![0; 4 * (width * height) as usize] };
    for k in 0..64 {
        let value = if frame >> (63 - k) & 1 == 1 { 255 } else { 0 };
        let (x, y) = (k % COLUMNS * side, k / COLUMNS * side);
        (0..side * side).for_each(|p| put(&mut strip, x + p % side, y + p / side, [value, value, value, 255]));
    }
    for y in 0..text.height {
        for x in 0..text.width {
            text.pixel(x, y).into_iter().for_each(|pixel| put(&mut strip, x, 2 * side + y, pixel));
        }
    }
    strip
}

fn put(image: &mut Image, x: u32, y: u32, pixel: [u8; 4]) {
    // opaque wherever there is anything, so that the background does not show through
    let pixel = [pixel[0], pixel[1], pixel[2], 255];
    if x < image.width && y < image.height {
        let at = 4 * (y as usize * image.width as usize + x as usize);
        image.rgba[at..at + 4].copy_from_slice(&pixel);
    }
}

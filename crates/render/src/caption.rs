//! Lines of text on a dark background, to be blended over a picture.

use crate::Image;
use crate::facet::{blank, font};

/// Dots from one line to the next, and around the text.
const LINE: i64 = 10;
const RIM: i64 = 4;
/// Largest number of lines, and of letters per line.
const MAX_LINES: usize = 120;

const GROUND: [u8; 4] = [12, 14, 18, 170];
const INK: [u8; 4] = [236, 238, 240, 255];

/// Draws the lines one below the other, in capital letters of 5 x 7 dots, each dot `scale` (1 to 8)
/// pixels wide. Lines beyond 120, and letters beyond 120 in a line, are cut off.
pub fn caption<S: AsRef<str>>(lines: &[S], scale: u32) -> Image {
    let scale = i64::from(scale.clamp(1, 8));
    let lines: Vec<String> =
        lines.iter().take(MAX_LINES).map(|l| l.as_ref().to_uppercase().chars().take(MAX_LINES).collect()).collect();
    let width = lines.iter().map(|l| font::text_width(l, scale)).max().unwrap_or(0) + 2 * RIM * scale;
    let height = (LINE * lines.len() as i64 - 3).max(0) * scale + 2 * RIM * scale;
    let mut image = blank(width as u32, height as u32, GROUND);
    for (i, line) in lines.iter().enumerate() {
        font::write(&mut image, line, RIM * scale, (RIM + LINE * i as i64) * scale, scale, INK);
    }
    image
}

//! Composition of finished pictures: both eyes in one, mirrored, side by side.

use crate::Image;
use tumble_scene::cave::{Flip, Stereo};

/// A picture of one color.
pub(crate) fn blank(width: u32, height: u32, color: [u8; 4]) -> Image {
    let rgba = color.into_iter().cycle().take(4 * width as usize * height as usize).collect();
    Image { width, height, rgba }
}

/// Copies `from` into `into` with its top left corner at `x`, `y`; pixels outside are cut off.
pub(crate) fn paste(into: &mut Image, from: &Image, x: u32, y: u32) {
    let (w, h) = (
        from.width.min(into.width.saturating_sub(x)) as usize,
        from.height.min(into.height.saturating_sub(y)) as usize,
    );
    for row in 0..h {
        let source = 4 * row * from.width as usize;
        let target = 4 * ((y as usize + row) * into.width as usize + x as usize);
        into.rgba[target..target + 4 * w].copy_from_slice(&from.rgba[source..source + 4 * w]);
    }
}

/// Combines the pictures of the eyes (one, or left and right of one size) as the stereo mode shows
/// them.
pub(crate) fn combined(mut eyes: Vec<Image>, stereo: Stereo) -> Image {
    if eyes.len() < 2 || stereo == Stereo::Mono {
        return eyes.swap_remove(0);
    }
    let (left, right) = (&eyes[0], &eyes[1]);
    match stereo {
        Stereo::Mono | Stereo::SideBySide => {
            let mut whole = blank(left.width + right.width, left.height, [0, 0, 0, 255]);
            paste(&mut whole, left, 0, 0);
            paste(&mut whole, right, left.width, 0);
            whole
        }
        Stereo::TopBottom => {
            let mut whole = blank(left.width, left.height + right.height, [0, 0, 0, 255]);
            paste(&mut whole, left, 0, 0);
            paste(&mut whole, right, 0, left.height);
            whole
        }
        Stereo::Anaglyph => {
            let pixels = left.rgba.chunks_exact(4).zip(right.rgba.chunks_exact(4));
            let rgba = pixels.flat_map(|(l, r)| [l[0], r[1], r[2], 255]).collect();
            Image { width: left.width, height: left.height, rgba }
        }
    }
}

/// Mirrors a picture.
pub(crate) fn flipped(mut image: Image, flip: Flip) -> Image {
    let width = image.width as usize;
    if matches!(flip, Flip::Horizontal | Flip::Both) {
        for row in image.rgba.chunks_exact_mut(4 * width) {
            let mirrored: Vec<u8> = row.chunks_exact(4).rev().flatten().copied().collect();
            row.copy_from_slice(&mirrored);
        }
    }
    if matches!(flip, Flip::Vertical | Flip::Both) {
        image.rgba = image.rgba.chunks_exact(4 * width).rev().flatten().copied().collect();
    }
    image
}

//! Composition of finished pictures: both eyes in one, mirrored, side by side.

use crate::Image;
use tumble_scene::cave::{Flip, Stereo};

/// The place of one eye's picture in the whole.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct EyePlace {
    /// Top left corner, pixels.
    pub at_px: [u32; 2],
    /// Which of red, green and blue are written.
    pub channels: [bool; 3],
    pub parity: Parity,
}

/// The pixels of a picture that belong to one eye: those with `(across·x + down·y) mod 2 = phase`, `x` to
/// the right and `y` down from its top left corner. The default has all pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Parity {
    pub across: u32,
    pub down: u32,
    pub phase: u32,
}

impl Parity {
    fn has(self, x: u32, y: u32) -> bool {
        (self.across * x + self.down * y) % 2 == self.phase
    }
}

impl EyePlace {
    /// Returns the place of the eye with this index, the first or the second in the picture, from the
    /// size of one eye's picture.
    pub fn new(stereo: Stereo, index: usize, [width, height]: [u32; 2]) -> EyePlace {
        let second = index > 0;
        let parity = |across, down| Parity { across, down, phase: u32::from(second) };
        EyePlace {
            at_px: match stereo {
                Stereo::SideBySide if second => [width, 0],
                Stereo::TopBottom if second => [0, height],
                _ => [0, 0],
            },
            channels: match stereo {
                Stereo::Anaglyph => [!second, second, second],
                _ => [true; 3],
            },
            parity: match stereo {
                Stereo::Rows => parity(0, 1),
                Stereo::Columns => parity(1, 0),
                Stereo::Checkerboard => parity(1, 1),
                _ => Parity::default(),
            },
        }
    }
}

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

/// Combines the pictures of the eyes, one or two of one size in the order of their places, as the stereo
/// mode shows them.
pub(crate) fn combined(mut eyes: Vec<Image>, stereo: Stereo) -> Image {
    if eyes.len() < 2 {
        return eyes.swap_remove(0);
    }
    let size = [eyes[0].width, eyes[0].height];
    let [width, height] = stereo.whole_px(size);
    let mut whole = blank(width, height, [0, 0, 0, 255]);
    for (i, eye) in eyes.iter().enumerate() {
        let EyePlace { at_px, channels, parity } = EyePlace::new(stereo, i, size);
        for (k, pixel) in eye.rgba.chunks_exact(4).enumerate() {
            let (x, y) = (k as u32 % eye.width, k as u32 / eye.width);
            if parity.has(x, y) {
                let at = 4 * ((at_px[1] + y) as usize * width as usize + (at_px[0] + x) as usize);
                (0..3).filter(|&c| channels[c]).for_each(|c| whole.rgba[at + c] = pixel[c]);
            }
        }
    }
    whole
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

//! Looks at a facet's own pictures for the operator's console: black ones are counted, and once a
//! second a small copy is sent.

use super::frame_log::hex;
use crate::cave::facet_report::Reporter;
use std::time::{Duration, Instant};
use tumble::render::Image;

/// Interval between two small pictures.
const INTERVAL: Duration = Duration::from_secs(1);
/// Maximum width of a small picture, pixels.
const SMALL_WIDTH: u32 = 160;
/// Largest value of a color of a black pixel: encoders and dithers change the last bit.
const BLACK: u8 = 1;

/// Looks at pictures.
pub struct PictureWatch {
    reporter: Reporter,
    sent: Option<Instant>,
}

impl PictureWatch {
    pub fn new(reporter: Reporter) -> PictureWatch {
        PictureWatch { reporter, sent: None }
    }

    /// Returns whether the next picture is to be looked at even if it is read back for that alone.
    pub fn is_due(&self) -> bool {
        self.sent.is_none_or(|sent| sent.elapsed() >= INTERVAL)
    }

    /// Looks at a picture with this hash.
    pub fn look(&mut self, image: &Image, hash: &[u8; 16]) {
        let black = is_black(image);
        self.reporter.update(|report| {
            report.pictures += 1;
            report.black += u64::from(black);
            report.black_now = if black { report.black_now + 1 } else { 0 };
            report.image = hex(hash);
        });
        if self.is_due() {
            self.sent = Some(Instant::now());
            // an unusable picture is missing on the console, and nothing else
            small(image).to_png().into_iter().for_each(|png| self.reporter.picture(png));
        }
    }
}

/// Returns whether no pixel has light.
fn is_black(image: &Image) -> bool {
    image.rgba.as_chunks::<4>().0.iter().all(|[r, g, b, _]| r.max(g).max(b) <= &BLACK)
}

/// Returns the picture at a smaller size; each pixel is the mean of a block.
fn small(image: &Image) -> Image {
    let side = image.width.div_ceil(SMALL_WIDTH).max(1);
    let (width, height) = ((image.width / side).max(1), (image.height / side).max(1));
    let mut rgba = Vec::with_capacity((4 * width * height) as usize);
    for (y, x) in (0..height).flat_map(|y| (0..width).map(move |x| (y, x))) {
        let block = (0..side * side).filter_map(|k| image.pixel(x * side + k % side, y * side + k / side));
        let (sum, count) = block.fold(([0u32; 3], 0u32), |(sum, count), [r, g, b, _]| {
            ([sum[0] + u32::from(r), sum[1] + u32::from(g), sum[2] + u32::from(b)], count + 1)
        });
        rgba.extend(sum.map(|sum| (sum / count.max(1)) as u8));
        rgba.push(255);
    }
    Image { width, height, rgba }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(width: u32, height: u32, pixel: impl Fn(u32, u32) -> [u8; 3]) -> Image {
        let at = |k: u32| pixel(k % width, k / width);
        let rgba = (0..width * height).flat_map(|k| [at(k)[0], at(k)[1], at(k)[2], 255]).collect();
        Image { width, height, rgba }
    }

    #[test]
    fn one_lit_pixel_is_no_black_picture_and_small_ones_keep_the_mean() {
        assert!(is_black(&image(40, 30, |_, _| [1, 0, 1])));
        assert!(!is_black(&image(40, 30, |x, y| [0, 0, if (x, y) == (39, 29) { 2 } else { 0 }])));
        let large = image(640, 480, |x, y| [if x % 4 < 2 { 200 } else { 100 }, (y / 4) as u8, 7]);
        let small = small(&large);
        assert_eq!((small.width, small.height), (160, 120));
        assert_eq!(small.pixel(17, 90), Some([150, 90, 7, 255]));
        assert_eq!(super::small(&image(3, 2, |_, _| [9; 3])).width, 3);
    }
}

//! Photographs: PNG and JPEG files as brightness.

use std::path::Path;
use tumble_render::Image;
use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

/// Largest side of a photograph, pixels.
const MAX_SIDE: usize = 16384;
/// Largest number of pixels of a photograph.
const MAX_PIXELS: usize = 1 << 26;
/// Largest file, bytes.
const MAX_BYTES: u64 = 256 << 20;
/// A color of this code value or more may have been brighter than the camera shows.
const CLIPPED: u8 = 253;

/// A photograph in gray.
#[derive(Clone, Debug, PartialEq)]
pub struct Photo {
    /// Width and height, pixels.
    pub size_px: [u32; 2],
    /// Mean of the code values of red, green and blue, 0 to 1, rows from the top.
    pub codes: Vec<f32>,
    /// Whether a color of the pixel is at the upper end of the codes.
    pub clipped: Vec<bool>,
}

impl Photo {
    /// Converts a picture.
    pub fn of(image: &Image) -> Photo {
        Photo::from_rgb([image.width, image.height], image.rgba.chunks_exact(4))
    }

    fn from_rgb<'a>(size_px: [u32; 2], pixels: impl Iterator<Item = &'a [u8]> + Clone) -> Photo {
        let mean = |p: &[u8]| p[..3].iter().map(|c| f32::from(*c)).sum::<f32>() / 765.0;
        let clipped = |p: &[u8]| p[..3].iter().any(|c| *c >= CLIPPED);
        Photo { size_px, codes: pixels.clone().map(mean).collect(), clipped: pixels.map(clipped).collect() }
    }

    /// Reads a PNG or JPEG file: at most 256 MiB, 16384 pixels a side, 2²⁶ pixels.
    ///
    /// # Errors
    /// The fault, without the name of the file.
    pub fn load(path: &Path) -> Result<Photo, String> {
        let unread = |e: std::io::Error| format!("cannot be read: {e}");
        let length = std::fs::metadata(path).map_err(unread)?.len();
        if length > MAX_BYTES {
            return Err(format!("has {length} bytes, and at most {MAX_BYTES} are read"));
        }
        Photo::parse(&tumble_scene::read_file(path).map_err(unread)?)
    }

    /// Parses the bytes of a PNG or JPEG file: at most 16384 pixels a side, 2²⁶ pixels.
    ///
    /// # Errors
    /// The fault.
    pub fn parse(bytes: &[u8]) -> Result<Photo, String> {
        match bytes {
            [0xff, 0xd8, ..] => Photo::from_jpeg(bytes),
            [0x89, b'P', b'N', b'G', ..] => Photo::from_png(bytes),
            _ => Err("is no PNG and no JPEG file".into()),
        }
    }

    fn from_jpeg(bytes: &[u8]) -> Result<Photo, String> {
        let damaged = |e: &dyn std::fmt::Display| format!("is a damaged JPEG file: {e}");
        let options = DecoderOptions::default()
            .set_max_width(MAX_SIDE)
            .set_max_height(MAX_SIDE)
            .jpeg_set_out_colorspace(ColorSpace::RGB);
        let mut decoder = JpegDecoder::new_with_options(ZCursor::new(bytes), options);
        decoder.decode_headers().map_err(|e| damaged(&e))?;
        let (w, h) = decoder.dimensions().ok_or_else(|| damaged(&"it has no size"))?;
        check_size(w, h)?;
        let rgb = decoder.decode().map_err(|e| damaged(&e))?;
        if rgb.len() < 3 * w * h {
            return Err(damaged(&"pixels are missing"));
        }
        Ok(Photo::from_rgb([w as u32, h as u32], rgb[..3 * w * h].chunks_exact(3)))
    }

    fn from_png(bytes: &[u8]) -> Result<Photo, String> {
        let damaged = |e: &dyn std::fmt::Display| format!("is a damaged PNG file: {e}");
        let mut decoder = png::Decoder::new(std::io::Cursor::new(bytes));
        decoder.set_transformations(png::Transformations::EXPAND | png::Transformations::STRIP_16);
        let mut reader = decoder.read_info().map_err(|e| damaged(&e))?;
        let (w, h) = (reader.info().width, reader.info().height);
        check_size(w as usize, h as usize)?;
        let mut pixels = vec![0; reader.output_buffer_size().ok_or_else(|| damaged(&"it is too large"))?];
        let info = reader.next_frame(&mut pixels).map_err(|e| damaged(&e))?;
        let pixels = &pixels[..info.buffer_size()];
        Ok(match info.color_type.samples() {
            // gray, with or without alpha
            n @ (1 | 2) => {
                let rgb: Vec<u8> = pixels.chunks_exact(n).flat_map(|p| [p[0]; 3]).collect();
                Photo::from_rgb([w, h], rgb.chunks_exact(3))
            }
            n => Photo::from_rgb([w, h], pixels.chunks_exact(n)),
        })
    }
}

fn check_size(w: usize, h: usize) -> Result<(), String> {
    match w.max(h) <= MAX_SIDE && w * h <= MAX_PIXELS && w * h > 0 {
        true => Ok(()),
        false => Err(format!("is {w} x {h} pixels, and at most {MAX_SIDE} a side and {MAX_PIXELS} together are read")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 4 x 2 pixels of the color 200, 100, 50, as another program wrote them.
    const JPEG: &str = "ffd8ffe000104a46494600010100000100010000ffdb00430002010101010102010101020202020204030202020205040403 \
        04060506060605060606070908060709070606080b08090a0a0a0a0a06080b0c0b0a0c090a0a0affdb004301020202020202 \
        050303050a0706070a0a0a0a0a0a0a0a0a0a0a0a0a0a0a0a0a0a0a0a0a0a0a0a0a0a0a0a0a0a0a0a0a0a0a0a0a0a0a0a0a0a \
        0a0a0a0a0a0a0a0affc00011080002000403011100021101031101ffc40014000100000000000000000000000000000005ff \
        c40014100100000000000000000000000000000000ffc40014010100000000000000000000000000000008ffc40014110100 \
        000000000000000000000000000000ffda000c03010002110311003f003c57361fffd9";

    fn jpeg() -> Vec<u8> {
        let digits: Vec<u8> = JPEG.bytes().filter(u8::is_ascii_hexdigit).collect();
        digits.chunks(2).map(|two| u8::from_str_radix(std::str::from_utf8(two).unwrap(), 16).unwrap()).collect()
    }

    #[test]
    fn a_jpeg_is_read_and_a_damaged_one_is_an_error() {
        let photo = Photo::from_jpeg(&jpeg()).unwrap();
        assert_eq!((photo.size_px, photo.codes.len()), ([4, 2], 8));
        assert!(photo.codes.iter().all(|code| (code - 350.0 / 765.0).abs() < 0.01), "{:?}", photo.codes);
        assert!(photo.clipped.iter().all(|clipped| !clipped));
        for cut in [3, 40, 160, 200] {
            assert!(Photo::from_jpeg(&jpeg()[..cut]).unwrap_err().starts_with("is a damaged JPEG file"), "{cut}");
        }
        // every byte changed once: an error or a picture, never a panic
        for at in 0..jpeg().len() {
            let mut bytes = jpeg();
            bytes[at] ^= 0x55;
            let _ = Photo::from_jpeg(&bytes);
        }
    }
}

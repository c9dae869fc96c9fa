//! Pictures in memory, as PNG and from PNG.

use crate::RenderError;
use std::fs::File;
use std::io::{BufReader, BufWriter, Write};
use std::path::Path;
use tumble_scene::{MAX_TEXTURE_SIDE, open_file};

/// A picture: 8-bit sRGB with alpha, rows from the top, four bytes `r, g, b, a` per pixel.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Image {
    /// Pixels per row.
    pub width: u32,
    /// Number of rows.
    pub height: u32,
    /// `4 * width * height` bytes.
    pub rgba: Vec<u8>,
}

impl Image {
    /// Returns the pixel `x` to the right and `y` down from the top left corner; `None` outside the
    /// picture.
    pub fn pixel(&self, x: u32, y: u32) -> Option<[u8; 4]> {
        if x >= self.width || y >= self.height {
            return None;
        }
        let at = 4 * (y as usize * self.width as usize + x as usize);
        self.rgba.get(at..at + 4)?.try_into().ok()
    }

    /// Writes the picture as an 8-bit RGBA PNG marked as sRGB. Parent folders must exist.
    ///
    /// # Errors
    /// [`RenderError::File`] names the path.
    pub fn write_png(&self, path: impl AsRef<Path>) -> Result<(), RenderError> {
        let path = path.as_ref();
        let fail = |reason: String| RenderError::File { path: path.display().to_string(), reason };
        let file = File::create(path).map_err(|e| fail(e.to_string()))?;
        self.encode(BufWriter::new(file)).map_err(|e| fail(e.to_string()))
    }

    /// Returns the bytes that [`Image::write_png`] writes.
    ///
    /// # Errors
    /// [`RenderError::Png`] for an image without pixels, or without four bytes for each.
    pub fn to_png(&self) -> Result<Vec<u8>, RenderError> {
        let mut bytes = Vec::new();
        self.encode(&mut bytes).map_err(|e| RenderError::Png(e.to_string()))?;
        Ok(bytes)
    }

    /// Writes the picture as [`Image::write_png`] does, in parts of at most 64 rows. After each,
    /// `done` gets the number of its rows, so that a program sees the progress of a large picture.
    ///
    /// # Errors
    /// [`RenderError::Png`] for an image without pixels or without four bytes for each, and for
    /// errors of `to`.
    pub fn encode_png(&self, to: impl Write, mut done: impl FnMut(u32)) -> Result<(), RenderError> {
        let encode = || {
            let mut writer = self.encoder(to).write_header()?;
            let mut stream = writer.stream_writer()?;
            for part in self.rgba.chunks(4 * 64 * self.width.max(1) as usize) {
                stream.write_all(part)?;
                done(part.len() as u32 / (4 * self.width.max(1)));
            }
            stream.finish()?;
            writer.finish()
        };
        let encoded: Result<(), png::EncodingError> = encode();
        encoded.map_err(|e| RenderError::Png(e.to_string()))
    }

    fn encode(&self, to: impl Write) -> Result<(), png::EncodingError> {
        let mut writer = self.encoder(to).write_header()?;
        writer.write_image_data(&self.rgba)?;
        writer.finish()
    }

    fn encoder<W: Write>(&self, to: W) -> png::Encoder<'static, W> {
        let mut encoder = png::Encoder::new(to, self.width, self.height);
        encoder.set_color(png::ColorType::Rgba);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_compression(png::Compression::High);
        encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
        encoder
    }

    /// Reads any PNG as a texture. Gray, palettes and 16 bits become 8-bit RGBA. Sides are at most
    /// 8192 pixels.
    ///
    /// # Errors
    /// [`RenderError::File`] names the path and the fault.
    pub fn load_png(path: impl AsRef<Path>) -> Result<Image, RenderError> {
        let path = path.as_ref();
        let fail = |reason: String| RenderError::File { path: path.display().to_string(), reason };
        let file = open_file(path).map_err(|e| fail(format!("the texture cannot be read: {e}")))?;
        let mut decoder = png::Decoder::new(BufReader::new(file));
        decoder.set_transformations(png::Transformations::EXPAND | png::Transformations::STRIP_16);
        let mut reader = decoder.read_info().map_err(|e| fail(format!("the texture is no PNG: {e}")))?;
        let (width, height) = (reader.info().width, reader.info().height);
        if width.max(height) > MAX_TEXTURE_SIDE {
            let most = MAX_TEXTURE_SIDE;
            return Err(fail(format!("the texture is {width} x {height} pixels, and each side may have {most}")));
        }
        let size = reader.output_buffer_size().ok_or_else(|| fail("the texture is too large".into()))?;
        let mut bytes = vec![0; size];
        let info = reader.next_frame(&mut bytes).map_err(|e| fail(format!("the texture is damaged: {e}")))?;
        let samples = info.color_type.samples();
        let pixel = |p: &[u8]| if samples < 3 { [p[0], p[0], p[0], 255] } else { [p[0], p[1], p[2], 255] };
        let rgba = bytes[..info.buffer_size()].chunks_exact(samples).flat_map(pixel).collect();
        Ok(Image { width, height, rgba })
    }

    /// Reads an 8-bit RGBA PNG as written by [`Image::write_png`], for golden pictures.
    ///
    /// # Errors
    /// [`RenderError::File`] names the path and the fault; other PNG layouts are refused.
    pub fn read_png(path: impl AsRef<Path>) -> Result<Image, RenderError> {
        let path = path.as_ref();
        let fail = |reason: String| RenderError::File { path: path.display().to_string(), reason };
        let file = open_file(path).map_err(|e| fail(e.to_string()))?;
        let mut reader = png::Decoder::new(BufReader::new(file)).read_info().map_err(|e| fail(e.to_string()))?;
        let info = reader.info();
        let (width, height) = (info.width, info.height);
        if (info.color_type, info.bit_depth) != (png::ColorType::Rgba, png::BitDepth::Eight) {
            return Err(fail("expected an 8-bit RGBA PNG".into()));
        }
        if width > crate::MAX_SIDE
            || height > crate::MAX_SIDE
            || u64::from(width) * u64::from(height) > crate::MAX_PIXELS
        {
            return Err(fail(format!("{width} x {height} pixels are more than a picture may have")));
        }
        let mut rgba = vec![0; 4 * width as usize * height as usize];
        reader.next_frame(&mut rgba).map_err(|e| fail(e.to_string()))?;
        Ok(Image { width, height, rgba })
    }
}

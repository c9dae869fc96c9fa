//! Files of textures: what is checked before a world has one.

use crate::open::plain::open_file;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::Path;

/// Largest side of a texture, pixels.
pub const MAX_TEXTURE_SIDE: u32 = 8192;
/// The chunk with which a PNG ends: no bytes, its name, its checksum.
const END: [u8; 12] = [0, 0, 0, 0, b'I', b'E', b'N', b'D', 0xAE, 0x42, 0x60, 0x82];

/// Checks that a file is a PNG which a surface can have: its header, its size, at most [`MAX_TEXTURE_SIDE`] pixels on each side, and that
/// it is whole to its end. Its pixels are decoded when it is first drawn.
///
/// # Errors
/// A sentence without the file's name.
pub fn check_texture(path: &Path) -> Result<(), String> {
    let mut file = open_file(path).map_err(|e| format!("the texture cannot be read: {e}"))?;
    let reader = png::Decoder::new(BufReader::new(&mut file)).read_info();
    let (width, height) = match reader {
        Ok(reader) => (reader.info().width, reader.info().height),
        Err(e) => return Err(format!("the texture is no PNG: {e}")),
    };
    if width.max(height) > MAX_TEXTURE_SIDE {
        return Err(format!("the texture is {width} x {height} pixels, and each side may have {MAX_TEXTURE_SIDE}"));
    }
    let mut end = [0; END.len()];
    let read = file.seek(SeekFrom::End(-(END.len() as i64))).and_then(|_| file.read_exact(&mut end));
    match read.is_ok() && end == END {
        true => Ok(()),
        false => Err("the texture is damaged: it has no end".into()),
    }
}

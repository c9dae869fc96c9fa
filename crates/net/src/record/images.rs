//! Images of cameras in a recording: a topic `/tumble/cameras/NAME` for each, with `foxglove.RawImage` messages.
//!
//! | camera | encoding | pixel |
//! |---|---|---|
//! | depth | `32FC1` | distance along the axis of the camera, m; −1 where nothing is |
//! | color | `rgb8` | sRGB |
//! | segmentation | `16UC1` | index of the entity in `/tf` plus 1; 0 where nothing is |
//!
//! Rows follow each other from the top, without padding; numbers are little-endian. An image comes before the state message of
//! its frame and has its log time. A channel is in the file from its first message on, so readers of earlier versions skip it.

use super::error::{RecordError, Result};
use super::messages::stamp;
use super::schemas::PROTOBUF;
use super::writer::AppendWriter;
use super::{MAX_NAME_BYTES, MAX_STATE_BYTES, ROOT_FRAME};
use foxglove::Encode;
use foxglove::messages::RawImage;
use prost::Message;
use std::collections::BTreeMap;
use std::path::Path;

/// Beginning of the topic of a camera; its name follows.
pub const TOPIC_CAMERAS: &str = "/tumble/cameras/";
/// Maximum number of cameras in a recording.
pub const MAX_CAMERAS: usize = 128;
pub(crate) const IMAGE_SCHEMA: &str = "foxglove.RawImage";
const DEPTH: &str = "32FC1";
const COLOR: &str = "rgb8";
const PARTS: &str = "16UC1";
/// Number of entities that a segmentation distinguishes.
const MAX_SEEN: u32 = u16::MAX as u32;

/// The pixels of an image, by rows from the top.
#[derive(Clone, Debug, PartialEq)]
pub enum Pixels {
    /// Distances along the axis of a depth camera, m; −1 where nothing is.
    Depth(Vec<f32>),
    /// sRGB of a color camera.
    Color(Vec<[u8; 3]>),
    /// Indices of entities that a segmentation camera sees; `None` where nothing is.
    Parts(Vec<Option<u32>>),
}

impl Pixels {
    /// Returns the number of pixels.
    fn count(&self) -> usize {
        match self {
            Pixels::Depth(pixels) => pixels.len(),
            Pixels::Color(pixels) => pixels.len(),
            Pixels::Parts(pixels) => pixels.len(),
        }
    }
}

/// An image of a camera.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordedImage {
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// The pixels.
    pub pixels: Pixels,
}

/// The images of a frame by the names of their cameras.
pub type Images = BTreeMap<String, RecordedImage>;

/// Channels of cameras by their names; they exist in a file from their first message on.
#[derive(Debug, Default)]
pub(crate) struct ImageChannels {
    schema: Option<u16>,
    channels: BTreeMap<String, u16>,
}

impl ImageChannels {
    /// Returns the number of the channel of a camera, and adds it to the file if it is new.
    pub fn of(&mut self, name: &str, writer: &mut AppendWriter, path: &Path) -> Result<u16> {
        if let Some(channel) = self.channels.get(name) {
            return Ok(*channel);
        }
        if self.channels.len() >= MAX_CAMERAS {
            return Err(RecordError::input("a frame", format!("more than {MAX_CAMERAS} cameras")));
        }
        let data = RawImage::get_schema().map(|schema| schema.data.into_owned()).unwrap_or_default();
        let mut add = || {
            let schema = match self.schema {
                Some(schema) => schema,
                None => writer.add_schema(IMAGE_SCHEMA, PROTOBUF, &data)?,
            };
            self.schema = Some(schema);
            writer.add_channel(schema, &format!("{TOPIC_CAMERAS}{name}"), PROTOBUF, &BTreeMap::new())
        };
        let added = add().map_err(RecordError::write(path))?;
        self.channels.insert(name.to_owned(), added);
        Ok(added)
    }
}

/// Checks an image and returns its pixels as bytes.
///
/// # Errors
/// The fault: another number of pixels than the size says, a number that is not finite, too many bytes, a long name.
pub(crate) fn encode_image(name: &str, image: &RecordedImage) -> std::result::Result<RawImage, String> {
    let wrong = |why: String| Err(format!("the image of \"{name}\": {why}"));
    let RecordedImage { width, height, pixels } = image;
    let count = u64::from(*width) * u64::from(*height);
    if count == 0 || count != pixels.count() as u64 {
        return wrong(format!("{} pixels for {width} x {height}", pixels.count()));
    }
    if name.is_empty() || name.len() > MAX_NAME_BYTES {
        return wrong(format!("its name has {} bytes, 1 to {MAX_NAME_BYTES} are allowed", name.len()));
    }
    let (encoding, data): (_, Vec<u8>) = match pixels {
        Pixels::Depth(depths) if depths.iter().any(|depth| !depth.is_finite()) => {
            return wrong("a depth that is not finite".into());
        }
        Pixels::Depth(depths) => (DEPTH, depths.iter().flat_map(|depth| depth.to_le_bytes()).collect()),
        Pixels::Color(colors) => (COLOR, colors.iter().flatten().copied().collect()),
        Pixels::Parts(parts) => {
            if let Some(part) = parts.iter().flatten().find(|part| **part >= MAX_SEEN) {
                return wrong(format!("it sees entity {part}; the first {MAX_SEEN} can be recorded"));
            }
            let number = |part: &Option<u32>| part.map_or(0, |part| part as u16 + 1).to_le_bytes();
            (PARTS, parts.iter().flat_map(number).collect())
        }
    };
    if data.len() > MAX_STATE_BYTES {
        return wrong(format!("{} bytes, at most {MAX_STATE_BYTES} are allowed", data.len()));
    }
    let step = (data.len() / *height as usize) as u32;
    let (timestamp, frame_id, encoding) = (None, ROOT_FRAME.into(), encoding.into());
    Ok(RawImage { timestamp, frame_id, width: *width, height: *height, encoding, step, data: data.into() })
}

/// Returns the message of a checked image at a log time.
pub(crate) fn image_message(mut image: RawImage, log_time: u64) -> Vec<u8> {
    image.timestamp = Some(stamp(log_time));
    image.encode_to_vec()
}

/// Reads the message of a camera.
pub(crate) fn decode_image(name: &str, data: &[u8]) -> std::result::Result<RecordedImage, String> {
    let wrong = |why: &str| format!("the image of \"{name}\": {why}");
    let RawImage { width, height, encoding, step, data, .. } =
        RawImage::decode(data).map_err(|e| wrong(&e.to_string()))?;
    let bytes = match encoding.as_str() {
        DEPTH => 4,
        COLOR => 3,
        PARTS => 2,
        _ => return Err(wrong("an unknown encoding")),
    };
    let row = u64::from(width) * bytes;
    // both fit: 32 bits times 32 bits times 4 at most, in 128 bits
    if row == 0 || u64::from(step) != row || u128::from(row) * u128::from(height) != data.len() as u128 {
        return Err(wrong("its size and its bytes do not agree"));
    }
    let pixels = match encoding.as_str() {
        DEPTH => {
            let depths: Vec<f32> = data.as_chunks().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect();
            if depths.iter().any(|depth| !depth.is_finite()) {
                return Err(wrong("a depth that is not finite"));
            }
            Pixels::Depth(depths)
        }
        COLOR => Pixels::Color(data.as_chunks().0.to_vec()),
        _ => {
            let part = |bytes: &[u8; 2]| u32::from(u16::from_le_bytes(*bytes)).checked_sub(1);
            Pixels::Parts(data.as_chunks().0.iter().map(part).collect())
        }
    };
    Ok(RecordedImage { width, height, pixels })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Messages whose size and bytes do not agree, and of other encodings, are refused before anything is allocated for them.
    #[test]
    fn malformed_images_are_refused() {
        let pixels = Pixels::Depth(vec![1.0; 6]);
        let good = encode_image("eye", &RecordedImage { width: 3, height: 2, pixels }).unwrap();
        assert!(decode_image("eye", &image_message(good.clone(), 0)).is_ok());
        let nan: Vec<u8> = [f32::NAN; 6].iter().flat_map(|x| x.to_le_bytes()).collect();
        for (bad, why) in [
            (RawImage { width: 0, ..good.clone() }, "do not agree"),
            (RawImage { height: 0, ..good.clone() }, "do not agree"),
            (RawImage { width: u32::MAX, height: u32::MAX, step: u32::MAX, ..good.clone() }, "do not agree"),
            (RawImage { step: 11, ..good.clone() }, "do not agree"),
            (RawImage { data: vec![0; 23].into(), ..good.clone() }, "do not agree"),
            (RawImage { encoding: "bgr8".into(), ..good.clone() }, "an unknown encoding"),
            (RawImage { data: nan.into(), ..good.clone() }, "not finite"),
        ] {
            let error = decode_image("eye", &image_message(bad, 0)).unwrap_err();
            assert!(error.contains("\"eye\"") && error.contains(why), "{error}");
        }
        assert!(decode_image("eye", &[0xff; 9]).is_err());
    }
}

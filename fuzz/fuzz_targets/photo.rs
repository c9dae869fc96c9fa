//! A photograph of a projector's patterns: PNG or JPEG.
#![no_main]

use libfuzzer_sys::fuzz_target;
use tumble_calibrate::Photo;

fuzz_target!(|bytes: &[u8]| {
    let Ok(photo) = Photo::parse(bytes) else { return };
    let pixels = photo.size_px.iter().map(|n| *n as usize).product::<usize>();
    assert_eq!((photo.codes.len(), photo.clipped.len()), (pixels, pixels));
    assert!(photo.codes.iter().all(|code| (0.0..=1.0).contains(code)));
});

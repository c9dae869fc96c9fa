//! A frame of a recorded session, parsed.
#![no_main]

use libfuzzer_sys::fuzz_target;
use tumble_net::sync::parse_frame;

fuzz_target!(|bytes: &[u8]| {
    if let Ok((frame, _)) = parse_frame(bytes) {
        assert!(frame.recorded.state.len() < bytes.len());
    }
});

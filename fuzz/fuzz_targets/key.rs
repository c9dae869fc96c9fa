//! The text of a key file.
#![no_main]

use libfuzzer_sys::fuzz_target;
use tumble_net::sync::udp::SharedKey;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(key) = SharedKey::parse(bytes) {
        assert!(key.is_secret());
    }
});

//! Requests and messages of a browser that shows a facet: nothing is answered without the key, and an
//! accepted message is read again as it is written.
#![no_main]

use libfuzzer_sys::fuzz_target;
use tumble_net::browser::{BrowserMessage, read_request};

const KEY: &str = "0123456789abcdef0123456789abcdef";

fuzz_target!(|bytes: &[u8]| {
    if let Ok(Some(_)) = read_request(bytes, KEY) {
        assert!(bytes.windows(KEY.len()).any(|window| window == KEY.as_bytes()));
    }
    let message = std::str::from_utf8(bytes).ok().and_then(BrowserMessage::read);
    if let Some(message) = message {
        assert_eq!(BrowserMessage::read(&message.to_string()), Some(message));
    }
});

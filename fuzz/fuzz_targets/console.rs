//! Requests to the operator's console: none is an action without the token, and an accepted one is
//! read again as it is written.
#![no_main]

use libfuzzer_sys::fuzz_target;
use tumble_net::control::{Action, read_request};

const TOKEN: &str = "0123456789abcdef0123456789abcdef";

fuzz_target!(|bytes: &[u8]| {
    if let Ok(Some(action)) = read_request(bytes, TOKEN)
        && action != Action::Page
    {
        assert!(bytes.windows(TOKEN.len()).any(|window| window == TOKEN.as_bytes()));
        let (method, path) = action.request();
        let again = format!("{method} {path} HTTP/1.1\r\nAuthorization: Bearer {TOKEN}\r\n\r\n");
        assert_eq!(read_request(again.as_bytes(), TOKEN), Ok(Some(action)));
    }
});

//! The JSON of a sphere tree: refused, or a tree that is written and read again as it is.
#![no_main]

use libfuzzer_sys::fuzz_target;
use tumble_collide::TreeFile;

fuzz_target!(|text: &str| {
    match TreeFile::from_json(text) {
        Err(error) => assert!(!error.to_string().is_empty()),
        Ok(file) => {
            let again = TreeFile::from_json(&file.to_json()).expect("what is written is read");
            assert_eq!(again.to_json(), file.to_json());
        }
    }
});

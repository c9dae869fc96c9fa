//! The fuzz target of `fuzz/` for archives, run without a fuzzer: on its seeds, and on seeds that were
//! cut and flipped.

use std::path::Path;
use tumble_calibrate::{Mpcdi, mpcdi_to_cave};

/// Replaces the macro of `libfuzzer_sys`: makes a target a function of its bytes.
#[macro_export]
macro_rules! fuzz_target {
    (|$bytes:ident: &[u8]| $body:block) => {
        pub fn target($bytes: &[u8]) {
            $body
        }
    };
}

#[allow(unused_attributes, unused_imports)]
#[path = "../../../../fuzz/fuzz_targets/mpcdi.rs"]
mod mpcdi_target;

#[test]
fn seeds_are_read_whole_and_damaged_without_a_panic() {
    for name in ["archive", "description"] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/seeds/mpcdi").join(name);
        let seed = std::fs::read(path).unwrap();
        let read = Mpcdi::parse(&seed).unwrap_or_else(|e| panic!("{name}: {e}"));
        mpcdi_to_cave(&read, [0.0, 0.0, 1.7]).unwrap_or_else(|e| panic!("{name}: {e}"));
        for i in 0..seed.len() {
            let mut damaged = seed.clone();
            damaged[i] ^= 1 << (i % 8);
            mpcdi_target::target(&damaged);
            mpcdi_target::target(&seed[..i]);
        }
    }
}

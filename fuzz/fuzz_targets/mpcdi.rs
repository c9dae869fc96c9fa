//! An MPCDI archive, or its description alone, made a cave.
#![no_main]

use libfuzzer_sys::fuzz_target;
use tumble_calibrate::{Mpcdi, mpcdi_to_cave};

fuzz_target!(|bytes: &[u8]| {
    let Ok(archive) = Mpcdi::parse(bytes) else { return };
    // masks of this size are read
    if archive.regions.iter().all(|region| region.size_px[0] * region.size_px[1] <= 1 << 20)
        && let Ok(made) = mpcdi_to_cave(&archive, [0.0, 0.0, 1.7])
    {
        let _ = tumble_scene::cave::Cave::parse(&made.cave, "fuzz.toml");
    }
});

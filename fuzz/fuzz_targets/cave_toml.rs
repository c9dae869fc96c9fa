//! The text of a cave file: parsed; if it is valid, its notes, the gaps between its screens, and
//! the projections of its facets.
#![no_main]

use libfuzzer_sys::fuzz_target;
use tumble_scene::cave::{Cave, gaps, is_cave};

fuzz_target!(|text: &str| {
    let _ = is_cave(text);
    match Cave::parse(text, "fuzz.toml") {
        Err(error) => assert!(!error.report(false).is_empty()),
        Ok(cave) => {
            assert!(gaps(&cave.screens).iter().all(|gap| gap.gap_m.is_finite()));
            for facet in &cave.facets {
                let (screen, user) = (&cave.screens[facet.screen], &cave.users[facet.user]);
                // a valid facet can be projected
                for side in facet.stereo.sides() {
                    assert!(screen.distance_m(&user.eye(*side)).is_finite());
                }
                assert!(screen.normal().norm() > 0.5 && cave.facet(&facet.name).is_ok());
            }
        }
    }
});

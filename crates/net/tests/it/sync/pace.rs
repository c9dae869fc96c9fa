//! Facets that draw slower than frames come.

use super::lockstep::STORM;
use super::stage::*;
use std::time::Duration;
use tumble_net::sync::simulate::Weather;
use tumble_net::sync::{Pace, Standing};

/// Frames come every 16 ms; each facet draws so long.
fn wall(seed: u64, weather: Weather, takes: Duration) -> Stage {
    let mut stage = Stage::new(seed, weather, 3, Pace::Lockstep);
    stage.facets.iter_mut().for_each(|facet| facet.takes = takes);
    assert!(stage.until(Duration::from_secs(2), |s| s.facets.iter().all(|f| f.shown.len() >= 5)));
    stage
}

fn late(stage: &Stage) -> Vec<u64> {
    (0..3).map(|k| stage.server.as_ref().unwrap().counts(k).0.late).collect()
}

fn in_step(stage: &Stage) -> bool {
    (0..3).all(|k| stage.server.as_ref().unwrap().standing(k) == Standing::InStep)
}

/// All are slow, and one moment was too long for all: nobody holds the server back then, so frames come faster than anyone draws.
#[test]
fn a_slow_wall_that_stumbled_is_in_step_again() {
    for (seed, weather) in [(1, Weather::CLEAR), (2, STORM)] {
        for takes in [30 * MS, 60 * MS, 70 * MS] {
            let mut stage = wall(seed, weather, takes);
            let until = stage.now + 250 * MS;
            stage.facets.iter_mut().for_each(|facet| facet.frozen_until = until);
            stage.run(250 * MS);
            assert!(late(&stage).iter().any(|late| *late > 0), "{:?}", late(&stage));
            assert!(stage.until(1000 * MS, in_step), "{takes:?}, seed {seed}: {:?}", late(&stage));
            // from here on they show the same frames, one after the other, and nothing is left out
            stage.run(300 * MS);
            let (before, shown) = (late(&stage), stage.facets[0].shown.len());
            stage.run(1000 * MS);
            let numbers: Vec<u64> = stage.numbers(0).split_off(shown);
            // a frame takes as long as it is drawn; in a storm what is lost is sent again after 5 ms
            let least = 1000 / (takes.as_millis() as usize + if seed == 1 { 10 } else { 25 });
            assert!(numbers.len() >= least && numbers.windows(2).all(|w| w[1] == w[0] + 1), "{takes:?}, seed {seed}: {numbers:?}");
            assert_eq!(before, late(&stage), "{takes:?}, seed {seed}");
            for k in 1..3 {
                let theirs = stage.numbers(k);
                assert!(numbers[..numbers.len() - 1].iter().all(|frame| theirs.contains(frame)), "{takes:?}, seed {seed}: {numbers:?} {theirs:?}");
            }
            stage.assert_true();
        }
    }
}

/// Who draws too long for the others is waited for once, not again and again.
#[test]
fn a_facet_that_is_too_slow_holds_the_wall_up_once() {
    for (seed, weather) in [(3, Weather::CLEAR), (4, STORM)] {
        let mut stage = wall(seed, weather, 2 * MS);
        stage.facets[1].takes = 90 * MS; // below the 100 ms of `ready_after`, above three quarters of them
        stage.facets[1].frozen_until = stage.now + 250 * MS;
        stage.run(1000 * MS);
        let before = stage.facets[0].shown.len();
        stage.run(3000 * MS);
        let frames = stage.facets[0].shown.len() - before;
        assert!(frames >= if seed == 3 { 180 } else { 110 }, "{frames} frames in 3 s");
        assert_eq!(stage.server.as_ref().unwrap().counts(1).0.late, 1);
        // it goes on showing what is newest, and in order
        let numbers = stage.numbers(1);
        assert!(numbers.is_sorted_by(|a, b| a < b) && numbers.len() > 30, "{numbers:?}");
        stage.assert_true();
    }
}

//! Facets that draw more slowly than frames are published.

use super::lockstep::STORM;
use super::simulated_session::*;
use std::time::Duration;
use tumble_net::sync::simulated_network::NetworkConditions;
use tumble_net::sync::{Membership, SyncMode};

/// A session with a frame every 16 ms and facets that draw for `takes`.
fn wall(seed: u64, conditions: NetworkConditions, takes: Duration) -> Stage {
    let mut stage = Stage::new(seed, conditions, 3, SyncMode::Lockstep);
    stage.facets.iter_mut().for_each(|facet| facet.takes = takes);
    assert!(stage.until(Duration::from_secs(2), |s| s.facets.iter().all(|f| f.shown.len() >= 5)));
    stage
}

/// Returns how many frames of each facet were late, at drawing or at showing.
fn late(stage: &Stage) -> Vec<u64> {
    (0..3).map(|k| stage.server.as_ref().unwrap().counts(k).0).map(|counts| counts.late + counts.missing).collect()
}

fn in_step(stage: &Stage) -> bool {
    (0..3).all(|k| stage.server.as_ref().unwrap().membership(k) == Membership::InStep)
}

/// Asserts that from now on all facets show the same consecutive frames, at the pace of the
/// slowest, and none is late.
fn assert_steady(stage: &mut Stage, takes: Duration, storm: bool, what: &str) {
    let (before, shown) = (late(stage), stage.facets[0].shown.len());
    stage.run(1000 * MS);
    let numbers: Vec<u64> = stage.numbers(0).split_off(shown);
    // in a storm a lost message is sent again after 5 ms
    let least = 1000 / (takes.as_millis() as usize + if storm { 25 } else { 10 });
    assert!(numbers.len() >= least && numbers.windows(2).all(|w| w[1] == w[0] + 1), "{what}: {numbers:?}");
    assert_eq!(before, late(stage), "{what}");
    for k in 1..3 {
        let theirs = stage.numbers(k);
        assert!(
            numbers[..numbers.len() - 1].iter().all(|frame| theirs.contains(frame)),
            "{what}: {numbers:?} {theirs:?}"
        );
    }
    stage.assert_true();
}

/// While the slow facets are out of step the server goes on with the first one, and frames come
/// faster than the others draw.
#[test]
fn slow_facets_that_stumbled_are_in_step_again() {
    for (seed, conditions) in [(1, NetworkConditions::PERFECT), (2, STORM)] {
        for takes in [30 * MS, 60 * MS, 70 * MS] {
            let mut stage = wall(seed, conditions, takes);
            stage.facets[0].takes = 2 * MS;
            let until = stage.now + 250 * MS;
            stage.facets[1..].iter_mut().for_each(|facet| facet.frozen_until = until);
            stage.run(250 * MS);
            assert!(late(&stage)[0] == 0 && late(&stage)[1..].iter().any(|late| *late > 0), "{:?}", late(&stage));
            let what = format!("{takes:?}, seed {seed}");
            assert!(stage.until(1000 * MS, in_step), "{what}: {:?}", late(&stage));
            stage.run(300 * MS);
            assert_steady(&mut stage, takes, seed == 2, &what);
        }
    }
}

/// If no facet is ready, none is delayed by another: the server waits for all.
#[test]
fn no_facet_is_late_if_all_stumble() {
    for (seed, conditions, takes) in
        [(5, NetworkConditions::PERFECT, 20 * MS), (6, STORM, 20 * MS), (7, NetworkConditions::PERFECT, 150 * MS)]
    {
        let mut stage = wall(seed, conditions, takes);
        let until = stage.now + 400 * MS;
        stage.facets.iter_mut().for_each(|facet| facet.frozen_until = until);
        stage.run(500 * MS);
        assert!(in_step(&stage) && late(&stage) == [0; 3], "seed {seed}: {:?}", late(&stage));
        assert_steady(&mut stage, takes, seed == 6, &format!("seed {seed}"));
    }
}

/// If all facets are gone, the server goes on without them after `drop_timeout`.
#[test]
fn a_wall_that_is_gone_holds_the_server_up_for_a_while_only() {
    let mut stage = wall(8, NetworkConditions::PERFECT, 2 * MS);
    (0..3).for_each(|k| stage.kill_facet(k));
    let frames = |stage: &Stage| stage.server.as_ref().unwrap().frame().unwrap();
    let before = frames(&stage);
    stage.run(1900 * MS);
    assert!(frames(&stage) <= before + 1, "it waits");
    stage.run(400 * MS);
    assert!(frames(&stage) >= before + 10, "it goes on");
}

/// The server waits for a facet that is too slow once, not for each frame.
#[test]
fn a_facet_that_is_too_slow_holds_the_wall_up_once() {
    for (seed, conditions) in [(3, NetworkConditions::PERFECT), (4, STORM)] {
        let mut stage = wall(seed, conditions, 2 * MS);
        stage.facets[1].takes = 90 * MS; // below the 100 ms of `ready_timeout`, above three quarters of them
        stage.facets[1].frozen_until = stage.now + 250 * MS;
        stage.run(1000 * MS);
        let before = stage.facets[0].shown.len();
        stage.run(3000 * MS);
        let frames = stage.facets[0].shown.len() - before;
        assert!(frames >= if seed == 3 { 180 } else { 110 }, "{frames} frames in 3 s");
        assert_eq!(late(&stage), [0, 1, 0]);
        // it goes on showing the newest frames, in order
        let numbers = stage.numbers(1);
        assert!(numbers.is_sorted_by(|a, b| a < b) && numbers.len() > 30, "{numbers:?}");
        stage.assert_true();
    }
}

//! Frames over bad networks: all of them, in order, the same on every facet.

use super::simulated_session::*;
use std::time::Duration;
use tumble_net::sync::simulated_network::NetworkConditions;
use tumble_net::sync::{Membership, ServerEvent, SyncMode};

pub const STORM: NetworkConditions = NetworkConditions {
    loss: 0.05,
    duplication: 0.02,
    reordering: 0.10,
    corruption: 0.01,
    delay: [Duration::from_micros(200), Duration::from_millis(1)],
};

/// Number of frames: `long` if `TUMBLE_SLOW` is set.
fn frames(short: u64, long: u64) -> u64 {
    if std::env::var_os("TUMBLE_SLOW").is_some() { long } else { short }
}

/// Runs lockstep until `count` frames are finished, and returns the stage.
fn run(seed: u64, conditions: NetworkConditions, count: u64, first: u64) -> Stage {
    let mut stage = Stage::new(seed, conditions, 6, SyncMode::Lockstep);
    stage.options.first_frame = first;
    stage.server = Some(tumble_net::sync::ServerSession::new(stage.options.clone(), &stage.base));
    let last = first.wrapping_add(count - 1);
    let done = |s: &Stage| s.facets.iter().all(|f| f.shown.last().is_some_and(|(frame, _)| *frame == last));
    for _ in 0..count {
        if stage.until(1000 * MS, done) {
            break;
        }
    }
    assert!(
        done(&stage),
        "facets show {:?}, expected {last}",
        stage.facets.iter().map(|f| f.shown.last().map(|s| s.0)).collect::<Vec<_>>()
    );
    stage.run(3 * MS); // the last answers are on their way
    stage
}

/// Asserts that the facets have shown exactly the frames `first..first + count`, in order, with the
/// right content.
fn assert_whole(stage: &Stage, count: u64, first: u64) {
    let expected: Vec<u64> = (0..count).map(|k| first.wrapping_add(k)).collect();
    for k in 0..6 {
        let shown = stage.numbers(k);
        assert_eq!(shown[..count as usize], expected, "facet {k}");
        assert_eq!(stage.facets[k].session.as_ref().unwrap().counts().missing, 0);
        let (counts, _) = stage.server.as_ref().unwrap().counts(k as u16);
        assert_eq!((counts.late, counts.mismatched, counts.dropped), (0, 0, 0), "facet {k}");
    }
    stage.assert_true();
}

#[test]
fn in_clear_weather_every_facet_shows_every_frame_once() {
    let stage = run(1, NetworkConditions::PERFECT, 60, 0);
    assert_whole(&stage, 60, 0);
    for k in 0..6 {
        let counts = stage.facets[k].session.as_ref().unwrap().counts();
        assert_eq!((counts.duplicate, counts.stale, counts.torn, counts.early, counts.refused), (0, 0, 0, 0, 0));
    }
    let finished = stage.events.iter().filter(|e| matches!(e, ServerEvent::Finished(_))).count();
    assert!(finished >= 60);
}

#[test]
fn in_a_storm_every_facet_shows_every_frame_once_and_in_order_full_length() {
    let count = frames(300, 100_000);
    let stage = run(2, STORM, count, 0);
    assert_whole(&stage, count, 0);
    let stats = stage.net.stats();
    assert!(stats.lost > 0 && stats.duplicated > 0 && stats.reordered > 0 && stats.corrupted > 0, "{stats:?}");
    let torn: u64 = (0..6).map(|k| stage.server.as_ref().unwrap().counts(k).0).map(|c| c.torn + c.refused).sum();
    let theirs: u64 =
        stage.facets.iter().map(|f| f.session.as_ref().unwrap().counts()).map(|c| c.torn + c.refused).sum();
    assert!(
        torn + theirs > 0 && torn + theirs <= stats.corrupted,
        "every damaged message that arrived was refused, and nothing else: {torn} + {theirs}"
    );
}

#[test]
fn frame_numbers_wrap() {
    for first in [u64::MAX - 20, u32::MAX as u64 - 20, (1 << 63) - 20] {
        let stage = run(3, STORM, 60, first);
        assert_whole(&stage, 60, first);
    }
}

#[test]
fn the_same_seed_gives_the_same_run_determinism() {
    let log = |seed| {
        let stage = run(seed, STORM, 40, 0);
        (stage.now, stage.net.stats(), stage.events, stage.facets.into_iter().map(|f| f.shown).collect::<Vec<_>>())
    };
    assert!(log(4) == log(4));
    assert!(log(4) != log(5));
}

/// In the mode `latest` each facet shows the newest frame: numbers rise and the content is right. A
/// slow facet skips frames and delays no other.
#[test]
fn latest_leaves_out_what_is_old() {
    let mut stage = Stage::new(6, STORM, 3, SyncMode::Latest);
    stage.facets[2].takes = 50 * MS;
    stage.run(Duration::from_secs(3));
    stage.assert_true();
    for k in 0..3 {
        assert!(stage.numbers(k).is_sorted_by(|a, b| a < b));
    }
    let published = stage.expected.len();
    let [fast, slow] = [0, 2].map(|k| stage.facets[k].shown.len());
    assert!(published > 180, "{published} frames in 3 s at 16 ms");
    assert!(
        fast > published * 85 / 100 && fast <= published,
        "{fast} of {published}: about 5 % are lost and not sent again"
    );
    assert!((40..=61).contains(&slow), "{slow} frames of 50 ms in 3 s");
}

/// The server waits for a facet that is slower than the others and within its timeout.
#[test]
fn the_slowest_gives_the_pace() {
    let mut stage = Stage::new(7, NetworkConditions::PERFECT, 6, SyncMode::Lockstep);
    stage.facets[4].takes = 40 * MS;
    stage.run(Duration::from_secs(4));
    let shown: Vec<usize> = stage.facets.iter().map(|f| f.shown.len()).collect();
    assert!(
        shown.iter().all(|&n| (90..=100).contains(&n) && n.abs_diff(shown[0]) <= 1),
        "4 s in frames of 40 ms: {shown:?}"
    );
    assert_eq!(stage.server.as_ref().unwrap().membership(4), Membership::InStep);
    stage.assert_true();
}

//! Kill, freeze and restart of a facet and of the server, at each state of the session.

use super::lockstep::STORM;
use super::simulated_session::*;
use std::time::Duration;
use tumble_net::sync::simulated_network::NetworkConditions;
use tumble_net::sync::{FacetSession, Membership, ServerEvent, ServerSession, SyncMode, Task, WaitReason};

/// Conditions that hold in the states of a session, seen from the facet that fails.
const MOMENTS: [fn(&Stage) -> bool; 5] = [
    |s| s.now > Duration::ZERO,                               // joining
    |s| s.facets[1].shown.len() >= 10 && s.facets[1].drawing, // drawing
    |s| s.facets[1].shown.len() >= 10 && matches!(task(s), Some(Task::Wait(WaitReason::Others(_)))), // ready
    |s| s.facets[1].shown.len() >= 10 && matches!(task(s), Some(Task::Wait(WaitReason::Frame))), // shown, between frames
    |s| s.facets[1].shown.len() >= 10 && s.server.as_ref().is_some_and(|s| !s.is_idle()) && !s.facets[1].drawing, // within a frame
];

pub fn task(stage: &Stage) -> Option<Task> {
    stage.facets[1].session.as_ref().map(FacetSession::task)
}

pub fn at(moment: usize, seed: u64) -> Stage {
    let conditions = if seed.is_multiple_of(2) { NetworkConditions::PERFECT } else { STORM };
    let mut stage = Stage::new(seed, conditions, 3, SyncMode::Lockstep);
    stage.facets[0].takes = 4 * MS; // so that the others wait for a facet
    assert!(stage.until(Duration::from_secs(2), MOMENTS[moment]), "moment {moment}");
    stage
}

fn shown(stage: &Stage) -> Vec<usize> {
    stage.facets.iter().map(|f| f.shown.len()).collect()
}

/// Each kill from each state: the wall stands still for at most the timeout of a frame and goes on
/// with the other facets. The server drops the dead facet after `drop_timeout`, and the restarted
/// facet is in step within a second.
#[test]
fn a_facet_that_is_killed_is_dropped_and_comes_back() {
    for (moment, seed) in (1..MOMENTS.len()).flat_map(|m| [(m, 10 + 2 * m as u64), (m, 11 + 2 * m as u64)]) {
        let mut stage = at(moment, seed);
        let before = shown(&stage);
        stage.kill_facet(1);
        stage.run(1000 * MS);
        let after = shown(&stage);
        assert!(
            after[0] >= before[0] + 40 && after[2] >= before[2] + 40,
            "the wall goes on: {before:?} {after:?} (moment {moment})"
        );
        assert_eq!(stage.server.as_ref().unwrap().membership(1), Membership::Following);
        stage.run(1500 * MS);
        assert_eq!(stage.server.as_ref().unwrap().membership(1), Membership::Absent, "dropped after 2 s");
        assert!(stage.events.iter().any(|e| matches!(e, ServerEvent::Gone(1, false))));
        stage.start_facet(1);
        let back = |s: &Stage| s.server.as_ref().unwrap().membership(1) == Membership::InStep;
        assert!(stage.until(1000 * MS, back), "back in step within a second (moment {moment}, seed {seed})");
        stage.run(500 * MS);
        let [a, b] = [0, 1].map(|k| stage.numbers(k));
        assert!(
            a.ends_with(&b[b.len() - 10..])
                || a[..a.len() - 1].ends_with(&b[b.len() - 10..])
                || b[..b.len() - 1].ends_with(&a[a.len() - 10..]),
            "{a:?} {b:?}"
        );
        stage.assert_true();
    }
}

/// The server is notified that the process has ended: the wall does not stand still, and the facet
/// is dropped at once.
#[test]
fn the_server_does_not_wait_for_a_facet_whose_process_ended() {
    for (moment, seed) in (1..MOMENTS.len()).flat_map(|m| [(m, 110 + 2 * m as u64), (m, 111 + 2 * m as u64)]) {
        let mut stage = at(moment, seed);
        let before = shown(&stage);
        stage.kill_facet(1);
        let now = stage.now;
        stage.server.as_mut().unwrap().facet_exited(now, 1);
        assert_eq!(stage.server.as_ref().unwrap().membership(1), Membership::Absent);
        stage.run(160 * MS);
        let after = shown(&stage);
        // ten frames of 16 ms; in a storm some take longer
        let least = if seed.is_multiple_of(2) { 9 } else { 6 };
        assert!(
            after[0] >= before[0] + least && after[2] >= before[2] + least,
            "{before:?} {after:?} (moment {moment}, seed {seed})"
        );
        let (counts, _) = stage.server.as_ref().unwrap().counts(1);
        assert_eq!((counts.late, counts.missing, counts.dropped), (0, 0, 1));
        stage.start_facet(1);
        let back = |s: &Stage| s.server.as_ref().unwrap().membership(1) == Membership::InStep;
        assert!(stage.until(1000 * MS, back), "moment {moment}, seed {seed}");
        stage.assert_true();
    }
}

/// A server that sleeps until a message or a deadline does the same, at the same times, as one that
/// polls ten thousand times a second.
#[test]
fn a_server_that_sleeps_until_something_is_due_misses_nothing() {
    for (seed, conditions, resend) in
        [(120, NetworkConditions::PERFECT, None), (121, STORM, Some(5 * MS)), (122, STORM, Some(5 * MS))]
    {
        let [awake, asleep] = [false, true].map(|sleeps| {
            let mut stage = Stage::new(seed, conditions, 3, SyncMode::Lockstep);
            stage.options.resend_interval = resend;
            (stage.sleeps, stage.server) = (sleeps, Some(ServerSession::new(stage.options.clone(), &stage.base)));
            stage.run(500 * MS);
            stage.kill_facet(1); // late, then dropped
            stage.run(2500 * MS);
            stage.start_facet(1);
            stage.run(500 * MS);
            (stage.events, stage.facets.iter().map(|f| (f.shown.clone(), f.shown_at.clone())).collect::<Vec<_>>())
        });
        assert!(
            awake.0.iter().any(|e| matches!(e, ServerEvent::Late(1, _)))
                && awake.0.iter().any(|e| matches!(e, ServerEvent::Gone(1, false)))
        );
        assert!(awake == asleep, "seed {seed}");
    }
}

#[test]
fn a_facet_that_is_started_again_at_once_takes_its_old_place() {
    for (moment, seed) in (0..MOMENTS.len()).flat_map(|m| [(m, 30 + 2 * m as u64), (m, 31 + 2 * m as u64)]) {
        let mut stage = at(moment, seed);
        stage.kill_facet(1);
        stage.start_facet(1);
        let count = stage.facets[1].shown.len();
        assert!(stage.until(1000 * MS, |s| s.facets[1].shown.len() >= count + 10), "moment {moment}, seed {seed}");
        assert_eq!(stage.server.as_ref().unwrap().membership(1), Membership::InStep);
        stage.assert_true();
    }
}

/// A facet that is frozen for less than `drop_timeout` catches up. After a longer freeze it is
/// dropped, notices it, and joins again. It never shows an older frame than before.
#[test]
fn a_facet_that_freezes_catches_up_or_joins_again() {
    for (moment, seed) in (1..MOMENTS.len()).flat_map(|m| [(m, 50 + 2 * m as u64), (m, 51 + 2 * m as u64)]) {
        for (freeze, dropped) in [(300 * MS, false), (3000 * MS, true)] {
            let mut stage = at(moment, seed);
            let before = shown(&stage);
            stage.facets[1].frozen_until = stage.now + freeze;
            stage.run(freeze);
            let after = shown(&stage);
            let lost = if moment == 4 { 20 } else { 12 }; // frames of 16 ms in the 100 or 200 ms for which the wall stands still
            assert!(
                after[0] + lost >= before[0] + (freeze.as_millis() / 17) as usize,
                "the wall goes on: {before:?} {after:?} (moment {moment})"
            );
            assert_eq!(stage.server.as_ref().unwrap().membership(1) == Membership::Absent, dropped);
            let back = |s: &Stage| s.server.as_ref().unwrap().membership(1) == Membership::InStep;
            assert!(
                stage.until(1000 * MS, back),
                "back in step within a second (moment {moment}, seed {seed}, {freeze:?})"
            );
            assert!(stage.numbers(1).is_sorted_by(|a, b| a < b));
            stage.assert_true();
        }
    }
}

/// The facets of a dead server report it. The next server has all of them within a second, although
/// its frame numbers differ.
#[test]
fn facets_notice_a_killed_server_and_find_its_successor() {
    for (moment, seed) in (1..MOMENTS.len()).flat_map(|m| [(m, 70 + 2 * m as u64), (m, 71 + 2 * m as u64)]) {
        for pause in [Duration::ZERO, 1000 * MS, 3000 * MS] {
            let mut stage = at(moment, seed);
            stage.server = None;
            stage.run(pause);
            if pause > 2500 * MS {
                let tasks: Vec<Task> = stage.facets.iter().map(|f| f.session.as_ref().unwrap().task()).collect();
                assert!(tasks.iter().all(|t| *t == Task::Wait(WaitReason::Lost)), "{tasks:?}");
            }
            let before = shown(&stage);
            stage.start_server();
            let all = |s: &Stage| s.facets.iter().zip(&before).all(|(f, n)| f.shown.len() >= n + 5);
            // a facet that has not noticed yet learns of the new server by its heartbeat, after
            // half a second at most
            assert!(
                stage.until(1700 * MS, all),
                "moment {moment}, seed {seed}, {pause:?}: {before:?} {:?}",
                shown(&stage)
            );
            let first = stage.options.first_frame;
            assert!(stage.facets.iter().all(|f| f.shown.last().unwrap().0 >= first));
            stage.assert_true();
        }
    }
}

/// A partition of the network: both sides notice, and the session recovers.
#[test]
fn a_partition_heals() {
    for (seed, gap) in [(90, 300 * MS), (91, 300 * MS), (92, 4000 * MS), (93, 4000 * MS)] {
        let mut stage = at(1, seed);
        stage.net.set_partitioned(1, true);
        stage.run(gap);
        stage.net.set_partitioned(1, false);
        let back = |s: &Stage| s.server.as_ref().unwrap().membership(1) == Membership::InStep;
        assert!(stage.until(1000 * MS, back), "seed {seed}, {gap:?}");
        stage.assert_true();
    }
}

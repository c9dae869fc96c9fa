//! Places of facets in a session: good-byes, connections that close early, two processes of one
//! facet.

use super::faults::{at, task};
use super::lockstep::STORM;
use super::simulated_session::*;
use std::time::Duration;
use tumble_net::sync::simulated_network::{Destination, NetworkConditions};
use tumble_net::sync::transport::{Closed, LinkEvent};
use tumble_net::sync::{
    EndReason, FacetOptions, FacetSession, Membership, ServerEvent, ServerSession, SyncMode, Task, WaitReason,
};

/// A good-bye differs from a death: END ends the facets, LEAVE frees the place at once.
#[test]
fn good_byes_are_not_deaths() {
    let mut stage = at(1, 96);
    let facet = stage.facets[1].session.as_mut().unwrap();
    facet.leave();
    let bytes: Vec<_> = facet.outgoing();
    for (_, bytes) in bytes {
        stage.net.send(stage.now, Destination::Server(1), &bytes);
    }
    stage.run(50 * MS);
    assert!(stage.events.contains(&ServerEvent::Gone(1, true)));
    assert_eq!(stage.server.as_ref().unwrap().counts(1).0.dropped, 0);
    stage.server.as_mut().unwrap().end();
    stage.run(50 * MS);
    for k in [0, 2] {
        assert_eq!(stage.facets[k].session.as_ref().unwrap().task(), Task::Ended(EndReason::Ended));
    }
}

/// Closes the link of facet 1, as both ends report it.
fn close_link(stage: &mut Stage, why: Closed) {
    let now = stage.now;
    stage.server.as_mut().unwrap().on_event(now, 1, LinkEvent::Closed(why), &[]);
    stage.facets[1].session.as_mut().unwrap().on_event(now, LinkEvent::Closed(why), Vec::new().into());
    stage.net.set_partitioned(1, true); // messages on the way are lost
    stage.run(50 * MS);
    stage.net.set_partitioned(1, false);
}

/// A facet joins and loses its connection without a frame, before the first frame and in mid-run.
/// The server accepts its next attempt although the attempt's number is used up.
#[test]
fn a_facet_that_loses_its_connection_before_its_first_frame_is_let_in_again() {
    let membership = |s: &Stage| s.server.as_ref().unwrap().membership(1);
    let in_step = |s: &Stage| s.server.as_ref().unwrap().membership(1) == Membership::InStep;
    for seed in [140, 141] {
        let mut stage =
            Stage::new(seed, if seed == 140 { NetworkConditions::PERFECT } else { STORM }, 2, SyncMode::Lockstep);
        stage.net.set_partitioned(0, true);
        assert!(stage.until(500 * MS, |s| membership(s) == Membership::Following));
        assert_eq!(task(&stage), Some(Task::Wait(WaitReason::Server)));
        close_link(&mut stage, Closed::TimedOut);
        stage.run(100 * MS);
        stage.net.set_partitioned(0, false);
        assert!(stage.until(1000 * MS, in_step), "before the first frame, seed {seed}");
        stage.run(100 * MS);

        close_link(&mut stage, Closed::TimedOut);
        assert!(stage.until(500 * MS, |s| membership(s) == Membership::Following));
        close_link(&mut stage, Closed::ByPeer);
        assert!(stage.until(1000 * MS, in_step), "in mid-run, seed {seed}");
        stage.assert_true();
    }
}

/// A server that drops a joining facet, whose link does not close, requests a new join.
#[test]
fn a_number_that_is_used_up_is_answered() {
    let mut stage = Stage::new(142, NetworkConditions::PERFECT, 2, SyncMode::Lockstep);
    stage.net.set_partitioned(0, true);
    let membership = |s: &Stage| s.server.as_ref().unwrap().membership(1);
    assert!(stage.until(500 * MS, |s| membership(s) == Membership::Following));
    let now = stage.now;
    stage.server.as_mut().unwrap().facet_exited(now, 1);
    assert!(stage.until(500 * MS, |s| membership(s) == Membership::Following));
}

/// A run that ends before its first frame also ends for the facets that have joined.
#[test]
fn the_end_is_understood_before_the_first_frame() {
    let mut stage = Stage::new(143, NetworkConditions::PERFECT, 2, SyncMode::Lockstep);
    stage.net.set_partitioned(0, true);
    assert!(stage.until(500 * MS, |s| s.server.as_ref().unwrap().membership(1) == Membership::Following));
    stage.server.as_mut().unwrap().end();
    stage.run(50 * MS);
    assert_eq!(task(&stage), Some(Task::Ended(EndReason::Ended)));
}

/// Simulates several processes of one facet over a link that gives the connection to the newest, as
/// shared memory and UDP do. The process that loses the connection reconnects within 20 ms. `has`
/// is the process with the connection.
fn run_duplicates(
    now: &mut Duration,
    server: &mut ServerSession,
    facets: &mut [Option<FacetSession>],
    time: Duration,
    has: &mut usize,
) {
    let end = *now + time;
    while *now < end {
        *now += MS;
        for k in 0..facets.len() {
            let Some(facet) = facets[k].as_mut().filter(|f| !matches!(f.task(), Task::Ended(_))) else { continue };
            if k != *has {
                // a process without the connection reconnects every 20 ms, as a new one
                if !now.as_millis().is_multiple_of(20) {
                    continue;
                }
                server.on_event(*now, 0, LinkEvent::Closed(Closed::Replaced), &[]);
                facet.on_event(*now, LinkEvent::Closed(Closed::ByPeer), Vec::new().into());
                facet.outgoing();
                facet.on_event(*now, LinkEvent::Opened, Vec::new().into());
                *has = k;
            }
            facet.advance(*now);
            facet.outgoing().iter().for_each(|(_, bytes)| server.on_event(*now, 0, LinkEvent::Message, bytes));
            for out in server.outgoing() {
                facet.on_event(*now, LinkEvent::Message, out.message.to_vec().into());
            }
            if facet.task() == Task::Draw && facet.begin().is_some() {
                facet.drawn(*now, [0; 16]);
            }
            if let Task::Present(_) = facet.task() {
                facet.presented(*now);
            }
        }
        if server.is_idle() && server.all_critical_joined() && now.as_millis().is_multiple_of(16) {
            server.publish(*now, &scene(), &viewer(0)).unwrap();
        }
    }
}

#[test]
fn the_first_process_of_a_facet_keeps_its_place() {
    let process = |seed: u64| Some(FacetSession::new(FacetOptions::new("facet 0", SCENE, seed << 16), scene()));
    let refused = |facet: &Option<FacetSession>| matches!(facet.as_ref().unwrap().task(), Task::Ended(EndReason::Refused(why)) if why.contains("another process already shows facet 'facet 0'"));
    let over = |facet: &Option<FacetSession>| matches!(facet.as_ref().unwrap().task(), Task::Ended(_));
    let mut server =
        ServerSession::new(Stage::new(1, NetworkConditions::PERFECT, 1, SyncMode::Lockstep).options, &scene());
    let (mut now, mut has, mut facets) = (MS, 0, vec![process(1)]);
    run_duplicates(&mut now, &mut server, &mut facets, 100 * MS, &mut has);
    facets.extend([process(2), process(3)]);
    run_duplicates(&mut now, &mut server, &mut facets, 400 * MS, &mut has);
    assert_eq!([over(&facets[0]), refused(&facets[1]), refused(&facets[2])], [false, true, true]);
    assert_eq!(server.membership(0), Membership::InStep);
    let joined = server.counts(0).0.joined;
    assert!(joined <= 6, "{joined}");
    run_duplicates(&mut now, &mut server, &mut facets, 1000 * MS, &mut has);
    assert_eq!(server.counts(0).0.joined, joined, "no further joins");

    // A process that is killed and started again gets the place at once. The process that was
    // stopped meanwhile and goes on is refused.
    let stopped = facets[0].take();
    facets.push(process(4));
    run_duplicates(&mut now, &mut server, &mut facets, 100 * MS, &mut has);
    assert_eq!(server.membership(0), Membership::InStep);
    run_duplicates(&mut now, &mut server, &mut facets, 2500 * MS, &mut has);
    facets[0] = stopped;
    run_duplicates(&mut now, &mut server, &mut facets, 400 * MS, &mut has);
    assert_eq!([refused(&facets[0]), over(&facets[3])], [true, false]);
    assert_eq!(server.membership(0), Membership::InStep);
}

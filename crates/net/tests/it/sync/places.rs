//! Whose place it is: good-byes, connections that close early, two processes of one facet.

use super::faults::{at, task};
use super::lockstep::STORM;
use super::simulated_session::*;
use std::time::Duration;
use tumble_net::sync::simulated_network::{Destination, NetworkConditions};
use tumble_net::sync::transport::{Closed, LinkEvent};
use tumble_net::sync::{
    EndReason, FacetOptions, FacetSession, Membership, ServerEvent, ServerSession, SyncMode, Task, WaitReason,
};

/// Good-byes are no deaths: END ends the facets, LEAVE frees the place at once.
#[test]
fn good_byes_are_told_from_deaths() {
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

/// The link of facet 1 closes, as both ends report it.
fn close_link(stage: &mut Stage, why: Closed) {
    let now = stage.now;
    stage.server.as_mut().unwrap().on_event(now, 1, LinkEvent::Closed(why), &[]);
    stage.facets[1].session.as_mut().unwrap().on_event(now, LinkEvent::Closed(why), Vec::new().into());
    stage.net.set_partitioned(1, true); // what was under way is gone
    stage.run(50 * MS);
    stage.net.set_partitioned(1, false);
}

/// Joined and without a frame, before the first one and in mid-run: the number that the server knows is used up.
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

/// A server that drops a joining facet, whose link does not close, tells it to join anew.
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

/// A run that ends before its first frame ends for those who have joined, too.
#[test]
fn the_end_is_understood_before_the_first_frame() {
    let mut stage = Stage::new(143, NetworkConditions::PERFECT, 2, SyncMode::Lockstep);
    stage.net.set_partitioned(0, true);
    assert!(stage.until(500 * MS, |s| s.server.as_ref().unwrap().membership(1) == Membership::Following));
    stage.server.as_mut().unwrap().end();
    stage.run(50 * MS);
    assert_eq!(task(&stage), Some(Task::Ended(EndReason::Ended)));
}

/// Two processes of one facet, and a link that gives the connection to who came last, as shared memory and UDP do: the loser comes back at once. What each
/// is told to do next, and how often somebody joined.
fn rivals(
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
                // who has lost the connection looks again within 20 ms, as who is new
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
fn of_two_processes_of_one_facet_the_first_that_answers_stays() {
    let process = |seed: u64| Some(FacetSession::new(FacetOptions::new("facet 0", SCENE, seed << 16), scene()));
    let refused = |facet: &Option<FacetSession>| matches!(facet.as_ref().unwrap().task(), Task::Ended(EndReason::Refused(why)) if why.contains("another process already shows facet 'facet 0'"));
    let over = |facet: &Option<FacetSession>| matches!(facet.as_ref().unwrap().task(), Task::Ended(_));
    let mut server =
        ServerSession::new(Stage::new(1, NetworkConditions::PERFECT, 1, SyncMode::Lockstep).options, &scene());
    let (mut now, mut has, mut facets) = (MS, 0, vec![process(1)]);
    rivals(&mut now, &mut server, &mut facets, 100 * MS, &mut has);
    facets.extend([process(2), process(3)]);
    rivals(&mut now, &mut server, &mut facets, 400 * MS, &mut has);
    assert_eq!([over(&facets[0]), refused(&facets[1]), refused(&facets[2])], [false, true, true]);
    assert_eq!(server.membership(0), Membership::InStep);
    let joined = server.counts(0).0.joined;
    assert!(joined <= 6, "{joined}");
    rivals(&mut now, &mut server, &mut facets, 1000 * MS, &mut has);
    assert_eq!(server.counts(0).0.joined, joined, "there is peace");

    // Killed and started again: at once. The one that was stopped meanwhile, and goes on, has lost its place for good.
    let stopped = facets[0].take();
    facets.push(process(4));
    rivals(&mut now, &mut server, &mut facets, 100 * MS, &mut has);
    assert_eq!(server.membership(0), Membership::InStep);
    rivals(&mut now, &mut server, &mut facets, 2500 * MS, &mut has);
    facets[0] = stopped;
    rivals(&mut now, &mut server, &mut facets, 400 * MS, &mut has);
    assert_eq!([refused(&facets[0]), over(&facets[3])], [true, false]);
    assert_eq!(server.membership(0), Membership::InStep);
}

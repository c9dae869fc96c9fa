//! Kill, freeze and restart of a facet and of the server, at each state of the session.

use super::lockstep::STORM;
use super::stage::*;
use std::time::Duration;
use tumble_net::sync::messages::Done;
use tumble_net::sync::simulate::{To, Weather};
use tumble_net::sync::transport::{Closed, LinkEvent};
use tumble_net::sync::wire;
use tumble_net::sync::{FacetOptions, FacetSession, Over, Pace, ServerEvent, ServerOptions, ServerSession, Standing, Task, Waiting};

/// States of a session, as the facet that fails is in them.
const MOMENTS: [fn(&Stage) -> bool; 5] = [
    |s| s.now > Duration::ZERO,                                                                         // joining
    |s| s.facets[1].shown.len() >= 10 && s.facets[1].drawing,                                           // drawing
    |s| s.facets[1].shown.len() >= 10 && matches!(task(s), Some(Task::Wait(Waiting::Others(_)))),       // ready
    |s| s.facets[1].shown.len() >= 10 && matches!(task(s), Some(Task::Wait(Waiting::Frame))),           // shown, between frames
    |s| s.facets[1].shown.len() >= 10 && s.server.as_ref().is_some_and(|s| !s.idle()) && !s.facets[1].drawing, // within a frame
];

fn task(stage: &Stage) -> Option<Task> {
    stage.facets[1].session.as_ref().map(FacetSession::task)
}

fn at(moment: usize, seed: u64) -> Stage {
    let weather = if seed.is_multiple_of(2) { Weather::CLEAR } else { STORM };
    let mut stage = Stage::new(seed, weather, 3, Pace::Lockstep);
    stage.facets[0].takes = 4 * MS; // so that the others wait for somebody
    assert!(stage.until(Duration::from_secs(2), MOMENTS[moment]), "moment {moment}");
    stage
}

fn shown(stage: &Stage) -> Vec<usize> {
    stage.facets.iter().map(|f| f.shown.len()).collect()
}

/// From moment and fault to its outcome: the wall stands still for at most the time that a frame waits, goes on with the others, drops the dead one after
/// `drop_after`, and has it back within a second of its restart.
#[test]
fn a_facet_that_is_killed_is_dropped_and_comes_back() {
    for (moment, seed) in (1..MOMENTS.len()).flat_map(|m| [(m, 10 + 2 * m as u64), (m, 11 + 2 * m as u64)]) {
        let mut stage = at(moment, seed);
        let before = shown(&stage);
        stage.kill_facet(1);
        stage.run(1000 * MS);
        let after = shown(&stage);
        assert!(after[0] >= before[0] + 40 && after[2] >= before[2] + 40, "the wall goes on: {before:?} {after:?} (moment {moment})");
        assert_eq!(stage.server.as_ref().unwrap().standing(1), Standing::Following);
        stage.run(1500 * MS);
        assert_eq!(stage.server.as_ref().unwrap().standing(1), Standing::Absent, "dropped after 2 s");
        assert!(stage.events.iter().any(|e| matches!(e, ServerEvent::Gone(1, false))));
        stage.start_facet(1);
        let back = |s: &Stage| s.server.as_ref().unwrap().standing(1) == Standing::InStep;
        assert!(stage.until(1000 * MS, back), "back in step within a second (moment {moment}, seed {seed})");
        stage.run(500 * MS);
        let [a, b] = [0, 1].map(|k| stage.numbers(k));
        assert!(a.ends_with(&b[b.len() - 10..]) || a[..a.len() - 1].ends_with(&b[b.len() - 10..]) || b[..b.len() - 1].ends_with(&a[a.len() - 10..]), "{a:?} {b:?}");
        stage.assert_true();
    }
}

/// Where it is known that its process has ended nobody waits for it: the wall does not stand still, and it is gone at once.
#[test]
fn a_facet_whose_process_ended_is_waited_for_no_longer() {
    for (moment, seed) in (1..MOMENTS.len()).flat_map(|m| [(m, 110 + 2 * m as u64), (m, 111 + 2 * m as u64)]) {
        let mut stage = at(moment, seed);
        let before = shown(&stage);
        stage.kill_facet(1);
        let now = stage.now;
        stage.server.as_mut().unwrap().lose(now, 1);
        assert_eq!(stage.server.as_ref().unwrap().standing(1), Standing::Absent);
        stage.run(160 * MS);
        let after = shown(&stage);
        // ten frames of 16 ms, and in a storm some that take longer
        let least = if seed.is_multiple_of(2) { 9 } else { 6 };
        assert!(after[0] >= before[0] + least && after[2] >= before[2] + least, "{before:?} {after:?} (moment {moment}, seed {seed})");
        let (counts, _) = stage.server.as_ref().unwrap().counts(1);
        assert_eq!((counts.late, counts.missing, counts.dropped), (0, 0, 1));
        stage.start_facet(1);
        let back = |s: &Stage| s.server.as_ref().unwrap().standing(1) == Standing::InStep;
        assert!(stage.until(1000 * MS, back), "moment {moment}, seed {seed}");
        stage.assert_true();
    }
}

/// A server that sleeps until a message comes or something is due does the same, at the same times, as one that looks ten thousand times a second.
#[test]
fn a_server_that_sleeps_until_something_is_due_misses_nothing() {
    for (seed, weather, resend) in [(120, Weather::CLEAR, None), (121, STORM, Some(5 * MS)), (122, STORM, Some(5 * MS))] {
        let [awake, asleep] = [false, true].map(|sleeps| {
            let mut stage = Stage::new(seed, weather, 3, Pace::Lockstep);
            stage.options.resend_after = resend;
            (stage.sleeps, stage.server) = (sleeps, Some(ServerSession::new(stage.options.clone(), &stage.base)));
            stage.run(500 * MS);
            stage.kill_facet(1); // late, then dropped
            stage.run(2500 * MS);
            stage.start_facet(1);
            stage.run(500 * MS);
            (stage.events, stage.facets.iter().map(|f| (f.shown.clone(), f.shown_at.clone())).collect::<Vec<_>>())
        });
        assert!(awake.0.iter().any(|e| matches!(e, ServerEvent::Late(1, _))) && awake.0.iter().any(|e| matches!(e, ServerEvent::Gone(1, false))));
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
        assert_eq!(stage.server.as_ref().unwrap().standing(1), Standing::InStep);
        stage.assert_true();
    }
}

/// Frozen for less than `drop_after` it catches up; for longer, it is dropped, notices, and joins again. What it shows is never old news.
#[test]
fn a_facet_that_freezes_catches_up_or_joins_again() {
    for (moment, seed) in (1..MOMENTS.len()).flat_map(|m| [(m, 50 + 2 * m as u64), (m, 51 + 2 * m as u64)]) {
        for (freeze, dropped) in [(300 * MS, false), (3000 * MS, true)] {
            let mut stage = at(moment, seed);
            let before = shown(&stage);
            stage.facets[1].frozen_until = stage.now + freeze;
            stage.run(freeze);
            let after = shown(&stage);
            let lost = if moment == 4 { 20 } else { 12 }; // frames of 16 ms in the 100 or 200 ms of standing still
            assert!(after[0] + lost >= before[0] + (freeze.as_millis() / 17) as usize, "the wall goes on: {before:?} {after:?} (moment {moment})");
            assert_eq!(stage.server.as_ref().unwrap().standing(1) == Standing::Absent, dropped);
            let back = |s: &Stage| s.server.as_ref().unwrap().standing(1) == Standing::InStep;
            assert!(stage.until(1000 * MS, back), "back in step within a second (moment {moment}, seed {seed}, {freeze:?})");
            assert!(stage.numbers(1).is_sorted_by(|a, b| a < b));
            stage.assert_true();
        }
    }
}

/// A server that dies leaves facets that say so; the next one has them all within a second, though its frames are others.
#[test]
fn a_server_that_is_killed_is_missed_and_its_successor_found() {
    for (moment, seed) in (1..MOMENTS.len()).flat_map(|m| [(m, 70 + 2 * m as u64), (m, 71 + 2 * m as u64)]) {
        for pause in [Duration::ZERO, 1000 * MS, 3000 * MS] {
            let mut stage = at(moment, seed);
            stage.server = None;
            stage.run(pause);
            if pause > 2500 * MS {
                let tasks: Vec<Task> = stage.facets.iter().map(|f| f.session.as_ref().unwrap().task()).collect();
                assert!(tasks.iter().all(|t| *t == Task::Wait(Waiting::Lost)), "{tasks:?}");
            }
            let before = shown(&stage);
            stage.start_server();
            let all = |s: &Stage| s.facets.iter().zip(&before).all(|(f, n)| f.shown.len() >= n + 5);
            // a facet that has not noticed yet is told by the new server when it beats, at the latest after half a second
            assert!(stage.until(1700 * MS, all), "moment {moment}, seed {seed}, {pause:?}: {before:?} {:?}", shown(&stage));
            let first = stage.options.first_frame;
            assert!(stage.facets.iter().all(|f| f.shown.last().unwrap().0 >= first));
            stage.assert_true();
        }
    }
}

/// A partition is a freeze of the wire: nobody dies, both sides notice, and it heals.
#[test]
fn a_partition_heals() {
    for (seed, gap) in [(90, 300 * MS), (91, 300 * MS), (92, 4000 * MS), (93, 4000 * MS)] {
        let mut stage = at(1, seed);
        stage.net.part(1, true);
        stage.run(gap);
        stage.net.part(1, false);
        let back = |s: &Stage| s.server.as_ref().unwrap().standing(1) == Standing::InStep;
        assert!(stage.until(1000 * MS, back), "seed {seed}, {gap:?}");
        stage.assert_true();
    }
}

#[test]
fn other_scenes_names_and_versions_are_refused_by_name() {
    let refusal = |options: FacetOptions, spoil: fn(&mut Vec<u8>)| {
        let mut facet = FacetSession::new(options, scene());
        let mut server = ServerSession::new(Stage::new(1, Weather::CLEAR, 2, Pace::Lockstep).options, &scene());
        facet.advance(MS);
        for (_, mut bytes) in facet.outgoing() {
            spoil(&mut bytes);
            server.on_event(MS, 1, LinkEvent::Message, &bytes);
        }
        let told = server.events().into_iter().find_map(|e| if let ServerEvent::Refused(1, why) = e { Some(why) } else { None }).unwrap();
        for out in server.outgoing() {
            facet.on_event(MS, LinkEvent::Message, out.message.to_vec().into());
        }
        (told, facet.task())
    };
    let over = |why: &str| Task::Over(Over::Refused(why.to_owned()));
    let (told, task) = refusal(FacetOptions::new("facet 1", [8; 32], 1), |_| {});
    assert!(told.contains(&"07".repeat(32)) && told.contains(&"08".repeat(32)) && told.contains("facet 1"), "{told}");
    assert_eq!(task, over(&told));
    let (told, task) = refusal(FacetOptions::new("left", SCENE, 1), |_| {});
    assert!(told.contains("'facet 1'") && told.contains("'left'"), "{told}");
    assert_eq!(task, over(&told));
    let (told, _) = refusal(FacetOptions::new("facet 1", SCENE, 1), |bytes| bytes[76] = 9);
    assert!(told.contains("version 2") && told.contains("version 9"), "{told}");
}

/// A facet that draws something else than was sent is found out by its hash, and the wall goes on.
#[test]
fn a_facet_that_draws_something_else_is_found_out() {
    let base = scene();
    let mut server = ServerSession::new(Stage::new(1, Weather::CLEAR, 1, Pace::Lockstep).options, &base);
    let mut facet = FacetSession::new(FacetOptions::new("facet 0", SCENE, 1), scene());
    let (mut wrong, mut shown) = (0, 0);
    for k in 1..400u32 {
        let now = k * MS;
        facet.advance(now);
        if facet.task() == Task::Draw && facet.begin().is_some() {
            facet.drawn(now, [0; 16]);
        }
        if let Task::Present(_) = facet.task() {
            facet.presented(now);
            shown += 1;
        }
        for (_, mut bytes) in facet.outgoing() {
            let (header, payload) = wire::open(&bytes).unwrap();
            if header.kind == wire::Kind::Ready && header.frame.is_multiple_of(3) {
                let mut done = Done::read(payload).unwrap();
                done.hash[5] ^= 1;
                bytes = wire::message(&header, |out| done.write(out));
                wrong += 1;
            }
            server.on_event(now, 0, LinkEvent::Message, &bytes);
        }
        if server.idle() && server.complete() {
            server.publish(now, &base, &viewer(0)).unwrap();
        }
        server.outgoing().iter().for_each(|out| facet.on_event(now, LinkEvent::Message, out.message.to_vec().into()));
    }
    assert!(shown > 50 && wrong > 15, "{shown} {wrong}");
    let told = server.events().iter().filter(|e| matches!(e, ServerEvent::Ready(0, frame, _, false) if frame % 3 == 0)).count();
    assert_eq!((server.counts(0).0.mismatched, told), (wrong, wrong as usize));
}

/// Good-byes are no deaths: END ends the facets, LEAVE frees the place at once.
#[test]
fn good_byes_are_told_from_deaths() {
    let mut stage = at(1, 96);
    let facet = stage.facets[1].session.as_mut().unwrap();
    facet.leave();
    let bytes: Vec<_> = facet.outgoing();
    for (_, bytes) in bytes {
        stage.net.send(stage.now, To::Server(1), &bytes);
    }
    stage.run(50 * MS);
    assert!(stage.events.contains(&ServerEvent::Gone(1, true)));
    assert_eq!(stage.server.as_ref().unwrap().counts(1).0.dropped, 0);
    stage.server.as_mut().unwrap().end();
    stage.run(50 * MS);
    for k in [0, 2] {
        assert_eq!(stage.facets[k].session.as_ref().unwrap().task(), Task::Over(Over::Ended));
    }
}

/// The link of facet 1 closes, as both ends report it.
fn close_link(stage: &mut Stage, why: Closed) {
    let now = stage.now;
    stage.server.as_mut().unwrap().on_event(now, 1, LinkEvent::Closed(why), &[]);
    stage.facets[1].session.as_mut().unwrap().on_event(now, LinkEvent::Closed(why), Vec::new().into());
    stage.net.part(1, true); // what was under way is gone
    stage.run(50 * MS);
    stage.net.part(1, false);
}

/// Joined and without a frame, before the first one and in mid-run: the number that the server knows is used up.
#[test]
fn a_facet_that_loses_its_connection_before_its_first_frame_is_let_in_again() {
    let standing = |s: &Stage| s.server.as_ref().unwrap().standing(1);
    let in_step = |s: &Stage| s.server.as_ref().unwrap().standing(1) == Standing::InStep;
    for seed in [140, 141] {
        let mut stage = Stage::new(seed, if seed == 140 { Weather::CLEAR } else { STORM }, 2, Pace::Lockstep);
        stage.net.part(0, true);
        assert!(stage.until(500 * MS, |s| standing(s) == Standing::Following));
        assert_eq!(task(&stage), Some(Task::Wait(Waiting::Server)));
        close_link(&mut stage, Closed::Silent);
        stage.run(100 * MS);
        stage.net.part(0, false);
        assert!(stage.until(1000 * MS, in_step), "before the first frame, seed {seed}");
        stage.run(100 * MS);

        close_link(&mut stage, Closed::Silent);
        assert!(stage.until(500 * MS, |s| standing(s) == Standing::Following));
        close_link(&mut stage, Closed::ByPeer);
        assert!(stage.until(1000 * MS, in_step), "in mid-run, seed {seed}");
        stage.assert_true();
    }
}

/// A server that drops a joining facet, whose link does not close, tells it to join anew.
#[test]
fn a_number_that_is_used_up_is_answered() {
    let mut stage = Stage::new(142, Weather::CLEAR, 2, Pace::Lockstep);
    stage.net.part(0, true);
    let standing = |s: &Stage| s.server.as_ref().unwrap().standing(1);
    assert!(stage.until(500 * MS, |s| standing(s) == Standing::Following));
    let now = stage.now;
    stage.server.as_mut().unwrap().lose(now, 1);
    assert!(stage.until(500 * MS, |s| standing(s) == Standing::Following));
}

/// A run that ends before its first frame ends for those who have joined, too.
#[test]
fn the_end_is_understood_before_the_first_frame() {
    let mut stage = Stage::new(143, Weather::CLEAR, 2, Pace::Lockstep);
    stage.net.part(0, true);
    assert!(stage.until(500 * MS, |s| s.server.as_ref().unwrap().standing(1) == Standing::Following));
    stage.server.as_mut().unwrap().end();
    stage.run(50 * MS);
    assert_eq!(task(&stage), Some(Task::Over(Over::Ended)));
}

/// Two processes of one facet, and a link that gives the connection to who came last, as shared memory and UDP do: the loser comes back at once. What each
/// is told to do next, and how often somebody joined.
fn rivals(now: &mut Duration, server: &mut ServerSession, facets: &mut [Option<FacetSession>], time: Duration, has: &mut usize) {
    let end = *now + time;
    while *now < end {
        *now += MS;
        for k in 0..facets.len() {
            let Some(facet) = facets[k].as_mut().filter(|f| !matches!(f.task(), Task::Over(_))) else { continue };
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
        if server.idle() && server.complete() && now.as_millis().is_multiple_of(16) {
            server.publish(*now, &scene(), &viewer(0)).unwrap();
        }
    }
}

#[test]
fn of_two_processes_of_one_facet_the_first_that_answers_stays() {
    let process = |seed: u64| Some(FacetSession::new(FacetOptions::new("facet 0", SCENE, seed << 16), scene()));
    let refused = |facet: &Option<FacetSession>| matches!(facet.as_ref().unwrap().task(), Task::Over(Over::Refused(why)) if why.contains("another process shows facet 'facet 0'"));
    let over = |facet: &Option<FacetSession>| matches!(facet.as_ref().unwrap().task(), Task::Over(_));
    let mut server = ServerSession::new(Stage::new(1, Weather::CLEAR, 1, Pace::Lockstep).options, &scene());
    let (mut now, mut has, mut facets) = (MS, 0, vec![process(1)]);
    rivals(&mut now, &mut server, &mut facets, 100 * MS, &mut has);
    facets.extend([process(2), process(3)]);
    rivals(&mut now, &mut server, &mut facets, 400 * MS, &mut has);
    assert_eq!([over(&facets[0]), refused(&facets[1]), refused(&facets[2])], [false, true, true]);
    assert_eq!(server.standing(0), Standing::InStep);
    let joined = server.counts(0).0.joined;
    assert!(joined <= 6, "{joined}");
    rivals(&mut now, &mut server, &mut facets, 1000 * MS, &mut has);
    assert_eq!(server.counts(0).0.joined, joined, "there is peace");

    // Killed and started again: at once. The one that was stopped meanwhile, and goes on, has lost its place for good.
    let stopped = facets[0].take();
    facets.push(process(4));
    rivals(&mut now, &mut server, &mut facets, 100 * MS, &mut has);
    assert_eq!(server.standing(0), Standing::InStep);
    rivals(&mut now, &mut server, &mut facets, 2500 * MS, &mut has);
    facets[0] = stopped;
    rivals(&mut now, &mut server, &mut facets, 400 * MS, &mut has);
    assert_eq!([refused(&facets[0]), over(&facets[3])], [true, false]);
    assert_eq!(server.standing(0), Standing::InStep);
}

/// A frame that does not fit is refused, asked for again, and shown when it comes right.
#[test]
fn a_frame_that_does_not_fit_is_asked_for_again() {
    let base = scene();
    let mut server = ServerSession::new(ServerOptions { resend_after: None, ..Stage::new(1, Weather::CLEAR, 1, Pace::Lockstep).options }, &base);
    let mut facet = FacetSession::new(FacetOptions::new("facet 0", SCENE, 1), scene());
    let mut spoilt = 0;
    for k in 1..100u32 {
        let now = k * MS;
        facet.advance(now);
        if facet.task() == Task::Draw && facet.begin().is_some() {
            facet.drawn(now, [0; 16]);
        }
        if let Task::Present(_) = facet.task() {
            facet.presented(now);
        }
        facet.outgoing().iter().for_each(|(_, bytes)| server.on_event(now, 0, LinkEvent::Message, bytes));
        if server.idle() && server.complete() {
            server.publish(now, &base, &viewer(0)).unwrap();
        }
        for out in server.outgoing() {
            let (header, payload) = wire::open(&out.message).unwrap();
            let spoil = header.kind == wire::Kind::State && header.frame == 5 && spoilt == 0;
            let bytes = if spoil { wire::message(&header, |out| out.extend(&payload[..payload.len() - 1])) } else { out.message.to_vec() };
            spoilt += u32::from(spoil);
            facet.on_event(now, LinkEvent::Message, bytes.into());
        }
    }
    let counts = facet.counts();
    assert_eq!((spoilt, counts.refused, counts.missing, server.counts(0).0.late), (1, 1, 0, 0));
    assert!(counts.shown > 20, "{counts:?}");
}

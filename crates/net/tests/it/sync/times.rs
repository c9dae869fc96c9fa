//! Times at which frames are shown, reported by clocks that disagree, compared with the stage's own
//! clock.

use super::lockstep::STORM;
use super::simulated_session::*;
use std::time::Duration;
use tumble_net::sync::simulated_network::{Destination, NetworkConditions};
use tumble_net::sync::{FrameTimes, Input, ServerEvent, SyncMode};

const US: Duration = Duration::from_micros(1);

fn times(stage: &Stage) -> Vec<FrameTimes> {
    stage.events.iter().filter_map(|e| if let ServerEvent::Shown(times) = e { Some(*times) } else { None }).collect()
}

/// Returns when each facet showed a frame first, by the stage's clock.
fn truth(stage: &Stage, frame: u64) -> Vec<Duration> {
    let at =
        |k: usize| stage.facets[k].shown.iter().position(|(f, _)| *f == frame).map(|at| stage.facets[k].shown_at[at]);
    (0..stage.facets.len()).filter_map(at).collect()
}

/// A session with clocks that are seconds to weeks apart, and screens that show a frame 0, 3 and 7
/// ms after the request.
fn stage(conditions: NetworkConditions, mode: SyncMode) -> Stage {
    let mut stage = Stage::new(11, conditions, 3, mode);
    for (facet, (clock_s, after_ms)) in stage.facets.iter_mut().zip([(0, 3), (1_000_000, 0), (7, 7)]) {
        (facet.clock, facet.shows_after) = (Duration::from_secs(clock_s), after_ms * MS);
    }
    stage
}

#[test]
fn the_skew_is_that_of_the_screens_whatever_the_clocks_say() {
    let mut stage = stage(NetworkConditions { delay: [500 * US; 2], ..NetworkConditions::PERFECT }, SyncMode::Lockstep);
    stage.run(Duration::from_secs(1));
    let times = times(&stage);
    assert!(times.len() > 50);
    for t in &times {
        assert_eq!((t.facets, t.skew), (3, 7 * MS), "frame {}", t.frame);
        assert!(t.error <= 1200 * US, "both ways take 1 ms and the stage's tenths: {:?}", t.error);
    }
}

#[test]
fn over_a_bad_network_the_skew_is_right_within_its_stated_error() {
    for mode in [SyncMode::Lockstep, SyncMode::Latest] {
        let mut stage = stage(STORM, mode);
        stage.run(Duration::from_secs(5));
        let times = times(&stage);
        assert!(times.len() > 100, "{mode:?}: {}", times.len());
        for t in times.iter().filter(|t| t.facets == 3) {
            let shown = truth(&stage, t.frame);
            let skew = *shown.iter().max().unwrap() - *shown.iter().min().unwrap();
            assert!(
                t.skew.abs_diff(skew) <= t.error,
                "{mode:?} frame {}: {:?} and {skew:?}, stated {:?}",
                t.frame,
                t.skew,
                t.error
            );
            assert!(t.error < 5 * MS, "{:?}", t.error);
        }
    }
}

/// An input at a facet and one at the server: each is timed once, to the last screen that shows it.
#[test]
fn from_what_a_user_does_to_the_picture_that_shows_it() {
    let mut stage = stage(NetworkConditions { delay: [500 * US; 2], ..NetworkConditions::PERFECT }, SyncMode::Lockstep);
    stage.run(200 * MS);
    // the stage's viewer carries the number of the world's frame as the number of the newest input
    let (by_facet, by_server) = (stage.world.frame() + 5, stage.world.frame() + 10);
    let sent = stage.now;
    let there = sent + stage.facets[1].clock;
    let input =
        Input { sequence: by_facet, user: 0, head: None, wand: None, hands: [None; 2], buttons: 0, keys: Vec::new() };
    let facet = stage.facets[1].session.as_mut().unwrap();
    assert!(facet.send_input(there, &input));
    facet.outgoing().iter().for_each(|(_, bytes)| stage.net.send(sent, Destination::Server(1), bytes));
    while stage.world.frame() < by_facet + 2 {
        stage.tick();
    }
    let came = stage.now;
    stage.server.as_mut().unwrap().note_input(came, 0, by_server);
    stage.run(400 * MS);
    let timed: Vec<FrameTimes> = times(&stage).into_iter().filter(|t| t.input.is_some()).collect();
    assert_eq!(timed.len(), 2, "{timed:?}");
    for (t, since) in timed.iter().zip([sent, came]) {
        let shown = truth(&stage, t.frame).into_iter().max().unwrap();
        assert_eq!((t.input, t.shown), (Some(shown - since), shown), "frame {}", t.frame);
    }
    assert!(timed[1].input.unwrap() > 50 * MS, "three frames of 16 ms and the screen: {:?}", timed[1].input);
}

//! Shared memory between threads and between processes, one of which is killed.

use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};
use tumble_net::sync::shm::{ShmFacet, ShmServer};
use tumble_net::sync::transport::*;

const RUN: &str = "TUMBLE_NET_TEST_SHM_RUN";

fn run_name(test: &str) -> String {
    format!("test-{}-{test}", std::process::id())
}

fn message(k: u64, length: usize) -> Vec<u8> {
    (0..length as u64).map(|at| (k * 31 + at * 7 + at / 251) as u8).collect()
}

/// A server and its facets in one thread, with all events that they received.
struct Cave {
    server: ShmServer,
    facets: Vec<ShmFacet>,
    at_server: Vec<(FacetNumber, LinkEvent, Vec<u8>)>,
    at_facet: Vec<Vec<(LinkEvent, Vec<u8>)>>,
}

impl Cave {
    fn new(test: &str, count: FacetNumber) -> Cave {
        let server = ShmServer::new(&run_name(test), count).unwrap();
        let facets = (0..count).map(|facet| ShmFacet::new(&run_name(test), facet).unwrap()).collect();
        let mut cave = Cave { server, facets, at_server: Vec::new(), at_facet: vec![Vec::new(); usize::from(count)] };
        cave.until(|cave| {
            cave.at_server.len() == usize::from(count) && cave.at_facet.iter().all(|events| events.len() == 1)
        });
        assert!(cave.at_server.drain(..).all(|(_, event, _)| event == LinkEvent::Opened));
        assert!(cave.at_facet.iter_mut().all(|events| events.pop() == Some((LinkEvent::Opened, Vec::new()))));
        cave
    }

    /// Polls server and facets in turn until `condition` holds; panics after 20 s.
    fn until(&mut self, condition: impl Fn(&Cave) -> bool) {
        let end = Instant::now() + Duration::from_secs(20);
        while !condition(self) {
            assert!(Instant::now() < end, "the condition does not hold within 20 s");
            self.poll_server();
            for k in 0..self.facets.len() {
                self.poll_facet(k);
            }
        }
    }

    fn poll_server(&mut self) {
        let mut message = Vec::new();
        if let Some((facet, event)) = self.server.recv(Duration::from_millis(1), &mut message).unwrap() {
            self.at_server.push((facet, event, message));
        }
    }

    fn poll_facet(&mut self, k: usize) {
        let mut message = Message::default();
        if let Some(event) = self.facets[k].recv(Duration::from_millis(1), &mut message).unwrap() {
            self.at_facet[k].push((event, message.into_vec()));
        }
    }
}

#[test]
fn messages_of_all_lengths_arrive_whole_and_in_order_both_ways() {
    let mut cave = Cave::new("lengths", 2);
    let lengths = [1, 48, 16 << 10, (16 << 10) + 1, 128 << 10, (128 << 10) + 1, 3 << 20];
    for (k, length) in lengths.into_iter().enumerate() {
        assert_eq!(cave.server.send_all(&[0, 1], Delivery::Reliable, &message(k as u64, length)).unwrap(), 2);
        assert!(cave.facets[1].send(Delivery::Reliable, &message(k as u64 + 100, length)).unwrap());
    }
    cave.until(|cave| cave.at_server.len() == 7 && cave.at_facet.iter().all(|events| events.len() == 7));
    for (k, length) in lengths.into_iter().enumerate() {
        assert!(
            cave.at_facet.iter().all(|events| events[k] == (LinkEvent::Message, message(k as u64, length))),
            "{length} bytes down"
        );
        assert!(cave.at_server[k] == (1, LinkEvent::Message, message(k as u64 + 100, length)), "{length} bytes up");
    }
    assert!(
        !cave.server.send(0, Delivery::Reliable, &[]).unwrap()
            && !cave.server.send(2, Delivery::Reliable, &[1]).unwrap()
    );
}

/// The buffer holds eight messages. Of three hundred, most go to other facets before the slow one
/// polls.
#[test]
fn a_facet_that_polls_late_requests_missed_messages() {
    let mut cave = Cave::new("late", 3);
    for k in 0..300u64 {
        let to: &[FacetNumber] = if k % 3 == 0 { &[0, 1, 2] } else { &[2] };
        assert_eq!(cave.server.send_all(to, Delivery::Reliable, &message(k, 1000)).unwrap(), to.len());
        // facet 2 polls each time; the others later, with different gaps
        cave.poll_facet(2);
    }
    for k in 0..20u64 {
        assert!(cave.facets[1].send(Delivery::Reliable, &message(k, 50)).unwrap());
    }
    cave.until(|cave| {
        cave.at_facet[2].len() == 300
            && cave.at_facet[1].len() == 100
            && cave.at_facet[0].len() == 100
            && cave.at_server.len() == 20
    });
    for facet in 0..3 {
        let step = if facet == 2 { 1 } else { 3 };
        assert!(
            cave.at_facet[facet]
                .iter()
                .enumerate()
                .all(|(k, got)| *got == (LinkEvent::Message, message(step * k as u64, 1000)))
        );
    }
    assert!(cave.at_server.iter().enumerate().all(|(k, got)| *got == (1, LinkEvent::Message, message(k as u64, 50))));
    assert!(cave.server.counters(0).repeated > 100 && cave.server.counters(1).repeated > 100);
    assert!(cave.server.counters(2).repeated < 20 && cave.facets[1].counters().repeated >= 12);
}

#[test]
fn of_newest_messages_the_last_arrives() {
    let mut cave = Cave::new("newest", 1);
    for k in 0..100 {
        assert!(cave.server.send(0, Delivery::Newest, &message(k, 5000)).unwrap());
    }
    cave.until(|cave| cave.at_facet[0].last().is_some_and(|(_, got)| *got == message(99, 5000)));
    assert!(cave.at_facet[0].len() < 100);
}

/// One side does nothing for longer than the idle timeout, as between SIGSTOP and SIGCONT; the
/// other goes on.
#[test]
fn a_facet_or_server_that_was_stopped_for_long_connects_anew() {
    let mut cave = Cave::new("stopped", 2);
    let end = Instant::now() + Duration::from_secs(20);
    while cave.at_server.is_empty() {
        cave.poll_server();
        cave.poll_facet(1);
        assert!(Instant::now() < end);
    }
    assert_eq!(
        cave.at_server.pop().map(|(facet, event, _)| (facet, event)),
        Some((0, LinkEvent::Closed(Closed::TimedOut)))
    );
    cave.until(|cave| cave.at_server.len() == 1 && cave.at_facet[0].len() == 2);
    let events: Vec<_> = cave.at_facet[0].drain(..).map(|(event, _)| event).collect();
    assert_eq!(events, [LinkEvent::Closed(Closed::ByPeer), LinkEvent::Opened]);
    assert_eq!(cave.at_server.pop().map(|(facet, event, _)| (facet, event)), Some((0, LinkEvent::Opened)));
    assert!(cave.at_facet[1].is_empty());

    while cave.at_facet[1].is_empty() || cave.at_facet[0].is_empty() {
        cave.poll_facet(0);
        cave.poll_facet(1);
        assert!(Instant::now() < end);
    }
    cave.until(|cave| cave.at_facet.iter().all(|events| events.len() == 2));
    for events in &cave.at_facet {
        assert_eq!(
            events.iter().map(|(event, _)| *event).collect::<Vec<_>>(),
            [LinkEvent::Closed(Closed::TimedOut), LinkEvent::Opened]
        );
    }
}

/// The server with the shorter idle timeout drops its frozen facet first.
#[test]
fn the_idle_timeout_is_as_long_as_set() {
    let (mut default, mut short) = (Cave::new("default", 1), Cave::new("short", 1));
    short.server = short.server.with_idle_timeout(Duration::from_millis(300));
    let end = Instant::now() + Duration::from_secs(20);
    while short.at_server.is_empty() {
        short.poll_server();
        default.poll_server();
        assert!(Instant::now() < end && default.at_server.is_empty());
    }
    assert_eq!(
        short.at_server.pop().map(|(facet, event, _)| (facet, event)),
        Some((0, LinkEvent::Closed(Closed::TimedOut)))
    );
}

#[test]
fn a_server_started_again_in_the_same_run_is_found() {
    let mut cave = Cave::new("again", 2);
    cave.server = ShmServer::new(&run_name("again"), 2).unwrap();
    cave.until(|cave| cave.at_server.len() == 2 && cave.at_facet.iter().all(|events| events.len() == 2));
    for events in &cave.at_facet {
        assert_eq!(
            events.iter().map(|(event, _)| *event).collect::<Vec<_>>(),
            [LinkEvent::Closed(Closed::ByPeer), LinkEvent::Opened]
        );
    }
}

/// A facet in its own process, which answers each message with the same message.
#[test]
#[ignore = "run by a_killed_facet_comes_back_and_nothing_is_left"]
fn child_answers_until_killed() {
    let run = std::env::var(RUN).expect("only the killing test runs this");
    let mut facet = ShmFacet::new(&run, 0).unwrap();
    let mut message = Message::default();
    let end = Instant::now() + Duration::from_secs(30);
    while Instant::now() < end {
        if facet.recv(Duration::from_millis(100), &mut message).unwrap() == Some(LinkEvent::Message) {
            assert!(facet.send(Delivery::Reliable, &message).unwrap());
        }
    }
}

fn start_child(run: &str) -> Child {
    Command::new(std::env::current_exe().unwrap())
        .args(["--exact", "shm::child_answers_until_killed", "--ignored"])
        .env(RUN, run)
        .stdout(Stdio::null())
        .spawn()
        .unwrap()
}

#[test]
fn a_killed_facet_comes_back_and_nothing_is_left() {
    let run = run_name("kill");
    let mut server = ShmServer::new(&run, 1).unwrap();
    let mut got = Vec::new();
    let mut event = |server: &mut ShmServer, seconds: u64| {
        let event = server.recv(Duration::from_secs(seconds), &mut got).unwrap().map(|(_, event)| event);
        (event, number(&got))
    };
    for round in 0..2u64 {
        let mut child = start_child(&run);
        assert_eq!(event(&mut server, 20).0, Some(LinkEvent::Opened));
        for k in 0..50 {
            assert!(server.send(0, Delivery::Reliable, &(100 * round + k).to_le_bytes()).unwrap());
            assert_eq!(event(&mut server, 10), (Some(LinkEvent::Message), 100 * round + k));
        }
        child.kill().unwrap(); // SIGKILL
        child.wait().unwrap();
        // the server never waits for a dead facet: it sends far more than any buffer holds within
        // the idle timeout
        let begin = Instant::now();
        for _ in 0..200 {
            server.send(0, Delivery::Reliable, &[7; 100_000]).unwrap();
        }
        assert!(begin.elapsed() < Duration::from_secs(20));
        assert_eq!(event(&mut server, 20).0, Some(LinkEvent::Closed(Closed::TimedOut)));
    }
    // A server that is killed in mid-run leaves its facet running, and the next server of the run
    // takes over: `a_server_started_again_in_the_same_run_is_found`.
    drop(server);
    tumble_net::sync::shm::clean_up().unwrap();
    let (folder, _) = tumble_net::sync::shm::folder().unwrap();
    let left: Vec<_> = walk(&folder.join("services")).into_iter().filter(|text| text.contains(&run)).collect();
    assert!(left.is_empty(), "{left:?}");
}

fn number(message: &[u8]) -> u64 {
    message.get(..8).map_or(u64::MAX, |bytes| u64::from_le_bytes(bytes.try_into().unwrap()))
}

/// Returns the contents of the files of a folder.
fn walk(folder: &std::path::Path) -> Vec<String> {
    let files = std::fs::read_dir(folder).into_iter().flatten().flatten();
    files.filter_map(|file| Some(String::from_utf8_lossy(&std::fs::read(file.path()).ok()?).into_owned())).collect()
}

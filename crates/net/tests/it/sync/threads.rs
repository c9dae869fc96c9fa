//! Server and facets on threads, over the in-process link, by the real clock; recording and replay
//! of the session.

use super::simulated_session::{SCENE, scene, viewer};
use crate::support::Scratch;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::Duration;
use tumble_core::collide::Shape;
use tumble_core::{RigidBody, World};
use tumble_net::record::RecorderOptions;
use tumble_net::sync::messages::FrameAck;
use tumble_net::sync::transport::{Closed, Delivery, FacetLink, LinkEvent, Message, ServerLink};
use tumble_net::sync::*;

const SECOND: Duration = Duration::from_secs(1);
pub type Shown = Vec<(u64, FrameAck)>;

/// Returns a stand-in for a picture: a hash of the data that its renderer would read.
fn picture(world: &World, viewer: &Viewer) -> [u8; 16] {
    let mut text = format!("{viewer:?}");
    for &id in world.ids() {
        text += &format!("{:?} {:?}", world.name(id), world.part_state(id, 0).map(|s| s.pose));
    }
    let mut image = [0; 16];
    image.copy_from_slice(&blake3::hash(text.as_bytes()).as_bytes()[..16]);
    image
}

/// Runs a facet until the end of the run and returns the frames it has shown.
pub fn facet(
    link: impl FacetLink + Send + 'static,
    k: u16,
    stop: &Arc<AtomicBool>,
) -> JoinHandle<(Shown, FacetCounts)> {
    let stop = stop.clone();
    std::thread::spawn(move || {
        let mut facet = Facet::new(link, FacetOptions::new(&format!("facet {k}"), SCENE, k as u64), scene());
        let mut shown = Vec::new();
        let input = Input { sequence: 1, user: 0, head: None, wand: None, hands: [None; 2], buttons: 1, keys: vec![k] };
        while !stop.load(Ordering::Relaxed) {
            match facet.next(20 * Duration::from_millis(1)).unwrap() {
                Task::Wait(_) => {}
                Task::Draw => {
                    if facet.begin().is_some() {
                        let image = picture(facet.world(), facet.viewer());
                        facet.drawn(image).unwrap();
                    }
                }
                Task::Present(_) => {
                    facet.presented().unwrap();
                    shown.extend(facet.session().shown());
                    if shown.len() == 1 {
                        assert!(facet.send_input(&input).unwrap());
                    }
                }
                Task::Ended(_) => break,
            }
        }
        (shown, facet.session().counts())
    })
}

pub fn options() -> ServerOptions {
    let slots = (0..3).map(|k| FacetSlot { name: format!("facet {k}"), critical: true }).collect();
    ServerOptions { ready_timeout: 10 * SECOND, drop_timeout: 60 * SECOND, ..ServerOptions::new(5, SCENE, slots) }
}

/// Returns the hashes of the states and of the pictures, frame by frame.
pub fn hashes(shown: &Shown) -> Vec<(u64, [u8; 16], [u8; 16])> {
    shown.iter().map(|(frame, done)| (*frame, done.hash, done.image)).collect()
}

#[test]
fn a_run_is_recorded_and_replays_to_the_same_hashes_twice() {
    let (scratch, count) = (Scratch::new("session"), 60);
    let path = scratch.file("run.mcap");
    let stop = Arc::new(AtomicBool::new(false));
    let transport = LocalTransport::new(3);
    let facets: Vec<_> = (0..3).map(|k| facet(transport.facet(k).unwrap(), k, &stop)).collect();
    let mut world = scene();
    let mut server = Server::new(transport.server(), options(), &world);
    let mut recorder = SessionRecorder::create(&path, "test", SCENE, &world, 1, RecorderOptions::default()).unwrap();
    server.wait_for_facets(10 * SECOND).unwrap();
    for frame in 0..count {
        world.step().unwrap();
        if frame == 30 {
            world.add(RigidBody::new(Shape::sphere(0.3).unwrap()).with_name("guest").with_mass(1.0)).unwrap();
        }
        assert_eq!(server.frame(&world, &viewer(frame)).unwrap(), frame);
        recorder.frame(&world, server.session().recorded(frame == 0).unwrap()).unwrap();
        recorder.events(&server.events());
    }
    server.end().unwrap();
    recorder.events(&server.events());
    assert_eq!(recorder.finish().unwrap().frames, count);
    let shown: Vec<Shown> = facets
        .into_iter()
        .map(|f| f.join().unwrap())
        .map(|(shown, counts)| {
            assert_eq!(counts, FacetCounts { shown: count, ..FacetCounts::default() });
            shown
        })
        .collect();
    assert!(shown.iter().all(|s| hashes(s) == hashes(&shown[0]) && s.iter().map(|s| s.0).eq(0..count)));

    for run in 0..2 {
        let transport = LocalTransport::new(3);
        let facets: Vec<_> = (0..3).map(|k| facet(transport.facet(k).unwrap(), k, &stop)).collect();
        let mut server = Server::new(transport.server(), options(), &scene());
        let mut replay = SessionReader::open(&path).unwrap();
        replay.check_scene(SCENE).unwrap();
        assert!(replay.check_scene([1; 32]).unwrap_err().to_string().contains(&"01".repeat(32)));
        server.wait_for_facets(10 * SECOND).unwrap();
        let (mut inputs, mut presented) = (Vec::new(), Vec::new());
        while let Some(frame) = replay.next_frame().unwrap() {
            server.replay(&frame.recorded).unwrap();
            inputs.extend(frame.inputs);
            presented.extend(frame.presented);
        }
        server.end().unwrap();
        for (k, facet) in facets.into_iter().enumerate() {
            assert_eq!(hashes(&facet.join().unwrap().0), hashes(&shown[k]), "replay {run}");
            assert_eq!(server.counts(k as u16).0.mismatched, 0);
            // the recording contains this facet's answers
            let then: Vec<_> =
                presented.iter().filter(|(f, ..)| *f as usize == k).map(|(_, frame, done)| (*frame, *done)).collect();
            assert_eq!(then, shown[k]);
            assert!(inputs.iter().any(|(f, input)| *f as usize == k && input.keys == [k as u16]));
        }
    }
}

/// Facets that do not join in time are named.
#[test]
fn absent_facets_are_named() {
    let transport = LocalTransport::new(3);
    let mut server = Server::new(transport.server(), options(), &scene());
    let error = server.wait_for_facets(Duration::from_millis(30)).unwrap_err().to_string();
    assert!(error.contains("facet 0, facet 1, facet 2 did not join"), "{error}");
}

/// The contract of the link: order, newest, closing and reconnecting.
#[test]
fn the_local_link_keeps_its_contract() {
    let (transport, mut bytes, mut lent, no_time) =
        (LocalTransport::new(2), Vec::new(), Message::default(), Duration::ZERO);
    let mut server = transport.server();
    assert!(!server.send(0, Delivery::Reliable, b"x").unwrap(), "nobody is there");
    let mut facet = transport.facet(0).unwrap();
    assert_eq!(server.recv(no_time, &mut bytes).unwrap(), Some((0, LinkEvent::Opened)));
    assert_eq!(facet.recv(no_time, &mut lent).unwrap(), Some(LinkEvent::Opened));
    for k in 0..3u8 {
        assert!(server.send(0, Delivery::Reliable, &[k]).unwrap());
        assert!(server.send(0, Delivery::Newest, &[10 + k]).unwrap());
    }
    let mut got = Vec::new();
    while facet.recv(no_time, &mut lent).unwrap() == Some(LinkEvent::Message) {
        got.push(lent[0]);
    }
    assert_eq!(got, [0, 1, 2, 12]);
    assert_eq!(server.counters(0).superseded, 2);
    assert!(!server.send(0, Delivery::Reliable, b"").unwrap() && !facet.send(Delivery::Reliable, b"").unwrap());
    facet.send(Delivery::Reliable, b"lost with the connection").unwrap();
    drop(facet);
    assert_eq!(server.recv(no_time, &mut bytes).unwrap(), Some((0, LinkEvent::Closed(Closed::ByPeer))));
    let mut facet = transport.facet(0).unwrap();
    assert_eq!(server.recv(no_time, &mut bytes).unwrap(), Some((0, LinkEvent::Opened)));
    server.close(0);
    let events: Vec<_> = (0..3).map(|_| facet.recv(no_time, &mut lent).unwrap()).collect();
    assert_eq!(events, [LinkEvent::Opened, LinkEvent::Closed(Closed::ByPeer), LinkEvent::Opened].map(Some));
    drop(server);
    assert_eq!(facet.recv(no_time, &mut lent).unwrap(), Some(LinkEvent::Closed(Closed::ByPeer)));
}

/// A facet that reads nothing loses its connection, and the others keep theirs: the server never
/// waits for it.
#[test]
fn a_facet_that_does_not_read_is_closed() {
    let transport = LocalTransport::new(2);
    let (mut server, _deaf) = (transport.server(), transport.facet(0).unwrap());
    let (message, mut bytes) = (vec![1; 8 << 20], Vec::new());
    let sent = (0..20).take_while(|_| server.send(0, Delivery::Reliable, &message).unwrap()).count();
    assert_eq!(sent, 8, "64 MiB in messages of 8");
    let mut events = Vec::new();
    while let Some((0, event)) = server.recv(Duration::ZERO, &mut bytes).unwrap() {
        events.push(event);
    }
    assert_eq!(events[..2], [LinkEvent::Opened, LinkEvent::Closed(Closed::Overrun)]);
}

/// A server ends without a word and another one starts: the facets change over by themselves.
#[test]
fn facets_find_the_next_server_over_a_link() {
    let (transport, stop) = (LocalTransport::new(3), Arc::new(AtomicBool::new(false)));
    let facets: Vec<_> = (0..3).map(|k| facet(transport.facet(k).unwrap(), k, &stop)).collect();
    let world = Mutex::new(scene());
    for run in 0..2 {
        let mut world = world.lock().unwrap();
        let options = ServerOptions { run: 10 + run, first_frame: 1000 * run, ..options() };
        let mut server = Server::new(transport.server(), options, &scene());
        server.wait_for_facets(10 * SECOND).unwrap();
        for frame in 0..10 {
            world.step().unwrap();
            server.frame(&world, &viewer(frame)).unwrap();
        }
        if run == 1 {
            server.end().unwrap();
        }
    }
    for facet in facets {
        let (shown, counts) = facet.join().unwrap();
        assert_eq!(shown.iter().map(|s| s.0).collect::<Vec<_>>(), (0..10).chain(1000..1010).collect::<Vec<_>>());
        assert_eq!(counts.lost, 1);
    }
}

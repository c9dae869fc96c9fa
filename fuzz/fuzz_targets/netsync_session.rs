//! Valid messages with random content, to a server and a facet in the middle of a run. The bytes
//! are a sequence of: kind, flags (run, join, receiver), frame, length, payload.
#![no_main]

use libfuzzer_sys::fuzz_target;
use std::time::Duration;
use tumble_core::collide::{Pose, Shape};
use tumble_core::{RigidBody, Settings, World};
use tumble_net::sync::transport::LinkEvent;
use tumble_net::sync::wire::{MessageHeader, MessageKind, message, open};
use tumble_net::sync::{FacetOptions, FacetSession, FacetSlot, ServerOptions, ServerSession, Task, Viewer};

fn world() -> World {
    let mut world = World::new(Settings::default()).expect("the default settings are sound");
    let ball = RigidBody::new(Shape::sphere(0.1).expect("a radius")).with_name("ball").with_mass(1.0);
    world.add(ball.with_pose(Pose::translation(0.0, 0.0, 0.1))).expect("a new name");
    world
}

fuzz_target!(|bytes: &[u8]| {
    let slots = vec![FacetSlot { name: "f".into(), critical: true }];
    let mut server = ServerSession::new(ServerOptions::new(1, [0; 32], slots), &world());
    let mut facet = FacetSession::new(FacetOptions::new("f", [0; 32], 1), world());
    let (mut rest, mut now, mut join) = (bytes, Duration::ZERO, 0);
    while let [kind, flags, frame, length, tail @ ..] = rest {
        let payload;
        (payload, rest) = tail.split_at((*length as usize).min(tail.len()));
        now += Duration::from_millis(1);
        facet.advance(now);
        if facet.task() == Task::Draw && facet.begin().is_some() {
            facet.drawn(now, [0; 16]);
        }
        if let Task::Present(_) = facet.task() {
            facet.presented(now);
        }
        for (_, bytes) in facet.outgoing() {
            join = open(&bytes).map_or(join, |(header, _)| header.join);
            server.on_event(now, 0, LinkEvent::Message, &bytes);
        }
        if server.is_idle() && server.all_critical_joined() {
            server.publish(now, &world(), &Viewer::default()).expect("a sound world");
        }
        server.outgoing().iter().for_each(|out| facet.on_event(now, LinkEvent::Message, out.message.to_vec().into()));
        let header = MessageHeader {
            kind: MessageKind::ALL[*kind as usize % MessageKind::ALL.len()],
            run: (*flags as u64) & 1,
            join: if flags & 2 == 0 { join } else { 0 },
            frame: *frame as u64,
            time_s: 0.0,
        };
        let shot = message(&header, |out| out.extend(payload));
        if flags & 4 == 0 {
            server.on_event(now, 0, LinkEvent::Message, &shot);
        } else {
            facet.on_event(now, LinkEvent::Message, shot.clone().into());
        }
        assert!(server.events().len() < 100);
    }
});

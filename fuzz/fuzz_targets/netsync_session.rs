//! Valid messages with random content, to a server and a facet in the middle of a run. The bytes
//! are a sequence of: kind, flags (run, join, receiver; of the first: whether the facet steps by itself),
//! frame, length, payload.
#![no_main]

use libfuzzer_sys::fuzz_target;
use std::time::Duration;
use tumble_core::collide::{Pose, Shape};
use tumble_core::{RigidBody, Settings, World};
use tumble_net::sync::transport::LinkEvent;
use tumble_net::sync::wire::{MessageHeader, MessageKind, message, open};
use tumble_net::sync::{
    FacetOptions, FacetSession, FacetSlot, FrameInputs, ServerOptions, ServerSession, Simulation, Task, Viewer,
};

fn world() -> World {
    let mut world = World::new(Settings::default()).expect("the default settings are sound");
    let ball = RigidBody::new(Shape::sphere(0.1).expect("a radius")).with_name("ball").with_mass(1.0);
    world.add(ball.with_pose(Pose::translation(0.0, 0.0, 0.1))).expect("a new name");
    world
}

/// A world without users.
struct Alone(World, Viewer);

impl Simulation for Alone {
    fn world(&self) -> &World {
        &self.0
    }

    fn viewer(&self) -> &Viewer {
        &self.1
    }

    fn advance(&mut self, frame: &FrameInputs) -> Result<(), String> {
        (0..frame.steps.min(2)).try_for_each(|_| self.0.step().map(|_| ()).map_err(|e| e.to_string()))
    }

    fn save(&self) -> Vec<u8> {
        self.0.save()
    }

    fn restore(&mut self, bytes: &[u8]) -> Result<(), String> {
        self.0.restore(bytes).map_err(|e| e.to_string())
    }
}

fuzz_target!(|bytes: &[u8]| {
    let slots = vec![FacetSlot { name: "f".into(), critical: true }];
    let options = ServerOptions { compute: Some([0; 32]), ..ServerOptions::new(1, [0; 32], slots) };
    let mut server = ServerSession::new(options, &world());
    let options = FacetOptions::new("f", [0; 32], 1);
    let mut facet = match bytes.get(1).is_some_and(|flags| flags & 8 != 0) {
        true => FacetSession::computing(options, Box::new(Alone(world(), Viewer::default()))),
        false => FacetSession::new(options, world()),
    };
    let simulation = Alone(world(), Viewer::default());
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
            if server.frame().is_some() {
                server.send_inputs(now, FrameInputs::default());
            }
            server.publish_simulation(now, &simulation).expect("a sound world");
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

//! Facets that step the world by themselves, over a simulated network that loses messages.

use super::simulated_session::{MS, SCENE, scene};
use std::collections::BTreeMap;
use std::time::Duration;
use tumble_core::World;
use tumble_core::collide::Pose;
use tumble_net::sync::simulated_network::{Destination, NetworkConditions, SimulatedNetwork};
use tumble_net::sync::transport::{FacetNumber, LinkEvent};
use tumble_net::sync::wire::{HEADER_BYTES, MessageKind, open};
use tumble_net::sync::*;

const CONSTANTS: [u8; 32] = [9; 32];

/// The scene, in which each input pushes the crate by the position of a head.
struct Pushed {
    world: World,
    viewer: Viewer,
    /// Frame of the world's counter after which an object is moved by a bit: a wrong node.
    wrong_after: Option<(u64, &'static str)>,
    /// Bytes that follow a saved world.
    ballast: usize,
}

impl Pushed {
    fn new() -> Pushed {
        let viewer = Viewer {
            users: vec![User { head: Pose::identity(), interpupillary_m: 0.064, input: 0 }],
            ..Viewer::default()
        };
        Pushed { world: scene(), viewer, wrong_after: None, ballast: 0 }
    }
}

impl Simulation for Pushed {
    fn world(&self) -> &World {
        &self.world
    }

    fn viewer(&self) -> &Viewer {
        &self.viewer
    }

    fn advance(&mut self, frame: &FrameInputs) -> Result<(), String> {
        let crate_ = self.world.find("crate").unwrap();
        for (source, input) in &frame.inputs {
            let head = input.head.unwrap_or_default();
            let push = head.translation.vector * (1.0 + f64::from(*source));
            self.world.set_velocity(crate_, push, [0.0; 3].into()).map_err(|e| e.to_string())?;
            (self.viewer.users[0].head, self.viewer.users[0].input) = (head, input.sequence);
        }
        for _ in 0..frame.steps {
            self.world.step().map_err(|e| e.to_string())?;
        }
        if let Some((_, name)) = self.wrong_after.take_if(|(after, _)| self.world.frame() >= *after) {
            let id = self.world.find(name).unwrap();
            let mut x = self.world.state_of(id).unwrap().to_vec();
            x[0] = f64::from_bits(x[0].to_bits() + 1);
            self.world.write_state_of(id, &x).unwrap();
        }
        Ok(())
    }

    fn save(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        self.viewer.write(&mut bytes);
        let size = bytes.len() as u32;
        [&size.to_le_bytes()[..], &bytes, &self.world.save(), &vec![0; self.ballast]].concat()
    }

    fn restore(&mut self, bytes: &[u8]) -> Result<(), String> {
        let (size, rest) = bytes.split_first_chunk().ok_or("short")?;
        let (viewer, world) = rest.split_at_checked(u32::from_le_bytes(*size) as usize).ok_or("short")?;
        let viewer = Viewer::read(viewer).map_err(|e| e.to_string())?;
        self.world.restore(world).map_err(|e| e.to_string())?;
        self.viewer = viewer;
        Ok(())
    }
}

struct Node {
    session: Option<FacetSession>,
    frozen_until: Duration,
    shown: Vec<(u64, FrameAck)>,
    lives: u64,
}

/// A server and its nodes. Inputs of user 0 come at random times, by a sequence that the seed gives.
struct Run {
    now: Duration,
    net: SimulatedNetwork,
    server: ServerSession,
    simulation: Pushed,
    nodes: Vec<Node>,
    events: Vec<ServerEvent>,
    /// Hash of each frame of the server.
    hashes: BTreeMap<u64, Hash>,
    /// Bytes of STEP messages, and their largest.
    step_bytes: Vec<usize>,
    worlds_sent: usize,
    next_frame: Duration,
    inputs: u64,
    /// Facets that get poses.
    mirrors: Vec<usize>,
}

impl Run {
    fn new(seed: u64, conditions: NetworkConditions, nodes: usize, mirrors: &[usize]) -> Run {
        let slots = (0..nodes).map(|k| FacetSlot { name: format!("facet {k}"), critical: true }).collect();
        let mut options = ServerOptions::new(1, SCENE, slots);
        (options.resend_interval, options.compute) = (Some(5 * MS), Some(CONSTANTS));
        let node = |_| Node { session: None, frozen_until: Duration::ZERO, shown: Vec::new(), lives: 0 };
        let mut run = Run {
            now: Duration::ZERO,
            net: SimulatedNetwork::new(seed, conditions),
            server: ServerSession::new(options, &scene()),
            simulation: Pushed::new(),
            nodes: (0..nodes).map(node).collect(),
            events: Vec::new(),
            hashes: BTreeMap::new(),
            step_bytes: Vec::new(),
            worlds_sent: 0,
            next_frame: Duration::ZERO,
            inputs: seed,
            mirrors: mirrors.to_vec(),
        };
        (0..nodes).for_each(|k| run.start(k, None));
        run
    }

    /// Starts a node, which may be a wrong one.
    fn start(&mut self, k: usize, wrong_after: Option<(u64, &'static str)>) {
        let node = &mut self.nodes[k];
        node.lives += 1;
        let scene_hash = if self.mirrors.contains(&k) { SCENE } else { CONSTANTS };
        let mut options = FacetOptions::new(&format!("facet {k}"), scene_hash, (k as u64) << 32 | node.lives << 16);
        options.join_interval = 20 * MS;
        node.session = Some(match self.mirrors.contains(&k) {
            true => FacetSession::new(options, scene()),
            false => FacetSession::computing(options, Box::new(Pushed { wrong_after, ..Pushed::new() })),
        });
    }

    fn frame_inputs(&mut self) -> Vec<(FacetNumber, Input)> {
        self.inputs = self.inputs.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let random = self.inputs >> 33;
        let head = Some(Pose::translation(0.1 * (random % 7) as f64, -0.1, 0.02));
        let input =
            |sequence| Input { sequence, user: 0, head, wand: None, hands: [None; 2], buttons: 1, keys: vec![4, 22] };
        (0..random % 3).map(|n| (n as u16, input(random + n))).collect()
    }

    fn tick(&mut self) {
        self.now += Duration::from_micros(200);
        while let Some((to, bytes)) = self.net.receive(self.now) {
            match to {
                Destination::Server(k) => self.server.on_event(self.now, k, LinkEvent::Message, &bytes),
                Destination::Facet(k) => {
                    let node = &mut self.nodes[k as usize];
                    if let Some(session) = node.session.as_mut().filter(|_| self.now >= node.frozen_until) {
                        session.on_event(self.now, LinkEvent::Message, bytes.into());
                    }
                }
            }
        }
        self.server.advance(self.now);
        let begun = self.server.frame().is_some();
        if self.server.is_idle() && self.now >= self.next_frame && (begun || self.server.all_critical_joined()) {
            if begun {
                let frame = FrameInputs { steps: 1, inputs: self.frame_inputs() };
                self.server.send_inputs(self.now, frame.clone());
                self.simulation.advance(&frame).unwrap();
            }
            let frame = self.server.publish_simulation(self.now, &self.simulation).unwrap();
            self.hashes.insert(frame, StateHashes::of(frame, &self.simulation.world, &self.simulation.viewer).hash);
            self.next_frame = self.now + 16 * MS;
        }
        self.events.extend(self.server.events());
        for out in self.server.outgoing() {
            let (header, _) = open(&out.message).unwrap();
            self.step_bytes.extend((header.kind == MessageKind::Step).then_some(out.message.len()));
            self.worlds_sent += usize::from(header.kind == MessageKind::World);
            out.to.iter().for_each(|&k| self.net.send(self.now, Destination::Facet(k), &out.message));
        }
        self.server.closing();
        (0..self.nodes.len()).for_each(|k| self.act(k));
    }

    fn act(&mut self, k: usize) {
        let node = &mut self.nodes[k];
        let Some(session) = node.session.as_mut().filter(|_| self.now >= node.frozen_until) else { return };
        session.advance(self.now);
        match session.task() {
            Task::Draw if session.begin().is_some() => session.drawn(self.now, [k as u8; 16]),
            Task::Present(_) => {
                session.presented(self.now);
                node.shown.extend(session.shown());
            }
            _ => {}
        }
        session.outgoing().iter().for_each(|(_, bytes)| self.net.send(self.now, Destination::Server(k as u16), bytes));
        session.closing();
    }

    fn until(&mut self, time: Duration, mut holds: impl FnMut(&Run) -> bool) -> bool {
        let until = self.now + time;
        while self.now < until && !holds(self) {
            self.tick();
        }
        holds(self)
    }

    fn run(&mut self, time: Duration) {
        self.until(time, |_| false);
    }

    fn is_in_step(&self, k: u16) -> bool {
        self.server.membership(k) == Membership::InStep
    }

    /// Asserts that every frame that a node showed is the server's, bit by bit.
    fn assert_same(&self, k: usize) {
        assert!(!self.nodes[k].shown.is_empty());
        for (frame, done) in &self.nodes[k].shown {
            assert_eq!(self.hashes.get(frame), Some(&done.hash), "frame {frame} on node {k}");
        }
    }

    fn differences(&self) -> Vec<(FacetNumber, u64, String)> {
        let of = |event: &ServerEvent| match event {
            ServerEvent::Differs(facet, frame, what) => Some((*facet, *frame, what.clone())),
            _ => None,
        };
        self.events.iter().filter_map(of).collect()
    }
}

const STORM: NetworkConditions = NetworkConditions {
    loss: 0.05,
    duplication: 0.02,
    reordering: 0.1,
    corruption: 0.01,
    delay: [Duration::from_micros(100), Duration::from_millis(1)],
};

fn frames(short: u64, long: u64) -> u64 {
    if std::env::var_os("TUMBLE_SLOW").is_some() { long } else { short }
}

#[test]
fn in_a_storm_all_nodes_step_to_the_same_bits_full_length() {
    let mut run = Run::new(3, STORM, 8, &[]);
    let last = frames(300, 108_000);
    assert!(run.until(Duration::from_secs(20 + last / 10), |run| run.server.frame() >= Some(last)));
    run.run(100 * MS);
    for k in 0..8 {
        run.assert_same(k);
        let numbers: Vec<u64> = run.nodes[k].shown.iter().map(|(frame, _)| *frame).collect();
        assert!(numbers.starts_with(&(0..last).collect::<Vec<_>>()), "each frame once and in order");
        let (counts, _) = run.server.counts(k as u16);
        assert_eq!((counts.mismatched, counts.late, counts.dropped), (0, 0, 0));
    }
    assert!(run.net.stats().lost > last && run.differences().is_empty());
    // the largest has two inputs: 128 header, 22 payload, 2 * (4 + 16 + 56 + 4)
    assert_eq!(run.step_bytes.iter().max(), Some(&(HEADER_BYTES + 22 + 2 * 80)));
}

#[test]
fn a_world_is_sent_to_nodes_that_join_and_to_no_other() {
    let mut run = Run::new(5, NetworkConditions::PERFECT, 3, &[]);
    assert!(run.until(Duration::from_secs(5), |run| run.server.frame() >= Some(60)));
    assert_eq!(run.worlds_sent, 3);
    run.nodes[1].session = None;
    run.run(Duration::from_secs(4));
    run.start(1, None);
    assert!(run.until(Duration::from_secs(1), |run| run.is_in_step(1)), "a node that starts late");
    assert_eq!(run.worlds_sent, 4);
    run.run(Duration::from_secs(1));
    (0..3).for_each(|k| run.assert_same(k));
}

#[test]
fn nodes_that_are_killed_or_freeze_in_a_storm_catch_up() {
    let mut run = Run::new(7, STORM, 4, &[]);
    assert!(run.until(Duration::from_secs(5), |run| run.server.frame() >= Some(30)));
    for round in 0..6 {
        let (killed, frozen) = (round % 4, (round + 1) % 4);
        run.nodes[killed].session = None;
        run.nodes[frozen].frozen_until = run.now + Duration::from_millis(300 + 900 * round as u64);
        run.run(Duration::from_millis(500));
        run.start(killed, None);
        run.run(run.nodes[frozen].frozen_until.saturating_sub(run.now));
        let back = run.until(Duration::from_secs(3), |run| (0..4).all(|k| run.is_in_step(k)));
        assert!(back, "round {round}");
    }
    run.run(Duration::from_secs(1));
    (0..4).for_each(|k| run.assert_same(k));
    assert!(run.differences().is_empty());
}

#[test]
fn a_wrong_node_is_named_with_its_first_object_and_is_right_again() {
    for conditions in [NetworkConditions::PERFECT, STORM] {
        let mut run = Run::new(11, conditions, 3, &[]);
        run.start(1, Some((40, "ball 2")));
        assert!(run.until(Duration::from_secs(10), |run| run.server.frame() >= Some(100)));
        // frame 0 is the world before the first step
        assert_eq!(run.differences().first(), Some(&(1, 40, "'ball 2'".to_owned())));
        let wrong: Vec<u64> =
            run.nodes[1].shown.iter().filter(|(frame, done)| run.hashes[frame] != done.hash).map(|(f, _)| *f).collect();
        assert_eq!(wrong, [40], "the frame after has the world of the server");
        assert_eq!(run.server.counts(1).0.mismatched, 1);
        assert!(run.nodes[1].shown.iter().any(|(frame, _)| *frame == 99));
        [0, 2].into_iter().for_each(|k| run.assert_same(k));
        assert_eq!((run.server.counts(0).0.late, run.server.counts(2).0.late), (0, 0), "the others do not stall");
    }
}

#[test]
fn nodes_that_cannot_compute_get_poses_in_the_same_run() {
    let mut run = Run::new(13, STORM, 3, &[1]);
    assert!(run.until(Duration::from_secs(10), |run| run.server.frame() >= Some(100)));
    [0, 2].into_iter().for_each(|k| run.assert_same(k));
    assert!(run.nodes[1].shown.len() >= 99);
    (0..3).for_each(|k| assert_eq!(run.server.counts(k).0.mismatched, 0));
}

#[test]
fn a_node_with_other_constants_is_refused_with_both_hashes() {
    let mut run = Run::new(17, NetworkConditions::PERFECT, 2, &[]);
    let options = FacetOptions::new("facet 1", SCENE, 99);
    run.nodes[1].session = Some(FacetSession::computing(options, Box::new(Pushed::new())));
    run.run(Duration::from_secs(1));
    let why = run.events.iter().find_map(|event| match event {
        ServerEvent::Refused(1, why) => Some(why.clone()),
        _ => None,
    });
    let why = why.unwrap();
    assert!(why.contains(&"09".repeat(32)) && why.contains(&"07".repeat(32)), "{why}");
    assert!(matches!(run.nodes[1].session.as_ref().unwrap().task(), Task::Ended(EndReason::Refused(_))));
}

/// A world that is too large to be sent refuses the facet that needs it, and ends no show.
#[test]
fn a_world_of_too_many_bytes_ends_no_show() {
    let mut run = Run::new(19, NetworkConditions::PERFECT, 2, &[]);
    assert!(run.until(Duration::from_secs(5), |run| run.server.frame() >= Some(20)));
    run.nodes[1].session = None;
    run.run(Duration::from_secs(3));
    run.simulation.ballast = 17 << 20;
    run.start(1, None);
    run.run(Duration::from_secs(1));
    assert!(matches!(run.nodes[1].session.as_ref().unwrap().task(), Task::Ended(EndReason::Refused(_))));
    let at = run.server.frame().unwrap();
    assert!(run.until(Duration::from_secs(2), |run| run.server.frame() >= Some(at + 60)));
    run.assert_same(0);
    assert!(run.is_in_step(0));
}

/// While a large world is on its way over a reliable link, a node that asks to join again and again
/// gets no second one, and then catches up with all frames since.
#[test]
fn one_world_at_a_time_is_on_its_way() {
    let slow = NetworkConditions { delay: [Duration::from_millis(1500); 2], ..NetworkConditions::PERFECT };
    let mut run = Run::new(23, slow, 1, &[]);
    run.server = ServerSession::new(
        ServerOptions {
            compute: Some(CONSTANTS),
            drop_timeout: Duration::from_secs(20),
            ready_timeout: 20 * MS,
            ..ServerOptions::new(1, SCENE, vec![FacetSlot { name: "facet 0".into(), critical: false }])
        },
        &scene(),
    );
    run.run(Duration::from_secs(7));
    assert_eq!(run.worlds_sent, 1);
    let (last, newest) = (run.nodes[0].shown.last().unwrap().0, run.server.frame().unwrap());
    // a frame takes at least 16 ms, and is 1.5 s on its way
    assert!(newest > 200 && newest - last < 1500 / 16 + 30, "frame {last} of {newest}");
    run.assert_same(0);
}

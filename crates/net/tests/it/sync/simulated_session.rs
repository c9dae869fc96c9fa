//! A server and its facets over a simulated network with a simulated clock: the same seed gives the
//! same run.

use std::collections::BTreeMap;
use std::time::Duration;
use tumble_core::collide::{Pose, Shape};
use tumble_core::{RigidBody, Settings, World};
use tumble_net::sync::messages::FrameAck;
use tumble_net::sync::simulated_network::{Destination, NetworkConditions, SimulatedNetwork};
use tumble_net::sync::transport::LinkEvent;
use tumble_net::sync::*;

pub const SCENE: [u8; 32] = [7; 32];
pub const MS: Duration = Duration::from_millis(1);

/// Spheres that fall on a floor, a box that slides, a fixed post.
pub fn scene() -> World {
    let mut world = World::new(Settings::default().with_dt(1.0 / 60.0)).unwrap();
    world.add_static(RigidBody::fixed(Shape::half_space()).with_name("ground")).unwrap();
    world
        .add_static(
            RigidBody::fixed(Shape::capsule(0.1, 2.0).unwrap())
                .with_name("post")
                .with_pose(Pose::translation(3.0, 0.0, 1.0)),
        )
        .unwrap();
    for k in 0..5 {
        let ball = RigidBody::new(Shape::sphere(0.1).unwrap()).with_name(format!("ball {k}")).with_mass(1.0);
        world.add(ball.with_pose(Pose::translation(0.3 * k as f64, 0.0, 1.0 + 0.2 * k as f64))).unwrap();
    }
    let crate_ = RigidBody::new(Shape::cuboid([0.4, 0.4, 0.4].into()).unwrap()).with_name("crate").with_mass(2.0);
    let crate_ = world.add(crate_.with_pose(Pose::translation(0.0, 2.0, 0.2))).unwrap();
    world.set_velocity(crate_, [1.0, 0.0, 0.0].into(), [0.0, 0.0, 3.0].into()).unwrap();
    world
}

pub fn viewer(frame: u64) -> Viewer {
    let head = Pose::translation(0.0, 0.01 * (frame % 100) as f64, 1.7);
    Viewer { users: vec![User { head, interpupillary_m: 0.064, input: frame }], ..Viewer::default() }
}

/// A facet that may be dead or frozen.
pub struct Actor {
    pub session: Option<FacetSession>,
    pub frozen_until: Duration,
    /// End of the drawing of the frame it has begun.
    pub busy_until: Duration,
    pub drawing: bool,
    pub takes: Duration,
    /// Time from the request to show a frame until it is shown.
    pub shows_after: Duration,
    show_requested: Option<Duration>,
    /// Offset of its clock.
    pub clock: Duration,
    /// Frames shown, with the acknowledgements, over all its lives.
    pub shown: Vec<(u64, FrameAck)>,
    /// Times of these frames, by the stage's clock.
    pub shown_at: Vec<Duration>,
    born: u64,
}

pub struct Stage {
    pub now: Duration,
    pub net: SimulatedNetwork,
    pub world: World,
    pub server: Option<ServerSession>,
    pub options: ServerOptions,
    pub facets: Vec<Actor>,
    pub events: Vec<ServerEvent>,
    /// Expected hash of each frame, from an independent mirror.
    pub expected: BTreeMap<u64, [u8; 16]>,
    pub base: World,
    pub every: Duration,
    /// Whether the server is woken by messages and deadlines only, and not at every tick.
    pub sleeps: bool,
    next_frame: Duration,
}

impl Stage {
    pub fn new(seed: u64, conditions: NetworkConditions, facets: usize, mode: SyncMode) -> Stage {
        let slots = (0..facets).map(|k| FacetSlot { name: format!("facet {k}"), critical: true }).collect();
        let mut options = ServerOptions::new(1, SCENE, slots);
        (options.mode, options.resend_interval) = (mode, Some(5 * MS));
        let actor = |_| Actor {
            session: None,
            frozen_until: Duration::ZERO,
            busy_until: Duration::ZERO,
            drawing: false,
            takes: Duration::from_millis(2),
            shows_after: Duration::ZERO,
            show_requested: None,
            clock: Duration::ZERO,
            shown: Vec::new(),
            shown_at: Vec::new(),
            born: 0,
        };
        let base = scene();
        let mut stage = Stage {
            now: Duration::ZERO,
            net: SimulatedNetwork::new(seed, conditions),
            world: base.fork(),
            server: Some(ServerSession::new(options.clone(), &base)),
            options,
            facets: (0..facets).map(actor).collect(),
            events: Vec::new(),
            expected: BTreeMap::new(),
            base,
            every: 16 * MS,
            sleeps: false,
            next_frame: Duration::ZERO,
        };
        (0..facets).for_each(|k| stage.start_facet(k));
        stage
    }

    pub fn start_facet(&mut self, k: usize) {
        let actor = &mut self.facets[k];
        actor.born += 1;
        let mut options = FacetOptions::new(&format!("facet {k}"), SCENE, (k as u64) << 32 | actor.born << 16);
        (options.mode, options.join_interval) = (self.options.mode, 20 * MS);
        actor.session = Some(FacetSession::new(options, scene()));
        (actor.drawing, actor.frozen_until) = (false, Duration::ZERO);
    }

    pub fn kill_facet(&mut self, k: usize) {
        self.facets[k].session = None;
    }

    pub fn start_server(&mut self) {
        self.options.run += 1;
        self.options.first_frame = self.options.first_frame.wrapping_add(1_000_000);
        self.server = Some(ServerSession::new(self.options.clone(), &self.base));
    }

    /// Runs for `time`, in ticks of a tenth of a millisecond.
    pub fn run(&mut self, time: Duration) {
        let until = self.now + time;
        while self.now < until {
            self.tick();
        }
    }

    /// Runs until `holds` does, for at most `time`; returns whether it does.
    pub fn until(&mut self, time: Duration, mut holds: impl FnMut(&Stage) -> bool) -> bool {
        let until = self.now + time;
        while self.now < until && !holds(self) {
            self.tick();
        }
        holds(self)
    }

    pub fn tick(&mut self) {
        self.now += Duration::from_micros(100);
        while let Some((to, bytes)) = self.net.receive(self.now) {
            match to {
                Destination::Server(k) => {
                    if let Some(server) = &mut self.server {
                        server.on_event(self.now, k, LinkEvent::Message, &bytes);
                    }
                }
                // messages to a frozen process would wait in its socket; here they are lost, which
                // is worse
                Destination::Facet(k) if self.now >= self.facets[k as usize].frozen_until => {
                    let actor = &mut self.facets[k as usize];
                    if let Some(facet) = &mut actor.session {
                        facet.on_event(self.now + actor.clock, LinkEvent::Message, bytes.into());
                    }
                }
                Destination::Facet(_) => {}
            }
        }
        self.serve();
        (0..self.facets.len()).for_each(|k| self.act(k));
    }

    fn serve(&mut self) {
        let Some(server) = &mut self.server else { return };
        if !self.sleeps || server.wake().is_some_and(|wake| self.now >= wake) {
            server.advance(self.now);
        }
        if server.is_idle() && self.now >= self.next_frame && (server.all_critical_joined() || server.frame().is_some())
        {
            self.world.step().unwrap();
            let viewer = viewer(self.world.frame());
            let frame = server.publish(self.now, &self.world, &viewer).unwrap();
            self.expected.insert(frame, expected(&self.base, &self.world, &viewer, frame));
            self.next_frame = self.now + self.every;
        }
        self.events.extend(server.events());
        for out in server.outgoing() {
            out.to.iter().for_each(|&k| self.net.send(self.now, Destination::Facet(k), &out.message));
        }
        server.closing();
    }

    fn act(&mut self, k: usize) {
        let actor = &mut self.facets[k];
        let Some(session) = actor.session.as_mut().filter(|_| self.now >= actor.frozen_until) else { return };
        let there = self.now + actor.clock;
        session.advance(there);
        match session.task() {
            Task::Draw if !actor.drawing => {
                (actor.drawing, actor.busy_until) = (session.begin().is_some(), self.now + actor.takes)
            }
            Task::Present(_) if self.now >= *actor.show_requested.get_or_insert(self.now) + actor.shows_after => {
                session.presented(there);
                actor.shown.extend(session.shown());
                actor.shown_at.push(self.now);
                actor.show_requested = None;
            }
            _ => {}
        }
        if actor.drawing && self.now >= actor.busy_until {
            session.drawn(there, [k as u8; 16]);
            actor.drawing = false;
        }
        session.outgoing().iter().for_each(|(_, bytes)| self.net.send(self.now, Destination::Server(k as u16), bytes));
        session.closing();
    }

    pub fn numbers(&self, k: usize) -> Vec<u64> {
        self.facets[k].shown.iter().map(|(frame, _)| *frame).collect()
    }

    /// Asserts that every frame shown has the content of the server's frame.
    pub fn assert_true(&self) {
        for (k, actor) in self.facets.iter().enumerate() {
            for (frame, done) in &actor.shown {
                assert_eq!(self.expected.get(frame), Some(&done.hash), "frame {frame} on facet {k}");
            }
        }
    }
}

/// Returns the hash of a frame by another way than the server's: by a new mirror for each frame,
/// without a network.
pub fn expected(base: &World, world: &World, viewer: &Viewer, frame: u64) -> [u8; 16] {
    let mut publisher = Publisher::new(base, false, 100);
    let published = publisher.publish(world, viewer, frame).unwrap();
    let mut mirror = Mirror::new(scene());
    mirror.apply_snapshot(&publisher.snapshot()).unwrap();
    mirror.apply_state(frame, world.time(), &published.state).unwrap();
    assert_eq!(mirror.hash(), published.hash, "the mirror shows what was published");
    published.hash
}

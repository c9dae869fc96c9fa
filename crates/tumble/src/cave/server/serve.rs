//! The server's process: simulates, publishes, keeps real time, and serves facets, recording and
//! users.

use super::facet_processes::{FacetProcesses, ProcessStatus, slots, transport_kind};
use super::input_devices::InputDevices;
use super::live_viewers::LiveViewers;
use super::outputs::{self, Recording};
use super::summary::{Metrics, Status, Summary, refused, unknown_peers_line};
use super::users::Users;
use crate::atomic_file::write_file;
use crate::cave::address::ServerAddress;
use crate::cave::args::{CaveOptions, ServeOptions, TransportKind};
use crate::cave::endpoints::{ServerEndpoint, idle_timeout, key, timing};
use crate::cave::lock::{RunInfo, RunLock};
use crate::cave::replay::frames::Replay;
use crate::cave::run_setup::{Role, RunSetup};
use crate::cave::signals::Signals;
use crate::failure::Failure;
use std::net::{Ipv4Addr, SocketAddr};
use std::path::Path;
use std::time::{Duration, Instant};
use tumble::dynamics::World;
use tumble::net::record::RecorderOptions;
use tumble::net::sync::cpu_latency::CpuLatencyRequest;
use tumble::net::sync::shm::{ShmServer, clean_up};
use tumble::net::sync::transport::FacetNumber;
use tumble::net::sync::udp::{Entropy, UdpServer};
use tumble::net::sync::{
    FacetSlot, Input, MAX_CONTACTS, Server, ServerEvent, ServerOptions, SessionError, SessionRecorder, SyncMode,
};
use tumble::scene::cave::{Cave, Mode};

/// Interval at which signals and processes are polled.
const POLL_INTERVAL: Duration = Duration::from_millis(20);

/// Runs a scene in a cave, or replays a recording of one. With a launcher's options it also runs
/// the facets of this machine.
pub fn run(options: &ServeOptions, launcher: Option<&CaveOptions>, recording: Option<&Path>) -> Result<(), Failure> {
    let signals = Signals::watch()?;
    let setup = RunSetup::load(options.scene.load()?, &options.surroundings, Role::Server)?;
    let say = |what: &str| (!options.quiet).then(|| eprintln!("{what}"));
    setup.notes.iter().for_each(|note| _ = say(note));
    outputs::check(options, &setup.cave)?;
    let replay = recording.map(|path| Replay::open(path, setup.hash)).transpose()?;
    let key = key(&setup.cave)?;
    let number = Entropy::system().map_err(|e| Failure::run("the run", e))?.next_u64();
    let name = format!("{number:016x}");
    if signals.stop_requested() {
        return Ok(());
    }
    let mut run = RunInfo::here(&setup.scene.file, &setup.cave.file);
    let mut lock = RunLock::take(&setup, &run, options.replace)?;
    signals.remove_at_the_end(lock.path().to_owned());
    let slots = slots(&setup.cave, launcher.is_some_and(|l| l.preview));
    let count = slots.len() as u16;
    let failed = |e| Failure::run("the server", e);
    let (end, address) = match transport_kind(options, &setup.cave) {
        TransportKind::SharedMemory => {
            let server = ShmServer::new(&name, count).map_err(failed)?.with_idle_timeout(idle_timeout(&setup.cave));
            (ServerEndpoint::Shm(Box::new(server)), ServerAddress::Memory(name))
        }
        TransportKind::Udp => {
            let server =
                UdpServer::bind(listen(options, &setup.cave), count, key, timing(&setup.cave)).map_err(failed)?;
            let address = ServerAddress::Udp(server.address().map_err(failed)?);
            say(&format!("server: {}", server.describe()));
            (ServerEndpoint::Udp(Box::new(server)), address)
        }
    };
    // from here on facets can join
    run.address = Some(address.clone());
    lock.write(&run)?;
    let shared_memory = matches!(end, ServerEndpoint::Shm(_));
    let server = Server::new(end, session_options(options, &setup, number, &slots), &setup.world);
    let mut processes = FacetProcesses::start(options, &setup.cave, launcher, &address, &signals)?;
    let _awake = options
        .stay_awake
        .then(|| CpuLatencyRequest::ask().inspect_err(|why| _ = say(&format!("the cores may fall asleep: {why}"))));
    let outcome = RunLoop::new(options, setup, server, slots, &signals, replay).and_then(|mut run_loop| {
        let outcome = run_loop.run_frames(&mut processes);
        let ended = run_loop.end(&mut processes);
        outcome.and(ended)
    });
    drop(processes);
    if shared_memory {
        // leftovers of killed facets
        clean_up().map_err(|e| Failure::run("cleaning up", e))?;
    }
    drop(lock);
    outcome
}

fn listen(options: &ServeOptions, cave: &Cave) -> SocketAddr {
    let remote = cave.nodes.iter().any(|n| !n.is_local());
    let default = if remote { (Ipv4Addr::UNSPECIFIED, cave.sync.port) } else { (Ipv4Addr::LOCALHOST, 0) };
    options.listen.unwrap_or(default.into())
}

/// Returns the timeout for facets to join.
fn connect_timeout(options: &ServeOptions, cave: &Cave) -> Duration {
    options.connect_timeout.map_or(Duration::from_millis(cave.sync.connect_timeout_ms.into()), Duration::from_secs_f64)
}

/// Returns the session's options from the cave file.
fn session_options(options: &ServeOptions, setup: &RunSetup, run: u64, slots: &[FacetSlot]) -> ServerOptions {
    let (sync, wait) = (&setup.cave.sync, connect_timeout(options, &setup.cave));
    let ms = |ms: u32| Duration::from_millis(ms.into());
    ServerOptions {
        mode: if sync.mode == Mode::Lockstep { SyncMode::Lockstep } else { SyncMode::Latest },
        ready_timeout: if options.no_realtime { wait } else { ms(sync.ready_timeout_ms) },
        first_frame_timeout: wait,
        drop_timeout: ms(sync.drop_timeout_ms),
        history: sync.history_frames as usize,
        contacts: if options.contacts { MAX_CONTACTS } else { 0 },
        ..ServerOptions::new(run, setup.join_hash, slots.to_vec())
    }
}

struct RunLoop<'a> {
    options: &'a ServeOptions,
    signals: &'a Signals,
    server: Server<ServerEndpoint>,
    world: World,
    users: Users,
    input_devices: InputDevices,
    live_viewers: LiveViewers,
    recorder: Option<(SessionRecorder, Recording)>,
    recorded: bool,
    cave: Cave,
    scene: String,
    duration: Option<f64>,
    slots: Vec<FacetSlot>,
    metrics: Metrics,
    status: Status,
    /// The recording to replay instead of simulating.
    replay: Option<Replay>,
    time_s: f64,
    began: Instant,
    behind_s: f64,
    frames: u64,
}

impl<'a> RunLoop<'a> {
    fn new(
        options: &'a ServeOptions,
        setup: RunSetup,
        server: Server<ServerEndpoint>,
        slots: Vec<FacetSlot>,
        signals: &'a Signals,
        replay: Option<Replay>,
    ) -> Result<RunLoop<'a>, Failure> {
        let viewer = setup.viewer()?;
        let RunSetup { scene, cave, mut world, hash, .. } = setup;
        let users = Users::new(viewer, &cave, &mut world, options.user_colliders)?;
        let input_devices = InputDevices::open(options, &cave, hash, replay.is_none())?;
        let live_viewers = LiveViewers::open(options)?;
        let from_cave = cave.recording.as_ref().filter(|_| replay.is_none()).map(|r| (r.file.clone(), r.every_frames));
        let recorder = options.record.clone().map(|file| (file, 1)).or(from_cave).map(|(file, every)| {
            let recording = Recording::new(file)?;
            if !recording.has_begun() {
                signals.remove_at_the_end(recording.begins_at().to_owned());
            }
            let recorder = SessionRecorder::create(
                recording.begins_at(),
                &scene.file,
                hash,
                &world,
                every,
                RecorderOptions::default(),
            );
            recorder.map(|r| (r, recording)).map_err(|e| Failure::run("recording", e))
        });
        Ok(RunLoop {
            options,
            signals,
            server,
            world,
            users,
            input_devices,
            live_viewers,
            recorder: recorder.transpose()?,
            recorded: false,
            cave,
            scene: scene.file,
            duration: options.duration,
            metrics: Metrics::new(slots.len()),
            slots,
            status: Status::new(options.quiet),
            replay,
            time_s: 0.0,
            began: Instant::now(),
            behind_s: 0.0,
            frames: 0,
        })
    }

    /// Runs from the first join to the last frame.
    fn run_frames(&mut self, processes: &mut FacetProcesses) -> Result<(), Failure> {
        if !self.wait_for_facets(processes)? {
            return Ok(());
        }
        if let Some((_, recording)) = &mut self.recorder {
            recording.begin()?;
        }
        let step_s = self.world.settings().dt;
        let steps = ((1.0 / (self.options.fps * step_s) + 1e-9).floor() as u32).max(1);
        let dt = self.frame_length(step_s * f64::from(steps));
        let last = self.duration.map(|s| (s / dt).round() as u64);
        self.began = Instant::now();
        let mut due = self.server.now();
        for frame in 0.. {
            let begin = Instant::now();
            if !self.publish(frame, steps, processes)? {
                return Ok(());
            }
            if last.map_or(self.input_devices.over(), |last| last == frame)
                || self.signals.stop_requested()
                || !self.check_processes(processes)?
            {
                return Ok(());
            }
            if !self.options.no_realtime {
                due = self.wait_for_next_frame(due, dt)?;
            }
            self.metrics.frame.add(begin.elapsed().as_secs_f64(), frame, self.time_s);
        }
        Ok(())
    }

    /// Waits for the critical facets. Returns `false` if the end was requested meanwhile.
    fn wait_for_facets(&mut self, processes: &mut FacetProcesses) -> Result<bool, Failure> {
        let wait = connect_timeout(self.options, &self.cave);
        let until = self.server.now() + wait;
        while !self.server.session().all_critical_joined() {
            if self.signals.stop_requested() {
                return Ok(false);
            }
            let now = self.server.now();
            if now > until {
                let missing_facets = self.server.session().missing_facets().into_iter().map(str::to_owned).collect();
                return Err(Failure::run("the start", SessionError::Missing(missing_facets, wait)));
            }
            self.server.idle_until(now + POLL_INTERVAL).map_err(failed)?;
            self.take_events(0.0);
            processes.watch(true)?;
        }
        Ok(true)
    }

    /// Simulates the steps of one frame.
    fn simulate(&mut self, frame: u64, steps: u32) -> Result<(), Failure> {
        let (clock, dt) = (Instant::now(), self.world.settings().dt);
        for _ in 0..steps {
            self.users.act(&mut self.world, dt)?;
            self.world.step().map_err(|e| Failure::run("the simulation stopped", e))?;
        }
        self.metrics.step.add(clock.elapsed().as_secs_f64(), frame, self.world.time());
        Ok(())
    }

    /// Returns the frame length, s: of a recording, or the simulated one.
    fn frame_length(&self, simulated: f64) -> f64 {
        self.replay.as_ref().and_then(Replay::frame_length).unwrap_or(simulated)
    }

    /// Waits until the frame is shown. A facet whose process ends meanwhile is no longer awaited,
    /// and is restarted.
    fn wait(&mut self, processes: &mut FacetProcesses) -> Result<(), Failure> {
        while !self.server.shown(POLL_INTERVAL).map_err(failed)?
            && self.check_processes(processes)?
            && !self.signals.stop_requested()
        {}
        Ok(())
    }

    /// Polls the facets' processes. Returns `false` if all have ended on request of their users.
    fn check_processes(&mut self, processes: &mut FacetProcesses) -> Result<bool, Failure> {
        let look = processes.watch(false)?;
        look.ended.into_iter().try_for_each(|facet| self.server.facet_exited(facet)).map_err(failed)?;
        match look.processes {
            ProcessStatus::Running => Ok(true),
            ProcessStatus::AllLeft => Ok(false),
            ProcessStatus::AllFailed => Err(Failure::run("the run", "no facet is left")),
        }
    }

    /// Publishes the next frame and waits until it is shown. Returns `false` at the end of a
    /// recording.
    fn publish(&mut self, frame: u64, steps: u32, processes: &mut FacetProcesses) -> Result<bool, Failure> {
        let recorded = self.replay.as_mut().map(Replay::next).transpose()?;
        if recorded.is_none() && frame > 0 {
            // inputs since the last frame take effect in this one
            self.take_events(self.time_s);
            self.input_devices.tracker_inputs().into_iter().for_each(|(from, input)| self.take_input(from, input));
            self.simulate(frame, steps)?;
        }
        let clock = Instant::now();
        match recorded {
            Some(None) => return Ok(false),
            Some(Some(recorded)) => {
                self.server.begin_recorded(&recorded).map_err(failed)?;
                self.wait(processes)?;
                self.time_s = recorded.time_s;
            }
            None => {
                self.server.begin(&self.world, &self.users.viewer).map_err(failed)?;
                self.wait(processes)?;
                self.time_s = self.world.time();
                self.live_viewers.frame(&self.world);
            }
        }
        self.metrics.barrier.add(clock.elapsed().as_secs_f64(), frame, self.time_s);
        self.frames += 1;
        if let Some((recorder, _)) = &mut self.recorder
            && let Some(recorded) = self.server.session().recorded(!self.recorded)
        {
            recorder.frame(&self.world, recorded).map_err(|e| Failure::run("recording", e))?;
            self.recorded = true;
        }
        let session = self.server.session();
        let replayed_input = self.input_devices.after(|| session.recorded(false))?;
        replayed_input.into_iter().for_each(|(from, input)| self.take_input(from, input));
        self.take_events(self.time_s);
        self.status.at(&self.server, &self.slots, &self.metrics, frame, self.time_s);
        Ok(true)
    }

    /// Waits until the next frame is due and returns when that is. A delay of more than a frame is
    /// dropped: time then runs slower, and no frame is skipped.
    fn wait_for_next_frame(&mut self, due: Duration, dt: f64) -> Result<Duration, Failure> {
        let (next, now) = (due + Duration::from_secs_f64(dt), self.server.now());
        let late = now.saturating_sub(next);
        if late > Duration::from_secs_f64(dt) {
            self.behind_s += late.as_secs_f64();
            return Ok(now);
        }
        while self.server.now() < next && !self.signals.stop_requested() {
            self.server.idle_until(next.min(self.server.now() + POLL_INTERVAL)).map_err(failed)?;
        }
        Ok(next)
    }

    fn take_events(&mut self, time_s: f64) {
        let mut events = self.server.events();
        events.retain(|event| self.input_devices.live() || !matches!(event, ServerEvent::Input(..)));
        if let Some((recorder, _)) = &mut self.recorder {
            recorder.events(&events);
        }
        for event in events {
            self.metrics.take(&event, time_s);
            self.replay.iter_mut().for_each(|replay| replay.take(&event));
            let slot = |k: &u16| self.slots.get(*k as usize).map_or("", |s| s.name.as_str());
            let said = match &event {
                ServerEvent::Joined(k) => Some(format!("facet {} joined", slot(k))),
                ServerEvent::Refused(k, why) => Some(format!("facet {} was refused: {why}", slot(k))),
                ServerEvent::Gone(k, true) => Some(format!("facet {} left", slot(k))),
                ServerEvent::Gone(k, false) => Some(format!("facet {} was dropped; the others continue", slot(k))),
                ServerEvent::Late(k, frame) => Some(format!("facet {} is late with frame {frame}", slot(k))),
                ServerEvent::Presented(k, frame, _, false) => {
                    Some(format!("facet {} drew frame {frame} with another state than was sent", slot(k)))
                }
                _ => None,
            };
            if let (Some(said), false) = (said, self.options.quiet) {
                eprintln!("{said}");
                self.status.interrupted();
            }
            if let ServerEvent::Input(from, input) = event {
                self.users.take(from, input, time_s);
            }
        }
    }

    /// Takes an input of a device other than a facet's window.
    fn take_input(&mut self, from: FacetNumber, input: Input) {
        self.server.note_input(input.user, input.sequence);
        let event = ServerEvent::Input(from, input);
        if let Some((recorder, _)) = &mut self.recorder {
            recorder.events(std::slice::from_ref(&event));
        }
        if let ServerEvent::Input(from, input) = event {
            self.users.take(from, input, self.time_s);
        }
    }

    /// Ends the run: recording, summary, facets. Every part is done even if another fails, and
    /// files come first because facets may not answer.
    fn end(&mut self, processes: &mut FacetProcesses) -> Result<(), Failure> {
        let wall_s = self.began.elapsed().as_secs_f64();
        let session_options = self.server.end().map_err(failed);
        let recorded = match self.recorder.take() {
            Some((recorder, recording)) if recording.has_begun() => {
                recorder.finish().map(|_| Some(recording)).map_err(|e| Failure::run("recording", e))
            }
            _ => Ok(None),
        };
        let summed = self.write_summary(wall_s);
        let processes = processes.end(self.frames > 0);
        if let (Ok(Some(recording)), false) = (&recorded, self.options.quiet) {
            outputs::say(&format!("recording: {}\n", recording.file().display()))?;
        }
        session_options.and(recorded.map(drop)).and(summed).and(processes).and(self.input_devices.check())
    }

    /// Prints the summary and writes its file.
    fn write_summary(&self, wall_s: f64) -> Result<(), Failure> {
        if self.frames > 0 {
            let summary = Summary {
                scene: self.scene.clone(),
                cave: self.cave.file.clone(),
                transport: if transport_kind(self.options, &self.cave) == TransportKind::Udp {
                    "udp"
                } else {
                    "shared memory"
                },
                mode: if self.cave.sync.mode == Mode::Lockstep { "lockstep" } else { "latest" },
                frames: self.frames,
                simulated_s: self.time_s,
                wall_s,
                behind_s: self.behind_s,
                simulation: self.metrics.step.quantiles(),
                barrier: self.metrics.barrier.quantiles(),
                frame: self.metrics.frame.quantiles(),
                skew: self.metrics.skew.non_empty(),
                input_to_picture: self.metrics.input.non_empty(),
                replay: self.replay.as_ref().map(|replay| replay.counts),
                replay_input: self.input_devices.replayed_counts(),
                tracker: self.input_devices.tracker_counts(),
                heads_rejected: self.users.heads_rejected,
                unknown_peers: refused(&self.server.unknown_peers()),
                facets: self.metrics.facets(&self.server, &self.slots, self.frames),
            };
            if !self.options.quiet {
                outputs::say(&summary.lines())?;
            }
            if let Some(path) = &self.options.summary {
                let text = serde_json::to_string_pretty(&summary).map_err(|e| Failure::run("the summary", e))? + "\n";
                write_file(path, text.as_bytes())?;
            }
        }
        if self.frames == 0 {
            // explains why no facet joined
            eprint!("{}", unknown_peers_line(&refused(&self.server.unknown_peers())));
        }
        Ok(())
    }
}

fn failed(error: SessionError) -> Failure {
    Failure::run("the server", error)
}

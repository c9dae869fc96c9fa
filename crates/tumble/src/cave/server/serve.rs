//! The server's process: simulates, publishes, keeps real time, and serves facets, recording and
//! users.

use super::contact_sound::ContactSound;
use super::facet_commands::{slots, transport_kind};
use super::facet_processes::{FacetProcesses, ProcessStatus};
use super::input_devices::InputDevices;
use super::live_viewers::LiveViewers;
use super::outputs;
use super::recording::{RunRecorder, Target};
use super::summary::{Metrics, Status};
use crate::cave::address::{RunKey, ServerAddress};
use crate::cave::args::{CaveOptions, ComputeKind, ServeOptions, TransportKind};
use crate::cave::endpoints::{ServerEndpoint, idle_timeout, key, timing};
use crate::cave::lock::{RunInfo, RunLock};
use crate::cave::replay::frames::Replay;
use crate::cave::run_setup::{Role, RunSetup};
use crate::cave::signals::Signals;
use crate::cave::simulation::{CaveSimulation, PACE_SOURCE};
use crate::divergence;
use crate::failure::Failure;
use std::net::{Ipv4Addr, SocketAddr};
use std::path::Path;
use std::time::{Duration, Instant};
use tumble::net::sync::cpu_latency::CpuLatencyRequest;
use tumble::net::sync::shm::{ShmServer, clean_up};
use tumble::net::sync::transport::FacetNumber;
use tumble::net::sync::udp::{Entropy, UdpServer};
use tumble::net::sync::{
    FacetSlot, FrameInputs, Input, MAX_CONTACTS, Server, ServerEvent, ServerOptions, SessionError, SyncMode,
};
use tumble::scene::cave::{Cave, Mode};

/// Interval at which signals and processes are polled.
const POLL_INTERVAL: Duration = Duration::from_millis(20);

/// Maximum time for facets to compile their pipelines and draw one picture.
const PREPARATION_TIMEOUT: Duration = Duration::from_secs(300);
/// Time after which a start is reported as slow.
const SLOW_START: Duration = Duration::from_secs(5);

/// Runs a scene in a cave, or replays a recording of one. With a launcher's options it also runs
/// the facets of this machine.
pub fn run(options: &ServeOptions, launcher: Option<&CaveOptions>, recording: Option<&Path>) -> Result<(), Failure> {
    let signals = Signals::watch()?;
    let setup = RunSetup::load(options.scene.load()?, &options.surroundings, Role::Server)?;
    let compute = compute(options, &setup.cave, recording.is_some());
    let options = &ServeOptions { compute, ..options.clone() };
    let launcher = launcher.map(|launcher| CaveOptions { serve: options.clone(), ..launcher.clone() });
    let launcher = launcher.as_ref();
    let say = |what: &str| (!options.quiet).then(|| eprintln!("{what}"));
    setup.notes.iter().for_each(|note| _ = say(note));
    outputs::check(options, launcher, &setup.cave, recording.is_some())?;
    let replay = recording.map(|path| Replay::open(path, setup.hash)).transpose()?;
    let key = key(&setup.cave)?;
    let mut entropy = Entropy::system().map_err(|e| Failure::run("the run", e))?;
    let number = entropy.next_u64();
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
            let at = listen(options, &setup.cave);
            // without a key file the run has a key of its own, by which this user's processes join
            run.key = (key.is_none() && at.ip().is_loopback()).then(|| RunKey::new(entropy.next_bytes()));
            let by = if run.key.is_some() { "a key of this run, for this user alone" } else { "the key file" };
            let key = key.or(run.key.as_ref().map(RunKey::shared));
            let server = UdpServer::bind(at, count, key, timing(&setup.cave)).map_err(failed)?;
            let address = ServerAddress::Udp(server.address().map_err(failed)?);
            say(&format!("server: {} by {by}", server.describe()));
            (ServerEndpoint::Udp(Box::new(server)), address)
        }
    };
    // from here on facets can join
    run.address = Some(address.clone());
    lock.write(&run)?;
    let shared_memory = matches!(end, ServerEndpoint::Shm(_));
    let simulation = CaveSimulation::new(&setup, setup.world.fork(), options.user_colliders)?;
    let everywhere = compute == Some(ComputeKind::Everywhere);
    let hash = everywhere.then(|| simulation.hash(&setup)).transpose()?;
    let session_options = ServerOptions { compute: hash, ..session_options(options, &setup, number, &slots) };
    let server = Server::new(end, session_options, &setup.world);
    let mut processes = FacetProcesses::start(options, &setup.cave, launcher, &address, &signals)?;
    let _awake = options
        .stay_awake
        .then(|| CpuLatencyRequest::ask().inspect_err(|why| _ = say(&format!("the cores may fall asleep: {why}"))));
    let begin = RunLoop::new(options, launcher, setup, simulation, server, slots, &signals, replay);
    let outcome = begin.and_then(|mut run_loop| {
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

/// Returns where the world is stepped, if the facets need to know: a replay steps nothing.
fn compute(options: &ServeOptions, cave: &Cave, replaying: bool) -> Option<ComputeKind> {
    let of_cave = ComputeKind::from(cave.sync.compute);
    match options.compute.unwrap_or(of_cave) {
        ComputeKind::Everywhere if !replaying => Some(ComputeKind::Everywhere),
        _ => (of_cave == ComputeKind::Everywhere).then_some(ComputeKind::Server),
    }
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

/// A run in progress. [`ending`](super::ending) has its end.
pub(super) struct RunLoop<'a> {
    pub options: &'a ServeOptions,
    /// Options of the launcher, if this process starts the facets.
    pub launcher: Option<&'a CaveOptions>,
    signals: &'a Signals,
    pub server: Server<ServerEndpoint>,
    pub simulation: CaveSimulation,
    /// Inputs since the last frame.
    inputs: Vec<(FacetNumber, Input)>,
    pub input_devices: InputDevices,
    live_viewers: LiveViewers,
    pub sound: Option<ContactSound>,
    pub recorder: RunRecorder,
    pub cave: Cave,
    pub scene: String,
    duration: Option<f64>,
    pub slots: Vec<FacetSlot>,
    pub metrics: Metrics,
    status: Status,
    /// The recording to replay instead of simulating.
    pub replay: Option<Replay>,
    pub time_s: f64,
    pub began: Instant,
    /// Begin of the last frame's simulation.
    frame_began: Option<Instant>,
    pub behind_s: f64,
    pub frames: u64,
}

impl<'a> RunLoop<'a> {
    #[allow(clippy::too_many_arguments)] // the parts of a run
    fn new(
        options: &'a ServeOptions,
        launcher: Option<&'a CaveOptions>,
        setup: RunSetup,
        simulation: CaveSimulation,
        server: Server<ServerEndpoint>,
        slots: Vec<FacetSlot>,
        signals: &'a Signals,
        replay: Option<Replay>,
    ) -> Result<RunLoop<'a>, Failure> {
        let RunSetup { scene, cave, hash, .. } = setup;
        let input_devices = InputDevices::open(options, &cave, hash, replay.is_none())?;
        let live_viewers = LiveViewers::open(options)?;
        let users = cave.users.iter().map(|user| user.name.clone()).collect();
        let sound = options.sound.map(|engine| ContactSound::open(engine, users)).transpose()?;
        let target = Target::of(options, cave.recording.as_ref(), replay.is_some());
        let recorder = RunRecorder::open(target.as_ref(), &scene.file, hash, &simulation.world, signals)?;
        Ok(RunLoop {
            options,
            launcher,
            signals,
            server,
            simulation,
            inputs: Vec::new(),
            input_devices,
            live_viewers,
            sound,
            recorder,
            cave,
            scene: scene.file,
            duration: options.duration,
            metrics: Metrics::new(&slots),
            slots,
            status: Status::new(options.quiet),
            replay,
            time_s: 0.0,
            began: Instant::now(),
            frame_began: None,
            behind_s: 0.0,
            frames: 0,
        })
    }

    /// Runs from the first join to the last frame.
    fn run_frames(&mut self, processes: &mut FacetProcesses) -> Result<(), Failure> {
        if !self.wait_for_facets(processes)? {
            return Ok(());
        }
        self.recorder.begin()?;
        let step_s = self.simulation.world.settings().dt;
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
        let (mut until, at_most) = (self.server.now() + wait, self.server.now() + wait + PREPARATION_TIMEOUT);
        let mut said = false;
        while !self.server.session().all_critical_joined() {
            if self.signals.stop_requested() {
                return Ok(false);
            }
            let (now, preparing) = (self.server.now(), processes.preparing());
            if !preparing.is_empty() {
                if now > SLOW_START && !std::mem::replace(&mut said, true) && !self.options.quiet {
                    eprintln!("facets that compile their pipelines are waited for: {}", preparing.join(", "));
                }
                until = (now + wait).min(at_most);
            }
            if now > until {
                let missing_facets = self.server.session().missing_facets().into_iter().map(str::to_owned).collect();
                let missing = SessionError::Missing(missing_facets, wait);
                return Err(Failure::run("the start", format!("{missing}; --wait SECONDS gives them more time")));
            }
            self.server.idle_until(now + POLL_INTERVAL).map_err(failed)?;
            self.take_events()?;
            processes.watch(true)?;
        }
        Ok(true)
    }

    /// Returns the pace at which users walk in a frame of this number of steps, if it is that of
    /// live users in real time.
    fn pace(&mut self, steps: u32) -> Option<Input> {
        let wall_s = self.frame_began.replace(Instant::now())?.elapsed().as_secs_f64();
        let live = !self.options.no_realtime && self.input_devices.live();
        let frame_s = f64::from(steps) * self.simulation.world.settings().dt;
        self.simulation.users.pace(wall_s, frame_s).filter(|_| live)
    }

    /// Simulates the steps of one frame. Nodes that compute by themselves do so at the same time.
    fn simulate(&mut self, frame: u64, steps: u32) -> Result<(), Failure> {
        let clock = Instant::now();
        let inputs = std::mem::take(&mut self.inputs);
        self.server.send_inputs(FrameInputs { steps, inputs }).map_err(failed)?;
        let sound = &mut self.sound;
        self.simulation.step(steps, |world| sound.iter_mut().for_each(|sound| sound.step(world)))?;
        let world = &self.simulation.world;
        self.sound.iter_mut().for_each(|sound| sound.frame(frame, world, &self.simulation.users.viewer));
        self.metrics.step.add(clock.elapsed().as_secs_f64(), frame, world.time());
        divergence::check(world)
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
            self.take_events()?;
            let tracked = self.input_devices.tracker_inputs();
            tracked.into_iter().try_for_each(|(from, input)| self.take_input(from, input))?;
            if let Some(pace) = self.pace(steps) {
                self.take_input(PACE_SOURCE, pace)?;
            }
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
                self.server.begin_simulation(&self.simulation).map_err(failed)?;
                self.inputs.clear();
                self.wait(processes)?;
                self.time_s = self.simulation.world.time();
                self.live_viewers.frame(&self.simulation.world);
            }
        }
        self.metrics.barrier.add(clock.elapsed().as_secs_f64(), frame, self.time_s);
        self.frames += 1;
        self.recorder.frame(&self.simulation.world, self.server.session());
        let session = self.server.session();
        let replayed_input = self.input_devices.after(|| session.recorded(false))?;
        replayed_input.into_iter().try_for_each(|(from, input)| self.take_input(from, input))?;
        self.take_events()?;
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

    fn take_events(&mut self) -> Result<(), Failure> {
        let mut events = self.server.events();
        events.retain(|event| self.input_devices.live() || !matches!(event, ServerEvent::Input(..)));
        self.recorder.events(&events);
        for event in events {
            self.metrics.take(&event, self.time_s);
            self.replay.iter_mut().for_each(|replay| replay.take(&event));
            let slot = |k: &u16| self.slots.get(*k as usize).map_or("", |s| s.name.as_str());
            let said = match &event {
                ServerEvent::Joined(k) => Some(format!("facet {} joined", slot(k))),
                ServerEvent::Refused(k, why) => Some(format!("facet {} was refused: {why}", slot(k))),
                ServerEvent::Gone(k, true) => Some(format!("facet {} left", slot(k))),
                ServerEvent::Gone(k, false) => Some(format!("facet {} was dropped; the others continue", slot(k))),
                ServerEvent::Late(k, frame) => Some(format!("facet {} is late with frame {frame}", slot(k))),
                ServerEvent::Differs(k, frame, object) => Some(format!(
                    "facet {} computed another state: {object} differs first, in frame {frame}; it gets the server's world",
                    slot(k)
                )),
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
                self.act(from, input)?;
            }
        }
        Ok(())
    }

    /// Takes an input of a device other than a facet's window.
    fn take_input(&mut self, from: FacetNumber, input: Input) -> Result<(), Failure> {
        if from != PACE_SOURCE {
            self.server.note_input(input.user, input.sequence);
        }
        self.recorder.events(&[ServerEvent::Input(from, input.clone())]);
        self.act(from, input)
    }

    /// Applies an input, and keeps it for the nodes that compute by themselves.
    fn act(&mut self, from: FacetNumber, input: Input) -> Result<(), Failure> {
        self.inputs.push((from, input.clone()));
        self.simulation.take(from, input)
    }
}

/// Reports an error of the session.
pub(super) fn failed(error: SessionError) -> Failure {
    Failure::run("the server", error)
}

//! The frames of a run: simulates, publishes, keeps real time, and serves facets, recording and users.

use super::facet_processes::{FacetProcesses, ProcessStatus};
use super::input_devices::InputDevices;
use super::live_viewers::LiveViewers;
use super::operator::{Operator, Wish};
use super::recording::{RunRecorder, Target};
use super::sounds::Sounds;
use super::start::connect_timeout;
use super::summary::{Metrics, Status};
use crate::cave::args::{CaveOptions, ServeOptions};
use crate::cave::endpoints::ServerEndpoint;
use crate::cave::replay::frames::Replay;
use crate::cave::run_setup::RunSetup;
use crate::cave::signals::Signals;
use crate::cave::simulation::{CaveSimulation, OPERATOR_SOURCE, PACE_SOURCE};
use crate::cave::tracker::smoothed::AppliedInput;
use crate::divergence;
use crate::failure::Failure;
use std::path::PathBuf;
use std::time::{Duration, Instant};
use tumble::net::sync::transport::FacetNumber;
use tumble::net::sync::{FacetSlot, FrameInputs, Input, Server, ServerEvent, SessionError};
use tumble::scene::cave::Cave;

/// Interval at which signals and processes are polled.
const POLL_INTERVAL: Duration = Duration::from_millis(20);
/// Time to read what a facet has sent before the end of its process.
const LAST_WORDS: Duration = Duration::from_millis(2);

/// Maximum time for facets to compile their pipelines and draw one picture.
const PREPARATION_TIMEOUT: Duration = Duration::from_secs(300);
/// Time after which a start is reported as slow.
const SLOW_START: Duration = Duration::from_secs(5);

/// How much is over.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Over {
    /// A scene: another one may follow.
    Scene,
    /// A scene, for a replay of this recording.
    Replay(PathBuf),
    Run,
}

/// A run in progress. [`ending`](super::ending) has its end.
pub(super) struct RunLoop<'a> {
    pub options: &'a ServeOptions,
    /// Options of the launcher, if this process starts the facets.
    pub launcher: Option<&'a CaveOptions>,
    pub signals: &'a Signals,
    pub operator: Operator<'a>,
    pub server: Server<ServerEndpoint>,
    pub simulation: CaveSimulation,
    /// Inputs since the last frame.
    inputs: Vec<(FacetNumber, Input)>,
    pub input_devices: InputDevices,
    live_viewers: LiveViewers,
    pub sounds: Sounds,
    pub recorder: RunRecorder,
    pub cave: Cave,
    pub scene: String,
    /// Hash of the scene.
    pub hash: [u8; 32],
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
    /// Frames in which simulated time went on.
    moving_frames: u64,
}

impl<'a> RunLoop<'a> {
    #[allow(clippy::too_many_arguments)] // the parts of a run
    pub fn new(
        options: &'a ServeOptions,
        launcher: Option<&'a CaveOptions>,
        setup: RunSetup,
        simulation: CaveSimulation,
        server: Server<ServerEndpoint>,
        slots: Vec<FacetSlot>,
        signals: &'a Signals,
        replay: Option<Replay>,
        operator: Operator<'a>,
    ) -> Result<RunLoop<'a>, Failure> {
        let RunSetup { scene, cave, hash, .. } = setup;
        let input_devices = InputDevices::open(options, &cave, hash, replay.is_none())?;
        let live_viewers = LiveViewers::open(options)?;
        let users: Vec<String> = cave.users.iter().map(|user| user.name.clone()).collect();
        let sounds = Sounds::open(options, &scene, users, &simulation.world)?;
        let target = Target::of(options, cave.recording.as_ref(), replay.is_some());
        let recorder = RunRecorder::open(target.as_ref(), &scene.file, hash, &simulation.world, signals)?;
        Ok(RunLoop {
            options,
            launcher,
            signals,
            operator,
            hash,
            server,
            simulation,
            inputs: Vec::new(),
            input_devices,
            live_viewers,
            sounds,
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
            moving_frames: 0,
        })
    }

    /// Runs from the first join to the last frame.
    pub fn run_frames(&mut self, processes: &mut FacetProcesses) -> Result<Over, Failure> {
        if !self.wait_for_facets(processes)? {
            return Ok(Over::Run);
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
                return Ok(Over::Scene);
            }
            // the duration is one of simulated time, which stands while the run is paused
            self.moving_frames += u64::from(frame > 0 && !self.simulation.is_paused());
            let over = last.map_or(self.input_devices.over(), |last| last == self.moving_frames);
            if over || self.operator.wish == Wish::NextScene {
                return Ok(Over::Scene);
            }
            if let Wish::Replay(file) = &self.operator.wish {
                return Ok(Over::Replay(file.clone()));
            }
            if self.operator.wish == Wish::Stop || self.signals.stop_requested() || !self.check_processes(processes)? {
                return Ok(Over::Run);
            }
            if !self.options.no_realtime {
                due = self.wait_for_next_frame(due, dt)?;
            }
            self.metrics.frame.add(begin.elapsed().as_secs_f64(), frame, self.time_s);
        }
        Ok(Over::Run)
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
            self.operate(processes)?;
            if self.operator.wish == Wish::Stop {
                return Ok(false);
            }
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
        let (server, recorder, sounds) = (&mut self.server, &mut self.recorder, &mut self.sounds);
        self.simulation.step(steps, |world| {
            server.step(world);
            recorder.step(world);
            sounds.step(world);
        })?;
        let world = &self.simulation.world;
        if let Some(said) = self.sounds.frame(frame, world, &self.simulation.users.viewer) {
            self.operator.log(&said);
            eprintln!("{said}");
            self.status.interrupted();
        }
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
        if !look.ended.is_empty() {
            // a facet that has left on request has said so before its end
            self.server.idle_until(self.server.now() + LAST_WORDS).map_err(failed)?;
        }
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
        self.operate(processes)?;
        let recorded = self.replay.as_mut().map(Replay::next).transpose()?;
        if recorded.is_none() && frame > 0 {
            // inputs since the last frame take effect in this one
            self.take_events()?;
            for (from, AppliedInput { input, age, lead_s }) in self.input_devices.inputs(self.server.now()) {
                age.into_iter().for_each(|age| self.server.note_input(input.user, input.sequence, age));
                lead_s.into_iter().for_each(|lead_s| self.metrics.lead.add(lead_s, frame, self.time_s));
                self.take_input(from, input)?;
            }
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
                self.input_devices.published(self.server.session().frame());
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
        for (from, input) in replayed_input {
            if from != PACE_SOURCE && from != OPERATOR_SOURCE {
                self.server.note_input(input.user, input.sequence, Duration::ZERO);
            }
            self.take_input(from, input)?;
        }
        self.take_events()?;
        let browsers = |facet| processes.report_of(facet).browsers;
        let alarms = self.input_devices.alarms();
        self.status.at(&self.server, &self.metrics, frame, self.time_s, browsers, &alarms);
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
        self.input_devices.lines().into_iter().for_each(|line| self.say(&line));
        for event in events {
            self.metrics.take(&event, self.time_s);
            if let ServerEvent::Shown(times) = &event
                && let Some(took_s) = self.input_devices.shown(times)
            {
                self.metrics.picture.add(took_s, times.frame, self.time_s);
            }
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
            said.into_iter().for_each(|said| self.say(&said));
            if let ServerEvent::Input(from, input) = event {
                self.act(from, input)?;
            }
        }
        Ok(())
    }

    /// Prints a line, and adds it to the console's log.
    fn say(&mut self, line: &str) {
        self.operator.log(line);
        if !self.options.quiet {
            eprintln!("{line}");
            self.status.interrupted();
        }
    }

    /// Takes an input of a device other than a facet's window.
    pub fn take_input(&mut self, from: FacetNumber, input: Input) -> Result<(), Failure> {
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

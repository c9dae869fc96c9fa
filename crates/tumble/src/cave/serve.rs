//! The server's process: it simulates, publishes, keeps time, and looks after facets, recording and users.

use super::args::{Carrier, CaveOptions, ServeOptions};
use super::crew::{Crew, Crewed, carrier, seats};
use super::devices::Devices;
use super::ends::{Address, ServerEnd, key, silence, timing};
use super::lock::{Lock, Run};
use super::outputs::{self, Recording};
use super::replay::Tape;
use super::signals::Signals;
use super::stage::{Role, Setting};
use super::summary::{Meter, Status, Summary, from_strangers, refused};
use super::users::Users;
use super::viewers::Viewers;
use crate::failure::Failure;
use std::net::{Ipv4Addr, SocketAddr};
use std::path::Path;
use std::time::{Duration, Instant};
use tumble::dynamics::World;
use tumble::net::record::RecorderOptions;
use tumble::net::sync::awake::Awake;
use tumble::net::sync::shm::{ShmServer, clean_up};
use tumble::net::sync::transport::FacetNumber;
use tumble::net::sync::udp::{Entropy, UdpServer};
use tumble::net::sync::{Input, Pace, Seat, Server, ServerEvent, ServerOptions, SessionError, SessionRecorder};
use tumble::scene::cave::{Cave, Mode};

/// Between two looks at signals and processes while nothing happens.
const TURN: Duration = Duration::from_millis(20);

/// Runs a scene in a cave, or shows a recording of one; with a launcher's options, also the facets of this machine.
pub fn run(options: &ServeOptions, launcher: Option<&CaveOptions>, recording: Option<&Path>) -> Result<(), Failure> {
    let signals = Signals::watch()?;
    let setting = Setting::load(&options.stage, Role::Server, |w| {
        w.dt_s = options.dt.unwrap_or(w.dt_s);
        w.stepper = options.stepper.unwrap_or(w.stepper);
        w.solver = options.solver.unwrap_or(w.solver);
    })?;
    let say = |what: &str| (!options.quiet).then(|| eprintln!("{what}"));
    setting.notes.iter().for_each(|note| _ = say(note));
    outputs::check(options, &setting.cave)?;
    let tape = recording.map(|path| Tape::open(path, setting.hash)).transpose()?;
    let key = key(&setting.cave)?;
    let number = Entropy::system().map_err(|e| Failure::run("the run", e))?.next_u64();
    let name = format!("{number:016x}");
    if signals.end() {
        return Ok(());
    }
    let mut run = Run::here(&setting.scene.file, &setting.cave.file);
    let mut lock = Lock::take(&setting, &run, options.replace)?;
    signals.remove_at_the_end(lock.path().to_owned());
    let seats = seats(&setting.cave, launcher.is_some_and(|l| l.preview));
    let count = seats.len() as u16;
    let failed = |e| Failure::run("the server", e);
    let (end, address) = match carrier(options, &setting.cave) {
        Carrier::SharedMemory => {
            let server = ShmServer::new(&name, count).map_err(failed)?.silent_after(silence(&setting.cave));
            (ServerEnd::Shm(Box::new(server)), Address::Memory(name))
        }
        Carrier::Udp => {
            let server =
                UdpServer::bind(listen(options, &setting.cave), count, key, timing(&setting.cave)).map_err(failed)?;
            let address = Address::Udp(server.address().map_err(failed)?);
            say(&format!("server: {}", server.describe()));
            (ServerEnd::Udp(Box::new(server)), address)
        }
    };
    // from now on it can be joined
    run.address = Some(address.clone());
    lock.write(&run)?;
    let shared_memory = matches!(end, ServerEnd::Shm(_));
    let server = Server::new(end, told(options, &setting, number, &seats), &setting.world);
    let mut crew = Crew::start(options, &setting.cave, launcher, &address, &signals)?;
    let _awake = options
        .stay_awake
        .then(|| Awake::ask().inspect_err(|why| _ = say(&format!("the cores may fall asleep: {why}"))));
    let outcome = Host::new(options, setting, server, seats, &signals, tape).and_then(|mut host| {
        let outcome = host.show(&mut crew);
        let ended = host.end(&mut crew);
        outcome.and(ended)
    });
    drop(crew);
    if shared_memory {
        // what killed facets left
        clean_up().map_err(|e| Failure::run("cleaning up", e))?;
    }
    drop(lock);
    outcome
}

fn listen(options: &ServeOptions, cave: &Cave) -> SocketAddr {
    let far = cave.nodes.iter().any(|n| !n.is_local());
    let usual = if far { (Ipv4Addr::UNSPECIFIED, cave.sync.port) } else { (Ipv4Addr::LOCALHOST, 0) };
    options.listen.unwrap_or(usual.into())
}

/// How long the start waits for facets.
fn patience(options: &ServeOptions, cave: &Cave) -> Duration {
    options.wait.map_or(Duration::from_millis(cave.sync.connect_timeout_ms.into()), Duration::from_secs_f64)
}

/// What the session is told: as the cave file says.
fn told(options: &ServeOptions, setting: &Setting, run: u64, seats: &[Seat]) -> ServerOptions {
    let (sync, wait) = (&setting.cave.sync, patience(options, &setting.cave));
    let ms = |ms: u32| Duration::from_millis(ms.into());
    ServerOptions {
        pace: if sync.mode == Mode::Lockstep { Pace::Lockstep } else { Pace::Latest },
        ready_after: if options.no_realtime { wait } else { ms(sync.ready_timeout_ms) },
        first_after: wait,
        drop_after: ms(sync.drop_timeout_ms),
        history: sync.history_frames as usize,
        ..ServerOptions::new(run, setting.joined, seats.to_vec())
    }
}

struct Host<'a> {
    options: &'a ServeOptions,
    signals: &'a Signals,
    server: Server<ServerEnd>,
    world: World,
    users: Users,
    devices: Devices,
    viewers: Viewers,
    recorder: Option<(SessionRecorder, Recording)>,
    recorded: bool,
    cave: Cave,
    scene: String,
    seconds: Option<f64>,
    seats: Vec<Seat>,
    meter: Meter,
    status: Status,
    /// What is shown, where nothing is simulated.
    tape: Option<Tape>,
    time_s: f64,
    began: Instant,
    behind_s: f64,
    frames: u64,
}

impl<'a> Host<'a> {
    fn new(
        options: &'a ServeOptions,
        setting: Setting,
        server: Server<ServerEnd>,
        seats: Vec<Seat>,
        signals: &'a Signals,
        tape: Option<Tape>,
    ) -> Result<Host<'a>, Failure> {
        let viewer = setting.viewer()?;
        let Setting { scene, cave, mut world, hash, .. } = setting;
        let users = Users::new(viewer, &cave, &mut world, options.push)?;
        let devices = Devices::open(options, &cave, hash, tape.is_none())?;
        let viewers = Viewers::open(options)?;
        let described = cave.recording.as_ref().filter(|_| tape.is_none()).map(|r| (r.file.clone(), r.every_frames));
        let recorder = options.record.clone().map(|file| (file, 1)).or(described).map(|(file, every)| {
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
        Ok(Host {
            options,
            signals,
            server,
            world,
            users,
            devices,
            viewers,
            recorder: recorder.transpose()?,
            recorded: false,
            cave,
            scene: scene.file,
            seconds: options.duration,
            meter: Meter::new(seats.len()),
            seats,
            status: Status::new(options.quiet),
            tape,
            time_s: 0.0,
            began: Instant::now(),
            behind_s: 0.0,
            frames: 0,
        })
    }

    /// From the first joining to the last frame.
    fn show(&mut self, crew: &mut Crew) -> Result<(), Failure> {
        if !self.gather(crew)? {
            return Ok(());
        }
        if let Some((_, recording)) = &mut self.recorder {
            recording.begin()?;
        }
        let step_s = self.world.settings().dt;
        let steps = ((1.0 / (self.options.fps * step_s) + 1e-9).floor() as u32).max(1);
        let dt = self.frame_length(step_s * f64::from(steps));
        let last = self.seconds.map(|s| (s / dt).round() as u64);
        self.began = Instant::now();
        let mut due = self.server.now();
        for frame in 0.. {
            let begin = Instant::now();
            if !self.publish(frame, steps, crew)? {
                return Ok(());
            }
            if last.map_or(self.devices.over(), |last| last == frame) || self.signals.end() || !self.look_after(crew)? {
                return Ok(());
            }
            if !self.options.no_realtime {
                due = self.keep_time(due, dt)?;
            }
            self.meter.frame.add(begin.elapsed().as_secs_f64(), frame, self.time_s);
        }
        Ok(())
    }

    /// Waits for the critical facets; `false` when the end was asked for meanwhile.
    fn gather(&mut self, crew: &mut Crew) -> Result<bool, Failure> {
        let wait = patience(self.options, &self.cave);
        let until = self.server.now() + wait;
        while !self.server.session().complete() {
            if self.signals.end() {
                return Ok(false);
            }
            let now = self.server.now();
            if now > until {
                let absent = self.server.session().absent().into_iter().map(str::to_owned).collect();
                return Err(Failure::run("the start", SessionError::Missing(absent, wait)));
            }
            self.server.idle_until(now + TURN).map_err(failed)?;
            self.take_events(0.0);
            crew.watch(true)?;
        }
        Ok(true)
    }

    /// The steps of one frame.
    fn simulate(&mut self, frame: u64, steps: u32) -> Result<(), Failure> {
        let (clock, dt) = (Instant::now(), self.world.settings().dt);
        for _ in 0..steps {
            self.users.act(&mut self.world, dt)?;
            self.world.step().map_err(|e| Failure::run("the simulation stopped", e))?;
        }
        self.meter.step.add(clock.elapsed().as_secs_f64(), frame, self.world.time());
        Ok(())
    }

    /// Of the simulation, s; a recording has its own.
    fn frame_length(&self, simulated: f64) -> f64 {
        self.tape.as_ref().and_then(Tape::frame_length).unwrap_or(simulated)
    }

    /// Waits until the frame is shown. A facet whose process ends meanwhile is waited for no longer, and started again.
    fn wait(&mut self, crew: &mut Crew) -> Result<(), Failure> {
        while !self.server.shown(TURN).map_err(failed)? && self.look_after(crew)? && !self.signals.end() {}
        Ok(())
    }

    /// Looks whether facets' processes have ended; `false` when all have, as their users wished.
    fn look_after(&mut self, crew: &mut Crew) -> Result<bool, Failure> {
        let look = crew.watch(false)?;
        look.ended.into_iter().try_for_each(|facet| self.server.lose(facet)).map_err(failed)?;
        match look.crew {
            Crewed::Yes => Ok(true),
            Crewed::Left => Ok(false),
            Crewed::Lost => Err(Failure::run("the run", "no facet is left")),
        }
    }

    /// The next frame, to its being shown: simulated, or from the recording. `false` where that is over.
    fn publish(&mut self, frame: u64, steps: u32, crew: &mut Crew) -> Result<bool, Failure> {
        let recorded = self.tape.as_mut().map(Tape::next).transpose()?;
        if recorded.is_none() && frame > 0 {
            // what came since the last frame counts in this one
            self.take_events(self.time_s);
            self.devices.tracked().into_iter().for_each(|(from, input)| self.take_input(from, input));
            self.simulate(frame, steps)?;
        }
        let clock = Instant::now();
        match recorded {
            Some(None) => return Ok(false),
            Some(Some(recorded)) => {
                self.server.begin_recorded(&recorded).map_err(failed)?;
                self.wait(crew)?;
                self.time_s = recorded.time_s;
            }
            None => {
                self.server.begin(&self.world, &self.users.viewer).map_err(failed)?;
                self.wait(crew)?;
                self.time_s = self.world.time();
                self.viewers.frame(&self.world);
            }
        }
        self.meter.barrier.add(clock.elapsed().as_secs_f64(), frame, self.time_s);
        self.frames += 1;
        if let Some((recorder, _)) = &mut self.recorder
            && let Some(recorded) = self.server.session().recorded(!self.recorded)
        {
            recorder.frame(&self.world, recorded).map_err(|e| Failure::run("recording", e))?;
            self.recorded = true;
        }
        let session = self.server.session();
        let played = self.devices.after(|| session.recorded(false))?;
        played.into_iter().for_each(|(from, input)| self.take_input(from, input));
        self.take_events(self.time_s);
        self.status.at(&self.server, &self.seats, &self.meter, frame, self.time_s);
        Ok(true)
    }

    /// Waits until the next frame is due, and when that is. What is late by more than a frame is given up: time then goes slower, and no frame is left out.
    fn keep_time(&mut self, due: Duration, dt: f64) -> Result<Duration, Failure> {
        let (next, now) = (due + Duration::from_secs_f64(dt), self.server.now());
        let late = now.saturating_sub(next);
        if late > Duration::from_secs_f64(dt) {
            self.behind_s += late.as_secs_f64();
            return Ok(now);
        }
        while self.server.now() < next && !self.signals.end() {
            self.server.idle_until(next.min(self.server.now() + TURN)).map_err(failed)?;
        }
        Ok(next)
    }

    fn take_events(&mut self, time_s: f64) {
        let mut events = self.server.events();
        events.retain(|event| self.devices.live() || !matches!(event, ServerEvent::Input(..)));
        if let Some((recorder, _)) = &mut self.recorder {
            recorder.events(&events);
        }
        for event in events {
            self.meter.take(&event, time_s);
            self.tape.iter_mut().for_each(|tape| tape.take(&event));
            let seat = |k: &u16| self.seats.get(*k as usize).map_or("", |s| s.name.as_str());
            let said = match &event {
                ServerEvent::Joined(k) => Some(format!("facet {} is there", seat(k))),
                ServerEvent::Refused(k, why) => Some(format!("facet {} is not let in: {why}", seat(k))),
                ServerEvent::Gone(k, true) => Some(format!("facet {} left", seat(k))),
                ServerEvent::Gone(k, false) => Some(format!("facet {} is dropped; the others go on", seat(k))),
                ServerEvent::Late(k, frame) => Some(format!("facet {} is late with frame {frame}", seat(k))),
                ServerEvent::Presented(k, frame, _, false) => {
                    Some(format!("facet {} drew another frame {frame} than was sent", seat(k)))
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

    /// What a user did by another device than a facet's window.
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

    /// Ends the run: recording, summary, facets. As much of it as can be done is, and what is to be kept comes first: facets may not answer.
    fn end(&mut self, crew: &mut Crew) -> Result<(), Failure> {
        let wall_s = self.began.elapsed().as_secs_f64();
        let told = self.server.end().map_err(failed);
        let recorded = match self.recorder.take() {
            Some((recorder, recording)) if recording.has_begun() => {
                recorder.finish().map(|_| Some(recording)).map_err(|e| Failure::run("recording", e))
            }
            _ => Ok(None),
        };
        let summed = self.sum_up(wall_s);
        let crew = crew.end(self.frames > 0);
        if let (Ok(Some(recording)), false) = (&recorded, self.options.quiet) {
            outputs::say(&format!("recording: {}\n", recording.file().display()))?;
        }
        told.and(recorded.map(drop)).and(summed).and(crew).and(self.devices.verdict())
    }

    /// What was counted and measured, to stdout and file.
    fn sum_up(&self, wall_s: f64) -> Result<(), Failure> {
        if self.frames > 0 {
            let summary = Summary {
                scene: self.scene.clone(),
                cave: self.cave.file.clone(),
                transport: if carrier(self.options, &self.cave) == Carrier::Udp { "udp" } else { "shared memory" },
                mode: if self.cave.sync.mode == Mode::Lockstep { "lockstep" } else { "latest" },
                frames: self.frames,
                simulated_s: self.time_s,
                wall_s,
                behind_s: self.behind_s,
                simulation: self.meter.step.figures(),
                barrier: self.meter.barrier.figures(),
                frame: self.meter.frame.figures(),
                skew: self.meter.skew.some(),
                input_to_picture: self.meter.input.some(),
                replay: self.tape.as_ref().map(|tape| tape.counts),
                input_from: self.devices.played_counts(),
                tracker: self.devices.tracker_counts(),
                heads_refused: self.users.heads_refused,
                strangers: refused(&self.server.strangers()),
                facets: self.meter.facets(&self.server, &self.seats, self.frames),
            };
            if !self.options.quiet {
                outputs::say(&summary.lines())?;
            }
            if let Some(path) = &self.options.summary {
                let text = serde_json::to_string_pretty(&summary).map_err(|e| Failure::run("the summary", e))? + "\n";
                std::fs::write(path, text).map_err(|e| Failure::run(&format!("writing {}", path.display()), e))?;
            }
        }
        if self.frames == 0 {
            // why nobody came
            eprint!("{}", from_strangers(&refused(&self.server.strangers())));
        }
        Ok(())
    }
}

fn failed(error: SessionError) -> Failure {
    Failure::run("the server", error)
}

//! `tumble facet`: what the server says is drawn, shown when the server says, and acknowledged by what was really drawn.

use super::args::FacetOptions;
use super::ends::{Address, FacetEnd};
use super::lock;
use super::log::FrameLog;
use super::painter::{Painter, image_hash, seat_name};
use super::signals::Signals;
use super::stage::{Role, Setting};
use super::window::{Desktop, Parts, desktop};
use crate::failure::Failure;
use std::io::Read;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use tumble::net::sync::{Facet, FacetOptions as Told, Over, Pace, SessionError, Task, Waiting};
use tumble::net::sync::{transport::FacetNumber, udp::Entropy};
use tumble::render::Image;
use tumble::scene::cave::{Mode, Output};

/// Between two looks at signals, pipe and picture.
const TURN: Duration = Duration::from_millis(50);
/// Waiting for a server that is no longer than this is not worth a word.
const MOMENT: Duration = Duration::from_secs(1);

/// Runs a facet until the run is over.
pub fn run(options: &FacetOptions) -> Result<(), Failure> {
    let signals = Signals::watch()?;
    let leader = options.led.then(watch_stdin).transpose()?;
    let setting = Setting::load(&options.stage, Role::Facet, |_| {})?;
    let described = options.facet.as_deref().map(|name| setting.cave.facet(name).cloned()).transpose()?;
    let number = described
        .as_ref()
        .map_or(0, |facet| setting.cave.facets.iter().position(|f| f.name == facet.name).unwrap_or(0))
        as FacetNumber;
    let name = seat_name(described.as_ref()).to_owned();
    let draw = &options.draw;
    let offscreen = draw.no_pictures
        || draw.offscreen
        || described.as_ref().is_some_and(|f| f.output == Output::Offscreen)
        || no_desktop(&name);
    let (mut painter, mut parts) = (None, None);
    match (draw.no_pictures, offscreen) {
        (true, _) => {}
        (false, true) => painter = Some(Painter::new(&setting, described.as_ref(), draw.quality)?),
        (false, false) => parts = Some(Parts::new(&setting, described.as_ref(), draw.quality)?),
    }
    let mut watch =
        Watch { name: name.clone(), signals, leader, patience: Duration::from_secs_f64(options.wait), sealed: false };
    let address = address(options, &setting, &watch)?;
    watch.sealed = matches!(address, Address::Udp(_));
    let again = options.server.is_none() && options.run.is_none();
    let link = FacetEnd::open(&address, number, &setting, again)?;
    let told = told(&setting, &name)?;
    let log = match (&draw.frames_dir, &draw.log_dir) {
        (Some(folder), _) => Some(FrameLog::open(folder, &name, true, !options.led)?),
        (None, Some(folder)) => Some(FrameLog::open(folder, &name, false, !options.led)?),
        (None, None) => None,
    };
    let facet = Facet::new(link, told, setting.world);
    let mut running = Running {
        facet,
        painter,
        log,
        stamp: draw.stamp,
        watch,
        alone: Alone::default(),
        drawing: None,
        picture: None,
    };
    let outcome = match parts {
        Some(parts) => parts.show(&mut running, draw.stamp),
        None => running.go(),
    };
    // whatever happened, the server need not find out by silence
    let _ = running.facet.leave();
    // what could not be written is why the rest went wrong
    running.log.as_mut().map_or(Ok(()), FrameLog::finish).and(outcome)
}

/// Whether there is none to open a window on; one that is named and does not answer is said.
fn no_desktop(name: &str) -> bool {
    match desktop() {
        Desktop::There => return false,
        Desktop::Silent(why) => {
            eprintln!("facet {name}: draws into memory, because the desktop does not answer ({why})")
        }
        Desktop::None => {}
    }
    true
}

/// What the session is told, as the cave file says.
fn told(setting: &Setting, name: &str) -> Result<Told, Failure> {
    let seed = Entropy::system().map_err(|e| Failure::run("the facet", e))?.next_u64();
    let sync = &setting.cave.sync;
    let pace = if sync.mode == Mode::Lockstep { Pace::Lockstep } else { Pace::Latest };
    Ok(Told {
        pace,
        drop_after: Duration::from_millis(sync.drop_timeout_ms.into()),
        ..Told::new(name, setting.joined, seed)
    })
}

/// Where the server is: as the command line says, or as the run that goes on here says, which is waited for.
fn address(options: &FacetOptions, setting: &Setting, watch: &Watch) -> Result<Address, Failure> {
    if let Some(server) = options.server {
        return Ok(Address::Udp(server));
    }
    if let Some(run) = &options.run {
        return Ok(Address::Memory(run.clone()));
    }
    let until = Instant::now() + watch.patience;
    let mut said = false;
    loop {
        if let Some(address) = lock::find(&setting.place)? {
            return Ok(address);
        }
        if watch.end() {
            return Err(Failure::run(&watch.title(), "ended while it waited for a run"));
        }
        if Instant::now() > until {
            let far = setting.cave.nodes.iter().any(|n| !n.is_local());
            let hint = if far { "; on another machine say where it is with --server ADDR:PORT" } else { "" };
            return Err(Failure::run(
                &watch.title(),
                format!("no run goes on in {} on this machine, {:.0} s long{hint}", setting.cave.file, options.wait),
            ));
        }
        if !std::mem::replace(&mut said, true) {
            watch.say(&format!("waits for a run in {}", setting.cave.file));
        }
        std::thread::sleep(TURN);
    }
}

/// Who may end a facet, and how long it waits.
struct Watch {
    name: String,
    signals: Signals,
    leader: Option<Arc<AtomicBool>>,
    patience: Duration,
    /// The server answers nobody who has another key file.
    sealed: bool,
}

impl Watch {
    fn title(&self) -> String {
        format!("facet {}", self.name)
    }

    fn say(&self, what: &str) {
        eprintln!("facet {}: {what}", self.name);
    }

    fn orphaned(&self) -> bool {
        self.leader.as_ref().is_some_and(|gone| gone.load(Ordering::Relaxed))
    }

    fn end(&self) -> bool {
        self.signals.end() || self.orphaned()
    }
}

/// Raised when stdin ends: the launcher is gone, however that came.
fn watch_stdin() -> Result<Arc<AtomicBool>, Failure> {
    let gone = Arc::new(AtomicBool::new(false));
    let raise = gone.clone();
    let wait = move || {
        let mut bytes = [0; 64];
        while matches!(std::io::stdin().read(&mut bytes), Ok(n) if n > 0) {}
        raise.store(true, Ordering::Relaxed);
    };
    std::thread::Builder::new().name("leader".into()).spawn(wait).map_err(|e| Failure::run("the facet", e))?;
    Ok(gone)
}

/// How long there has been no server, and what was said about it.
#[derive(Default)]
pub struct Alone {
    since: Option<(Waiting, Instant)>,
    said: bool,
}

impl Alone {
    fn look(&mut self, task: &Task, watch: &Watch) -> Result<(), Failure> {
        let Task::Wait(why @ (Waiting::Server | Waiting::Lost)) = *task else {
            if self.since.take().is_some() && std::mem::take(&mut self.said) {
                watch.say("has its server");
            }
            return Ok(());
        };
        let (_, since) = *self.since.filter(|(before, _)| *before == why).get_or_insert((why, Instant::now()));
        self.since = Some((why, since));
        if since.elapsed() > watch.patience {
            let what =
                if why == Waiting::Lost { "the server is lost and did not come back" } else { "no server answers" };
            let key = if watch.sealed {
                "; a server that has another key file looks like this, too: compare them"
            } else {
                ""
            };
            return Err(Failure::run(
                &watch.title(),
                format!("{what}, {:.0} s long{key}", watch.patience.as_secs_f64()),
            ));
        }
        if !self.said && (why == Waiting::Lost || since.elapsed() > MOMENT) {
            watch.say(if why == Waiting::Lost {
                "has lost its server, keeps the last picture and looks for it"
            } else {
                "waits for the server"
            });
            self.said = true;
        }
        Ok(())
    }
}

/// A facet that is connected, or looks for its server.
pub struct Running {
    pub facet: Facet<FacetEnd>,
    painter: Option<Painter>,
    pub log: Option<FrameLog>,
    stamp: bool,
    watch: Watch,
    alone: Alone,
    /// The frame that is being drawn, and its simulated time.
    drawing: Option<(u64, f64)>,
    /// The frame that is drawn, and not yet shown.
    picture: Option<Drawn>,
}

struct Drawn {
    frame: u64,
    time_s: f64,
    hash: [u8; 16],
    image: Option<Image>,
}

/// The link's trouble.
pub fn failed(error: SessionError) -> Failure {
    Failure::run("the connection to the server", error)
}

impl Running {
    /// What to do next, after waiting for it for at most `timeout`; `None` when the facet is to end.
    pub fn next(&mut self, timeout: Duration) -> Result<Option<Task>, Failure> {
        self.log.as_mut().map_or(Ok(()), FrameLog::check)?;
        if self.watch.orphaned() {
            return Err(Failure::run(&self.watch.title(), "its launcher is gone"));
        }
        if self.watch.signals.end() {
            return Ok(None);
        }
        let task = self.facet.next(timeout).map_err(failed)?;
        self.alone.look(&task, &self.watch)?;
        match task {
            Task::Over(Over::Refused(why)) => {
                Err(Failure::input(format!("facet {}: the server refuses it: {why}", self.watch.name)))
            }
            Task::Over(_) => Ok(None),
            task => Ok(Some(task)),
        }
    }

    /// Whether what was shown is written, so far that there is room for more.
    pub fn has_room(&self) -> bool {
        self.log.as_ref().is_none_or(FrameLog::has_room)
    }

    /// For how many whole seconds there has been no server.
    pub fn alone_s(&self) -> u64 {
        self.alone.since.map_or(0, |(_, since)| since.elapsed().as_secs())
    }

    /// Draws into memory, or nothing, until the end.
    fn go(&mut self) -> Result<(), Failure> {
        while let Some(task) = self.next(if self.drawing.is_some() { Duration::ZERO } else { TURN })? {
            match task {
                // what was begun is finished first, also where nobody waits for it any more
                Task::Wait(_) | Task::Draw if self.drawing.is_some() => self.see_the_picture()?,
                Task::Wait(_) | Task::Over(_) => {}
                // packing pictures is behind: the server hears that this facet lives, and waits
                Task::Draw if !self.has_room() => std::thread::sleep(MOMENT / 200),
                Task::Draw => self.draw()?,
                Task::Present(frame) => self.present(frame)?,
            }
        }
        Ok(())
    }

    fn draw(&mut self) -> Result<(), Failure> {
        let Some(frame) = self.facet.begin() else { return Ok(()) };
        let time_s = self.facet.world().time();
        match &mut self.painter {
            Some(painter) => {
                painter.begin(self.facet.world(), self.facet.viewer(), self.stamp.then_some(frame))?;
                self.drawing = Some((frame, time_s));
                Ok(())
            }
            None => self.drawn(frame, time_s, None),
        }
    }

    fn see_the_picture(&mut self) -> Result<(), Failure> {
        let (Some(painter), Some((frame, time_s))) = (&mut self.painter, self.drawing) else { return Ok(()) };
        match painter.finished(TURN)? {
            Some(image) => self.drawn(frame, time_s, Some(image)),
            None => Ok(()),
        }
    }

    /// A frame is drawn.
    pub fn drawn(&mut self, frame: u64, time_s: f64, image: Option<Image>) -> Result<(), Failure> {
        self.drawing = None;
        let hash = image.as_ref().map_or([0; 16], image_hash);
        self.picture = Some(Drawn { frame, time_s, hash, image });
        self.facet.drawn(hash).map_err(failed)
    }

    /// A frame is shown.
    pub fn present(&mut self, frame: u64) -> Result<(), Failure> {
        self.facet.presented().map_err(failed)?;
        let shown = self.facet.session().shown();
        let Some(drawn) = self.picture.take().filter(|d| d.frame == frame) else { return Ok(()) };
        if let (Some(log), Some((_, done))) = (&mut self.log, shown) {
            log.shown(frame, drawn.time_s, &done.hash, &drawn.hash, drawn.image)?;
        }
        Ok(())
    }
}

//! Several facets of a process in windows. The main thread has all windows and the device, as the desktop
//! requires, and each session has a thread.
//!
//! ```text
//! session of the first facet   STATE ─► world ─► draw list ─┐ draw
//!                                                           ▼
//! main thread                  events of all windows     pictures of all windows ─► kept on the device
//!                                │ input                    │ drawn          ▲ present n
//!                                ▼                          ▼                │
//! session of each facet        INPUT                      READY ─► PRESENT ──┘─► PRESENTED
//! ```
//!
//! The end of one window ends all facets of the process, because the first one has the world.

use super::burn_in;
use super::desktop::Probe;
use super::pictures::{Picture, Pictures};
use super::render_thread::{ListMaker, RenderRequest, Wanted};
use super::runner::FacetRunner;
use super::user_input::{HeldInput, InputSender};
use super::window::{no_server, window_options};
use crate::cave::endpoints::FacetEndpoint;
use crate::cave::run_setup::{RunSetup, apply_viewer};
use crate::failure::Failure;
use crate::view::view_mode::facet_ray;
use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{SyncSender, sync_channel};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::time::Duration;
use tumble::collide::Pose;
use tumble::dynamics::World;
use tumble::net::sync::{Facet as Session, Viewer};
use tumble::render::winit::event::WindowEvent;
use tumble::render::{
    CaveView, Image, Mailbox, Quality, RenderError, Stage, Wall, WallApp, WallLoop, WindowOptions,
    finished_calibration_picture,
};
use tumble::scene::cave::Facet;

/// Interval at which a session waits for the windows to open.
const OPEN_INTERVAL: Duration = Duration::from_millis(20);
/// Calibration patterns of a window that wait for their frames, at most.
const MAX_PATTERNS: usize = 2;

/// Request of a session to the windows.
pub enum WallMessage {
    /// Draw a frame for all windows.
    Draw(Box<RenderRequest>),
    /// Show the frame in a window, and say so.
    Present { window: usize, frame: u64, done: SyncSender<Result<(), Failure>> },
    /// Warn in a window that there has been no server for this time, s.
    Warn { window: usize, passed_s: u64 },
    /// A session has ended.
    Ended,
}

/// The device that draws the windows.
struct Device {
    software: bool,
    adapter: String,
}

/// Data that a window and its session share.
struct Link {
    pictures: Pictures,
    /// Whether every picture is read back, for the frame log.
    always_read: bool,
    /// Whether the next one is read back.
    read: AtomicBool,
    /// Held keys, and where the user pulls.
    held: Mutex<(Vec<u16>, Option<Pose>)>,
}

/// The painter of a facet in one of several windows: asks the main thread.
pub struct WindowPainter {
    window: usize,
    mailbox: Mailbox<WallMessage>,
    device: Arc<OnceLock<Device>>,
    link: Arc<Link>,
    /// Draw lists: of the first facet alone, which has the world.
    lists: Option<ListMaker>,
    sender: InputSender,
    /// Number of seconds without a server in the last warning.
    warned: Option<u64>,
}

impl WindowPainter {
    /// Waits for the windows and has their first pictures drawn, for which pipelines are compiled. Returns
    /// `false` if the facet must stop.
    pub fn prepare(&mut self, world: &World, viewer: &Viewer, stop: impl Fn() -> bool) -> Result<bool, Failure> {
        let device = loop {
            match self.device.get() {
                Some(device) => break device,
                None if stop() => return Ok(false),
                None => std::thread::sleep(OPEN_INTERVAL),
            }
        };
        let default = if device.software { Quality::fast() } else { Quality::default() };
        self.lists.iter_mut().for_each(|lists| _ = lists.quality.get_or_insert(default));
        self.begin(world, viewer, &Wanted::first())?;
        while self.finished(OPEN_INTERVAL)?.is_none() {
            if stop() {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Returns whether a software driver draws.
    pub fn is_software(&self) -> bool {
        self.device.get().is_some_and(|device| device.software)
    }

    /// Returns the graphics adapter; empty before the windows are open.
    pub fn adapter(&self) -> &str {
        self.device.get().map_or("", |device| &device.adapter)
    }

    /// Starts the pictures of all windows, in the first facet, and asks for that of this one.
    pub fn begin(&mut self, world: &World, viewer: &Viewer, wanted: &Wanted) -> Result<(), Failure> {
        self.warned = None;
        self.link.pictures.want(wanted.frame);
        if wanted.read {
            self.link.read.store(true, Ordering::Relaxed);
        }
        let Some(lists) = &mut self.lists else { return Ok(()) };
        let request = RenderRequest { list: lists.list(world)?, viewer: viewer.clone(), wanted: *wanted };
        self.ask(WallMessage::Draw(Box::new(request)))
    }

    /// Returns whether the picture is finished within `timeout`, and the picture if it is read back.
    pub fn finished(&mut self, timeout: Duration) -> Result<Option<Option<Image>>, Failure> {
        self.link.pictures.take(timeout)
    }

    /// Shows the finished picture of the frame.
    pub fn present(&mut self, frame: u64) -> Result<(), Failure> {
        let (done, shown) = sync_channel(1);
        self.ask(WallMessage::Present { window: self.window, frame, done })?;
        shown.recv().unwrap_or_else(|_| Err(closed()))
    }

    /// Warns that the picture is old.
    pub fn warn(&mut self, passed_s: u64) -> Result<(), Failure> {
        if passed_s >= 1 && self.warned != Some(passed_s) {
            self.warned = Some(passed_s);
            return self.ask(WallMessage::Warn { window: self.window, passed_s });
        }
        Ok(())
    }

    /// Sends the user's input if the server does not have it yet.
    pub fn send(&mut self, session: &mut Session<FacetEndpoint>) -> Result<(), Failure> {
        let (keys, wand) = self.link.held.lock().unwrap_or_else(PoisonError::into_inner).clone();
        self.sender.send(session, &keys, wand)
    }

    fn ask(&self, message: WallMessage) -> Result<(), Failure> {
        if self.mailbox.send(message) { Ok(()) } else { Err(closed()) }
    }
}

fn closed() -> Failure {
    Failure::run("the windows", "they have been closed")
}

/// The windows of this process, before they open.
pub struct WallSetup {
    event_loop: WallLoop<WallMessage>,
    options: Vec<WindowOptions>,
    app: Windows,
}

impl WallSetup {
    /// Prepares a window for each facet, and their painters. `read` says that every picture is read back,
    /// `burn_in` that frame numbers are drawn over the pictures; `end` ends all sessions. `probe` is a
    /// connection to the desktop, which ends when the windows are open.
    pub fn new(
        setup: &RunSetup,
        facets: &[Facet],
        lists: ListMaker,
        (read, burn_in): (bool, bool),
        probe: Probe,
        end: Arc<AtomicBool>,
    ) -> Result<(WallSetup, Vec<WindowPainter>), Failure> {
        let event_loop = WallLoop::new()?;
        let (mailbox, device) = (event_loop.mailbox(), Arc::new(OnceLock::new()));
        let (mut windows, mut options, mut painters, mut lists) = (Vec::new(), Vec::new(), Vec::new(), Some(lists));
        for (k, facet) in facets.iter().enumerate() {
            let link = Arc::new(Link {
                pictures: Pictures::default(),
                always_read: read,
                read: AtomicBool::new(false),
                held: Mutex::default(),
            });
            let view = setup.view()?;
            options.push(window_options(setup, &view, Some(facet)));
            painters.push(WindowPainter {
                window: k,
                mailbox: mailbox.clone(),
                device: device.clone(),
                link: link.clone(),
                lists: lists.take(),
                sender: InputSender::new(facet.user as u16),
                warned: None,
            });
            let (facet, held, patterns) = (facet.clone(), HeldInput::default(), VecDeque::new());
            windows.push(FacetWindow { view, facet, link, held, patterns });
        }
        let app = Windows { windows, device, burn_in, viewer: setup.viewer()?, ended: 0, end, probe: Some(probe) };
        Ok((WallSetup { event_loop, options, app }, painters))
    }

    /// Opens the windows and runs the sessions in threads, until all have ended. `finish` completes each.
    pub fn show(
        self,
        runners: &mut [FacetRunner],
        finish: impl Fn(&mut FacetRunner, Result<(), Failure>) -> Result<(), Failure> + Sync,
    ) -> Result<(), Failure> {
        let WallSetup { event_loop, options, mut app } = self;
        let (mailbox, end) = (event_loop.mailbox(), app.end.clone());
        let run = |runner: &mut FacetRunner| {
            let shown = runner.run();
            if shown.is_err() {
                end.store(true, Ordering::Relaxed);
            }
            let finished = finish(runner, shown);
            let _ = mailbox.send(WallMessage::Ended); // the windows may have failed before
            finished
        };
        std::thread::scope(|scope| {
            let run = &run;
            let threads: Vec<_> = runners.iter_mut().map(|runner| scope.spawn(move || run(runner))).collect();
            let shown = event_loop.run(&options, &mut app);
            end.store(true, Ordering::Relaxed);
            let ended = |thread: std::thread::ScopedJoinHandle<'_, _>| {
                thread.join().unwrap_or_else(|_| Err(Failure::run("the facets", "a thread has ended")))
            };
            let outcomes: Vec<Result<(), Failure>> = threads.into_iter().map(ended).collect();
            // a failure of the windows is the cause of others
            std::iter::once(shown).chain(outcomes).collect()
        })
    }
}

/// The windows of this process.
struct Windows {
    windows: Vec<FacetWindow>,
    device: Arc<OnceLock<Device>>,
    burn_in: bool,
    /// The users of the last frame.
    viewer: Viewer,
    /// Number of sessions that have ended.
    ended: usize,
    end: Arc<AtomicBool>,
    /// Keeps the desktop from resetting until the windows are open.
    probe: Option<Probe>,
}

/// A facet's part of its window.
struct FacetWindow {
    view: CaveView,
    facet: Facet,
    link: Arc<Link>,
    held: HeldInput,
    /// The calibration patterns of the next frames.
    patterns: VecDeque<(u64, Option<Image>)>,
}

impl FacetWindow {
    /// Draws the window's picture and keeps it for its frame.
    fn draw(&mut self, wall: &mut Wall, window: usize, stage: &Stage, wanted: &Wanted) -> Result<Picture, RenderError> {
        let Wanted { frame, pattern, .. } = *wanted;
        let read = self.link.read.swap(false, Ordering::Relaxed) || self.link.always_read;
        let pattern = pattern.map(|pattern| finished_calibration_picture(&self.view, &self.facet, pattern));
        self.patterns.retain(|(other, _)| *other < frame);
        while self.patterns.len() >= MAX_PATTERNS {
            self.patterns.pop_front();
        }
        self.patterns.push_back((frame, pattern.clone()));
        self.view.draw_on_device(wall.renderer(), stage, &self.facet)?;
        wall.keep(window, frame)?;
        match pattern {
            Some(pattern) if read => Ok(Picture::Image(pattern)),
            None if read => wall.renderer().begin_read().map(Picture::Reading),
            _ => Ok(Picture::OnDevice),
        }
    }

    /// Hands the user's input to the session.
    fn hold(&self, viewer: &Viewer) {
        let wand = self.held.wand(viewer, |at_px| facet_ray(&self.view, &self.facet, at_px));
        *self.link.held.lock().unwrap_or_else(PoisonError::into_inner) = (self.held.keys.clone(), wand);
    }
}

impl Windows {
    /// Draws a frame for all windows.
    fn draw(&mut self, wall: &mut Wall, request: RenderRequest) {
        let text = |error: RenderError| error.to_string();
        let RenderRequest { list, viewer, wanted } = request;
        let stage = wall.renderer().stage(&list).map_err(text);
        let draw = |(k, window): (usize, &mut FacetWindow)| {
            apply_viewer(&mut window.view, &viewer, wanted.frame);
            window.hold(&viewer);
            window.draw(wall, k, stage.as_ref().map_err(String::clone)?, &wanted).map_err(text)
        };
        // all are recorded before the device is waited for
        let drawn: Vec<_> = self.windows.iter_mut().enumerate().map(draw).collect();
        let finished = wall.renderer().wait().map_err(text);
        for (window, picture) in self.windows.iter().zip(drawn) {
            let picture = finished.clone().and(picture).and_then(|picture| picture.wait().map_err(text));
            window.link.pictures.put(wanted.frame, false, picture);
        }
        self.viewer = viewer;
    }

    /// Shows a frame in a window. A hidden one shows nothing and does not delay the others.
    fn present(&mut self, wall: &mut Wall, k: usize, frame: u64) -> Result<(), Failure> {
        let pattern = self.windows[k].patterns.iter().find(|(other, _)| *other == frame);
        // a pattern covers the picture
        let number = || self.burn_in.then(|| burn_in::strip(wall.size_px(k)[0], frame));
        let caption = pattern.and_then(|(_, pattern)| pattern.clone()).or_else(number);
        wall.set_caption(k, caption);
        wall.show(k, frame)?;
        Ok(())
    }
}

impl WallApp for Windows {
    type Error = Failure;
    type Message = WallMessage;

    fn opened(&mut self, wall: &mut Wall) -> Result<(), Failure> {
        self.probe = None;
        let (software, adapter) = (wall.renderer().is_software(), wall.renderer().adapter().to_owned());
        let _ = self.device.set(Device { software, adapter });
        Ok(())
    }

    fn event(&mut self, _: &mut Wall, k: usize, event: &WindowEvent) -> Result<(), Failure> {
        let window = &mut self.windows[k];
        window.held.event(event);
        window.hold(&self.viewer);
        if window.held.ended || matches!(event, WindowEvent::CloseRequested | WindowEvent::Destroyed) {
            self.end.store(true, Ordering::Relaxed);
        }
        Ok(())
    }

    fn message(&mut self, wall: &mut Wall, message: WallMessage) -> Result<bool, Failure> {
        match message {
            WallMessage::Draw(request) => self.draw(wall, *request),
            WallMessage::Present { window, frame, done } => {
                let _ = done.send(self.present(wall, window, frame)); // the session waits for it
            }
            WallMessage::Warn { window, passed_s } => {
                wall.set_caption(window, Some(no_server(passed_s)));
                wall.show_again(window)?;
            }
            WallMessage::Ended => self.ended += 1,
        }
        Ok(self.ended < self.windows.len())
    }
}

//! A facet in a window of its own. Keys and mouse are sent to the server as a user's input.

use super::burn_in;
use super::control::{FacetControl, STANDBY_INTERVAL};
use super::desktop::Probe;
use super::finish;
use super::render_thread::{ListMaker, PREVIEW_PX, slot_name};
use super::runner::FacetRunner;
use super::user_input::{HeldInput, InputSender};
use crate::cave::run_setup::{RunSetup, apply_viewer};
use crate::failure::Failure;
use crate::view::view_mode::ViewMode;
use std::time::{Duration, Instant};
use tumble::dynamics::World;
use tumble::net::sync::{Task, WaitReason};
use tumble::render::winit::event::WindowEvent;
use tumble::render::{
    CaveView, DrawList, Image, Next, Quality, Screen, WindowApp, WindowOptions, caption, finished_calibration_picture,
    run_window,
};
use tumble::scene::cave::{Display, Facet, Output};

/// Wait for a message between two polls of the window's input.
const POLL_INTERVAL: Duration = Duration::from_millis(8);

/// Returns the window of a facet, or of all facets if there is none.
pub fn window_options(setup: &RunSetup, view: &CaveView, facet: Option<&Facet>) -> WindowOptions {
    let title = format!("tumble: {} on {}", setup.scene.file, slot_name(facet));
    let plain = WindowOptions::new(title, view.size_px(facet, PREVIEW_PX));
    let display = facet.map_or_else(Display::default, |facet| facet.display.clone());
    let plain = WindowOptions {
        monitor: display.monitor,
        full_screen: display.full_screen,
        refresh_hz: display.refresh_hz,
        adapter: display.gpu,
        ..plain
    };
    match facet.map(|f| f.output) {
        Some(Output::Window { position_px }) => {
            WindowOptions { position_px: Some(position_px), decorated: false, resizable: false, ..plain }
        }
        _ => WindowOptions { resizable: facet.is_none(), ..plain },
    }
}

/// Everything that a facet needs to open its window.
pub struct WindowSetup {
    view_mode: ViewMode,
    lists: ListMaker,
    options: WindowOptions,
    user: u16,
    /// The world before the first frame.
    world: World,
}

impl WindowSetup {
    /// Prepares the window of a facet, or of all facets if there is none.
    pub fn new(setup: &RunSetup, facet: Option<&Facet>, lists: ListMaker) -> Result<WindowSetup, Failure> {
        let view = Box::new(setup.view()?);
        let options = window_options(setup, &view, facet);
        let user = facet.map_or(0, |f| f.user) as u16;
        let view_mode = match facet {
            Some(facet) => ViewMode::Facet(view, Box::new(facet.clone())),
            None => ViewMode::Unfolded(view),
        };
        Ok(WindowSetup { view_mode, lists, options, user, world: setup.world.fork() })
    }

    /// Opens the window and runs the facet until the run ends or the window is closed. `join` connects it to
    /// the server: before the window opens, or with `stand_by` when the launcher says so, and the window is
    /// hidden meanwhile. `probe` is a connection to the desktop, which ends when the window is open.
    pub fn show(
        self,
        control: &FacetControl,
        stand_by: bool,
        burn_in: bool,
        probe: Probe,
        mut join: impl FnMut() -> Result<FacetRunner, Failure>,
    ) -> Result<(), Failure> {
        let options = WindowOptions { visible: !stand_by, ..self.options.clone() };
        let window = Window {
            sender: InputSender::new(self.user),
            window_setup: self,
            burn_in,
            list: DrawList::default(),
            held: HeldInput::default(),
            warned: None,
            pattern: None,
            probe: Some(probe),
        };
        let runner = if stand_by { None } else { Some(join()?) };
        let mut app = FacetWindow { window, runner, control, join };
        let shown = run_window(&options, &mut app);
        match &mut app.runner {
            Some(runner) => finish(runner, shown),
            None => shown,
        }
    }
}

/// Returns the warning that the picture is old.
pub fn no_server(passed_s: u64) -> Image {
    caption(&[format!("no server for {passed_s} s; what you see is old")], 2)
}

struct Window {
    window_setup: WindowSetup,
    burn_in: bool,
    /// Draw list of the shown frame.
    list: DrawList,
    held: HeldInput,
    sender: InputSender,
    /// Number of seconds without a server in the last warning.
    warned: Option<u64>,
    /// The calibration pattern of the next picture.
    pattern: Option<Image>,
    /// Keeps the desktop from resetting until the window is open.
    probe: Option<Probe>,
}

/// A window with its facet, which has joined or stands by.
struct FacetWindow<'a, J> {
    window: Window,
    runner: Option<FacetRunner>,
    control: &'a FacetControl,
    join: J,
}

impl Window {
    /// Draws a picture that nobody sees: the first one takes seconds to compile pipelines, and the server does
    /// not know this facet yet.
    fn prepare(&mut self, screen: &mut Screen) -> Result<(), Failure> {
        let default = if screen.is_software() { Quality::fast() } else { Quality::default() };
        self.window_setup.lists.quality.get_or_insert(default);
        self.list = self.window_setup.lists.list(&self.window_setup.world)?;
        self.window_setup.view_mode.draw(screen, &self.list)?;
        screen.renderer().wait()?;
        self.probe = None;
        Ok(())
    }

    fn draw(&mut self, runner: &mut FacetRunner, screen: &mut Screen) -> Result<(), Failure> {
        let Some(frame) = runner.facet.begin() else { return Ok(()) };
        let (world, viewer): (&World, _) = (runner.facet.world(), runner.facet.viewer());
        let time_s = world.time();
        self.list = self.window_setup.lists.list(world)?;
        let (ViewMode::Facet(view, _) | ViewMode::Unfolded(view)) = &mut self.window_setup.view_mode else {
            return Ok(());
        };
        apply_viewer(view, viewer, frame);
        self.window_setup.view_mode.draw(screen, &self.list)?;
        self.pattern = match (&self.window_setup.view_mode, runner.pattern()) {
            (ViewMode::Facet(view, facet), Some(pattern)) => Some(finished_calibration_picture(view, facet, pattern)),
            _ => None,
        };
        // a frame is drawn when the device has finished; it is read back only for the log, and for
        // the console once a second
        let image = match runner.wants_picture() {
            true if self.pattern.is_some() => self.pattern.clone(),
            true => Some(screen.renderer().read()?),
            false => screen.renderer().wait().map(|()| None)?,
        };
        runner.drawn(frame, time_s, image)
    }

    fn present(&mut self, runner: &mut FacetRunner, screen: &mut Screen, frame: u64) -> Result<(), Failure> {
        // a pattern covers the picture
        let number = self.burn_in.then(|| burn_in::strip(screen.size_px()[0], frame));
        screen.set_caption(self.pattern.take().or(number));
        self.warned = None;
        // a hidden window shows nothing and must not delay the others
        screen.show()?;
        runner.present(frame)
    }

    /// Shows a warning that the picture is old.
    fn warn(&mut self, passed: u64, screen: &mut Screen) -> Result<(), Failure> {
        if passed >= 1 && self.warned != Some(passed) {
            self.warned = Some(passed);
            screen.set_caption(Some(no_server(passed)));
            screen.show()?;
        }
        Ok(())
    }

    /// Sends the user's input if the server does not have it yet.
    fn send(&mut self, runner: &mut FacetRunner, screen: &Screen) -> Result<(), Failure> {
        let ray = |at_px| self.window_setup.view_mode.ray(&self.list, screen.size_px(), at_px);
        let wand = self.held.wand(runner.facet.viewer(), ray);
        self.sender.send(&mut runner.facet, &self.held.keys, wand)
    }
}

impl<J: FnMut() -> Result<FacetRunner, Failure>> FacetWindow<'_, J> {
    /// Joins and shows the window when the launcher says so.
    fn stand_by(&mut self, screen: &mut Screen) -> Result<Next, Failure> {
        if self.control.should_stop() {
            return Ok(Next::End);
        }
        if !self.control.may_join() {
            return Ok(Next::At(Instant::now() + STANDBY_INTERVAL));
        }
        let runner = self.runner.insert((self.join)()?);
        screen.window().set_visible(true);
        runner.prepared(screen.is_software(), screen.adapter());
        Ok(Next::At(Instant::now()))
    }
}

impl<J: FnMut() -> Result<FacetRunner, Failure>> WindowApp for FacetWindow<'_, J> {
    type Error = Failure;

    fn opened(&mut self, screen: &mut Screen) -> Result<(), Failure> {
        self.window.prepare(screen)?;
        match &mut self.runner {
            Some(runner) => runner.prepared(screen.is_software(), screen.adapter()),
            None => self.control.reporter.update(|report| report.preparing = false),
        }
        Ok(())
    }

    fn event(&mut self, _: &mut Screen, event: &WindowEvent) -> Result<(), Failure> {
        self.window.held.event(event);
        Ok(())
    }

    fn turn(&mut self, screen: &mut Screen) -> Result<Next, Failure> {
        let Some(runner) = &mut self.runner else { return self.stand_by(screen) };
        let window = &mut self.window;
        let Some(task) = runner.next(POLL_INTERVAL)?.filter(|_| !window.held.ended) else { return Ok(Next::End) };
        match task {
            Task::Draw if !runner.has_room() => std::thread::sleep(POLL_INTERVAL),
            Task::Draw => window.draw(runner, screen)?,
            Task::Present(frame) => window.present(runner, screen, frame)?,
            Task::Wait(WaitReason::Server | WaitReason::Lost) => window.warn(runner.server_wait_s(), screen)?,
            Task::Wait(_) | Task::Ended(_) => {}
        }
        window.send(runner, screen)?;
        Ok(Next::At(Instant::now()))
    }
}

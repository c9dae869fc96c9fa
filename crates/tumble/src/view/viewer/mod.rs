//! The application in the window: state and drawing. `events.rs` handles keys and mouse, `panel.rs`
//! the sliders, `hud.rs` text and status lines. Steps are taken on another thread
//! ([`SimulationThread`]).

mod events;
mod hud;
mod panel;

use super::joints::Joints;
use super::keys::{self, Command};
use super::overlays::Overlays;
use super::presets::{Presets, distance};
use super::real_time::RealTime;
use super::simulation_thread::{Simulation, SimulationThread};
use super::statistics::Statistics;
use super::status::Log;
use super::user::User;
use super::view_mode::ViewMode;
use crate::args::ViewOptions;
use crate::failure::Failure;
use panel::Panel;
use std::path::PathBuf;
use std::time::{Duration, Instant};
use tumble::dynamics::{CameraChange, World, WorldError};
use tumble::render::winit::event::WindowEvent;
use tumble::render::{DebugDraw, DrawList, Drawing, Image, Next, Quality, Screen, Shown, WindowApp, caption};
use tumble::scene::{FileKind, SceneFile, visual_notes};
use tumble::sound::Listener;

/// Time between two status lines while only the simulation changes.
const STATUS_INTERVAL: Duration = Duration::from_millis(250);
/// Time between two updates while the window is idle.
const IDLE_INTERVAL: Duration = Duration::from_millis(20);
/// The simulation starts after this time even if the desktop shows no picture, as in a window that
/// opens hidden.
const FIRST_PICTURE_TIMEOUT: Duration = Duration::from_secs(5);
/// Pictures per second if the desktop does not report its refresh rate.
const DEFAULT_RATE: f64 = 60.0;

/// A scene in a window.
pub struct Viewer {
    name: String,
    simulation_thread: SimulationThread,
    drawing: Drawing,
    list: DrawList,
    view_mode: ViewMode,
    user: User,
    presets: Presets,
    overlays: Overlays,
    joints: Joints,
    panel: Panel,
    pointer: Pointer,
    statistics: Statistics,
    log: Log,
    show: Hud,
    limits: Limits,
    /// `None` until the graphics driver is known.
    quality: Option<Quality>,
    screenshot_dir: PathBuf,
    picture_wanted: bool,
    last_picture: Option<Image>,
    /// The camera that scripted events chose last.
    scripted_camera: Option<CameraChange>,
    /// Whether the shown picture is out of date.
    stale: bool,
    /// [`Simulation::changes`] of the present list.
    drawn: u64,
    ended: bool,
    shown: u64,
    /// Size of the window.
    size_px: [u32; 2],
    focused: bool,
    times: Times,
}

/// The mouse.
#[derive(Default)]
struct Pointer {
    at_px: [f64; 2],
    turning: bool,
    /// Fraction of a notch by which the wheel has turned.
    wheel: f64,
}

/// Visibility of text over the picture.
struct Hud {
    any: bool,
    statistics: bool,
    help: bool,
}

/// When the viewer ends by itself, and how often it draws.
struct Limits {
    pictures: Option<u64>,
    per_second: Option<f64>,
    /// The picture after which the graphics device is lost, for tests.
    device: Option<u64>,
}

/// Times of the last update, the last status line and the opening of the window.
struct Times {
    turn: Instant,
    hud: Option<Instant>,
    opened: Instant,
}

impl Viewer {
    /// Opens a viewer for a world at time 0.
    pub fn new(scene: &SceneFile, world: World, view_mode: ViewMode, options: &ViewOptions) -> Result<Viewer, Failure> {
        let mut drawing = Drawing::new(scene);
        let list = drawing.list(&world, &DebugDraw::default()).map_err(Failure::input)?;
        visual_notes(world.visuals()).iter().for_each(|note| eprintln!("{note}"));
        let mut presets = Presets::new(&world, &list);
        let mut user = User::new(view_mode.rig(&list), distance(&list.camera));
        if let Some(name) = &options.camera {
            if !presets.find(name) {
                return Err(Failure::input(format!(
                    "no camera `{name}`; expected one of {}",
                    presets.names().join(", ")
                )));
            }
            presets.camera(&world, &list).iter().for_each(|camera| user.look_from(camera));
        }
        let now = Instant::now();
        let robot = crate::args::kind(&options.scene.name) == FileKind::Urdf;
        // a robot of a URDF file has no drives and would collapse before it is seen
        let paused = options.paused || (robot && options.duration.is_none());
        let joints = Joints::new(scene, &world);
        let player = crate::player::wanted(&options.play, scene)?;
        let last = options.duration.map(|s| (s / world.settings().dt).round() as u64);
        Ok(Viewer {
            name: options.scene.name.clone(),
            simulation_thread: SimulationThread::new(Simulation::new(world, RealTime::new(paused), last, player)),
            drawing,
            list,
            view_mode,
            user,
            presets,
            overlays: Overlays { draw: options.debug_draw.0 },
            joints,
            panel: Panel::new(robot),
            pointer: Pointer::default(),
            statistics: Statistics::new(now),
            log: Log::create(options.status.as_deref())?,
            show: Hud { any: !options.no_hud, statistics: true, help: false },
            limits: Limits { pictures: options.frames, per_second: options.fps, device: options.lose_device },
            quality: options.quality,
            screenshot_dir: options.screenshot_dir.clone(),
            picture_wanted: options.screenshot.is_some(),
            last_picture: None,
            scripted_camera: None,
            stale: true,
            drawn: 0,
            ended: false,
            shown: 0,
            size_px: [0; 2],
            focused: false,
            times: Times { turn: now, hud: None, opened: now },
        })
    }

    /// After the window is closed: writes the last status line and returns the screenshot, if
    /// requested.
    pub fn finish(&mut self) -> Result<Option<Image>, Failure> {
        if self.log.wanted() {
            let status = self.status();
            self.log.write(status, true)?;
        }
        match self.simulation_thread.lock().error.take() {
            Some(error) => Err(Failure::run("the simulation stopped", error)),
            None => Ok(self.last_picture.take()),
        }
    }

    /// Updates the draw list to the present state.
    fn update_list(&mut self) -> Result<(), Failure> {
        let mut simulation = self.simulation_thread.lock();
        let (eye, forward) = (self.user.eye(), self.user.forward());
        simulation.ears = Listener::looking(eye, [0, 1, 2].map(|k| eye[k] + forward[k]), [0.0, 0.0, 1.0]);
        let world = &simulation.world;
        self.list = self.drawing.list(world, &self.overlays.draw).map_err(|e| Failure::run("the picture", e))?;
        self.drawn = simulation.changes;
        let scripted = world.looks().camera;
        if scripted != self.scripted_camera {
            self.user.look_from(&self.list.camera); // an event chose another one; the user is free to leave it
            self.scripted_camera = scripted;
        } else if let Some(camera) = self.presets.followed(world, &self.list) {
            self.user.look_from(&camera);
        }
        if let Some(quality) = &self.quality {
            quality.apply(&mut self.list.settings);
        }
        self.view_mode.widen_shadows(&mut self.list);
        self.view_mode.set_place(self.user.rig(), &mut self.list);
        if let Some(picker) = &simulation.picker {
            picker.draw(world, &mut self.list);
        }
        Ok(())
    }

    fn draw(&mut self, screen: &mut Screen) -> Result<(), Failure> {
        let clock = Instant::now();
        self.update_list()?;
        self.view_mode.draw(screen, &self.list)?;
        let lines = self.lines();
        screen.set_caption((!lines.is_empty()).then(|| caption(&lines, panel::scale(screen.size_px()[0]))));
        screen.set_panel(self.panel_image());
        if screen.show()? == Shown::Yes {
            self.stale = false;
            self.shown += 1;
        }
        if self.limits.device == Some(self.shown) {
            screen.lose_device();
        }
        self.statistics.pictures.add(clock.elapsed());
        Ok(())
    }

    /// Writes a screenshot. If it cannot be written, a message says so and the session continues.
    fn save_picture(&mut self, screen: &mut Screen) -> Result<(), Failure> {
        let frame = self.simulation_thread.lock().world.frame();
        self.update_list()?;
        let path = self.screenshot_dir.join(format!("{}_{frame:06}.png", file_name(&self.name)));
        match self.view_mode.picture(screen, &self.list)?.write_png(&path) {
            Ok(()) => eprintln!("picture: {}", path.display()),
            Err(error) => eprintln!("no picture: {error}"),
        }
        Ok(())
    }

    /// Takes the screenshot at the end, if requested.
    fn take_last(&mut self, screen: &mut Screen) -> Result<(), Failure> {
        if self.picture_wanted {
            self.update_list()?;
            self.last_picture = Some(self.view_mode.picture(screen, &self.list)?);
        }
        Ok(())
    }

    /// Time from one picture to the next.
    fn interval(&self, screen: &Screen) -> Duration {
        let desktop = || Some(f64::from(screen.window().current_monitor()?.refresh_rate_millihertz()?) / 1000.0);
        let rate = self.limits.per_second.or_else(desktop).filter(|rate| *rate >= 0.01).unwrap_or(DEFAULT_RATE);
        Duration::from_secs_f64(1.0 / rate.max(0.01))
    }

    /// Starts the simulation when the first picture is on the screen; before that the pipelines are
    /// built.
    fn begin(&mut self, screen: &mut Screen) -> Result<(), Failure> {
        if self.simulation_thread.runs() || (self.shown == 0 && self.times.opened.elapsed() < FIRST_PICTURE_TIMEOUT) {
            return Ok(());
        }
        screen.renderer().wait()?;
        self.times.turn = Instant::now();
        self.simulation_thread.start()
    }

    /// Moves the user by the held keys.
    fn walk(&mut self, screen: &Screen, passed_s: f64) {
        if self.user.moves() {
            self.presets.release();
            self.user.pass(passed_s);
            self.view_mode.set_place(self.user.rig(), &mut self.list);
            self.move_picker(screen);
            self.stale = true;
        }
    }
}

impl WindowApp for Viewer {
    type Error = Failure;

    fn opened(&mut self, screen: &mut Screen) -> Result<(), Failure> {
        let default = if screen.is_software() { Quality::fast() } else { Quality::default() };
        self.quality.get_or_insert(default);
        // opening took time; the simulation starts with the first picture
        self.times.turn = Instant::now();
        self.times.opened = self.times.turn;
        Ok(())
    }

    fn event(&mut self, screen: &mut Screen, event: &WindowEvent) -> Result<(), Failure> {
        self.handle(screen, event)
    }

    fn turn(&mut self, screen: &mut Screen) -> Result<Next, Failure> {
        let now = Instant::now();
        self.size_px = screen.size_px();
        let passed = (now - self.times.turn).as_secs_f64();
        self.times.turn = now;
        self.walk(screen, passed);
        if self.simulation_thread.is_broken() {
            return Err(Failure::run("the simulation", "its thread ended; the message above says why"));
        }
        let (moved, over, paused, counted) = {
            let mut simulation = self.simulation_thread.lock();
            let counted = self.statistics.count(now, &mut simulation.steps);
            (simulation.changes != self.drawn, simulation.is_over(), simulation.real_time.paused, counted)
        };
        self.stale |= moved;
        if counted {
            screen.window().set_title(&self.title(screen));
            self.stale |= self.show.any && self.show.statistics;
        }
        if self.stale || self.limits.pictures.is_some() {
            self.draw(screen)?;
        }
        self.write_status(now)?;
        self.begin(screen)?;
        if over || self.ended || self.limits.pictures.is_some_and(|pictures| self.shown >= pictures) {
            self.take_last(screen)?;
            return Ok(Next::End);
        }
        let active = !paused || self.user.moves() || self.stale || self.limits.pictures.is_some();
        Ok(Next::At(now + if active { self.interval(screen) } else { IDLE_INTERVAL }))
    }
}

/// Returns the part of a scene's name or path that serves as a file name.
fn file_name(scene: &str) -> String {
    let path = std::path::Path::new(scene);
    let stem = path.file_stem().and_then(|s| s.to_str()).filter(|s| *s != "scene");
    let folder = || path.parent().and_then(|p| p.file_name()).and_then(|s| s.to_str());
    stem.or_else(folder).unwrap_or("scene").to_string()
}

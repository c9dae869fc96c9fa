//! The program in the window: events in, steps and pictures out.

use super::hand::Hand;
use super::keys::{self, Command};
use super::overlays::Overlays;
use super::pace::Pace;
use super::presets::{Presets, distance};
use super::sight::Sight;
use super::statistics::Statistics;
use super::status::{Log, Status};
use super::user::{Body, User};
use crate::args::ViewOptions;
use crate::failure::Failure;
use crate::shots::write_png;
use std::path::PathBuf;
use std::time::{Duration, Instant};
use tumble::core::World;
use tumble::render::winit::event::{ElementState, MouseButton, MouseScrollDelta, WindowEvent};
use tumble::render::winit::keyboard::PhysicalKey;
use tumble::render::winit::window::Fullscreen;
use tumble::render::{DebugDraw, DrawList, Drawing, Image, Next, Quality, Screen, Shown, WindowApp, caption};
use tumble::scene::SceneFile;

/// Steps between two pictures take at most this long, and then one more.
const MOST_STEPPING: Duration = Duration::from_millis(100);
/// Between two status lines while nothing but time changes, and between two looks at the clock while nothing does.
const IDLE: Duration = Duration::from_millis(250);
/// What dragging turns, rad per pixel.
const TURN_RAD_PER_PX: f64 = 0.005;
/// Pictures per second where the desktop does not say how many it shows.
const USUAL_RATE: f64 = 60.0;

/// A scene that is looked at.
pub struct Viewer {
    name: String,
    world: World,
    /// The world at time 0.
    start: Vec<u8>,
    drawing: Drawing,
    list: DrawList,
    sight: Sight,
    user: User,
    presets: Presets,
    pace: Pace,
    hand: Option<Hand>,
    overlays: Overlays,
    pointer: Pointer,
    statistics: Statistics,
    log: Log,
    show: Captions,
    limits: Limits,
    /// `None` until it is known what draws.
    quality: Option<Quality>,
    shots: PathBuf,
    picture_wanted: bool,
    last_picture: Option<Image>,
    /// What stopped the simulation.
    trouble: Option<String>,
    /// Whether what is shown is no longer what is.
    stale: bool,
    ended: bool,
    shown: u64,
    /// Of the window.
    size_px: [u32; 2],
    focused: bool,
    times: Times,
}

/// The mouse.
#[derive(Default)]
struct Pointer {
    at_px: [f64; 2],
    turning: bool,
    /// Of the wheel, what is not yet a whole notch.
    wheel: f64,
}

/// Text over the picture.
struct Captions {
    any: bool,
    statistics: bool,
    help: bool,
}

/// When the viewer ends by itself, and how often it draws.
struct Limits {
    steps: Option<u64>,
    pictures: Option<u64>,
    per_second: Option<f64>,
}

/// Moments of the last turn, picture and status line.
struct Times {
    turn: Instant,
    picture: Option<Instant>,
    told: Option<Instant>,
}

impl Viewer {
    /// Of a world at time 0.
    pub fn new(scene: &SceneFile, world: World, sight: Sight, options: &ViewOptions) -> Result<Viewer, Failure> {
        let mut drawing = Drawing::new(scene);
        let list = drawing.list(&world, &DebugDraw::default()).map_err(Failure::input)?;
        let mut presets = Presets::new(&world, &list);
        let body = match &sight {
            Sight::Camera => Body::Eye(list.camera),
            Sight::Facet(view, _) | Sight::Unfolded(view) => {
                let user = match &sight {
                    Sight::Facet(_, facet) => &view.cave().users[facet.user],
                    _ => &view.cave().users[0],
                };
                Body::Cave { place: *view.place(), eye_m: user.eye_m.into(), forward: user.forward.into() }
            }
        };
        let mut user = User::new(body, distance(&list.camera));
        if let Some(name) = &options.camera {
            if !presets.find(name) {
                return Err(Failure::input(format!("no camera `{name}`; wanted one of {}", presets.names().join(", "))));
            }
            presets.camera(&world, &list).iter().for_each(|camera| user.look_from(camera));
        }
        let now = Instant::now();
        let dt = world.settings().dt;
        Ok(Viewer {
            name: options.scene.clone(),
            start: world.save(),
            drawing,
            list,
            sight,
            user,
            presets,
            pace: Pace::new(options.paused),
            hand: None,
            overlays: Overlays { draw: options.debug_draw.0 },
            pointer: Pointer::default(),
            statistics: Statistics::new(now),
            log: Log::create(options.status.as_deref())?,
            show: Captions { any: !options.plain, statistics: true, help: false },
            limits: Limits { steps: options.seconds.map(|s| (s / dt).round() as u64), pictures: options.frames, per_second: options.fps },
            quality: options.quality,
            shots: options.shots.clone(),
            picture_wanted: options.picture.is_some(),
            last_picture: None,
            trouble: None,
            stale: true,
            ended: false,
            shown: 0,
            size_px: [0; 2],
            focused: false,
            times: Times { turn: now, picture: None, told: None },
            world,
        })
    }

    /// After the window is closed: the last status line, and the picture of the end if it is wanted.
    pub fn finish(&mut self) -> Result<Option<Image>, Failure> {
        if self.log.wanted() {
            let status = self.status();
            self.log.tell(status, true)?;
        }
        match self.trouble.take() {
            Some(trouble) => Err(Failure::run("the simulation stopped", trouble)),
            None => Ok(self.last_picture.take()),
        }
    }

    fn act(&mut self, screen: &mut Screen, command: Command) -> Result<(), Failure> {
        match command {
            Command::Pause => self.pace.toggle(),
            Command::Step => self.pace.step_once(),
            Command::Reset => self.reset()?,
            Command::Faster => self.pace.change_speed(1),
            Command::Slower => self.pace.change_speed(-1),
            Command::NextCamera => self.go_to(1),
            Command::LastCamera => self.go_to(-1),
            Command::Home => {
                self.presets.home();
                self.go_to(0);
            }
            Command::Fly => self.user.flies = !self.user.flies,
            Command::Overlay(index) => self.overlays.switch(index),
            Command::Statistics => (self.show.any, self.show.statistics) = (true, !(self.show.any && self.show.statistics)),
            Command::Help => (self.show.any, self.show.help) = (true, !self.show.help),
            Command::Picture => self.save_picture(screen)?,
            Command::Quality => {
                let all = [Quality::default(), Quality::fast(), Quality::fastest()];
                let next = all.iter().position(|q| Some(*q) == self.quality).map_or(0, |i| (i + 1) % all.len());
                self.quality = Some(all[next]);
            }
            Command::Fullscreen => {
                let full = screen.window().fullscreen().is_some();
                screen.window().set_fullscreen((!full).then_some(Fullscreen::Borderless(None)));
            }
            Command::Quit => self.ended = true,
        }
        self.stale = true;
        Ok(())
    }

    fn go_to(&mut self, by: isize) {
        self.presets.go(by);
        if let Some(camera) = self.presets.camera(&self.world, &self.list) {
            self.user.look_from(&camera);
        }
    }

    fn reset(&mut self) -> Result<(), Failure> {
        self.hand = None;
        self.trouble = None;
        self.world.restore(&self.start).map_err(|e| Failure::run("going back to time 0", e))
    }

    fn pointed(&mut self, screen: &Screen, at_px: [f64; 2]) {
        let [dx, dy] = std::array::from_fn(|k| at_px[k] - self.pointer.at_px[k]);
        self.pointer.at_px = at_px;
        if self.pointer.turning {
            self.presets.let_go();
            self.user.turn(-TURN_RAD_PER_PX * dx, -TURN_RAD_PER_PX * dy);
            self.stale = true;
        }
        self.move_hand(screen);
    }

    /// The hand stays below the pointer, wherever user and pointer go.
    fn move_hand(&mut self, screen: &Screen) {
        if let Some(hand) = &mut self.hand {
            if let Some(ray) = self.sight.ray(&self.list, screen.size_px(), self.pointer.at_px) {
                hand.follow(&ray);
            }
            self.stale = true;
        }
    }

    fn button(&mut self, screen: &Screen, button: MouseButton, down: bool) {
        match button {
            MouseButton::Left if down => {
                let ray = self.sight.ray(&self.list, screen.size_px(), self.pointer.at_px);
                self.hand = ray.and_then(|ray| Hand::pick(&self.world, &ray));
                self.pointer.turning = self.hand.is_none();
            }
            MouseButton::Left => (self.hand, self.pointer.turning) = (None, false),
            MouseButton::Right => self.pointer.turning = down,
            _ => {}
        }
        self.stale = true;
    }

    fn wheel(&mut self, screen: &Screen, up: f64) {
        match &mut self.hand {
            Some(hand) => hand.reach(1.1f64.powf(-up)),
            None => {
                self.pointer.wheel += up;
                let notches = self.pointer.wheel.trunc();
                self.pointer.wheel -= notches;
                self.user.change_speed(notches as i32);
            }
        }
        self.move_hand(screen);
        self.stale = true;
    }

    /// Takes the steps that are due.
    fn step(&mut self) -> Result<(), Failure> {
        let (begin, dt) = (Instant::now(), self.world.settings().dt);
        while self.trouble.is_none() && self.limits.steps.is_none_or(|steps| self.world.frame() < steps) && self.pace.take(dt) {
            if let Some(hand) = &self.hand {
                // what is no longer there lets go
                if hand.pull(&mut self.world).is_err() {
                    self.hand = None;
                }
            }
            let clock = Instant::now();
            if let Err(error) = self.world.step() {
                self.pace.paused = true;
                self.trouble = Some(error.to_string());
                if self.limits.steps.is_some() {
                    self.ended = true;
                }
            }
            self.statistics.step(clock.elapsed());
            self.stale = true;
            if begin.elapsed() > MOST_STEPPING {
                self.pace.give_up();
                break;
            }
        }
        Ok(())
    }

    /// The draw list of this moment.
    fn update_list(&mut self) -> Result<(), Failure> {
        self.list = self.drawing.list(&self.world, &self.overlays.draw).map_err(|e| Failure::run("the picture", e))?;
        if let Some(camera) = self.presets.followed(&self.world, &self.list) {
            self.user.look_from(&camera);
        }
        if let Some(quality) = &self.quality {
            quality.apply(&mut self.list.settings);
        }
        self.sight.widen_shadows(&mut self.list);
        self.sight.stand(self.user.body(), &mut self.list);
        if let Some(hand) = &self.hand {
            hand.draw(&self.world, &mut self.list);
        }
        Ok(())
    }

    fn draw(&mut self, screen: &mut Screen) -> Result<(), Failure> {
        let clock = Instant::now();
        self.update_list()?;
        self.sight.draw(screen, &self.list)?;
        let lines = self.lines();
        screen.set_caption((!lines.is_empty()).then(|| caption(&lines, if screen.size_px()[0] >= 960 { 2 } else { 1 })));
        if screen.show()? == Shown::Yes {
            self.stale = false;
            self.shown += 1;
        }
        self.statistics.picture(clock.elapsed());
        self.times.picture = Some(clock);
        Ok(())
    }

    fn lines(&self) -> Vec<String> {
        let mut lines = Vec::new();
        if self.show.any && self.show.statistics {
            let f = self.statistics.shown;
            let time = if self.pace.paused { "paused".to_string() } else { format!("{:.4}x", self.pace.speed()).replace(".0000", "") };
            lines.push(format!("{:.0} fps  t {:.3} s  {time}", f.pictures_per_s, self.world.time()));
            lines.push(format!("picture {:.1} ms  step {:.2} ms  {:.0} steps/s", f.drawing_ms, f.step_ms, f.steps_per_s));
            lines.push(format!("contacts {}  behind {:.1} s  camera {}", self.world.contacts().len(), self.pace.behind_s, self.presets.name()));
        }
        lines.extend(self.trouble.iter().map(|trouble| format!("stopped: {trouble}. R goes back to time 0")));
        if self.show.any && self.show.help {
            lines.extend(keys::HELP.iter().map(|line| line.to_string()));
        }
        lines
    }

    fn save_picture(&mut self, screen: &mut Screen) -> Result<(), Failure> {
        self.update_list()?;
        let path = self.shots.join(format!("{}_{:06}.png", file_name(&self.name), self.world.frame()));
        write_png(&self.sight.picture(screen, &self.list)?, &path)?;
        eprintln!("picture: {}", path.display());
        Ok(())
    }

    fn status(&self) -> Status {
        let held = self.hand.as_ref().and_then(|hand| hand.held(&self.world));
        Status {
            frame: self.world.frame(),
            time_s: self.world.time(),
            paused: self.pace.paused,
            speed: self.pace.speed(),
            behind_s: self.pace.behind_s,
            shown: self.shown,
            size_px: self.size_px,
            focused: self.focused,
            eye_m: self.user.eye(),
            forward: self.user.forward(),
            camera: self.presets.name().to_string(),
            flies: self.user.flies,
            step_m: self.user.step_m(),
            held: held.as_ref().map(|h| h.0.clone()),
            held_at_m: held.as_ref().map(|h| h.1.into()),
            hand_at_m: held.as_ref().map(|h| h.2.into()),
            quality: self.quality.map(|q| q.to_string()),
            overlays: self.overlays.names(),
            caption: self.show.any && (self.show.statistics || self.show.help),
            state_blake3: blake3::hash(&self.world.save()).to_hex().to_string(),
        }
    }

    fn tell(&mut self, now: Instant) -> Result<(), Failure> {
        if !self.log.wanted() {
            return Ok(());
        }
        let due = self.times.told.is_none_or(|told| now - told >= IDLE);
        let status = self.status();
        if due {
            self.times.told = Some(now);
        }
        self.log.tell(status, due)
    }

    /// Time from one picture to the next.
    fn interval(&self, screen: &Screen) -> Duration {
        let desktop = || Some(f64::from(screen.window().current_monitor()?.refresh_rate_millihertz()?) / 1000.0);
        let rate = self.limits.per_second.or_else(desktop).filter(|rate| *rate >= 0.01).unwrap_or(USUAL_RATE);
        Duration::from_secs_f64(1.0 / rate.max(0.01))
    }

    fn is_over(&self) -> bool {
        let reached = |limit: Option<u64>, now: u64| limit.is_some_and(|limit| now >= limit);
        self.ended || reached(self.limits.steps, self.world.frame()) || reached(self.limits.pictures, self.shown)
    }
}

impl WindowApp for Viewer {
    type Error = Failure;

    fn opened(&mut self, screen: &mut Screen) -> Result<(), Failure> {
        let usual = if screen.is_software() { Quality::fast() } else { Quality::default() };
        self.quality.get_or_insert(usual);
        // opening took its time; the simulation starts now
        self.times.turn = Instant::now();
        Ok(())
    }

    fn event(&mut self, screen: &mut Screen, event: &WindowEvent) -> Result<(), Failure> {
        match event {
            WindowEvent::KeyboardInput { event, .. } => {
                let down = event.state == ElementState::Pressed;
                if let PhysicalKey::Code(code) = event.physical_key
                    && let Some(way) = keys::way(code)
                {
                    if down { self.user.press(way) } else { self.user.release(way) }
                }
                if down && !event.repeat && let Some(command) = keys::command(&event.logical_key) {
                    self.act(screen, command)?;
                }
            }
            WindowEvent::ModifiersChanged(modifiers) => self.user.fast = modifiers.state().shift_key(),
            WindowEvent::CursorMoved { position, .. } => self.pointed(screen, [position.x, position.y]),
            WindowEvent::MouseInput { state, button, .. } => self.button(screen, *button, *state == ElementState::Pressed),
            WindowEvent::MouseWheel { delta, .. } => {
                let up = match delta {
                    MouseScrollDelta::LineDelta(_, y) => f64::from(*y),
                    MouseScrollDelta::PixelDelta(p) => p.y / 20.0,
                };
                if up != 0.0 {
                    self.wheel(screen, up);
                }
            }
            WindowEvent::Focused(true) => self.focused = true,
            WindowEvent::Focused(false) => {
                self.focused = false;
                self.user.release_all();
                (self.hand, self.pointer.turning) = (None, false);
            }
            WindowEvent::Resized(_) => self.stale = true,
            WindowEvent::CloseRequested => self.take_last(screen)?,
            _ => {}
        }
        Ok(())
    }

    fn turn(&mut self, screen: &mut Screen) -> Result<Next, Failure> {
        let now = Instant::now();
        self.size_px = screen.size_px();
        let passed = (now - self.times.turn).as_secs_f64();
        self.times.turn = now;
        if self.user.moves() {
            self.presets.let_go();
            self.user.pass(passed);
            self.sight.stand(self.user.body(), &mut self.list);
            self.move_hand(screen);
            self.stale = true;
        }
        self.pace.pass(passed);
        self.step()?;
        if self.statistics.count(now) {
            screen.window().set_title(&self.title(screen));
            self.stale |= self.show.any && self.show.statistics;
        }
        if self.stale || self.limits.pictures.is_some() {
            self.draw(screen)?;
        }
        self.tell(now)?;
        if self.is_over() {
            self.take_last(screen)?;
            return Ok(Next::End);
        }
        let active = !self.pace.paused || self.user.moves() || self.stale || self.limits.pictures.is_some();
        Ok(Next::At(now + if active { self.interval(screen) } else { IDLE.min(Duration::from_millis(20)) }))
    }
}

impl Viewer {
    /// The picture of the end, where one is wanted.
    fn take_last(&mut self, screen: &mut Screen) -> Result<(), Failure> {
        if self.picture_wanted {
            self.update_list()?;
            self.last_picture = Some(self.sight.picture(screen, &self.list)?);
        }
        Ok(())
    }

    fn title(&self, screen: &Screen) -> String {
        let f = self.statistics.shown;
        let on = match &self.sight {
            Sight::Camera => String::new(),
            Sight::Facet(_, facet) => format!(" on {}", facet.name),
            Sight::Unfolded(view) => format!(" in {}", view.cave().file),
        };
        let [w, h] = screen.size_px();
        let state = if self.pace.paused { "paused" } else { "running" };
        format!("tumble: {}{on} ({state}, t {:.2} s, {:.0} fps, {w}x{h})", self.name, self.world.time(), f.pictures_per_s)
    }
}

/// What of a scene's name or path serves as a file's name.
fn file_name(scene: &str) -> String {
    let path = std::path::Path::new(scene);
    let stem = path.file_stem().and_then(|s| s.to_str()).filter(|s| *s != "scene");
    let folder = || path.parent().and_then(|p| p.file_name()).and_then(|s| s.to_str());
    stem.or_else(folder).unwrap_or("scene").to_string()
}

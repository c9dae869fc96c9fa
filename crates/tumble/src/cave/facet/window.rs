//! A facet in a window of its own. Keys and mouse are sent to the server as a user's input.
//!
//! W A S D, Q E and the arrow keys move the cave. V and B stretch out the left and the right hand
//! (`--user-colliders`). The left mouse button pulls a body. Escape ends the facet.

use super::burn_in;
use super::desktop::Probe;
use super::render_thread::{PREVIEW_PX, draw_list, slot_name};
use super::runner::{FacetRunner, failed};
use crate::cave::run_setup::{RunSetup, apply_viewer};
use crate::failure::Failure;
use crate::view::view_mode::ViewMode;
use std::time::{Duration, Instant};
use tumble::collide::Pose;
use tumble::dynamics::World;
use tumble::net::sync::{Input, Task, WaitReason};
use tumble::render::winit::event::{ElementState, MouseButton, WindowEvent};
use tumble::render::winit::keyboard::{KeyCode, PhysicalKey};
use tumble::render::{
    DebugDraw, DrawList, Drawing, Image, Next, Quality, Screen, WindowApp, WindowOptions, caption,
    finished_calibration_picture, run_window,
};
use tumble::scene::cave::{Display, Facet, Output};

/// Wait for a message between two polls of the window's input.
const POLL_INTERVAL: Duration = Duration::from_millis(8);
/// Interval at which unchanged input is sent again, because the server expires it.
const INPUT_RESEND_INTERVAL: Duration = Duration::from_millis(250);

/// Everything that a facet needs to open its window.
pub struct WindowSetup {
    view_mode: ViewMode,
    drawing: Drawing,
    quality: Option<Quality>,
    overlays: DebugDraw,
    options: WindowOptions,
    user: u16,
}

impl WindowSetup {
    /// Prepares the window of a facet, or of all facets if there is none.
    pub fn new(
        setup: &RunSetup,
        facet: Option<&Facet>,
        quality: Option<Quality>,
        overlays: DebugDraw,
    ) -> Result<WindowSetup, Failure> {
        let view = Box::new(setup.view()?);
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
        let options = match facet.map(|f| f.output) {
            Some(Output::Window { position_px }) => {
                WindowOptions { position_px: Some(position_px), decorated: false, resizable: false, ..plain }
            }
            _ => WindowOptions { resizable: facet.is_none(), ..plain },
        };
        let user = facet.map_or(0, |f| f.user) as u16;
        let view_mode = match facet {
            Some(facet) => ViewMode::Facet(view, Box::new(facet.clone())),
            None => ViewMode::Unfolded(view),
        };
        Ok(WindowSetup { view_mode, drawing: Drawing::new(&setup.scene), quality, overlays, options, user })
    }

    /// Opens the window and runs the facet until the run ends or the window is closed.
    /// `probe` is a connection to the desktop, which ends when the window is open.
    pub fn show(self, runner: &mut FacetRunner, burn_in: bool, probe: Option<Probe>) -> Result<(), Failure> {
        let options = self.options.clone();
        let mut window = Window {
            window_setup: self,
            runner,
            burn_in,
            list: DrawList::default(),
            keys: Vec::new(),
            pulling: false,
            at_px: [0.0; 2],
            sent: None,
            sequence: 0,
            warned: None,
            ended: false,
            pattern: None,
            probe,
        };
        run_window(&options, &mut window)
    }
}

struct Window<'a> {
    window_setup: WindowSetup,
    runner: &'a mut FacetRunner,
    burn_in: bool,
    /// Draw list of the shown frame.
    list: DrawList,
    /// Held keys by USB HID usage.
    keys: Vec<u16>,
    pulling: bool,
    at_px: [f64; 2],
    /// The newest input, and when it was sent.
    sent: Option<(Input, Instant)>,
    sequence: u64,
    /// Number of seconds without a server in the last warning.
    warned: Option<u64>,
    ended: bool,
    /// The calibration pattern of the next picture.
    pattern: Option<Image>,
    /// Keeps the desktop from resetting until the window is open.
    probe: Option<Probe>,
}

impl Window<'_> {
    fn draw(&mut self, screen: &mut Screen) -> Result<(), Failure> {
        let Some(frame) = self.runner.facet.begin() else { return Ok(()) };
        let (world, viewer): (&World, _) = (self.runner.facet.world(), self.runner.facet.viewer());
        let time_s = world.time();
        let WindowSetup { drawing, quality, overlays, .. } = &mut self.window_setup;
        self.list = draw_list(drawing, world, quality.as_ref(), overlays)?;
        let (ViewMode::Facet(view, _) | ViewMode::Unfolded(view)) = &mut self.window_setup.view_mode else {
            return Ok(());
        };
        apply_viewer(view, viewer, frame);
        self.window_setup.view_mode.draw(screen, &self.list)?;
        self.pattern = match (&self.window_setup.view_mode, self.runner.pattern()) {
            (ViewMode::Facet(view, facet), Some(pattern)) => Some(finished_calibration_picture(view, facet, pattern)),
            _ => None,
        };
        // a frame is drawn when the device has finished; it is read back only for the log, and for
        // the console once a second
        let image = match self.runner.wants_picture() {
            true if self.pattern.is_some() => self.pattern.clone(),
            true => Some(screen.renderer().read()?),
            false => screen.renderer().wait().map(|()| None)?,
        };
        self.runner.drawn(frame, time_s, image)
    }

    fn present(&mut self, screen: &mut Screen, frame: u64) -> Result<(), Failure> {
        // a pattern covers the picture
        let number = self.burn_in.then(|| burn_in::strip(screen.size_px()[0], frame));
        screen.set_caption(self.pattern.take().or(number));
        self.warned = None;
        // a hidden window shows nothing and must not delay the others
        screen.show()?;
        self.runner.present(frame)
    }

    /// Shows a warning that the picture is old.
    fn warn(&mut self, screen: &mut Screen) -> Result<(), Failure> {
        let passed = self.runner.server_wait_s();
        if passed >= 1 && self.warned != Some(passed) {
            self.warned = Some(passed);
            screen.set_caption(Some(caption(&[format!("no server for {passed} s; what you see is old")], 2)));
            screen.show()?;
        }
        Ok(())
    }

    /// Sends the user's input if the server does not have it yet.
    fn send(&mut self, screen: &Screen) -> Result<(), Failure> {
        let wand = if self.pulling { self.wand(screen) } else { None };
        let (keys, buttons) = (self.keys.clone(), u32::from(wand.is_some()));
        let idle = keys.is_empty() && buttons == 0;
        let known = |(sent, at): &(Input, Instant)| {
            sent.keys == keys
                && sent.buttons == buttons
                && sent.wand == wand
                && (idle || at.elapsed() < INPUT_RESEND_INTERVAL)
        };
        if self.sent.as_ref().map_or(idle, known) {
            return Ok(());
        }
        self.sequence += 1;
        let input = Input {
            sequence: self.sequence,
            user: self.window_setup.user,
            head: None,
            wand,
            hands: [None; 2],
            buttons,
            keys,
        };
        if self.runner.facet.send_input(&input).map_err(failed)? {
            self.sent = Some((input, Instant::now()));
        }
        Ok(())
    }

    /// Returns the line of sight through the pointer in the cave's frame: from the eye along its y
    /// axis.
    fn wand(&self, screen: &Screen) -> Option<Pose> {
        let ray = self.window_setup.view_mode.ray(&self.list, screen.size_px(), self.at_px)?;
        let viewer = self.runner.facet.viewer();
        let origin = viewer.cave.inverse() * nalgebra::Point3::from(ray.origin);
        let direction = viewer.cave.rotation.inverse() * ray.direction;
        let aside = if direction.z.abs() < 0.9 { nalgebra::Vector3::z() } else { nalgebra::Vector3::x() };
        let right = direction.cross(&aside).normalize();
        let axes = nalgebra::Matrix3::from_columns(&[right, direction, right.cross(&direction)]);
        let rotation =
            nalgebra::UnitQuaternion::from_rotation_matrix(&nalgebra::Rotation3::from_matrix_unchecked(axes));
        Some(Pose::from_parts((origin.coords / viewer.scale).into(), rotation))
    }
}

impl WindowApp for Window<'_> {
    type Error = Failure;

    fn opened(&mut self, screen: &mut Screen) -> Result<(), Failure> {
        let default = if screen.is_software() { Quality::fast() } else { Quality::default() };
        self.window_setup.quality.get_or_insert(default);
        // the first picture takes seconds to compile pipelines; the server does not know this facet
        // yet
        self.list = {
            let WindowSetup { drawing, quality, overlays, .. } = &mut self.window_setup;
            draw_list(drawing, self.runner.facet.world(), quality.as_ref(), overlays)?
        };
        self.window_setup.view_mode.draw(screen, &self.list)?;
        screen.renderer().wait()?;
        self.probe = None;
        self.runner.prepared(screen.is_software(), screen.adapter());
        Ok(())
    }

    fn event(&mut self, _: &mut Screen, event: &WindowEvent) -> Result<(), Failure> {
        match event {
            WindowEvent::KeyboardInput { event, .. } => {
                let down = event.state == ElementState::Pressed;
                let PhysicalKey::Code(code) = event.physical_key else { return Ok(()) };
                self.ended |= down && code == KeyCode::Escape;
                if let Some(key) = usage(code) {
                    self.keys.retain(|held| *held != key);
                    self.keys.extend(down.then_some(key));
                }
            }
            WindowEvent::CursorMoved { position, .. } => self.at_px = [position.x, position.y],
            WindowEvent::MouseInput { state, button: MouseButton::Left, .. } => {
                self.pulling = *state == ElementState::Pressed
            }
            WindowEvent::Focused(false) => {
                self.keys.clear();
                self.pulling = false;
            }
            _ => {}
        }
        Ok(())
    }

    fn turn(&mut self, screen: &mut Screen) -> Result<Next, Failure> {
        let Some(task) = self.runner.next(POLL_INTERVAL)?.filter(|_| !self.ended) else { return Ok(Next::End) };
        match task {
            Task::Draw if !self.runner.has_room() => std::thread::sleep(POLL_INTERVAL),
            Task::Draw => self.draw(screen)?,
            Task::Present(frame) => self.present(screen, frame)?,
            Task::Wait(WaitReason::Server | WaitReason::Lost) => self.warn(screen)?,
            Task::Wait(_) | Task::Ended(_) => {}
        }
        self.send(screen)?;
        Ok(Next::At(Instant::now()))
    }
}

/// Returns the USB HID usage (page 7) of a key that moves a user or makes an event fire.
fn usage(code: KeyCode) -> Option<u16> {
    Some(match code {
        KeyCode::KeyA => 0x04,
        KeyCode::KeyB => 0x05,
        KeyCode::KeyD => 0x07,
        KeyCode::KeyE | KeyCode::PageUp => 0x08,
        KeyCode::KeyQ | KeyCode::PageDown => 0x14,
        KeyCode::KeyS => 0x16,
        KeyCode::KeyV => 0x19,
        KeyCode::KeyW => 0x1A,
        KeyCode::ArrowRight => 0x4F,
        KeyCode::ArrowLeft => 0x50,
        KeyCode::ArrowDown => 0x51,
        KeyCode::ArrowUp => 0x52,
        KeyCode::Enter => 0x28,
        other => FREE_KEYS.iter().find(|(code, _)| *code == other)?.1,
    })
}

/// Keys that do not move a user, with their usages.
const FREE_KEYS: [(KeyCode, u16); 28] = [
    (KeyCode::KeyC, 0x06),
    (KeyCode::KeyF, 0x09),
    (KeyCode::KeyG, 0x0A),
    (KeyCode::KeyH, 0x0B),
    (KeyCode::KeyI, 0x0C),
    (KeyCode::KeyJ, 0x0D),
    (KeyCode::KeyK, 0x0E),
    (KeyCode::KeyL, 0x0F),
    (KeyCode::KeyM, 0x10),
    (KeyCode::KeyN, 0x11),
    (KeyCode::KeyO, 0x12),
    (KeyCode::KeyP, 0x13),
    (KeyCode::KeyR, 0x15),
    (KeyCode::KeyT, 0x17),
    (KeyCode::KeyU, 0x18),
    (KeyCode::KeyX, 0x1B),
    (KeyCode::KeyY, 0x1C),
    (KeyCode::KeyZ, 0x1D),
    (KeyCode::Digit1, 0x1E),
    (KeyCode::Digit2, 0x1F),
    (KeyCode::Digit3, 0x20),
    (KeyCode::Digit4, 0x21),
    (KeyCode::Digit5, 0x22),
    (KeyCode::Digit6, 0x23),
    (KeyCode::Digit7, 0x24),
    (KeyCode::Digit8, 0x25),
    (KeyCode::Digit9, 0x26),
    (KeyCode::Digit0, 0x27),
];

//! Keys, mouse and window events.

use super::*;
use crate::view::picker::Picker;
use crate::view::view_mode::Ray;
use tumble::render::winit::event::{ElementState, MouseButton, MouseScrollDelta};
use tumble::render::winit::keyboard::PhysicalKey;
use tumble::render::winit::window::Fullscreen;

/// Turn per pixel of dragging, rad.
const TURN_RAD_PER_PX: f64 = 0.005;

impl Viewer {
    /// Handles a window event.
    pub(super) fn handle(&mut self, screen: &mut Screen, event: &WindowEvent) -> Result<(), Failure> {
        match event {
            WindowEvent::KeyboardInput { event, .. } => {
                let down = event.state == ElementState::Pressed;
                if let PhysicalKey::Code(code) = event.physical_key
                    && let Some(movement) = keys::movement(code)
                {
                    if down { self.user.press(movement) } else { self.user.release(movement) }
                }
                if down
                    && !event.repeat
                    && let Some(name) = keys::name(&event.logical_key)
                {
                    self.simulation_thread.lock().world.press(&name);
                }
                if down
                    && let Some(command) = keys::command(&event.logical_key)
                    && (!event.repeat || command.repeats())
                {
                    self.act(screen, command)?;
                }
            }
            WindowEvent::ModifiersChanged(modifiers) => self.user.fast = modifiers.state().shift_key(),
            WindowEvent::CursorMoved { position, .. } => self.pointer_moved(screen, [position.x, position.y])?,
            WindowEvent::MouseInput { state, button, .. } => {
                self.button(screen, *button, *state == ElementState::Pressed)?
            }
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
                self.simulation_thread.lock().picker = None;
                self.pointer.turning = false;
                self.panel.release();
            }
            WindowEvent::Resized(_) => self.stale = true,
            WindowEvent::CloseRequested => self.take_last(screen)?,
            _ => {}
        }
        Ok(())
    }

    fn act(&mut self, screen: &mut Screen, command: Command) -> Result<(), Failure> {
        match command {
            Command::Pause => self.simulation_thread.lock().real_time.toggle(),
            Command::Step => self.simulation_thread.lock().real_time.step_once(),
            Command::Reset => {
                let mut simulation = self.simulation_thread.lock();
                self.joints.release(&mut simulation.world);
                simulation.reset()?;
            }
            Command::Faster => self.simulation_thread.lock().real_time.change_speed(1),
            Command::Slower => self.simulation_thread.lock().real_time.change_speed(-1),
            Command::NextCamera => self.go_to(1),
            Command::PreviousCamera => self.go_to(-1),
            Command::Home => {
                self.presets.home();
                self.go_to(0);
            }
            Command::Fly => self.user.flies = !self.user.flies,
            Command::Overlay(index) => self.overlays.switch(index),
            Command::Statistics => {
                (self.show.any, self.show.statistics) = (true, !(self.show.any && self.show.statistics))
            }
            Command::Help => (self.show.any, self.show.help) = (true, !self.show.help),
            Command::Sliders => (self.show.any, self.panel.wanted) = (true, !(self.show.any && self.panel.wanted)),
            Command::Hold => self.switch_hold(),
            Command::NextJoint => self.choose_joint(if self.user.fast { -1 } else { 1 }),
            Command::JointUp => self.nudge_joint(1.0)?,
            Command::JointDown => self.nudge_joint(-1.0)?,
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
        if let Some(camera) = self.presets.camera(&self.simulation_thread.lock().world, &self.list) {
            self.user.look_from(&camera);
        }
    }

    fn pointer_moved(&mut self, screen: &Screen, at_px: [f64; 2]) -> Result<(), Failure> {
        let [dx, dy] = std::array::from_fn(|k| at_px[k] - self.pointer.at_px[k]);
        self.pointer.at_px = at_px;
        if self.drag_slider()? {
            return Ok(());
        }
        if self.pointer.turning {
            self.presets.release();
            self.user.turn(-TURN_RAD_PER_PX * dx, -TURN_RAD_PER_PX * dy);
            self.stale = true;
        }
        self.move_picker(screen);
        Ok(())
    }

    /// The line of sight below the pointer.
    fn ray(&self, screen: &Screen) -> Option<Ray> {
        self.view_mode.ray(&self.list, screen.size_px(), self.pointer.at_px)
    }

    /// Keeps the spring's target below the pointer when the user or the pointer moves.
    pub(super) fn move_picker(&mut self, screen: &Screen) {
        let ray = self.ray(screen);
        if let Some(picker) = &mut self.simulation_thread.lock().picker {
            ray.iter().for_each(|ray| picker.follow(ray));
            self.stale = true;
        }
    }

    fn button(&mut self, screen: &Screen, button: MouseButton, down: bool) -> Result<(), Failure> {
        match button {
            MouseButton::Left if down && self.press_panel()? => {}
            MouseButton::Left if down => {
                let ray = self.ray(screen);
                let mut simulation = self.simulation_thread.lock();
                simulation.picker = ray.and_then(|ray| Picker::pick(&simulation.world, &ray));
                self.pointer.turning = simulation.picker.is_none();
            }
            MouseButton::Left => {
                self.simulation_thread.lock().picker = None;
                self.pointer.turning = false;
                self.panel.release();
            }
            MouseButton::Right => self.pointer.turning = down,
            _ => {}
        }
        self.stale = true;
        Ok(())
    }

    fn wheel(&mut self, screen: &Screen, up: f64) {
        let held = self
            .simulation_thread
            .lock()
            .picker
            .as_mut()
            .map(|picker| picker.scale_distance(1.1f64.powf(-up)))
            .is_some();
        if !held {
            self.pointer.wheel += up;
            let notches = self.pointer.wheel.trunc();
            self.pointer.wheel -= notches;
            self.user.change_speed(notches as i32);
        }
        self.move_picker(screen);
        self.stale = true;
    }
}

//! Keys and mouse of a facet's window, as a user's input.
//!
//! W A S D, Q E and the arrow keys move the cave. V and B stretch out the left and the right hand
//! (`--user-colliders`). The left mouse button pulls a body. Escape ends the facet.

use super::runner::failed;
use crate::cave::endpoints::FacetEndpoint;
use crate::failure::Failure;
use crate::view::view_mode::Ray;
use std::time::{Duration, Instant};
use tumble::collide::Pose;
use tumble::net::sync::{Facet, Input, Viewer};
use tumble::render::winit::event::{ElementState, MouseButton, WindowEvent};
use tumble::render::winit::keyboard::{KeyCode, PhysicalKey};

/// Interval at which unchanged input is sent again, because the server expires it.
const INPUT_RESEND_INTERVAL: Duration = Duration::from_millis(250);

/// Keys and mouse of a window.
#[derive(Default)]
pub struct HeldInput {
    /// Held keys by USB HID usage.
    pub keys: Vec<u16>,
    pulling: bool,
    at_px: [f64; 2],
    /// Whether the user has ended the facet.
    pub ended: bool,
}

impl HeldInput {
    /// Takes an event of the window.
    pub fn event(&mut self, event: &WindowEvent) {
        match event {
            WindowEvent::KeyboardInput { event, .. } => {
                let down = event.state == ElementState::Pressed;
                let PhysicalKey::Code(code) = event.physical_key else { return };
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
    }

    /// Returns the line of sight through the pointer in the cave's frame while it pulls: from the eye along
    /// its y axis. `ray` returns the line of sight through a pixel.
    pub fn wand(&self, viewer: &Viewer, ray: impl FnOnce([f64; 2]) -> Option<Ray>) -> Option<Pose> {
        let ray = ray(self.at_px).filter(|_| self.pulling)?;
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

/// Sends the input of a window to the server.
pub struct InputSender {
    user: u16,
    /// The newest input, and when it was sent.
    sent: Option<(Input, Instant)>,
    sequence: u64,
}

impl InputSender {
    /// Creates the sender of the input of a user.
    pub fn new(user: u16) -> InputSender {
        InputSender { user, sent: None, sequence: 0 }
    }

    /// Sends the user's input if the server does not have it yet.
    pub fn send(&mut self, facet: &mut Facet<FacetEndpoint>, keys: &[u16], wand: Option<Pose>) -> Result<(), Failure> {
        let buttons = u32::from(wand.is_some());
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
            user: self.user,
            head: None,
            wand,
            hands: [None; 2],
            buttons,
            keys: keys.to_vec(),
        };
        if facet.send_input(&input).map_err(failed)? {
            self.sent = Some((input, Instant::now()));
        }
        Ok(())
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

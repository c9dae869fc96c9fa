//! A camera that the mouse moves about a point.
//!
//! Drag with the left button: turn. Middle or right button: move. Wheel: distance.

use crate::Camera;
use nalgebra::{Point3, Unit, UnitQuaternion, Vector3};
use winit::event::{ElementState, MouseButton, MouseScrollDelta, WindowEvent};

/// Turn per pixel, rad.
const TURN: f32 = 0.006;
/// Steepest view up or down, rad.
const STEEPEST: f32 = 1.5;
/// Factor of the distance per notch of the wheel.
const NOTCH: f32 = 0.9;

/// How far the camera has left its home.
#[derive(Clone, Copy, Debug)]
pub struct Orbit {
    /// Turns about the vertical and up or down, rad.
    turn: [f32; 2],
    /// Factor of the distance.
    distance: f32,
    /// Movement of the target to the right and up, in distances.
    moved: [f32; 2],
    cursor: [f64; 2],
    held: Option<MouseButton>,
}

impl Default for Orbit {
    fn default() -> Orbit {
        Orbit { turn: [0.0; 2], distance: 1.0, moved: [0.0; 2], cursor: [0.0; 2], held: None }
    }
}

impl Orbit {
    /// Handles an event; returns whether the picture changes.
    pub fn handle(&mut self, event: &WindowEvent, [_, height]: [u32; 2]) -> bool {
        match event {
            WindowEvent::CursorMoved { position, .. } => {
                let now = [position.x, position.y];
                let by = [(now[0] - self.cursor[0]) as f32, (now[1] - self.cursor[1]) as f32];
                self.cursor = now;
                match self.held {
                    Some(MouseButton::Left) => {
                        self.turn = [self.turn[0] - TURN * by[0], self.turn[1] + TURN * by[1]];
                    }
                    Some(_) => {
                        let scale = 0.73 * self.distance / height.max(1) as f32; // 2·tan(40°/2)
                        self.moved = [self.moved[0] - scale * by[0], self.moved[1] + scale * by[1]];
                    }
                    None => return false,
                }
            }
            WindowEvent::MouseInput { state, button, .. } => {
                self.held = (*state == ElementState::Pressed).then_some(*button);
                return false;
            }
            WindowEvent::MouseWheel { delta, .. } => {
                let up = match delta {
                    MouseScrollDelta::LineDelta(_, y) => *y,
                    MouseScrollDelta::PixelDelta(p) => p.y as f32 / 20.0,
                };
                self.distance = (self.distance * NOTCH.powf(up)).clamp(1e-3, 1e3);
            }
            WindowEvent::Focused(false) => {
                self.held = None;
                return false;
            }
            WindowEvent::Resized(_) | WindowEvent::RedrawRequested => {}
            _ => return false,
        }
        true
    }

    /// Returns the camera for a home.
    pub fn camera(&self, home: &Camera) -> Camera {
        let Camera::LookAt { eye, target, up, vertical_fov_rad, near_m, far_m } = *home else { return *home };
        let away = eye - target;
        let length = away.norm();
        let vertical = Unit::new_normalize(up);
        let pitch = (away.dot(&vertical) / length).clamp(-1.0, 1.0).asin();
        let right = Unit::new_normalize(up.cross(&away));
        let rise = (pitch + self.turn[1]).clamp(-STEEPEST, STEEPEST) - pitch;
        let turned =
            UnitQuaternion::from_axis_angle(&vertical, self.turn[0]) * UnitQuaternion::from_axis_angle(&right, -rise);
        let away = turned * away * self.distance;
        let right = up.cross(&away).normalize();
        let above = away.cross(&right).normalize();
        let by: Vector3<f32> = (right * self.moved[0] + above * self.moved[1]) * length;
        let target: Point3<f32> = target + by;
        let (near_m, far_m) = (near_m * self.distance.min(1.0), far_m * self.distance.max(1.0));
        Camera::LookAt { eye: target + away, target, up, vertical_fov_rad, near_m, far_m }
    }
}

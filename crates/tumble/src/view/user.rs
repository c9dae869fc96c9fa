//! Position and direction of the user, moved by keys and mouse (thesis §III.C: the keyboard moves
//! the user and changes the elevation, the mouse turns).
//!
//! The speed is the distance covered in a second of holding a key. A tap moves by a tenth of it,
//! however short the tap is and however slow the pictures are.

use nalgebra::{Point3, Vector3};
use tumble::render::Camera;
use tumble::scene::CavePlace;

/// A tap moves as far as holding the key for this time, s.
const TAP_S: f64 = 0.1;
/// A key held for longer than this continues after the tap's step, s.
const HOLD_S: f64 = 0.3;
/// Longest time per update that counts for a held key, s.
const MAX_TURN_S: f64 = 0.1;
/// Turning by keys, rad/s.
const TURN_RAD_PER_S: f64 = 1.5;
/// Steepest view up or down, rad.
const MAX_PITCH_RAD: f64 = 1.55;
/// Factor of the speed with Shift.
const FAST: f64 = 4.0;

type Vec3 = Vector3<f64>;

/// Movements of the user that keys control.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Movement {
    Ahead,
    Back,
    Left,
    Right,
    Up,
    Down,
    TurnLeft,
    TurnRight,
}

/// The eye or eyes of the user.
#[derive(Clone, Debug, PartialEq)]
pub enum Rig {
    /// One eye: a camera.
    Eye(Camera),
    /// The user of a cave: the cave's place in the scene, the eye in the cave, and the direction of
    /// view there.
    Cave { place: CavePlace, eye_m: [f64; 3], forward: [f64; 3] },
}

/// The user.
pub struct User {
    rig: Rig,
    /// Whether movement follows the direction of view; otherwise it is level.
    pub flies: bool,
    /// Speed while a key is held, m/s.
    pub speed: f64,
    /// Whether Shift is held.
    pub fast: bool,
    keys: Vec<HeldKey>,
}

/// A movement key that is held or was tapped: time since it went down, time of movement done, and
/// whether it is up again.
struct HeldKey {
    movement: Movement,
    down_s: f64,
    done_s: f64,
    released: bool,
}

impl User {
    /// Starts at a place. `distance_m`, from the eye to what is in view, sets the speed.
    pub fn new(rig: Rig, distance_m: f64) -> User {
        User { rig, flies: false, speed: round_speed(distance_m / 4.0), fast: false, keys: Vec::new() }
    }

    /// The eye or eyes.
    pub fn rig(&self) -> &Rig {
        &self.rig
    }

    /// Moves to a camera's eye and direction; a cave stays upright.
    pub fn look_from(&mut self, camera: &Camera) {
        match &mut self.rig {
            Rig::Eye(own) => *own = *camera,
            Rig::Cave { place, eye_m, forward } => {
                if let Camera::LookAt { eye, target, .. } = camera {
                    let scale = place.scale;
                    let towards: [f64; 3] = (target - eye).cast().into();
                    let upright = CavePlace::standing(*eye_m, *forward, [0.0; 3], towards);
                    *place = CavePlace { scale, ..upright };
                    set_eye(place, *eye_m, eye.cast().into());
                }
            }
        }
    }

    /// Position of the eye, world axes, m.
    pub fn eye(&self) -> [f64; 3] {
        match &self.rig {
            Rig::Eye(Camera::LookAt { eye, .. }) => eye.cast().into(),
            Rig::Eye(Camera::Raw { .. }) => [0.0; 3],
            Rig::Cave { place, eye_m, .. } => place.to_scene(*eye_m),
        }
    }

    /// Direction of view, a unit vector in world axes.
    pub fn forward(&self) -> [f64; 3] {
        match &self.rig {
            Rig::Eye(Camera::LookAt { eye, target, .. }) => (target - eye).cast::<f64>().normalize().into(),
            Rig::Eye(Camera::Raw { .. }) => [0.0; 3],
            Rig::Cave { place, forward, .. } => place.turned(*forward),
        }
    }

    /// A movement key goes down.
    pub fn press(&mut self, movement: Movement) {
        match self.keys.iter_mut().find(|h| h.movement == movement) {
            Some(keys) if keys.released => {
                *keys = HeldKey { movement, down_s: 0.0, done_s: keys.done_s - TAP_S, released: false }
            }
            Some(_) => {}
            None => self.keys.push(HeldKey { movement, down_s: 0.0, done_s: 0.0, released: false }),
        }
    }

    /// A movement key comes up.
    pub fn release(&mut self, movement: Movement) {
        self.keys.iter_mut().filter(|h| h.movement == movement).for_each(|h| h.released = true);
    }

    /// All keys come up, as when another window gets the focus.
    pub fn release_all(&mut self) {
        self.keys.iter_mut().for_each(|h| h.released = true);
    }

    /// Returns whether a key moves the user.
    pub fn moves(&self) -> bool {
        !self.keys.is_empty()
    }

    /// Moves by the held keys for the time that has passed on the clock, s.
    pub fn pass(&mut self, clock_s: f64) {
        let turn = clock_s.clamp(0.0, MAX_TURN_S);
        let mut keys = std::mem::take(&mut self.keys);
        for key in &mut keys {
            key.down_s += turn;
            // the tap's step first; after it only keys that are still held
            let repeats = !key.released && key.down_s > HOLD_S;
            let part = if repeats { turn } else { turn.min((TAP_S - key.done_s).max(0.0)) };
            key.done_s += part;
            self.go(key.movement, part);
        }
        keys.retain(|key| !key.released || key.done_s < TAP_S);
        self.keys = keys;
    }

    fn go(&mut self, movement: Movement, seconds: f64) {
        let step = self.speed * if self.fast { FAST } else { 1.0 } * seconds;
        let forward = Vec3::from(self.forward());
        let level = Vec3::new(forward.x, forward.y, 0.0).try_normalize(1e-6).unwrap_or(Vec3::y());
        let ahead = if self.flies { forward } else { level };
        let right = level.cross(&Vec3::z());
        match movement {
            Movement::Ahead => self.shift(ahead * step),
            Movement::Back => self.shift(-ahead * step),
            Movement::Right => self.shift(right * step),
            Movement::Left => self.shift(-right * step),
            Movement::Up => self.shift(Vec3::z() * step),
            Movement::Down => self.shift(-Vec3::z() * step),
            Movement::TurnLeft => self.turn(TURN_RAD_PER_S * seconds, 0.0),
            Movement::TurnRight => self.turn(-TURN_RAD_PER_S * seconds, 0.0),
        }
    }

    /// Moves by a vector without turning, m, world axes.
    pub fn shift(&mut self, by: Vec3) {
        match &mut self.rig {
            Rig::Eye(Camera::LookAt { eye, target, .. }) => {
                *eye += by.cast();
                *target += by.cast();
            }
            Rig::Eye(Camera::Raw { .. }) => {}
            Rig::Cave { place, .. } => (0..3).for_each(|k| place.origin_m[k] += by[k]),
        }
    }

    /// Turns left and up, rad. A cave stays upright and turns left only.
    pub fn turn(&mut self, left: f64, up: f64) {
        let forward = Vec3::from(self.forward());
        match &mut self.rig {
            Rig::Eye(Camera::LookAt { eye, target, up: upright, .. }) => {
                let from: Point3<f64> = eye.cast();
                let distance = (target.cast::<f64>() - from).norm();
                let heading = if forward.x.hypot(forward.y) > 1e-6 {
                    forward.y.atan2(forward.x)
                } else {
                    f64::from(upright.y).atan2(f64::from(upright.x))
                };
                let (heading, pitch) = (heading + left, (forward.z.asin() + up).clamp(-MAX_PITCH_RAD, MAX_PITCH_RAD));
                let (sin, cos) = pitch.sin_cos();
                let to = from + Vec3::new(cos * heading.cos(), cos * heading.sin(), sin) * distance;
                (*target, *upright) = (to.cast(), Vector3::z());
            }
            Rig::Eye(Camera::Raw { .. }) => {}
            Rig::Cave { place, eye_m, .. } => {
                let eye = place.to_scene(*eye_m);
                place.heading_deg += left.to_degrees();
                set_eye(place, *eye_m, eye);
            }
        }
    }

    /// Distance that a tap moves, m.
    pub fn step_m(&self) -> f64 {
        self.speed * TAP_S
    }

    /// Raises (1) or lowers (-1) the speed in steps of 1, 2, 5, 10.
    pub fn change_speed(&mut self, by: i32) {
        let factor = if by > 0 { 1.8 } else { 1.0 / 1.8 };
        for _ in 0..by.abs().min(20) {
            self.speed = round_speed(self.speed * factor).clamp(0.001, 1000.0);
        }
    }
}

/// Moves a cave so that its point `eye_m` is at the point `at` of the scene.
fn set_eye(place: &mut CavePlace, eye_m: [f64; 3], at: [f64; 3]) {
    let now = place.to_scene(eye_m);
    (0..3).for_each(|k| place.origin_m[k] += at[k] - now[k]);
}

/// Rounds to the nearest of 1, 2 or 5 times a power of ten, by ratio.
fn round_speed(speed: f64) -> f64 {
    let speed = if speed.is_finite() { speed.clamp(1e-3, 1e3) } else { 1.0 };
    let ten = 10f64.powi(speed.log10().floor() as i32);
    let off = |x: &f64| (x / speed).ln().abs();
    [1.0, 2.0, 5.0, 10.0].map(|digit| digit * ten).into_iter().min_by(|a, b| off(a).total_cmp(&off(b))).unwrap_or(1.0)
}

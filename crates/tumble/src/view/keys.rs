//! The assignment of keys.

use super::user::Movement;
use tumble::render::winit::keyboard::{Key, KeyCode, NamedKey};

/// An action that a key triggers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Command {
    Pause,
    Step,
    Reset,
    Faster,
    Slower,
    NextCamera,
    PreviousCamera,
    Home,
    Fly,
    Overlay(usize),
    Statistics,
    Help,
    Sliders,
    Hold,
    NextJoint,
    JointUp,
    JointDown,
    Picture,
    Quality,
    Fullscreen,
    Quit,
}

impl Command {
    /// Returns whether the action repeats while its key is held.
    pub fn repeats(self) -> bool {
        matches!(self, Command::NextJoint | Command::JointUp | Command::JointDown)
    }
}

/// The overlays of the number keys, from 1 on, by their names in `--debug-draw`.
pub const OVERLAYS: [&str; 8] = ["contacts", "normals", "velocities", "forces", "joints", "frames", "islands", "tree"];

/// The help text for keys and mouse.
pub const HELP: [&str; 23] = [
    "W A S D     walk; arrow keys walk and turn",
    "E Q         up, down; also page up, page down",
    "shift       four times as fast",
    "F           fly along the view, or walk level",
    "right drag  look around; also left drag off a body",
    "left drag   pull a body; the wheel brings it closer",
    "wheel       walk faster or slower",
    "C, shift C  next camera, previous camera",
    "home        the scene's camera",
    "J, drag     sliders of joints; tab selects one",
    "[ ]         selected joint down, up; shift: faster",
    "K           hold all joints by drives, or release",
    "space       pause, continue",
    ". or N      single step",
    "R           reset to time 0",
    "+ -         double, halve the speed of time",
    "1 2 3 4     contacts, normals, velocities, forces",
    "5 6 7       joints, frames, islands",
    "8           sphere trees, level by level",
    "T, H or F1  statistics, this help",
    "G           quality: default, fast, fastest",
    "P, F11      screenshot, full screen",
    "escape      quit",
];

/// Returns the action of a key, if it has one.
pub fn command(key: &Key) -> Option<Command> {
    let letter = match key {
        Key::Named(NamedKey::Space) => return Some(Command::Pause),
        Key::Named(NamedKey::Escape) => return Some(Command::Quit),
        Key::Named(NamedKey::Tab) => return Some(Command::NextJoint),
        Key::Named(NamedKey::Home) => return Some(Command::Home),
        Key::Named(NamedKey::F1) => return Some(Command::Help),
        Key::Named(NamedKey::F11) => return Some(Command::Fullscreen),
        Key::Character(text) => text.as_str(),
        _ => return None,
    };
    Some(match letter {
        " " => Command::Pause,
        "." | "n" | "N" => Command::Step,
        "r" | "R" => Command::Reset,
        "+" | "=" => Command::Faster,
        "-" | "_" => Command::Slower,
        "c" => Command::NextCamera,
        "C" => Command::PreviousCamera,
        "f" | "F" => Command::Fly,
        "t" | "T" => Command::Statistics,
        "h" | "H" | "?" => Command::Help,
        "j" | "J" => Command::Sliders,
        "k" | "K" => Command::Hold,
        "[" | "{" => Command::JointDown,
        "]" | "}" => Command::JointUp,
        "p" | "P" => Command::Picture,
        "g" | "G" => Command::Quality,
        digit => match digit.parse::<usize>() {
            Ok(n) if (1..=OVERLAYS.len()).contains(&n) => Command::Overlay(n - 1),
            _ => return None,
        },
    })
}

/// Returns the name of a key for scripted events: its letter, in lower case, or its digit, or `enter`.
pub fn name(key: &Key) -> Option<String> {
    match key {
        Key::Named(NamedKey::Enter) => Some("enter".into()),
        Key::Character(text) => Some(text.to_lowercase()),
        _ => None,
    }
}

/// Returns how a key moves the user. Keys are identified by their place on the keyboard, whatever
/// is printed on them.
pub fn movement(code: KeyCode) -> Option<Movement> {
    Some(match code {
        KeyCode::KeyW | KeyCode::ArrowUp => Movement::Ahead,
        KeyCode::KeyS | KeyCode::ArrowDown => Movement::Back,
        KeyCode::KeyA => Movement::Left,
        KeyCode::KeyD => Movement::Right,
        KeyCode::KeyE | KeyCode::PageUp => Movement::Up,
        KeyCode::KeyQ | KeyCode::PageDown => Movement::Down,
        KeyCode::ArrowLeft => Movement::TurnLeft,
        KeyCode::ArrowRight => Movement::TurnRight,
        _ => return None,
    })
}

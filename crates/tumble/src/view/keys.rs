//! What keys do.

use super::user::Movement;
use tumble::render::winit::keyboard::{Key, KeyCode, NamedKey};

/// What a key asks for.
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
    /// Whether a key that is held goes on asking for it.
    pub fn repeats(self) -> bool {
        matches!(self, Command::NextJoint | Command::JointUp | Command::JointDown)
    }
}

/// Overlays by number key from 1 on, as `--debug-draw` names them.
pub const OVERLAYS: [&str; 8] = ["contacts", "normals", "velocities", "forces", "joints", "frames", "islands", "tree"];

/// What is told of keys and mouse.
pub const HELP: [&str; 23] = [
    "W A S D     walk; arrows too, left and right turn",
    "E Q         up and down; also page up, page down",
    "shift       four times as fast",
    "F           fly where you look, or walk level",
    "right drag  look around; left drag off a body too",
    "left drag   pull a body; the wheel brings it nearer",
    "wheel       faster or slower on foot",
    "C, shift C  next camera, the one before",
    "home        the scene's camera",
    "J, drag     sliders of joints; tab chooses one",
    "[ ]         chosen joint down, up; shift faster",
    "K           hold all joints by drives, free them",
    "space       pause, go on",
    ". or N      one step",
    "R           back to time 0",
    "+ -         time twice as fast, half as fast",
    "1 2 3 4     contacts, normals, velocities, forces",
    "5 6 7       joints, frames, islands",
    "8           sphere trees, level by level",
    "T, H or F1  statistics, this help",
    "G           looks: usual, fast, fastest",
    "P, F11      picture to a file, full screen",
    "escape      end",
];

/// What a key that goes down asks for, if anything.
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

/// Which way a key moves the user, by its place on the keyboard, whatever is printed on it.
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

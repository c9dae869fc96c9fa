//! `--status`: the state of the window as lines of JSON, for programs.

use crate::failure::Failure;
use serde::Serialize;
use std::fs::File;
use std::io::{Write, stdout};
use std::path::Path;

/// One line. Names carry the units; vectors have world axes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Status {
    /// Steps since time 0.
    pub frame: u64,
    pub time_s: f64,
    pub paused: bool,
    /// Requested simulated seconds per second.
    pub speed: f64,
    /// Simulated seconds that were skipped because steps took too long.
    pub behind_s: f64,
    /// Number of pictures shown.
    pub shown: u64,
    pub size_px: [u32; 2],
    /// Whether the window has the keyboard's focus.
    pub focused: bool,
    pub eye_m: [f64; 3],
    /// Unit vector.
    pub forward: [f64; 3],
    pub camera: String,
    pub flies: bool,
    /// Distance that a tap on a key moves the eye.
    pub step_m: f64,
    /// The picked body, its picked point and the target of the spring.
    pub picked: Option<String>,
    pub picked_point_m: Option<[f64; 3]>,
    pub pick_target_m: Option<[f64; 3]>,
    /// In the words of `--quality`.
    pub quality: Option<String>,
    pub overlays: Vec<String>,
    pub caption: bool,
    /// Joints with sliders, and whether drives hold them.
    pub joints: Vec<JointStatus>,
    pub joints_held: bool,
    /// BLAKE3, in hexadecimal, of the bytes that `tumble run --save` writes for the same state.
    pub state_blake3: String,
}

/// A joint with a slider.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct JointStatus {
    pub name: String,
    /// rad or m.
    pub position: f64,
    /// Target of the drive that holds it, if any.
    pub target: Option<f64>,
    /// Left end, right end and height of its bar, pixels from the window's top left corner; none if
    /// it is not shown.
    pub slider_px: Option<[f64; 3]>,
}

impl Status {
    /// Returns whether anything differs that does not change by itself.
    pub fn differs(&self, other: &Status) -> bool {
        let still = |s: &Status| Status {
            frame: 0,
            time_s: 0.0,
            behind_s: 0.0,
            shown: 0,
            picked_point_m: None,
            state_blake3: String::new(),
            joints: s.joints.iter().map(|joint| JointStatus { position: 0.0, ..joint.clone() }).collect(),
            ..s.clone()
        };
        still(self) != still(other)
    }
}

/// The destination of the status lines.
pub struct Log {
    to: Option<Box<dyn Write>>,
    last: Option<Status>,
}

impl Log {
    /// Opens a file, stdout (`-`), or nothing.
    pub fn create(path: Option<&Path>) -> Result<Log, Failure> {
        let to: Option<Box<dyn Write>> = match path {
            None => None,
            Some(path) if path.as_os_str() == "-" => Some(Box::new(stdout())),
            Some(path) => Some(Box::new(
                File::create(path)
                    .map_err(|e| Failure::input(format!("{}: cannot be written: {e}", path.display())))?,
            )),
        };
        Ok(Log { to, last: None })
    }

    /// Returns whether there is a destination.
    pub fn wanted(&self) -> bool {
        self.to.is_some()
    }

    /// Writes a line if the status differs from the last one, or if `anyway` is set.
    pub fn write(&mut self, status: Status, anyway: bool) -> Result<(), Failure> {
        let Some(to) = &mut self.to else { return Ok(()) };
        if anyway || self.last.as_ref().is_none_or(|last| status.differs(last)) {
            let failed = |e: &dyn std::fmt::Display| Failure::run("the status", e.to_string());
            let line = serde_json::to_string(&status).map_err(|e| failed(&e))?;
            writeln!(to, "{line}").and_then(|()| to.flush()).map_err(|e| failed(&e))?;
            self.last = Some(status);
        }
        Ok(())
    }
}

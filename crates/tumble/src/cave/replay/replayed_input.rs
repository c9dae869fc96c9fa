//! `--replay-input`: applies the users' inputs of an earlier run at the same frames.
//!
//! An input takes effect with the first step after its arrival, and a recording has it with the
//! frame before that step. So the same scene, steps and options give the same states again. The
//! hashes of the recording prove it.

use crate::failure::Failure;
use std::path::{Path, PathBuf};
use tumble::net::sync::transport::FacetNumber;
use tumble::net::sync::{FrameRecord, Input, RecordedFrame, SessionReader};

/// Tolerance for times of equal frames, s.
const TIME_TOLERANCE_S: f64 = 1e-9;

/// A recording whose inputs are replayed.
pub struct ReplayedInput {
    path: PathBuf,
    reader: SessionReader,
    now: Option<RecordedFrame>,
    next: Option<RecordedFrame>,
    pub counts: Counts,
}

/// Result of the replay.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Counts {
    pub inputs: u64,
    /// Number of frames whose state is bitwise equal to the recorded one.
    pub same: u64,
    /// Number of frames whose state differs.
    pub different: u64,
    /// The first of these.
    pub first_different: Option<u64>,
}

impl ReplayedInput {
    /// Opens a recording of this scene that has every frame.
    pub fn open(path: &Path, scene: [u8; 32]) -> Result<ReplayedInput, Failure> {
        let wrong = |e: &dyn std::fmt::Display| super::named(path, e);
        let mut reader = SessionReader::open(path).map_err(|e| wrong(&e))?;
        reader.check_scene(scene).map_err(|e| wrong(&e))?;
        let now = reader.next_frame().map_err(|e| wrong(&e))?;
        let next = reader.next_frame().map_err(|e| wrong(&e))?;
        let numbers = [&now, &next].map(|frame| frame.as_ref().map(|f| f.recorded.frame));
        if numbers != [Some(0), Some(1)] {
            return Err(wrong(
                &"its inputs can be replayed only if it begins with frame 0 and has every frame (every_frames = 1)",
            ));
        }
        Ok(ReplayedInput { path: path.to_owned(), reader, now, next, counts: Counts::default() })
    }

    /// Returns whether the recording has ended.
    pub fn is_over(&self) -> bool {
        self.now.is_none()
    }

    /// Compares a simulated frame with the recorded one. Returns the inputs from it to the next
    /// frame.
    pub fn after(&mut self, simulated: &FrameRecord) -> Result<Vec<(FacetNumber, Input)>, Failure> {
        let Some(then) = std::mem::replace(&mut self.now, self.next.take()) else { return Ok(Vec::new()) };
        self.next = self.reader.next_frame().map_err(|e| Failure::run("the recorded inputs", e))?;
        let (ours, theirs) = ((simulated.frame, simulated.time_s), (then.recorded.frame, then.recorded.time_s));
        if ours.0 != theirs.0 || (ours.1 - theirs.1).abs() > TIME_TOLERANCE_S {
            let text = format!(
                "{}: frame {} at {:.6} s follows where this run has frame {} at {:.6} s; --dt and --fps must be those of the recording, and no frame may be left out",
                self.path.display(),
                theirs.0,
                theirs.1,
                ours.0,
                ours.1
            );
            return Err(Failure::input(text));
        }
        if simulated.hash == then.recorded.hash {
            self.counts.same += 1;
        } else {
            self.counts.different += 1;
            if self.counts.first_different.is_none() {
                self.counts.first_different = Some(ours.0);
                eprintln!("frame {} differs from the recording", ours.0);
            }
        }
        self.counts.inputs += then.inputs.len() as u64;
        Ok(then.inputs)
    }

    /// Returns an error if any frame differs from the recording.
    pub fn check(&self) -> Result<(), Failure> {
        let Counts { same, different, first_different: Some(first), .. } = self.counts else { return Ok(()) };
        let why = format!(
            "{different} of {} frames differ from the recording, the first is frame {first}; scene, environment, cave, --user-colliders, --stepper and --solver must be those of the recording",
            same + different
        );
        Err(Failure::run(&format!("--replay-input {}", self.path.display()), why))
    }
}

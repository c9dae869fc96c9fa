//! `--replay-input`: what users did in an earlier run, done again at the same frames.
//!
//! An input counts from the first step after it came, and a recording has it with the frame before that step. So the same scene, steps and options give the
//! same states again, which the hashes of the recording show.

use crate::failure::Failure;
use std::path::{Path, PathBuf};
use tumble::net::sync::transport::FacetNumber;
use tumble::net::sync::{FrameRecord, Input, RecordedFrame, SessionReader};

/// Times of frames that differ by more are other times, s.
const TIME_TOLERANCE_S: f64 = 1e-9;

/// A recording whose inputs are played.
pub struct ReplayedInput {
    path: PathBuf,
    reader: SessionReader,
    now: Option<RecordedFrame>,
    next: Option<RecordedFrame>,
    pub counts: Counts,
}

/// What came of it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Counts {
    pub inputs: u64,
    /// Frames whose state is the recorded one, bit by bit.
    pub same: u64,
    /// Frames whose state is not.
    pub different: u64,
    /// The first of these.
    pub first_different: Option<u64>,
}

impl ReplayedInput {
    /// Opens it, if it is of this scene and has every frame.
    pub fn open(path: &Path, scene: [u8; 32]) -> Result<ReplayedInput, Failure> {
        let wrong = |e: &dyn std::fmt::Display| Failure::input(format!("{}: {e}", path.display()));
        let mut reader = SessionReader::open(path).map_err(|e| wrong(&e))?;
        reader.check_scene(scene).map_err(|e| wrong(&e))?;
        let now = reader.next_frame().map_err(|e| wrong(&e))?;
        let next = reader.next_frame().map_err(|e| wrong(&e))?;
        let numbers = [&now, &next].map(|frame| frame.as_ref().map(|f| f.recorded.frame));
        if numbers != [Some(0), Some(1)] {
            return Err(wrong(
                &"its inputs are played only if it begins with frame 0 and has every frame (every_frames = 1)",
            ));
        }
        Ok(ReplayedInput { path: path.to_owned(), reader, now, next, counts: Counts::default() })
    }

    /// Whether the recording is over.
    pub fn is_over(&self) -> bool {
        self.now.is_none()
    }

    /// A frame was simulated: compares it, and gives what users did from it to the next one.
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
                eprintln!("frame {} comes out otherwise than recorded", ours.0);
            }
        }
        self.counts.inputs += then.inputs.len() as u64;
        Ok(then.inputs)
    }

    /// Whether all frames came out as recorded.
    pub fn check(&self) -> Result<(), Failure> {
        let Counts { same, different, first_different: Some(first), .. } = self.counts else { return Ok(()) };
        let why = format!(
            "{different} of {} frames came out otherwise than recorded, the first is frame {first}; scene, environment, cave, --user-colliders, --stepper and --solver must be those of the recording",
            same + different
        );
        Err(Failure::run(&format!("--replay-input {}", self.path.display()), why))
    }
}

//! Where users' input comes from beside the facets' windows: a tracker, or a recording in place of everything live.

use crate::cave::args::ServeOptions;
use crate::cave::replay::replayed_input::{self, ReplayedInput};
use crate::cave::tracker::osc;
use crate::cave::tracker::socket::{TrackerSocket, configured};
use crate::failure::Failure;
use tumble::net::sync::transport::FacetNumber;
use tumble::net::sync::{FrameRecord, Input};
use tumble::scene::cave::Cave;

/// The tracker's number among those that send input; no facet has it.
pub const TRACKER_SOURCE: FacetNumber = FacetNumber::MAX;

/// All devices of a run.
pub struct InputDevices {
    tracker: Option<TrackerSocket>,
    replayed_input: Option<ReplayedInput>,
}

impl InputDevices {
    /// As files and command line say, for a scene of this hash.
    pub fn open(
        options: &ServeOptions,
        cave: &Cave,
        scene: [u8; 32],
        simulating: bool,
    ) -> Result<InputDevices, Failure> {
        let replayed_input = options.replay_input.as_ref().map(|path| ReplayedInput::open(path, scene)).transpose()?;
        let wanted = configured(cave, options.tracker, &options.tracker_from)?
            .filter(|_| replayed_input.is_none() && simulating);
        let tracker = wanted.as_ref().map(TrackerSocket::open).transpose()?;
        if let (Some(socket), Some(tracker), false) = (&tracker, &wanted, options.quiet) {
            eprintln!("{}", socket.describe(tracker));
        }
        if let (Some(path), false) = (&options.replay_input, options.quiet) {
            eprintln!("input: as recorded in {}; what windows and trackers say now is left out", path.display());
        }
        Ok(InputDevices { tracker, replayed_input })
    }

    /// Whether what facets send counts.
    pub fn live(&self) -> bool {
        self.replayed_input.is_none()
    }

    /// Whether a recording of inputs has come to its end.
    pub fn over(&self) -> bool {
        self.replayed_input.as_ref().is_some_and(ReplayedInput::is_over)
    }

    /// What the tracker told since the last frame.
    pub fn tracker_inputs(&self) -> Vec<(FacetNumber, Input)> {
        let inputs = self.tracker.iter().flat_map(TrackerSocket::inputs);
        inputs.map(|input| (TRACKER_SOURCE, input)).collect()
    }

    /// What was recorded as done from this frame to the next; `simulated` is asked for only where there is a recording.
    pub fn after(
        &mut self,
        simulated: impl FnOnce() -> Option<FrameRecord>,
    ) -> Result<Vec<(FacetNumber, Input)>, Failure> {
        match &mut self.replayed_input {
            Some(replayed_input) => simulated().map_or(Ok(Vec::new()), |recorded| replayed_input.after(&recorded)),
            None => Ok(Vec::new()),
        }
    }

    /// What came from the tracker.
    pub fn tracker_counts(&self) -> Option<osc::Counts> {
        self.tracker.as_ref().map(TrackerSocket::counts)
    }

    /// Whether the inputs of a recording made of the scene what they made of it then.
    pub fn check(&self) -> Result<(), Failure> {
        self.replayed_input.as_ref().map_or(Ok(()), ReplayedInput::check)
    }

    /// What came of playing inputs.
    pub fn replayed_counts(&self) -> Option<replayed_input::Counts> {
        self.replayed_input.as_ref().map(|p| p.counts)
    }
}

//! Where users' input comes from beside the facets' windows: a tracker, or a recording in place of everything live.

use super::args::ServeOptions;
use super::osc;
use super::played::{self, Played};
use super::tracker::{Heard, described};
use crate::failure::Failure;
use tumble::net::sync::transport::FacetNumber;
use tumble::net::sync::{Input, Recorded};
use tumble::scene::cave::Cave;

/// The tracker's number among those that send input; no facet has it.
pub const TRACKER: FacetNumber = FacetNumber::MAX;

/// All devices of a run.
pub struct Devices {
    tracker: Option<Heard>,
    played: Option<Played>,
}

impl Devices {
    /// As files and command line say, for a scene of this hash.
    pub fn open(options: &ServeOptions, cave: &Cave, scene: [u8; 32], simulating: bool) -> Result<Devices, Failure> {
        let played = options.input_from.as_ref().map(|path| Played::open(path, scene)).transpose()?;
        let wanted =
            described(cave, options.tracker, &options.tracker_from)?.filter(|_| played.is_none() && simulating);
        let tracker = wanted.as_ref().map(Heard::open).transpose()?;
        if let (Some(heard), Some(tracker), false) = (&tracker, &wanted, options.quiet) {
            eprintln!("{}", heard.describe(tracker));
        }
        if let (Some(path), false) = (&options.input_from, options.quiet) {
            eprintln!("input: as recorded in {}; what windows and trackers say now is left out", path.display());
        }
        Ok(Devices { tracker, played })
    }

    /// Whether what facets send counts.
    pub fn live(&self) -> bool {
        self.played.is_none()
    }

    /// Whether a recording of inputs has come to its end.
    pub fn over(&self) -> bool {
        self.played.as_ref().is_some_and(Played::is_over)
    }

    /// What the tracker told since the last frame.
    pub fn tracked(&self) -> Vec<(FacetNumber, Input)> {
        let inputs = self.tracker.iter().flat_map(Heard::inputs);
        inputs.map(|input| (TRACKER, input)).collect()
    }

    /// What was recorded as done from this frame to the next; `simulated` is asked for only where there is a recording.
    pub fn after(
        &mut self,
        simulated: impl FnOnce() -> Option<Recorded>,
    ) -> Result<Vec<(FacetNumber, Input)>, Failure> {
        match &mut self.played {
            Some(played) => simulated().map_or(Ok(Vec::new()), |recorded| played.after(&recorded)),
            None => Ok(Vec::new()),
        }
    }

    /// What came from the tracker.
    pub fn tracker_counts(&self) -> Option<osc::Counts> {
        self.tracker.as_ref().map(Heard::counts)
    }

    /// Whether the inputs of a recording made of the scene what they made of it then.
    pub fn verdict(&self) -> Result<(), Failure> {
        self.played.as_ref().map_or(Ok(()), Played::verdict)
    }

    /// What came of playing inputs.
    pub fn played_counts(&self) -> Option<played::Counts> {
        self.played.as_ref().map(|p| p.counts)
    }
}

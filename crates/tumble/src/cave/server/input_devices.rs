//! Sources of the users' input besides the facets' windows: a tracker, or a recording that replaces
//! all live input.

use crate::cave::args::ServeOptions;
use crate::cave::endpoints::key;
use crate::cave::gamepad::{Gamepad, user_of};
use crate::cave::replay::replayed_input::{self, ReplayedInput};
use crate::cave::tracker::openxr_client::OpenXrClient;
use crate::cave::tracker::osc;
use crate::cave::tracker::presence::Presence;
use crate::cave::tracker::smoothed::{AppliedInput, SmoothedHeads};
use crate::cave::tracker::socket::{TrackerSocket, configured};
use crate::cave::tracker::vrpn_client::VrpnClient;
use crate::failure::Failure;
use std::time::{Duration, Instant};
use tumble::net::sync::transport::FacetNumber;
use tumble::net::sync::{FrameRecord, FrameTimes, Input};
use tumble::scene::cave::{Cave, Tracker};

/// Source number of the tracker; no facet has it.
pub const TRACKER_SOURCE: FacetNumber = FacetNumber::MAX;
/// Source number of the gamepad.
const GAMEPAD_SOURCE: FacetNumber = FacetNumber::MAX - 3;

/// All input devices of a run.
pub struct InputDevices {
    tracker: Option<TrackerSocket>,
    vrpn: Option<VrpnClient>,
    openxr: Option<OpenXrClient>,
    gamepad: Option<Gamepad>,
    replayed_input: Option<ReplayedInput>,
    heads: SmoothedHeads,
    /// Time at which the inputs of the next frame were taken, by the server's clock.
    taken: Option<Duration>,
}

impl InputDevices {
    /// Opens the devices of cave file and command line for a scene with this hash.
    pub fn open(
        options: &ServeOptions,
        cave: &Cave,
        scene: [u8; 32],
        simulating: bool,
    ) -> Result<InputDevices, Failure> {
        let (key, heads) = (key(cave)?, SmoothedHeads::new(options.heads()));
        let replayed_input = options.replay_input.as_ref().map(|path| ReplayedInput::open(path, scene)).transpose()?;
        let live = replayed_input.is_none() && simulating;
        let about = cave.tracker.clone().unwrap_or_else(|| Tracker::of(&cave.users));
        // the command line's tracker takes the place of the cave file's
        let vrpn = match (&options.vrpn, &about.vrpn) {
            (Some(server), _) => Some((server, &options.vrpn_map)),
            (None, Some(server)) if options.tracker.is_none() && options.openxr.is_none() => {
                Some((server, &about.vrpn_map))
            }
            _ => None,
        };
        let is_default = options.tracker.is_none() && options.vrpn.is_none() && options.dtrack_map.is_empty();
        let openxr = options.openxr.as_ref().or(about.openxr.as_ref().filter(|_| is_default));
        let gamepad = options.gamepad.as_ref().map(|name| user_of(name, &cave.users)).transpose()?;
        let gamepad = gamepad.filter(|_| live).map(|user| Gamepad::new(user, options.quiet));
        let wanted = configured(cave, options.tracker, &options.tracker_from, &options.dtrack_map)?
            .filter(|_| live && vrpn.is_none() && openxr.is_none());
        let open = |tracker| TrackerSocket::open(tracker, key.as_ref());
        let tracker = wanted.as_ref().map(open).transpose()?;
        let connect = |(server, maps): (&String, &Vec<_>)| VrpnClient::open(server, maps, &about);
        let vrpn = vrpn.filter(|_| live).map(connect).transpose()?;
        let follow = |user: &String| OpenXrClient::open(user, &about);
        let openxr = openxr.filter(|_| live).map(follow).transpose()?;
        if let (Some(socket), Some(tracker), false) = (&tracker, &wanted, options.quiet) {
            eprintln!("{}", socket.describe(tracker));
        }
        if let (Some(path), false) = (&options.replay_input, options.quiet) {
            eprintln!("input: replayed from {}; live input of windows and trackers is ignored", path.display());
        }
        Ok(InputDevices { tracker, vrpn, openxr, gamepad, replayed_input, heads, taken: None })
    }

    /// Returns whether input of facets is used.
    pub fn live(&self) -> bool {
        self.replayed_input.is_none()
    }

    /// Returns whether a recording of inputs has ended.
    pub fn over(&self) -> bool {
        self.replayed_input.as_ref().is_some_and(ReplayedInput::is_over)
    }

    /// Returns the inputs of tracker and gamepad for the next frame, which begins at this time of the server's clock.
    pub fn inputs(&mut self, begin: Duration) -> Vec<(FacetNumber, AppliedInput)> {
        let now = Instant::now();
        self.taken = Some(begin);
        let tracked = self.tracker.iter().flat_map(TrackerSocket::inputs);
        let tracked = tracked.chain(self.vrpn.iter().flat_map(VrpnClient::inputs));
        let tracked = tracked.chain(self.openxr.iter().flat_map(OpenXrClient::inputs)).collect();
        let tracked = self.heads.applied(tracked, now).into_iter().map(|applied| (TRACKER_SOURCE, applied));
        let held = self.gamepad.iter_mut().filter_map(|gamepad| gamepad.input(now));
        let held = held.map(|input| AppliedInput { input, age: Some(Duration::ZERO), lead_s: None });
        tracked.chain(held.map(|applied| (GAMEPAD_SOURCE, applied))).collect()
    }

    /// Notes the number of the frame for which inputs were taken.
    pub fn published(&mut self, frame: Option<u64>) {
        if let (Some(frame), Some(taken)) = (frame, self.taken.take()) {
            self.heads.display.begun(frame, taken);
        }
    }

    /// Returns the time from taking the inputs of a frame to its presentation, s, and predicts heads by it.
    pub fn shown(&mut self, times: &FrameTimes) -> Option<f64> {
        self.heads.display.shown(times)
    }

    /// Returns the devices that come and go.
    fn presences(&self) -> impl Iterator<Item = &Presence> {
        self.vrpn.iter().map(VrpnClient::presence).chain(self.openxr.iter().map(OpenXrClient::presence))
    }

    /// Returns the alarms of devices that do not answer.
    pub fn alarms(&self) -> Vec<String> {
        self.presences().filter_map(Presence::alarm).collect()
    }

    /// Returns the lines about devices since the last call.
    pub fn lines(&self) -> Vec<String> {
        self.presences().flat_map(Presence::lines).collect()
    }

    /// Returns the recorded inputs from this frame to the next. `simulated` is called only if there
    /// is a recording.
    pub fn after(
        &mut self,
        simulated: impl FnOnce() -> Option<FrameRecord>,
    ) -> Result<Vec<(FacetNumber, Input)>, Failure> {
        match &mut self.replayed_input {
            Some(replayed_input) => simulated().map_or(Ok(Vec::new()), |recorded| replayed_input.after(&recorded)),
            None => Ok(Vec::new()),
        }
    }

    /// Returns the tracker's counts.
    pub fn tracker_counts(&self) -> Option<osc::Counts> {
        let datagrams = self.tracker.as_ref().map(TrackerSocket::counts);
        let vrpn = || self.vrpn.as_ref().map(VrpnClient::counts);
        datagrams.or_else(vrpn).or_else(|| self.openxr.as_ref().map(OpenXrClient::counts))
    }

    /// Checks that replayed inputs gave the recorded states.
    pub fn check(&self) -> Result<(), Failure> {
        self.replayed_input.as_ref().map_or(Ok(()), ReplayedInput::check)
    }

    /// Returns the result of replayed inputs.
    pub fn replayed_counts(&self) -> Option<replayed_input::Counts> {
        self.replayed_input.as_ref().map(|p| p.counts)
    }
}

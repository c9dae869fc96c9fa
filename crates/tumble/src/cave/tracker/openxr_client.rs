//! Head and hands of a headset by OpenXR, on a thread of their own: poses become the messages that trackers send as
//! OSC, and go through the same decoder.
//!
//! Calls of a runtime can take any time, so none is made by the thread of the simulation. A session that was lost is
//! created again every two seconds.

use super::headset::{HeadsetSession, Runtime, Sample};
use super::osc::{Counts, OscDecoder, TrackedInput};
use super::presence::Presence;
use super::socket::{POLL_INTERVAL, lock};
use crate::failure::Failure;
use rosc::{OscMessage, OscType};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use tumble::scene::cave::{Axes, Tracker};

/// Time that a runtime has to be loaded before the run goes on without it.
const LOAD_TIMEOUT: Duration = Duration::from_secs(5);
/// Time between two attempts.
const RETRY_INTERVAL: Duration = Duration::from_secs(2);
/// Time between two poses.
const SAMPLE_INTERVAL: Duration = Duration::from_millis(4);
/// Time that the thread has to end; a runtime that holds it longer is left to the end of the process.
const END_TIMEOUT: Duration = Duration::from_secs(2);

/// A headset and its thread.
pub struct OpenXrClient {
    decoder: Arc<Mutex<OscDecoder>>,
    presence: Arc<Presence>,
    end: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl OpenXrClient {
    /// Starts the thread. Users and origin are those of the tracker; the axes are those of OpenXR, `y_up`.
    ///
    /// # Errors
    /// A user that the tracker does not have; a machine without loader or runtime, or with one that cannot do without
    /// graphics.
    pub fn open(user: &str, tracker: &Tracker) -> Result<OpenXrClient, Failure> {
        OpenXrClient::open_library(None, user, tracker)
    }

    fn open_library(library: Option<PathBuf>, user: &str, tracker: &Tracker) -> Result<OpenXrClient, Failure> {
        if !tracker.users.iter().any(|known| known == user) {
            let users = tracker.users.join(", ");
            return Err(Failure::input(format!("--openxr {user}: there is no such user; there are {users}")));
        }
        let tracker = Tracker { axes: Axes::YUp, ..tracker.clone() };
        let (decoder, end) = (Arc::new(Mutex::new(OscDecoder::new(&tracker))), Arc::new(AtomicBool::new(false)));
        let presence = Arc::new(Presence::new("OpenXR".into()));
        let (theirs, ended) = (decoder.clone(), end.clone());
        let follower = Follower { user: user.into(), decoder: theirs, presence: presence.clone(), end: ended };
        let (report, loaded) = channel();
        let builder = std::thread::Builder::new().name("openxr".into());
        let thread = builder.spawn(move || follower.run(library.as_deref(), |outcome| report.send(outcome).is_ok()));
        let thread = thread.map_err(|e| Failure::run("OpenXR", e))?;
        match loaded.recv_timeout(LOAD_TIMEOUT) {
            Ok(outcome) => outcome.map_err(|why| Failure::run("OpenXR", why))?,
            Err(RecvTimeoutError::Disconnected) => return Err(Failure::run("OpenXR", "the runtime cannot be loaded")),
            Err(RecvTimeoutError::Timeout) => {
                presence.note(&format!("the runtime does not answer for {} s; is awaited", LOAD_TIMEOUT.as_secs()));
            }
        }
        Ok(OpenXrClient { decoder, presence, end, thread: Some(thread) })
    }

    /// Returns the user's input if it changed since the last call.
    pub fn inputs(&self) -> Vec<TrackedInput> {
        lock(&self.decoder).inputs()
    }

    /// Returns whether the headset is followed.
    pub fn presence(&self) -> &Presence {
        &self.presence
    }

    /// Returns the counts.
    pub fn counts(&self) -> Counts {
        lock(&self.decoder).counts.clone()
    }
}

impl Drop for OpenXrClient {
    fn drop(&mut self) {
        self.end.store(true, Ordering::Relaxed);
        let Some(thread) = self.thread.take() else { return };
        let start = Instant::now();
        while !thread.is_finished() && start.elapsed() < END_TIMEOUT {
            std::thread::sleep(Duration::from_millis(2));
        }
        if thread.is_finished() {
            let _ = thread.join();
        }
    }
}

/// The part of a client on its thread.
struct Follower {
    user: String,
    decoder: Arc<Mutex<OscDecoder>>,
    presence: Arc<Presence>,
    end: Arc<AtomicBool>,
}

impl Follower {
    /// Loads the runtime, reports the outcome, and follows the headset until the end. `report` returns whether anybody
    /// waits for the outcome.
    fn run(&self, library: Option<&Path>, report: impl FnOnce(Result<(), String>) -> bool) {
        let runtime = match Runtime::load(library) {
            Ok(runtime) => runtime,
            Err(why) => {
                if !report(Err(why.clone())) {
                    self.presence.note(&why);
                }
                return;
            }
        };
        report(Ok(()));
        while !self.ended() {
            let followed = self.follow(&runtime);
            self.release();
            if let Err(why) = followed {
                self.presence.lost(Instant::now(), &why);
            }
            self.wait(RETRY_INTERVAL);
        }
    }

    /// Follows the headset until the end or a fault, which it returns.
    fn follow(&self, runtime: &Runtime) -> Result<(), String> {
        let (mut session, mut connected) = (HeadsetSession::open(runtime)?, false);
        while !self.ended() {
            if let Some(sample) = session.sample()? {
                if !std::mem::replace(&mut connected, true) {
                    self.presence.found(&session.describe());
                }
                self.apply(&sample);
            }
            std::thread::sleep(SAMPLE_INTERVAL);
        }
        Ok(())
    }

    /// Gives a sample to the decoder as messages of an OSC tracker. A head that is not known stays.
    fn apply(&self, sample: &Sample) {
        if let Some(head) = sample.head {
            self.send("head", &head.map(OscType::Double));
        }
        let hands = [("hand/left", sample.hands[0]), ("hand/right", sample.hands[1]), ("wand", sample.wand)];
        for (part, pose) in hands {
            self.send(part, &pose.map_or(Vec::new(), |pose| pose.map(OscType::Double).to_vec()));
        }
        self.send("buttons", &[OscType::Long(sample.buttons.into())]);
    }

    /// Releases hands and buttons.
    fn release(&self) {
        self.apply(&Sample { head: None, hands: [None; 2], wand: None, buttons: 0 });
    }

    fn send(&self, part: &str, args: &[OscType]) {
        let addr = format!("/tumble/user/{}/{part}", self.user);
        lock(&self.decoder).apply_one(Instant::now(), &OscMessage { addr, args: args.to_vec() });
    }

    fn ended(&self) -> bool {
        self.end.load(Ordering::Relaxed)
    }

    fn wait(&self, time: Duration) {
        let start = Instant::now();
        while start.elapsed() < time && !self.ended() {
            std::thread::sleep(POLL_INTERVAL);
        }
    }
}

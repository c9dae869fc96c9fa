//! The world of a facet that steps by itself.
//!
//! ```text
//! WORLD(f) ─► restore ─► frame f          STEP(f + 1) ─► compare the hash of f ─► advance ─► frame f + 1
//! ```
//!
//! A gap in the frames, or a frame that fails, ends in a request for the world of a later frame
//! (RESYNC). A facet that is behind advances by several frames before it draws.

use super::super::compute::{ObjectHashes, SavedWorld, Simulation, StateHashes, Step};
use super::super::messages::{Content, increment};
use super::super::mirror::Mirror;
use super::super::transport::Message;
use super::super::viewer::Viewer;
use super::super::wire::{HEADER_BYTES, Hash, MessageError, MessageHeader, MessageKind, is_later};
use super::following::Followed;
use super::{FacetSession, PendingState, Phase};
use std::collections::VecDeque;
use std::time::Duration;
use tumble_core::World;

pub(super) const NO_MIRROR: MessageError = MessageError::Malformed("poses for a facet that steps by itself");
/// Maximum number of frames that wait; a facet that is farther behind asks for a world. Frames wait
/// while a large world is on its way, so this is longer than that takes.
const MAX_WAITING_FRAMES: usize = 600;
/// Maximum number of frames that a facet advances before it draws.
const FRAMES_PER_PICTURE: usize = 8;

/// The world that a facet shows.
#[allow(clippy::large_enum_variant)] // a session has one, for its life
pub(super) enum Shown {
    /// A copy that follows the server's messages.
    Mirrored(Mirror),
    /// A world that the facet steps by itself.
    Computed(Computing),
    /// The frames of another session of this process.
    Followed(Followed),
}

impl Shown {
    pub fn world(&self) -> &World {
        match self {
            Shown::Mirrored(mirror) => mirror.world(),
            Shown::Computed(node) => node.simulation.world(),
            Shown::Followed(followed) => followed.world(),
        }
    }

    pub fn viewer(&self) -> &Viewer {
        match self {
            Shown::Mirrored(mirror) => mirror.viewer(),
            Shown::Computed(node) => node.simulation.viewer(),
            Shown::Followed(followed) => &followed.viewer,
        }
    }

    /// Returns the simulated time of the frame, s.
    pub fn time_s(&self) -> f64 {
        match self {
            Shown::Followed(followed) => followed.time_s,
            _ => self.world().time(),
        }
    }

    /// Returns the hash of the frame that the world shows.
    pub fn hash(&mut self) -> Hash {
        match self {
            Shown::Mirrored(mirror) => mirror.hash(),
            Shown::Computed(node) => node.hashes.as_ref().map_or([0; 16], |hashes| hashes.hash),
            Shown::Followed(followed) => followed.hash,
        }
    }

    /// Returns the content that the facet asks for.
    pub fn wanted(&self, exact: bool) -> Content {
        match self {
            Shown::Computed(_) => Content::Inputs,
            Shown::Followed(followed) => followed.content(),
            Shown::Mirrored(_) if exact => Content::Exact,
            Shown::Mirrored(_) => Content::Poses,
        }
    }

    /// Returns whether frames wait to be made.
    pub fn has_frames(&self) -> bool {
        match self {
            Shown::Mirrored(_) => false,
            Shown::Computed(node) => !node.queue.is_empty(),
            Shown::Followed(followed) => !followed.queue.is_empty(),
        }
    }

    /// Returns the frames of inputs that wait; `None` for a facet that gets states.
    fn queue(&mut self) -> Option<&mut VecDeque<PendingState>> {
        match self {
            Shown::Mirrored(_) => None,
            Shown::Computed(node) => Some(&mut node.queue),
            Shown::Followed(followed) => (followed.content() == Content::Inputs).then_some(&mut followed.queue),
        }
    }

    /// Returns the revision of the object table; `None` before the first one, and without one.
    pub fn revision(&self) -> Option<u32> {
        match self {
            Shown::Mirrored(mirror) => mirror.revision(),
            Shown::Computed(_) => None,
            Shown::Followed(followed) => followed.revision,
        }
    }

    /// Applies the object table of a snapshot.
    pub fn apply_snapshot(&mut self, payload: &[u8]) -> Result<(), MessageError> {
        match self {
            Shown::Mirrored(mirror) => mirror.apply_snapshot(payload),
            Shown::Followed(followed) if followed.content() != Content::Inputs => followed.apply_snapshot(payload),
            Shown::Computed(_) | Shown::Followed(_) => Err(NO_MIRROR),
        }
    }

    /// Returns whether the facet gets states.
    pub fn gets_states(&self) -> bool {
        !matches!(self.wanted(false), Content::Inputs)
    }

    /// Forgets the frames of a run.
    pub fn restart(&mut self) {
        match self {
            Shown::Mirrored(_) => {}
            Shown::Computed(node) => node.restart(),
            Shown::Followed(followed) => followed.queue.clear(),
        }
    }
}

/// A simulation, and the frames that it has not made yet.
pub(super) struct Computing {
    simulation: Box<dyn Simulation>,
    queue: VecDeque<PendingState>,
    /// Hashes of the last frame.
    hashes: Option<StateHashes>,
}

impl Computing {
    fn restart(&mut self) {
        self.queue.clear();
        self.hashes = None;
    }

    /// Makes a frame. Returns the hashes of the frame before if they differ from the server's.
    fn make(&mut self, header: &MessageHeader, payload: &[u8]) -> Result<Option<StateHashes>, MessageError> {
        let unfit = MessageError::Unfit;
        let before = match header.kind {
            MessageKind::World => {
                let world = SavedWorld::read(payload)?;
                self.simulation.restore(world.bytes).map_err(unfit)?;
                world.before
            }
            _ => {
                let step = Step::read(payload)?;
                self.simulation.advance(&step.inputs).map_err(unfit)?;
                step.before
            }
        };
        let now = StateHashes::of(header.frame, self.simulation.world(), self.simulation.viewer());
        let last = self.hashes.replace(now);
        let preceding = last.filter(|last| last.frame.wrapping_add(1) == header.frame);
        Ok(preceding.filter(|last| before != [0; 16] && last.hash != before))
    }
}

impl FacetSession {
    /// Creates the session of a facet that steps by itself. `options.scene` is the hash that covers
    /// all constants and settings ([`ServerOptions::compute`](super::super::ServerOptions::compute)).
    pub fn computing(options: super::FacetOptions, simulation: Box<dyn Simulation>) -> FacetSession {
        FacetSession::with(options, Shown::Computed(Computing { simulation, queue: VecDeque::new(), hashes: None }))
    }

    /// Makes the frames that wait, and returns the number of the last one.
    pub(super) fn make_frames(&mut self) -> Option<u64> {
        for _ in 0..FRAMES_PER_PICTURE {
            let Shown::Computed(node) = &mut self.content else { return None };
            let Some(PendingState { header, message, arrived }) = node.queue.pop_front() else { break };
            match node.make(&header, &message[HEADER_BYTES..]) {
                Ok(differing) => {
                    if self.drawing.is_some() {
                        increment(&mut self.counts.missing);
                    }
                    self.drawing = Some((header.frame, arrived));
                    differing.into_iter().for_each(|hashes| self.report_difference(arrived, &hashes));
                }
                Err(_) => {
                    increment(&mut self.counts.refused);
                    node.restart();
                    (self.newest, self.drawing) = (None, None);
                    self.resync(arrived);
                    return None;
                }
            }
        }
        self.drawing.map(|(frame, _)| frame)
    }

    fn report_difference(&mut self, now: Duration, hashes: &StateHashes) {
        let objects: &ObjectHashes = &hashes.objects;
        self.send(MessageKind::Differs, hashes.frame, |out| objects.write(out));
        self.resync(now);
    }

    /// Takes a world: the facet is in the run.
    pub(super) fn on_world(
        &mut self,
        now: Duration,
        header: MessageHeader,
        message: Message,
    ) -> Result<(), MessageError> {
        self.last_received = now;
        let (live, newest) = (self.phase == Phase::Live, self.newest);
        let Some(queue) = self.content.queue() else {
            return Err(MessageError::Malformed("a world for a facet that does not step"));
        };
        if live && newest.is_some_and(|newest| !is_later(header.frame, newest)) {
            increment(&mut self.counts.duplicate);
            self.repeat_answer(header.frame);
            return Ok(());
        }
        queue.clear();
        if let Some(newest) = newest.filter(|_| live) {
            self.counts.missing = self.counts.missing.wrapping_add(header.frame.wrapping_sub(newest) - 1);
        }
        (self.phase, self.run, self.lost, self.resynced) = (Phase::Live, header.run, false, None);
        self.queue_frame(now, header, message);
        Ok(())
    }

    /// Takes the inputs of a frame if they are those of the next one.
    pub(super) fn on_step(
        &mut self,
        now: Duration,
        header: MessageHeader,
        message: Message,
    ) -> Result<(), MessageError> {
        self.last_received = now;
        let Some(queue) = self.content.queue() else {
            return Err(MessageError::Malformed("inputs for a facet that does not step"));
        };
        let full = queue.len() >= MAX_WAITING_FRAMES;
        match self.newest {
            Some(newest) if header.frame == newest => {
                increment(&mut self.counts.duplicate);
                self.repeat_answer(header.frame);
            }
            Some(newest) if header.frame == newest.wrapping_add(1) && !full => self.queue_frame(now, header, message),
            Some(newest) if !is_later(header.frame, newest) => increment(&mut self.counts.stale),
            _ => {
                increment(&mut self.counts.early);
                self.resync(now);
            }
        }
        Ok(())
    }

    fn queue_frame(&mut self, arrived: Duration, header: MessageHeader, message: Message) {
        self.newest = Some(header.frame);
        self.show |= self.drawn_frame.is_some();
        if let Some(queue) = self.content.queue() {
            queue.push_back(PendingState { header, message, arrived });
        }
    }
}

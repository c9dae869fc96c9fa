//! A session that shows the frames of another session of the same process, the *leader*: only the leader
//! has a world, which both draw.
//!
//! ```text
//! leader:    STATE(f) ─► begin: applied to its world ─► applied: f, hash, viewer ─┐
//! follower:  STATE(f) ─► kept unread ─────────────────────────────────────────────┴► follow: the same frame
//! ```
//!
//! The server sends the same state to all facets, so the follower compares the numbers of run and frame
//! alone. The hash that it acknowledges is that of the leader's world, which is drawn.

use super::super::messages::{Content, increment};
use super::super::table::Snapshot;
use super::super::viewer::Viewer;
use super::super::wire::{Hash, MessageError};
use super::computing::Shown;
use super::{FacetOptions, FacetSession, PendingState};
use std::collections::VecDeque;
use tumble_core::{Settings, World, WorldError};

/// A frame that a session has applied to its world.
#[derive(Clone, Debug, PartialEq)]
pub struct AppliedFrame {
    run: u64,
    frame: u64,
    time_s: f64,
    hash: Hash,
    viewer: Viewer,
}

impl AppliedFrame {
    /// Returns the number of the frame.
    pub fn frame(&self) -> u64 {
        self.frame
    }
}

/// Frames of a follower.
pub(super) struct Followed {
    content: Content,
    /// Without objects.
    world: World,
    /// Revision of the object table of the last snapshot.
    pub revision: Option<u32>,
    pub viewer: Viewer,
    pub time_s: f64,
    pub hash: Hash,
    /// Frames of inputs that wait.
    pub queue: VecDeque<PendingState>,
}

impl Followed {
    pub fn world(&self) -> &World {
        &self.world
    }

    pub fn content(&self) -> Content {
        self.content
    }

    pub fn apply_snapshot(&mut self, payload: &[u8]) -> Result<(), MessageError> {
        self.revision = Some(Snapshot::parse(payload)?.revision);
        Ok(())
    }
}

impl FacetSession {
    /// Creates a session that follows another one of this process. `computing` says whether the leader
    /// steps the world by itself ([`computing`](Self::computing)); options but the name and the seed are the
    /// leader's. Its own world has no objects.
    ///
    /// # Errors
    /// None in practice: an empty world cannot be created.
    pub fn following(options: FacetOptions, computing: bool) -> Result<FacetSession, WorldError> {
        let content = match (computing, options.exact) {
            (true, _) => Content::Inputs,
            (false, true) => Content::Exact,
            (false, false) => Content::Poses,
        };
        let (world, viewer) = (World::new(Settings::default())?, Viewer::default());
        let (hash, queue) = ([0; 16], VecDeque::new());
        let followed = Followed { content, world, revision: None, viewer, time_s: 0.0, hash, queue };
        Ok(FacetSession::with(options, Shown::Followed(followed)))
    }

    /// Returns the frame of [`begin`](Self::begin) until it is [`drawn`](Self::drawn), for followers.
    pub fn applied(&mut self) -> Option<AppliedFrame> {
        let (frame, _) = self.drawing?;
        let (hash, viewer) = (self.content.hash(), self.content.viewer().clone());
        Some(AppliedFrame { run: self.run, frame, time_s: self.time_s(), hash, viewer })
    }

    /// Begins the frame that waits if the leader has applied it last, instead of [`begin`](Self::begin).
    /// Returns whether it has; otherwise the frame goes on waiting.
    pub fn follow(&mut self, leader: &AppliedFrame) -> bool {
        let Shown::Followed(followed) = &mut self.content else { return false };
        let waiting = followed.queue.back().or(self.pending.as_ref());
        if waiting.is_none_or(|state| (self.run, state.header.frame) != (leader.run, leader.frame)) {
            return false;
        }
        let Some(state) = followed.queue.pop_back().or_else(|| self.pending.take()) else { return false };
        followed.queue.drain(..).for_each(|_| increment(&mut self.counts.missing));
        (followed.hash, followed.time_s, followed.viewer) = (leader.hash, leader.time_s, leader.viewer.clone());
        self.drawing = Some((leader.frame, state.arrived));
        true
    }
}

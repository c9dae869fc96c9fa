//! Stages of a frame: published, ready, presented.

use super::super::messages::{Content, increment};
use super::super::publisher::PublishError;
use super::super::recording::FrameRecord;
use super::super::transport::FacetNumber;
use super::super::viewer::Viewer;
use super::super::wire::{HEADER_BYTES, Hash, MessageKind, message};
use super::frame_times::note_request;
use super::{FacetState, FrameStage, Membership, ServerEvent, ServerSession, SlotCounts, SyncMode};
use std::sync::Arc;
use std::time::Duration;
use tumble_core::World;

impl ServerSession {
    /// Publishes the world as the next frame and returns its number. A world at rest must be
    /// published too, so that joining facets see it. A frame that is still in progress is
    /// abandoned, and facets that have not shown it count as late.
    ///
    /// # Errors
    /// [`PublishError`]; nothing was sent.
    pub fn publish(&mut self, now: Duration, world: &World, viewer: &Viewer) -> Result<u64, PublishError> {
        self.abandon_frame();
        let frame = self.next;
        let replicas = self.joined().any(|(_, p)| p.content == Content::Exact);
        for exact in [false, true] {
            let stream = &mut self.streams[exact as usize];
            stream.state = Arc::default();
            if exact && !replicas {
                stream.publisher.skip();
                continue; // no replica, no work
            }
            let published = stream.publisher.publish(world, viewer, frame)?;
            let list = published.fresh.then(|| stream.publisher.snapshot());
            self.time_s = world.time();
            self.take(exact, frame, list, &published.state, published.hash);
        }
        self.begin_times(frame, Some(viewer));
        self.send_frame(now, frame);
        Ok(frame)
    }

    /// Takes the events of the world's last step into the next frame: call it after each step of a frame with several.
    pub fn step(&mut self, world: &World) {
        self.streams.iter_mut().for_each(|stream| stream.publisher.step(world));
    }

    /// Publishes a recorded frame under its number. A session either simulates or replays. Replicas
    /// get nothing, because recordings hold poses.
    pub fn publish_recorded(&mut self, now: Duration, recorded: &FrameRecord) {
        self.abandon_frame();
        self.time_s = recorded.time_s;
        self.take(false, recorded.frame, recorded.snapshot.clone(), &recorded.state, recorded.hash);
        self.begin_times(recorded.frame, None);
        self.send_frame(now, recorded.frame);
    }

    fn begin_times(&mut self, frame: u64, viewer: Option<&Viewer>) {
        if let Some(frame_times) = self.frame_times.publish(frame, viewer) {
            self.report(ServerEvent::Shown(frame_times));
        }
    }

    /// Returns the last published frame for a recording. With `fresh` it includes the object table
    /// even if that is an old one.
    pub fn recorded(&self, fresh: bool) -> Option<FrameRecord> {
        let (frame, stream) = (self.frame?, &self.streams[0]);
        let state = stream.state.get(HEADER_BYTES..)?.to_vec();
        let snapshot = (fresh || stream.listed == Some(frame)).then(|| stream.snapshot.clone());
        Some(FrameRecord { frame, time_s: self.time_s, snapshot, state, hash: stream.hashes.back()?.1 })
    }

    /// Keeps a frame for sending.
    pub(super) fn take(&mut self, exact: bool, frame: u64, list: Option<Arc<Vec<u8>>>, state: &[u8], hash: Hash) {
        let head = self.head(MessageKind::State, 0, frame);
        let stream = &mut self.streams[exact as usize];
        if let Some(list) = list {
            (stream.snapshot, stream.listed) = (list, Some(frame));
        }
        stream.state = Arc::new(message(&head, |out| out.extend(state)));
        stream.hashes.push_back((frame, hash));
        while stream.hashes.len() > self.options.history {
            stream.hashes.pop_front();
        }
    }

    /// Sends the kept frame, after its object table if that is new.
    pub(super) fn send_frame(&mut self, now: Duration, frame: u64) {
        let first = self.frame.is_none();
        (self.frame, self.next, self.stage, self.first_ready_at) =
            (Some(frame), frame.wrapping_add(1), FrameStage::Idle, None);
        for facet_state in
            self.facets.iter_mut().filter(|p| p.membership == Membership::Following && (first || p.caught_up))
        {
            facet_state.membership = Membership::InStep;
        }
        for (content, stream) in [(Content::Poses, 0), (Content::Exact, 1)] {
            let of_stream = |(k, p): (FacetNumber, &FacetState)| (p.content == content).then_some((k, p.membership));
            let to: Vec<(FacetNumber, Membership)> = self.joined().filter_map(of_stream).collect();
            let stream = &self.streams[stream];
            let (fresh, state) = (stream.listed == Some(frame), stream.state.clone());
            if fresh {
                to.iter().for_each(|&(k, _)| self.send_snapshot(k));
            }
            // a following facet gets the newest frame only, not those that it missed
            for membership in [Membership::InStep, Membership::Following] {
                let to: Vec<FacetNumber> = to.iter().filter(|(_, s)| *s == membership).map(|(k, _)| *k).collect();
                if !state.is_empty() && !to.is_empty() {
                    self.send(to, self.state_delivery(membership), state.clone());
                }
            }
        }
        self.send_worlds(now);
        let present = |p: &&mut FacetState| p.membership != Membership::Absent && p.content != Content::Inputs;
        for facet_state in self.facets.iter_mut().filter(present) {
            facet_state.sent = now;
            note_request(&mut facet_state.state_requested, frame, now);
        }
        if self.options.mode == SyncMode::Lockstep {
            self.stage = FrameStage::Ready(now);
        }
        self.advance(now);
    }

    pub(super) fn advance_frame(&mut self, now: Duration) {
        let Some(frame) = self.frame else { return };
        match self.stage {
            FrameStage::Idle => {}
            FrameStage::Ready(_) => {
                let all = self.awaited().all(|p| p.ready == Some(frame));
                if !all && self.wait_deadline().is_none_or(|end| now < end) {
                    return;
                }
                self.stop_waiting(frame, |p| p.ready == Some(frame), |counts| &mut counts.late);
                let to: Vec<FacetNumber> =
                    self.joined().filter(|(_, p)| p.ready == Some(frame)).map(|(k, _)| k).collect();
                self.stage = FrameStage::Presented(now);
                self.send_present(now, to, frame);
            }
            FrameStage::Presented(_) => {
                let all = self.awaited().all(|p| p.presented == Some(frame));
                if !all && self.wait_deadline().is_none_or(|end| now < end) {
                    return;
                }
                self.stop_waiting(frame, |p| p.presented == Some(frame), |counts| &mut counts.missing);
                self.stage = FrameStage::Idle;
                if let Some(frame_times) = self.frame_times.finish(frame) {
                    self.report(ServerEvent::Shown(frame_times));
                }
                self.report(ServerEvent::Finished(frame));
            }
        }
    }

    /// Returns the time at which the server stops waiting for facets that have not answered.
    pub(super) fn wait_deadline(&self) -> Option<Duration> {
        let options = &self.options;
        match self.stage {
            FrameStage::Idle => None,
            FrameStage::Ready(since) => {
                // as long as no facet is ready, none is delayed by the others
                let at_most = since.saturating_add(options.ready_timeout.max(options.drop_timeout));
                let end = |p: &FacetState| match (p.synced, self.first_ready_at) {
                    (false, _) => since.saturating_add(options.first_frame_timeout),
                    (true, None) => at_most,
                    // it may still have to finish an older frame
                    (true, Some(first)) => {
                        first.saturating_add(options.ready_timeout * if p.caught_up { 2 } else { 1 }).min(at_most)
                    }
                };
                self.awaited().filter(|p| p.ready != self.frame).map(end).max()
            }
            FrameStage::Presented(since) => Some(since.saturating_add(self.options.ready_timeout)),
        }
    }

    /// Stops waiting for facets in step that have not `done` their part.
    pub(super) fn stop_waiting(
        &mut self,
        frame: u64,
        done: impl Fn(&FacetState) -> bool,
        counter: impl Fn(&mut SlotCounts) -> &mut u64,
    ) {
        for k in 0..self.facets.len() {
            let facet_state = &mut self.facets[k];
            if facet_state.membership == Membership::InStep && !done(facet_state) {
                facet_state.membership = Membership::Following;
                (facet_state.answered, facet_state.caught_up) = (None, false);
                increment(counter(&mut facet_state.counts));
                self.report(ServerEvent::Late(k as FacetNumber, frame));
            }
        }
    }

    /// Stops waiting for the frame in progress.
    pub(super) fn abandon_frame(&mut self) {
        let Some(frame) = self.frame else { return };
        if let FrameStage::Ready(_) = self.stage {
            self.stop_waiting(frame, |p| p.ready == Some(frame), |counts| &mut counts.late);
        }
        if let FrameStage::Presented(_) = self.stage {
            self.stop_waiting(frame, |p| p.presented == Some(frame), |counts| &mut counts.missing);
        }
    }
}

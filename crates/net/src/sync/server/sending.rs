//! Sending, and the work that is due by time.

use super::super::messages::Content;
use super::super::transport::{Delivery, FacetNumber};
use super::super::wire::{MessageHeader, MessageKind, message};
use super::frame_times::note_request;
use super::{FacetState, FrameStage, Membership, ServerSession, Stream, SyncMode, ToFacets};
use std::sync::Arc;
use std::time::Duration;

impl ServerSession {
    pub(super) fn drop_timed_out(&mut self, now: Duration) {
        let silent = |p: &FacetState| now >= p.last_received.saturating_add(self.options.drop_timeout);
        let silent: Vec<FacetNumber> = self.joined().filter(|(_, p)| silent(p)).map(|(k, _)| k).collect();
        for facet in silent {
            self.mark_absent(facet, false);
            self.close.push(facet);
        }
    }

    /// Resends unanswered messages, for links that lose messages.
    pub(super) fn resend(&mut self, now: Duration, after: Duration) {
        let due: Vec<FacetNumber> =
            self.joined().filter(|(_, p)| now >= p.sent.saturating_add(after)).map(|(k, _)| k).collect();
        for facet in due {
            let facet_state = &mut self.facets[facet as usize];
            facet_state.sent = now;
            let (synced, ready, presented) =
                (facet_state.synced, facet_state.ready == self.frame, facet_state.presented == self.frame);
            match self.stage {
                _ if !synced => self.send_snapshot_and_state(now, facet),
                FrameStage::Ready(_) if !ready => self.send_state(now, facet),
                FrameStage::Presented(_) if ready && !presented => {
                    self.send_present(now, vec![facet], self.frame.unwrap_or(0))
                }
                _ => {}
            }
        }
    }

    /// Returns the next time at which [`advance`](Self::advance) has work, if no event comes
    /// before.
    pub fn wake(&self) -> Option<Duration> {
        let joined = self.joined().map(|(_, p)| p.last_received.saturating_add(self.options.drop_timeout));
        let beats = self.joined().map(|(_, p)| p.sent.saturating_add(self.options.drop_timeout / 4));
        let again = self
            .options
            .resend_interval
            .into_iter()
            .flat_map(|after| self.joined().map(move |(_, p)| p.sent.saturating_add(after)));
        joined.chain(beats).chain(again).chain(self.wait_deadline()).min()
    }

    /// Sends heartbeats to facets that got no other message for a quarter of the drop timeout.
    pub(super) fn send_heartbeats(&mut self, now: Duration) {
        let every = self.options.drop_timeout / 4;
        let due: Vec<FacetNumber> =
            self.joined().filter(|(_, p)| now >= p.sent.saturating_add(every)).map(|(k, _)| k).collect();
        if !due.is_empty() {
            due.iter().for_each(|&k| self.facets[k as usize].sent = now);
            let send_heartbeats = message(&self.head(MessageKind::Heartbeat, 0, self.frame.unwrap_or(0)), |_| {});
            self.send(due, Delivery::Newest, Arc::new(send_heartbeats));
        }
    }

    pub(super) fn joined(&self) -> impl Iterator<Item = (FacetNumber, &FacetState)> {
        let numbered = self.facets.iter().enumerate().map(|(k, p)| (k as FacetNumber, p));
        numbered.filter(|(_, p)| p.membership != Membership::Absent)
    }

    pub(super) fn awaited(&self) -> impl Iterator<Item = &FacetState> {
        self.facets.iter().filter(|p| p.membership == Membership::InStep && p.slot.critical)
    }

    pub(super) fn state_delivery(&self, membership: Membership) -> Delivery {
        let awaited = self.options.mode == SyncMode::Lockstep && membership == Membership::InStep;
        if awaited { Delivery::Reliable } else { Delivery::Newest }
    }

    pub(super) fn head(&self, kind: MessageKind, join: u64, frame: u64) -> MessageHeader {
        MessageHeader { kind, run: self.options.run, join, frame, time_s: self.time_s }
    }

    /// Sends the snapshot and the last frame, with which a facet begins.
    pub(super) fn send_snapshot_and_state(&mut self, now: Duration, facet: FacetNumber) {
        match (self.frame, self.facets[facet as usize].content) {
            (None, _) => {}
            (Some(_), Content::Inputs) => self.send_world(now, facet),
            (Some(_), _) => {
                self.send_snapshot(facet);
                self.send_state(now, facet);
            }
        }
    }

    pub(super) fn send_snapshot(&mut self, facet: FacetNumber) {
        let facet_state = &self.facets[facet as usize];
        let (snapshot, join) = (self.stream(facet_state.content).snapshot.clone(), facet_state.join);
        if !snapshot.is_empty() {
            self.send_to(facet, MessageKind::Snapshot, join, self.frame.unwrap_or(self.next), |out| {
                out.extend(snapshot.iter())
            });
        }
    }

    pub(super) fn send_state(&mut self, now: Duration, facet: FacetNumber) {
        let content = self.facets[facet as usize].content;
        if content == Content::Inputs {
            return self.repeat_inputs(now, facet);
        }
        let state = self.stream(content).state.clone();
        if !state.is_empty() {
            note_request(&mut self.facets[facet as usize].state_requested, self.frame.unwrap_or(0), now);
            self.send(vec![facet], self.state_delivery(Membership::InStep), state);
        }
    }

    /// Returns the frames of poses, or those of exact messages.
    fn stream(&self, content: Content) -> &Stream {
        &self.streams[usize::from(content == Content::Exact)]
    }

    pub(super) fn send_present(&mut self, now: Duration, to: Vec<FacetNumber>, frame: u64) {
        if self.options.mode == SyncMode::Lockstep {
            to.iter().for_each(|&k| note_request(&mut self.facets[k as usize].present_requested, frame, now));
            let present = message(&self.head(MessageKind::Present, 0, frame), |_| {});
            self.send(to, Delivery::Reliable, Arc::new(present));
        }
    }

    pub(super) fn send_to(
        &mut self,
        facet: FacetNumber,
        kind: MessageKind,
        join: u64,
        frame: u64,
        write: impl FnOnce(&mut Vec<u8>),
    ) {
        let bytes = message(&self.head(kind, join, frame), write);
        self.send(vec![facet], Delivery::Reliable, Arc::new(bytes));
    }

    pub(super) fn send(&mut self, to: Vec<FacetNumber>, delivery: Delivery, message: Arc<Vec<u8>>) {
        if !to.is_empty() {
            self.out.push(ToFacets { to, delivery, message });
        }
    }
}

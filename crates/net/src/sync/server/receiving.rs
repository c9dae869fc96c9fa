//! Handling of the facets' messages in a server.

use super::super::compute::ObjectHashes;
use super::super::input::Input;
use super::super::messages::{Content, FacetCounts, FrameAck, Join, Refusal, increment};
use super::super::transport::FacetNumber;
use super::super::wire::{Hash, MessageError, MessageHeader, MessageKind, VERSION, is_later, open};
use super::frame_times::ClockOffset;
use super::{FrameStage, MAX_FORMER_JOINS, Membership, ServerEvent, ServerSession, SyncMode, hex, process_of};
use std::time::Duration;

impl ServerSession {
    pub(super) fn on_message(&mut self, now: Duration, facet: FacetNumber, bytes: &[u8]) {
        if facet as usize >= self.facets.len() {
            return;
        }
        match open(bytes) {
            Ok((header, payload)) => {
                if let Err(fault) = self.on_header(now, facet, &header, payload) {
                    self.count_error(facet, &fault);
                }
            }
            Err(MessageError::Version(theirs)) => {
                self.reject_join(facet, 0, format!("the server speaks NetSync version {VERSION}, this facet version {theirs}: use the same build of tumble on both"));
            }
            Err(fault) => self.count_error(facet, &fault),
        }
    }

    pub(super) fn count_error(&mut self, facet: FacetNumber, fault: &MessageError) {
        let counts = &mut self.facets[facet as usize].counts;
        increment(if *fault == MessageError::Torn { &mut counts.torn } else { &mut counts.refused });
    }

    pub(super) fn on_header(
        &mut self,
        now: Duration,
        facet: FacetNumber,
        header: &MessageHeader,
        payload: &[u8],
    ) -> Result<(), MessageError> {
        if header.kind == MessageKind::Join {
            self.on_join(now, facet, header.join, Join::read(payload)?);
            return Ok(());
        }
        let facet_state = &mut self.facets[facet as usize];
        if header.run != self.options.run
            || header.join != facet_state.join
            || facet_state.membership == Membership::Absent
        {
            increment(&mut facet_state.counts.stale);
            if facet_state.membership == Membership::Absent
                || !facet_state.former_joins.contains(&header.join) && header.join != facet_state.join
            {
                self.send_to(facet, MessageKind::Rejoin, header.join, 0, |_| {});
            }
            return Ok(());
        }
        facet_state.last_received = now;
        match header.kind {
            MessageKind::Ready => self.on_ready(now, facet, header.frame, FrameAck::read(payload)?),
            MessageKind::Presented => self.on_presented(now, facet, header.frame, FrameAck::read(payload)?),
            MessageKind::Resync => self.send_snapshot_and_state(now, facet),
            MessageKind::Heartbeat => facet_state.reported = FacetCounts::read(payload)?,
            MessageKind::Leave => self.mark_absent(facet, true),
            MessageKind::Input => self.on_input(now, facet, Input::read(payload)?),
            MessageKind::Differs => self.on_differs(facet, header.frame, &ObjectHashes::read(payload)?),
            _ => return Err(MessageError::Malformed("a kind that only servers send")),
        }
        Ok(())
    }

    pub(super) fn on_join(&mut self, now: Duration, facet: FacetNumber, join: u64, wanted: Join) {
        let facet_state = &mut self.facets[facet as usize];
        if facet_state.former_joins.contains(&join) {
            increment(&mut facet_state.counts.stale);
            return self.send_to(facet, MessageKind::Rejoin, join, 0, |_| {});
        }
        if facet_state.membership != Membership::Absent && facet_state.join == join {
            if self.frame.is_some() {
                increment(&mut facet_state.counts.duplicate); // before the first frame it asks again because nothing is answered
            }
            facet_state.last_received = now;
            if !facet_state.synced {
                self.send_snapshot_and_state(now, facet);
            }
            return;
        }
        if self.ended {
            return self.send_to(facet, MessageKind::End, join, 0, |_| {});
        }
        if let Some(why) = self.join_problem(facet, &wanted) {
            return self.reject_join(facet, join, why);
        }
        let (grace, facet_state) = (self.options.drop_timeout, &mut self.facets[facet as usize]);
        if !facet_state.duplicate_facets.admit(now, process_of(join), grace) {
            let why = format!(
                "another process already shows facet '{}': end it first, or show another facet",
                facet_state.slot.name
            );
            return self.reject_join(facet, join, why);
        }
        if self.facets[facet as usize].membership != Membership::Absent {
            self.mark_absent(facet, false);
        }
        let facet_state = &mut self.facets[facet as usize];
        (facet_state.membership, facet_state.join, facet_state.last_received, facet_state.sent) =
            (Membership::Following, join, now, now);
        (facet_state.content, facet_state.needs_world, facet_state.world_under_way) = (wanted.content, true, None);
        (facet_state.synced, facet_state.ready, facet_state.presented, facet_state.reported) =
            (false, None, None, FacetCounts::default());
        (facet_state.answered, facet_state.caught_up) = (None, false);
        facet_state.inputs.clear();
        (facet_state.clock, facet_state.state_requested, facet_state.present_requested) =
            (ClockOffset::default(), None, None);
        increment(&mut facet_state.counts.joined);
        self.report(ServerEvent::Joined(facet));
        self.send_snapshot_and_state(now, facet);
    }

    /// Returns why a facet may not join, if there is a reason.
    pub(super) fn join_problem(&self, facet: FacetNumber, wanted: &Join) -> Option<String> {
        let slot = &self.facets[facet as usize].slot;
        if slot.name != wanted.name {
            return Some(format!(
                "facet {facet} of the server's cave is '{}', not '{}': use the same cave file on both",
                slot.name, wanted.name
            ));
        }
        let ours = match (wanted.content, self.options.compute) {
            (Content::Inputs, None) => {
                return Some(format!(
                    "facet '{}' computes by itself, and the server sends no inputs: start it with --compute everywhere",
                    slot.name
                ));
            }
            (Content::Inputs, Some(hash)) => hex(&hash),
            _ => hex(&self.options.scene),
        };
        let theirs = hex(&wanted.scene);
        (ours != theirs).then(|| {
            format!(
                "the server's scene has the hash {ours}, that of facet '{}' has {theirs}: use the same files on both",
                slot.name
            )
        })
    }

    pub(super) fn reject_join(&mut self, facet: FacetNumber, join: u64, why: String) {
        increment(&mut self.facets[facet as usize].counts.refused);
        let refusal = Refusal(why.clone());
        self.send_to(facet, MessageKind::Refused, join, 0, |out| refusal.write(out));
        self.report(ServerEvent::Refused(facet, why));
    }

    /// Returns whether a frame's hash is right, if the frame is remembered.
    pub(super) fn check(&self, content: Content, frame: u64, hash: &Hash) -> Option<bool> {
        let of_stream = |k: usize| self.streams[k].hashes.iter().find(|(f, _)| *f == frame).map(|(_, ours)| ours);
        let ours = match content {
            Content::Poses => of_stream(0),
            Content::Exact => of_stream(1),
            Content::Inputs => self.inputs.hash(frame),
        };
        ours.map(|ours| ours == hash)
    }

    /// Detects that a following facet is fast enough again. It draws one frame after the other,
    /// always the newest, so the time between two answers is its drawing time. If that is well
    /// below `ready_timeout`, the facet can be awaited again, even if it is slower than the frame
    /// rate.
    fn track_catch_up(&mut self, now: Duration, facet: FacetNumber, frame: u64) {
        let well_below = self.options.ready_timeout * 3 / 4;
        let facet_state = &mut self.facets[facet as usize];
        if self.options.mode != SyncMode::Lockstep
            || facet_state.membership != Membership::Following
            || facet_state.answered.is_some_and(|(last, _)| !is_later(frame, last))
        {
            return;
        }
        facet_state.caught_up = facet_state.answered.is_some_and(|(_, at)| now.saturating_sub(at) < well_below);
        facet_state.answered = Some((frame, now));
    }

    pub(super) fn on_ready(&mut self, now: Duration, facet: FacetNumber, frame: u64, done: FrameAck) {
        self.track_catch_up(now, facet, frame);
        let facet_state = &self.facets[facet as usize];
        let right = self.check(facet_state.content, frame, &done.hash);
        let facet_state = &mut self.facets[facet as usize];
        let Some(right) = right else { return increment(&mut facet_state.counts.stale) };
        let again = facet_state.ready.is_some_and(|f| !is_later(frame, f));
        facet_state.synced = true;
        facet_state.answer_world(frame);
        if again {
            increment(&mut facet_state.counts.duplicate);
        } else {
            facet_state.ready = Some(frame);
            if self.frame == Some(frame) && self.options.mode == SyncMode::Lockstep {
                self.first_ready_at = self
                    .first_ready_at
                    .or((facet_state.membership == Membership::InStep && facet_state.slot.critical).then_some(now));
                (facet_state.membership, facet_state.answered, facet_state.caught_up) =
                    (Membership::InStep, None, false);
            }
            if !right {
                self.replace_wrong_world(facet);
            }
            self.time_ready(now, facet as usize, frame, &done);
            self.report(ServerEvent::Ready(facet, frame, done, right));
        }
        let at_the_barrier = self.frame == Some(frame) && matches!(self.stage, FrameStage::Ready(_));
        self.advance_frame(now);
        // a late or repeated READY gets its own PRESENT
        if !at_the_barrier && self.facets[facet as usize].presented != Some(frame) {
            self.send_present(now, vec![facet], frame);
        }
    }

    pub(super) fn on_presented(&mut self, now: Duration, facet: FacetNumber, frame: u64, done: FrameAck) {
        let facet_state = &self.facets[facet as usize];
        let right = self.check(facet_state.content, frame, &done.hash);
        let latest = self.options.mode == SyncMode::Latest;
        let facet_state = &mut self.facets[facet as usize];
        let Some(right) = right else { return increment(&mut facet_state.counts.stale) };
        if facet_state.presented.is_some_and(|f| !is_later(frame, f)) {
            return increment(&mut facet_state.counts.duplicate);
        }
        facet_state.presented = Some(frame);
        facet_state.synced = true;
        facet_state.answer_world(frame);
        increment(&mut facet_state.counts.presented);
        if latest {
            facet_state.membership = Membership::InStep;
        }
        if !right && latest {
            self.replace_wrong_world(facet);
        }
        self.time_presented(now, facet as usize, frame, &done);
        self.report(ServerEvent::Presented(facet, frame, done, right));
    }

    pub(super) fn on_input(&mut self, now: Duration, facet: FacetNumber, input: Input) {
        let facet_state = &mut self.facets[facet as usize];
        if let Some(&newest) = facet_state.inputs.get(&input.user)
            && !is_later(input.sequence, newest)
        {
            return increment(if input.sequence == newest {
                &mut facet_state.counts.duplicate
            } else {
                &mut facet_state.counts.stale
            });
        }
        facet_state.inputs.insert(input.user, input.sequence);
        self.frame_times.input(now, input.user, input.sequence);
        self.report(ServerEvent::Input(facet, input));
    }

    pub(super) fn mark_absent(&mut self, facet: FacetNumber, on_request: bool) {
        let Some(facet_state) = self.facets.get_mut(facet as usize).filter(|p| p.membership != Membership::Absent)
        else {
            return;
        };
        facet_state.membership = Membership::Absent;
        facet_state.former_joins.push_back(facet_state.join);
        if facet_state.former_joins.len() > MAX_FORMER_JOINS {
            facet_state.former_joins.pop_front();
        }
        if !on_request {
            increment(&mut facet_state.counts.dropped);
        }
        self.report(ServerEvent::Gone(facet, on_request));
    }
}

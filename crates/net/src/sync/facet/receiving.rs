//! Handling of the server's messages in a facet.

use super::super::messages::{Refusal, increment};
use super::super::mirror::Mirror;
use super::super::server::SyncMode;
use super::super::table::Snapshot;
use super::super::transport::Message;
use super::super::wire::{HEADER_BYTES, MessageError, MessageHeader, MessageKind, VERSION, is_later, open};
use super::computing::NO_MIRROR;
use super::{EndReason, FacetSession, PendingState, Phase};
use std::time::Duration;

impl FacetSession {
    pub(super) fn on_message(&mut self, now: Duration, message: Message) {
        if let Phase::Ended(_) = self.phase {
            return;
        }
        let taken = match open(&message).map(|(header, _)| header) {
            Ok(header) => self.on_header(now, header, message),
            Err(MessageError::Version(theirs)) if self.phase == Phase::Joining => {
                let why = format!(
                    "the server speaks NetSync version {theirs}, this facet version {VERSION}: use the same build of tumble on both"
                );
                self.phase = Phase::Ended(EndReason::Refused(why));
                Ok(())
            }
            Err(fault) => Err(fault),
        };
        if let Err(fault) = taken {
            increment(if fault == MessageError::Torn { &mut self.counts.torn } else { &mut self.counts.refused });
        }
    }

    fn on_header(&mut self, now: Duration, header: MessageHeader, message: Message) -> Result<(), MessageError> {
        let payload = &message[HEADER_BYTES..]; // it was opened
        let about_us = header.join == self.join;
        let live = self.phase == Phase::Live && header.run == self.run;
        match header.kind {
            MessageKind::Snapshot if about_us && (live || self.phase == Phase::Joining) => {
                if self.drawing.is_some() {
                    self.list = Some(PendingState { header, message, arrived: now });
                } else {
                    self.on_snapshot(now, &header, payload)?;
                }
            }
            MessageKind::World if about_us && (live || self.phase == Phase::Joining) => {
                return self.on_world(now, header, message);
            }
            MessageKind::Step if live => return self.on_step(now, header, message),
            MessageKind::Refused if about_us => {
                self.phase = Phase::Ended(EndReason::Refused(Refusal::read(payload)?.0))
            }
            MessageKind::Rejoin if about_us && self.phase == Phase::Live => self.on_server_lost(),
            MessageKind::Rejoin if about_us => self.restart_join(),
            MessageKind::End if live || about_us => {
                // the server waits for this acknowledgement
                self.send(MessageKind::Leave, 0, |_| {});
                self.phase = Phase::Ended(EndReason::Ended);
            }
            MessageKind::State if self.phase == Phase::Joining => self.keep_early(now, header, message),
            MessageKind::State if live => return self.on_state(now, header, message),
            MessageKind::Present if live => self.on_present(now, header.frame),
            MessageKind::Heartbeat if live => {}
            MessageKind::Snapshot
            | MessageKind::Refused
            | MessageKind::Rejoin
            | MessageKind::End
            | MessageKind::State
            | MessageKind::World
            | MessageKind::Step
            | MessageKind::Present
            | MessageKind::Heartbeat => {
                increment(&mut self.counts.stale);
                return Ok(());
            }
            _ => return Err(MessageError::Malformed("a kind that only facets send")),
        }
        self.last_received = now;
        Ok(())
    }

    pub(super) fn on_snapshot(
        &mut self,
        now: Duration,
        header: &MessageHeader,
        payload: &[u8],
    ) -> Result<(), MessageError> {
        self.last_received = now;
        if let Some(listed) = self.listed.filter(|listed| !is_later(header.frame, *listed)) {
            increment(if listed == header.frame { &mut self.counts.duplicate } else { &mut self.counts.stale });
            return Ok(());
        }
        if !self.content.gets_states() {
            return Err(NO_MIRROR);
        }
        if self.phase == Phase::Live && Some(Snapshot::revision_of(payload)?) == self.content.revision() {
            increment(&mut self.counts.duplicate);
            return Ok(());
        }
        self.content.apply_snapshot(payload)?;
        let revision = self.content.revision();
        (self.phase, self.run, self.listed, self.lost, self.resynced) =
            (Phase::Live, header.run, Some(header.frame), false, None);
        if self.pending.take().is_some() {
            increment(&mut self.counts.missing); // it belonged to the old list
        }
        let early = self.early.take().filter(|early| early.header.run == self.run);
        let fits = early.filter(|early| Mirror::revision_of(&early.message[HEADER_BYTES..]).ok() == revision);
        fits.into_iter().for_each(|early| self.take_state(early));
        Ok(())
    }

    fn on_state(&mut self, now: Duration, header: MessageHeader, message: Message) -> Result<(), MessageError> {
        self.last_received = now;
        if !self.content.gets_states() {
            return Err(NO_MIRROR);
        }
        if Some(Mirror::revision_of(&message[HEADER_BYTES..])?) == self.content.revision() {
            self.take_state(PendingState { header, message, arrived: now });
            return Ok(());
        }
        if self.newest.is_some_and(|newest| !is_later(header.frame, newest)) {
            increment(&mut self.counts.stale);
            return Ok(());
        }
        self.keep_early(now, header, message);
        self.resync(now);
        Ok(())
    }

    /// Requests snapshot and state again, at most once per join interval.
    pub(super) fn resync(&mut self, now: Duration) {
        if self.resynced.is_none_or(|asked| now >= asked.saturating_add(self.options.join_interval)) {
            self.resynced = Some(now);
            self.send(MessageKind::Resync, 0, |_| {});
        }
    }

    fn keep_early(&mut self, now: Duration, header: MessageHeader, message: Message) {
        increment(&mut self.counts.early);
        self.early = Some(PendingState { header, message, arrived: now });
    }

    fn take_state(&mut self, state: PendingState) {
        let frame = state.header.frame;
        if let Some(newest) = self.newest {
            if frame == newest {
                increment(&mut self.counts.duplicate);
                return self.repeat_answer(frame);
            }
            if !is_later(frame, newest) {
                return increment(&mut self.counts.stale);
            }
            self.counts.missing = self.counts.missing.wrapping_add(frame.wrapping_sub(newest) - 1);
        }
        self.newest = Some(frame);
        if self.pending.replace(state).is_some() {
            increment(&mut self.counts.missing);
        }
        self.show |= self.drawn_frame.is_some();
    }

    fn on_present(&mut self, now: Duration, frame: u64) {
        let drawn_frame = self.drawn_frame.as_ref().map(|(drawn_frame, ..)| *drawn_frame);
        let shown = self.shown.map(|(shown, _)| shown);
        if drawn_frame == Some(frame) {
            if !self.show {
                self.present_received = Some(now);
            }
            self.show = true;
        } else if shown == Some(frame) {
            increment(&mut self.counts.duplicate);
            self.repeat_answer(frame);
        } else if self.newest.is_none_or(|newest| is_later(frame, newest) || frame == newest) {
            increment(&mut self.counts.early);
        } else {
            increment(&mut self.counts.stale);
        }
    }

    /// Repeats an acknowledgement that was lost: the server has asked again.
    pub(super) fn repeat_answer(&mut self, frame: u64) {
        if let Some((drawn_frame, done, _)) = self.drawn_frame.filter(|(drawn_frame, ..)| *drawn_frame == frame) {
            self.answer(MessageKind::Ready, drawn_frame, &done);
        } else if let Some((shown, done)) = self.shown.filter(|(shown, _)| *shown == frame) {
            if self.options.mode == SyncMode::Lockstep {
                self.answer(MessageKind::Ready, shown, &done);
            }
            self.answer(MessageKind::Presented, shown, &done);
        }
    }
}

//! What a facet does with each message of the server.

use super::super::messages::{Refusal, count};
use super::super::mirror::Mirror;
use super::super::server::Pace;
use super::super::table::Snapshot;
use super::super::transport::Message;
use super::super::wire::{Fault, HEADER_BYTES, Header, Kind, VERSION, later, open};
use super::{FacetSession, Over, Pending, Phase};
use std::time::Duration;

impl FacetSession {
    pub(super) fn on_message(&mut self, now: Duration, message: Message) {
        if let Phase::Over(_) = self.phase {
            return;
        }
        let taken = match open(&message).map(|(header, _)| header) {
            Ok(header) => self.on_header(now, header, message),
            Err(Fault::Version(theirs)) if self.phase == Phase::Joining => {
                let why = format!(
                    "the server speaks NetSync version {theirs}, this facet version {VERSION}: use the same build of tumble on both"
                );
                self.phase = Phase::Over(Over::Refused(why));
                Ok(())
            }
            Err(fault) => Err(fault),
        };
        if let Err(fault) = taken {
            count(if fault == Fault::Torn { &mut self.counts.torn } else { &mut self.counts.refused });
        }
    }

    fn on_header(&mut self, now: Duration, header: Header, message: Message) -> Result<(), Fault> {
        let payload = &message[HEADER_BYTES..]; // it was opened
        let about_us = header.join == self.join;
        let live = self.phase == Phase::Live && header.run == self.run;
        match header.kind {
            Kind::Snapshot if about_us && (live || self.phase == Phase::Joining) => {
                if self.drawing.is_some() {
                    self.list = Some(Pending { header, message, arrived: now });
                } else {
                    self.on_snapshot(now, &header, payload)?;
                }
            }
            Kind::Refused if about_us => self.phase = Phase::Over(Over::Refused(Refusal::read(payload)?.0)),
            Kind::Rejoin if about_us && self.phase == Phase::Live => self.lose(),
            Kind::Rejoin if about_us => self.join_anew(),
            Kind::End if live || about_us => {
                // so that the server knows who has heard it
                self.send(Kind::Leave, 0, |_| {});
                self.phase = Phase::Over(Over::Ended);
            }
            Kind::State if self.phase == Phase::Joining => self.keep_early(now, header, message),
            Kind::State if live => return self.on_state(now, header, message),
            Kind::Present if live => self.on_present(now, header.frame),
            Kind::Beat if live => {}
            Kind::Snapshot | Kind::Refused | Kind::Rejoin | Kind::End | Kind::State | Kind::Present | Kind::Beat => {
                count(&mut self.counts.stale);
                return Ok(());
            }
            _ => return Err(Fault::Malformed("a kind that only facets send")),
        }
        self.heard = now;
        Ok(())
    }

    pub(super) fn on_snapshot(&mut self, now: Duration, header: &Header, payload: &[u8]) -> Result<(), Fault> {
        self.heard = now;
        if let Some(listed) = self.listed.filter(|listed| !later(header.frame, *listed)) {
            count(if listed == header.frame { &mut self.counts.duplicate } else { &mut self.counts.stale });
            return Ok(());
        }
        if self.phase == Phase::Live && Some(Snapshot::revision_of(payload)?) == self.mirror.revision() {
            count(&mut self.counts.duplicate);
            return Ok(());
        }
        self.mirror.apply_snapshot(payload)?;
        (self.phase, self.run, self.listed, self.lost, self.resynced) =
            (Phase::Live, header.run, Some(header.frame), false, None);
        if self.pending.take().is_some() {
            count(&mut self.counts.missing); // it belonged to the old list
        }
        let early = self.early.take().filter(|early| early.header.run == self.run);
        let fits =
            early.filter(|early| Mirror::revision_of(&early.message[HEADER_BYTES..]).ok() == self.mirror.revision());
        fits.into_iter().for_each(|early| self.take_state(early));
        Ok(())
    }

    fn on_state(&mut self, now: Duration, header: Header, message: Message) -> Result<(), Fault> {
        self.heard = now;
        if Some(Mirror::revision_of(&message[HEADER_BYTES..])?) == self.mirror.revision() {
            self.take_state(Pending { header, message, arrived: now });
            return Ok(());
        }
        if self.newest.is_some_and(|newest| !later(header.frame, newest)) {
            count(&mut self.counts.stale);
            return Ok(());
        }
        self.keep_early(now, header, message);
        self.resync(now);
        Ok(())
    }

    /// Asks for the list and the frame again, unless it did so a moment ago.
    pub(super) fn resync(&mut self, now: Duration) {
        if self.resynced.is_none_or(|asked| now >= asked.saturating_add(self.options.join_every)) {
            self.resynced = Some(now);
            self.send(Kind::Resync, 0, |_| {});
        }
    }

    fn keep_early(&mut self, now: Duration, header: Header, message: Message) {
        count(&mut self.counts.early);
        self.early = Some(Pending { header, message, arrived: now });
    }

    fn take_state(&mut self, state: Pending) {
        let frame = state.header.frame;
        if let Some(newest) = self.newest {
            if frame == newest {
                count(&mut self.counts.duplicate);
                return self.answer_again(frame);
            }
            if !later(frame, newest) {
                return count(&mut self.counts.stale);
            }
            self.counts.missing = self.counts.missing.wrapping_add(frame.wrapping_sub(newest) - 1);
        }
        self.newest = Some(frame);
        if self.pending.replace(state).is_some() {
            count(&mut self.counts.missing);
        }
        self.show |= self.held.is_some();
    }

    fn on_present(&mut self, now: Duration, frame: u64) {
        let held = self.held.as_ref().map(|(held, ..)| *held);
        let shown = self.shown.map(|(shown, _)| shown);
        if held == Some(frame) {
            if !self.show {
                self.told = Some(now);
            }
            self.show = true;
        } else if shown == Some(frame) {
            count(&mut self.counts.duplicate);
            self.answer_again(frame);
        } else if self.newest.is_none_or(|newest| later(frame, newest) || frame == newest) {
            count(&mut self.counts.early);
        } else {
            count(&mut self.counts.stale);
        }
    }

    /// The server asks again: the answer was lost.
    fn answer_again(&mut self, frame: u64) {
        if let Some((held, done, _)) = self.held.filter(|(held, ..)| *held == frame) {
            self.answer(Kind::Ready, held, &done);
        } else if let Some((shown, done)) = self.shown.filter(|(shown, _)| *shown == frame) {
            if self.options.pace == Pace::Lockstep {
                self.answer(Kind::Ready, shown, &done);
            }
            self.answer(Kind::Presented, shown, &done);
        }
    }
}

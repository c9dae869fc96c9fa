//! What a server sends, and what it does when time passes.

use super::super::transport::{Delivery, FacetNumber};
use super::super::wire::{Header, Kind, message};
use super::times::ask;
use super::{Pace, Place, ServerSession, Stage, Standing, ToFacets};
use std::sync::Arc;
use std::time::Duration;

impl ServerSession {
    pub(super) fn drop_the_silent(&mut self, now: Duration) {
        let silent = |p: &Place| now >= p.heard.saturating_add(self.options.drop_after);
        let silent: Vec<FacetNumber> = self.there().filter(|(_, p)| silent(p)).map(|(k, _)| k).collect();
        for facet in silent {
            self.gone(facet, false);
            self.close.push(facet);
        }
    }

    /// Over a link that loses messages: what is unanswered goes out again.
    pub(super) fn resend(&mut self, now: Duration, after: Duration) {
        let due: Vec<FacetNumber> =
            self.there().filter(|(_, p)| now >= p.sent.saturating_add(after)).map(|(k, _)| k).collect();
        for facet in due {
            let place = &mut self.places[facet as usize];
            place.sent = now;
            let (synced, ready, presented) = (place.synced, place.ready == self.frame, place.presented == self.frame);
            match self.stage {
                _ if !synced => self.send_all_again(now, facet),
                Stage::Ready(_) if !ready => self.send_state(now, facet),
                Stage::Presented(_) if ready && !presented => {
                    self.send_present(now, vec![facet], self.frame.unwrap_or(0))
                }
                _ => {}
            }
        }
    }

    /// The next time at which [`advance`](Self::advance) has something to do, if nothing comes before.
    pub fn wake(&self) -> Option<Duration> {
        let there = self.there().map(|(_, p)| p.heard.saturating_add(self.options.drop_after));
        let beats = self.there().map(|(_, p)| p.sent.saturating_add(self.options.drop_after / 4));
        let again = self
            .options
            .resend_after
            .into_iter()
            .flat_map(|after| self.there().map(move |(_, p)| p.sent.saturating_add(after)));
        there.chain(beats).chain(again).chain(self.patience_ends()).min()
    }

    /// Who hears nothing else hears that the server lives.
    pub(super) fn beat(&mut self, now: Duration) {
        let every = self.options.drop_after / 4;
        let due: Vec<FacetNumber> =
            self.there().filter(|(_, p)| now >= p.sent.saturating_add(every)).map(|(k, _)| k).collect();
        if !due.is_empty() {
            due.iter().for_each(|&k| self.places[k as usize].sent = now);
            let beat = message(&self.head(Kind::Beat, 0, self.frame.unwrap_or(0)), |_| {});
            self.send(due, Delivery::Newest, Arc::new(beat));
        }
    }

    pub(super) fn there(&self) -> impl Iterator<Item = (FacetNumber, &Place)> {
        let numbered = self.places.iter().enumerate().map(|(k, p)| (k as FacetNumber, p));
        numbered.filter(|(_, p)| p.standing != Standing::Absent)
    }

    pub(super) fn waited_for(&self) -> impl Iterator<Item = &Place> {
        self.places.iter().filter(|p| p.standing == Standing::InStep && p.seat.critical)
    }

    pub(super) fn state_delivery(&self, standing: Standing) -> Delivery {
        let waited_for = self.options.pace == Pace::Lockstep && standing == Standing::InStep;
        if waited_for { Delivery::Reliable } else { Delivery::Newest }
    }

    pub(super) fn head(&self, kind: Kind, join: u64, frame: u64) -> Header {
        Header { kind, run: self.options.run, join, frame, time_s: self.time_s }
    }

    /// The snapshot, and the frame published last: what a facet needs to begin.
    pub(super) fn send_all_again(&mut self, now: Duration, facet: FacetNumber) {
        if self.frame.is_some() {
            self.send_snapshot(facet);
            self.send_state(now, facet);
        }
    }

    pub(super) fn send_snapshot(&mut self, facet: FacetNumber) {
        let place = &self.places[facet as usize];
        let (snapshot, join) = (self.streams[place.exact as usize].snapshot.clone(), place.join);
        if !snapshot.is_empty() {
            self.send_to(facet, Kind::Snapshot, join, self.frame.unwrap_or(self.next), |out| {
                out.extend(snapshot.iter())
            });
        }
    }

    pub(super) fn send_state(&mut self, now: Duration, facet: FacetNumber) {
        let state = self.streams[self.places[facet as usize].exact as usize].state.clone();
        if !state.is_empty() {
            ask(&mut self.places[facet as usize].asked_state, self.frame.unwrap_or(0), now);
            self.send(vec![facet], self.state_delivery(Standing::InStep), state);
        }
    }

    pub(super) fn send_present(&mut self, now: Duration, to: Vec<FacetNumber>, frame: u64) {
        if self.options.pace == Pace::Lockstep {
            to.iter().for_each(|&k| ask(&mut self.places[k as usize].asked_present, frame, now));
            let present = message(&self.head(Kind::Present, 0, frame), |_| {});
            self.send(to, Delivery::Reliable, Arc::new(present));
        }
    }

    pub(super) fn send_to(
        &mut self,
        facet: FacetNumber,
        kind: Kind,
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

//! What a server does with each message of a facet.

use super::super::input::Input;
use super::super::messages::{Done, FacetCounts, Join, Refusal, count};
use super::super::transport::FacetNumber;
use super::super::wire::{Fault, Hash, Header, Kind, VERSION, later, open};
use super::times::Clock;
use super::{MAX_RETIRED, Pace, ServerEvent, ServerSession, Stage, Standing, hex, process_of};
use std::time::Duration;

impl ServerSession {
    pub(super) fn on_message(&mut self, now: Duration, facet: FacetNumber, bytes: &[u8]) {
        if facet as usize >= self.places.len() {
            return;
        }
        match open(bytes) {
            Ok((header, payload)) => {
                if let Err(fault) = self.on_header(now, facet, &header, payload) {
                    self.refuse(facet, &fault);
                }
            }
            Err(Fault::Version(theirs)) => {
                self.deny(facet, 0, format!("the server speaks NetSync version {VERSION}, this facet version {theirs}: use the same build of tumble on both"));
            }
            Err(fault) => self.refuse(facet, &fault),
        }
    }

    pub(super) fn refuse(&mut self, facet: FacetNumber, fault: &Fault) {
        let counts = &mut self.places[facet as usize].counts;
        count(if *fault == Fault::Torn { &mut counts.torn } else { &mut counts.refused });
    }

    pub(super) fn on_header(
        &mut self,
        now: Duration,
        facet: FacetNumber,
        header: &Header,
        payload: &[u8],
    ) -> Result<(), Fault> {
        if header.kind == Kind::Join {
            self.on_join(now, facet, header.join, Join::read(payload)?);
            return Ok(());
        }
        let place = &mut self.places[facet as usize];
        if header.run != self.options.run || header.join != place.join || place.standing == Standing::Absent {
            count(&mut place.counts.stale);
            if place.standing == Standing::Absent || !place.retired.contains(&header.join) && header.join != place.join
            {
                self.send_to(facet, Kind::Rejoin, header.join, 0, |_| {});
            }
            return Ok(());
        }
        place.heard = now;
        match header.kind {
            Kind::Ready => self.on_ready(now, facet, header.frame, Done::read(payload)?),
            Kind::Presented => self.on_presented(now, facet, header.frame, Done::read(payload)?),
            Kind::Resync => self.send_all_again(now, facet),
            Kind::Beat => place.told = FacetCounts::read(payload)?,
            Kind::Leave => self.gone(facet, true),
            Kind::Input => self.on_input(now, facet, Input::read(payload)?),
            _ => return Err(Fault::Malformed("a kind that only servers send")),
        }
        Ok(())
    }

    pub(super) fn on_join(&mut self, now: Duration, facet: FacetNumber, join: u64, wanted: Join) {
        let place = &mut self.places[facet as usize];
        if place.retired.contains(&join) {
            count(&mut place.counts.stale);
            return self.send_to(facet, Kind::Rejoin, join, 0, |_| {});
        }
        if place.standing != Standing::Absent && place.join == join {
            if self.frame.is_some() {
                count(&mut place.counts.duplicate); // before the first frame it asks again because nothing is answered
            }
            place.heard = now;
            if !place.synced {
                self.send_all_again(now, facet);
            }
            return;
        }
        if self.ended {
            return self.send_to(facet, Kind::End, join, 0, |_| {});
        }
        if let Some(why) = self.objection(facet, &wanted) {
            return self.deny(facet, join, why);
        }
        let (soon, place) = (self.options.drop_after, &mut self.places[facet as usize]);
        if !place.rivals.admit(now, process_of(join), soon) {
            let why = format!(
                "another process shows facet '{}' and answers: end that one first, or show another facet",
                place.seat.name
            );
            return self.deny(facet, join, why);
        }
        if self.places[facet as usize].standing != Standing::Absent {
            self.gone(facet, false);
        }
        let place = &mut self.places[facet as usize];
        (place.standing, place.join, place.exact, place.heard, place.sent) =
            (Standing::Following, join, wanted.exact, now, now);
        (place.synced, place.ready, place.presented, place.told) = (false, None, None, FacetCounts::default());
        (place.answered, place.keeps_up) = (None, false);
        place.inputs.clear();
        (place.clock, place.asked_state, place.asked_present) = (Clock::default(), None, None);
        count(&mut place.counts.joined);
        self.tell(ServerEvent::Joined(facet));
        self.send_all_again(now, facet);
    }

    /// Why a facet cannot be let in.
    pub(super) fn objection(&self, facet: FacetNumber, wanted: &Join) -> Option<String> {
        let seat = &self.places[facet as usize].seat;
        if seat.name != wanted.name {
            return Some(format!(
                "facet {facet} of the server's cave is '{}', not '{}': use the same cave file on both",
                seat.name, wanted.name
            ));
        }
        let (ours, theirs) = (hex(&self.options.scene), hex(&wanted.scene));
        (ours != theirs).then(|| {
            format!(
                "the server's scene has the hash {ours}, that of facet '{}' has {theirs}: use the same files on both",
                seat.name
            )
        })
    }

    pub(super) fn deny(&mut self, facet: FacetNumber, join: u64, why: String) {
        count(&mut self.places[facet as usize].counts.refused);
        let refusal = Refusal(why.clone());
        self.send_to(facet, Kind::Refused, join, 0, |out| refusal.write(out));
        self.tell(ServerEvent::Refused(facet, why));
    }

    /// Whether a frame's hash is what was sent, if it is remembered.
    pub(super) fn check(&self, exact: bool, frame: u64, hash: &Hash) -> Option<bool> {
        self.streams[exact as usize].hashes.iter().find(|(f, _)| *f == frame).map(|(_, ours)| ours == hash)
    }

    /// A facet that follows draws one frame after the other, always the newest: the time between two answers is what one takes it. Where that is well below what
    /// a frame is waited for, it can be waited for again, also if it is slower than the frames come.
    fn watch_pace(&mut self, now: Duration, facet: FacetNumber, frame: u64) {
        let well_below = self.options.ready_after * 3 / 4;
        let place = &mut self.places[facet as usize];
        if self.options.pace != Pace::Lockstep
            || place.standing != Standing::Following
            || place.answered.is_some_and(|(last, _)| !later(frame, last))
        {
            return;
        }
        place.keeps_up = place.answered.is_some_and(|(_, at)| now.saturating_sub(at) < well_below);
        place.answered = Some((frame, now));
    }

    pub(super) fn on_ready(&mut self, now: Duration, facet: FacetNumber, frame: u64, done: Done) {
        self.watch_pace(now, facet, frame);
        let place = &self.places[facet as usize];
        let right = self.check(place.exact, frame, &done.hash);
        let place = &mut self.places[facet as usize];
        let Some(right) = right else { return count(&mut place.counts.stale) };
        let again = place.ready.is_some_and(|f| !later(frame, f));
        place.synced = true;
        if again {
            count(&mut place.counts.duplicate);
        } else {
            place.ready = Some(frame);
            if self.frame == Some(frame) && self.options.pace == Pace::Lockstep {
                self.first_ready =
                    self.first_ready.or((place.standing == Standing::InStep && place.seat.critical).then_some(now));
                (place.standing, place.answered, place.keeps_up) = (Standing::InStep, None, false);
            }
            if !right {
                count(&mut place.counts.mismatched);
            }
            self.time_ready(now, facet as usize, frame, &done);
            self.tell(ServerEvent::Ready(facet, frame, done, right));
        }
        let at_the_barrier = self.frame == Some(frame) && matches!(self.stage, Stage::Ready(_));
        self.turn(now);
        // who comes when the frame has been shown, or asks again, is answered by itself
        if !at_the_barrier && self.places[facet as usize].presented != Some(frame) {
            self.send_present(now, vec![facet], frame);
        }
    }

    pub(super) fn on_presented(&mut self, now: Duration, facet: FacetNumber, frame: u64, done: Done) {
        let place = &self.places[facet as usize];
        let right = self.check(place.exact, frame, &done.hash);
        let latest = self.options.pace == Pace::Latest;
        let place = &mut self.places[facet as usize];
        let Some(right) = right else { return count(&mut place.counts.stale) };
        if place.presented.is_some_and(|f| !later(frame, f)) {
            return count(&mut place.counts.duplicate);
        }
        place.presented = Some(frame);
        place.synced = true;
        count(&mut place.counts.presented);
        if latest {
            place.standing = Standing::InStep;
        }
        if !right && latest {
            count(&mut place.counts.mismatched);
        }
        self.time_presented(now, facet as usize, frame, &done);
        self.tell(ServerEvent::Presented(facet, frame, done, right));
    }

    pub(super) fn on_input(&mut self, now: Duration, facet: FacetNumber, input: Input) {
        let place = &mut self.places[facet as usize];
        if let Some(&newest) = place.inputs.get(&input.user)
            && !later(input.sequence, newest)
        {
            return count(if input.sequence == newest { &mut place.counts.duplicate } else { &mut place.counts.stale });
        }
        place.inputs.insert(input.user, input.sequence);
        self.times.input(now, input.user, input.sequence);
        self.tell(ServerEvent::Input(facet, input));
    }

    pub(super) fn gone(&mut self, facet: FacetNumber, by_its_word: bool) {
        let Some(place) = self.places.get_mut(facet as usize).filter(|p| p.standing != Standing::Absent) else {
            return;
        };
        place.standing = Standing::Absent;
        place.retired.push_back(place.join);
        if place.retired.len() > MAX_RETIRED {
            place.retired.pop_front();
        }
        if !by_its_word {
            count(&mut place.counts.dropped);
        }
        self.tell(ServerEvent::Gone(facet, by_its_word));
    }
}

//! A frame's way: published, ready, presented.

use super::super::messages::count;
use super::super::publisher::PublishError;
use super::super::recording::Recorded;
use super::super::transport::FacetNumber;
use super::super::viewer::Viewer;
use super::super::wire::{HEADER_BYTES, Hash, Kind, message};
use super::times::ask;
use super::{Pace, Place, SeatCounts, ServerEvent, ServerSession, Stage, Standing};
use std::sync::Arc;
use std::time::Duration;
use tumble_core::World;

impl ServerSession {
    /// Publishes the world as the next frame; its number. Publish also while the world stands still, so that who joins sees it. Where a frame is still
    /// under way it is given up, and who has not shown it counts as late.
    ///
    /// # Errors
    /// [`PublishError`]; nothing was sent.
    pub fn publish(&mut self, now: Duration, world: &World, viewer: &Viewer) -> Result<u64, PublishError> {
        self.give_up();
        let frame = self.next;
        let replicas = self.there().any(|(_, p)| p.exact);
        for exact in [false, true] {
            let stream = &mut self.streams[exact as usize];
            stream.state = Arc::default();
            if exact && !replicas {
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

    /// Publishes a frame as it was recorded, under its number. One session either simulates or replays. Replicas get nothing: recordings hold poses.
    pub fn publish_recorded(&mut self, now: Duration, recorded: &Recorded) {
        self.give_up();
        self.time_s = recorded.time_s;
        self.take(false, recorded.frame, recorded.snapshot.clone(), &recorded.state, recorded.hash);
        self.begin_times(recorded.frame, None);
        self.send_frame(now, recorded.frame);
    }

    fn begin_times(&mut self, frame: u64, viewer: Option<&Viewer>) {
        if let Some(times) = self.times.publish(frame, viewer) {
            self.tell(ServerEvent::Shown(times));
        }
    }

    /// The frame published last, as a recording keeps it; `fresh`: with its list of objects even if that is an old one.
    pub fn recorded(&self, fresh: bool) -> Option<Recorded> {
        let (frame, stream) = (self.frame?, &self.streams[0]);
        let state = stream.state.get(HEADER_BYTES..)?.to_vec();
        let snapshot = (fresh || stream.listed == Some(frame)).then(|| stream.snapshot.clone());
        Some(Recorded { frame, time_s: self.time_s, snapshot, state, hash: stream.hashes.back()?.1 })
    }

    /// Keeps a frame for sending.
    pub(super) fn take(&mut self, exact: bool, frame: u64, list: Option<Arc<Vec<u8>>>, state: &[u8], hash: Hash) {
        let head = self.head(Kind::State, 0, frame);
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

    /// Sends the frame that was kept, with its list of objects if that is new.
    pub(super) fn send_frame(&mut self, now: Duration, frame: u64) {
        let first = self.frame.is_none();
        (self.frame, self.next, self.stage, self.first_ready) = (Some(frame), frame.wrapping_add(1), Stage::Idle, None);
        for place in self.places.iter_mut().filter(|p| p.standing == Standing::Following && (first || p.keeps_up)) {
            place.standing = Standing::InStep;
        }
        for exact in [false, true] {
            let of_stream = |(k, p): (FacetNumber, &Place)| (p.exact == exact).then_some((k, p.standing));
            let to: Vec<(FacetNumber, Standing)> = self.there().filter_map(of_stream).collect();
            let stream = &self.streams[exact as usize];
            let (fresh, state) = (stream.listed == Some(frame), stream.state.clone());
            if fresh {
                to.iter().for_each(|&(k, _)| self.send_snapshot(k));
            }
            // who follows wants the newest frame, and not all that it missed before it
            for standing in [Standing::InStep, Standing::Following] {
                let to: Vec<FacetNumber> = to.iter().filter(|(_, s)| *s == standing).map(|(k, _)| *k).collect();
                if !state.is_empty() && !to.is_empty() {
                    self.send(to, self.state_delivery(standing), state.clone());
                }
            }
        }
        for place in self.places.iter_mut().filter(|p| p.standing != Standing::Absent) {
            place.sent = now;
            ask(&mut place.asked_state, frame, now);
        }
        if self.options.pace == Pace::Lockstep {
            self.stage = Stage::Ready(now);
        }
        self.advance(now);
    }

    pub(super) fn turn(&mut self, now: Duration) {
        let Some(frame) = self.frame else { return };
        match self.stage {
            Stage::Idle => {}
            Stage::Ready(_) => {
                let all = self.waited_for().all(|p| p.ready == Some(frame));
                if !all && self.patience_ends().is_none_or(|end| now < end) {
                    return;
                }
                self.leave_behind(frame, |p| p.ready == Some(frame), |counts| &mut counts.late);
                let to: Vec<FacetNumber> =
                    self.there().filter(|(_, p)| p.ready == Some(frame)).map(|(k, _)| k).collect();
                self.stage = Stage::Presented(now);
                self.send_present(now, to, frame);
            }
            Stage::Presented(_) => {
                let all = self.waited_for().all(|p| p.presented == Some(frame));
                if !all && self.patience_ends().is_none_or(|end| now < end) {
                    return;
                }
                self.leave_behind(frame, |p| p.presented == Some(frame), |counts| &mut counts.missing);
                self.stage = Stage::Idle;
                if let Some(times) = self.times.finish(frame) {
                    self.tell(ServerEvent::Shown(times));
                }
                self.tell(ServerEvent::Finished(frame));
            }
        }
    }

    /// When those who have not answered are waited for no longer.
    pub(super) fn patience_ends(&self) -> Option<Duration> {
        let options = &self.options;
        match self.stage {
            Stage::Idle => None,
            Stage::Ready(since) => {
                // while nobody is ready nobody is held up
                let at_most = since.saturating_add(options.ready_after.max(options.drop_after));
                let end = |p: &Place| match (p.synced, self.first_ready) {
                    (false, _) => since.saturating_add(options.first_after),
                    (true, None) => at_most,
                    // what it began before it was waited for comes first
                    (true, Some(first)) => {
                        first.saturating_add(options.ready_after * if p.keeps_up { 2 } else { 1 }).min(at_most)
                    }
                };
                self.waited_for().filter(|p| p.ready != self.frame).map(end).max()
            }
            Stage::Presented(since) => Some(since.saturating_add(self.options.ready_after)),
        }
    }

    /// Waits no longer for those who are in step and not `done`.
    pub(super) fn leave_behind(
        &mut self,
        frame: u64,
        done: impl Fn(&Place) -> bool,
        counter: impl Fn(&mut SeatCounts) -> &mut u64,
    ) {
        for k in 0..self.places.len() {
            let place = &mut self.places[k];
            if place.standing == Standing::InStep && !done(place) {
                place.standing = Standing::Following;
                (place.answered, place.keeps_up) = (None, false);
                count(counter(&mut place.counts));
                self.tell(ServerEvent::Late(k as FacetNumber, frame));
            }
        }
    }

    /// Ends the waiting for the frame that is under way.
    pub(super) fn give_up(&mut self) {
        let Some(frame) = self.frame else { return };
        if let Stage::Ready(_) = self.stage {
            self.leave_behind(frame, |p| p.ready == Some(frame), |counts| &mut counts.late);
        }
        if let Stage::Presented(_) = self.stage {
            self.leave_behind(frame, |p| p.presented == Some(frame), |counts| &mut counts.missing);
        }
    }
}

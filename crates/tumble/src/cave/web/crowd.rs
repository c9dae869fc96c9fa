//! The browsers of a facet and their part in the swap barrier. No clock and no socket: times and messages
//! are arguments.
//!
//! ```text
//! joined ─ frame n ─► drawing ─ "drawn n" ─► waiting ─ show n ─► showing ─ frame n + 1 ─► …
//! ```
//!
//! A browser is awaited at the barrier once it has drawn a few frames in time. One that is late is shown
//! what it draws, gets no frame before it has drawn the last, and is not awaited until it is in time
//! again, for twice as many frames each time: a slow browser costs the run a time-out now and then, ever
//! more rarely, and never stalls it.

use super::encode::{Encoder, show};
use crate::cave::facet_report::BrowserReport;
use crate::failure::Failure;
use std::sync::mpsc::SyncSender;
use std::time::{Duration, Instant};
use tumble::net::browser::{Backend, BrowserMessage};

/// Maximum number of browsers of a facet.
pub const MAX_BROWSERS: usize = 8;
/// Number of frames in time after which a browser is awaited for the first time.
const STEADY: u32 = 5;
/// Largest number of frames in time after which a browser is awaited again.
const MOST_STEADY: u32 = 10_000;
/// Time without an answer after which a browser is removed.
const GONE: Duration = Duration::from_secs(30);

/// The browsers of a facet.
pub struct Crowd {
    timeout: Duration,
    browsers: Vec<Browser>,
    next: u64,
    /// The last frame that all screens show.
    released: Option<u64>,
    counts: BrowserReport,
}

struct Browser {
    id: u64,
    encoder: Encoder,
    outbox: SyncSender<Vec<u8>>,
    /// The frame that it draws, and since when.
    drawing: Option<(u64, Instant)>,
    /// The frame that it has drawn and must not show yet.
    drawn: Option<u64>,
    /// Frames in succession that it has drawn in time.
    in_time: u32,
    /// The number of them after which it is awaited.
    steady: u32,
}

impl Browser {
    fn is_awaited(&self) -> bool {
        self.in_time >= self.steady
    }
}

impl Crowd {
    /// Creates an empty crowd; a browser that draws for longer than the time-out is late.
    pub fn new(timeout: Duration) -> Crowd {
        Crowd { timeout, browsers: Vec::new(), next: 0, released: None, counts: BrowserReport::default() }
    }

    /// Adds a browser, which gets its messages from the outbox. Returns its number; `None` if there are
    /// too many.
    pub fn join(&mut self, backend: Backend, outbox: SyncSender<Vec<u8>>) -> Option<u64> {
        if self.browsers.len() >= MAX_BROWSERS {
            return None;
        }
        self.next += 1;
        let (id, encoder) = (self.next, Encoder::new(backend));
        self.browsers.push(Browser { id, encoder, outbox, drawing: None, drawn: None, in_time: 0, steady: STEADY });
        Some(id)
    }

    /// Removes a browser.
    pub fn leave(&mut self, id: u64) {
        self.browsers.retain(|browser| browser.id != id);
    }

    /// Returns whether a browser is here.
    pub fn has(&self, id: u64) -> bool {
        self.browsers.iter().any(|browser| browser.id == id)
    }

    /// Returns whether a browser would draw the next frame.
    pub fn is_idle(&self) -> bool {
        self.browsers.iter().any(|browser| browser.drawing.is_none())
    }

    /// Sends a frame to the browsers that have drawn their last. One for which it cannot be encoded is
    /// removed; the reason is returned.
    pub fn begin(
        &mut self,
        frame: u64,
        now: Instant,
        mut encode: impl FnMut(&mut Encoder) -> Result<Vec<u8>, Failure>,
    ) -> Option<Failure> {
        // a browser that has not answered for long is gone
        self.browsers.retain(|b| b.drawing.is_none_or(|(_, since)| now.duration_since(since) < GONE));
        let mut failure = None;
        self.browsers.retain_mut(|browser| {
            if browser.drawing.is_some() {
                return true;
            }
            (browser.drawing, browser.drawn) = (Some((frame, now)), None);
            match encode(&mut browser.encoder) {
                Ok(message) => browser.outbox.try_send(message).is_ok(),
                Err(why) => {
                    failure = Some(why);
                    false
                }
            }
        });
        failure
    }

    /// Returns whether no browser is awaited any more for the frame that was sent.
    pub fn is_drawn(&mut self, now: Instant) -> bool {
        let mut all = true;
        for browser in self.browsers.iter_mut().filter(|browser| browser.is_awaited()) {
            let Some((_, since)) = browser.drawing else { continue };
            if now.duration_since(since) > self.timeout {
                browser.in_time = 0;
                browser.steady = (2 * browser.steady).min(MOST_STEADY);
                self.counts.late += 1;
            } else {
                all = false;
            }
        }
        all
    }

    /// Has the browsers show a frame.
    pub fn present(&mut self, frame: u64) {
        self.released = Some(frame);
        let ready = |browser: &Browser| browser.drawn == Some(frame);
        self.browsers.retain_mut(|browser| {
            let shows = ready(browser);
            browser.drawn = browser.drawn.filter(|_| !shows);
            !shows || browser.outbox.try_send(show(frame)).is_ok()
        });
    }

    /// Takes a browser's message. Returns `false` if it broke the protocol or cannot draw; it is to be
    /// removed.
    pub fn take(&mut self, id: u64, message: &BrowserMessage, now: Instant) -> bool {
        let (timeout, released) = (self.timeout, self.released);
        let Some(browser) = self.browsers.iter_mut().find(|browser| browser.id == id) else { return false };
        match *message {
            BrowserMessage::Drawn(frame) => {
                let Some((_, since)) = browser.drawing.filter(|(drawing, _)| *drawing == frame) else { return false };
                browser.drawing = None;
                let in_time = now.duration_since(since) <= timeout;
                browser.in_time = if in_time { browser.in_time.saturating_add(1) } else { 0 };
                // a late one has missed the barrier and shows what it has
                if released.is_some_and(|released| released >= frame) {
                    return browser.outbox.try_send(show(frame)).is_ok();
                }
                browser.drawn = Some(frame);
                true
            }
            BrowserMessage::Shown(frame) => {
                let Some(behind) = released.and_then(|released| released.checked_sub(frame)) else { return false };
                self.counts.shown += 1;
                if browser.is_awaited() {
                    self.counts.behind_max = self.counts.behind_max.max(behind);
                }
                true
            }
            BrowserMessage::Hello(_) | BrowserMessage::Failed(_) => false,
        }
    }

    /// Returns the counts.
    pub fn counts(&self) -> BrowserReport {
        let awaited = self.browsers.iter().filter(|browser| browser.is_awaited()).count() as u32;
        BrowserReport { browsers: self.browsers.len() as u32, awaited, ..self.counts }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc::{Receiver, sync_channel};

    const TIMEOUT: Duration = Duration::from_millis(100);

    struct Trial {
        crowd: Crowd,
        now: Instant,
    }

    impl Trial {
        fn join(&mut self) -> (u64, Receiver<Vec<u8>>) {
            let (outbox, inbox) = sync_channel(4);
            (self.crowd.join(Backend::Webgl2, outbox).unwrap(), inbox)
        }

        fn begin(&mut self, frame: u64) {
            assert!(self.crowd.begin(frame, self.now, |_| Ok(vec![frame as u8])).is_none());
        }

        fn take(&mut self, id: u64, message: BrowserMessage) -> bool {
            self.crowd.take(id, &message, self.now)
        }

        fn later(&mut self, ms: u64) {
            self.now += Duration::from_millis(ms);
        }
    }

    fn trial() -> Trial {
        Trial { crowd: Crowd::new(TIMEOUT), now: Instant::now() }
    }

    #[test]
    fn a_browser_is_awaited_when_it_is_steady_and_shows_with_the_others() {
        let mut trial = trial();
        let (id, inbox) = trial.join();
        for frame in 0..20 {
            trial.begin(frame);
            assert_eq!(inbox.try_recv(), Ok(vec![frame as u8]));
            assert_eq!(trial.crowd.is_drawn(trial.now), frame < u64::from(STEADY), "{frame}");
            trial.later(30);
            assert!(trial.take(id, BrowserMessage::Drawn(frame)) && trial.crowd.is_drawn(trial.now));
            assert!(inbox.try_recv().is_err(), "shown before the others have drawn");
            trial.crowd.present(frame);
            assert_eq!(inbox.try_recv(), Ok(show(frame)));
            assert!(trial.take(id, BrowserMessage::Shown(frame)));
        }
        let counts = trial.crowd.counts();
        assert_eq!((counts.late, counts.shown, counts.behind_max, counts.awaited), (0, 20, 0, 1));
    }

    /// A browser that needs 250 ms a frame delays a run of 20 ms a frame by one time-out.
    #[test]
    fn a_slow_browser_costs_one_time_out_and_shows_what_it_can() {
        let mut trial = trial();
        let (id, inbox) = trial.join();
        let (mut stalled_ms, mut drawing, mut shown) = (0, None, Vec::new());
        for frame in 0..200u64 {
            // in time at first
            let takes_ms = if frame < 10 { 10 } else { 250 };
            trial.begin(frame);
            while let Ok(message) = inbox.try_recv() {
                match message.len() {
                    1 => drawing = Some((u64::from(message[0]), takes_ms)),
                    _ => shown.push(u32::from_le_bytes(message[8..12].try_into().unwrap())),
                }
            }
            let mut waited = 0;
            loop {
                if let Some((frame, left)) = drawing.as_mut() {
                    *left -= 10;
                    if *left <= 0 {
                        let frame = *frame;
                        drawing = None;
                        assert!(trial.take(id, BrowserMessage::Drawn(frame)));
                    }
                }
                if trial.crowd.is_drawn(trial.now) && waited >= 20 {
                    break;
                }
                trial.later(10);
                waited += 10;
            }
            stalled_ms += waited - 20;
            trial.crowd.present(frame);
        }
        assert_eq!(trial.crowd.counts().late, 1);
        assert!(stalled_ms <= 110, "{stalled_ms}");
        assert!(shown.len() > 20 && shown.is_sorted(), "{shown:?}");
    }

    /// One that is late whenever it is awaited delays 5,000 frames by nine time-outs: 5 · 2ⁿ frames in
    /// time come before the one after n others (5 · (2⁹ − 1) = 2555, 5 · (2¹⁰ − 1) = 5115).
    #[test]
    fn a_browser_that_is_late_on_purpose_is_trusted_less_each_time() {
        let mut trial = trial();
        let (id, inbox) = trial.join();
        for frame in 0..5000 {
            trial.begin(frame);
            if !trial.crowd.is_drawn(trial.now) && trial.crowd.counts().awaited > 0 {
                trial.later(101);
                assert!(trial.crowd.is_drawn(trial.now));
            }
            trial.crowd.present(frame);
            trial.take(id, BrowserMessage::Drawn(frame));
            inbox.try_iter().for_each(drop);
        }
        assert_eq!(trial.crowd.counts().late, 9);
    }

    #[test]
    fn a_browser_that_breaks_the_protocol_or_is_silent_is_removed() {
        let mut trial = trial();
        let (id, _inbox) = trial.join();
        trial.begin(7);
        for wrong in [BrowserMessage::Drawn(8), BrowserMessage::Shown(7), BrowserMessage::Hello(Backend::Webgpu)] {
            assert!(!trial.take(id, wrong.clone()), "{wrong:?}");
        }
        assert!(trial.take(id, BrowserMessage::Drawn(7)) && !trial.take(id, BrowserMessage::Drawn(7)));
        trial.begin(8);
        trial.later(31_000);
        trial.begin(9);
        assert!(!trial.crowd.has(id) && trial.crowd.is_drawn(trial.now));
        // one that takes no messages is removed when its outbox is full
        let (id, inbox) = trial.join();
        drop(inbox);
        trial.begin(10);
        assert!(!trial.crowd.has(id));
        let joined: Vec<_> = (0..MAX_BROWSERS).map(|_| trial.join()).collect();
        assert!(trial.crowd.join(Backend::Webgl2, sync_channel(1).0).is_none());
        assert_eq!(trial.crowd.counts().browsers as usize, joined.len());
    }
}

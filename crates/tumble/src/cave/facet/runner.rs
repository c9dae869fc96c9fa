//! A facet's session with its picture: draws, presents and logs frames, in memory or for a window.

use super::control::{FacetControl, POLL_INTERVAL, ServerWait};
use super::frame_log::FrameLog;
use super::group::Membership;
use super::painter::Painter;
use super::picture_watch::PictureWatch;
use super::priority;
use super::render_thread::{Wanted, image_hash};
use crate::cave::endpoints::FacetEndpoint;
use crate::cave::facet_report::Reporter;
use crate::failure::Failure;
use std::sync::atomic::Ordering;
use std::time::Duration;
use tumble::net::sync::{EndReason, Facet, SessionError, Task};
use tumble::render::{CalibrationPattern, Image};

/// Interval at which the input of a window is looked at.
const INPUT_INTERVAL: Duration = Duration::from_millis(8);
/// Pause while the frame log has no room for another frame.
const LOG_FULL_PAUSE: Duration = Duration::from_millis(5);

/// A facet that is connected or looks for its server.
pub struct FacetRunner {
    pub facet: Facet<FacetEndpoint>,
    membership: Membership,
    painter: Option<Painter>,
    pub log: Option<FrameLog>,
    burn_in: bool,
    control: FacetControl,
    reporter: Reporter,
    watch: Option<PictureWatch>,
    server_wait: ServerWait,
    /// The frame being drawn, and its simulated time.
    drawing: Option<(u64, f64)>,
    /// The drawn frame that is not shown yet.
    picture: Option<DrawnFrame>,
}

struct DrawnFrame {
    frame: u64,
    time_s: f64,
    hash: [u8; 16],
    image: Option<Image>,
}

/// Reports an error of the link.
pub fn failed(error: SessionError) -> Failure {
    Failure::run("the connection to the server", error)
}

impl FacetRunner {
    /// Creates a facet that has drawn nothing.
    pub fn new(
        facet: Facet<FacetEndpoint>,
        membership: Membership,
        painter: Option<Painter>,
        log: Option<FrameLog>,
        burn_in: bool,
        control: FacetControl,
        watch: Option<PictureWatch>,
    ) -> FacetRunner {
        let (reporter, server_wait) = (control.reporter.clone(), ServerWait::default());
        FacetRunner {
            facet,
            membership,
            painter,
            log,
            burn_in,
            control,
            reporter,
            watch,
            server_wait,
            drawing: None,
            picture: None,
        }
    }

    /// Reports that the facet is ready to join, and what draws it. With a software driver it has begun to draw
    /// by now, and the driver's threads exist.
    pub fn prepared(&self, software: bool, adapter: &str) {
        if software && let Err(why) = priority::lower_drawing_threads() {
            self.control.say(&format!("draws with real-time priority, which delays the sessions: {why}"));
        }
        self.reporter.update(|report| (report.preparing, report.adapter) = (false, adapter.to_owned()));
        self.reporter.flush();
    }

    /// Waits at most `timeout` for the next task. Returns `None` when the facet must end.
    pub fn next(&mut self, timeout: Duration) -> Result<Option<Task>, Failure> {
        self.log.as_mut().map_or(Ok(()), FrameLog::check)?;
        if self.control.is_orphaned() {
            return Err(Failure::run(&self.control.title(), "its launcher has ended"));
        }
        if self.control.signals.stop_requested() || self.control.end_all.load(Ordering::Relaxed) {
            return Ok(None);
        }
        let task = self.facet.next(timeout).map_err(failed)?;
        self.server_wait.update(&task, &self.control)?;
        match task {
            Task::Ended(EndReason::Refused(why)) => {
                Err(Failure::input(format!("facet {}: the server refuses it: {why}", self.control.name)))
            }
            Task::Ended(_) => Ok(None),
            task => Ok(Some(task)),
        }
    }

    /// Returns whether the frame log has room for another frame.
    pub fn has_room(&self) -> bool {
        self.log.as_ref().is_none_or(FrameLog::has_room)
    }

    /// Returns whether a window must read its next picture back.
    pub fn wants_picture(&self) -> bool {
        self.log.is_some() || self.watch.as_ref().is_some_and(PictureWatch::is_due)
    }

    /// Returns the calibration pattern to show instead of the scene.
    pub fn pattern(&self) -> Option<CalibrationPattern> {
        self.control.pattern()
    }

    /// Returns the number of whole seconds without a server.
    pub fn server_wait_s(&self) -> u64 {
        self.server_wait.elapsed().as_secs()
    }

    /// Draws until the end by the painter, or nothing without one.
    pub fn run(&mut self) -> Result<(), Failure> {
        if let Some(painter) = &mut self.painter {
            let control = &self.control;
            if !painter.prepare(self.facet.world(), self.facet.viewer(), || control.should_stop())? {
                return Ok(());
            }
        }
        let painter = self.painter.as_ref();
        self.prepared(painter.is_some_and(Painter::is_software), painter.map_or("", Painter::adapter));
        let interval = if matches!(painter, Some(Painter::Window(_))) { INPUT_INTERVAL } else { POLL_INTERVAL };
        while let Some(task) = self.next(if self.drawing.is_some() { Duration::ZERO } else { interval })? {
            match task {
                // a started picture is finished first, even if no frame waits for it any more
                Task::Wait(_) | Task::Draw if self.drawing.is_some() => self.poll_picture(interval)?,
                Task::Wait(_) | Task::Ended(_) => {}
                // the frame log is behind: the session stays alive and the server waits
                Task::Draw if !self.has_room() => std::thread::sleep(LOG_FULL_PAUSE),
                Task::Draw => self.draw()?,
                Task::Present(frame) => self.present(frame)?,
            }
            if let Some(painter) = &mut self.painter {
                painter.attend(&mut self.facet, self.server_wait.elapsed().as_secs())?;
            }
        }
        Ok(())
    }

    fn draw(&mut self) -> Result<(), Failure> {
        let Some(frame) = self.membership.begin(&mut self.facet) else { return Ok(()) };
        let time_s = self.facet.session().time_s();
        let read = self.wants_picture();
        match &mut self.painter {
            Some(painter) => {
                let wanted = Wanted { frame, burn_in: self.burn_in, pattern: self.control.pattern(), read };
                painter.begin(self.facet.world(), self.facet.viewer(), &wanted)?;
                self.drawing = Some((frame, time_s));
                Ok(())
            }
            None => self.drawn(frame, time_s, None),
        }
    }

    fn poll_picture(&mut self, timeout: Duration) -> Result<(), Failure> {
        let (Some(painter), Some((frame, time_s))) = (&mut self.painter, self.drawing) else {
            return Ok(());
        };
        match painter.finished(timeout)? {
            Some(image) => self.drawn(frame, time_s, image),
            None => Ok(()),
        }
    }

    /// Reports a drawn frame.
    pub fn drawn(&mut self, frame: u64, time_s: f64, image: Option<Image>) -> Result<(), Failure> {
        self.drawing = None;
        let hash = image.as_ref().map_or([0; 16], image_hash);
        if let (Some(watch), Some(image)) = (&mut self.watch, &image) {
            watch.look(image, &hash);
        }
        self.picture = Some(DrawnFrame { frame, time_s, hash, image });
        self.facet.drawn(hash).map_err(failed)
    }

    /// Reports and logs a shown frame.
    pub fn present(&mut self, frame: u64) -> Result<(), Failure> {
        self.painter.iter_mut().try_for_each(|painter| painter.present(frame))?;
        self.facet.presented().map_err(failed)?;
        let shown = self.facet.session().shown();
        let Some(drawn) = self.picture.take().filter(|d| d.frame == frame) else { return Ok(()) };
        if let (Some(log), Some((_, done))) = (&mut self.log, shown) {
            log.shown(frame, drawn.time_s, &done.hash, &drawn.hash, drawn.image)?;
        }
        Ok(())
    }
}

//! What is told of what is shown: lines over the picture, the title, the status.

use super::*;
use crate::view::status::Status;

impl Viewer {
    /// Lines over the picture.
    pub(super) fn lines(&self) -> Vec<String> {
        let mut lines = Vec::new();
        let simulation = self.clockwork.lock();
        let (world, pace) = (&simulation.world, &simulation.pace);
        if self.show.any && self.show.statistics {
            let f = self.statistics.shown;
            let time =
                if pace.paused { "paused".to_string() } else { format!("{:.4}x", pace.speed()).replace(".0000", "") };
            lines.push(format!("{:.0} fps  t {:.3} s  {time}", f.pictures_per_s, world.time()));
            lines.push(format!(
                "picture {:.1} ms  step {:.2} ms  {:.0} steps/s",
                f.drawing_ms, f.step_ms, f.steps_per_s
            ));
            lines.push(format!(
                "contacts {}  behind {:.1} s  camera {}",
                world.contacts().len(),
                pace.behind_s,
                self.presets.name()
            ));
        }
        lines.extend(simulation.trouble.iter().map(|trouble| format!("stopped: {trouble}. R goes back to time 0")));
        if self.show.any && self.show.help {
            lines.extend(keys::HELP.iter().map(|line| line.to_string()));
        }
        lines
    }

    pub(super) fn title(&self, screen: &Screen) -> String {
        let simulation = self.clockwork.lock();
        let on = match &self.sight {
            Sight::Camera => String::new(),
            Sight::Facet(_, facet) => format!(" on {}", facet.name),
            Sight::Unfolded(view) => format!(" in {}", view.cave().file),
        };
        let [w, h] = screen.size_px();
        let state = if simulation.pace.paused { "paused" } else { "running" };
        let fps = self.statistics.shown.pictures_per_s;
        format!("tumble: {}{on} ({state}, t {:.2} s, {fps:.0} fps, {w}x{h})", self.name, simulation.world.time())
    }

    pub(super) fn status(&self) -> Status {
        let simulation = self.clockwork.lock();
        let (world, pace) = (&simulation.world, &simulation.pace);
        let held = simulation.hand.as_ref().and_then(|hand| hand.held(world));
        Status {
            frame: world.frame(),
            time_s: world.time(),
            paused: pace.paused,
            speed: pace.speed(),
            behind_s: pace.behind_s,
            shown: self.shown,
            size_px: self.size_px,
            focused: self.focused,
            eye_m: self.user.eye(),
            forward: self.user.forward(),
            camera: self.presets.name().to_string(),
            flies: self.user.flies,
            step_m: self.user.step_m(),
            held: held.as_ref().map(|h| h.0.clone()),
            held_at_m: held.as_ref().map(|h| h.1.into()),
            hand_at_m: held.as_ref().map(|h| h.2.into()),
            quality: self.quality.map(|q| q.to_string()),
            overlays: self.overlays.names(),
            caption: self.show.any && (self.show.statistics || self.show.help),
            joints: self.joint_status(world),
            joints_held: self.joints.held(),
            state_blake3: blake3::hash(&world.save()).to_hex().to_string(),
        }
    }

    /// A line of the status, where something changed or it is time.
    pub(super) fn tell(&mut self, now: Instant) -> Result<(), Failure> {
        if !self.log.wanted() {
            return Ok(());
        }
        let due = self.times.told.is_none_or(|told| now - told >= IDLE);
        let status = self.status();
        if due {
            self.times.told = Some(now);
        }
        self.log.tell(status, due)
    }
}

//! The HUD, the window title and the status lines.

use super::*;
use crate::view::status::Status;

impl Viewer {
    /// The lines of the HUD.
    pub(super) fn lines(&self) -> Vec<String> {
        let mut lines = Vec::new();
        let simulation = self.simulation_thread.lock();
        let (world, real_time) = (&simulation.world, &simulation.real_time);
        if self.show.any && self.show.statistics {
            let f = self.statistics.shown;
            let time = if real_time.paused {
                "paused".to_string()
            } else {
                format!("{:.4}x", real_time.speed()).replace(".0000", "")
            };
            lines.push(format!("{:.0} fps  t {:.3} s  {time}", f.pictures_per_s, world.time()));
            lines.push(format!(
                "picture {:.1} ms  step {:.2} ms  {:.0} steps/s",
                f.drawing_ms, f.step_ms, f.steps_per_s
            ));
            lines.push(format!(
                "contacts {}  behind {:.1} s  camera {}",
                world.contacts().len(),
                real_time.behind_s,
                self.presets.name()
            ));
        }
        lines.extend(simulation.error.iter().map(|error| format!("stopped: {error}. R resets to time 0")));
        if self.show.any && self.show.help {
            lines.extend(keys::HELP.iter().map(|line| line.to_string()));
        }
        lines
    }

    pub(super) fn title(&self, screen: &Screen) -> String {
        let simulation = self.simulation_thread.lock();
        let on = match &self.view_mode {
            ViewMode::Camera => String::new(),
            ViewMode::Facet(_, facet) => format!(" on {}", facet.name),
            ViewMode::Unfolded(view) => format!(" in {}", view.cave().file),
        };
        let [w, h] = screen.size_px();
        let state = if simulation.real_time.paused { "paused" } else { "running" };
        let fps = self.statistics.shown.pictures_per_s;
        format!("tumble: {}{on} ({state}, t {:.2} s, {fps:.0} fps, {w}x{h})", self.name, simulation.world.time())
    }

    pub(super) fn status(&self) -> Status {
        let simulation = self.simulation_thread.lock();
        let (world, real_time) = (&simulation.world, &simulation.real_time);
        let picked = simulation.picker.as_ref().and_then(|picker| picker.picked(world));
        Status {
            frame: world.frame(),
            time_s: world.time(),
            paused: real_time.paused,
            speed: real_time.speed(),
            behind_s: real_time.behind_s,
            shown: self.shown,
            size_px: self.size_px,
            focused: self.focused,
            eye_m: self.user.eye(),
            forward: self.user.forward(),
            camera: self.presets.name().to_string(),
            flies: self.user.flies,
            step_m: self.user.step_m(),
            picked: picked.as_ref().map(|h| h.0.clone()),
            picked_point_m: picked.as_ref().map(|h| h.1.into()),
            pick_target_m: picked.as_ref().map(|h| h.2.into()),
            quality: self.quality.map(|q| q.to_string()),
            overlays: self.overlays.names(),
            caption: self.show.any && (self.show.statistics || self.show.help),
            joints: self.joint_status(world),
            joints_held: self.joints.held(),
            state_blake3: blake3::hash(&world.save()).to_hex().to_string(),
        }
    }

    /// Writes a status line if the status has changed or [`STATUS_INTERVAL`] has passed.
    pub(super) fn write_status(&mut self, now: Instant) -> Result<(), Failure> {
        if !self.log.wanted() {
            return Ok(());
        }
        let due = self.times.hud.is_none_or(|hud| now - hud >= STATUS_INTERVAL);
        let status = self.status();
        if due {
            self.times.hud = Some(now);
        }
        self.log.write(status, due)
    }
}

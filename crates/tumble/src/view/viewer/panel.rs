//! The panel of sliders, moved by mouse and keys.

use super::*;
use crate::view::simulation_thread::Simulation;
use crate::view::status::JointStatus;
use tumble::render::SliderPanel;

/// Fraction of its range that a key moves a joint by; ten times as much with Shift.
const NUDGE: f64 = 0.01;

/// The state of the panel.
pub(super) struct Panel {
    /// Whether it is switched on.
    pub(super) wanted: bool,
    /// Index of the joint that keys move.
    chosen: usize,
    /// Index of the first joint shown.
    first: usize,
    /// Index of the joint whose slider is dragged.
    dragged: Option<usize>,
}

impl Panel {
    pub(super) fn new(wanted: bool) -> Panel {
        Panel { wanted, chosen: 0, first: 0, dragged: None }
    }

    pub(super) fn release(&mut self) {
        self.dragged = None;
    }
}

impl Viewer {
    /// The panel, if it is shown.
    fn panel(&self) -> Option<SliderPanel> {
        let [width, height] = self.size_px;
        let panel =
            || SliderPanel::fitting(self.joints.len(), self.panel.chosen, self.panel.first, scale(width), height);
        (self.show.any && self.panel.wanted && self.joints.len() > 0).then(panel)
    }

    /// Its left edge in the window, pixels.
    fn panel_left(&self, panel: &SliderPanel) -> f64 {
        f64::from(self.size_px[0].saturating_sub(panel.size_px()[0]))
    }

    pub(super) fn panel_image(&self) -> Option<Image> {
        let panel = self.panel()?;
        let sliders = self.joints.sliders(&self.simulation_thread.lock().world, self.panel.chosen);
        let title = if self.joints.held() { "joints held, K releases" } else { "joints free, K holds" };
        Some(panel.draw(title, &sliders))
    }

    /// Handles a press of the left button; returns whether it was on the panel.
    pub(super) fn press_panel(&mut self) -> Result<bool, Failure> {
        let Some(panel) = self.panel() else { return Ok(false) };
        let [x, y] = self.pointer.at_px;
        let own = [x - self.panel_left(&panel), y];
        let [width, height] = panel.size_px().map(f64::from);
        if let Some((index, _)) = panel.at(own) {
            (self.panel.chosen, self.panel.first, self.panel.dragged) = (index, panel.first, Some(index));
            self.drag_slider()?;
        }
        Ok((0.0..width).contains(&own[0]) && own[1] < height)
    }

    /// Handles a motion of the pointer; returns whether it moves a slider.
    pub(super) fn drag_slider(&mut self) -> Result<bool, Failure> {
        let (Some(index), Some(panel)) = (self.panel.dragged, self.panel()) else { return Ok(false) };
        let share = panel.share(self.pointer.at_px[0] - self.panel_left(&panel));
        self.move_joint(|joints, simulation| {
            joints.set_fraction(&mut simulation.world, index, share, simulation.real_time.paused)
        })?;
        Ok(true)
    }

    /// Chooses the next joint, or the previous one.
    pub(super) fn choose_joint(&mut self, by: isize) {
        let count = self.joints.len().max(1) as isize;
        self.panel.wanted |= self.joints.len() > 0;
        self.panel.chosen = (self.panel.chosen as isize + by).rem_euclid(count) as usize;
        self.panel.first = self.panel().map_or(0, |panel| panel.first);
    }

    /// Moves the chosen joint by a key.
    pub(super) fn nudge_joint(&mut self, sign: f64) -> Result<(), Failure> {
        let (index, share) = (self.panel.chosen, sign * NUDGE * if self.user.fast { 10.0 } else { 1.0 });
        self.move_joint(|joints, simulation| {
            joints.nudge(&mut simulation.world, index, share, simulation.real_time.paused)
        })
    }

    /// Holds all joints, or releases them.
    pub(super) fn switch_hold(&mut self) {
        let world = &mut self.simulation_thread.lock().world;
        if self.joints.held() { self.joints.release(world) } else { self.joints.hold(world) }
    }

    fn move_joint(
        &mut self,
        change: impl FnOnce(&mut Joints, &mut Simulation) -> Result<(), WorldError>,
    ) -> Result<(), Failure> {
        let mut simulation = self.simulation_thread.lock();
        change(&mut self.joints, &mut simulation).map_err(|e| Failure::run("moving a joint", e))?;
        simulation.changes += 1;
        self.stale = true;
        Ok(())
    }

    /// The joints and their sliders, for status lines.
    pub(super) fn joint_status(&self, world: &World) -> Vec<JointStatus> {
        let panel = self.panel();
        let place = |index: usize| {
            let panel = panel?;
            let [left, right] = panel.bar_px().map(|x| x + self.panel_left(&panel));
            Some([left, right, panel.middle_px(index)?])
        };
        let status = |(index, slider): (usize, tumble::render::Slider)| JointStatus {
            name: slider.name,
            position: slider.value,
            target: slider.target,
            slider_px: place(index),
        };
        self.joints.sliders(world, self.panel.chosen).into_iter().enumerate().map(status).collect()
    }
}

/// Pixels per dot of text, by the width of the window.
pub(super) fn scale(width_px: u32) -> u32 {
    if width_px >= 960 { 2 } else { 1 }
}

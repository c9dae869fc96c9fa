//! The overlays that keys switch.

use super::keys::OVERLAYS;
use tumble::render::DebugDraw;

/// Deepest level of sphere trees that the key steps through.
const MAX_LEVEL: u32 = 5;

/// Debug drawing, switched by keys.
pub struct Overlays {
    /// The present overlays.
    pub draw: DebugDraw,
}

impl Overlays {
    /// Switches the overlay with this index. Sphere trees advance by a level, and are off after the
    /// last.
    pub fn switch(&mut self, index: usize) {
        let draw = &mut self.draw;
        match OVERLAYS[index] {
            "contacts" => draw.contacts = !draw.contacts,
            "normals" => draw.normals = !draw.normals,
            "velocities" => draw.velocities = !draw.velocities,
            "forces" => draw.forces = !draw.forces,
            "joints" => draw.joints = !draw.joints,
            "frames" => draw.frames = !draw.frames,
            "islands" => draw.islands = !draw.islands,
            _ => {
                draw.tree_level = Some(draw.tree_level.map_or(0, |level| level + 1)).filter(|level| *level <= MAX_LEVEL)
            }
        }
    }

    /// The names of the active overlays, as `--debug-draw` takes them.
    pub fn names(&self) -> Vec<String> {
        let d = &self.draw;
        let flags = [d.contacts, d.normals, d.velocities, d.forces, d.joints, d.frames, d.islands];
        let on = OVERLAYS.iter().zip(flags).filter(|(_, on)| *on).map(|(name, _)| name.to_string());
        on.chain(d.tree_level.map(|level| format!("tree={level}"))).collect()
    }
}

//! Debug drawing: contact points, normals, velocities, forces and sphere trees, as the thesis's detector draws them (§IV.B.3).

use super::small;
use crate::{DebugStyle, DrawList};
use nalgebra::Point3;
use std::str::FromStr;
use tumble_core::collide::Shape;
use tumble_core::{ContactPoint, Mode, World};

/// Which overlays to draw.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DebugDraw {
    /// Contact points.
    pub contacts: bool,
    /// Contact normals.
    pub normals: bool,
    /// Velocities of the bodies.
    pub velocities: bool,
    /// Contact forces.
    pub forces: bool,
    /// A level of every sphere tree, 0 for the root.
    pub tree_level: Option<u32>,
}

/// A word that names no overlay.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("no overlay '{0}'; wanted contacts, normals, velocities, forces, tree=LEVEL or all, with commas between them")]
pub struct UnknownOverlay(String);

impl FromStr for DebugDraw {
    type Err = UnknownOverlay;

    fn from_str(words: &str) -> Result<DebugDraw, UnknownOverlay> {
        let mut draw = DebugDraw::default();
        for word in words.split(',').map(str::trim) {
            match word {
                "contacts" => draw.contacts = true,
                "normals" => draw.normals = true,
                "velocities" => draw.velocities = true,
                "forces" => draw.forces = true,
                "all" => draw = DebugDraw { contacts: true, normals: true, velocities: true, forces: true, ..draw },
                other => {
                    let level = other.strip_prefix("tree=").and_then(|n| n.parse().ok());
                    draw.tree_level = Some(level.ok_or_else(|| UnknownOverlay(other.to_string()))?);
                }
            }
        }
        Ok(draw)
    }
}

/// An arrow of this share of the scene's size stands for the largest force; a force of a hundredth still has a tenth of its length.
const ARROW: f32 = 0.2;
/// Length of a normal, as a share of the longest arrow.
const NORMAL: f32 = 0.4;
/// A velocity's arrow is where the body would be after this time, s.
const LOOK_AHEAD: f64 = 0.1;

/// Neighbouring balls of a tree take these in turn, so that each is told from the next.
pub(super) const SHELL_COLORS: [[f32; 3]; 6] = [[0.95, 0.45, 0.10], [0.10, 0.55, 0.95], [0.95, 0.80, 0.10], [0.60, 0.25, 0.85], [0.15, 0.75, 0.40], [0.90, 0.20, 0.40]];

impl DebugDraw {
    pub(super) fn draw(&self, world: &World, list: &mut DrawList) {
        let size = ARROW * list.bounding_ball(true).map_or(1.0, |(_, r)| r).clamp(0.05, 5.0);
        let largest = world.contacts().iter().map(|c| c.force.norm()).fold(0.0, f64::max);
        for contact in world.contacts().iter().filter(|c| c.gap <= 1e-3 || c.force.norm() > 0.0) {
            let point = Point3::from(small(&contact.point));
            let toward = toward_shown(world, contact);
            if self.contacts {
                list.point(point, DebugStyle::new([1.0, 0.85, 0.1]).width(8.0).on_top());
            }
            if self.normals {
                list.arrow(point, toward * NORMAL * size * small(&contact.normal), DebugStyle::new([0.05, 0.35, 1.0]).width(3.0).on_top());
            }
            if self.forces && largest > 0.0 {
                let force = contact.force / largest;
                let seen = force / force.norm().sqrt().max(1e-6);
                list.arrow(point, toward * size * small(&seen), DebugStyle::new([1.0, 0.12, 0.08]).width(4.0).on_top());
            }
        }
        for &id in world.ids().iter().filter(|_| self.velocities) {
            let Some(site) = world.site(id, 0).filter(|s| s.velocity.norm() > 1e-3) else { continue };
            list.arrow(Point3::from(small(&site.position())), small(&(LOOK_AHEAD * site.velocity)), DebugStyle::new([0.1, 0.9, 0.3]).width(3.0).on_top());
        }
        if let Some(level) = self.tree_level {
            trees(world, list, level);
        }
    }
}

/// 1 where the arrows of a contact are those of its `a`, -1 where they are those of its `b`: of the body that moves, or of the upper one.
fn toward_shown(world: &World, contact: &ContactPoint) -> f32 {
    let moves = |id| world.status(id).is_some_and(|s| s.mode == Mode::Dynamic);
    match (moves(contact.a), moves(contact.b)) {
        (true, false) => 1.0,
        (false, true) => -1.0,
        _ if contact.normal.z < 0.0 => -1.0,
        _ => 1.0,
    }
}

/// The balls of one level; a branch that ended before it shows its leaf.
fn trees(world: &World, list: &mut DrawList, level: u32) {
    for &id in world.ids() {
        let Some(collidable) = world.object(id).and_then(|o| o.collidable()) else { continue };
        for part in 0..collidable.parts() {
            let (Some(site), Some(tree)) = (world.site(id, part), collidable.shape(part).and_then(Shape::tree)) else { continue };
            let shown = tree.nodes().iter().filter(|n| n.level == level || (n.is_leaf() && n.level < level));
            for (node, color) in shown.zip(SHELL_COLORS.iter().cycle()) {
                let center = site.pose * nalgebra::Point3::from(node.center);
                list.shell(Point3::from(small(&center.coords)), node.radius as f32, DebugStyle::new(*color).opacity(0.6));
            }
        }
    }
}

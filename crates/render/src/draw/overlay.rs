//! Debug drawing: contact points, normals, velocities, forces and sphere trees, as the thesis's detector draws them (§IV.B.3).

use super::small;
use crate::{DebugStyle, DrawList};
use nalgebra::Point3;
use std::str::FromStr;
use tumble_core::World;

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

/// An arrow of this share of the scene's size stands for the largest force; normals are a third of it.
const ARROW: f32 = 0.12;
/// A velocity's arrow is where the body would be after this time, s.
const LOOK_AHEAD: f64 = 0.1;

impl DebugDraw {
    pub(super) fn draw(&self, world: &World, list: &mut DrawList) {
        let size = ARROW * list.bounding_ball(true).map_or(1.0, |(_, r)| r).clamp(0.05, 5.0);
        let largest = world.contacts().iter().map(|c| c.force.norm()).fold(0.0, f64::max);
        for contact in world.contacts().iter().filter(|c| c.gap <= 1e-3 || c.force.norm() > 0.0) {
            let point = Point3::from(small(&contact.point));
            if self.contacts {
                list.point(point, DebugStyle::new([1.0, 0.85, 0.1]).width(7.0).on_top());
            }
            if self.normals {
                list.arrow(point, 0.33 * size * small(&contact.normal), DebugStyle::new([0.1, 0.6, 1.0]).on_top());
            }
            if self.forces && largest > 0.0 {
                list.arrow(point, size * small(&(contact.force / largest)), DebugStyle::new([1.0, 0.2, 0.15]).width(3.0).on_top());
            }
        }
        for &id in world.ids().iter().filter(|_| self.velocities) {
            let Some(site) = world.site(id, 0).filter(|s| s.velocity.norm() > 1e-3) else { continue };
            list.arrow(Point3::from(small(&site.position())), small(&(LOOK_AHEAD * site.velocity)), DebugStyle::new([0.2, 0.9, 0.35]).on_top());
        }
        if let Some(level) = self.tree_level {
            trees(world, list, level);
        }
    }
}

/// The balls of one level; a branch that ended before it shows its leaf.
fn trees(world: &World, list: &mut DrawList, level: u32) {
    for &id in world.ids() {
        let Some(collidable) = world.object(id).and_then(|o| o.collidable()) else { continue };
        for part in 0..collidable.parts() {
            let (Some(site), Some(tree)) = (world.site(id, part), collidable.shape(part).tree()) else { continue };
            for node in tree.nodes().iter().filter(|n| n.level == level || (n.is_leaf() && n.level < level)) {
                let center = site.pose * nalgebra::Point3::from(node.center);
                list.shell(Point3::from(small(&center.coords)), node.radius as f32, DebugStyle::new([0.95, 0.55, 0.15]).opacity(0.35));
            }
        }
    }
}

//! Debug drawing: contact points, normals, velocities, forces and sphere trees, as the thesis's
//! detector draws them (§IV.B.3).

use super::small;
use crate::{DebugStyle, DrawList};
use nalgebra::{Isometry3, Point3, Vector3};
use std::collections::{BTreeMap, BTreeSet};
use std::str::FromStr;
use tumble_core::collide::{Pose, Shape, Vec3};
use tumble_core::{ArticulatedBody, ContactPoint, Joint, LoopJoint, LoopJointKind, Mode, ObjectId, World};

/// The overlays to draw.
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
    /// Axes of joints, and anchors of loop joints.
    pub joints: bool,
    /// Axes of every part: x red, y green, z blue.
    pub frames: bool,
    /// Objects that are solved together, each island in its own color.
    pub islands: bool,
    /// Sleeping objects in blue-gray, resting objects that are awake in olive, moving objects in
    /// orange.
    pub sleep: bool,
    /// A level of every sphere tree; 0 is the root.
    pub tree_level: Option<u32>,
}

/// A word that names no overlay.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "no overlay '{0}'; expected contacts, normals, velocities, forces, joints, frames, islands, sleep, tree=LEVEL or all, separated by commas"
)]
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
                "joints" => draw.joints = true,
                "frames" => draw.frames = true,
                "islands" => draw.islands = true,
                "sleep" => draw.sleep = true,
                "all" => {
                    draw = DebugDraw {
                        contacts: true,
                        normals: true,
                        velocities: true,
                        forces: true,
                        joints: true,
                        frames: true,
                        ..draw
                    }
                }
                other => {
                    let level = other.strip_prefix("tree=").and_then(|n| n.parse().ok());
                    draw.tree_level = Some(level.ok_or_else(|| UnknownOverlay(other.to_string()))?);
                }
            }
        }
        Ok(draw)
    }
}

/// Length of the longest arrow as a fraction of the scene's size. It belongs to the largest force;
/// a force of a hundredth has a tenth of its length.
const ARROW: f32 = 0.2;
/// Length of a normal, as a fraction of the longest arrow.
const NORMAL: f32 = 0.4;
/// A velocity's arrow ends where the body would be after this time, s.
const VELOCITY_ARROW_S: f64 = 0.1;

/// Colors of adjacent spheres of a tree, in turn.
pub(super) const SHELL_COLORS: [[f32; 3]; 6] = [
    [0.95, 0.45, 0.10],
    [0.10, 0.55, 0.95],
    [0.95, 0.80, 0.10],
    [0.60, 0.25, 0.85],
    [0.15, 0.75, 0.40],
    [0.90, 0.20, 0.40],
];

impl DebugDraw {
    pub(super) fn draw(&self, world: &World, list: &mut DrawList) {
        if *self == DebugDraw::default() {
            return;
        }
        let size = ARROW * list.bounding_sphere(true).map_or(1.0, |(_, r)| r).clamp(0.05, 5.0);
        let largest = world.contacts().iter().map(|c| c.force.norm()).fold(0.0, f64::max);
        for contact in world.contacts().iter().filter(|c| c.depth >= -1e-3 || c.force.norm() > 0.0) {
            let point = Point3::from(small(&contact.point));
            let toward = toward_shown(world, contact);
            if self.contacts {
                list.point(point, DebugStyle::new([1.0, 0.85, 0.1]).width(8.0).on_top());
            }
            if self.normals {
                list.arrow(
                    point,
                    toward * NORMAL * size * small(&contact.normal),
                    DebugStyle::new([0.05, 0.35, 1.0]).width(3.0).on_top(),
                );
            }
            if self.forces && largest > 0.0 {
                let force = contact.force / largest;
                let seen = force / force.norm().sqrt().max(1e-6);
                list.arrow(point, toward * size * small(&seen), DebugStyle::new([1.0, 0.12, 0.08]).width(4.0).on_top());
            }
        }
        for &id in world.ids().iter().filter(|_| self.velocities) {
            let Some(part_state) = world.part_state(id, 0).filter(|s| s.velocity.norm() > 1e-3) else { continue };
            list.arrow(
                Point3::from(small(&part_state.position())),
                small(&(VELOCITY_ARROW_S * part_state.velocity)),
                DebugStyle::new([0.1, 0.9, 0.3]).width(3.0).on_top(),
            );
        }
        if self.frames {
            frames(world, list, 0.3 * size);
        }
        if self.joints {
            joints(world, list, 0.5 * size);
        }
        if let Some(level) = self.tree_level {
            trees(world, list, level);
        }
    }
}

/// Draws the axes of every part that is drawn.
fn frames(world: &World, list: &mut DrawList, length: f32) {
    for &id in world.ids() {
        let visuals = world.object(id).and_then(|o| o.renderable()).map_or(&[][..], |r| r.visuals());
        let parts: BTreeSet<usize> = visuals.iter().map(|v| v.part).collect();
        for part_state in parts.into_iter().filter_map(|part| world.part_state(id, part)) {
            let pose: Isometry3<f32> = part_state.pose.cast();
            for (axis, color) in [[0.9, 0.1, 0.1], [0.1, 0.75, 0.15], [0.15, 0.3, 1.0]].into_iter().enumerate() {
                let end = pose * Point3::from(Vector3::ith(axis, length));
                list.line(pose.translation.vector.into(), end, DebugStyle::new(color).width(2.5).on_top());
            }
        }
    }
}

const REVOLUTE_COLOR: [f32; 3] = [1.0, 0.55, 0.05];
const PRISMATIC_COLOR: [f32; 3] = [0.1, 0.8, 0.85];
const SPHERICAL_COLOR: [f32; 3] = [0.85, 0.25, 0.9];

/// Draws joints: a dot, and an arrow along the axis of a revolute or prismatic joint. A loop joint
/// has a dot or arrow at both ends, which shows how far they are apart.
fn joints(world: &World, list: &mut DrawList, length: f32) {
    let mut joint = |at: Point3<f32>, axis: Option<Vector3<f32>>, color: [f32; 3]| {
        let style = DebugStyle::new(color).on_top();
        list.point(at, style.width(7.0));
        if let Some(axis) = axis {
            list.arrow(at - 0.5 * length * axis, length * axis, style.width(2.5));
        }
    };
    for &id in world.ids() {
        if let Some(body) = world.get::<ArticulatedBody>(id) {
            for (link, l) in body.model().links().iter().enumerate() {
                let Some(part_state) = world.part_state(id, link) else { continue };
                let (at, along) = (Point3::from(small(&part_state.position())), |axis: &Vec3| {
                    Some(small(&(part_state.pose.rotation * axis)))
                });
                match &l.joint {
                    Joint::Revolute { axis } => joint(at, along(axis), REVOLUTE_COLOR),
                    Joint::Prismatic { axis } => joint(at, along(axis), PRISMATIC_COLOR),
                    Joint::Spherical => joint(at, None, SPHERICAL_COLOR),
                    Joint::Fixed | Joint::Floating => {}
                }
            }
        }
        if let Some(loop_joint) = world.get::<LoopJoint>(id) {
            for side in loop_joint.sides() {
                let carrier = match side.part {
                    Some((of, part)) => world.part_state(of, part).map(|part_state| part_state.pose),
                    None => Some(Pose::identity()),
                };
                let Some(frame) = carrier.map(|pose| pose * side.frame) else { continue };
                let axis = Some(small(&(frame.rotation * Vec3::z())));
                let at = Point3::from(small(&frame.translation.vector));
                match loop_joint.kind() {
                    LoopJointKind::Revolute | LoopJointKind::Universal => joint(at, axis, REVOLUTE_COLOR),
                    LoopJointKind::Prismatic | LoopJointKind::Cylindrical | LoopJointKind::Planar => {
                        joint(at, axis, PRISMATIC_COLOR)
                    }
                    _ => joint(at, None, SPHERICAL_COLOR),
                }
            }
        }
    }
}

/// Returns a color for each dynamic object: one for each [island](World::islands) of several
/// objects, in their order; gray for objects without connections.
pub(super) fn island_colors(world: &World) -> BTreeMap<ObjectId, [f32; 3]> {
    let mut palette = SHELL_COLORS.iter().copied().cycle();
    let mut color = |island: &[ObjectId]| if island.len() == 1 { None } else { palette.next() };
    let islands = world.islands();
    islands
        .iter()
        .flat_map(|island| {
            let color = color(island).unwrap_or([0.55, 0.56, 0.58]);
            island.iter().map(move |&id| (id, color))
        })
        .collect()
}

/// An object rests below this speed of each of its parts, m/s and rad/s.
const REST_SPEED: f64 = 5e-3;

/// Returns a color for each dynamic object: blue-gray if it sleeps, olive if it rests but is awake,
/// orange if it moves.
pub(super) fn sleep_colors(world: &World) -> BTreeMap<ObjectId, [f32; 3]> {
    let moving = world.ids().iter().copied().filter(|&id| world.status(id).is_some_and(|s| s.mode == Mode::Dynamic));
    let parts = |id| (0..).map_while(move |part| world.part_state(id, part));
    let still = |id| {
        parts(id).all(|part_state| {
            part_state.velocity.norm() < REST_SPEED && part_state.angular_velocity.norm() < REST_SPEED
        })
    };
    let color = |id| match (world.asleep(id), still(id)) {
        (true, _) => [0.32, 0.42, 0.60],
        (_, true) => [0.50, 0.58, 0.30],
        _ => [0.95, 0.55, 0.15],
    };
    moving.map(|id| (id, color(id))).collect()
}

/// Returns 1 if a contact's arrows are drawn as acting on its `a`, -1 if on its `b`: on the dynamic
/// body, or on the upper of two.
fn toward_shown(world: &World, contact: &ContactPoint) -> f32 {
    let moves = |id| world.status(id).is_some_and(|s| s.mode == Mode::Dynamic);
    match (moves(contact.a), moves(contact.b)) {
        (true, false) => 1.0,
        (false, true) => -1.0,
        _ if contact.normal.z < 0.0 => -1.0,
        _ => 1.0,
    }
}

/// Draws the spheres of one level, and the leaves above it.
fn trees(world: &World, list: &mut DrawList, level: u32) {
    for &id in world.ids() {
        let Some(collidable) = world.object(id).and_then(|o| o.collidable()) else { continue };
        for part in 0..collidable.parts() {
            let (Some(part_state), Some(tree)) =
                (world.part_state(id, part), collidable.shape(part).and_then(Shape::tree))
            else {
                continue;
            };
            let shown = tree.nodes().iter().filter(|n| n.level == level || (n.is_leaf() && n.level < level));
            for (node, color) in shown.zip(SHELL_COLORS.iter().cycle()) {
                let center = part_state.pose * nalgebra::Point3::from(node.center);
                list.shell(
                    Point3::from(small(&center.coords)),
                    node.radius as f32,
                    DebugStyle::new(*color).opacity(0.6),
                );
            }
        }
    }
}

//! Picking with the mouse: the pointer selects a body, and a spring pulls it.

use super::view_mode::Ray;
use tumble::collide::Vec3;
use tumble::dynamics::{ObjectId, PickForce, World, WorldError};
use tumble::render::{DebugStyle, DrawList};

/// Angular frequency of the spring, rad/s: a body reaches the pointer after a third of a second and
/// hangs 4 cm below it.
pub const FREQUENCY: f64 = 15.0;

/// The picked body and the target of its spring.
pub struct Picker {
    force: PickForce,
    /// Distance of the target along the axis of the view, m.
    depth_m: f64,
}

impl Picker {
    /// Picks the first body that the ray meets. Returns `None` if the ray meets nothing, or first a
    /// part that does not move.
    pub fn pick(world: &World, ray: &Ray) -> Option<Picker> {
        let (id, part, distance) = first_seen(world, ray)?;
        let moves = world.status(id)?.moves() && world.object(id)?.collidable().is_some_and(|c| c.part_moves(part));
        let part_state = world.part_state(id, part).filter(|_| moves)?;
        let target = ray.origin + ray.direction * distance;
        let point = part_state.pose.rotation.inverse() * (target - part_state.position());
        Some(Picker {
            force: PickForce { id, part, point, target, frequency: FREQUENCY },
            depth_m: distance * ray.direction.dot(&ray.axis),
        })
    }

    /// Moves the target to the ray of the pointer.
    pub fn follow(&mut self, ray: &Ray) {
        let along = ray.direction.dot(&ray.axis);
        if along > 1e-6 {
            self.force.target = ray.origin + ray.direction * (self.depth_m / along);
        }
    }

    /// Scales the target's distance from the eye.
    pub fn scale_distance(&mut self, factor: f64) {
        self.depth_m = (self.depth_m * factor).clamp(1e-3, 1e4);
    }

    /// Pulls during the next step.
    pub fn pull(&self, world: &mut World) -> Result<(), WorldError> {
        self.force.apply(world).map(drop)
    }

    /// Returns the body's name, the picked point and the target, world axes, m.
    pub fn picked(&self, world: &World) -> Option<(String, Vec3, Vec3)> {
        let part_state = world.part_state(self.force.id, self.force.part)?;
        let point = part_state.pose.rotation * self.force.point + part_state.position();
        Some((world.name(self.force.id)?.to_string(), point, self.force.target))
    }

    /// Draws a line from the picked point to the target.
    pub fn draw(&self, world: &World, list: &mut DrawList) {
        let Some((_, point, target)) = self.picked(world) else { return };
        let (from, to) = (nalgebra::Point3::from(point.cast::<f32>()), nalgebra::Point3::from(target.cast::<f32>()));
        let style = DebugStyle::new([1.0, 0.55, 0.1]).on_top();
        list.line(from, to, style.width(3.0));
        list.point(from, style.width(9.0));
        list.point(to, style.width(9.0));
    }
}

/// Returns object, part and distance of the first visual that the ray enters.
fn first_seen(world: &World, ray: &Ray) -> Option<(ObjectId, usize, f64)> {
    let mut first: Option<(ObjectId, usize, f64)> = None;
    for &id in world.ids() {
        let Some(renderable) =
            world.object(id).and_then(|o| o.renderable()).filter(|_| world.status(id).is_some_and(|s| s.enabled))
        else {
            continue;
        };
        for visual in renderable.visuals() {
            let Some(part_state) = world.part_state(id, visual.part) else { continue };
            let Some(distance) = visual.ray(&part_state.pose, &ray.origin, &ray.direction) else { continue };
            if first.is_none_or(|(_, _, nearest)| distance < nearest) {
                first = Some((id, visual.part, distance));
            }
        }
    }
    first
}

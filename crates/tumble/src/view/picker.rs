//! The user's hand: a body is picked by the mouse and pulled by a spring.

use super::view_mode::Ray;
use tumble::collide::Vec3;
use tumble::dynamics::{ObjectId, PickForce, World, WorldError};
use tumble::render::{DebugStyle, DrawList};

/// Frequency of the spring, rad/s: the hand has what it pulls after a third of a second, and what hangs from it is 4 cm below.
pub const FREQUENCY: f64 = 15.0;

/// What is held, and where it is wanted.
pub struct Picker {
    pull: PickForce,
    /// Depth along the line of sight at which the hand is, m.
    depth_m: f64,
}

impl Picker {
    /// Takes hold of what moves where the ray meets it; `None` where it meets nothing, or first what does not move.
    pub fn pick(world: &World, ray: &Ray) -> Option<Picker> {
        let (id, part, distance) = first_seen(world, ray)?;
        let moves = world.status(id)?.moves() && world.object(id)?.collidable().is_some_and(|c| c.part_moves(part));
        let part_state = world.part_state(id, part).filter(|_| moves)?;
        let target = ray.origin + ray.direction * distance;
        let point = part_state.pose.rotation.inverse() * (target - part_state.position());
        Some(Picker {
            pull: PickForce { id, part, point, target, frequency: FREQUENCY },
            depth_m: distance * ray.direction.dot(&ray.axis),
        })
    }

    /// Where the pointer points now.
    pub fn follow(&mut self, ray: &Ray) {
        let along = ray.direction.dot(&ray.axis);
        if along > 1e-6 {
            self.pull.target = ray.origin + ray.direction * (self.depth_m / along);
        }
    }

    /// Nearer to the user or farther away, by a factor.
    pub fn scale_distance(&mut self, factor: f64) {
        self.depth_m = (self.depth_m * factor).clamp(1e-3, 1e4);
    }

    /// Pulls during the next step.
    pub fn pull(&self, world: &mut World) -> Result<(), WorldError> {
        world.pick(&self.pull).map(drop)
    }

    /// Whose body it is, the point that is held, and where it is wanted, world axes, m.
    pub fn picked(&self, world: &World) -> Option<(String, Vec3, Vec3)> {
        let part_state = world.part_state(self.pull.id, self.pull.part)?;
        let point = part_state.pose.rotation * self.pull.point + part_state.position();
        Some((world.object(self.pull.id)?.name().to_string(), point, self.pull.target))
    }

    /// A line from the point that is held to the hand.
    pub fn draw(&self, world: &World, list: &mut DrawList) {
        let Some((_, point, target)) = self.picked(world) else { return };
        let (from, to) = (nalgebra::Point3::from(point.cast::<f32>()), nalgebra::Point3::from(target.cast::<f32>()));
        let style = DebugStyle::new([1.0, 0.55, 0.1]).on_top();
        list.line(from, to, style.width(3.0));
        list.point(from, style.width(9.0));
        list.point(to, style.width(9.0));
    }
}

/// The object, part and distance of the first visual that a ray enters.
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

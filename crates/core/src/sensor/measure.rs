//! Readings of sensors: the equations of [`SensorKind`].

use super::{Sensor, SensorKind, SensorPlace};
use crate::articulated::ArticulatedBody;
use crate::constraint::loop_joint::{Anchor, LoopJoint};
use crate::object::part_state::PartState;
use crate::world::view::ObjectId;
use crate::world::{Core, Ray};
use smallvec::{SmallVec, smallvec};
use tumble_collide::{Pose, Quat, Vec3};

/// The numbers of a reading.
pub(crate) type Reading = SmallVec<[f64; 4]>;

/// A frame of `dt` seconds that ended at the present.
#[derive(Clone, Copy)]
pub(crate) struct Past<'a> {
    /// Part states at its start.
    pub before: &'a [PartState],
    pub dt: f64,
}

/// A site in the world.
#[derive(Clone, Copy)]
struct SiteState {
    pose: Pose,
    velocity: Vec3,
    angular_velocity: Vec3,
}

fn numbers(v: Vec3) -> Reading {
    Reading::from_slice(v.as_slice())
}

/// Returns the orientation half way between two, on the shorter way.
fn middle(a: &Quat, b: &Quat) -> Quat {
    let sign = if a.coords.dot(&b.coords) < 0.0 { -1.0 } else { 1.0 };
    Quat::new_normalize((a.coords + sign * b.coords).into())
}

impl Sensor {
    /// Returns the reading at the present; `None` if what it reads was removed, or cannot be read. Without a past all
    /// means over a frame are zero.
    pub(crate) fn measure(&self, core: &Core, past: Option<Past>) -> Option<Reading> {
        if self.kind().is_camera() {
            return None;
        }
        match (self.place(), past) {
            (SensorPlace::Site(site), past) => self.at_site(core, site, past),
            (SensorPlace::LoopJoint(id), past) => self.of_loop_joint(core, *id, past),
            (SensorPlace::Dof(id, dof), past) => self.of_body(core, *id, *dof, past),
        }
    }

    fn at_site(&self, core: &Core, site: &Anchor, past: Option<Past>) -> Option<Reading> {
        let now = core.site(site, &core.derived.part_states)?;
        let axes = |v: Vec3| Some(numbers(now.pose.rotation.inverse_transform_vector(&v)));
        let world = SiteState { pose: Pose::identity(), velocity: Vec3::zeros(), angular_velocity: Vec3::zeros() };
        let reference = match self.reference() {
            Some(anchor) => core.site(anchor, &core.derived.part_states)?,
            None => world,
        };
        let seen = |v: Vec3| Some(numbers(reference.pose.rotation.inverse_transform_vector(&v)));
        let arm = now.pose.translation.vector - reference.pose.translation.vector;
        match self.kind() {
            SensorKind::Gyroscope => axes(now.angular_velocity),
            SensorKind::Velocimeter => axes(now.velocity),
            SensorKind::Position => seen(arm),
            SensorKind::LinearVelocity => {
                seen(now.velocity - reference.velocity - reference.angular_velocity.cross(&arm))
            }
            SensorKind::AngularVelocity => seen(now.angular_velocity - reference.angular_velocity),
            SensorKind::Orientation => {
                let q = (reference.pose.rotation.inverse() * now.pose.rotation).coords;
                Some(Reading::from_slice((if q.w < 0.0 { -q } else { q }).as_slice()))
            }
            SensorKind::RangeFinder => Some(smallvec![self.range(core, site, &now.pose)]),
            _ => self.mean_at_site(core, site, &now, past),
        }
    }

    /// Returns a mean over the frame.
    fn mean_at_site(&self, core: &Core, site: &Anchor, now: &SiteState, past: Option<Past>) -> Option<Reading> {
        let Some(Past { before, dt }) = past else { return Some(smallvec![0.0; self.kind().numbers()]) };
        let start = core.site(site, before)?;
        let axes = middle(&start.pose.rotation, &now.pose.rotation);
        let acceleration = (now.velocity - start.velocity) / dt;
        match self.kind() {
            SensorKind::Accelerometer => {
                Some(numbers(axes.inverse_transform_vector(&(acceleration - core.settings.gravity))))
            }
            SensorKind::LinearAcceleration => Some(numbers(acceleration)),
            SensorKind::AngularAcceleration => Some(numbers((now.angular_velocity - start.angular_velocity) / dt)),
            SensorKind::Touch => Some(smallvec![self.touch(core, site, [&start.pose, &now.pose])? / dt]),
            SensorKind::Force | SensorKind::Torque => {
                let (id, part) = site.part?;
                let entry = core.objects().get(id)?;
                let any: &dyn std::any::Any = entry.object;
                let body = any.downcast_ref::<ArticulatedBody>()?;
                let s = 0.5 * (start.pose.translation.vector + now.pose.translation.vector);
                let states = [before, &core.derived.part_states];
                if !entry.moves() {
                    return Some(numbers(Vec3::zeros()));
                }
                let sum = body.joint_impulse(body.link_of(part)?, entry.state_range, states, &core.loads, &s);
                let mean = if self.kind() == SensorKind::Force { sum.force } else { sum.torque } / dt;
                Some(numbers(axes.inverse_transform_vector(&mean)))
            }
            _ => None,
        }
    }

    /// Returns the distance along z to the next part that does not move with the site, m; −1 for none.
    fn range(&self, core: &Core, site: &Anchor, pose: &Pose) -> f64 {
        let direction = pose.rotation * Vec3::z();
        let ray = Ray { origin: pose.translation.vector, direction, max_distance: f64::INFINITY };
        core.distance_along(&ray, |id, part| core.carries(site, id, part)).unwrap_or(-1.0)
    }

    /// Returns the impulse along the normals of the contacts of the site's body, or of the shapes of its link alone, within the
    /// volume if there is one, N·s.
    fn touch(&self, core: &Core, site: &Anchor, [start, end]: [&Pose; 2]) -> Option<f64> {
        let (id, part) = site.part?;
        let any: &dyn std::any::Any = core.objects().get(id)?.object;
        let body = any.downcast_ref::<ArticulatedBody>();
        let link = body.and_then(|body| site.link.or_else(|| body.frame_of(part)));
        let mine = |row: u32| {
            let owner = core.owners[row as usize];
            let own = |body: &ArticulatedBody| match link {
                Some(link) => body.frame_of(owner.part as usize) == Some(link),
                None => body.link_of(owner.part as usize).is_none(), // all shapes on the base
            };
            owner.id == id && body.is_none_or(own)
        };
        let middle = Pose::from_parts(
            (0.5 * (start.translation.vector + end.translation.vector)).into(),
            middle(&start.rotation, &end.rotation),
        );
        let inside =
            |point: &Vec3| self.volume().is_none_or(|volume| volume.closest_point(&middle, point).distance <= 0.0);
        let touches = core.loads.touches.iter().filter(|t| t.parts.iter().any(|row| mine(*row)) && inside(&t.point));
        Some(touches.map(|touch| touch.impulse).sum())
    }

    fn of_loop_joint(&self, core: &Core, id: ObjectId, past: Option<Past>) -> Option<Reading> {
        let entry = core.objects().get(id)?;
        let any: &dyn std::any::Any = entry.object;
        let joint = any.downcast_ref::<LoopJoint>()?;
        let view = core.view(core.state.time);
        let position = || joint.position(&view);
        let load = core.loads.joints.get(&entry.serial).copied().unwrap_or_default();
        let mean = |impulse: f64| past.map_or(0.0, |past| impulse / past.dt);
        let side = joint.sides()[0];
        match self.kind() {
            SensorKind::JointPosition => Some(smallvec![position()?[0]]),
            SensorKind::JointVelocity => Some(smallvec![position()?[1]]),
            SensorKind::DriveForce => Some(smallvec![mean(load.drive)]),
            SensorKind::Force | SensorKind::Torque => {
                let now = core.site(&side, &core.derived.part_states)?.pose.rotation;
                let start = core.site(&side, past.map_or(&core.derived.part_states, |past| past.before))?.pose.rotation;
                let impulse = if self.kind() == SensorKind::Force { load.force } else { load.torque };
                Some(numbers(middle(&start, &now).inverse_transform_vector(&impulse.map(mean))))
            }
            _ => None,
        }
    }

    fn of_body(&self, core: &Core, id: ObjectId, dof: usize, past: Option<Past>) -> Option<Reading> {
        let entry = core.objects().get(id)?;
        let any: &dyn std::any::Any = entry.object;
        let body = any.downcast_ref::<ArticulatedBody>()?;
        let x = &core.state.x[entry.state_range.x.clone()];
        let v = entry.state_range.v.start + dof;
        let value = match (self.kind(), past) {
            (SensorKind::JointPosition, _) => x[body.position_of(dof)?],
            (SensorKind::JointVelocity, _) => *x.get(body.model().positions() + dof)?,
            (_, Some(past)) => {
                core.loads.drives.get(v).copied().unwrap_or(0.0) / past.dt + core.applied_generalized().get(v)?
            }
            (_, None) => 0.0,
        };
        Some(smallvec![value])
    }
}

impl Core {
    /// Returns a site by these part states of the world; `None` if its part was removed.
    fn site(&self, anchor: &Anchor, part_states: &[PartState]) -> Option<SiteState> {
        let Some((id, part)) = anchor.part else {
            let zero = Vec3::zeros();
            return Some(SiteState { pose: anchor.frame, velocity: zero, angular_velocity: zero });
        };
        let range = self.table.get(id)?.state_range.parts.clone();
        let state = part_states.get(range)?.get(part)?;
        let pose = state.pose * anchor.frame;
        let velocity = state.velocity_at(&pose.translation.vector);
        Some(SiteState { pose, velocity, angular_velocity: state.angular_velocity })
    }

    /// Returns the present pose of a site; `None` if its part was removed.
    pub(crate) fn site_pose(&self, anchor: &Anchor) -> Option<Pose> {
        Some(self.site(anchor, &self.derived.part_states)?.pose)
    }

    /// Returns the link that carries a part of an articulated body: `None` for its base, and for all parts of other objects.
    pub(crate) fn carrier(&self, id: ObjectId, part: usize) -> Option<usize> {
        let any: &dyn std::any::Any = self.objects().get(id)?.object;
        any.downcast_ref::<ArticulatedBody>()?.link_of(part)
    }
}

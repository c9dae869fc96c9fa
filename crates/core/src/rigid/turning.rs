//! How fast the forces of loop joints turn a rigid body back and forth (equations in `step/turning.rs`).

use super::RigidBody;
use crate::object::part_state::PointLoad;
use crate::step::{add_stiffness, rate_squared};
use tumble_collide::{Mat3, Pose};

impl RigidBody {
    /// Returns the angular frequency, rad/s, in a pose of the part under `loads`; 0 without any.
    pub(super) fn fastest_turn(&self, pose: &Pose, loads: &mut dyn Iterator<Item = PointLoad>) -> f64 {
        let Some(first) = loads.next() else { return 0.0 };
        let (q, center) = (&pose.rotation, pose.translation.vector - self.part_arm(&pose.rotation));
        let mut stiffness = Mat3::zeros();
        for load in std::iter::once(first).chain(loads) {
            add_stiffness(&mut stiffness, &(load.point - center), &load.force);
        }
        let turned = |k: usize| self.omega(q, &stiffness.column(k).into_owned());
        rate_squared(&Mat3::from_columns(&[turned(0), turned(1), turned(2)])).sqrt()
    }
}

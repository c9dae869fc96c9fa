//! How fast the forces within an articulated body turn its links back and forth (equations in
//! `step/turning.rs`).

use super::body::ArticulatedBody;
use crate::articulated::algorithms::dynamics::Dynamics;
use crate::object::part_state::{PartState, PointLoad};
use crate::step::add_stiffness;
use smallvec::SmallVec;
use tumble_collide::{Mat3, Vec3};

/// `4 + 2√3`: see the head of `step/turning.rs`.
const AGAINST_EACH_OTHER: f64 = 7.464_101_615_137_754;

impl ArticulatedBody {
    /// Returns the link that turns fastest, and its angular frequency, rad/s. `loads` act on parts,
    /// besides weight and inertia at the accelerations of the links.
    pub(super) fn fastest_turn(
        &self,
        dynamics: &Dynamics,
        part_states: &[PartState],
        gravity: &Vec3,
        loads: &mut dyn Iterator<Item = PointLoad>,
    ) -> (usize, f64) {
        let links = self.model.links();
        let mut carried = SmallVec::<[Vec3; 32]>::from_elem(Vec3::zeros(), links.len());
        let mut stiffness = SmallVec::<[Mat3; 32]>::from_elem(Mat3::zeros(), links.len());
        let mut beyond = SmallVec::<[f64; 32]>::from_elem(0.0, links.len());
        for load in loads {
            if let Some(link) = self.link_of(load.part) {
                let arm = load.point - part_states[link].position();
                add_stiffness(&mut stiffness[link], &arm, &load.force);
                carried[link] += load.force;
            }
        }
        let mut fastest = (0, 0.0);
        for (i, link) in links.iter().enumerate().rev() {
            let state = &part_states[i];
            let (arm, spin) = (state.pose.rotation * link.mass.center, state.angular_velocity);
            // the forces that its own rotation needs turn with it
            let tangential = state.acceleration + state.angular_acceleration.cross(&arm);
            add_stiffness(&mut stiffness[i], &arm, &(link.mass.mass * (gravity - tangential)));
            carried[i] += link.mass.mass * (gravity - tangential - spin.cross(&spin.cross(&arm)));
            beyond[i] += link.mass.mass;
            let square = dynamics.joint_rate(i, &stiffness[i]);
            if square > fastest.1 {
                fastest = (i, square);
            }
            if let Some(parent) = link.parent {
                let (arm, spin) =
                    (state.position() - part_states[parent].position(), part_states[parent].angular_velocity);
                add_stiffness(&mut stiffness[parent], &arm, &(carried[i] + beyond[i] * spin.cross(&spin.cross(&arm))));
                (carried[parent], beyond[parent]) = (carried[parent] + carried[i], beyond[parent] + beyond[i]);
            }
        }
        (fastest.0, (AGAINST_EACH_OTHER * fastest.1).sqrt())
    }
}

//! How fast the forces within an articulated body turn its links back and forth (equations in
//! `step/turning.rs`).

use super::body::{ArticulatedBody, BodyCache};
use crate::object::part_state::{PartState, PointLoad};
use crate::step::add_stiffness;
use tumble_collide::{Mat3, Vec3};

/// `4 + 2√3`: see the head of `step/turning.rs`.
const AGAINST_EACH_OTHER: f64 = 7.464_101_615_137_754;

/// The load of a joint: sums over its link and the links beyond it.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Carried {
    /// N.
    force: Vec3,
    /// Stiffness about its joint, N·m/rad.
    stiffness: Mat3,
    /// Mass, kg.
    mass: f64,
}

impl ArticulatedBody {
    /// Returns the link that turns fastest, and its angular frequency, rad/s. `loads` act on parts,
    /// besides weight and inertia at the accelerations of the links.
    pub(super) fn fastest_turn(
        &self,
        BodyCache { dynamics, carried, .. }: &mut BodyCache,
        part_states: &[PartState],
        gravity: &Vec3,
        loads: &mut dyn Iterator<Item = PointLoad>,
    ) -> (usize, f64) {
        let links = self.model.links();
        carried.clear();
        carried.resize(links.len(), Carried::default());
        for load in loads {
            if let Some(link) = self.link_of(load.part) {
                let arm = load.point - part_states[link].position();
                add_stiffness(&mut carried[link].stiffness, &arm, &load.force);
                carried[link].force += load.force;
            }
        }
        let mut fastest = (0, 0.0);
        for (i, link) in links.iter().enumerate().rev() {
            let state = &part_states[i];
            let (arm, spin) = (state.pose.rotation * link.mass.center, state.angular_velocity);
            // the forces that its own rotation needs turn with it
            let tangential = state.acceleration + state.angular_acceleration.cross(&arm);
            let mut own = carried[i];
            add_stiffness(&mut own.stiffness, &arm, &(link.mass.mass * (gravity - tangential)));
            own.force += link.mass.mass * (gravity - tangential - spin.cross(&spin.cross(&arm)));
            own.mass += link.mass.mass;
            let square = dynamics.joint_rate(i, &own.stiffness);
            if square > fastest.1 {
                fastest = (i, square);
            }
            if let Some(parent) = link.parent {
                let (arm, spin) =
                    (state.position() - part_states[parent].position(), part_states[parent].angular_velocity);
                let outer = &mut carried[parent];
                add_stiffness(&mut outer.stiffness, &arm, &(own.force + own.mass * spin.cross(&spin.cross(&arm))));
                (outer.force, outer.mass) = (outer.force + own.force, outer.mass + own.mass);
            }
        }
        (fastest.0, (AGAINST_EACH_OTHER * fastest.1).sqrt())
    }
}

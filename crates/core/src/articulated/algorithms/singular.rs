//! Joints that meet no inertia.

use crate::articulated::model::Model;
use std::fmt;

/// A joint that meets no inertia at a state: the mass matrix is singular there, and the acceleration does not exist.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SingularJoint {
    /// Number of the state in a batch; 0 of a single state.
    pub lane: usize,
    /// Number of the moving link that the joint carries.
    pub link: usize,
}

impl fmt::Display for SingularJoint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "the joint of moving link {} moves no inertia at state {}", self.link, self.lane)
    }
}

impl std::error::Error for SingularJoint {}

impl Model {
    /// Returns the message for a joint that meets no inertia, with the name of its moving link and a remedy.
    ///
    /// # Panics
    /// If there is no moving link of that number.
    pub fn singularity(&self, link: usize) -> String {
        format!(
            "the joint of link '{}' moves no inertia in this pose (gimbal lock of stacked joints, or a point mass on the axis); \
             a spherical joint instead of the stack has no such pose",
            self.links()[link].name
        )
    }
}

//! Smoothed and predicted heads of users.

use super::one_euro::{Placed, PoseFilter, Smoothing};
use nalgebra::{Quaternion, UnitQuaternion};
use std::collections::BTreeMap;
use std::time::Instant;
use tumble::collide::Pose;
use tumble::net::sync::Input;

/// The filters of all users. Hands and wands pass as they are: a filter would delay what they push.
pub struct SmoothedHeads {
    smoothing: Option<Smoothing>,
    start: Instant,
    filters: BTreeMap<u16, PoseFilter>,
}

impl SmoothedHeads {
    /// Begins; without a smoothing heads pass as they are.
    pub fn new(smoothing: Option<Smoothing>) -> SmoothedHeads {
        SmoothedHeads { smoothing, start: Instant::now(), filters: BTreeMap::new() }
    }

    /// Returns the inputs with the heads that pictures are drawn for.
    pub fn applied(&mut self, mut inputs: Vec<Input>) -> Vec<Input> {
        let Some(smoothing) = self.smoothing else { return inputs };
        let now = self.start.elapsed().as_secs_f64();
        for input in &mut inputs {
            if let Some(head) = &mut input.head {
                let filter = self.filters.entry(input.user).or_insert_with(|| PoseFilter::new(smoothing));
                let q = head.rotation.coords;
                let measured = Placed { position: head.translation.vector.into(), rotation: [q.x, q.y, q.z, q.w] };
                let Placed { position, rotation: [x, y, z, w] } = filter.next(now, measured);
                let rotation = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
                *head = Pose::from_parts(nalgebra::Vector3::from(position).into(), rotation);
            }
        }
        inputs
    }
}

//! Force and torque of a joint of an articulated body, by the balance of momentum of all that it carries:
//!
//! ```text
//! J = Σ (p₁ − p₀) − Σ f          K = Σ (L₁ − L₀) − Σ τ          over the links beyond the joint
//! L = (x_c − s)×m·v_c + R·I·Rᵀ·ω
//! ```
//!
//! `J/dt` and `K/dt` are the means over the frame, to the accuracy of the impulses. Joints beyond, with their drives, limits and
//! friction, act between two of the links and cancel. Rotors (armature) have no momentum here, as in MuJoCo.
//!
//! | symbol | meaning |
//! |---|---|
//! | `J`, `K` | impulse of the parent on the child, N·s; its moment about `s`, N·m·s |
//! | `p`, `L` | momentum of a link, and its angular momentum about `s`, at the start and at the end of the frame |
//! | `f`, `τ` | impulses of all other forces on a link over the frame, and their moments about `s` |
//! | `s` | where the site is in the middle of the frame; fixed |
//! | `x_c`, `m`, `I`, `R` | center of mass, mass and inertia of a link, its orientation |

use super::loads::FrameLoads;
use crate::articulated::{ArticulatedBody, LinkMass};
use crate::object::part_state::{PartState, StateRange, Wrench};
use tumble_collide::Vec3;

impl ArticulatedBody {
    /// Returns the impulse of the joint that moves `link` on it over a frame, and its moment about `s` (N·m·s and N·s, world axes).
    pub(crate) fn joint_impulse(
        &self,
        link: usize,
        me: &StateRange,
        [before, after]: [&[PartState]; 2],
        loads: &FrameLoads,
        s: &Vec3,
    ) -> Wrench {
        let mut beyond = vec![false; self.model().links().len()];
        let mut sum = Wrench::default();
        for (k, carried) in self.model().links().iter().enumerate() {
            beyond[k] = k == link || carried.parent.is_some_and(|parent| beyond[parent]);
            if beyond[k] {
                let row = me.parts.start + k;
                let ([p0, l0], [p1, l1]) =
                    (momentum(&carried.mass, &before[row], s), momentum(&carried.mass, &after[row], s));
                sum.force += p1 - p0;
                sum.torque += l1 - l0;
                for row in std::iter::once(row).chain(self.colliders_of(Some(k)).map(|part| me.parts.start + part)) {
                    let Wrench { torque, force } = loads.parts.get(row).copied().unwrap_or_default();
                    sum.force -= force;
                    sum.torque -= torque - s.cross(&force);
                }
            }
        }
        sum
    }
}

/// Returns the momentum of a link, kg·m/s, and its angular momentum about `s`, kg·m²/s.
fn momentum(mass: &LinkMass, state: &PartState, s: &Vec3) -> [Vec3; 2] {
    let center = state.pose.transform_point(&mass.center.into()).coords;
    let p = mass.mass * state.velocity_at(&center);
    let own = state.pose.rotation.inverse_transform_vector(&state.angular_velocity);
    [p, (center - s).cross(&p) + state.pose.rotation * (mass.inertia * own)]
}

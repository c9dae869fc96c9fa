//! Sums over the links: energy, momentum, center of mass [RBDA §2.13, §5.3].
//!
//! ```text
//! T = Σ ½m·|v + ω×c|² + ½ω·I_c·ω + ½a·q̇² = Σ ½m·|v|² + m·v·(ω×c) + ½ω·I·ω + ½a·q̇²         V = −Σ m·g·(p + c)
//! P = Σ m·(v + ω×c)                                                     H = Σ I·ω + m·c×v + p×m·(v + ω×c)
//! ```
//!
//! Symbols as in `kinematics.rs`; `a` is the armature of a joint, `g` is gravity, `H` is about the world's origin.

use crate::articulated::algorithms::kinematics::Kinematics;
use crate::articulated::model::Model;
use crate::object::{Energy, Momentum};
use tumble_collide::Vec3;

/// Returns kinetic energy and potential energy in uniform `gravity` (m/s², world axes; zero at the
/// world's origin), J, for the refreshed motion.
pub fn energy(model: &Model, kin: &Kinematics, gravity: &Vec3) -> Energy {
    let mut sum = Energy::default();
    for ((link, own), rate) in model.links().iter().zip(kin.links()).zip(kin.joint_rates()) {
        let (m, turn) = (link.mass.mass, own.angular);
        if link.armature != 0.0 {
            sum.kinetic += 0.5 * link.armature * (rate.angular.norm_squared() + rate.linear.norm_squared());
        }
        let translation = 0.5 * m * own.linear.norm_squared() + m * own.linear.dot(&turn.cross(&own.center));
        sum.kinetic += translation + 0.5 * turn.dot(&(own.inertia * turn));
        sum.potential -= m * gravity.dot(&(own.pose.translation.vector + own.center));
    }
    sum
}

/// Returns linear momentum, N·s, and angular momentum about the world's origin, N·m·s, for the
/// refreshed motion.
pub fn momentum(model: &Model, kin: &Kinematics) -> Momentum {
    let mut sum = Momentum::default();
    for (link, own) in model.links().iter().zip(kin.links()) {
        let m = link.mass.mass;
        let linear = m * (own.linear + own.angular.cross(&own.center));
        sum.linear += linear;
        sum.angular +=
            own.inertia * own.angular + m * own.center.cross(&own.linear) + own.pose.translation.vector.cross(&linear);
    }
    sum
}

/// Returns position, m, and velocity, m/s, of the center of all mass in the world. `None` for a
/// model without mass (inertia alone).
pub fn center_of_mass(model: &Model, kin: &Kinematics) -> Option<(Vec3, Vec3)> {
    let mass = model.mass();
    let moment: Vec3 =
        model.links().iter().zip(kin.links()).map(|(l, k)| l.mass.mass * (k.pose.translation.vector + k.center)).sum();
    (mass > 0.0).then(|| (moment / mass, momentum(model, kin).linear / mass))
}

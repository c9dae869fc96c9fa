//! Jacobians: velocity of a point or a link due to the generalized velocities [RBDA §4.4].
//!
//! Column `k` belongs to a joint on the path from the link to the root, with columns `S_ω`, `S_v`
//! at the origin `o` of that joint's link:
//!
//! ```text
//! angular  S_ω               linear, at the world point p  S_v + S_ω×(p − o)
//! ```
//!
//! All other columns are zero. [`Kinematics::bias_accelerations`] gives `J̇·v`.

use crate::articulated::algorithms::kinematics::{Kinematics, Rates};
use crate::articulated::model::Model;
use tumble_collide::Vec3;

/// Writes the Jacobian of the world point `point` carried by `link`: 3×dof numbers by rows, world
/// axes, `J·v` in m/s.
pub fn point_jacobian(model: &Model, kin: &Kinematics, link: usize, point: &Vec3, out: &mut [f64]) {
    let dof = model.dof();
    out[..3 * dof].fill(0.0);
    columns_at(model, kin, link, point, |k, rates| {
        for row in 0..3 {
            out[row * dof + k] = rates.linear[row];
        }
    });
}

/// Writes the Jacobian of the angular velocity of `link` (first three rows) and of the velocity of
/// its origin (last three): 6×dof numbers by rows, world axes.
pub fn link_jacobian(model: &Model, kin: &Kinematics, link: usize, out: &mut [f64]) {
    let dof = model.dof();
    out[..6 * dof].fill(0.0);
    let origin = kin.links()[link].pose.translation.vector;
    columns_at(model, kin, link, &origin, |k, rates| {
        for row in 0..3 {
            out[row * dof + k] = rates.angular[row];
            out[(3 + row) * dof + k] = rates.linear[row];
        }
    });
}

/// Visits every column that moves `link`, from the link to the root.
fn columns_at(model: &Model, kin: &Kinematics, link: usize, point: &Vec3, mut visit: impl FnMut(usize, Rates)) {
    let mut at = Some(link);
    while let Some(i) = at {
        let (link, origin) = (&model.links()[i], kin.links()[i].pose.translation.vector);
        for k in link.v..link.v + link.joint.dof() {
            let column = kin.columns()[k];
            visit(
                k,
                Rates { angular: column.angular, linear: column.linear + column.angular.cross(&(point - origin)) },
            );
        }
        at = link.parent;
    }
}

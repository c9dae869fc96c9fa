//! The mass matrix by the composite-rigid-body algorithm [RBDA §6.2].
//!
//! An inward sweep adds each subtree to its link: composite mass `m`, first moment `h = m·c` and
//! inertia `I` about the link's origin. The momentum of that composite at unit velocity of its
//! joint is then carried to every ancestor, whose columns of `S` give the entries:
//!
//! ```text
//! f = m·S_v + S_ω×h          n = I·S_ω + h×S_v                       M[k, k] = S_kᵀ·[n; f] + a
//! to the parent: n += r×f                                            M[j, k] = S_jᵀ·[n; f]
//! composite of the parent:  m_λ += m,  h_λ += h + m·r,
//!                           I_λ += I + 2(r·h)·1 − r·hᵀ − h·rᵀ + m·(|r|²·1 − r·rᵀ)
//! ```
//!
//! `a` is the armature of the joint. Other symbols as in `kinematics.rs`.

use crate::articulated::algorithms::kinematics::{Kinematics, Rates};
use crate::articulated::model::{Link, Model};
use tumble_collide::{Mat3, Vec3};

/// Buffers of the mass matrix.
#[derive(Clone, Debug)]
pub struct MassMatrix {
    composites: Vec<Composite>,
}

/// Mass, first moment and inertia of a subtree about its link's origin.
#[derive(Clone, Copy, Debug)]
struct Composite {
    mass: f64,
    moment: Vec3,
    inertia: Mat3,
}

impl MassMatrix {
    /// Allocates buffers for `model`.
    pub fn new(model: &Model) -> MassMatrix {
        MassMatrix {
            composites: vec![
                Composite { mass: 0.0, moment: Vec3::zeros(), inertia: Mat3::zeros() };
                model.links().len()
            ],
        }
    }

    /// Writes `M` at the refreshed position: dof×dof numbers by rows, symmetric to the bit.
    pub fn write(&mut self, model: &Model, kin: &Kinematics, out: &mut [f64]) {
        let dof = model.dof();
        out[..dof * dof].fill(0.0);
        self.gather(model, kin);
        for (i, link) in model.links().iter().enumerate() {
            for k in numbers(link) {
                let (mut at, mut momentum) = (i, self.composites[i].momentum(&kin.columns()[k]));
                loop {
                    for j in numbers(&model.links()[at]) {
                        let column = &kin.columns()[j];
                        let entry = column.angular.dot(&momentum.angular) + column.linear.dot(&momentum.linear);
                        (out[j * dof + k], out[k * dof + j]) = (entry, entry);
                    }
                    let Some(parent) = model.links()[at].parent else { break };
                    momentum.angular += kin.links()[at].arm.cross(&momentum.linear);
                    at = parent;
                }
                out[k * dof + k] += link.armature;
            }
        }
    }

    /// Computes the composites, children before parents.
    fn gather(&mut self, model: &Model, kin: &Kinematics) {
        for (i, link) in model.links().iter().enumerate() {
            let (m, own) = (link.mass.mass, &kin.links()[i]);
            self.composites[i] = Composite { mass: m, moment: m * own.center, inertia: own.inertia };
        }
        for (i, link) in model.links().iter().enumerate().rev() {
            if let Some(parent) = link.parent {
                let part = self.composites[i];
                self.composites[parent].take(&part, &kin.links()[i].arm);
            }
        }
    }
}

impl Composite {
    /// Returns the momentum of the composite that moves by `column`: linear, and angular about the
    /// link's origin.
    fn momentum(&self, column: &Rates) -> Rates {
        Rates {
            angular: self.inertia * column.angular + self.moment.cross(&column.linear),
            linear: self.mass * column.linear + column.angular.cross(&self.moment),
        }
    }

    /// Adds a composite whose origin is at `r` from this one.
    fn take(&mut self, part: &Composite, r: &Vec3) {
        let (m, h) = (part.mass, &part.moment);
        self.mass += m;
        self.moment += h + m * r;
        let diagonal = Mat3::from_diagonal_element(2.0 * r.dot(h) + m * r.norm_squared());
        self.inertia += part.inertia + diagonal - r * h.transpose() - h * r.transpose() - m * r * r.transpose();
    }
}

fn numbers(link: &Link) -> std::ops::Range<usize> {
    link.v..link.v + link.joint.dof()
}

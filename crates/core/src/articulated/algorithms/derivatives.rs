//! Derivatives of inverse and forward dynamics by positions, velocities and forces: Singh, Russell and
//! Wensing, *Efficient Analytical Derivatives of Rigid-Body Dynamics using Spatial Vector Algebra*, 2022.
//!
//! All quantities are spatial, in world axes and about one point that is fixed in space. With
//! `I`, `B`, `f` summed over the links beyond a joint, and `j` a joint on the way from `k` to the root:
//!
//! ```text
//! Ψ̇ = v_λ × S           Ψ̈ = a_λ × S + v_λ × Ψ̇           Ṡ = v × S
//! f = I·a + v ×* I·v     B = ½((v×*)I − I(v×) + (·)×*(I·v))
//! ∂τ_k/∂q_j = S_k·(2B·Ψ̇_j + I·Ψ̈_j)                      ∂τ_j/∂q_k = S_j·(2B·Ψ̇_k + I·Ψ̈_k + S_k ×* f)
//! ∂τ_k/∂v_j = S_k·(2B·S_j + I·(Ψ̇_j + Ṡ_j))              ∂τ_j/∂v_k = S_j·(2B·S_k + I·(Ψ̇_k + Ṡ_k))
//! ∂q̈/∂q = −M⁻¹·∂τ/∂q    ∂q̈/∂v = −M⁻¹·∂τ/∂v    ∂q̈/∂τ = M⁻¹
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `S_k` | motion of joint number `k` at unit velocity |
//! | `v`, `v_λ`; `a`, `a_λ` | velocity of the link and its parent; their spatial acceleration, minus gravity |
//! | `I` | inertia of a link |
//! | `B` | Coriolis matrix of a link: `f` changes by `2B·δv` |
//!
//! The source has velocities in axes of the link. Those of a floating root are in world axes here, so that
//! they do not turn with it: with `×` on both halves, `∂τ/∂θ = ∂τ'/∂θ + δθ × τ − ∂τ'/∂v·(δθ × v) −
//! M·(δθ × q̈')`, and `q̈' = q̈ − [0; ω × v]` changes with `v` (`'`: as in the source).

use crate::articulated::algorithms::kinematics::{Kinematics, LinkMotion};
use crate::articulated::algorithms::rnea::InverseDynamics;
use crate::articulated::model::Model;
use crate::articulated::model::joint::Joint;
use crate::spatial::{Force, Motion, Vector};
use nalgebra::{DMatrix, DVector, Matrix6, Vector6};
use tumble_collide::{Mat3, Vec3};

/// Derivatives of the generalized forces `τ` of inverse dynamics. Row `i`, column `k`: of number `i` of `τ` by
/// number `k`. A column of positions is the derivative along [`integrate`](crate::articulated::integrate).
#[derive(Clone, Debug, PartialEq)]
pub struct InverseDynamicsDerivatives {
    /// `∂τ/∂q`, dof×dof.
    pub by_q: DMatrix<f64>,
    /// `∂τ/∂v`, dof×dof.
    pub by_v: DMatrix<f64>,
    /// `∂τ/∂q̈`, the mass matrix with armatures, dof×dof, symmetric.
    pub by_qdd: DMatrix<f64>,
}

/// Derivatives of the generalized accelerations `q̈` of forward dynamics, with rows and columns as in
/// [`InverseDynamicsDerivatives`].
#[derive(Clone, Debug, PartialEq)]
pub struct ForwardDynamicsDerivatives {
    /// `q̈`, one number per degree of freedom.
    pub qdd: DVector<f64>,
    /// `∂q̈/∂q`, dof×dof.
    pub by_q: DMatrix<f64>,
    /// `∂q̈/∂v`, dof×dof.
    pub by_v: DMatrix<f64>,
    /// `∂q̈/∂τ`, the inverse of the mass matrix, dof×dof.
    pub by_tau: DMatrix<f64>,
}

/// Returns the derivatives of [`inverse_dynamics`](crate::articulated::inverse_dynamics) without wrenches at
/// positions `q`, velocities `v` and accelerations `qdd`, in uniform gravity, m/s². `kin` is refreshed.
///
/// ```
/// use tumble_core::{Joint, LinkMass, ModelBuilder, articulated::{Kinematics, inverse_dynamics_derivatives}};
/// use tumble_core::collide::{Pose, Vec3};
/// let mut builder = ModelBuilder::new();
/// builder.link("bob", None, Joint::revolute(Vec3::y()), Pose::identity(), LinkMass::point(2.0, Vec3::new(0.0, 0.0, -0.5)));
/// let model = builder.build()?;
/// let gravity = Vec3::new(0.0, 0.0, -9.81);
/// let d = inverse_dynamics_derivatives(&model, &mut Kinematics::new(&model), &gravity, &[0.3], &[0.0], &[0.0]);
/// // τ = m·g·l·sin q of a pendulum
/// assert!((d.by_q[(0, 0)] - 2.0 * 9.81 * 0.5 * f64::cos(0.3)).abs() < 1e-12);
/// # Ok::<(), tumble_core::ModelError>(())
/// ```
pub fn inverse_dynamics_derivatives(
    model: &Model,
    kin: &mut Kinematics,
    gravity: &Vec3,
    q: &[f64],
    v: &[f64],
    qdd: &[f64],
) -> InverseDynamicsDerivatives {
    kin.refresh(model, q, v);
    let motions = Motions::new(model, kin, v, qdd, gravity);
    let (mut d, tau) = motions.derivatives(model, &motions.composites(model, kin));
    for link in model.links().iter().filter(|link| link.joint == Joint::Floating) {
        let k = link.v;
        let own = |x: &[f64]| [vector(x, k), vector(x, k + 3)];
        let ([spin, velocity], [turned, moved]) = (own(v), own(qdd));
        let own_tau = own(&tau);
        let body = [turned, moved - spin.cross(&velocity)];
        for axis in 0..3 {
            let unit = Vec3::ith(axis, 1.0);
            let turns = |pair: [Vec3; 2]| Vector6::from_iterator(pair.iter().flat_map(|x| unit.cross(x).data.0[0]));
            let lost = d.by_v.columns(k, 6) * turns([spin, velocity]) + d.by_qdd.columns(k, 6) * turns(body);
            let mut column = d.by_q.column_mut(k + axis);
            column -= lost;
            let mut own = column.rows_mut(k, 6);
            own += turns(own_tau);
        }
        let linear = d.by_qdd.columns(k + 3, 3).into_owned();
        for axis in 0..3 {
            let unit = Vec3::ith(axis, 1.0);
            let mut by_spin = d.by_v.column_mut(k + axis);
            by_spin -= &linear * unit.cross(&velocity);
            let mut by_velocity = d.by_v.column_mut(k + 3 + axis);
            by_velocity -= &linear * spin.cross(&unit);
        }
    }
    d
}

/// Returns the derivatives of forward dynamics at positions `q`, velocities `v` and joint forces `tau`, without
/// wrenches, in uniform gravity, m/s². `kin` is refreshed. `None` if the mass matrix is singular.
pub fn forward_dynamics_derivatives(
    model: &Model,
    kin: &mut Kinematics,
    gravity: &Vec3,
    q: &[f64],
    v: &[f64],
    tau: &[f64],
) -> Option<ForwardDynamicsDerivatives> {
    let dof = model.dof();
    let mut bias = vec![0.0; dof];
    kin.refresh(model, q, v);
    InverseDynamics::new(model).bias(model, kin, gravity, &[], &mut bias);
    let mut mass = vec![0.0; dof * dof];
    super::crba::MassMatrix::new(model).write(model, kin, &mut mass);
    let factor = DMatrix::from_vec(dof, dof, mass).cholesky()?;
    let qdd = factor.solve(&DVector::from_iterator(dof, tau.iter().zip(&bias).map(|(tau, bias)| tau - bias)));
    let inverse = inverse_dynamics_derivatives(model, kin, gravity, q, v, qdd.as_slice());
    let solved = |of: &DMatrix<f64>| -factor.solve(of);
    Some(ForwardDynamicsDerivatives {
        by_q: solved(&inverse.by_q),
        by_v: solved(&inverse.by_v),
        by_tau: factor.inverse(),
        qdd,
    })
}

/// The motions of all joint numbers and of all links, about the point `about`.
struct Motions {
    /// `S`, `Ψ̇`, `Ψ̈` and `Ψ̇ + Ṡ`, one per velocity number.
    columns: Vec<[Motion; 4]>,
    /// `v` and `a`, one per link.
    links: Vec<[Motion; 2]>,
    about: Vec3,
}

/// `I`, `B` and `f` of a link, or of all links beyond its joint.
#[derive(Clone, Copy)]
struct Composite {
    inertia: Matrix6<f64>,
    coriolis: Matrix6<f64>,
    force: Force,
}

impl Motions {
    fn new(model: &Model, kin: &Kinematics, v: &[f64], qdd: &[f64], gravity: &Vec3) -> Motions {
        let about = kin.links().first().map_or(Vec3::zeros(), |link| link.pose.translation.vector);
        let still = [Motion::default(), Motion::new(Vector::default(), (-gravity).into())];
        let mut motions = Motions { columns: Vec::with_capacity(v.len()), links: Vec::with_capacity(v.len()), about };
        for (link, place) in model.links().iter().zip(kin.links()) {
            let [outer, outer_acceleration] = link.parent.map_or(still, |parent| motions.links[parent]);
            let to_about = about - place.pose.translation.vector;
            let [mut velocity, mut acceleration] = [outer, outer_acceleration];
            for k in link.v..link.v + link.joint.dof() {
                let column = &kin.columns()[k];
                let s = Motion::new(column.angular.into(), column.linear.into()).at(to_about.into());
                velocity += s * v[k];
                acceleration += s * qdd[k];
            }
            let joint = velocity - outer;
            acceleration += outer.cross(joint);
            if link.joint == Joint::Floating {
                // q̈' of the head of this file: the acceleration in axes of the link
                let lost = vector(v, link.v).cross(&vector(v, link.v + 3));
                acceleration -= Motion::new(Vector::default(), lost.into());
            }
            for k in link.v..link.v + link.joint.dof() {
                let column = &kin.columns()[k];
                let s = Motion::new(column.angular.into(), column.linear.into()).at(to_about.into());
                let rate = outer.cross(s);
                let second = outer_acceleration.cross(s) + outer.cross(rate);
                motions.columns.push([s, rate, second, rate + velocity.cross(s)]);
            }
            motions.links.push([velocity, acceleration]);
        }
        motions
    }

    /// Returns the composites of all links.
    fn composites(&self, model: &Model, kin: &Kinematics) -> Vec<Composite> {
        let of_link = |((link, place), [v, a]): ((&crate::articulated::Link, &LinkMotion), &[Motion; 2])| {
            let m = link.mass.mass;
            let (origin, center) = (place.pose.translation.vector - self.about, place.center);
            let central = place.inertia + m * (skew(&center) * skew(&center)); // parallel axes
            let arm = skew(&(origin + center));
            let mut inertia = Matrix6::zeros();
            inertia.fixed_view_mut::<3, 3>(0, 0).copy_from(&(central - m * arm * arm));
            inertia.fixed_view_mut::<3, 3>(0, 3).copy_from(&(m * arm));
            inertia.fixed_view_mut::<3, 3>(3, 0).copy_from(&(-m * arm));
            inertia.fixed_view_mut::<3, 3>(3, 3).copy_from(&(m * Mat3::identity()));
            let momentum = force(&(inertia * six(v)));
            let column = |k: usize| {
                let unit = motion(&Vector6::ith(k, 1.0));
                let carried = v.cross_force(force(&inertia.column(k).into_owned())) + unit.cross_force(momentum);
                0.5 * (six_of(&carried) - inertia * six(&v.cross(unit)))
            };
            let coriolis = Matrix6::from_columns(&std::array::from_fn::<_, 6, _>(column));
            Composite { inertia, coriolis, force: force(&(inertia * six(a))) + v.cross_force(momentum) }
        };
        let mut all: Vec<Composite> = model.links().iter().zip(kin.links()).zip(&self.links).map(of_link).collect();
        for (i, link) in model.links().iter().enumerate().rev() {
            if let Some(parent) = link.parent {
                let Composite { inertia, coriolis, force } = all[i];
                let sum = &mut all[parent];
                sum.inertia += inertia;
                sum.coriolis += coriolis;
                sum.force += force;
            }
        }
        all
    }

    /// Returns the derivatives with the velocities of the source, and `τ`.
    fn derivatives(&self, model: &Model, composites: &[Composite]) -> (InverseDynamicsDerivatives, Vec<f64>) {
        let dof = model.dof();
        let [mut by_q, mut by_v, mut by_qdd] = [(); 3].map(|()| DMatrix::zeros(dof, dof));
        let mut tau = vec![0.0; dof];
        for (i, link) in model.links().iter().enumerate() {
            let Composite { inertia, coriolis, force } = &composites[i];
            for k in link.v..link.v + link.joint.dof() {
                let [s, rate, second, both] = self.columns[k].map(|motion| six(&motion));
                let (momentum, drag) = (inertia * s, 2.0 * coriolis.tr_mul(&s));
                let turned = six_of(&self.columns[k][0].cross_force(*force));
                let from_q = 2.0 * coriolis * rate + inertia * second + turned;
                let from_v = 2.0 * coriolis * s + inertia * both;
                tau[k] = s.dot(&six_of(force));
                let mut at = Some(i);
                while let Some(link) = at {
                    let own = &model.links()[link];
                    for j in own.v..own.v + own.joint.dof() {
                        let [s_j, rate_j, second_j, both_j] = self.columns[j].map(|motion| six(&motion));
                        by_q[(k, j)] = drag.dot(&rate_j) + momentum.dot(&second_j);
                        by_v[(k, j)] = drag.dot(&s_j) + momentum.dot(&both_j);
                        by_qdd[(k, j)] = momentum.dot(&s_j);
                        if link != i {
                            by_q[(j, k)] = s_j.dot(&from_q);
                            by_v[(j, k)] = s_j.dot(&from_v);
                            by_qdd[(j, k)] = by_qdd[(k, j)];
                        }
                    }
                    at = own.parent;
                }
                by_qdd[(k, k)] += link.armature;
            }
        }
        (InverseDynamicsDerivatives { by_q, by_v, by_qdd }, tau)
    }
}

fn vector(x: &[f64], k: usize) -> Vec3 {
    Vec3::new(x[k], x[k + 1], x[k + 2])
}

fn skew(x: &Vec3) -> Mat3 {
    x.cross_matrix()
}

fn six(m: &Motion) -> Vector6<f64> {
    Vector6::new(m.angular.x, m.angular.y, m.angular.z, m.linear.x, m.linear.y, m.linear.z)
}

fn six_of(f: &Force) -> Vector6<f64> {
    Vector6::new(f.torque.x, f.torque.y, f.torque.z, f.force.x, f.force.y, f.force.z)
}

fn motion(x: &Vector6<f64>) -> Motion {
    Motion::new(Vector::new(x[0], x[1], x[2]), Vector::new(x[3], x[4], x[5]))
}

fn force(x: &Vector6<f64>) -> Force {
    Force::new(Vector::new(x[0], x[1], x[2]), Vector::new(x[3], x[4], x[5]))
}

//! Two families of algorithms that share no code: the articulated-body method with its factors
//! (`Dynamics`), and inverse dynamics, mass matrix and Jacobians (`Kinematics`).

use crate::articulated_random::*;
use nalgebra::{DMatrix, DVector};
use tumble_core::articulated::*;
use tumble_core::collide::Vec3;
use tumble_core::{Model, Wrench};

const G: Vec3 = Vec3::new(0.3, -0.7, -9.81);

/// One tree in one state, on both sides.
struct Both {
    model: Model,
    dynamics: Dynamics,
    kin: Kinematics,
    work: InverseDynamics,
    q: Vec<f64>,
    v: Vec<f64>,
    wrenches: Vec<Wrench>,
}

fn all(seed: u64) -> (Random, Vec<Both>) {
    let mut random = Random(seed ^ 0x5a5a);
    let mut made = Vec::new();
    for model in random_trees(seed).into_iter().chain(random_trees(seed + 100)) {
        let (q, v) = random_state(&mut random, &model, 1.0);
        let (mut dynamics, mut kin) = (Dynamics::new(&model), Kinematics::new(&model));
        dynamics.refresh(&q, &v);
        kin.refresh(&model, &q, &v);
        let wrenches =
            model.links().iter().map(|_| Wrench { torque: random.vector(1.0), force: random.vector(2.0) }).collect();
        made.push(Both { dynamics, kin, work: InverseDynamics::new(&model), model, q, v, wrenches });
    }
    (random, made)
}

impl Both {
    fn torques(&mut self, qdd: &[f64]) -> Vec<f64> {
        let mut tau = vec![f64::NAN; self.model.dof()];
        self.work.solve(&self.model, &self.kin, &G, qdd, &self.wrenches, &mut tau);
        tau
    }

    fn accelerations(&self, tau: &[f64]) -> Vec<f64> {
        let mut qdd = vec![f64::NAN; self.model.dof()];
        self.dynamics.accelerate_in(&mut self.dynamics.scratch(), &G, tau, &self.wrenches, &mut qdd);
        qdd
    }

    fn mass_matrix(&self) -> DMatrix<f64> {
        let dof = self.model.dof();
        let mut m = vec![f64::NAN; dof * dof];
        MassMatrix::new(&self.model).write(&self.model, &self.kin, &mut m);
        DMatrix::from_row_slice(dof, dof, &m)
    }
}

#[test]
fn forward_dynamics_undoes_inverse_dynamics() {
    let (mut random, cases) = all(51);
    let mut worst = 0.0f64;
    for mut case in cases {
        let qdd = random.numbers(case.model.dof(), 5.0);
        let tau = case.torques(&qdd);
        let error = relative(&case.accelerations(&tau), &qdd);
        assert!(error < 1e-10, "{} links, {} dof: {error:e}", case.model.links().len(), case.model.dof());
        worst = worst.max(error);
        // the fused pass takes no wrenches
        case.wrenches.clear();
        let (tau, mut fused) = (case.torques(&qdd), vec![f64::NAN; qdd.len()]);
        forward_dynamics(&mut case.dynamics, &G, &case.q, &case.v, &tau, &mut fused).unwrap();
        assert!(relative(&fused, &qdd) < 1e-10);
    }
    println!("worst ABM(RNEA(a)) − a: {worst:.1e}");
}

#[test]
fn inverse_dynamics_undoes_forward_dynamics() {
    let (mut random, cases) = all(52);
    for mut case in cases {
        let tau = random.numbers(case.model.dof(), 20.0);
        let qdd = case.accelerations(&tau);
        let size = qdd.iter().fold(1.0f64, |m, x| m.max(x.abs()));
        // torques are differences of numbers as large as the accelerations
        assert!(apart(&case.torques(&qdd), &tau) < 1e-12 * size);
    }
}

#[test]
fn poses_velocities_and_accelerations_of_links_are_the_same() {
    let (mut random, cases) = all(53);
    for case in cases {
        let count = case.model.links().len();
        let qdd = random.numbers(case.model.dof(), 5.0);
        let (mut ours, mut theirs) = (vec![Rates::zero(); count], vec![(Vec3::zeros(), Vec3::zeros()); count]);
        case.kin.accelerations(&case.model, &qdd, &Vec3::zeros(), &mut ours);
        case.dynamics.link_accelerations(&qdd, &mut theirs);
        for (i, link) in case.kin.links().iter().enumerate() {
            let (angular, linear) = case.dynamics.link_velocity(i);
            let size = 1.0 + linear.norm() + ours[i].linear.norm() + ours[i].angular.norm();
            assert!((link.pose.to_homogeneous() - case.dynamics.link_pose(i).to_homogeneous()).norm() < 1e-12);
            assert!((link.angular - angular).norm() + (link.linear - linear).norm() < 1e-12 * size);
            assert!((ours[i].angular - theirs[i].0).norm() + (ours[i].linear - theirs[i].1).norm() < 1e-12 * size);
        }
    }
}

/// `|L·v|² = v·Mv`, and `Lᵀ·L·v = M·v`.
#[test]
fn the_whitening_maps_are_a_root_of_the_mass_matrix() {
    let (mut random, cases) = all(54);
    for case in cases {
        let dof = case.model.dof();
        let v = random.numbers(dof, 2.0);
        let (mut s, mut u, mut j) = (case.dynamics.scratch(), vec![f64::NAN; dof], vec![f64::NAN; dof]);
        case.dynamics.mul_l(&mut s, &v, &mut u);
        case.dynamics.mul_lt(&mut s, &u, &mut j);
        let momentum = case.mass_matrix() * DVector::from_column_slice(&v);
        assert!(apart(&j, momentum.as_slice()) < 1e-12);
        let (square, twice) = (u.iter().map(|u| u * u).sum::<f64>(), momentum.dot(&DVector::from_column_slice(&v)));
        assert!((square / twice - 1.0).abs() < 1e-12);
    }
}

/// `Y·Yᵀ = J·M⁻¹·Jᵀ` for three axes at a point and three turns of a link, with the Jacobians and
/// the mass matrix from here.
#[test]
fn responses_at_points_are_those_of_jacobian_and_mass_matrix() {
    let (mut random, cases) = all(55);
    for case in cases {
        let dof = case.model.dof();
        let inverse = case.mass_matrix().cholesky().unwrap();
        for _ in 0..5 {
            let (link, arm) = (random.index(case.model.links().len()), random.vector(0.5));
            let origin = case.kin.links()[link].pose.translation.vector;
            let mut six = vec![f64::NAN; 6 * dof];
            let mut three = vec![f64::NAN; 3 * dof];
            link_jacobian(&case.model, &case.kin, link, &mut six);
            point_jacobian(&case.model, &case.kin, link, &(origin + arm), &mut three);
            three.extend(&six[..3 * dof]);
            let jacobian = DMatrix::from_row_slice(6, dof, &three);
            let dense = &jacobian * inverse.solve(&jacobian.transpose());
            let (mut y, axes) = (vec![0.0; 6 * dof], [Vec3::x(), Vec3::y(), Vec3::z()]);
            case.dynamics.point_response(link, &arm, &axes, 1.0, &mut y[..3 * dof]);
            for k in 0..3 {
                case.dynamics.rotation_response(link, &axes[k], 1.0, &mut y[(3 + k) * dof..(4 + k) * dof]);
            }
            let rows = DMatrix::from_row_slice(6, dof, &y);
            assert!(relative((&rows * rows.transpose()).as_slice(), dense.as_slice()) < 1e-10);
        }
    }
}

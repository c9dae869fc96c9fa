//! Laws that inverse dynamics, mass matrix, Jacobians and sums satisfy on any tree, checked by
//! finite differences of poses.

use crate::articulated_random::*;
use nalgebra::{DMatrix, DVector};
use tumble_core::articulated::*;
use tumble_core::collide::{Mat3, Quat, Vec3};
use tumble_core::{Model, Wrench};

const G: Vec3 = Vec3::new(0.3, -0.7, -9.81);

/// A tree with its algorithms, a motion of it and wrenches on its links.
#[derive(Clone)]
struct Case {
    model: Model,
    kin: Kinematics,
    work: InverseDynamics,
    q: Vec<f64>,
    v: Vec<f64>,
    qdd: Vec<f64>,
    wrenches: Vec<Wrench>,
}

fn cases(seed: u64) -> Vec<Case> {
    let mut random = Random(seed ^ 0xabcd);
    let make = |model: Model| {
        let (q, v) = random_state(&mut random, &model, 1.0);
        let qdd = random.numbers(model.dof(), 3.0);
        let wrenches =
            model.links().iter().map(|_| Wrench { torque: random.vector(1.0), force: random.vector(2.0) }).collect();
        let mut kin = Kinematics::new(&model);
        kin.refresh(&model, &q, &v);
        Case { kin, work: InverseDynamics::new(&model), model, q, v, qdd, wrenches }
    };
    random_trees(seed).into_iter().map(make).collect()
}

impl Case {
    /// The kinematics `t` seconds later, on a motion of velocity `v` and acceleration `qdd` (to
    /// second order in `t`).
    fn later(&self, qdd: &[f64], t: f64) -> Kinematics {
        let mean: Vec<f64> = self.v.iter().zip(qdd).map(|(v, a)| v + 0.5 * t * a).collect();
        let end: Vec<f64> = self.v.iter().zip(qdd).map(|(v, a)| v + t * a).collect();
        let mut q = self.q.clone();
        integrate(&self.model, &mut q, &mean, t);
        let mut kin = Kinematics::new(&self.model);
        kin.refresh(&self.model, &q, &end);
        kin
    }

    /// Returns the rate of change of some numbers along that motion: central differences,
    /// extrapolated to fourth order.
    fn rate(&self, qdd: &[f64], read: impl Fn(&Kinematics) -> Vec<f64>) -> Vec<f64> {
        let h = 1e-3;
        let central = |h: f64| {
            let (a, b) = (read(&self.later(qdd, h)), read(&self.later(qdd, -h)));
            a.iter().zip(&b).map(|(a, b)| (a - b) / (2.0 * h)).collect::<Vec<f64>>()
        };
        central(h).iter().zip(central(0.5 * h)).map(|(coarse, fine)| (4.0 * fine - coarse) / 3.0).collect()
    }

    fn mass_matrix(&self) -> DMatrix<f64> {
        let dof = self.model.dof();
        let mut m = vec![f64::NAN; dof * dof];
        MassMatrix::new(&self.model).write(&self.model, &self.kin, &mut m);
        DMatrix::from_row_slice(dof, dof, &m)
    }

    fn torques(&mut self, gravity: &Vec3, qdd: &[f64], wrenches: &[Wrench]) -> Vec<f64> {
        let mut tau = vec![f64::NAN; self.model.dof()];
        self.work.solve(&self.model, &self.kin, gravity, qdd, wrenches, &mut tau);
        tau
    }
}

fn link_rates(kin: &Kinematics) -> Vec<f64> {
    kin.links().iter().flat_map(|l| [l.angular.data.0[0], l.linear.data.0[0]].concat()).collect()
}

fn flat(rates: &[Rates]) -> Vec<f64> {
    rates.iter().flat_map(|r| [r.angular.data.0[0], r.linear.data.0[0]].concat()).collect()
}

fn rotation(kin: &Kinematics, i: usize) -> Mat3 {
    kin.links()[i].pose.rotation.to_rotation_matrix().into_inner()
}

#[test]
fn velocities_of_links_are_the_rates_of_their_poses() {
    for case in cases(1) {
        let still = vec![0.0; case.model.dof()];
        let places = |kin: &Kinematics| {
            kin.links().iter().flat_map(|l| l.pose.translation.vector.data.0[0]).collect::<Vec<f64>>()
        };
        let expected: Vec<f64> = case.kin.links().iter().flat_map(|l| l.linear.data.0[0]).collect();
        assert!(apart(&case.rate(&still, places), &expected) < 1e-9);
        let turns = |kin: &Kinematics| {
            (0..kin.links().len()).flat_map(|i| rotation(kin, i).data.0.concat()).collect::<Vec<f64>>()
        };
        // dR/dt = ω × R
        let expected: Vec<f64> = (0..case.model.links().len())
            .flat_map(|i| (case.kin.links()[i].angular.cross_matrix() * rotation(&case.kin, i)).data.0.concat())
            .collect();
        assert!(apart(&case.rate(&still, turns), &expected) < 1e-9);
    }
}

#[test]
fn bias_accelerations_are_the_rates_of_link_velocities_at_constant_v() {
    for case in cases(2) {
        let mut bias = vec![Rates::zero(); case.model.links().len()];
        case.kin.bias_accelerations(&case.model, &mut bias);
        let still = vec![0.0; case.model.dof()];
        let error = apart(&flat(&bias), &case.rate(&still, link_rates));
        assert!(error < 1e-8, "{} links: {error:e}", case.model.links().len());
    }
}

#[test]
fn accelerations_are_the_rates_of_link_velocities_and_j_qdd_plus_bias() {
    for case in cases(3) {
        let (count, dof) = (case.model.links().len(), case.model.dof());
        let (mut with, mut without) = (vec![Rates::zero(); count], vec![Rates::zero(); count]);
        case.kin.accelerations(&case.model, &case.qdd, &Vec3::zeros(), &mut with);
        case.kin.bias_accelerations(&case.model, &mut without);
        assert!(apart(&flat(&with), &case.rate(&case.qdd, link_rates)) < 1e-8);
        let mut jacobian = vec![f64::NAN; 6 * dof];
        for i in 0..count {
            link_jacobian(&case.model, &case.kin, i, &mut jacobian);
            let sum = DMatrix::from_row_slice(6, dof, &jacobian) * DVector::from_column_slice(&case.qdd)
                + DVector::from_vec(flat(&without[i..=i]));
            assert!(apart(sum.as_slice(), &flat(&with[i..=i])) < 1e-12);
        }
    }
}

/// Jacobians against finite differences: each coordinate is moved alone, and the pose of the link
/// and a point on it are compared.
#[test]
fn jacobians_are_the_derivatives_of_poses() {
    let mut random = Random(44);
    for case in cases(4) {
        let (dof, i) = (case.model.dof(), random.index(case.model.links().len()));
        let (mut six, mut three) = (vec![f64::NAN; 6 * dof], vec![f64::NAN; 3 * dof]);
        let point = random.vector(0.5);
        let here = case.kin.links()[i].pose.transform_point(&point.into()).coords;
        link_jacobian(&case.model, &case.kin, i, &mut six);
        point_jacobian(&case.model, &case.kin, i, &here, &mut three);
        for k in 0..dof {
            let mut unit = Case { v: vec![0.0; dof], ..case.clone() };
            unit.v[k] = 1.0;
            let still = vec![0.0; dof];
            let moved =
                unit.rate(&still, |kin| kin.links()[i].pose.transform_point(&point.into()).coords.data.0[0].to_vec());
            assert!(apart(&column(&three, dof, k), &moved) < 1e-9);
            let origin = unit.rate(&still, |kin| kin.links()[i].pose.translation.vector.data.0[0].to_vec());
            assert!(apart(&column(&six, dof, k)[3..], &origin) < 1e-9);
            let spin = unit.rate(&still, |kin| rotation(kin, i).data.0.concat());
            let w = Mat3::from_column_slice(&spin) * rotation(&case.kin, i).transpose();
            assert!(apart(&column(&six, dof, k)[..3], &[w[(2, 1)], w[(0, 2)], w[(1, 0)]]) < 1e-9);
        }
    }
}

fn column(rows: &[f64], dof: usize, k: usize) -> Vec<f64> {
    rows.iter().skip(k).step_by(dof).copied().collect()
}

/// `½v·Mv` against `Σ ½m|ċ|² + ½ω·I·ω` with `ċ` and `ω` from differences of poses; positive
/// definite by Cholesky.
#[test]
fn the_mass_matrix_is_that_of_the_kinetic_energy() {
    for case in cases(5) {
        let m = case.mass_matrix();
        assert_eq!(m, m.transpose());
        assert!(m.clone().cholesky().is_some());
        let v = DVector::from_column_slice(&case.v);
        let half = 0.5 * (m * &v).dot(&v);
        let still = vec![0.0; case.model.dof()];
        let centers = case.rate(&still, |kin| {
            let place = |(l, k): (&Link, &LinkMotion)| k.pose.transform_point(&l.mass.center.into()).coords.data.0[0];
            case.model.links().iter().zip(kin.links()).flat_map(place).collect()
        });
        let spins =
            case.rate(&still, |kin| (0..kin.links().len()).flat_map(|i| rotation(kin, i).data.0.concat()).collect());
        let mut kinetic = 0.0;
        for (i, link) in case.model.links().iter().enumerate() {
            let turned = rotation(&case.kin, i).transpose() * Mat3::from_column_slice(&spins[9 * i..]);
            let w = Vec3::new(turned[(2, 1)], turned[(0, 2)], turned[(1, 0)]);
            kinetic += 0.5 * link.mass.mass * Vec3::from_column_slice(&centers[3 * i..]).norm_squared()
                + 0.5 * w.dot(&(link.mass.inertia * w));
        }
        assert!((half / kinetic - 1.0).abs() < 1e-9, "{half} {kinetic}");
        let recorded = energy(&case.model, &case.kin, &G).kinetic;
        assert!((recorded / half - 1.0).abs() < 1e-12, "{recorded} {half}");
    }
}

#[test]
fn inverse_dynamics_is_the_mass_matrix_times_acceleration_plus_bias() {
    for mut case in cases(6) {
        let (qdd, wrenches) = (case.qdd.clone(), case.wrenches.clone());
        let whole = case.torques(&G, &qdd, &wrenches);
        let mut bias = vec![f64::NAN; case.model.dof()];
        case.work.bias(&case.model, &case.kin, &G, &wrenches, &mut bias);
        let sum = case.mass_matrix() * DVector::from_column_slice(&qdd) + DVector::from_vec(bias);
        assert!(relative(sum.as_slice(), &whole) < 1e-13);
    }
}

/// Wrenches change the generalized forces by `−Jᵀ` times them.
#[test]
fn wrenches_act_through_the_transposed_jacobians() {
    for mut case in cases(7) {
        let (qdd, wrenches, dof) = (case.qdd.clone(), case.wrenches.clone(), case.model.dof());
        let mut sum = DVector::from_vec(case.torques(&G, &qdd, &[]));
        let mut jacobian = vec![f64::NAN; 6 * dof];
        for (i, wrench) in wrenches.iter().enumerate() {
            link_jacobian(&case.model, &case.kin, i, &mut jacobian);
            let both = DVector::from_iterator(6, wrench.torque.iter().chain(wrench.force.iter()).copied());
            sum -= DMatrix::from_row_slice(6, dof, &jacobian).transpose() * both;
        }
        assert!(apart(&case.torques(&G, &qdd, &wrenches), sum.as_slice()) < 1e-13);
    }
}

/// Power: along the motion that the torques hold, `dE/dt = τ·v + (wrenches on their links)`.
#[test]
fn energy_changes_by_the_power_of_the_torques() {
    for mut case in cases(8) {
        let (qdd, wrenches) = (case.qdd.clone(), case.wrenches.clone());
        let tau = case.torques(&G, &qdd, &wrenches);
        let mut power: f64 = tau.iter().zip(&case.v).map(|(t, v)| t * v).sum();
        power += case
            .kin
            .links()
            .iter()
            .zip(&wrenches)
            .map(|(l, w)| l.angular.dot(&w.torque) + l.linear.dot(&w.force))
            .sum::<f64>();
        let rate = case.rate(&qdd, |kin| vec![energy(&case.model, kin, &G).total()]);
        assert!(apart(&[power], &rate) < 1e-8, "{power} {}", rate[0]);
    }
}

/// Newton's and Euler's equations of the whole tree: momentum changes by gravity, the wrenches, and
/// the forces through the roots.
#[test]
fn momentum_changes_by_what_acts_from_outside() {
    for mut case in cases(9) {
        let (qdd, wrenches) = (case.qdd.clone(), case.wrenches.clone());
        case.torques(&G, &qdd, &wrenches);
        let (mut force, mut torque) = (Vec3::zeros(), Vec3::zeros());
        let mut act = |at: &Vec3, f: &Vec3, n: &Vec3| {
            force += f;
            torque += n + at.cross(f);
        };
        for (i, link) in case.model.links().iter().enumerate() {
            let pose = &case.kin.links()[i].pose;
            act(&pose.transform_point(&link.mass.center.into()).coords, &(link.mass.mass * G), &Vec3::zeros());
            act(&pose.translation.vector, &wrenches[i].force, &wrenches[i].torque);
            if link.parent.is_none() {
                let through = case.work.joint_loads()[i];
                act(&pose.translation.vector, &through.force, &through.torque);
            }
        }
        let rate = case.rate(&qdd, |kin| {
            let p = momentum(&case.model, kin);
            [p.linear.data.0[0], p.angular.data.0[0]].concat()
        });
        assert!(apart(&[force.data.0[0], torque.data.0[0]].concat(), &rate) < 1e-8);
    }
}

#[test]
fn the_center_of_mass_moves_with_its_velocity_and_carries_the_linear_momentum() {
    for case in cases(10) {
        let (_, velocity) = center_of_mass(&case.model, &case.kin).unwrap();
        let rate = case.rate(&vec![0.0; case.model.dof()], |kin| {
            let mass: f64 = case.model.links().iter().map(|l| l.mass.mass).sum();
            let weigh = |(l, k): (&Link, &LinkMotion)| {
                l.mass.mass / mass * k.pose.transform_point(&l.mass.center.into()).coords
            };
            case.model.links().iter().zip(kin.links()).map(weigh).sum::<Vec3>().data.0[0].to_vec()
        });
        assert!(apart(velocity.as_slice(), &rate) < 1e-9);
        assert!(
            (momentum(&case.model, &case.kin).linear - case.model.mass() * velocity).norm() < 1e-12 * case.model.mass()
        );
    }
}

#[test]
fn the_torque_of_gravity_is_the_slope_of_the_potential() {
    for mut case in cases(11) {
        let dof = case.model.dof();
        case.v = vec![0.0; dof];
        case.kin.refresh(&case.model, &case.q, &case.v);
        let tau = case.torques(&G, &[], &[]);
        for k in 0..dof {
            case.v = vec![0.0; dof];
            case.v[k] = 1.0;
            let slope = case.rate(&vec![0.0; dof], |kin| vec![energy(&case.model, kin, &G).potential]);
            assert!(
                (tau[k] - slope[0]).abs() < 1e-8 * tau.iter().fold(1.0f64, |m, t| m.max(t.abs())),
                "{k}: {} {}",
                tau[k],
                slope[0]
            );
        }
    }
}

/// `exp` by its series on matrices, independent of quaternions.
fn exponential(w: Vec3) -> Mat3 {
    let (x, mut term, mut sum) = (w.cross_matrix(), Mat3::identity(), Mat3::identity());
    for k in 1..60 {
        term = term * x / k as f64;
        sum += term;
    }
    sum
}

#[test]
fn positions_integrate_along_the_exponential_of_a_constant_turn() {
    let mut random = Random(12);
    for case in cases(12) {
        let v = random.numbers(case.model.dof(), 2.0);
        let mut q = case.q.clone();
        integrate(&case.model, &mut q, &v, 0.7);
        for link in case.model.links() {
            let Some(k) = link.joint.quaternion() else { continue };
            let turn = |q: &[f64]| {
                let x = &q[link.q + k..];
                Quat::from_quaternion(nalgebra::Quaternion::new(x[3], x[0], x[1], x[2]))
                    .to_rotation_matrix()
                    .into_inner()
            };
            let w = Vec3::from_column_slice(&v[link.v..]) * 0.7;
            let expected = if k == 0 { turn(&case.q) * exponential(w) } else { exponential(w) * turn(&case.q) };
            assert!((turn(&q) - expected).norm() < 1e-13);
            assert!((q[link.q + k..link.q + k + 4].iter().map(|x| x * x).sum::<f64>() - 1.0).abs() < 1e-15);
        }
        // back to the start, and the velocity that leads from one to the other
        let mut back = vec![f64::NAN; case.model.dof()];
        difference(&case.model, &case.q, &q, &mut back);
        assert!(apart(&back, &v.iter().map(|v| 0.7 * v).collect::<Vec<f64>>()) < 1e-13);
        let mut start = q.clone();
        integrate(&case.model, &mut start, &back, -1.0);
        let same = |(a, b): (&f64, &f64)| (a - b).abs();
        let flipped = |(a, b): (&f64, &f64)| (a + b).abs();
        assert!(start.iter().zip(&case.q).map(|p| same(p).min(flipped(p))).fold(0.0, f64::max) < 1e-13);
    }
}

/// Differences take the shorter way: half-turns are its limit, and opposite quaternions are the
/// same rotation.
#[test]
fn a_difference_goes_the_short_way_round() {
    let mut builder = tumble_core::ModelBuilder::new();
    builder.link("ball", None, tumble_core::Joint::Spherical, tumble_core::collide::Pose::identity(), Random(1).mass());
    let model = builder.build().unwrap();
    let at = |angle: f64, sign: f64| [0.0, 0.0, sign * (0.5 * angle).sin(), sign * (0.5 * angle).cos()];
    for (angle, sign) in [(0.0, -1.0), (1e-9, 1.0), (1e-9, -1.0), (2.0, -1.0), (3.1, 1.0), (3.1, -1.0), (-3.1, -1.0)] {
        let mut v = [f64::NAN; 3];
        difference(&model, &at(0.0, 1.0), &at(angle, sign), &mut v);
        assert!((v[2] - angle).abs() < 1e-14 && v[0] == 0.0 && v[1] == 0.0, "{angle} {sign}: {v:?}");
    }
}

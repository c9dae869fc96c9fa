//! Inverse dynamics against equations of motion written by hand.

use crate::articulated_random::*;
use nalgebra::DVector;
use tumble_core::articulated::*;
use tumble_core::collide::{Mat3, Pose, Quat, Vec3};
use tumble_core::{Joint, LinkMass, Model, ModelBuilder, Wrench};

const G: f64 = 9.81;
const DOWN: Vec3 = Vec3::new(0.0, 0.0, -G);

fn torques(model: &Model, gravity: &Vec3, q: &[f64], v: &[f64], qdd: &[f64]) -> Vec<f64> {
    let (mut kin, mut work) = (Kinematics::new(model), InverseDynamics::new(model));
    let mut tau = vec![f64::NAN; model.dof()];
    inverse_dynamics(model, (&mut kin, &mut work), gravity, q, v, qdd, &[], &mut tau);
    tau
}

fn one(joint: Joint, placement: Pose, mass: LinkMass) -> Model {
    let mut builder = ModelBuilder::new();
    builder.link("link", None, joint, placement, mass);
    builder.build().unwrap()
}

/// `τ = (ml² + I)·q̈ + mgl·sin q`.
#[test]
fn a_pendulum_takes_the_torque_of_its_equation() {
    let (m, l, i) = (2.0, 0.7, 0.3);
    let rod =
        LinkMass { mass: m, center: Vec3::new(0.0, 0.0, -l), inertia: Mat3::from_diagonal(&Vec3::new(0.1, i, 0.2)) };
    let model = one(Joint::revolute(Vec3::new(0.0, 5.0, 0.0)), Pose::translation(3.0, -1.0, 2.0), rod);
    for (q, v, a) in [(0.0f64, 0.0, 0.0), (0.4, 1.0, -2.0), (2.9, -7.0, 3.0)] {
        let tau = torques(&model, &DOWN, &[q], &[v], &[a]);
        assert!((tau[0] - ((m * l * l + i) * a + m * G * l * q.sin())).abs() < 1e-13, "{}", tau[0]);
    }
}

/// Lagrange's equations of the double pendulum in its absolute angles θ; ours are θ₁ and θ₂ − θ₁.
#[test]
fn a_double_pendulum_takes_the_torques_of_its_equations() {
    let (m1, m2, l1, l2) = (1.3, 0.6, 0.5, 0.8);
    let mut builder = ModelBuilder::new();
    let bob = |m, l: f64| LinkMass::point(m, Vec3::new(0.0, 0.0, -l));
    let upper = builder.link("upper", None, Joint::revolute(Vec3::y()), Pose::identity(), bob(m1, l1));
    builder.link("lower", Some(upper), Joint::revolute(Vec3::y()), Pose::translation(0.0, 0.0, -l1), bob(m2, l2));
    let model = builder.build().unwrap();
    let mut random = Random(5);
    for _ in 0..50 {
        let (t, w, a) = (random.numbers(2, 3.0), random.numbers(2, 4.0), random.numbers(2, 10.0));
        let (s, c) = (t[0] - t[1]).sin_cos();
        let couple = m2 * l1 * l2;
        let q1 = (m1 + m2) * l1 * l1 * a[0] + couple * (c * a[1] + s * w[1] * w[1]) + (m1 + m2) * G * l1 * t[0].sin();
        let q2 = m2 * l2 * l2 * a[1] + couple * (c * a[0] - s * w[0] * w[0]) + m2 * G * l2 * t[1].sin();
        let relative = |x: &[f64]| [x[0], x[1] - x[0]];
        let tau = torques(&model, &DOWN, &relative(&t), &relative(&w), &relative(&a));
        assert!(apart(&tau, &[q1 + q2, q2]) < 1e-14, "{tau:?}");
    }
}

/// A bead on a turning rod: `F = m(r̈ − rΩ²)`, `τ = mr²·Ω̇ + 2mrṙΩ`.
#[test]
fn a_slider_on_a_turntable_feels_centrifugal_and_coriolis_forces() {
    let m = 1.7;
    let mut builder = ModelBuilder::new();
    let table = builder.link("table", None, Joint::revolute(Vec3::z()), Pose::identity(), LinkMass::none());
    builder.link("bead", Some(table), Joint::prismatic(Vec3::x()), Pose::identity(), LinkMass::point(m, Vec3::zeros()));
    let model = builder.build().unwrap();
    let mut random = Random(6);
    for _ in 0..20 {
        let (q, v, a) = (random.numbers(2, 2.0), random.numbers(2, 3.0), random.numbers(2, 5.0));
        let tau = torques(&model, &DOWN, &q, &v, &a);
        let expected = [m * q[1] * q[1] * a[0] + 2.0 * m * q[1] * v[1] * v[0], m * (a[1] - q[1] * v[0] * v[0])];
        assert!(apart(&tau, &expected) < 1e-14, "{tau:?} {expected:?}");
    }
}

/// `F = m(q̈ + g·sin β)` up a slope.
#[test]
fn a_slider_on_a_slope_carries_its_share_of_the_weight() {
    let (m, slope) = (2.5, 0.35f64);
    let up = Vec3::new(slope.cos(), 0.0, slope.sin());
    let model = one(Joint::prismatic(up), Pose::identity(), LinkMass::point(m, Vec3::new(0.1, 0.2, 0.3)));
    let tau = torques(&model, &DOWN, &[0.4], &[-3.0], &[1.5]);
    assert!((tau[0] - m * (1.5 + G * slope.sin())).abs() < 1e-13);
}

/// Steady precession: `mgl = I₃·ω₃·Ω − I₁·Ω²·cos θ` (moments about the pivot) holds the top by
/// gravity alone; without gravity the pivot must supply that torque along the line of nodes.
#[test]
fn a_top_precesses_steadily_without_torque() {
    let (m, l, i1, i3, tilt, precession) = (0.5, 0.06, 4e-3, 1e-3, 0.6f64, 2.0);
    let about_center = Vec3::new(i1 - m * l * l, i1 - m * l * l, i3);
    let top = LinkMass { mass: m, center: Vec3::new(0.0, 0.0, l), inertia: Mat3::from_diagonal(&about_center) };
    let model = one(Joint::Spherical, Pose::identity(), top);
    let spin_total = (m * G * l + i1 * precession * precession * tilt.cos()) / (i3 * precession);
    let spin = spin_total - precession * tilt.cos();
    for (azimuth, phase) in [(0.0, 0.0), (0.9, 2.2), (-2.0, 5.0f64)] {
        let turn = Quat::from_scaled_axis(Vec3::z() * azimuth)
            * Quat::from_scaled_axis(Vec3::y() * tilt)
            * Quat::from_scaled_axis(Vec3::z() * phase);
        let (s, c) = phase.sin_cos();
        let across = precession * tilt.sin();
        // Body components of the angular velocity and their rates, from R = Rz(Ωt)·Ry(θ)·Rz(ψt).
        let v = [-across * c, across * s, spin_total];
        let a = [across * spin * s, across * spin * c, 0.0];
        let q = turn.coords.data.0[0];
        let tau = torques(&model, &DOWN, &q, &v, &a);
        // To rounding of I₃·ω₃², 23 N·m.
        assert!(tau.iter().all(|t| t.abs() < 1e-13), "{tau:?}");
        let free = turn * Vec3::from_vec(torques(&model, &Vec3::zeros(), &q, &v, &a));
        let nodes = Vec3::new(-azimuth.sin(), azimuth.cos(), 0.0);
        assert!((free - nodes * (m * G * l * tilt.sin())).norm() < 1e-13, "{free:?}");
    }
}

/// Newton and Euler of a free body whose frame is not at its center of mass.
#[test]
fn a_floating_link_is_a_rigid_body() {
    let mut random = Random(8);
    let body = random.mass();
    let model = one(Joint::Floating, random.pose(1.0), body);
    for _ in 0..20 {
        let (q, v) = random_state(&mut random, &model, 3.0);
        let a = random.numbers(6, 5.0);
        let r =
            Quat::from_quaternion(nalgebra::Quaternion::new(q[6], q[3], q[4], q[5])).to_rotation_matrix().into_inner();
        let (w, dw, dv) = (Vec3::from_column_slice(&v), Vec3::from_column_slice(&a), Vec3::from_column_slice(&a[3..]));
        let (c, inertia) = (r * body.center, r * body.inertia * r.transpose());
        let force = body.mass * (dv + dw.cross(&c) + w.cross(&w.cross(&c)) - DOWN);
        let torque = inertia * dw + w.cross(&(inertia * w)) + c.cross(&force);
        let tau = torques(&model, &DOWN, &q, &v, &a);
        assert!(apart(&tau, &[torque.data.0[0], force.data.0[0]].concat()) < 1e-14);
    }
}

/// Weight of a tree held still: force through the root joint `−mg`, torque about the root `−Σ
/// c×mg`.
#[test]
fn a_held_tree_hangs_on_its_root() {
    let mut random = Random(9);
    let model = random_tree(&mut random, 30, false, Kinds::All);
    let (q, _) = random_state(&mut random, &model, 0.0);
    let (mut kin, mut work) = (Kinematics::new(&model), InverseDynamics::new(&model));
    kin.refresh(&model, &q, &vec![0.0; model.dof()]);
    work.bias(&model, &kin, &DOWN, &[], &mut vec![0.0; model.dof()]);
    let root = work.joint_loads()[0];
    let (center, _) = center_of_mass(&model, &kin).unwrap();
    let arm = center - kin.links()[0].pose.translation.vector;
    assert!((root.force + model.mass() * DOWN).norm() < 1e-12 * model.mass());
    assert!((root.torque + arm.cross(&(model.mass() * DOWN))).norm() < 1e-12 * model.mass());
}

/// A fixed link has the same weight as one on a revolute joint that is held.
#[test]
fn a_folded_link_is_a_hinged_one_that_does_not_turn() {
    let mut random = Random(10);
    let (poses, masses) =
        ([random.pose(0.5), random.pose(0.5), random.pose(0.5)], [random.mass(), random.mass(), random.mass()]);
    let build = |middle: Joint| {
        let mut builder = ModelBuilder::new();
        let a = builder.link("a", None, Joint::Spherical, poses[0], masses[0]);
        let b = builder.link("b", Some(a), middle, poses[1], masses[1]);
        builder.link("c", Some(b), Joint::prismatic(Vec3::x()), poses[2], masses[2]);
        builder.build().unwrap()
    };
    let (folded, hinged) = (build(Joint::Fixed), build(Joint::revolute(Vec3::z())));
    let (q, v) = random_state(&mut random, &folded, 2.0);
    let a = random.numbers(4, 3.0);
    let with = |x: &[f64], at: usize| [&x[..at], &[0.0], &x[at..]].concat();
    let tau = torques(&folded, &DOWN, &q, &v, &a);
    let longer = torques(&hinged, &DOWN, &with(&q, 4), &with(&v, 3), &with(&a, 3));
    assert!(apart(&tau, &[&longer[..3], &longer[4..]].concat()) < 1e-14);
    let (mut kin, mut other) = (Kinematics::new(&folded), Kinematics::new(&hinged));
    kin.refresh(&folded, &q, &v);
    other.refresh(&hinged, &with(&q, 4), &with(&v, 3));
    let (mine, its) = (kin.frame_pose(folded.frame("b").unwrap()), other.links()[1].pose);
    assert!((mine.to_homogeneous() - its.to_homogeneous()).norm() < 1e-14);
}

/// The mass matrix of a chain of three parallel prismatic joints equals Newton's equations by hand.
#[test]
fn stacked_sliders_have_a_mass_matrix_of_partial_sums() {
    let mut builder = ModelBuilder::new();
    let mut parent = None;
    for (k, m) in [1.0, 2.0, 4.0].into_iter().enumerate() {
        parent = Some(builder.link(
            format!("{k}"),
            parent,
            Joint::prismatic(Vec3::x()),
            Pose::translation(0.0, 0.3, 0.0),
            LinkMass::point(m, Vec3::y()),
        ));
    }
    let model = builder.build().unwrap();
    let mut m = [f64::NAN; 9];
    let kin = Kinematics::new(&model);
    MassMatrix::new(&model).write(&model, &kin, &mut m);
    assert_eq!(m, [7.0, 6.0, 4.0, 6.0, 6.0, 4.0, 4.0, 4.0, 4.0]);
}

/// A force on a link is held by the torques that virtual work gives: a planar arm pulled at its
/// end.
#[test]
fn a_pulled_arm_needs_the_moments_of_the_pull() {
    let mut builder = ModelBuilder::new();
    let light = LinkMass::point(1.0, Vec3::zeros());
    let a = builder.link("a", None, Joint::revolute(Vec3::z()), Pose::identity(), light);
    let b = builder.link("b", Some(a), Joint::revolute(Vec3::z()), Pose::translation(0.4, 0.0, 0.0), light);
    builder.link("hand", Some(b), Joint::revolute(Vec3::z()), Pose::translation(0.3, 0.0, 0.0), light);
    let model = builder.build().unwrap();
    let (mut kin, mut work) = (Kinematics::new(&model), InverseDynamics::new(&model));
    let (q, pull) = ([0.5, -1.1, 0.2], Vec3::new(2.0, 3.0, -1.0));
    kin.refresh(&model, &q, &[0.0; 3]);
    let mut wrenches = [Wrench::default(); 3];
    wrenches[2] = Wrench { torque: Vec3::new(0.0, 0.0, 0.7), force: pull };
    let mut tau = [f64::NAN; 3];
    work.bias(&model, &kin, &Vec3::zeros(), &wrenches, &mut tau);
    let elbow = Vec3::new(0.4 * 0.5f64.cos(), 0.4 * 0.5f64.sin(), 0.0);
    let hand = elbow + Vec3::new(0.3 * (-0.6f64).cos(), 0.3 * (-0.6f64).sin(), 0.0);
    let moment = |from: Vec3| -(hand - from).cross(&pull).z - 0.7;
    assert!(
        (DVector::from_row_slice(&tau) - DVector::from_row_slice(&[moment(Vec3::zeros()), moment(elbow), -0.7])).norm()
            < 1e-15
    );
}

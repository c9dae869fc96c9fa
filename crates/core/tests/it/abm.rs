//! The articulated-body kernel against dense mechanics and closed forms.

use crate::abm_reference::{
    Kinds, Numbers, bias, drift, jacobian, mass_matrix, moved, poses, random_state, random_tree,
};
use nalgebra::{Cholesky, DMatrix, DVector};
use tumble_core::articulated::{BatchDynamics, Dynamics, Lanes, SingularJoint, forward_dynamics};
use tumble_core::collide::{Mat3, Pose, Vec3};
use tumble_core::{Joint, LinkMass, Model, ModelBuilder, Wrench};

/// Sizes and seeds of the random trees.
const TREES: [(usize, u64); 9] = [(1, 1), (1, 5), (2, 2), (3, 3), (7, 4), (12, 5), (25, 6), (50, 7), (100, 8)];

fn trees() -> impl Iterator<Item = (Model, u64)> {
    TREES
        .iter()
        .flat_map(|&(links, seed)| [Kinds::Hinges, Kinds::All].map(|kinds| (random_tree(links, kinds, seed), seed)))
}

fn refreshed(model: &Model, seed: u64) -> (Dynamics, Vec<f64>, Vec<f64>) {
    let (q, v) = random_state(model, seed);
    let mut d = Dynamics::new(model);
    d.refresh(&q, &v);
    assert_eq!(d.singular(), None);
    (d, q, v)
}

fn close(what: &str, a: &DMatrix<f64>, b: &DMatrix<f64>, tolerance: f64) {
    let error = (a - b).amax() / b.amax().max(1e-300);
    assert!(error < tolerance, "{what}: relative error {error:e}");
}

/// The matrix of a linear map of `n` numbers.
fn matrix(n: usize, mut map: impl FnMut(&[f64], &mut [f64])) -> DMatrix<f64> {
    let mut m = DMatrix::zeros(n, n);
    for k in 0..n {
        let mut e = vec![0.0; n];
        e[k] = 1.0;
        map(&e, m.column_mut(k).as_mut_slice());
    }
    m
}

#[test]
fn accelerations_balance_the_dense_equations_of_motion() {
    for (model, seed) in trees() {
        let (d, q, v) = refreshed(&model, seed);
        let mut n = Numbers::new(seed + 100);
        let (tau, gravity) = (n.list(d.dof(), 3.0), 9.81 * n.vector());
        let wrenches: Vec<Wrench> =
            (0..d.links()).map(|_| Wrench { torque: n.vector(), force: 4.0 * n.vector() }).collect();
        let mut qdd = vec![0.0; d.dof()];
        d.accelerate_in(&mut d.scratch(), &gravity, &tau, &wrenches, &mut qdd);
        let inertial = mass_matrix(&model, &q) * DVector::from_vec(qdd);
        let bias = bias(&model, &q, &v, &gravity, &wrenches);
        let rest = &inertial + &bias - DVector::from_vec(tau);
        let size = inertial.amax().max(bias.amax());
        assert!(rest.amax() < 1e-10 * size, "{} links: {:e}", d.links(), rest.amax() / size);
    }
}

#[test]
fn one_pass_agrees_with_refresh_and_accelerate() {
    for (model, seed) in trees() {
        let (d, q, v) = refreshed(&model, seed);
        let tau = Numbers::new(seed + 7).list(d.dof(), 3.0);
        let gravity = Vec3::new(0.3, -0.2, -9.81);
        let (mut a, mut b) = (vec![0.0; d.dof()], vec![0.0; d.dof()]);
        d.accelerate_in(&mut d.scratch(), &gravity, &tau, &[], &mut a);
        forward_dynamics(&mut d.clone(), &gravity, &q, &v, &tau, &mut b).unwrap();
        let size = a.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        assert!(a.iter().zip(&b).all(|(a, b)| (a - b).abs() < 1e-11 * size), "{} links", d.links());
    }
}

#[test]
fn uniform_gravity_is_a_wrench_on_every_link() {
    for (model, seed) in trees() {
        let (d, q, _) = refreshed(&model, seed);
        let gravity = Vec3::new(1.0, 2.0, -9.0);
        let poses = poses(&model, &q);
        let weights: Vec<Wrench> = model
            .links()
            .iter()
            .zip(&poses)
            .map(|(link, pose)| {
                let force = link.mass.mass * gravity;
                Wrench { torque: (pose.rotation * link.mass.center).cross(&force), force }
            })
            .collect();
        let tau = vec![0.0; d.dof()];
        let (mut a, mut b) = (vec![0.0; d.dof()], vec![0.0; d.dof()]);
        d.accelerate_in(&mut d.scratch(), &gravity, &tau, &[], &mut a);
        d.accelerate(&mut d.scratch(), &tau, &weights, &mut b);
        let size = a.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        assert!(a.iter().zip(&b).all(|(a, b)| (a - b).abs() < 1e-10 * size), "{} links", d.links());
    }
}

#[test]
fn poses_velocities_and_accelerations_of_links() {
    for (model, seed) in trees() {
        let (d, q, v) = refreshed(&model, seed);
        let poses = poses(&model, &q);
        let qdd = Numbers::new(seed + 9).list(d.dof(), 2.0);
        let mut found = vec![(Vec3::zeros(), Vec3::zeros()); d.links()];
        d.link_accelerations(&qdd, &mut found);
        for i in 0..d.links() {
            let pose = d.link_pose(i);
            assert!((pose.translation.vector - poses[i].translation.vector).norm() < 1e-12);
            let turned =
                pose.rotation.to_rotation_matrix().into_inner() - poses[i].rotation.to_rotation_matrix().into_inner();
            assert!(turned.amax() < 1e-12);
            let j = jacobian(&model, &poses, i, &Vec3::zeros());
            let velocity = &j * DVector::from_column_slice(&v);
            let (angular, linear) = d.link_velocity(i);
            assert!(
                (angular - velocity.fixed_rows::<3>(0)).norm() < 1e-11
                    && (linear - velocity.fixed_rows::<3>(3)).norm() < 1e-11
            );
            let a = &j * DVector::from_column_slice(&qdd) + drift(&model, &q, &v, i, &Vec3::zeros());
            let size = a.amax().max(1.0);
            assert!((found[i].0 - a.fixed_rows::<3>(0)).norm() < 1e-10 * size, "{i}: {:?} {a}", found[i]);
            assert!((found[i].1 - a.fixed_rows::<3>(3)).norm() < 1e-10 * size, "{i}: {:?} {a}", found[i]);
        }
    }
}

#[test]
fn the_root_of_the_mass_matrix_is_one() {
    for (model, seed) in trees() {
        let (d, q, _) = refreshed(&model, seed);
        let (n, mut s, dense) = (d.dof(), d.scratch(), mass_matrix(&model, &q));
        let l = matrix(n, |v, u| d.mul_l(&mut s, v, u));
        close("LᵀL = M", &(l.transpose() * &l), &dense, 1e-12);
        let transposed = matrix(n, |u, j| d.mul_lt(&mut s, u, j));
        close("mul_lt is Lᵀ", &transposed, &l.transpose(), 1e-12);
        let inverse = matrix(n, |u, v| d.solve_l(&mut s, u, v));
        close("solve_l is L⁻¹", &(&inverse * &l), &DMatrix::identity(n, n), 1e-10);
        let response = matrix(n, |j, y| d.solve_lt(&mut s, j, y));
        close("solve_lt is L⁻ᵀ", &response, &inverse.transpose(), 1e-12);
    }
}

#[test]
fn probes_of_every_kind_see_the_dense_response() {
    for (model, seed) in trees() {
        let (d, q, _) = refreshed(&model, seed);
        let mut n = Numbers::new(seed + 31);
        let poses = poses(&model, &q);
        let mut dense: Vec<DVector<f64>> = Vec::new();
        let mut rows: Vec<Vec<f64>> = Vec::new();
        for _ in 0..6 {
            let (link, other) = (n.below(d.links()), n.below(d.links()));
            let (point, axes) = (0.3 * n.vector(), [n.vector(), n.vector(), n.vector(), n.vector()]);
            // a point of one link against a point of another, along four directions
            let mut y = vec![0.0; 4 * d.dof()];
            d.point_response(link, &(poses[link].rotation * point), &axes, 1.0, &mut y);
            d.point_response(other, &(poses[other].rotation * -point), &axes, -1.0, &mut y);
            rows.extend(y.chunks(d.dof()).map(|row| row.to_vec()));
            let j = jacobian(&model, &poses, link, &point) - jacobian(&model, &poses, other, &-point);
            dense.extend(axes.iter().map(|n| j.rows(3, 3).transpose() * n));
            // the rotation of a link, and a single joint
            let mut y = vec![0.0; d.dof()];
            d.rotation_response(link, &axes[0], 0.5, &mut y);
            rows.push(y.clone());
            dense.push(0.5 * jacobian(&model, &poses, link, &point).rows(0, 3).transpose() * axes[0]);
            let mut unit = DVector::zeros(d.dof());
            unit[n.below(d.dof())] = 1.0;
            d.solve_lt(&mut d.scratch(), unit.as_slice(), &mut y);
            rows.push(y);
            dense.push(unit);
        }
        let y = DMatrix::from_fn(rows.len(), d.dof(), |i, k| rows[i][k]);
        let j = DMatrix::from_fn(rows.len(), d.dof(), |i, k| dense[i][k]);
        let mass = Cholesky::new(mass_matrix(&model, &q)).unwrap();
        let inverse = mass.solve(&j.transpose());
        close("Y Yᵀ = J M⁻¹ Jᵀ", &(&y * y.transpose()), &(&j * &inverse), 1e-10);
        let lambda = DVector::from_vec(n.list(rows.len(), 1.0));
        let mut dv = DVector::zeros(d.dof());
        d.solve_l(&mut d.scratch(), (y.transpose() * &lambda).as_slice(), dv.as_mut_slice());
        let wanted = inverse * lambda;
        let error = (&dv - &wanted).amax() / wanted.amax();
        assert!(error < 1e-10, "Δv = M⁻¹Jᵀλ, {} links: {error:e}", d.links());
    }
}

#[test]
fn a_response_stays_on_the_path_to_the_root() {
    let mut builder = ModelBuilder::new();
    let mut n = Numbers::new(3);
    let root = builder.link("root", None, Joint::Floating, Pose::identity(), n.mass());
    let mut leaf = |name: &str| {
        let (axis, placement, mass) = (n.vector(), n.pose(0.3), n.mass());
        builder.link(name, Some(root), Joint::revolute(axis), placement, mass)
    };
    let (left, right) = (leaf("left"), leaf("right"));
    let model = builder.build().unwrap();
    let (d, ..) = refreshed(&model, 2);
    let mut y = vec![0.0; d.dof()];
    d.point_response(left, &Vec3::x(), &[Vec3::new(1.0, 2.0, 3.0)], 1.0, &mut y);
    assert_eq!(y[model.links()[right].v], 0.0);
    assert!(y[model.links()[left].v].abs() > 1e-3 && y[..6].iter().all(|x| x.abs() > 1e-6));
}

#[test]
fn a_rod_swings_as_the_closed_form_says() {
    // I q̈ = −m g (l/2) sin q with I = m l²/3.
    let (mass, length) = (2.0, 0.8);
    let moment = mass * length * length / 12.0;
    let rod = LinkMass {
        mass,
        center: Vec3::new(0.0, 0.0, -0.5 * length),
        inertia: Mat3::from_diagonal(&Vec3::new(moment, moment, 0.0)),
    };
    let mut builder = ModelBuilder::new();
    builder.link("rod", None, Joint::revolute(Vec3::y()), Pose::translation(0.0, 0.0, 3.0), rod);
    let model = builder.build().unwrap();
    let mut d = Dynamics::new(&model);
    for q in [-2.5, -0.3, 0.0, 0.7, 3.0] {
        let mut qdd = [0.0];
        forward_dynamics(&mut d, &Vec3::new(0.0, 0.0, -9.81), &[q], &[5.0], &[0.0], &mut qdd).unwrap();
        assert!((qdd[0] + 1.5 * 9.81 / length * f64::sin(q)).abs() < 1e-12, "{q}: {qdd:?}");
    }
}

#[test]
fn a_free_top_obeys_euler() {
    let moments = Vec3::new(1.0, 2.0, 3.0);
    let top = LinkMass { mass: 4.0, center: Vec3::zeros(), inertia: Mat3::from_diagonal(&moments) };
    let mut builder = ModelBuilder::new();
    builder.link("top", None, Joint::Floating, Pose::identity(), top);
    let model = builder.build().unwrap();
    let (omega, mut qdd) = (Vec3::new(0.3, -2.0, 1.1), [0.0; 6]);
    let v = [omega.x, omega.y, omega.z, 1.0, 2.0, 3.0];
    forward_dynamics(
        &mut Dynamics::new(&model),
        &-Vec3::z(),
        &[5.0, 6.0, 7.0, 0.0, 0.0, 0.0, 1.0],
        &v,
        &[0.0; 6],
        &mut qdd,
    )
    .unwrap();
    let wanted = -omega.cross(&moments.component_mul(&omega)).component_div(&moments);
    assert!((Vec3::new(qdd[0], qdd[1], qdd[2]) - wanted).norm() < 1e-14);
    assert!((Vec3::new(qdd[3], qdd[4], qdd[5]) + Vec3::z()).norm() < 1e-14);
}

/// A stack of three revolute joints, of which only the last link has mass. With the middle one at
/// 90 degrees, the first and the last have the same axis.
fn gimbal() -> Model {
    let mut builder = ModelBuilder::new();
    let outer = builder.link("yaw", None, Joint::revolute(Vec3::z()), Pose::identity(), LinkMass::none());
    let middle = builder.link("pitch", Some(outer), Joint::revolute(Vec3::y()), Pose::identity(), LinkMass::none());
    let body = LinkMass {
        mass: 1.0,
        center: Vec3::new(0.1, 0.0, 0.2),
        inertia: Mat3::from_diagonal(&Vec3::new(0.1, 0.2, 0.3)),
    };
    builder.link("roll", Some(middle), Joint::revolute(Vec3::x()), Pose::identity(), body);
    builder.build().unwrap()
}

#[test]
fn gimbal_lock_is_named_and_finite() {
    let model = gimbal();
    let mut d = Dynamics::new(&model);
    let (mut s, v) = (d.scratch(), [1.0, -2.0, 3.0]);
    for (pitch, singular) in [(0.0, false), (1.5, false), (1.57, false), (std::f64::consts::FRAC_PI_2, true)] {
        d.refresh(&[0.3, pitch, -0.7], &v);
        assert_eq!(d.singular(), singular.then_some(0), "pitch {pitch}");
        let (mut qdd, mut u, mut y, mut w) = ([f64::NAN; 3], [f64::NAN; 3], [f64::NAN; 3], [f64::NAN; 3]);
        d.accelerate_in(&mut s, &-Vec3::z(), &[0.1, 0.2, 0.3], &[], &mut qdd);
        d.mul_l(&mut s, &v, &mut u);
        d.solve_l(&mut s, &v, &mut w);
        d.solve_lt(&mut s, &v, &mut y);
        d.point_response(2, &Vec3::x(), &[Vec3::y()], 1.0, &mut y);
        assert!(qdd.iter().chain(&u).chain(&y).chain(&w).all(|x| x.is_finite()), "{pitch}: {qdd:?} {u:?} {y:?}");
    }
}

/// Forward dynamics does not pass a state without accelerations: one state, and any lane of a batch in SIMD or not.
#[test]
fn forward_dynamics_names_the_joint_that_moves_no_inertia() {
    let model = gimbal();
    let lock = std::f64::consts::FRAC_PI_2;
    let mut d = Dynamics::new(&model);
    for (pitch, held) in [(0.4, None), (lock, Some(SingularJoint { lane: 0, link: 0 }))] {
        let found = forward_dynamics(&mut d, &-Vec3::z(), &[0.3, pitch, 0.1], &[0.0; 3], &[1.0; 3], &mut [0.0; 3]);
        assert_eq!(found.err(), held);
    }
    for mut batch in [BatchDynamics::<8>::new(&model), BatchDynamics::<8>::plain(&model)] {
        for locked in [&[][..], &[0], &[5], &[7], &[6, 3]] {
            let pitches = Lanes(std::array::from_fn(|lane| if locked.contains(&lane) { lock } else { 0.1 }));
            let (q, ones) = ([Lanes([0.3; 8]), pitches, Lanes([0.1; 8])], [Lanes([1.0; 8]); 3]);
            let found = batch.forward_dynamics(&-Vec3::z(), &q, &ones, &ones, &mut [Lanes([0.0; 8]); 3]);
            assert_eq!(found.err(), locked.iter().min().map(|lane| SingularJoint { lane: *lane, link: 0 }));
        }
    }
    let mut builder = ModelBuilder::new();
    let swing = LinkMass::point(2.0, Vec3::new(0.5, 0.0, 0.0));
    builder.link("arm", None, Joint::revolute(Vec3::y()), Pose::identity(), swing);
    let bead = LinkMass::point(1.0, Vec3::new(0.0, 0.0, 0.2));
    builder.link("bead", Some(0), Joint::revolute(Vec3::z()), Pose::identity(), bead);
    let model = builder.build().unwrap();
    let found =
        forward_dynamics(&mut Dynamics::new(&model), &-Vec3::z(), &[0.0; 2], &[0.0; 2], &[1.0; 2], &mut [0.0; 2]);
    let held = found.unwrap_err();
    assert_eq!(held.link, 1);
    assert!(model.singularity(held.link).contains("the joint of link 'bead' moves no inertia"));
}

#[test]
fn gimbal_lock_is_distinguished_from_its_neighborhood_in_any_structure() {
    for seed in 0..200 {
        let mut n = Numbers::new(seed);
        let mut builder = ModelBuilder::new();
        let turned = |n: &mut Numbers| Joint::revolute(n.vector());
        let (joint, placement, mass) = (turned(&mut n), n.pose(0.5), n.mass());
        let before = builder.link("before", None, joint, placement, mass);
        let outer = builder.link("yaw", Some(before), Joint::revolute(Vec3::z()), n.pose(0.5), LinkMass::none());
        let middle = builder.link("pitch", Some(outer), Joint::revolute(Vec3::y()), Pose::identity(), LinkMass::none());
        let thin = 10f64.powf(3.0 * n.next() - 3.0);
        let moments = Mat3::from_diagonal(&Vec3::new(1.0 + thin, 1.0, thin));
        let axes = n.rotation().to_rotation_matrix().into_inner();
        let body = LinkMass { mass: 1.0, center: n.vector(), inertia: axes * moments * axes.transpose() };
        let hand = builder.link("roll", Some(middle), Joint::revolute(Vec3::x()), Pose::identity(), body);
        let (joint, placement, mass) = (turned(&mut n), n.pose(0.5), n.mass());
        builder.link("after", Some(hand), joint, placement, mass);
        let model = builder.build().unwrap();
        let mut d = Dynamics::new(&model);
        let v = n.list(model.dof(), 1.0);
        for (off, singular) in [(0.0, true), (1e-4, false), (-1e-3, false)] {
            let mut q = n.list(model.positions(), 3.0);
            q[2] = std::f64::consts::FRAC_PI_2 + off;
            d.refresh(&q, &v);
            assert_eq!(d.singular(), singular.then_some(1), "seed {seed}, {off} from lock");
            let mut qdd = vec![f64::NAN; model.dof()];
            d.accelerate(&mut d.scratch(), &v, &[], &mut qdd);
            assert!(qdd.iter().all(|x| x.is_finite()));
        }
    }
}

#[test]
fn a_ball_joint_moves_as_three_hinges_do() {
    // The same body on a spherical joint and on the stack of revolute joints, away from gimbal
    // lock: the same angular acceleration.
    let stack = gimbal();
    let mut builder = ModelBuilder::new();
    builder.link("ball", None, Joint::Spherical, Pose::identity(), stack.links()[2].mass);
    let ball = builder.build().unwrap();
    let (q, v) = ([0.3, 0.5, -0.7], [1.0, -2.0, 3.0]);
    let mut hinges = Dynamics::new(&stack);
    hinges.refresh(&q, &v);
    let rotation = hinges.link_pose(2).rotation;
    let own = rotation.inverse() * hinges.link_velocity(2).0;
    let mut single = Dynamics::new(&ball);
    single.refresh(rotation.coords.as_slice(), own.as_slice());
    let wrench = Wrench { torque: Vec3::new(0.4, 0.1, -0.3), force: Vec3::zeros() };
    let (mut qdd, mut out) = ([0.0; 3], [(Vec3::zeros(), Vec3::zeros()); 3]);
    hinges.accelerate_in(
        &mut hinges.scratch(),
        &-Vec3::z(),
        &[0.0; 3],
        &[Wrench::default(), Wrench::default(), wrench],
        &mut qdd,
    );
    hinges.link_accelerations(&qdd, &mut out);
    let wanted = out[2].0;
    single.accelerate_in(&mut single.scratch(), &-Vec3::z(), &[0.0; 3], &[wrench], &mut qdd);
    single.link_accelerations(&qdd, &mut out);
    assert!((out[0].0 - wanted).norm() < 1e-12, "{:?} {wanted:?}", out[0].0);
}

#[test]
fn energy_of_the_whitened_velocity_and_power() {
    // ½|u|² is the kinetic energy of the links, and its rate is the power of the forces.
    for (model, seed) in trees() {
        let (mut d, q, v) = refreshed(&model, seed);
        let mut s = d.scratch();
        let mut kinetic = |d: &Dynamics, v: &[f64]| {
            let mut u = vec![0.0; v.len()];
            d.mul_l(&mut s, v, &mut u);
            0.5 * u.iter().map(|x| x * x).sum::<f64>()
        };
        let energy = kinetic(&d, &v);
        let poses = poses(&model, &q);
        let links: f64 = (0..d.links())
            .map(|i| {
                let (mass, (omega, velocity)) = (&model.links()[i].mass, d.link_velocity(i));
                let r = poses[i].rotation.to_rotation_matrix().into_inner();
                let center = velocity + omega.cross(&(r * mass.center));
                0.5 * mass.mass * center.norm_squared() + 0.5 * omega.dot(&(r * mass.inertia * r.transpose() * omega))
            })
            .sum();
        assert!((energy - links).abs() < 1e-12 * links, "{energy} {links}");
        let tau = Numbers::new(seed + 3).list(d.dof(), 1.0);
        let mut qdd = vec![0.0; d.dof()];
        d.accelerate(&mut d.scratch(), &tau, &[], &mut qdd);
        let size = qdd.iter().fold(1.0f64, |m, x| m.max(x.abs()));
        let h = 1e-4 / size;
        let mut later = |h: f64| {
            let v: Vec<f64> = v.iter().zip(&qdd).map(|(v, a)| v + h * a).collect();
            let middle: Vec<f64> = v.iter().zip(&qdd).map(|(v, a)| v - 0.5 * h * a).collect();
            d.refresh(&moved(&model, &q, &middle, h), &v);
            kinetic(&d, &v)
        };
        let rate = (later(h) - later(-h)) / (2.0 * h);
        let power: f64 = tau.iter().zip(&v).map(|(t, v)| t * v).sum();
        assert!((rate - power).abs() < 1e-5 * energy * size, "{rate} {power}");
    }
}

//! The armature of a joint: the inertia of its rotor on the diagonal of the mass matrix.

use crate::articulated_random::{Kinds, Random, random_state, random_tree, random_trees};
use nalgebra::{DMatrix, DVector};
use tumble_core::articulated::{
    BatchDynamics, Dynamics, InverseDynamics, Kinematics, Lanes, MassMatrix, energy, forward_dynamics,
};
use tumble_core::collide::{Pose, Vec3};
use tumble_core::{ArticulatedBody, Joint, LinkMass, Model, ModelBuilder, ModelError, Settings, World};

const GRAVITY: Vec3 = Vec3::new(0.3, -0.7, -9.81);

/// Returns the model with armatures on its revolute, prismatic and spherical joints, and their list by
/// velocity number.
fn armored(model: &Model, random: &mut Random) -> (Model, Vec<f64>) {
    let (mut builder, mut list) = (ModelBuilder::new(), vec![0.0; model.dof()]);
    for link in model.links() {
        let number = builder.link(&link.name, link.parent, link.joint, link.placement, link.mass);
        if link.joint.dof() == 1 || link.joint == Joint::Spherical {
            let armature = random.real(0.0, 2.0);
            list[link.v..link.v + link.joint.dof()].fill(armature);
            builder.set_armature(number, armature);
        }
    }
    (builder.build().unwrap(), list)
}

fn mass_matrix(model: &Model, q: &[f64]) -> DMatrix<f64> {
    let (mut kin, mut m) = (Kinematics::new(model), vec![0.0; model.dof() * model.dof()]);
    kin.refresh(model, q, &vec![0.0; model.dof()]);
    MassMatrix::new(model).write(model, &kin, &mut m);
    DMatrix::from_vec(model.dof(), model.dof(), m)
}

#[test]
fn all_algorithms_have_the_same_armature() {
    let (mut random, mut spherical) = (Random(5), 0);
    for plain in random_trees(91) {
        // joints that carry others: their armature acts on what is below them
        let carries = |k: usize| plain.links().iter().any(|other| other.parent == Some(k));
        let balls = plain.links().iter().enumerate().filter(|(_, link)| link.joint == Joint::Spherical);
        spherical += balls.filter(|(k, link)| carries(*k) && link.parent.is_some()).count();
        let (model, armature) = armored(&plain, &mut random);
        let n = model.dof();
        let (q, v) = random_state(&mut random, &model, 2.0);
        let (bare, m) = (mass_matrix(&plain, &q), mass_matrix(&model, &q));
        let expected = &bare + DMatrix::from_diagonal(&DVector::from_vec(armature.clone()));
        assert!((&m - &expected).amax() <= 1e-14 * expected.amax(), "the diagonal of the mass matrix");

        // The factor: LᵀL = M, and its four maps.
        let mut d = Dynamics::new(&model);
        d.refresh(&q, &v);
        assert_eq!(d.singular(), None);
        let mut s = d.scratch();
        let column = |map: &mut dyn FnMut(&[f64], &mut [f64])| {
            let mut out = DMatrix::zeros(n, n);
            for k in 0..n {
                let mut unit = vec![0.0; n];
                unit[k] = 1.0;
                map(&unit, out.column_mut(k).as_mut_slice());
            }
            out
        };
        let l = column(&mut |v, u| d.mul_l(&mut s, v, u));
        let lt = column(&mut |u, j| d.mul_lt(&mut s, u, j));
        let inverse = column(&mut |u, v| d.solve_l(&mut s, u, v));
        let inverse_t = column(&mut |j, y| d.solve_lt(&mut s, j, y));
        let identity = DMatrix::<f64>::identity(n, n);
        let close = |what: &str, a: &DMatrix<f64>, b: &DMatrix<f64>, least: f64| {
            let error = (a - b).amax() / b.amax();
            assert!(error < least, "{what} of {n} dof: {error:e}");
        };
        close("L transposed times L", &(l.transpose() * &l), &m, 1e-11);
        close("the transposed map", &lt, &l.transpose(), 1e-11);
        close("the inverse map", &(&l * &inverse), &identity, 1e-8);
        close("the transposed inverse", &inverse_t, &inverse.transpose(), 1e-8);

        // Forward and inverse dynamics are each other's inverse.
        let tau = random.numbers(n, 5.0);
        let (mut qdd, mut once, mut back) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
        d.accelerate_in(&mut s, &GRAVITY, &tau, &[], &mut qdd);
        forward_dynamics(&mut d, &GRAVITY, &q, &v, &tau, &mut once).unwrap();
        assert_eq!(once, qdd);
        let mut kin = Kinematics::new(&model);
        kin.refresh(&model, &q, &v);
        InverseDynamics::new(&model).solve(&model, &kin, &GRAVITY, &qdd, &[], &mut back);
        let size = qdd.iter().fold(1.0f64, |m, x| m.max(x.abs())) * m.amax();
        let worst = back.iter().zip(&tau).fold(0.0f64, |w, (a, b)| w.max((a - b).abs()));
        assert!(worst < 1e-9 * size, "{n} dof: {worst:e} of {size:e}");

        // Kinetic energy is ½vᵀMv.
        let kinetic = energy(&model, &kin, &GRAVITY).kinetic;
        let v = DVector::from_vec(v);
        let quadratic = 0.5 * (v.transpose() * &m * &v)[0];
        assert!((kinetic - quadratic).abs() < 1e-12 * quadratic, "{kinetic} and {quadratic}");
    }
    assert!(spherical > 10, "{spherical}");
}

#[test]
fn lanes_have_the_bits_of_one_state() {
    let mut random = Random(8);
    let (model, _) = armored(&random_tree(&mut Random(3), 12, true, Kinds::All), &mut random);
    let mut batch = BatchDynamics::<8>::new(&model);
    let states: Vec<_> = (0..8).map(|_| random_state(&mut random, &model, 2.0)).collect();
    let lanes = |count: usize, of: &dyn Fn(usize, usize) -> f64| -> Vec<Lanes<8>> {
        (0..count).map(|k| Lanes(std::array::from_fn(|lane| of(lane, k)))).collect()
    };
    let q = lanes(model.positions(), &|lane, k| states[lane].0[k]);
    let v = lanes(model.dof(), &|lane, k| states[lane].1[k]);
    let tau = lanes(model.dof(), &|lane, k| (lane * k) as f64 * 0.1);
    let mut qdd = lanes(model.dof(), &|_, _| 0.0);
    batch.forward_dynamics(&GRAVITY, &q, &v, &tau, &mut qdd).unwrap();
    let mut d = Dynamics::new(&model);
    for (lane, (q, v)) in states.iter().enumerate() {
        let (tau, mut one): (Vec<f64>, _) = (tau.iter().map(|t| t.0[lane]).collect(), vec![0.0; model.dof()]);
        forward_dynamics(&mut d, &GRAVITY, q, v, &tau, &mut one).unwrap();
        assert_eq!(one, qdd.iter().map(|a| a.0[lane]).collect::<Vec<_>>());
    }
}

/// A rod of mass `m` and length `l` about its end, with a rotor: `q̈ = −½mgl sin q / (ml²/3 + a)`.
fn pendulum(armature: f64) -> Model {
    let (m, l) = (1.5, 0.8);
    let mut builder = ModelBuilder::new();
    let inertia = Vec3::new(m * l * l / 12.0, m * l * l / 12.0, 0.0);
    let mass = LinkMass {
        mass: m,
        center: Vec3::new(0.0, 0.0, -0.5 * l),
        inertia: nalgebra::Matrix3::from_diagonal(&inertia),
    };
    let rod = builder.link("rod", None, Joint::revolute(Vec3::y()), Pose::identity(), mass);
    builder.set_armature(rod, armature);
    builder.build().unwrap()
}

#[test]
fn a_pendulum_with_a_rotor_swings_as_its_closed_form_and_keeps_its_energy() {
    let (m, l, g, a) = (1.5, 0.8, 9.81, 0.4);
    let (model, inertia) = (pendulum(a), 1.5 * 0.64 / 3.0 + 0.4);
    let mut qdd = [0.0];
    forward_dynamics(&mut Dynamics::new(&model), &Vec3::new(0.0, 0.0, -g), &[0.7], &[1.3], &[0.2], &mut qdd).unwrap();
    assert!((qdd[0] - (0.2 - 0.5 * m * g * l * f64::sin(0.7)) / inertia).abs() < 1e-12);

    // A small swing: half a period is π·√(I/(½mgl)).
    let mut world = World::new(Settings::default().with_dt(1e-4).with_gravity(Vec3::new(0.0, 0.0, -g))).unwrap();
    let id = world.add(ArticulatedBody::new("rod", model).with_positions(&[1e-3]).unwrap()).unwrap();
    let total = |world: &World| world.energy().kinetic + world.energy().potential;
    let start = total(&world);
    let half = std::f64::consts::PI * (inertia / (0.5 * m * g * l)).sqrt();
    let steps = (half / 1e-4).round() as usize;
    (0..steps).for_each(|_| _ = world.step().unwrap());
    let state = world.state_of(id).unwrap();
    assert!((state[0] + 1e-3).abs() < 1e-7, "{state:?}");
    let change = total(&world) - start;
    assert!(change.abs() < 1e-12, "{change:e}");
}

/// A top of mass `m` at height `l` with moments `J` about its joint and a rotor `a`: `ω̇ = (J + a)⁻¹ (τ − ω × J ω + l z × m g)` in its
/// own axes. Two tops in a chain, the upper one without mass
/// and its rotor huge, move as the lower one alone. Energy is kept over a swing.
#[test]
fn a_top_with_a_rotor_turns_as_its_closed_form_and_keeps_its_energy() {
    let (a, m, l) = (0.25, 2.0, 0.5);
    let own = nalgebra::Matrix3::from_diagonal(&Vec3::new(0.1, 0.12, 0.05));
    let mass = LinkMass { mass: m, center: Vec3::new(0.0, 0.0, l), inertia: own };
    let about_joint = own + nalgebra::Matrix3::from_diagonal(&Vec3::new(m * l * l, m * l * l, 0.0));
    let top = |rotor: f64, stacked: bool| {
        let mut builder = ModelBuilder::new();
        let parent = stacked.then(|| {
            let base = builder.link("base", None, Joint::Spherical, Pose::identity(), LinkMass::none());
            builder.set_armature(base, 1e12);
            base
        });
        let link = builder.link("top", parent, Joint::Spherical, Pose::identity(), mass);
        builder.set_armature(link, rotor);
        builder.build().unwrap()
    };
    let turn = nalgebra::UnitQuaternion::from_scaled_axis(Vec3::new(0.4, -0.3, 0.9));
    let (q, v, tau) = (turn.coords, Vec3::new(1.0, -2.0, 3.0), Vec3::new(0.1, 0.2, -0.3));
    let down = turn.inverse() * GRAVITY;
    let moment = tau - v.cross(&(about_joint * v)) + Vec3::new(0.0, 0.0, l).cross(&(m * down));
    let expected = (about_joint + nalgebra::Matrix3::identity() * a).try_inverse().unwrap() * moment;
    let alone = top(a, false);
    let mut qdd = [0.0; 3];
    forward_dynamics(&mut Dynamics::new(&alone), &GRAVITY, q.as_slice(), v.as_slice(), tau.as_slice(), &mut qdd)
        .unwrap();
    assert!((Vec3::from(qdd) - expected).norm() < 1e-12, "{qdd:?}, expected {expected}");

    let chain = top(a, true);
    let (mut both, still) = ([0.0; 6], [0.0, 0.0, 0.0, 1.0]);
    let (q, v, tau) =
        ([&still[..], q.as_slice()].concat(), [&[0.0; 3], v.as_slice()].concat(), [&[0.0; 3], tau.as_slice()].concat());
    forward_dynamics(&mut Dynamics::new(&chain), &GRAVITY, &q, &v, &tau, &mut both).unwrap();
    assert!((Vec3::from_column_slice(&both[3..]) - expected).norm() < 1e-9, "{both:?}, expected {expected}");

    let drift = [1e-3, 5e-4].map(|dt| {
        let mut world = World::new(Settings::default().with_dt(dt).with_gravity(GRAVITY)).unwrap();
        let body = ArticulatedBody::new("top", alone.clone()).with_positions(&q[4..]).unwrap();
        world.add(body.with_velocities(&v[3..]).unwrap()).unwrap();
        let total = |world: &World| world.energy().kinetic + world.energy().potential;
        let start = total(&world);
        let step = |_| {
            world.step().unwrap();
            (total(&world) - start).abs()
        };
        (0..(1.0 / dt) as usize).map(step).fold(0.0, f64::max)
    });
    // of second order in the step, as without a rotor
    assert!(drift[0] < 1e-4 && drift[1] < 0.3 * drift[0], "{drift:?}");
}

#[test]
fn a_massless_link_may_have_an_armature_and_other_joints_not() {
    let make = |joint: Joint, mass: LinkMass, armature: f64| {
        let mut builder = ModelBuilder::new();
        let link = builder.link("rotor", None, joint, Pose::identity(), mass);
        builder.set_armature(link, armature);
        builder.build()
    };
    let model = make(Joint::revolute(Vec3::z()), LinkMass::none(), 0.5).unwrap();
    let mut qdd = [0.0];
    forward_dynamics(&mut Dynamics::new(&model), &GRAVITY, &[0.3], &[2.0], &[3.0], &mut qdd).unwrap();
    assert_eq!(qdd, [6.0]);
    let ball = LinkMass::point(1.0, Vec3::x());
    for (joint, armature) in [(Joint::Spherical, -0.1), (Joint::revolute(Vec3::z()), -1.0), (Joint::Floating, 0.1)] {
        let error = make(joint, ball, armature).unwrap_err();
        assert!(matches!(error, ModelError::Inertia { .. }) && error.to_string().contains("armature"), "{error}");
    }
}

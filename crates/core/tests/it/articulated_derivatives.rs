//! Derivatives of the dynamics of random trees, against central differences of algorithms that share no code
//! with them.

use crate::articulated_random::*;
use nalgebra::DMatrix;
use tumble_core::articulated::*;
use tumble_core::collide::Vec3;
use tumble_core::{Joint, Model};

const G: Vec3 = Vec3::new(0.3, -0.7, -9.81);
/// Step of the differences: errors of its square and of rounding are below 1e-8 of the largest entry.
const STEP: f64 = 3e-5;

/// Returns the columns of the slopes of `of` along unit changes of one of three arguments.
fn slopes(model: &Model, at: &[Vec<f64>; 3], which: usize, of: &dyn Fn(&[Vec<f64>; 3]) -> Vec<f64>) -> DMatrix<f64> {
    let dof = model.dof();
    let moved = |k: usize, h: f64| {
        let mut at = at.clone();
        if which == 0 {
            let unit: Vec<f64> = (0..dof).map(|i| f64::from(u8::from(i == k))).collect();
            integrate(model, &mut at[0], &unit, h);
        } else {
            at[which][k] += h;
        }
        of(&at)
    };
    // of fourth order: what is left of the step is far below rounding
    let columns = (0..dof).flat_map(|k| {
        let [a, b, c, d] = [-2.0, -1.0, 1.0, 2.0].map(|n| moved(k, n * STEP));
        (0..dof).map(move |i| (8.0 * (c[i] - b[i]) - (d[i] - a[i])) / (12.0 * STEP)).collect::<Vec<_>>()
    });
    DMatrix::from_iterator(dof, dof, columns)
}

fn close(found: &DMatrix<f64>, slope: &DMatrix<f64>, what: &str, model: &Model) {
    let off = apart(found.as_slice(), slope.as_slice());
    assert!(off < 1e-7, "{what} of {} links: off by {off} of the largest entry", model.links().len());
}

fn trees() -> Vec<Model> {
    let mut random = Random(77);
    let mut trees: Vec<Model> = (0..30)
        .flat_map(|i| [(1 + i % 12, true), (1 + i % 15, false)])
        .map(|(count, floating)| random_tree(&mut random, count, floating, Kinds::All))
        .collect();
    trees.extend(random_trees(3).into_iter().filter(|model| model.dof() < 60));
    trees
}

/// The trees with a rotor at every joint but the floating root.
fn trees_with_rotors() -> Vec<Model> {
    let with_rotors = |model: Model| {
        let names = model.links().iter().filter(|link| link.joint != Joint::Floating);
        let names: Vec<String> = names.map(|link| link.name.clone()).collect();
        let body = names.iter().enumerate().fold(ArticulatedBody::new("tree", model), |body, (i, name)| {
            body.with_armature(name, 0.05 + 0.02 * (i % 7) as f64).expect("a joint with an armature")
        });
        body.model().clone()
    };
    let trees: Vec<Model> = trees().into_iter().map(with_rotors).collect();
    let turned = |model: &Model| model.links().iter().any(|l| l.joint == Joint::Spherical && l.armature > 0.0);
    assert!(trees.iter().filter(|model| turned(model)).count() > 20);
    trees
}

#[test]
fn derivatives_of_inverse_dynamics_are_its_slopes() {
    check_inverse(&trees());
}

#[test]
fn derivatives_of_inverse_dynamics_with_rotors_are_its_slopes() {
    check_inverse(&trees_with_rotors());
}

fn check_inverse(trees: &[Model]) {
    let mut random = Random(5);
    for model in trees {
        let (q, v) = random_state(&mut random, model, 1.5);
        let at = [q, v, random.numbers(model.dof(), 3.0)];
        let d = inverse_dynamics_derivatives(model, &mut Kinematics::new(model), &G, &at[0], &at[1], &at[2]);
        let tau = |[q, v, qdd]: &[Vec<f64>; 3]| {
            let mut tau = vec![f64::NAN; model.dof()];
            let work = (&mut Kinematics::new(model), &mut InverseDynamics::new(model));
            inverse_dynamics(model, work, &G, q, v, qdd, &[], &mut tau);
            tau
        };
        close(&d.by_q, &slopes(model, &at, 0, &tau), "by q", model);
        close(&d.by_v, &slopes(model, &at, 1, &tau), "by v", model);
        close(&d.by_qdd, &slopes(model, &at, 2, &tau), "by qdd", model);
    }
}

#[test]
fn derivatives_of_forward_dynamics_are_its_slopes() {
    check_forward(&trees());
}

#[test]
fn derivatives_of_forward_dynamics_with_rotors_are_its_slopes() {
    check_forward(&trees_with_rotors());
}

fn check_forward(trees: &[Model]) {
    let mut random = Random(6);
    for model in trees {
        let (q, v) = random_state(&mut random, model, 1.5);
        let at = [q, v, random.numbers(model.dof(), 3.0)];
        let found = forward_dynamics_derivatives(model, &mut Kinematics::new(model), &G, &at[0], &at[1], &at[2]);
        let d = found.expect("a tree with inertia at every joint");
        let qdd = |[q, v, tau]: &[Vec<f64>; 3]| {
            let mut qdd = vec![f64::NAN; model.dof()];
            forward_dynamics(&mut Dynamics::new(model), &G, q, v, tau, &mut qdd).unwrap();
            qdd
        };
        assert!(apart(d.qdd.as_slice(), &qdd(&at)) < 1e-8);
        close(&d.by_q, &slopes(model, &at, 0, &qdd), "by q", model);
        close(&d.by_v, &slopes(model, &at, 1, &qdd), "by v", model);
        close(&d.by_tau, &slopes(model, &at, 2, &qdd), "by tau", model);
    }
}

/// In gimbal lock of a stack of massless links the mass matrix has no inverse.
#[test]
fn a_singular_mass_matrix_has_no_forward_derivatives() {
    use tumble_core::collide::Pose;
    use tumble_core::{LinkMass, ModelBuilder};
    let mut builder = ModelBuilder::new();
    builder.link("free of mass", None, Joint::revolute(Vec3::z()), Pose::identity(), LinkMass::none());
    builder.link("point", Some(0), Joint::prismatic(Vec3::z()), Pose::identity(), LinkMass::point(1.0, Vec3::zeros()));
    let model = builder.build().unwrap();
    let none = [0.0; 2];
    assert_eq!(forward_dynamics_derivatives(&model, &mut Kinematics::new(&model), &G, &none, &none, &none), None);
}

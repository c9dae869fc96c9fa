//! Laws of `Integratable` that hold for every object with a state, of this crate and of the engine.
//! An object of a new kind is checked by one more line.

use crate::common::*;
use nalgebra::DMatrix;
use tumble_core::collide::{Mat3, Pose, Vec3};
use tumble_core::*;
use tumble_extension::Bead;

/// The matrix of a linear map of `n` numbers.
fn matrix(n: usize, mut map: impl FnMut(&[f64], &mut [f64])) -> DMatrix<f64> {
    let mut columns = DMatrix::zeros(n, n);
    for k in 0..n {
        let mut unit = vec![0.0; n];
        unit[k] = 1.0;
        map(&unit, columns.column_mut(k).as_mut_slice());
    }
    columns
}

fn close(name: &str, law: &str, got: &DMatrix<f64>, by_hand: &DMatrix<f64>, within: f64) {
    let (off, size) = ((got - by_hand).amax(), 1.0 + by_hand.amax());
    assert!(off < within * size, "{name}: {law} is off by {off:e}, numbers up to {size}");
}

fn parts_at(object: &dyn Object, x: &[f64]) -> (Cache, Vec<PartState>) {
    let parts = object.integratable().unwrap().state_sizes().parts;
    let (mut cache, mut part_states) = (object.new_cache(), vec![PartState::default(); parts]);
    object.refresh(x, &mut cache, &mut part_states);
    (cache, part_states)
}

fn check(name: &str, object: &dyn Object, x: &[f64]) {
    let body = object.integratable().unwrap();
    let (n, (mut cache, part_states)) = (body.state_sizes().dof, parts_at(object, x));
    let cache = &mut cache;
    let l = matrix(n, |v, u| body.mul_l(cache, v, u));
    let inverse = matrix(n, |u, v| body.solve_l(cache, u, v));
    close(name, "L⁻¹·L = 1", &(&inverse * &l), &DMatrix::identity(n, n), 1e-10);
    close(name, "mul_lt = Lᵀ", &matrix(n, |u, j| body.mul_lt(cache, u, j)), &l.transpose(), 1e-12);
    close(name, "solve_lt = L⁻ᵀ", &matrix(n, |j, y| body.solve_lt(cache, j, y)), &inverse.transpose(), 1e-12);

    let (mut v, mut u) = (DMatrix::zeros(n, 1), DMatrix::zeros(n, 1));
    body.velocity(x, v.as_mut_slice());
    body.whitened_velocity(cache, x, u.as_mut_slice());
    close(name, "u = L·v", &u, &(&l * &v), 1e-12);
    let kinetic = DMatrix::repeat(1, 1, body.energy(x, &Vec3::zeros()).kinetic);
    close(name, "T = ½|u|²", &kinetic, &(0.5 * u.transpose() * &u), 1e-12);
    let mut written = x.to_vec();
    body.write_velocity(&mut written, v.as_slice());
    close(
        name,
        "write_velocity",
        &DMatrix::from_row_slice(1, x.len(), &written),
        &DMatrix::from_row_slice(1, x.len(), x),
        1e-12,
    );

    let axes = [Vec3::x(), Vec3::new(0.0, 0.6, 0.8), Vec3::new(0.48, 0.64, -0.6)];
    let mut wrenches = Vec::new();
    for (part, part_state) in part_states.iter().enumerate() {
        wrenches.push(Wrench { force: Vec3::new(0.3, -0.2, 0.5), torque: Vec3::new(0.1, 0.4, -0.3) });
        let at = PartPoint { part, part_state, point: part_state.position() + Vec3::new(0.2, -0.1, 0.3), axes: &axes };
        let (mut j, mut y) = (DMatrix::zeros(n, 3), DMatrix::zeros(n, 3)); // by columns
        body.jacobian(cache, &at, j.as_mut_slice());
        body.test_impulse(cache, &at, -1.0, y.as_mut_slice());
        let velocity = axes.map(|axis| axis.dot(&part_state.velocity_at(&at.point)));
        close(name, "J·v", &(j.transpose() * &v), &DMatrix::from_row_slice(3, 1, &velocity), 1e-12);
        close(name, "test impulse = −L⁻ᵀ·Jᵀ", &y, &(-inverse.transpose() * &j), 1e-10);
    }
    accelerations(name, object, x, &wrenches);
}

/// Accelerations of the parts are the rates of their velocities along the motion, by central
/// differences.
fn accelerations(name: &str, object: &dyn Object, x: &[f64], wrenches: &[Wrench]) {
    let body = object.integratable().unwrap();
    let (n, (mut cache, mut part_states)) = (body.state_sizes().dof, parts_at(object, x));
    let (generalized, mut dp, mut own) = (vec![0.2; n], vec![0.0; n], vec![0.0; n]);
    let forces = ForceSlice { part_states: &part_states, wrenches, generalized: &generalized };
    body.derivative(&mut cache, x, &forces, &mut dp);
    body.accelerations(&mut cache, x, &dp, &mut part_states);
    body.free_motion_rate(&mut cache, x, &mut own);
    let push: Vec<f64> = dp.iter().zip(&own).map(|(dp, own)| dp - own).collect();
    let h = 1e-5;
    let [before, after] = [-h, h].map(|h| {
        let mut x = x.to_vec();
        body.free_motion(&mut cache, &mut x, 0.5 * h);
        body.kick(&mut x, &push, h);
        body.free_motion(&mut cache, &mut x, 0.5 * h);
        parts_at(object, &x).1
    });
    for (part, state) in part_states.iter().enumerate() {
        let rate = |of: fn(&PartState) -> Vec3| (of(&after[part]) - of(&before[part])) / (2.0 * h);
        let off = (state.acceleration - rate(|s| s.velocity)).norm()
            + (state.angular_acceleration - rate(|s| s.angular_velocity)).norm();
        assert!(
            off < 1e-6 * (1.0 + state.acceleration.norm()),
            "{name}: acceleration of part {part} is off by {off:e}"
        );
    }
}

#[test]
fn every_object_obeys_the_laws_of_its_trait() {
    check("particle", &particle(2.0, 0.1, Vec3::zeros(), Vec3::zeros()), &[0.1, -0.4, 0.3, 1.0, 2.0, -0.5]);
    check("bead", &Bead::new("bead", 0.7, 0.25, sphere(0.02)), &[1.1, 0.3]);

    let inertia = Mat3::new(0.5, 0.02, 0.01, 0.02, 0.4, -0.03, 0.01, -0.03, 0.3);
    let body = RigidBody::new(sphere(0.1)).with_mass_and_inertia(2.0, inertia);
    let mut x = [0.1, -0.4, 0.3, 0.4, -0.2, 0.4, 0.8, 1.0, 2.0, -0.5, 0.3, 0.7, -0.4];
    check("rigid body", &body, &x);
    x[10..].fill(0.0);
    check("rigid body without spin", &body, &x);

    let mass = LinkMass { mass: 1.5, center: Vec3::new(0.02, 0.1, -0.3), inertia };
    let mut builder = ModelBuilder::new();
    let root = builder.link("root", None, Joint::Floating, Pose::identity(), mass);
    let arm = builder.link("arm", Some(root), Joint::Spherical, Pose::translation(0.0, 0.1, -0.4), mass);
    let slide = builder.link("slide", Some(arm), Joint::prismatic(Vec3::x()), Pose::translation(0.2, 0.0, -0.5), mass);
    builder.link("hand", Some(slide), Joint::revolute(Vec3::y()), Pose::translation(0.0, 0.0, -0.3), mass);
    let robot = ArticulatedBody::new("robot", builder.build().unwrap());
    let (q, v) = (
        [0.1, -0.4, 0.3, 0.4, -0.2, 0.4, 0.8, 0.2, 0.4, 0.4, 0.8, 0.3, -0.7],
        [0.4, -0.2, 0.3, 1.0, 0.5, -0.6, 0.2, 0.8, -0.3, 0.7, 1.1],
    );
    check("articulated body", &robot, &[&q[..], &v[..]].concat());
}

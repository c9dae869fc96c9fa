//! Laws of the spatial algebra, for any numbers.

use nalgebra::{SMatrix, SVector, UnitQuaternion};
use proptest::prelude::*;
use tumble_core::collide::{Mat3, Pose, Vec3};
use tumble_core::spatial::{ArticulatedInertia, Force, Inertia, Matrix, Motion, Symmetric, Transform, Vector};

type Six = SVector<f64, 6>;
type SixSquare = SMatrix<f64, 6, 6>;

fn vector() -> impl Strategy<Value = Vector> {
    [-3.0..3.0, -3.0..3.0, -3.0..3.0].prop_map(|[x, y, z]: [f64; 3]| Vector::new(x, y, z))
}

fn motion() -> impl Strategy<Value = Motion> {
    (vector(), vector()).prop_map(|(angular, linear)| Motion::new(angular, linear))
}

fn force() -> impl Strategy<Value = Force> {
    (vector(), vector()).prop_map(|(torque, force)| Force::new(torque, force))
}

fn frame() -> impl Strategy<Value = Transform> {
    (vector(), vector()).prop_map(|(turn, at)| {
        Pose::from_parts(Vec3::from(at).into(), UnitQuaternion::from_scaled_axis(Vec3::from(turn))).into()
    })
}

/// Mass, center and the inertia of three pairs of points about it.
fn body() -> impl Strategy<Value = (f64, Vec3, Mat3)> {
    (0.1..5.0f64, vector(), [vector(), vector(), vector()]).prop_map(|(mass, center, points)| {
        let about = points.iter().fold(Mat3::zeros(), |sum, p| {
            let p = Vec3::from(*p);
            sum + mass / 3.0 * (p.norm_squared() * Mat3::identity() - p * p.transpose())
        });
        (mass, center.into(), about)
    })
}

/// Six numbers of a motion or force vector; only here, for comparisons.
fn six(a: Vector, b: Vector) -> Six {
    Six::from_column_slice(&[a.x, a.y, a.z, b.x, b.y, b.z])
}

fn of_motion(m: Motion) -> Six {
    six(m.angular, m.linear)
}

fn of_force(f: Force) -> Six {
    six(f.torque, f.force)
}

fn close(a: Six, b: Six) -> bool {
    (a - b).amax() <= 1e-12 * (1.0 + a.amax().max(b.amax()))
}

fn near(a: f64, b: f64, size: f64) -> bool {
    (a - b).abs() <= 1e-12 * (1.0 + size)
}

fn blocks(j: Mat3, h: Mat3, m: Mat3) -> SixSquare {
    let mut out = SixSquare::zeros();
    out.fixed_view_mut::<3, 3>(0, 0).copy_from(&j);
    out.fixed_view_mut::<3, 3>(0, 3).copy_from(&h);
    out.fixed_view_mut::<3, 3>(3, 0).copy_from(&h.transpose());
    out.fixed_view_mut::<3, 3>(3, 3).copy_from(&m);
    out
}

/// A random symmetric positive 6×6 matrix and its form of 21 numbers.
fn articulated() -> impl Strategy<Value = (ArticulatedInertia, SixSquare)> {
    prop::collection::vec(-1.0..1.0f64, 36).prop_map(|a| {
        let a = SixSquare::from_column_slice(&a);
        let dense = a.transpose() * a + 0.1 * SixSquare::identity();
        let block = |i, j| -> Mat3 { dense.fixed_view::<3, 3>(i, j).into_owned() };
        let rows = Matrix::from(block(0, 3).transpose());
        let inertia = ArticulatedInertia {
            rotational: block(0, 0).into(),
            coupling: [rows.x, rows.y, rows.z],
            mass: block(3, 3).into(),
        };
        (inertia, dense)
    })
}

proptest! {
    #[test]
    fn transforms_compose_and_invert(a in frame(), b in frame(), m in motion(), f in force()) {
        prop_assert!(close(of_motion(a.then(&b).motion(m)), of_motion(a.motion(b.motion(m)))));
        prop_assert!(close(of_force(a.then(&b).force(f)), of_force(a.force(b.force(f)))));
        prop_assert!(close(of_motion(a.inverse().motion(a.motion(m))), of_motion(m)));
        prop_assert!(close(of_force(a.inverse().force(a.force(f))), of_force(f)));
        prop_assert!(close(of_motion(a.motion_back(m)), of_motion(a.inverse().motion(m))));
        prop_assert!(close(of_force(a.force_back(f)), of_force(a.inverse().force(f))));
    }

    #[test]
    fn power_is_the_same_in_every_frame(a in frame(), m in motion(), f in force(), r in vector()) {
        let (power, size) = (m.power(f), 100.0);
        prop_assert!(near(a.motion(m).power(a.force(f)), power, size));
        prop_assert!(near(m.at(-r).power(f.from_arm(r)), power, size));
    }

    #[test]
    fn cross_products_are_dual_and_obey_jacobi(m in motion(), n in motion(), k in motion(), f in force()) {
        prop_assert!(near(m.cross(n).power(f), -n.power(m.cross_force(f)), 300.0));
        prop_assert!(close(of_motion(m.cross(m)), Six::zeros()));
        let jacobi = m.cross(n.cross(k)) + n.cross(k.cross(m)) + k.cross(m.cross(n));
        prop_assert!(of_motion(jacobi).amax() < 1e-11);
    }

    #[test]
    fn cross_products_are_rates_of_transforms(m in motion(), n in motion(), f in force()) {
        // A frame that moves by m for a short time: what is fixed in it changes by m × n, m ×* f.
        // Central differences.
        let h = 1e-5;
        let moved = |h: f64| -> Transform {
            let turn = UnitQuaternion::from_scaled_axis(h * Vec3::from(m.angular));
            Pose::from_parts((h * Vec3::from(m.linear)).into(), turn).into()
        };
        let rate = (of_motion(moved(h).motion(n)) - of_motion(moved(-h).motion(n))) / (2.0 * h);
        prop_assert!((rate - of_motion(m.cross(n))).amax() < 1e-7);
        let rate = (of_force(moved(h).force(f)) - of_force(moved(-h).force(f))) / (2.0 * h);
        prop_assert!((rate - of_force(m.cross_force(f))).amax() < 1e-7);
    }

    #[test]
    fn kinetic_energy_and_momentum_of_a_rigid_body((mass, center, about) in body(), v in motion(), a in frame()) {
        let inertia = Inertia::new(mass, &center, &about);
        let omega = Vec3::from(v.angular);
        let velocity = Vec3::from(v.linear) + omega.cross(&center);
        let doubled = mass * velocity.norm_squared() + omega.dot(&(about * omega));
        prop_assert!(near(inertia.doubled_energy(v), doubled, doubled));
        let momentum = six((about * omega + center.cross(&(mass * velocity))).into(), (mass * velocity).into());
        prop_assert!(close(of_force(inertia.times(v)), momentum));
        // The same body seen from another frame has the same energy, and its momentum is that force
        // seen from there.
        let seen = inertia.seen_from(&a);
        let scale = doubled + of_force(a.force(inertia.times(v))).amax() * of_motion(a.motion(v)).amax();
        prop_assert!(near(seen.doubled_energy(a.motion(v)), doubled, scale));
        prop_assert!((of_force(seen.times(a.motion(v))) - of_force(a.force(inertia.times(v)))).amax() < 1e-12 * (1.0 + scale));
    }

    #[test]
    fn articulated_inertia_is_its_six_by_six((ia, dense) in articulated(), m in motion(), r in vector(), s in vector(), d in 0.0..2.0f64) {
        prop_assert!(close(of_force(ia.times(m)), dense * of_motion(m)));
        prop_assert!(close(of_force(ia.times_angular(s)), dense * six(s, Vector::default())));
        prop_assert!(close(of_force(ia.times_linear(s)), dense * six(Vector::default(), s)));
        let u = ia.times_angular(s);
        let less = dense - d * of_force(u) * of_force(u).transpose();
        prop_assert!((of_force(ia.minus_square(u, d).times(m)) - less * of_motion(m)).amax() < 1e-12 * (1.0 + less.amax() * 20.0));
        // X = [1 0; −r× 1] by its columns.
        let x = SixSquare::from_columns(&std::array::from_fn::<Six, 6, _>(|k| {
            let e = Six::ith(k, 1.0);
            let (angular, linear) = (Vec3::new(e[0], e[1], e[2]), Vec3::new(e[3], e[4], e[5]));
            six(angular.into(), (linear - Vec3::from(r).cross(&angular)).into())
        }));
        let shifted = x.transpose() * dense * x;
        prop_assert!((of_force(ia.from_arm(r).times(m)) - shifted * of_motion(m)).amax() < 1e-12 * (1.0 + shifted.amax() * 20.0));
    }

    #[test]
    fn a_rigid_body_is_an_articulated_one((mass, center, about) in body(), m in motion()) {
        let inertia = Inertia::new(mass, &center, &about);
        prop_assert!(close(of_force(ArticulatedInertia::rigid(&inertia).times(m)), of_force(inertia.times(m))));
        let cross = Mat3::new(0.0, -center.z, center.y, center.z, 0.0, -center.x, -center.y, center.x, 0.0);
        let dense = blocks(about - mass * cross * cross, mass * cross, mass * Mat3::identity());
        prop_assert!(close(of_force(inertia.times(m)), dense * of_motion(m)));
    }

    #[test]
    fn matrices_do_as_nalgebras(a in [vector(), vector(), vector()], b in [vector(), vector(), vector()], v in vector()) {
        let (a, b) = (Matrix::new(a[0], a[1], a[2]), Matrix::new(b[0], b[1], b[2]));
        let (ma, mb, mv) = (Mat3::from(a), Mat3::from(b), Vec3::from(v));
        prop_assert!((Mat3::from(a * b) - ma * mb).amax() < 1e-13 && (Mat3::from(a.times_constant(&b)) - ma * mb).amax() < 1e-13);
        prop_assert!((Vec3::from(a * v) - ma * mv).amax() < 1e-13 && (Vec3::from(a.transposed_times(v)) - ma.transpose() * mv).amax() < 1e-13);
        let symmetric = Symmetric::of_pair(a.x, a.y);
        let dense = ma.column(0) * ma.column(1).transpose() + ma.column(1) * ma.column(0).transpose();
        prop_assert!((Mat3::from(symmetric) - dense).amax() < 1e-13 && (Vec3::from(symmetric * v) - dense * mv).amax() < 1e-12);
    }
}

//! Batches in lanes give the bits of one state alone; sine and cosine of the lanes against `libm`.

use crate::abm_reference::{Kinds, Numbers, random_state, random_tree};
use nalgebra::ComplexField;
use tumble_core::articulated::{BatchDynamics, Dynamics, Lanes, SingularJoint, forward_dynamics};
use tumble_core::collide::{Mat3, Pose, Vec3};
use tumble_core::spatial::Scalar;
use tumble_core::{Joint, LinkMass, Model, ModelBuilder};

const GRAVITY: Vec3 = Vec3::new(0.2, -0.1, -9.81);

type State = (Vec<f64>, Vec<f64>, Vec<f64>);

fn gather<const N: usize>(states: &[State], pick: impl Fn(&State) -> &Vec<f64>) -> Vec<Lanes<N>> {
    (0..pick(&states[0]).len()).map(|k| Lanes(std::array::from_fn(|lane| pick(&states[lane])[k]))).collect()
}

/// Compares both layouts of a batch with one state at a time.
fn check<const N: usize>(model: &Model, states: &[State]) {
    let (q, v, tau) = (gather::<N>(states, |s| &s.0), gather::<N>(states, |s| &s.1), gather::<N>(states, |s| &s.2));
    let mut alone = Dynamics::new(model);
    for mut batch in [BatchDynamics::<N>::new(model), BatchDynamics::<N>::plain(model)] {
        let mut found = vec![Lanes([f64::NAN; N]); model.dof()];
        let held = batch.forward_dynamics(&GRAVITY, &q, &v, &tau, &mut found).err();
        let mut first = None;
        for (lane, (q, v, tau)) in states.iter().take(N).enumerate() {
            let mut wanted = vec![0.0; model.dof()];
            let singular = forward_dynamics(&mut alone, &GRAVITY, q, v, tau, &mut wanted).err();
            first = first.or(singular.map(|SingularJoint { link, .. }| SingularJoint { lane, link }));
            let bits = |x: f64| x.to_bits();
            let same = found.iter().zip(&wanted).all(|(f, w)| bits(f.0[lane]) == bits(*w));
            assert!(same && wanted.iter().all(|x| x.is_finite()), "lane {lane} of {N}: {found:?} {wanted:?}");
        }
        assert_eq!(held, first);
    }
}

fn check_all(model: &Model, states: &[State]) {
    check::<1>(model, states);
    check::<3>(model, states);
    check::<4>(model, states);
    check::<8>(model, states);
    check::<12>(model, states);
    check::<16>(model, states);
}

#[test]
fn a_lane_has_the_bits_of_its_state_alone() {
    for (links, seed) in [(1, 1), (2, 2), (5, 3), (9, 4), (30, 5), (100, 6)] {
        for kinds in [Kinds::Hinges, Kinds::All] {
            let model = random_tree(links, kinds, seed);
            let state = |k: u64| {
                let (q, v) = random_state(&model, seed + k);
                (q, v, Numbers::new(seed + 50 + k).list(model.dof(), 2.0))
            };
            check_all(&model, &(0..16).map(state).collect::<Vec<State>>());
        }
    }
}

#[test]
fn a_lane_of_far_angles_or_of_gimbal_lock_disturbs_no_other() {
    let mut builder = ModelBuilder::new();
    let outer = builder.link("yaw", None, Joint::revolute(Vec3::z()), Pose::identity(), LinkMass::none());
    let middle = builder.link("pitch", Some(outer), Joint::revolute(Vec3::y()), Pose::identity(), LinkMass::none());
    let body = LinkMass {
        mass: 1.0,
        center: Vec3::new(0.1, 0.0, 0.2),
        inertia: Mat3::from_diagonal(&Vec3::new(0.1, 0.2, 0.3)),
    };
    builder.link("roll", Some(middle), Joint::revolute(Vec3::x()), Pose::identity(), body);
    let model = builder.build().unwrap();
    let near = [0.1, 3e7, std::f64::consts::FRAC_PI_2, -1e12, 0.4, -0.5, 1.0, 2.0];
    let pitch: Vec<f64> = near.iter().chain(&near.map(|x| 0.3 - x)).copied().collect();
    let states: Vec<State> =
        pitch.iter().map(|&pitch| (vec![0.3, pitch, 1.1], vec![1.0, 2.0, 3.0], vec![0.1; 3])).collect();
    check_all(&model, &states);
}

/// Returns the number of floats between two numbers of the same sign, or the sum of their distances
/// to 0.
fn steps_between(a: f64, b: f64) -> u64 {
    let key =
        |x: f64| if x.is_sign_negative() { -((x.to_bits() & (u64::MAX >> 1)) as i64) } else { x.to_bits() as i64 };
    key(a).abs_diff(key(b))
}

#[test]
fn sine_and_cosine_are_libms_to_one_step() {
    let mut n = Numbers::new(1);
    let mut angles: Vec<f64> =
        [0.0, 1e-300, 1e-9, 0.5, 1e6, 1.000_000_1e6, 1e15, 1e300].into_iter().flat_map(|x| [x, -x]).collect();
    for size in [1e-3, 0.8, 4.0, 30.0, 1e3, 1e5, 1e6, 1e8] {
        angles.extend(n.list(40_000, size));
    }
    for k in 0..20_000 {
        // Next to multiples of π/4, where a quarter begins or a result is near 0.
        let near = f64::from(k) * std::f64::consts::FRAC_PI_4;
        angles.extend([near, -near, near.next_up(), near.next_down()]);
    }
    let mut differing = 0;
    for &x in &angles {
        let (s, c) = x.sin_cos_pair();
        let (s1, c1) = ComplexField::sin_cos(x);
        assert!(steps_between(s, s1) <= 1 && steps_between(c, c1) <= 1, "{x:e}: {s:e} {s1:e}, {c:e} {c1:e}");
        differing += u32::from(s != s1) + u32::from(c != c1);
    }
    assert!(f64::from(differing) < 0.1 * angles.len() as f64, "{differing} of {}", 2 * angles.len());
    for x in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let (s, c) = x.sin_cos_pair();
        assert!(s.is_nan() && c.is_nan());
    }
}

/// [`Scalar::sin_cos`] by a name that `f64`'s own method does not hide.
trait Pair {
    fn sin_cos_pair(self) -> (f64, f64);
}

impl Pair for f64 {
    fn sin_cos_pair(self) -> (f64, f64) {
        Scalar::sin_cos(self)
    }
}

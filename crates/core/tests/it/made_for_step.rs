//! Objects that are made for steps of one length.

use crate::common::*;
use tumble_core::*;

/// A mass on a line, `X = [x, v]`, `M = 1 kg`, made for steps of one length.
#[derive(Clone)]
struct Slider(Option<f64>);

impl Object for Slider {
    fn name(&self) -> &str {
        "slider"
    }
    fn integratable(&self) -> Option<&dyn Integratable> {
        Some(self)
    }
}

impl Integratable for Slider {
    fn state_sizes(&self) -> StateSizes {
        StateSizes { x: 2, dof: 1, parts: 0 }
    }
    fn write_initial(&self, x: &mut [f64]) {
        x.copy_from_slice(&[0.0, 1.0]);
    }
    fn jacobian(&self, _cache: &mut Cache, _at: &PartPoint, _j: &mut [f64]) {}
    fn mul_l(&self, _cache: &mut Cache, v: &[f64], u: &mut [f64]) {
        u[0] = v[0];
    }
    fn solve_l(&self, _cache: &mut Cache, u: &[f64], v: &mut [f64]) {
        v[0] = u[0];
    }
    fn solve_lt(&self, _cache: &mut Cache, j: &[f64], y: &mut [f64]) {
        y[0] = j[0];
    }
    fn mul_lt(&self, _cache: &mut Cache, du: &[f64], j: &mut [f64]) {
        j[0] = du[0];
    }
    fn made_for_step(&self) -> Option<f64> {
        self.0
    }
}

const DT: f64 = 1.0 / 240.0;

#[test]
fn lengths_that_no_stepper_can_take_are_refused() {
    for wrong in [0.0, -0.0, -DT, f64::NAN, f64::INFINITY, f64::MIN_POSITIVE, 0.99e-4 * DT] {
        let mut world = world("backtracking", DT);
        world.add(Slider(Some(DT))).unwrap();
        world.step().unwrap();
        let slider = world.ids()[0];
        world.get_mut::<Slider>(slider).unwrap().0 = Some(wrong);
        let before = world.save();
        let error = world.step().unwrap_err();
        assert!(
            matches!(&error, StepError::MadeForStep { object, step, .. } if object == "slider" && (*step == wrong || wrong.is_nan())),
            "{wrong}: {error}"
        );
        assert!(error.to_string().contains(&format!("is made for steps of {wrong} s")), "{error}");
        assert_eq!(world.save(), before);
    }
}

#[test]
fn admissible_lengths_divide_the_frame() {
    for length in [None, Some(DT), Some(0.5 * DT), Some(1e-4 * DT), Some(3.0 * DT), Some(1e300)] {
        let mut world = world("backtracking", DT);
        world.add(Slider(length)).unwrap();
        world.step().unwrap();
        assert!((world.state()[0] - DT).abs() < 1e-9 && world.time() == DT, "{length:?}");
    }
}

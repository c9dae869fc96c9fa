//! One-sided rows of constraints, located in time like contacts.

use crate::common::*;
use tumble_core::collide::Vec3;
use tumble_core::rows::RowSet;
use tumble_core::*;

/// A pendulum with one joint: `X = [θ, ω]`, `M = 1 kg·m²`, torque `−pull·sin θ`, one-sided stops at
/// `θ = stops`.
#[derive(Clone)]
struct Pendulum {
    angle: f64,
    rate: f64,
    pull: f64,
    stops: [f64; 2],
    /// Whether it reports its gaps.
    located: bool,
}

impl Pendulum {
    fn energy_at(&self, angle: f64) -> f64 {
        self.pull * (1.0 - angle.cos())
    }
}

impl Object for Pendulum {
    fn name(&self) -> &str {
        "pendulum"
    }
    fn integratable(&self) -> Option<&dyn Integratable> {
        Some(self)
    }
    fn constraint(&self) -> Option<&dyn Constraint> {
        Some(self)
    }
}

impl Integratable for Pendulum {
    fn state_sizes(&self) -> StateSizes {
        StateSizes { x: 2, dof: 1, parts: 0 }
    }
    fn write_initial(&self, x: &mut [f64]) {
        x.copy_from_slice(&[self.angle, self.rate]);
    }
    fn accumulate_forces(&self, me: &StateRange, view: &WorldView, out: &mut Forces) {
        out.generalized[me.v.start] -= self.pull * view.x[me.x.start].sin();
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
    fn energy(&self, x: &[f64], _gravity: &Vec3) -> Energy {
        Energy { kinetic: 0.5 * x[1] * x[1], potential: self.energy_at(x[0]) }
    }
}

impl Constraint for Pendulum {
    fn rows(&self, me: &StateRange, view: &WorldView, _level: Level, out: &mut RowBuilder) {
        let (owner, angle) = (out.owner(), view.x[me.x.start]);
        out.row(RowTarget::new(RowSet::HalfLine, angle - self.stops[0])).on_coordinates(owner, &[1.0]);
        out.row(RowTarget::new(RowSet::HalfLine, self.stops[1] - angle)).on_coordinates(owner, &[-1.0]);
    }
    fn gaps(&self, me: &StateRange, view: &WorldView, out: &mut Vec<f64>) {
        let angle = view.x[me.x.start];
        if self.located {
            out.extend([angle - self.stops[0], self.stops[1] - angle]);
        }
    }
}

fn with(integrator: Integrator, pendulum: Pendulum) -> (World, ObjectId) {
    let mut world = world("backtracking", 1.0 / 60.0);
    world.set_settings(world.settings().with_integrator(integrator)).unwrap();
    let id = world.add(pendulum).unwrap();
    (world, id)
}

const BOTH: [Integrator; 2] = [Integrator::Verlet, Integrator::DormandPrince];

/// It falls from −1.5 rad to the stop at 0.5 at 3.4 rad/s, loses its kinetic energy there, and
/// swings back from rest: its energy is that of the stop's height.
#[test]
fn a_swing_ends_at_its_stop() {
    for integrator in BOTH {
        let start = Pendulum { angle: -1.5, rate: 0.0, pull: G, stops: [-2.0, 0.5], located: true };
        let stop_energy = start.energy_at(0.5);
        let (mut world, id) = with(integrator, start);
        let (mut furthest, mut struck, mut tries) = (f64::MIN, 0, 0);
        for _ in 0..60 {
            let before = world.energy().total();
            let report = *world.step().unwrap();
            tries = tries.max(report.tries);
            furthest = furthest.max(world.state_of(id).unwrap()[0]);
            if world.energy().total() < 0.5 * before {
                struck += 1;
            }
        }
        let energy = world.energy().total();
        println!(
            "{integrator:?}: struck {struck}, furthest {furthest}, energy {:e} off, {tries} tries",
            energy / stop_energy - 1.0
        );
        assert!(struck == 1 && furthest < 0.5 + 1e-6, "{integrator:?}: struck {struck} times, came to {furthest} rad");
        // 1e-6 rad are g·sin θ·1e-6 J at the stop; the energy of the leapfrog swings by h²/8·(g·sin
        // θ)² about that
        let slope = G * 0.5f64.sin();
        let own = if integrator == Integrator::Verlet { (slope / 60.0).powi(2) / 8.0 } else { 1e-7 };
        assert!((energy - stop_energy).abs() < 1e-6 * slope + own, "{integrator:?}: {energy} J, by hand {stop_energy}");
    }
}

/// Pressed against its stop, it stays within 1e-6 rad of it from the first frame after the impact,
/// and needs no more than two tries per frame.
#[test]
fn a_joint_pressed_against_a_stop_rests_there() {
    for integrator in BOTH {
        // it falls over from 0.1 rad: e^{√g·t}
        let (mut world, id) =
            with(integrator, Pendulum { angle: 0.1, rate: 0.0, pull: -G, stops: [-2.0, 1.2], located: true });
        let mut arrived = None;
        for frame in 0..240 {
            let report = *world.step().unwrap();
            let x = world.state_of(id).unwrap();
            let (gap, rate) = (1.2 - x[0], x[1]);
            assert!(gap > -1e-6, "{integrator:?}: frame {frame}: {:e} rad beyond the stop", -gap);
            if gap < 1e-6 && arrived.is_none() {
                arrived = Some(frame);
            } else if let Some(first) = arrived {
                assert!(
                    gap < 1e-6 && rate.abs() < 1e-9,
                    "{integrator:?}: frame {frame}, {first} was the stroke: {gap:e} rad from it with {rate:e} rad/s"
                );
                assert!(report.tries <= 2, "{integrator:?}: frame {frame}: {} tries", report.tries);
            }
        }
        println!("{integrator:?}: {arrived:?}");
        assert!(arrived.is_some_and(|frame| frame < 120), "{integrator:?}: {arrived:?}");
    }
}

/// Without a force the time of impact is distance over speed, for any frame length; the stop has no
/// effect before it.
#[test]
fn a_stop_acts_when_it_is_reached_and_not_before() {
    for integrator in BOTH {
        let (mut world, id) =
            with(integrator, Pendulum { angle: 0.0, rate: 5.0, pull: 0.0, stops: [-1.0, 0.21], located: true });
        // 0.042 s: two frames and a half
        for frame in 1..=4 {
            world.step().unwrap();
            let (x, free) = (world.state_of(id).unwrap(), frame <= 2);
            let expected = if free { [5.0 * frame as f64 / 60.0, 5.0] } else { [0.21, 0.0] };
            assert!(
                (x[0] - expected[0]).abs() <= 1.0e-7 && (x[1] - expected[1]).abs() < 1e-12,
                "{integrator:?}: frame {frame}: {x:?}"
            );
        }
    }
}

/// A limit without a reported gap is not located in time: it decelerates the joint early and never
/// lets it through.
#[test]
fn a_limit_without_a_reported_gap_decelerates_early() {
    for integrator in BOTH {
        let (mut world, id) =
            with(integrator, Pendulum { angle: 0.0, rate: 5.0, pull: 0.0, stops: [-1.0, 0.21], located: false });
        for _ in 0..6 {
            world.step().unwrap();
        }
        let x = world.state_of(id).unwrap();
        assert!((x[0] - 0.21).abs() < 1e-6 && x[1].abs() < 1e-6, "{integrator:?}: {x:?}");
    }
}

/// A world that begins beyond a stop runs, and returns at the recovery speed.
#[test]
fn a_start_beyond_a_stop_is_recovered_from() {
    for integrator in BOTH {
        let (mut world, id) =
            with(integrator, Pendulum { angle: 0.5, rate: 0.0, pull: 0.0, stops: [-1.0, 0.4], located: true });
        for _ in 0..6 {
            let report = world.step().unwrap();
            assert!(report.tries < 10);
        }
        // 3 rad/s · 6/60 s
        let x = world.state_of(id).unwrap();
        assert!((x[0] - 0.4).abs() < 1e-6 && x[1].abs() < 1e-6, "{integrator:?}: {x:?}");
    }
}

#[test]
fn a_gap_that_is_no_number_is_an_error() {
    let (mut world, _) = with(
        Integrator::Verlet,
        Pendulum { angle: 0.0, rate: 0.0, pull: 0.0, stops: [f64::NEG_INFINITY, 1.0], located: true },
    );
    assert!(matches!(world.step().unwrap_err(), StepError::Row { object, .. } if object == "pendulum"));
}

/// The first joint of a double pendulum falls on a stop and is held there by its weight, while the
/// second swings on as a pendulum: the first stays on the stop, and energy is conserved after the
/// impact.
#[test]
fn a_joint_is_held_at_its_stop_while_the_next_one_swings() {
    for integrator in BOTH {
        let mut world = world("backtracking", 1.0 / 240.0);
        world.set_settings(world.settings().with_integrator(integrator)).unwrap();
        let mut body = ArticulatedBody::new(
            "chain",
            crate::articulated_world::hinged(2, 0.2, crate::articulated_world::rod(1.0, 0.2)),
        )
        .with_positions(&[0.8, -0.3])
        .unwrap();
        body.set_dof(0, DofSettings { limits: Some([0.6, 2.0]), ..DofSettings::default() }).unwrap();
        let id = world.add(body).unwrap();
        let (mut arrived, mut swing, mut off, mut drift, mut tries) = (None, [f64::MAX, f64::MIN], 0.0f64, 0.0f64, 0);
        for frame in 0..1200 {
            let report = *world.step().unwrap();
            let (x, energy) = (world.state_of(id).unwrap(), world.energy().total());
            let gap = x[0] - 0.6;
            assert!(gap > -1e-6, "{integrator:?}: frame {frame}: {:e} rad beyond the stop", -gap);
            let Some((_, start)) = arrived else {
                arrived = (gap < 1e-6).then_some((frame, energy));
                continue;
            };
            (off, tries) = (off.max(gap.abs()), tries.max(report.tries));
            drift = drift.max((energy - start).abs());
            swing = [swing[0].min(x[1]), swing[1].max(x[1])];
        }
        println!("{integrator:?}: arrived {arrived:?}, off {off:e}, swing {swing:?}, drift {drift:e}, {tries} tries");
        // the swing exchanges 0.28 J
        assert!(arrived.is_some() && swing[1] - swing[0] > 1.0, "{integrator:?}: {arrived:?}, {swing:?}");
        assert!(
            off < 1e-9 && drift < 2e-4 && tries == 1,
            "{integrator:?}: {off:e} rad off the stop, energy off by {drift:e} J, {tries} tries"
        );
    }
}

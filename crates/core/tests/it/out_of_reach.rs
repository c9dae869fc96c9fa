//! Closures that are led to where they cannot be: what hangs on them stays sane, lags behind, and closes again.

use crate::articulated_world::{hinged, rod, world};
use crate::common::*;
use tumble_core::collide::{Pose, Vec3};
use tumble_core::*;

/// A chain of so many links of 0.2 m from the origin, whose end a hand leads.
struct Led {
    world: World,
    chain: ObjectId,
    hand: ObjectId,
    closure: ObjectId,
    links: usize,
    report: Option<OutOfReach>,
}

const LENGTH: f64 = 0.2;

impl Led {
    /// Hung up in a zigzag of `angle` from −z, and pinned to the hand where it ends.
    fn new(stepper: &str, links: usize, angle: f64) -> Led {
        let mut world = world(1.0 / 240.0, stepper, Integrator::Verlet);
        let q: Vec<f64> = (0..links).map(|i| if i == 0 { angle } else if i % 2 == 1 { -2.0 * angle } else { 2.0 * angle }).collect();
        let chain = ArticulatedBody::new("chain", hinged(links, LENGTH, rod(1.0, LENGTH))).with_positions(&q).unwrap();
        let chain = world.add(chain).unwrap();
        let last = world.site(chain, links - 1).unwrap().pose;
        let end = last.translation.vector - LENGTH * (last.rotation * Vec3::z());
        let mut hand = RigidBody::fixture("hand", sphere(0.01)).at(Pose::translation(end.x, end.y, end.z));
        hand.meets = 0;
        let hand = world.add_boxed(Box::new(hand), Mode::Kinematic).unwrap();
        let pin = Closure::point_at("pin", &world, Some((chain, links - 1)), Some((hand, 0)), end).unwrap();
        let closure = world.add(pin).unwrap();
        Led { world, chain, hand, closure, links, report: None }
    }

    fn misfit(&self) -> f64 {
        self.world.get::<Closure>(self.closure).unwrap().misfit(&self.world.view()).unwrap().distance
    }

    /// Fastest joint, rad/s.
    fn fastest(&self) -> f64 {
        self.world.state_of(self.chain).unwrap()[self.links..].iter().fold(0.0, |a: f64, v| a.max(v.abs()))
    }

    /// Leads the hand for so many seconds; the fastest joint and the largest misfit on the way.
    fn lead(&mut self, velocity: Vec3, seconds: f64) -> (f64, f64) {
        let (mut fastest, mut misfit): (f64, f64) = (0.0, 0.0);
        for _ in 0..(seconds * 240.0).round() as usize {
            self.world.set_velocity(self.hand, velocity, Vec3::zeros()).unwrap();
            let report = *self.world.step().unwrap();
            self.report = report.out_of_reach;
            fastest = fastest.max(self.fastest());
            misfit = misfit.max(self.misfit());
        }
        (fastest, misfit)
    }
}

#[test]
fn probe() {
    for stepper in STEPPERS {
        for links in [2, 5] {
            for along in [Vec3::new(0.0, 0.0, -0.5), Vec3::new(0.35, 0.0, -0.35), Vec3::new(0.0, 0.3, -0.4)] {
                let mut led = Led::new(stepper, links, 0.5);
                for k in 0..8 {
                    let (fastest, misfit) = led.lead(along, 0.25);
                    let hand = position(&led.world, led.hand);
                    println!("{stepper} {links} {along:?} out {k}: {fastest:.3e} rad/s, misfit {misfit:.4e}, beyond {:.4} {:?}", hand.norm() - links as f64 * LENGTH, led.report.map(|r| r.distance));
                }
                for k in 0..10 {
                    let (fastest, misfit) = led.lead(if k < 8 { -along } else { Vec3::zeros() }, 0.25);
                    println!("{stepper} {links} {along:?} back {k}: {fastest:.3e} rad/s, misfit {misfit:.4e} now {:.2e}", led.misfit());
                }
            }
        }
    }
}

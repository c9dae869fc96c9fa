//! Limits of joints in `time_stepping`: no joint passes one by the end of a step, however fast its
//! links swing about each other.

use crate::articulated_world::rod;
use tumble_core::collide::{Pose, Vec3};
use tumble_core::{ArticulatedBody, DofSettings, Joint, ModelBuilder, Settings, World};

/// Six rods of 0.2 m on revolute joints about y and x in turn: the first turns freely, the others
/// within ±0.4 rad.
fn whip(rates: &[f64; 6]) -> ArticulatedBody {
    let mut builder = ModelBuilder::new();
    let mut parent = None;
    for i in 0..6 {
        let placement = if i == 0 { Pose::identity() } else { Pose::translation(0.0, 0.0, -0.2) };
        let axis = if i % 2 == 0 { Vec3::y() } else { Vec3::x() };
        parent = Some(builder.link(format!("link {i}"), parent, Joint::revolute(axis), placement, rod(1.0, 0.2)));
    }
    let mut body = ArticulatedBody::new("whip", builder.build().unwrap()).with_velocities(rates).unwrap();
    (1..6).for_each(|i| body.set_dof(i, DofSettings { limits: Some([-0.4, 0.4]), ..DofSettings::default() }).unwrap());
    body
}

/// An earlier version estimated the end of a step from the velocities of its middle and projected
/// the estimate in 15 sweeps: limits were exceeded by 1e-3 rad and more, and the correction of the
/// joints gained energy.
#[test]
fn links_that_swing_about_each_other_keep_to_their_limits() {
    for rate in [60.0, 120.0, 240.0] {
        let mut world = World::new(Settings::default().with_dt(1.0 / rate)).unwrap();
        let id = world.add(whip(&[12.0, 9.0, -14.0, 11.0, -8.0, 13.0])).unwrap();
        let (start, mut worst, mut highest) = (world.energy().total(), 0.0f64, f64::MIN);
        for _ in 0..(3.0 * rate) as usize {
            world.step().unwrap();
            highest = highest.max(world.energy().total());
            let x = world.state_of(id).unwrap();
            worst = x[1..6].iter().fold(worst, |worst, q| worst.max(q.abs() - 0.4));
        }
        println!(
            "at {rate} Hz: past a limit by {worst:.1e} rad; energy at most {highest:.3} J, at the start {start:.3} J"
        );
        assert!(worst <= 1e-6, "at {rate} Hz a limit is passed by {worst:e} rad");
    }
}

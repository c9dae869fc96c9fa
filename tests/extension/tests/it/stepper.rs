//! A stepper of another crate in a world.

use crate::common::*;
use tumble_core::collide::{Pose, Shape, Vec3};
use tumble_core::*;
use tumble_extension::Graded;

/// A ball thrown at the ground at 3 m/s.
fn thrown(settings: Settings, stepper: Box<dyn Stepper>) -> World {
    let mut world = World::new(settings.with_dt(1.0 / 60.0)).unwrap();
    world.set_stepper(stepper);
    let material = Material { restitution: 0.5, friction: 0.3, ..Material::default() };
    world.add_static(RigidBody::fixed(Shape::half_space()).with_material(material)).unwrap();
    let ball = RigidBody::new(sphere(0.1)).with_mass(1.0).with_material(material);
    world.add(ball.with_pose(Pose::translation(0.0, 0.0, 0.3)).with_velocity(Vec3::new(2.4, 0.0, -1.8))).unwrap();
    world
}

/// 3 m/s in 1/60 s are 50 mm: four sub-steps of 12.6 mm, bit for bit those of the setting. In the
/// end the ball rolls at 5/7 of 2.4 m/s (the angular momentum about the ground stays), 28.6 mm:
/// three sub-steps.
#[test]
fn a_stepper_of_another_crate_chooses_its_substeps() {
    let still = Settings::default().with_gravity(Vec3::zeros());
    let mut graded = thrown(still, Box::new(Graded::new(0.0126)));
    let mut plain = thrown(still.with_substeps(4), stepper_by_name("time_stepping").unwrap());
    assert_eq!(graded.step().unwrap().substeps, 4);
    plain.step().unwrap();
    assert_eq!(graded.state(), plain.state());

    let mut graded = thrown(Settings::default(), Box::new(Graded::new(0.0126)));
    let mut forked = graded.fork();
    for _ in 0..600 {
        graded.step().unwrap();
        forked.step().unwrap();
    }
    assert_eq!(graded.report().substeps, 3);
    assert!(graded.save() == forked.save());
}

/// Steps to the middle of a frame, goes back to its start, and takes it whole; or forgets to.
struct Hesitant(TimeStepping, bool);

impl Stepper for Hesitant {
    fn name(&self) -> &'static str {
        "hesitant"
    }
    fn step(&mut self, mut frame: StepContext) -> Result<(), StepError> {
        let (dt, mut start) = (frame.settings().dt, WorldState::default());
        frame.checkpoint(&mut start);
        frame.substep(&mut self.0, 0.5 * dt)?;
        if self.1 {
            assert!(frame.roll_back(&start) && frame.report().substeps == 1);
            frame.substep(&mut self.0, dt)?;
        }
        Ok(())
    }
    fn fork(&self) -> Box<dyn Stepper> {
        Box::new(Hesitant(TimeStepping::default(), self.1))
    }
}

#[test]
fn a_stepper_tries_again_within_a_frame_and_must_reach_its_end() {
    let stepper = |whole| Box::new(Hesitant(TimeStepping::default(), whole));
    let mut tried = thrown(Settings::default(), stepper(true));
    let mut plain = thrown(Settings::default(), stepper_by_name("time_stepping").unwrap());
    for _ in 0..60 {
        tried.step().unwrap();
        plain.step().unwrap();
    }
    assert_eq!(tried.state(), plain.state());
    let mut short = thrown(Settings::default(), stepper(false));
    let before = short.save();
    let error = short.step().unwrap_err();
    assert!(matches!(error, StepError::Duration { stepper: "hesitant", .. }), "{error}");
    assert!(short.save() == before);
}

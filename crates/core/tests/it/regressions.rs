//! Regression tests of contacts and impacts, each with the correct number.

use crate::common::*;
use tumble_core::collide::{Pose, Shape, Vec3};
use tumble_core::*;

/// A billiard ball without friction, e = 1.
const R: f64 = 0.0286;

fn billiard(world: &mut World, name: &str, at: [f64; 3], v: f64) -> ObjectId {
    let ball = RigidBody::new(sphere(R)).with_name(name).with_mass(0.17).with_material(Material {
        restitution: 1.0,
        friction: 0.0,
        ..Material::default()
    });
    world.add(ball.with_pose(Pose::translation(at[0], at[1], at[2])).with_velocity(Vec3::new(v, 0.0, 0.0))).unwrap()
}

/// A kinematic plate with its top at z = 0.1.
fn kinematic_plate(world: &mut World) -> ObjectId {
    let plate = RigidBody::fixed(Shape::cuboid(Vec3::new(2.0, 2.0, 0.2)).unwrap())
        .with_name("plate")
        .with_material(Material { friction: 0.5, ..Material::default() });
    world.add_boxed(Box::new(plate), Mode::Kinematic).unwrap()
}

fn box_on_plate(world: &mut World) -> ObjectId {
    let body = RigidBody::new(cube(0.2))
        .with_name("box")
        .with_mass(1.0)
        .with_material(Material { friction: 0.5, ..Material::default() });
    world.add(body.with_pose(Pose::translation(0.0, 0.0, 0.2))).unwrap()
}

/// Returns the distance between the box and the plate's top.
fn gap(world: &World, body: ObjectId, plate: ObjectId) -> f64 {
    position(world, body).z - position(world, plate).z - 0.2
}

#[test]
fn a_box_on_a_plate_that_starts_to_rise_is_not_thrown_off() {
    // the plate's velocity already carries the box: a further push out of the plate would lift it.
    // e = 0: the gap stays 0.
    for stepper in STEPPERS {
        let mut world = world(stepper, 1.0 / 60.0);
        let plate = kinematic_plate(&mut world);
        let body = box_on_plate(&mut world);
        for frame in 0..60 {
            let v = if frame < 20 { 0.0 } else { 1.0 };
            world.set_velocity(plate, Vec3::new(0.0, 0.0, v), Vec3::zeros()).unwrap();
            world.step().unwrap();
            assert!(
                gap(&world, body, plate).abs() < 1e-6,
                "{stepper} frame {frame}: {} m above the plate",
                gap(&world, body, plate)
            );
        }
        assert!((velocity(&world, body).z - 1.0).abs() < 1e-9, "{stepper}");
    }
}

#[test]
fn a_ball_that_starts_inside_a_rising_plate_ends_on_it() {
    // 1 mm deep; recovery of 3 m/s over 1/60 s may undo 50 mm: the gap is 0 after one frame, not
    // the plate's 1/60 m.
    for stepper in STEPPERS {
        let mut world = world(stepper, 1.0 / 60.0);
        let plate = kinematic_plate(&mut world);
        let ball = RigidBody::new(sphere(0.1))
            .with_name("ball")
            .with_mass(1.0)
            .with_material(Material { friction: 0.5, ..Material::default() })
            .with_pose(Pose::translation(0.0, 0.0, 0.199));
        let ball = world.add(ball.with_velocity(Vec3::z())).unwrap();
        world.set_velocity(plate, Vec3::z(), Vec3::zeros()).unwrap();
        world.step().unwrap();
        assert!(gap(&world, ball, plate).abs() < 1e-6, "{stepper}: {} m above the plate", gap(&world, ball, plate));
    }
}

#[test]
fn a_body_that_lands_elsewhere_does_not_lift_a_box_off_a_kinematic_plate() {
    // sub-steps and projections caused by the tumbler change the tumbler alone: the gap stays 0.
    for stepper in STEPPERS {
        for v in [0.0, 0.5] {
            let mut world = world(stepper, 1.0 / 60.0);
            world
                .add_static(
                    RigidBody::fixed(Shape::half_space())
                        .with_name("ground")
                        .with_pose(Pose::translation(0.0, 0.0, -1.0)),
                )
                .unwrap();
            let plate = kinematic_plate(&mut world);
            let body = box_on_plate(&mut world);
            let tumbler = RigidBody::new(Shape::cuboid(Vec3::new(0.2, 0.4, 0.3)).unwrap())
                .with_name("tumbler")
                .with_mass(1.0)
                .with_material(Material { restitution: 0.2, friction: 0.5, ..Material::default() });
            let tumbler =
                tumbler.with_pose(Pose::translation(4.0, 0.0, 0.0)).with_angular_velocity(Vec3::new(3.0, 2.0, 1.0));
            let tumbler = world.add(tumbler).unwrap();
            world.set_velocity(plate, Vec3::new(0.0, 0.0, v), Vec3::zeros()).unwrap();
            for frame in 0..90 {
                world.step().unwrap();
                assert!(
                    gap(&world, body, plate).abs() < 1e-6,
                    "{stepper} {v} m/s frame {frame}: {} m",
                    gap(&world, body, plate)
                );
            }
            assert!(position(&world, tumbler).z < -0.7, "{stepper}: the tumbler has landed");
        }
    }
}

#[test]
fn a_fast_off_center_hit_goes_along_the_line_of_centers_at_impact() {
    // Equal masses, e = 1, no friction, impact parameter b: at contact the line of centers makes
    // the angle θ with the velocity, sin θ = b/2R. The struck ball gets v·cos θ along it: (cos²θ,
    // sin θ·cos θ)·v, and the other keeps the rest (sin²θ, −sin θ·cos θ)·v.
    //
    // A stepper computes the normal at a gap of δ instead of 0: sin θ' = b/(2R + δ), so |δθ| = tan
    // θ·δ/2R, and the velocities, v/2·(1 ± cos 2θ, sin 2θ), have an error of v·|δθ|. Backtracking
    // ends within its contact tolerance (1e-7 m: 6.5e-7·v). time_stepping follows the flight until
    // the surfaces are within its drift tolerance (1e-4 m: 6.5e-4·v), because it treats such
    // contacts as touching.
    let (b, d) = (0.02, 2.0 * R);
    let (sin, cos) = (b / d, (1.0 - b * b / (d * d)).sqrt());
    for stepper in STEPPERS {
        for v in [10.0, 30.0, 60.0] {
            let mut world = no_gravity(world(stepper, 1.0 / 60.0));
            let near = if stepper == "backtracking" {
                world.settings().contact_tolerance
            } else {
                world.settings().drift_tolerance
            };
            let striker = billiard(&mut world, "striker", [0.0; 3], v);
            let struck = billiard(&mut world, "struck", [0.095, b, 0.0], 0.0);
            (0..3).for_each(|_| {
                world.step().unwrap();
            });
            let (a, c) = (velocity(&world, striker), velocity(&world, struck));
            let off =
                (c - v * cos * Vec3::new(cos, sin, 0.0)).norm().max((a - v * sin * Vec3::new(sin, -cos, 0.0)).norm());
            assert!(off < v * sin / cos * near / d, "{stepper} at {v} m/s: {off:e} m/s off: {a:?} {c:?}");
            assert!((a + c - Vec3::new(v, 0.0, 0.0)).norm() < 1e-12 * v, "{stepper}: momentum");
            assert!((a.norm_squared() + c.norm_squared() - v * v).abs() < 1e-12 * v * v, "{stepper}: energy");
        }
    }
}

#[test]
fn a_ball_that_misses_by_23_mm_strikes_nothing() {
    // the impact parameter of 80 mm exceeds two radii, 57.2 mm: no impulse, so the velocities keep
    // their bits.
    for stepper in STEPPERS {
        let mut world = no_gravity(world(stepper, 1.0 / 60.0));
        let a = billiard(&mut world, "flies", [0.0; 3], 10.0);
        let b = billiard(&mut world, "rests", [0.15, 0.08, 0.0], 0.0);
        (0..3).for_each(|_| {
            world.step().unwrap();
        });
        assert_eq!(velocity(&world, a), Vec3::new(10.0, 0.0, 0.0), "{stepper}");
        assert_eq!(
            (velocity(&world, b), position(&world, b)),
            (Vec3::zeros(), Vec3::new(0.15, 0.08, 0.0)),
            "{stepper}"
        );
        assert!((position(&world, a) - Vec3::new(0.5, 0.0, 0.0)).norm() < 1e-15, "{stepper}");
    }
}

#[test]
fn a_frozen_table_that_was_spinning_does_not_drag_what_lies_on_it() {
    // a static body is at rest, whatever momentum it has: the box on it rests too.
    for stepper in STEPPERS {
        for spin in [Vec3::zeros(), Vec3::new(10.0, 0.0, 0.0), Vec3::new(0.0, 0.0, 10.0)] {
            let mut world = world(stepper, 1.0 / 60.0);
            let table = RigidBody::new(Shape::cuboid(Vec3::new(2.0, 2.0, 0.2)).unwrap())
                .with_name("table")
                .with_mass(10.0)
                .with_material(Material { friction: 0.3, ..Material::default() });
            let table = world.add(table.with_angular_velocity(spin)).unwrap();
            world.set_mode(table, Mode::Static).unwrap();
            let body = RigidBody::new(cube(0.2))
                .with_name("box")
                .with_mass(1.0)
                .with_material(Material { friction: 0.3, ..Material::default() });
            let body = world.add(body.with_pose(Pose::translation(0.6, 0.0, 0.2))).unwrap();
            (0..30).for_each(|_| {
                world.step().unwrap();
            });
            let moved = (position(&world, body) - Vec3::new(0.6, 0.0, 0.2)).norm();
            assert!(moved < 1e-9 && velocity(&world, body).norm() < 1e-9, "{stepper} {spin:?}: moved by {moved:e} m");
            assert!(world.part_state(table, 0).unwrap().pose == Pose::identity(), "{stepper}: the table turned");
        }
    }
}

/// Simulates three equal balls in a row with gaps, the first with velocity `v`. Returns velocities
/// and positions along the row after `seconds`.
fn shock(stepper: &str, dt: f64, v: f64, gaps: [f64; 2], seconds: f64) -> [(f64, f64); 3] {
    let mut world = no_gravity(world(stepper, dt));
    let second = 2.0 * R + gaps[0];
    let x = [0.0, second, second + 2.0 * R + gaps[1]];
    let ids =
        [0, 1, 2].map(|i| billiard(&mut world, &format!("ball{i}"), [x[i], 0.0, 0.0], if i == 0 { v } else { 0.0 }));
    (0..(seconds / dt).round() as usize).for_each(|_| {
        world.step().unwrap();
    });
    ids.map(|id| (velocity(&world, id).x, position(&world, id).x))
}

fn assert_shock_passed(stepper: &str, dt: f64, v: f64, gaps: [f64; 2], seconds: f64) {
    // Equal masses, e = 1, head on: each impact passes the velocity on. 0, 0, v; the balls stop one
    // gap further, in order; the last flies for the remaining time.
    let out = shock(stepper, dt, v, gaps, seconds);
    assert!(
        out.iter().zip([0.0, 0.0, v]).all(|(o, v)| (o.0 - v).abs() < 1e-9),
        "{stepper} dt {dt:.4} v {v}: (v, x) {out:?}"
    );
    assert!(
        out[0].1 + 2.0 * R < out[1].1 + 1e-6 && out[1].1 + 2.0 * R < out[2].1 + 1e-6,
        "{stepper} dt {dt:.4}: out of order {out:?}"
    );
}

#[test]
fn a_shock_passes_through_separated_balls() {
    // 12 m/s at 1/60 s is 0.2 m per frame: a ball that is struck crosses a gap of 20 mm and strikes
    // the next ball within the same frame.
    assert_shock_passed("backtracking", 1.0 / 60.0, 12.0, [0.0028, 0.02], 0.05);
    for stepper in STEPPERS {
        assert_shock_passed(stepper, 1.0 / 240.0, 4.0, [0.001, 0.0048], 0.05);
    }
    assert_shock_passed("backtracking", 1.0 / 60.0, 4.0, [0.001, 0.0048], 0.05);
}

#[test]
fn a_ball_just_struck_does_not_tunnel_in_the_same_frame() {
    assert_shock_passed("time_stepping", 1.0 / 60.0, 4.0, [0.001, 0.0048], 0.05);
    assert_shock_passed("time_stepping", 1.0 / 60.0, 12.0, [0.0028, 0.02], 0.05);
}

#[test]
fn a_ball_sliding_along_a_capsule_is_carried_by_its_weight_in_every_frame() {
    // The contact moves with the ball, not with a material point of the capsule: there is no
    // curvature along the axis, so the resting force is m·g = 9.81 N.
    for stepper in STEPPERS {
        let mut world = world(stepper, 1.0 / 240.0);
        let lying = Pose::rotation(Vec3::new(0.0, std::f64::consts::FRAC_PI_2, 0.0));
        world
            .add_static(
                RigidBody::fixed(Shape::capsule(0.1, 10.0).unwrap())
                    .with_name("capsule")
                    .with_material(Material { friction: 0.0, ..Material::default() })
                    .with_pose(lying),
            )
            .unwrap();
        let ball = sliding_ball(&mut world, 0.0);
        for frame in 0..60 {
            world.step().unwrap();
            assert!(
                (weight_carried(&world, ball) - G).abs() < 1e-9,
                "{stepper} frame {frame}: {} N",
                weight_carried(&world, ball)
            );
        }
        let off = (position(&world, ball) - Vec3::new(0.75, 0.0, 0.2)).norm();
        assert!(
            off < 1e-9 && (velocity(&world, ball) - Vec3::new(3.0, 0.0, 0.0)).norm() < 1e-9,
            "{stepper}: {off:e} m off"
        );
    }
}

/// Adds a ball of 1 kg without friction at 3 m/s along x, its lowest point at z = 0.1.
fn sliding_ball(world: &mut World, x: f64) -> ObjectId {
    let ball = RigidBody::new(sphere(0.1))
        .with_name("ball")
        .with_mass(1.0)
        .with_material(Material { friction: 0.0, ..Material::default() })
        .with_pose(Pose::translation(x, 0.0, 0.2));
    world.add(ball.with_velocity(Vec3::new(3.0, 0.0, 0.0))).unwrap()
}

/// Returns the upward contact force on a body, N.
fn weight_carried(world: &World, body: ObjectId) -> f64 {
    let on = |c: &ContactPoint| if c.a == body { c.force.z } else { -c.force.z };
    world.contacts().iter().filter(|c| c.a == body || c.b == body).map(on).sum()
}

#[test]
fn a_ball_that_slides_off_a_box_is_carried_to_the_edge_and_then_falls() {
    // v²/r = 90 m/s² > g: it leaves the edge at once, on the parabola z = 0.2 − g·t²/2. It crosses
    // the edge in the middle of frame 60. A stepper may detect that at either end of the frame,
    // half a frame of fall: vz has an error of at most g·h/2.
    let h = 1.0 / 240.0;
    for stepper in STEPPERS {
        let mut world = world(stepper, h);
        world
            .add_static(
                RigidBody::fixed(Shape::cuboid(Vec3::new(2.0, 2.0, 0.2)).unwrap())
                    .with_name("table")
                    .with_material(Material { friction: 0.0, ..Material::default() }),
            )
            .unwrap();
        let ball = sliding_ball(&mut world, 1.0 - 60.5 * 3.0 * h);
        for frame in 0..120 {
            world.step().unwrap();
            let wanted = if frame < 60 { G } else { 0.0 };
            assert!(
                frame == 60 || (weight_carried(&world, ball) - wanted).abs() < 1e-9,
                "{stepper} frame {frame}: {} N",
                weight_carried(&world, ball)
            );
        }
        let (v, t) = (velocity(&world, ball), 59.5 * h);
        assert!(
            (v.x - 3.0).abs() < 1e-9 && (v.z + G * t).abs() <= 0.5 * G * h + 1e-9,
            "{stepper}: {v:?}, vz should be {}",
            -G * t
        );
        let z = 0.2 - 0.5 * G * t * t;
        assert!(
            (position(&world, ball).z - z).abs() <= 0.5 * G * h * (t + h),
            "{stepper}: {} against {z}",
            position(&world, ball).z
        );
    }
}

/// Two tops at the same height act as one plane: straight on at 3 m/s, with a contact force of m·g
/// = 9.81 N.
///
/// The edge of the next box is in contact when it is nearer than the contact tolerance δ, tilted by
/// θ = √(2δ/r). The ball may lose v·θ² = 6e-6 m/s there, and the force of that one frame is left
/// out.
fn slide_over_a_seam(stepper: &str) {
    let mut world = world(stepper, 1.0 / 240.0);
    for (name, x) in [("left", 0.0), ("right", 2.0)] {
        let table = RigidBody::fixed(Shape::cuboid(Vec3::new(2.0, 2.0, 0.2)).unwrap())
            .with_name(name)
            .with_material(Material { friction: 0.0, ..Material::default() });
        world.add_static(table.with_pose(Pose::translation(x, 0.0, 0.0))).unwrap();
    }
    let ball = sliding_ball(&mut world, 0.503);
    for frame in 0..80 {
        world.step().unwrap();
        let (force, v) = (weight_carried(&world, ball), velocity(&world, ball));
        let lost = 3.0 * 2.0 * world.settings().contact_tolerance / 0.1;
        let (even, straight) = (frame == 39 || (force - G).abs() < 1e-6, (v - Vec3::new(3.0, 0.0, 0.0)).norm() < lost);
        assert!(even && straight, "{stepper} frame {frame}, x = {}: {force} N, {v:?}", position(&world, ball).x);
    }
    assert!((position(&world, ball).z - 0.2).abs() < 1e-6, "{stepper}");
}

#[test]
fn a_ball_does_not_trip_over_the_seam_of_two_boxes_in_backtracking() {
    slide_over_a_seam("backtracking");
}

#[test]
fn a_ball_does_not_trip_over_the_seam_of_two_boxes_in_time_stepping() {
    slide_over_a_seam("time_stepping");
}

#[test]
fn a_thrust_within_the_frame_does_not_push_a_ball_through_the_ground() {
    // 500 N on 1 kg over 1/60 s move it 69 mm from rest; the ball is at rest when the frame begins,
    // 10 mm above a plate of 40 mm.
    for stepper in STEPPERS {
        let mut world = world(stepper, 1.0 / 60.0);
        ground(&mut world, 0.0, 0.5);
        let ball =
            RigidBody::new(sphere(0.02)).with_name("ball").with_mass(1.0).with_pose(Pose::translation(0.0, 0.0, 0.03));
        let ball = world.add(ball).unwrap();
        for _ in 0..3 {
            let at = position(&world, ball);
            world.apply_force(ball, 0, Vec3::new(0.0, 0.0, -500.0), &at).unwrap();
            world.step().unwrap();
            let bottom = position(&world, ball).z - 0.02;
            assert!((-1e-6..0.01).contains(&bottom), "{stepper}: bottom at {bottom}");
        }
    }
}

#[test]
fn energy_never_grows_in_impacts_with_friction_with_or_without_a_far_kinematic_body() {
    // without gravity all energy is kinetic, and e = 1 and μ = 1 add none.
    for stepper in STEPPERS {
        for kinematic in [false, true] {
            for seed in 0..40 {
                let s = seed as f64;
                let mut world = no_gravity(world(stepper, 1.0 / 240.0));
                ground(&mut world, 1.0, 1.0);
                let rod = RigidBody::new(Shape::cuboid(Vec3::new(1.0, 0.04, 0.04)).unwrap())
                    .with_name("rod")
                    .with_mass(1.0)
                    .with_material(Material { restitution: 1.0, friction: 1.0, ..Material::default() });
                let pose = Pose::new(Vec3::new(0.0, 0.0, 0.6), Vec3::new(0.0, 0.2 + 0.03 * s, 0.0));
                let rod = world.add(rod.with_pose(pose).with_velocity(Vec3::new(6.0 - 0.3 * s, 0.0, -2.0))).unwrap();
                if kinematic {
                    let far =
                        RigidBody::fixed(sphere(0.1)).with_name("far").with_pose(Pose::translation(50.0, 50.0, 50.0));
                    world.add_boxed(Box::new(far), Mode::Kinematic).unwrap();
                }
                let start = world.energy().total();
                for frame in 0..120 {
                    world.step().unwrap();
                    let growth = world.energy().total() / start - 1.0;
                    assert!(
                        growth < 1e-9,
                        "{stepper} kinematic {kinematic} seed {seed} frame {frame}: energy grew by {growth:e}"
                    );
                }
                assert!(velocity(&world, rod).z > -1.9, "{stepper} seed {seed}: it struck");
            }
        }
    }
}

#[test]
fn a_ball_that_bounces_far_away_does_not_change_one_bit_of_a_stack() {
    // islands share nothing: the bounce does not change the bits of bodies that it does not touch.
    let run = |far: bool| -> Vec<Vec<u64>> {
        let mut world = world("time_stepping", 1.0 / 60.0);
        ground(&mut world, 1.0, 0.5);
        let boxes: Vec<ObjectId> = (0..8)
            .map(|i| {
                let body = RigidBody::new(cube(0.5))
                    .with_name(format!("box{i}"))
                    .with_mass(1.0)
                    .with_material(Material { friction: 0.5, ..Material::default() });
                world.add(body.with_pose(Pose::translation(0.0, 0.0, 0.25 + 0.5 * i as f64))).unwrap()
            })
            .collect();
        if far {
            let ball = RigidBody::new(sphere(0.1))
                .with_name("far")
                .with_mass(1.0)
                .with_material(Material { restitution: 1.0, friction: 0.0, ..Material::default() })
                .with_pose(Pose::translation(30.0, 0.0, 0.3));
            world.add(ball.with_velocity(Vec3::new(0.0, 0.0, -3.0))).unwrap();
        }
        let mut passes = 0;
        let frames = (0..120)
            .map(|_| {
                passes += world.step().unwrap().impact_passes;
                boxes.iter().flat_map(|id| world.state_of(*id).unwrap().iter().map(|x| x.to_bits())).collect()
            })
            .collect();
        assert_eq!(passes > 0, far, "only the ball bounces");
        frames
    };
    let (alone, with_ball) = (run(false), run(true));
    for (frame, (a, b)) in alone.iter().zip(&with_ball).enumerate() {
        assert!(
            a == b,
            "frame {frame}: {} numbers of the stack differ",
            a.iter().zip(b).filter(|(a, b)| a != b).count()
        );
    }
}

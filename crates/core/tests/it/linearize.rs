//! The derivative of a step against differences of steps, and against the derivatives of forward dynamics.

use crate::articulated_random::Random;
use crate::common::{cube, ground, sphere};
use nalgebra::{DMatrix, DVector};
use tumble_core::articulated::{Kinematics, forward_dynamics_derivatives};
use tumble_core::collide::{Pose, Quat, Shape, Vec3};
use tumble_core::{
    ArticulatedBody, ArticulationBuilder, Collidable, Drive, Integratable, Joint, LinearizeError, LinearizedStep,
    LinkBuilder, Material, Object, ObjectId, RigidBody, Settings, Switch, World, solver, stepper_by_name,
};

/// A world whose solves are exact to about 1e-13 m/s: differences of its steps have the error of their method alone.
fn exact_world(dt: f64) -> World {
    let mut settings = Settings::default().with_dt(dt);
    settings.solver_settings.tolerance = 1e-14;
    settings.solver_settings.max_sweeps = 50_000;
    settings.solver_settings.max_relaxations = u32::MAX;
    settings.projection_sweeps = 50_000;
    settings.contact_tolerance = 1e-10;
    World::new(settings).unwrap()
}

/// The state after a frame from a displaced one, in the coordinates of `LinearizedStep`, from those of `end`.
pub fn displaced(world: &World, of: &LinearizedStep, end: &World, column: usize, by: f64) -> DVector<f64> {
    let n = of.b.ncols();
    let mut world = world.fork();
    for (id, range) in of.objects.iter().filter(|(_, range)| range.contains(&(column % n))) {
        let mut step = vec![0.0; range.len()];
        step[column % n - range.start] = by;
        if column >= 2 * n {
            world.apply_generalized(*id, &step).unwrap();
            continue;
        }
        let (mut x, mut v) = (world.state_of(*id).unwrap().to_vec(), vec![0.0; range.len()]);
        let fork = world.fork();
        let body = body(&fork, *id);
        body.velocity(&x, &mut v);
        if column < n {
            body.integrate_positions(&mut x, &step, 1.0);
        } else {
            v.iter_mut().zip(&step).for_each(|(v, step)| *v += step);
        }
        body.write_velocity(&mut x, &v);
        world.write_state_of(*id, &x).unwrap();
    }
    world.step().unwrap();
    let mut out = DVector::zeros(2 * n);
    for (id, range) in &of.objects {
        let (from, to, body) = (end.state_of(*id).unwrap(), world.state_of(*id).unwrap(), body(&world, *id));
        let [mut way, mut before, mut after] = [(); 3].map(|()| vec![0.0; range.len()]);
        body.difference(from, to, &mut way);
        body.velocity(from, &mut before);
        body.velocity(to, &mut after);
        for k in 0..range.len() {
            out[range.start + k] = way[k];
            out[n + range.start + k] = after[k] - before[k];
        }
    }
    out
}

fn body(world: &World, id: ObjectId) -> &dyn Integratable {
    match (world.get::<RigidBody>(id), world.get::<ArticulatedBody>(id)) {
        (Some(body), _) => body.integratable().unwrap(),
        (_, Some(body)) => body.integratable().unwrap(),
        _ => panic!("not a rigid and not an articulated body"),
    }
}

/// `[A B]` by differences of fourth order of whole steps with the real solver.
fn by_differences(world: &World, of: &LinearizedStep, size: f64) -> DMatrix<f64> {
    let n = of.b.ncols();
    let mut end = world.fork();
    end.step().unwrap();
    let mut all = DMatrix::zeros(2 * n, 3 * n);
    for column in 0..3 * n {
        // within the displacements next to which `linearize` looks for kinks
        let e = match column / n {
            0 => 9e-7,
            1 => 1.8e-6,
            _ => 9e-6 / of.b.column(column - 2 * n).amax().max(0.02),
        } * size;
        let [a, b, c, d] = [e, -e, 2.0 * e, -2.0 * e].map(|by| displaced(world, of, &end, column, by));
        all.set_column(column, &((8.0 * (a - b) - (c - d)) / (12.0 * e)));
    }
    all
}

/// `[A B]`.
fn joined(of: &LinearizedStep) -> DMatrix<f64> {
    let n = of.b.ncols();
    let mut all = of.a.clone().insert_columns(2 * n, n, 0.0);
    all.columns_mut(2 * n, n).copy_from(&of.b);
    all
}

/// The largest difference of two `[A B]`, relative to the largest entries of `A` and `B`.
fn error_of(of: &LinearizedStep, a: &DMatrix<f64>, b: &DMatrix<f64>) -> f64 {
    let (n, off) = (of.b.ncols(), a - b);
    let forces = off.columns(2 * n, n).amax() / of.b.amax().max(1e-3);
    (off.columns(0, 2 * n).amax() / of.a.amax()).max(forces)
}

/// A box, a ball, a capsule or a robot with four legs at a random place at the ground.
fn random_contact(seed: u64) -> World {
    let mut random = Random(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1);
    let mut between = |low: f64, high: f64| random.real(low, high);
    let mut world = exact_world(1.0 / 240.0);
    let friction = if seed.is_multiple_of(5) { 0.0 } else { between(0.2, 1.0) };
    ground(&mut world, 0.0, friction);
    // overlap, or a gap that the step closes or not
    let gap = [-1.0, 1.0][(seed / 4 % 2) as usize] * between(5e-5, 8e-4);
    let speed = [0.0, 0.02, 1.5][(seed / 8 % 3) as usize];
    let mut v = Vec3::new(between(-speed, speed), between(-speed, speed), between(-0.25, 0.1));
    let w = Vec3::new(between(-speed, speed), between(-speed, speed), between(-speed, speed));
    if (seed / 24).is_multiple_of(4) {
        v.z = between(0.05, 0.5); // opens
    }
    let material = Material { friction, ..Material::default() };
    let turn = if (seed / 96).is_multiple_of(2) { 0.0 } else { 0.3 };
    let tilt = Vec3::new(between(-turn, turn), between(-turn, turn), between(-3.0, 3.0));
    let rotation = Quat::from_scaled_axis(tilt);
    if seed % 4 == 3 {
        let robot = robot(material, [(); 4].map(|()| between(-0.4, 0.4)));
        let low = robot_height(&robot, &rotation);
        let pose = Pose::from_parts(Vec3::new(0.0, 0.0, gap - low).into(), rotation);
        let mut speeds = vec![w.x, w.y, w.z, v.x, v.y, v.z];
        speeds.extend([(); 4].map(|()| between(-speed, speed)));
        world.add(robot.with_pose(pose).with_velocities(&speeds).unwrap()).unwrap();
        return world;
    }
    let shape = [Shape::cuboid(Vec3::new(0.2, 0.3, 0.1)).unwrap(), sphere(0.1), Shape::capsule(0.05, 0.2).unwrap()]
        [(seed % 4) as usize]
        .clone();
    let bounds = shape.aabb(&Pose::from_parts(Vec3::zeros().into(), rotation));
    let body = RigidBody::new(shape)
        .with_mass(between(0.5, 3.0))
        .with_material(material)
        .with_pose(Pose::from_parts(Vec3::new(0.0, 0.0, gap - bounds.min.z).into(), rotation))
        .with_velocity(v)
        .with_angular_velocity(w);
    world.add(body).unwrap();
    world
}

/// A box on four legs that end in balls, with springs, dry friction, limits and a drive.
fn robot(material: Material, angles: [f64; 4]) -> ArticulatedBody {
    let trunk = LinkBuilder::new("trunk", Joint::Floating)
        .with_shape(Shape::cuboid(Vec3::new(0.4, 0.2, 0.1)).unwrap(), Pose::identity())
        .with_mass(4.0);
    let mut builder = ArticulationBuilder::new("robot").link(trunk);
    for (i, angle) in angles.into_iter().enumerate() {
        let (x, y) = ([-0.15, 0.15][i % 2], [-0.12, 0.12][i / 2]);
        let leg = LinkBuilder::new(format!("leg {i}"), Joint::revolute(Vec3::y()))
            .with_parent("trunk")
            .with_pose(Pose::translation(x, y, -0.05))
            .with_shape(sphere(0.03), Pose::translation(0.0, 0.0, -0.2))
            .with_mass(0.5)
            .with_material(material)
            .with_position(angle);
        let leg = match i {
            0 => leg.with_spring(20.0, 0.1),
            1 => leg.with_joint_friction(0.3),
            2 => leg.with_limits([angle - 1e-4, 2.0]),
            _ => leg.with_drive(Drive::Position {
                stiffness: 30.0,
                damping: 1.0,
                target: 0.1,
                velocity: 0.0,
                limit: 5.0,
            }),
        };
        builder = builder.link(leg);
    }
    builder.build().unwrap()
}

/// The height of the lowest foot of a robot at the origin.
fn robot_height(robot: &ArticulatedBody, rotation: &Quat) -> f64 {
    let mut world = World::default();
    let pose = Pose::from_parts(Vec3::zeros().into(), *rotation);
    let id = world.add(robot.clone().with_pose(pose)).unwrap();
    let parts = robot.state_sizes().parts;
    let low = |part: usize| Some(robot.shape(part)?.aabb(&world.part_state(id, part)?.pose).min.z);
    (0..parts).filter_map(low).fold(f64::INFINITY, f64::min)
}

#[test]
fn a_thousand_random_contacts_agree_with_differences() {
    let (mut worst, mut kinked, mut indeterminate, mut unsure, mut checked, mut seed) = ((0.0f64, 0), 0, 0, 0, 0, 0);
    let mut kinds = [0; 3];
    while checked < 1000 {
        seed += 1;
        let world = random_contact(seed);
        let linear = world.linearize().unwrap();
        // at a kink, as where a contact slides at 1e-7 m/s, a solution may be less exact
        let kink = !(linear.switches.is_empty() && linear.one_sided.is_empty() && linear.across.is_empty());
        assert!(linear.residual < if kink { 1e-10 } else { 1e-11 }, "seed {seed}: {:.1e}", linear.residual);
        // differences cross a kink there
        if kink {
            kinked += 1;
            continue;
        }
        if linear.indeterminate {
            indeterminate += 1;
            continue;
        }
        // differences that do not agree with themselves have met a kink, or the solver's rounding
        let expected = by_differences(&world, &linear, 1.0);
        let again = by_differences(&world, &linear, 0.7);
        if error_of(&linear, &expected, &again) > 5e-8 {
            unsure += 1;
            continue;
        }
        // the mean has less of the rounding of the solves, which is 1e-13 m/s over displacements of 1e-6
        let expected = 0.5 * (expected + again);
        checked += 1;
        let off = error_of(&linear, &joined(&linear), &expected);
        if off > worst.0 {
            worst = (off, seed);
        }
        let mut end = world.fork();
        end.step().unwrap();
        let pressed: Vec<_> = end.contacts().iter().filter(|c| c.force != Vec3::zeros()).collect();
        let slides = pressed.iter().any(|c| {
            let normal = c.force.dot(&c.normal);
            (c.force - normal * c.normal).norm() > 0.999 * 0.2 * normal && c.velocity.norm() > 0.01
        });
        kinds[if pressed.is_empty() { 0 } else { 1 + usize::from(slides) }] += 1;
    }
    println!(
        "worst {:.1e} (seed {}), {kinked} at a kink, {indeterminate} not determined, {unsure} without differences; open, standing, sliding {kinds:?}",
        worst.0, worst.1
    );
    assert!(kinds.iter().all(|kind| *kind > 100), "{kinds:?}");
    assert!(kinked + indeterminate + unsure < 150, "{kinked} {indeterminate} {unsure}");
    assert!(worst.0 < 1e-7, "{:.1e} at seed {}", worst.0, worst.1);
}

#[test]
fn in_free_motion_it_is_the_derivative_of_forward_dynamics() {
    // δv' = δv + dt·(∂a/∂q·δq + ∂a/∂v·δv + ∂a/∂τ·δτ) + O(dt²): with two lengths of the frame, the order of the rest is seen
    let arm = || {
        let link = |name: &str| {
            LinkBuilder::new(name, Joint::revolute(Vec3::y()))
                .with_shape(Shape::capsule(0.03, 0.4).unwrap(), Pose::translation(0.0, 0.0, -0.25))
                .with_density(800.0)
        };
        let second = link("second").with_parent("first").with_pose(Pose::translation(0.0, 0.0, -0.5));
        let robot = ArticulationBuilder::new("arm").link(link("first")).link(second).build().unwrap();
        robot.with_positions(&[0.7, -0.4]).unwrap().with_velocities(&[1.5, -2.0]).unwrap()
    };
    let robot = arm();
    let gravity = Vec3::new(0.0, 0.0, -9.81);
    let expected = forward_dynamics_derivatives(
        robot.model(),
        &mut Kinematics::new(robot.model()),
        &gravity,
        &[0.7, -0.4],
        &[1.5, -2.0],
        &[0.0, 0.0],
    )
    .unwrap();
    let off = |dt: f64| {
        let mut world = exact_world(dt);
        world.add(arm()).unwrap();
        let step = world.linearize().unwrap();
        let rates = (step.a.rows(2, 2) - DMatrix::identity(4, 4).rows(2, 2)) / dt;
        let by_q = (rates.columns(0, 2) - &expected.by_q).amax();
        let by_v = (rates.columns(2, 2) - &expected.by_v).amax();
        let by_tau = (step.b.rows(2, 2) / dt - &expected.by_tau).amax();
        [by_q, by_v, by_tau]
    };
    let (coarse, fine) = (off(1e-3), off(1e-4));
    println!("{coarse:.2?} {fine:.2?}");
    for (coarse, fine) in coarse.into_iter().zip(fine) {
        assert!(fine < 0.05 && fine < 0.11 * coarse, "{coarse:.2e} {fine:.2e}");
    }
}

#[test]
fn a_ball_that_rolls_or_slides_has_the_closed_form() {
    // a ball that touches, of radius r and mass m, pushed by f: rolling δv' = δv + dt·f/(m + I/r²), sliding δv' = δv + dt·f/m
    let (r, m, dt) = (0.1, 2.0, 1.0 / 240.0);
    for (v, w, mass) in [(1.0, 10.0, 1.4 * m), (1.0, -10.0, m)] {
        let mut world = exact_world(dt);
        ground(&mut world, 0.0, 0.3);
        let ball =
            RigidBody::new(sphere(r)).with_mass(m).with_material(Material { friction: 0.3, ..Material::default() });
        let ball = ball.with_pose(Pose::translation(0.0, 0.0, r - 1e-5)).with_velocity(Vec3::new(v, 0.0, 0.0));
        world.add(ball.with_angular_velocity(Vec3::new(0.0, w, 0.0))).unwrap();
        let step = world.linearize().unwrap();
        let (x, vx, vz) = (3, 9, 11);
        assert!((step.b[(vx, x)] - dt / mass).abs() < 1e-9 * dt, "{:.6e} {:.6e}", step.b[(vx, x)], dt / mass);
        // a rolling ball keeps 5/7 of a push, and the rest of it goes to its spin
        let kept = if w > 0.0 { 5.0 / 7.0 } else { 1.0 };
        assert!((step.a[(vx, vx)] - kept).abs() < 1e-8, "{}", step.a[(vx, vx)]);
        // overlap is corrected: what presses down is stopped
        assert!(step.a[(vz, vz)].abs() < 1e-8 && step.a.row(vz).amax() < 1e-8);
    }
}

#[test]
fn a_bounce_has_the_closed_form() {
    // t = (v + √(v² + 2·g·d))/g to the ground at distance d, speed w = √(v² + 2·g·d) there, then −e·w upwards
    let (r, e, g, dt, d, v) = (0.05, 0.6, 9.81, 1.0 / 120.0, 0.02, -4.0);
    let mut world = exact_world(dt);
    ground(&mut world, e, 0.0);
    let ball = RigidBody::new(sphere(r)).with_mass(0.3).with_pose(Pose::translation(0.0, 0.0, r + d));
    let material = Material { restitution: e, friction: 0.0, ..Material::default() };
    world.add(ball.with_material(material).with_velocity(Vec3::new(0.0, 0.0, v))).unwrap();
    let step = world.linearize().unwrap();
    let w = (v * v + 2.0 * g * d).sqrt();
    let t = (v + w) / g;
    // ∂t/∂d = 1/w, ∂t/∂v = t/w, ∂w/∂d = g/w, ∂w/∂v = v/w;   v' = e·w − g·(dt − t),  z' = e·w·(dt − t) − ½·g·(dt − t)²
    let left = dt - t;
    let of = |dt_: f64, dw: f64| (e * dw * left - e * w * dt_ + g * left * dt_, e * dw + g * dt_);
    let (by_d, by_v) = (of(1.0 / w, g / w), of(t / w, v / w));
    let (z, vz) = (5, 11);
    let found = [step.a[(z, z)], step.a[(vz, z)], step.a[(z, vz)], step.a[(vz, vz)]];
    for (found, expected) in found.into_iter().zip([by_d.0, by_d.1, by_v.0, by_v.1]) {
        assert!((found - expected).abs() < 1e-7 * expected.abs().max(1.0), "{found:.9} {expected:.9}");
    }
}

#[test]
fn a_body_at_rest_is_at_a_kink_and_says_so() {
    let mut world = exact_world(1.0 / 240.0);
    let floor = ground(&mut world, 0.0, 0.5);
    let id = world.add(RigidBody::new(cube(0.2)).with_pose(Pose::translation(0.0, 0.0, 0.1))).unwrap();
    (0..60).for_each(|_| _ = world.step().unwrap());
    let before = world.save();
    let step = world.linearize().unwrap();
    assert_eq!(world.save(), before, "the world is as it was");
    let mut objects = step.switches.iter().filter(|s| s.switch == Switch::Gap).filter_map(|s| s.objects);
    assert!(
        objects.any(|pair| pair.contains(&id) && pair.contains(&floor)),
        "the gap closes on one side and overlaps on the other"
    );
    // standing: no displacement along the ground, and no turn, changes a velocity; and a push does nothing
    assert!(step.b.rows(6, 6).amax() < 1e-9 * step.a.amax());
    let dt = 1.0 / 240.0;
    for along in [3, 4, 2] {
        assert!((step.a[(along, along)] - 1.0).abs() < 1e-9 && step.a.fixed_view::<6, 1>(6, along).amax() < 1e-6 / dt);
    }
}

#[test]
fn another_method_is_an_error_with_its_name() {
    let mut world = World::default();
    world.set_stepper(stepper_by_name("backtracking").unwrap());
    let error = world.linearize().unwrap_err();
    assert_eq!(error, LinearizeError::Method { kind: "stepper", found: "backtracking", expected: "time_stepping" });
    let mut world = World::default();
    world.set_solver(solver::by_name("lcp_pyramid").unwrap());
    let text = world.linearize().unwrap_err().to_string();
    assert_eq!(text, "a step by 'lcp_pyramid' cannot be linearized; set the solver 'gauss_seidel'");
}

/// Springs and drives of spherical joints far from rest, about all axes at once.
#[test]
fn springs_and_drives_of_spherical_joints_agree_with_differences() {
    let link = |name: &str| {
        LinkBuilder::new(name, Joint::Spherical)
            .with_shape(Shape::capsule(0.05, 0.4).unwrap(), Pose::translation(0.05, 0.0, -0.25))
            .with_density(800.0)
            .with_rotation(Quat::from_scaled_axis(Vec3::new(0.4, -0.7, 0.3)))
            .with_velocities(&[1.0, -0.5, 2.0])
    };
    let drive = Drive::Position { stiffness: 30.0, damping: 2.0, target: 0.3, velocity: 0.1, limit: f64::INFINITY };
    let second = link("second").with_parent("first").with_pose(Pose::translation(0.0, 0.0, -0.5)).with_drive(drive);
    let first = link("first").with_spring(20.0, 0.2).with_joint_damping(0.1);
    let mut world = exact_world(1.0 / 240.0);
    world.add(ArticulationBuilder::new("arm").link(first).link(second).build().unwrap()).unwrap();
    let step = world.linearize().unwrap();
    let off = error_of(&step, &joined(&step), &by_differences(&world, &step, 1.0));
    println!("{off:.1e}");
    assert!(off < 1e-7, "{off:e}");
}

//! Contacts of links with planes, rigid bodies, each other and other articulated bodies, in the
//! same solver as all constraints.

use crate::articulated_world::{adaptive, hinged, loose_chain, rod, run, world};
use crate::common::{ground, sphere};
use tumble_core::collide::{Mat3, Pose, Shape, Vec3};
use tumble_core::{
    ArticulatedBody, Collider, DofSettings, Integrator, Joint, LinkMass, Material, ModelBuilder, ObjectId, RigidBody,
    World,
};

/// Adds a box that is thrown at the floor: a rigid body, or a floating base without links.
fn thrown(mut world: World, articulated: bool, lift: f64) -> (World, ObjectId) {
    ground(&mut world, 0.6, 0.5);
    let shape = Shape::cuboid(Vec3::new(0.2, 0.4, 0.6)).unwrap();
    let solid = RigidBody::new(shape.clone()).with_name("box").with_mass(2.0);
    let pose = Pose::new(Vec3::new(0.0, 0.0, 0.6 + lift), Vec3::new(0.3, 0.5, 0.1));
    let (v, w) = (Vec3::new(0.5, 0.2, -1.0), Vec3::new(1.0, 2.0, 3.0));
    let id = if articulated {
        let mut builder = ModelBuilder::new();
        builder.link(
            "box",
            None,
            Joint::Floating,
            Pose::identity(),
            LinkMass { mass: 2.0, center: Vec3::zeros(), inertia: *solid.inertia() },
        );
        let mut body = ArticulatedBody::new("box", builder.build().unwrap())
            .with_pose(pose)
            .with_velocities(&[w.x, w.y, w.z, v.x, v.y, v.z])
            .unwrap();
        let mut collider = Collider::new(shape, Pose::identity());
        collider.material = Material { restitution: 0.6, friction: 0.5, ..Material::default() };
        body.add_collider("box", collider).unwrap();
        world.add(body).unwrap()
    } else {
        world
            .add(solid.with_pose(pose).with_velocity(v).with_angular_velocity(w).with_material(Material {
                restitution: 0.6,
                friction: 0.5,
                ..Material::default()
            }))
            .unwrap()
    };
    (world, id)
}

#[test]
fn a_floating_link_and_a_rigid_body_are_the_same_thing() {
    let mut pair = [false, true].map(|articulated| thrown(adaptive(1.0 / 240.0, 1e-12), articulated, 0.0));
    let (mut impacts, mut worst_place, mut worst_impulse): (u32, f64, f64) = (0, 0.0, 0.0);
    while impacts < 2 {
        let mut passes = [0, 0];
        for ((world, _), passes) in pair.iter_mut().zip(&mut passes) {
            *passes = world.step().unwrap().impact_passes;
        }
        assert_eq!(passes[0], passes[1]);
        let [a, b] = [0, 1].map(|i| *pair[i].0.part_state(pair[i].1, 0).unwrap());
        worst_place =
            worst_place.max((a.position() - b.position()).norm()).max(a.pose.rotation.angle_to(&b.pose.rotation));
        let [a, b] = [0, 1].map(|i| pair[i].0.momentum());
        worst_impulse = worst_impulse.max((a.linear - b.linear).norm()).max((a.angular - b.angular).norm());
        impacts += (passes[0] > 0) as u32;
        assert!(pair[0].0.time() < 5.0, "no second impact");
    }
    println!("to the second impact: {worst_place:.1e} m or rad, momenta {worst_impulse:.1e}");
    assert!(worst_place < 1e-8 && worst_impulse < 1e-8, "{worst_place:.1e} {worst_impulse:.1e}");
}

#[test]
fn the_same_contact_gives_the_same_impulse() {
    // both begin from the same state, slightly inside the floor: one frame, an impact with friction
    let [a, b] = [false, true].map(|articulated| {
        let (mut world, id) =
            thrown(world(1.0 / 240.0, "time_stepping", Integrator::Verlet), articulated, -0.6 + 0.352);
        world.set_settings(world.settings().with_gravity(Vec3::zeros())).unwrap();
        if articulated {
            let mut x = world.state_of(id).unwrap().to_vec();
            x[7..10].fill(0.0);
            world.write_state_of(id, &x).unwrap();
        } else {
            world.set_velocity(id, Vec3::new(0.5, 0.2, -1.0), Vec3::zeros()).unwrap();
        }
        world.step().unwrap();
        world.contacts().iter().map(|c| c.impulse).collect::<Vec<_>>()
    });
    assert!(a.len() == b.len() && a.iter().any(|i| i.norm() > 0.1), "{a:?} {b:?}");
    a.iter().zip(&b).for_each(|(a, b)| assert!((a - b).norm() < 1e-10, "{a:?} {b:?}"));
}

#[test]
fn a_chain_that_slides_off_a_sphere_comes_to_rest() {
    let mut world = world(1.0 / 240.0, "time_stepping", Integrator::Verlet);
    ground(&mut world, 0.0, 0.5);
    world
        .add_static(RigidBody::fixed(sphere(0.3)).with_name("ball").with_pose(Pose::translation(0.0, 0.0, 0.6)))
        .unwrap();
    let id = world.add(loose_chain(16, Vec3::new(0.03, 0.01, 1.0), 0.5)).unwrap();
    let (start, mut highest): (f64, f64) = (world.energy().total(), 0.0);
    for _ in 0..240 * 5 {
        world.step().unwrap();
        highest = highest.max(world.energy().total());
    }
    assert!(highest < start + 1e-3, "energy grew from {start} to {highest} J");
    // a straight piece may roll on without resistance; the remaining motion is small, and no loaded
    // contact slides
    let pressed = world.contacts().iter().filter(|c| c.impulse.norm() > 1e-7);
    let slides = pressed.map(|c| c.velocity.norm()).fold(0.0, f64::max);
    println!("left: {:.1e} J of {start:.2} J, sliding at most {slides:.1e} m/s", world.energy().kinetic);
    assert!(world.energy().kinetic < 1e-5 && slides < 1e-6, "{} J, {slides} m/s", world.energy().kinetic);
    assert!(world.report().max_penetration < 1e-5);
    joined(&world, id, 16);
}

/// Asserts that the end of each link is the joint of the next: exact, because joints are
/// coordinates.
fn joined(world: &World, id: ObjectId, links: usize) {
    for i in 1..links {
        let [above, below] = [i - 1, i].map(|l| world.part_state(id, l).unwrap().pose);
        let gap = above.translation.vector + above.rotation * Vec3::new(0.1, 0.0, 0.0) - below.translation.vector;
        assert!(gap.norm() < 1e-13, "joint {i}: {gap:?}");
    }
}

#[test]
fn a_chain_drapes_over_a_sphere() {
    for stepper in ["time_stepping", "backtracking"] {
        let mut world = world(1.0 / 240.0, stepper, Integrator::Verlet);
        world
            .add_static(
                RigidBody::fixed(sphere(0.3))
                    .with_name("ball")
                    .with_material(Material { friction: 1.0, ..Material::default() }),
            )
            .unwrap();
        let id = world.add(loose_chain(10, Vec3::new(0.0, 0.0, 0.33), 1.0)).unwrap();
        let mut last = 0.0;
        run(&mut world, if stepper == "backtracking" { 2.0 } else { 8.0 });
        for _ in 0..24 {
            world.step().unwrap();
            last = world.energy().kinetic.max(last);
        }
        let up: f64 = world.contacts().iter().map(|c| if c.a == id { c.force.z } else { -c.force.z }).sum();
        println!("{stepper}: kinetic energy {last:.1e} J, held up by {up:.6} N");
        assert!(last < 1e-12 && (up - 10.0 * 0.05 * 9.81).abs() < 1e-6, "{stepper}: {last} {up}");
        assert!(world.part_state(id, 0).unwrap().position().z < 0.1, "its ends hang down");
        joined(&world, id, 10);
        assert!(world.report().max_penetration < 1e-3);
    }
}

/// Adds two pendulums with balls of 1 kg, side by side, which just touch at rest.
fn pendulums(mut world: World, angle: f64) -> World {
    for (name, x, q) in [("left", -0.05, angle), ("right", 0.05, 0.0)] {
        let bob = LinkMass { inertia: 1e-3 * Mat3::identity(), ..LinkMass::point(1.0, Vec3::new(0.0, 0.0, -0.5)) };
        let mut body = ArticulatedBody::new(name, hinged(1, 0.5, bob))
            .with_pose(Pose::translation(x, 0.0, 0.0))
            .with_positions(&[q])
            .unwrap();
        let mut ball = Collider::new(sphere(0.05), Pose::translation(0.0, 0.0, -0.5));
        ball.material = Material { restitution: 1.0, friction: 0.0, ..Material::default() };
        body.add_collider("link 0", ball).unwrap();
        world.add(body).unwrap();
    }
    world
}

#[test]
fn two_equal_pendulums_swap_their_swings() {
    let mut world = pendulums(adaptive(1.0 / 240.0, 1e-9), 0.5);
    let start = world.energy().total();
    let struck = (0..240).any(|_| world.step().unwrap().impact_passes > 0);
    assert!(struck);
    run(&mut world, 0.05);
    let [left, right] = [0, 1].map(|i| world.state_of(world.ids()[i]).unwrap()[1]);
    assert!(left.abs() < 1e-6 && right < -1.0, "{left} {right}");
    assert!((world.energy().total() / start - 1.0).abs() < 1e-6, "{} {start}", world.energy().total());
}

/// Adds three rods of 0.4 m with capsules; a torque folds the last one back onto the first.
fn folding(own: bool, apart: bool) -> (World, ObjectId) {
    let mut world = world(1.0 / 240.0, "time_stepping", Integrator::Verlet);
    world.set_settings(world.settings().with_gravity(Vec3::zeros())).unwrap();
    let mut body = ArticulatedBody::new("arm", hinged(3, 0.4, rod(1.0, 0.4))).with_positions(&[0.0, 1.5, 0.0]).unwrap();
    for i in 0..3 {
        let shape = Shape::capsule(0.03, 0.3).unwrap();
        body.add_collider(&format!("link {i}"), Collider::new(shape, Pose::translation(0.0, 0.0, -0.2))).unwrap();
    }
    for i in 0..2 {
        body.set_dof(i, DofSettings { friction: 100.0, ..DofSettings::default() }).unwrap();
    }
    body.self_collision = own;
    if apart {
        body.exclude_collisions("link 0", "link 2").unwrap();
    }
    let id = world.add(body).unwrap();
    for _ in 0..240 * 3 {
        world.apply_generalized(id, &[0.0, 0.0, 0.3]).unwrap();
        world.step().unwrap();
    }
    (world, id)
}

#[test]
fn links_of_a_body_collide_unless_disabled() {
    let (world, id) = folding(true, false);
    let (q, contacts) = (world.state_of(id).unwrap()[2], world.contacts().len());
    assert!(
        contacts > 0 && world.contacts().iter().all(|c| c.part_a.abs_diff(c.part_b) == 2),
        "first against last, not neighbors"
    );
    assert!(q > 1.5 && q < 2.98, "stopped by the first link at {q} rad");
    for (own, apart) in [(false, false), (true, true)] {
        let (world, id) = folding(own, apart);
        assert!(world.contacts().is_empty() && world.state_of(id).unwrap()[2] > 3.0);
    }
}

#[test]
fn a_ball_at_rest_on_a_held_arm_loads_its_joint() {
    // a box of 1 kg rests on a plate that joint friction holds: the chain below carries its weight,
    // nothing moves
    let mut world = world(1.0 / 240.0, "time_stepping", Integrator::Verlet);
    let mut builder = ModelBuilder::new();
    let plate = LinkMass { mass: 1.0, center: Vec3::new(0.2, 0.0, 0.0), inertia: 0.01 * Mat3::identity() };
    builder.link("plate", None, Joint::revolute(Vec3::y()), Pose::translation(0.0, 0.0, 1.0), plate);
    let mut body = ArticulatedBody::new("table", builder.build().unwrap());
    body.add_collider(
        "plate",
        Collider::new(Shape::cuboid(Vec3::new(0.4, 0.4, 0.02)).unwrap(), Pose::translation(0.2, 0.0, 0.0)),
    )
    .unwrap();
    // weights at 0.2 and 0.3 m: 9.81·(0.2 + 0.3) = 4.905 N·m
    let hold = |friction| DofSettings { friction, ..DofSettings::default() };
    body.set_dof(0, hold(4.95)).unwrap();
    let table = world.add(body).unwrap();
    let cube = RigidBody::new(Shape::cuboid(Vec3::repeat(0.1)).unwrap())
        .with_name("cube")
        .with_mass(1.0)
        .with_pose(Pose::translation(0.3, 0.0, 1.06));
    world.add(cube).unwrap();
    run(&mut world, 3.0);
    assert!(world.state_of(table).unwrap()[0].abs() < 1e-6, "{:?}", world.state_of(table));
    world.get_mut::<ArticulatedBody>(table).unwrap().set_dof(0, hold(4.85)).unwrap();
    run(&mut world, 1.0);
    assert!(world.state_of(table).unwrap()[0] > 1e-3, "{:?}", world.state_of(table));
}

#[test]
fn a_snapshot_of_links_in_contact_goes_on_with_the_same_bytes() {
    let make = || {
        let mut world = world(1.0 / 240.0, "time_stepping", Integrator::Verlet);
        ground(&mut world, 0.0, 0.5);
        world.add(loose_chain(8, Vec3::new(0.0, 0.0, 0.2), 0.5)).unwrap();
        world
    };
    let mut world = make();
    run(&mut world, 0.3);
    let saved = world.save();
    run(&mut world, 0.3);
    let (mut other, mut fork) = (make(), make());
    other.restore(&saved).unwrap();
    fork.restore(&saved).unwrap();
    let mut fork = fork.fork();
    run(&mut other, 0.3);
    run(&mut fork, 0.3);
    assert!(world.save() == other.save() && world.save() == fork.save());
}

#[test]
fn a_link_is_kept_apart_from_the_base_it_does_not_hang_on() {
    for apart in [false, true] {
        let mut world = world(1.0 / 240.0, "time_stepping", Integrator::Verlet);
        let mut builder = ModelBuilder::new();
        builder.link("stand", None, Joint::Fixed, Pose::identity(), LinkMass::none());
        let mut parent = None;
        for i in 0..2 {
            let at = Pose::translation(0.0, 0.0, if i == 0 { 1.0 } else { -0.4 });
            parent = Some(builder.link(format!("link {i}"), parent, Joint::revolute(Vec3::y()), at, rod(1.0, 0.4)));
        }
        let mut body = ArticulatedBody::new("arm", builder.build().unwrap()).with_positions(&[1.5, 0.0]).unwrap();
        body.add_collider("stand", Collider::new(sphere(0.3), Pose::translation(0.0, 0.0, 0.2))).unwrap();
        body.add_collider("link 1", Collider::new(sphere(0.05), Pose::translation(0.0, 0.0, -0.35))).unwrap();
        if apart {
            body.exclude_collisions("link 1", "stand").unwrap();
        }
        world.add(body).unwrap();
        let met = (0..480)
            .filter(|_| {
                world.step().unwrap().max_penetration > 0.0 || world.contacts().iter().any(|c| c.impulse.norm() > 0.0)
            })
            .count();
        assert_eq!(met > 0, !apart);
    }
}

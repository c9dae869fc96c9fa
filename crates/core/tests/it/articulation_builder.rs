//! Articulated bodies made by [`ArticulationBuilder`]: masses of shapes, motion by theory, errors.

use crate::common::*;
use std::f64::consts::{PI, TAU};
use tumble_core::collide::{Mat3, Pose, Shape, Vec3};
use tumble_core::*;

fn down(z: f64) -> Pose {
    Pose::translation(0.0, 0.0, -z)
}

fn rod(name: &str) -> LinkBuilder {
    let shape = Shape::cuboid(Vec3::new(0.02, 0.02, 1.0)).unwrap();
    LinkBuilder::new(name, Joint::revolute(Vec3::y())).with_shape(shape, down(0.5)).with_mass(2.0)
}

/// A dumbbell of two balls at the ends of a rod, by the parallel axis theorem.
#[test]
fn the_mass_of_a_link_is_that_of_its_shapes() {
    let ball = |x| (sphere(0.1), Pose::translation(x, 0.0, 0.3));
    let link = [ball(-0.5), ball(0.5)]
        .into_iter()
        .fold(LinkBuilder::new("bell", Joint::Floating), |link, (shape, pose)| link.with_shape(shape, pose));
    let of = |link: LinkBuilder| ArticulationBuilder::new("a").link(link).build().unwrap().model().links()[0].mass;
    let one = 4.0 / 3.0 * PI * 0.1_f64.powi(3) * 1000.0;
    let (about_x, about_z) = (0.8 * one * 0.01, 2.0 * one * (0.4 * 0.01 + 0.25));
    let mass = of(link.clone());
    assert!((mass.mass - 2.0 * one).abs() < 1e-12 && (mass.center - Vec3::new(0.0, 0.0, 0.3)).norm() < 1e-12);
    assert!((mass.inertia - Mat3::from_diagonal(&Vec3::new(about_x, about_z, about_z))).amax() < 1e-12);
    let heavy = of(link.clone().with_mass(6.0));
    assert_eq!(heavy.mass, 6.0);
    assert!((heavy.inertia - mass.inertia * (3.0 / one)).amax() < 1e-12);
    assert!((of(link.clone().with_density(500.0)).mass - one).abs() < 1e-12);
    let given = LinkMass::point(1.0, Vec3::x());
    assert_eq!(of(link.with_mass_properties(given)), given);
}

/// A rod that hangs on its end: `I = m l²/3`, so the period of small swings is `2π √(2 l / (3 g))`.
#[test]
fn a_rod_swings_with_the_period_of_theory() {
    for stepper in STEPPERS {
        let mut world = world(stepper, 1.0 / 240.0);
        let body = ArticulationBuilder::new("pendulum").link(rod("rod").with_position(1e-3)).build().unwrap();
        let id = world.add(body.with_pose(Pose::translation(0.0, 0.0, 3.0))).unwrap();
        let (width, length) = (0.02_f64, 1.0_f64);
        let inertia = 2.0 * ((length * length + width * width) / 12.0 + 0.25 * length * length);
        let omega = (2.0 * G * 0.5 * length / inertia).sqrt();
        for k in 1..=(5.0 * TAU / omega * 240.0) as usize {
            world.step().unwrap();
            let angle = world.state_of(id).unwrap()[0];
            let expected = 1e-3 * (omega * k as f64 / 240.0).cos();
            assert!((angle - expected).abs() < 2e-5, "{stepper}, step {k}: {angle} for {expected}");
        }
    }
}

#[test]
fn limits_drives_and_couplings_reach_the_joints() {
    let drive = Drive::Position { stiffness: 1e3, damping: 1e2, target: 0.7, velocity: 0.0, limit: f64::INFINITY };
    let body = ArticulationBuilder::new("arm")
        .link(rod("upper").with_drive(drive).with_limits([-0.5, 0.5]).with_joint_damping(0.1).with_joint_friction(0.2))
        .link(rod("lower").with_parent("upper").with_pose(down(1.0)).with_velocity(0.1))
        .mimic("lower", "upper", -2.0, 0.1)
        .exclude_collisions("upper", "lower")
        .build()
        .unwrap();
    assert_eq!((body.dofs()[0].damping, body.dofs()[0].friction), (0.1, 0.2));
    let mut world = no_gravity(world("time_stepping", 1.0 / 240.0));
    let id = world.add(body).unwrap();
    (0..960).for_each(|_| _ = world.step().unwrap());
    let x = world.state_of(id).unwrap();
    assert!((x[0] - 0.5).abs() < 1e-6 && (x[1] + 0.9).abs() < 1e-6, "the limit, and q = -2·0.5 + 0.1: {x:?}");
}

#[test]
fn errors_name_the_link() {
    let build = |link: LinkBuilder| {
        ArticulationBuilder::new("arm").link(rod("upper")).link(link).build().err().unwrap().to_string()
    };
    let none = ArticulationBuilder::new("arm").link(rod("upper").with_parent("x")).build().err().unwrap().to_string();
    assert!(none.contains("no link was"), "{none}");
    for (link, words) in [
        (rod("lower").with_parent("uper"), "its parent 'uper' was not added before it; there are upper"),
        (rod("upper"), "two links are named 'upper'"),
        (LinkBuilder::new("lower", Joint::revolute(Vec3::y())), "link 'lower' and its descendants have no inertia"),
        (LinkBuilder::new("lower", Joint::revolute(Vec3::y())).with_mass(1.0), "has a mass but no shape"),
        (rod("lower").with_mass(-1.0), "link 'lower': mass is -1"),
        (rod("lower").with_density(0.0), "link 'lower': "),
        (rod("lower").with_shape(Shape::half_space(), Pose::identity()), "link 'lower': "),
        (rod("lower").with_limits([1.0, -1.0]), "link 'lower': the lower limit is 1"),
        (rod("lower").with_joint_damping(f64::NAN), "link 'lower': damping is NaN"),
        (rod("lower").with_position(f64::INFINITY), "finite numbers"),
        (
            LinkBuilder::new("ball", Joint::Spherical)
                .with_density(1.0)
                .with_shape(sphere(1.0), down(0.0))
                .with_position(1.0),
            "link 'ball': it has a position",
        ),
        (LinkBuilder::new("base", Joint::Fixed).with_joint_friction(1.0), "link 'base': it has settings of a joint"),
    ] {
        let message = build(link);
        assert!(message.contains(words) && message.contains("arm"), "{message}");
    }
    let arm = || ArticulationBuilder::new("arm").link(rod("upper"));
    let message = arm().mimic("upper", "lower", 1.0, 0.0).build().err().unwrap().to_string();
    assert!(message.contains("no link named 'lower'"), "{message}");
    let message = arm().exclude_collisions("upper", "lower").build().err().unwrap().to_string();
    assert!(message.contains("no link named 'lower'"), "{message}");
}

/// A mesh keeps the frame of its file: its collider, its visual and its mass are about its center.
#[test]
fn a_mesh_off_its_center_stands_where_its_file_says() {
    let mesh = collide::TriMesh::lathe(&[(0.0, 0.0), (0.1, 0.0), (0.1, 0.4), (0.0, 0.4)], 24).unwrap();
    let shape = Shape::mesh(mesh, &collide::TreeSettings::octree()).unwrap();
    let center = shape.center_of_mass();
    assert!(center.norm() > 0.1);
    let link = LinkBuilder::new("link", Joint::Floating).with_shape(shape, Pose::translation(1.0, 0.0, 0.0));
    let body = ArticulationBuilder::new("a").link(link).build().unwrap();
    let place = Vec3::x() + center;
    assert!((body.model().links()[0].mass.center - place).norm() < 1e-9);
    assert!((body.renderable().unwrap().visuals()[0].pose.translation.vector - place).norm() < 1e-12);
    let world = {
        let mut world = World::default();
        world.add(body).unwrap();
        world
    };
    assert!((world.part_states()[2].position() - place).norm() < 1e-12);
}

/// A table as a URDF has it: links that are all fixed to the base. It is ground for others and never moves.
#[test]
fn a_body_of_fixed_links_is_static() {
    for stepper in STEPPERS {
        let mut world = World::new(Settings::default().with_sleep(Some(Sleep::default()))).unwrap();
        world.set_stepper(stepper_by_name(stepper).unwrap());
        let top = LinkBuilder::new("top", Joint::Fixed)
            .with_shape(Shape::cuboid(Vec3::new(1.0, 1.0, 0.1)).unwrap(), Pose::translation(0.0, 0.0, 0.7));
        let leg = LinkBuilder::new("leg", Joint::Fixed)
            .with_parent("top")
            .with_shape(Shape::cylinder(0.05, 0.65).unwrap(), Pose::translation(0.0, 0.0, 0.325));
        let table = ArticulationBuilder::new("table").link(top).link(leg).build().unwrap();
        let table = world.add(table.with_pose(Pose::translation(0.0, 0.0, 0.2))).unwrap();
        let ball = RigidBody::new(Shape::sphere(0.1).unwrap()).with_mass(1.0);
        let ball = world.add(ball.with_pose(Pose::translation(0.1, 0.2, 1.2))).unwrap();
        // nothing supports a table on the floor: it stands in the air
        for _ in 0..480 {
            world.step().unwrap();
        }
        let at = world.part_state(ball, 0).unwrap().position();
        assert!((at - Vec3::new(0.1, 0.2, 1.05)).norm() < 1e-6, "{stepper}: {at:?}");
        assert_eq!(world.state_of(table).unwrap().len(), 0);
        let (mut again, mut fork) =
            (World::from_archive(&world.archive(&[]).unwrap(), &mut |_| None).unwrap(), world.fork());
        fork.restore(&world.save()).unwrap();
        for world in [&mut world, &mut again, &mut fork] {
            world.step().unwrap();
        }
        assert!(again.save() == world.save() && fork.save() == world.save());
    }
}

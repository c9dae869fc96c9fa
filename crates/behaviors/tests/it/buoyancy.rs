//! Buoyancy against closed forms.

use crate::{Numbers, steps};
use std::f64::consts::PI;
use tumble_behaviors::{Buoyancy, submerged};
use tumble_core::prelude::*;

const G: f64 = 9.81;

fn world(dt: f64) -> World {
    World::new(Settings::default().with_dt(dt).with_gravity(Vec3::new(0.0, 0.0, -G))).unwrap()
}

fn water(drag: f64) -> Buoyancy {
    Buoyancy::new("water", Vec3::zeros(), 1000.0).unwrap().with_drag(drag, Vec3::zeros()).unwrap()
}

#[test]
fn a_ball_floats_where_it_displaces_its_weight() {
    for (dt, share) in [(1.0 / 60.0, 0.3), (1.0 / 240.0, 0.3), (1.0 / 120.0, 0.5), (1.0 / 120.0, 0.9)] {
        let mut world = world(dt);
        let ball = RigidBody::new(Shape::sphere(0.2).unwrap()).with_mass(share * 1000.0 * 4.0 / 3.0 * PI * 0.008);
        let id = world.add(ball.with_pose(Pose::translation(0.0, 0.0, 0.1))).unwrap();
        world.add(water(3.0)).unwrap();
        steps(&mut world, (40.0 / dt) as usize);
        // t²·(3·r − t) = 4·s·r³ for the height t of the cap
        let (mut low, mut high) = (0.0, 0.4);
        for _ in 0..60 {
            let t: f64 = 0.5 * (low + high);
            if t * t * (0.6 - t) < 4.0 * share * 0.008 { low = t } else { high = t }
        }
        let z = world.body(id).unwrap().position().z;
        assert!((z - (0.2 - low)).abs() < 1e-9, "{share}: {z} is not {}", 0.2 - low);
    }
}

#[test]
fn a_box_floats_and_heaves_with_its_period_in_second_order() {
    // a box of 1 × 1 × 0.4 m and 250 kg draws 0.25 m; ω² = ρ·g·A/m
    let omega = (1000.0 * G / 250.0f64).sqrt();
    let start = |world: &mut World, z: f64| {
        let float = RigidBody::new(Shape::cuboid(Vec3::new(1.0, 1.0, 0.4)).unwrap()).with_mass(250.0);
        let id = world.add(float.with_pose(Pose::translation(0.0, 0.0, z))).unwrap();
        world.add(water(0.0)).unwrap();
        id
    };
    let mut still = world(1.0 / 60.0);
    let id = start(&mut still, -0.05);
    steps(&mut still, 600);
    assert!((still.body(id).unwrap().position() + 0.05 * Vec3::z()).norm() < 1e-9);
    let errors = [60, 120, 240].map(|rate| {
        let mut world = world(1.0 / f64::from(rate));
        let id = start(&mut world, -0.05 + 0.04);
        let energy = world.energy().total();
        steps(&mut world, 7 * rate as usize / 4);
        let drift = (world.energy().total() - energy).abs();
        // of ½·k·a² = 7.8 J
        assert!(drift < 0.05, "{drift} J");
        (world.body(id).unwrap().position().z + 0.05 - 0.04 * (1.75 * omega).cos()).abs()
    });
    println!("errors of the heave after 1.75 s {errors:?} m");
    assert!(errors.windows(2).all(|e| (e[0] / e[1] - 4.0).abs() < 0.2), "{errors:?}");
}

#[test]
fn a_tilted_box_has_the_righting_arm_of_a_wall_sided_ship() {
    // draft T at rest, tilt θ at the same displacement: the center of buoyancy moves in the frame of the box
    // by (BM·tan θ, ½·BM·tan²θ) with BM = B²/(12·T)
    let (beam, draft) = (1.0, 0.3);
    let shape = Shape::cuboid(Vec3::new(beam, 3.0, 0.8)).unwrap();
    for angle in [0.01f64, 0.1, 0.3] {
        let turn = Quat::from_axis_angle(&Vec3::y_axis(), angle);
        // the water line crosses the middle of the beam at the draft
        let line = turn * Vec3::new(0.0, 0.0, -0.4 + draft);
        let below = submerged(&shape, &Pose::from_parts(Vec3::zeros().into(), turn), &line, &Vec3::z());
        let own = turn.inverse() * below.center;
        let metacenter = beam * beam / (12.0 * draft);
        assert!((below.volume - beam * 3.0 * draft).abs() < 1e-12);
        assert!((own.x.abs() - metacenter * angle.tan()).abs() < 1e-12 && own.y.abs() < 1e-12, "{own}");
        assert!((own.z + 0.4 - 0.5 * draft - 0.5 * metacenter * angle.tan().powi(2)).abs() < 1e-12, "{own}");
    }
}

#[test]
fn a_wide_box_rights_itself_and_a_tall_one_capsizes() {
    for (size, upright) in [(Vec3::new(1.0, 1.0, 0.3), true), (Vec3::new(0.5, 0.5, 0.7), false)] {
        let mut world = world(1.0 / 120.0);
        let turn = Quat::from_axis_angle(&Vec3::y_axis(), 0.1);
        let body = RigidBody::new(Shape::cuboid(size).unwrap()).with_density(500.0);
        let id = world.add(body.with_pose(Pose::from_parts(Vec3::zeros().into(), turn))).unwrap();
        world.add(water(2.0)).unwrap();
        steps(&mut world, 120 * 30);
        let up = (world.body(id).unwrap().pose().rotation * Vec3::z()).z.abs();
        assert_eq!(up > 0.999, upright, "{up}");
    }
}

#[test]
fn volumes_below_and_above_add_up_and_match_counted_points() {
    let mut numbers = Numbers(23);
    let ring = TriMesh::torus(0.5, 0.2, 48, 24);
    let leg =
        |x: f64| CompoundPart::new(Shape::cuboid(Vec3::new(0.2, 0.3, 0.8)).unwrap(), Pose::translation(x, 0.0, 0.0));
    let shapes = [
        Shape::sphere(0.5).unwrap(),
        Shape::cuboid(Vec3::new(0.4, 1.0, 0.6)).unwrap(),
        Shape::capsule(0.3, 0.8).unwrap(),
        Shape::cylinder(0.3, 0.8).unwrap(),
        Shape::mesh(ring, &TreeSettings::octree()).unwrap(),
        Shape::compound(vec![leg(-0.3), leg(0.3)]).unwrap(),
    ];
    for shape in &shapes {
        for _ in 0..4 {
            let turn = Quat::from_scaled_axis(numbers.vector(2.0));
            let pose = Pose::from_parts((numbers.vector(0.2) + 3.0 * Vec3::x()).into(), turn);
            let (point, up) = (Vec3::new(numbers.number(), 8.0, 0.1 * numbers.number()), Vec3::z());
            let (below, above) = (submerged(shape, &pose, &point, &up), submerged(shape, &pose, &point, &-up));
            assert!((below.volume + above.volume - shape.volume()).abs() < 1e-4 * shape.volume(), "{shape:?}");
            let mean = (below.volume * below.center + above.volume * above.center) / shape.volume();
            assert!((mean - pose.translation.vector).norm() < 1e-3, "{shape:?}: {mean}");
            let (n, side) = (80, 2.4);
            let at = |k: usize| ((k as f64 + 0.5) / n as f64 - 0.5) * side;
            let (mut count, mut sum) = (0, Vec3::zeros());
            for k in 0..n * n * n {
                // a layer of cells ends at the plane
                let across = pose.translation.vector.xy();
                let p = Vec3::new(across.x + at(k % n), across.y + at(k / n % n), point.z + at(k / n / n));
                if p.z < point.z && shape.closest_point(&pose, &p).distance < 0.0 {
                    (count, sum) = (count + 1, sum + p);
                }
            }
            let counted = f64::from(count) * (side / n as f64).powi(3);
            assert!((below.volume - counted).abs() < 0.02 * shape.volume(), "{shape:?}: {below:?}, {counted}");
            if counted > 0.05 * shape.volume() {
                assert!((below.center - sum / f64::from(count)).norm() < 0.01, "{shape:?}: {below:?}");
            }
        }
    }
}

#[test]
fn the_boxes_of_a_mesh_and_a_primitive_float_alike() {
    let mut numbers = Numbers(7);
    let size = Vec3::new(0.4, 1.0, 0.6);
    let (a, b) = (Shape::cuboid(size).unwrap(), Shape::mesh(TriMesh::cuboid(size), &TreeSettings::octree()).unwrap());
    for _ in 0..500 {
        let pose = Pose::from_parts(numbers.vector(0.5).into(), Quat::from_scaled_axis(numbers.vector(3.0)));
        let up = numbers.vector(1.0).normalize();
        let [a, b] = [&a, &b].map(|shape| submerged(shape, &pose, &Vec3::zeros(), &up));
        assert!((a.volume - b.volume).abs() < 1e-12, "{a:?}, {b:?}");
        assert!((a.volume * a.center - b.volume * b.center).norm() < 1e-12, "{a:?}, {b:?}");
    }
}

#[test]
fn a_sunk_ball_rises_at_its_terminal_velocity() {
    // (ρ·V − m)·g = γ·ρ·V·v
    let mut world = world(1.0 / 60.0);
    let displaced = 1000.0 * 4.0 / 3.0 * PI * 0.001;
    let ball = RigidBody::new(Shape::sphere(0.1).unwrap()).with_mass(0.5 * displaced);
    let id = world.add(ball.with_pose(Pose::translation(0.0, 0.0, -1000.0))).unwrap();
    world.add(water(2.0)).unwrap();
    steps(&mut world, 1200);
    let v = world.body(id).unwrap().velocity();
    assert!((v - 0.5 * G / 2.0 * Vec3::z()).norm() < 1e-9, "{v}");
}

//! Cloth and jelly against closed forms and laws.

use crate::steps;
use std::time::Instant;
use tumble_behaviors::{BehaviorError, Cloth, Jelly, MeshSpring, SpringMesh};
use tumble_core::prelude::*;
use tumble_core::{ForceSlice, Integratable, PartPoint, PartState, Wrench};

const G: f64 = 9.81;

fn world(dt: f64, gravity: f64) -> World {
    World::new(Settings::default().with_dt(dt).with_gravity(Vec3::new(0.0, 0.0, -gravity))).unwrap()
}

fn spring(nodes: [usize; 2], length: f64, stiffness: f64) -> MeshSpring {
    MeshSpring { nodes, length, stiffness, damping: 0.0 }
}

#[test]
fn one_spring_swings_with_the_period_of_the_midpoint_rule() {
    let (k, m) = (200.0, 0.5f64);
    let omega = (k / m).sqrt();
    let errors = [60, 120, 240, 480].map(|rate| {
        let h = 1.0 / f64::from(rate);
        let mut world = world(h, 0.0);
        let mesh = SpringMesh::new(vec![Vec3::zeros(), 1.1 * Vec3::x()], vec![1.0, m], vec![spring([0, 1], 1.0, k)]);
        let mesh = mesh.unwrap().with_implicitness(0.5).unwrap().with_pins(|x| x.x == 0.0);
        let id = SpringMesh::add(&mut world, mesh).unwrap();
        steps(&mut world, rate as usize);
        let stretch = SpringMesh::positions(&world, id).unwrap()[1].x - 1.0;
        // exactly ω' = (2/h)·atan(½·ω·h) for this linear motion
        let slow = 2.0 / h * (0.5 * omega * h).atan();
        assert!((stretch - 0.1 * slow.cos()).abs() < 1e-10, "{stretch} is not {}", 0.1 * slow.cos());
        assert!((world.energy().total() - 0.5 * k * 0.01).abs() < 1e-11, "no energy is lost");
        (slow - omega).abs()
    });
    assert!(errors.windows(2).all(|e| e[0] / e[1] > 3.8), "of second order: {errors:?}");
}

#[test]
fn a_damped_spring_decays_as_the_midpoint_rule_says() {
    // (1 + ½hc/m + ¼h²ω²)·Δv = −h·(ω²·x_½ + c/m·v): a linear map of (x, v), written out
    let (k, m, c, h) = (90.0, 0.3, 1.5, 1.0 / 100.0);
    let mut world = world(h, 0.0);
    let damped = MeshSpring { damping: c, ..spring([0, 1], 1.0, k) };
    let mesh = SpringMesh::new(vec![Vec3::zeros(), 1.2 * Vec3::x()], vec![1.0, m], vec![damped]).unwrap();
    let mesh = mesh.with_implicitness(0.5).unwrap().with_pins(|x| x.x == 0.0);
    let id = SpringMesh::add(&mut world, mesh).unwrap();
    let (mut x, mut v) = (0.2f64, 0.0f64);
    for _ in 0..200 {
        steps(&mut world, 1);
        let half = x + 0.5 * h * v;
        let gain = -h * (k * half + c * v) / (m + 0.5 * h * c + 0.25 * h * h * k);
        (x, v) = (half + 0.5 * h * (v + gain), v + gain);
        let got = SpringMesh::positions(&world, id).unwrap()[1].x - 1.0;
        assert!((got - x).abs() < 1e-12, "{got} is not {x}");
    }
    // and that is the exact decay to second order
    let (rate, omega) = (0.5 * c / m, (k / m - 0.25 * c * c / m / m).sqrt());
    let exact = 0.2 * (-rate * 2.0f64).exp() * ((2.0 * omega).cos() + rate / omega * (2.0 * omega).sin());
    assert!((x - exact).abs() < 2e-3, "{x} is not {exact}");
}

#[test]
fn a_hanging_cloth_stretches_as_its_columns_of_springs() {
    for dt in [1.0 / 60.0, 1.0 / 240.0] {
        let mut world = world(dt, G);
        let (n, k, mass) = (9, 300.0, 0.81);
        let cloth = Cloth { nodes: [n; 2], size: [1.0; 2], mass, stiffness: [k, 0.0, 0.0], damping: 0.02 };
        let upright =
            Pose::from_parts(Vec3::zeros().into(), Quat::from_axis_angle(&Vec3::x_axis(), 0.5 * std::f64::consts::PI));
        let mesh = cloth.mesh().unwrap().with_pose(upright).with_pins(|x| x.z > 0.4999);
        let id = SpringMesh::add(&mut world, mesh).unwrap();
        steps(&mut world, (20.0 / dt) as usize);
        let positions = SpringMesh::positions(&world, id).unwrap();
        let node = mass / (n * n) as f64;
        for column in 0..n {
            // a spring carries all nodes below it
            let mut z = 0.5;
            for row in (0..n - 1).rev() {
                z -= 0.125 + (row + 1) as f64 * node * G / k;
                let at = positions[column + n * row];
                assert!((at.z - z).abs() < 1e-7, "{at} is not at {z}");
                assert!((at.x - (column as f64 * 0.125 - 0.5)).abs() < 1e-7 && at.y.abs() < 1e-7, "{at}");
            }
        }
    }
}

#[test]
fn energy_falls_monotonically_under_damping() {
    // a sheet that is thrown, folded and stretched, without contacts
    for dt in [1.0 / 60.0, 1.0 / 240.0] {
        let mut world = world(dt, G);
        let cloth = Cloth { nodes: [12; 2], stiffness: [400.0, 200.0, 20.0], damping: 0.05, ..Cloth::default() };
        let mesh = cloth.mesh().unwrap().with_pins(|x| x.y > 0.4999 && x.x.abs() > 0.4999);
        let id = SpringMesh::add(&mut world, mesh).unwrap();
        let mut x = world.state_of(id).unwrap().to_vec();
        let half = x.len() / 2;
        for node in 0..half / 3 {
            let free = x[3 * node + 1] < 0.4;
            x[half + 3 * node + 2] = if free { 2.0 * (7.0 * x[3 * node]).sin() } else { 0.0 };
        }
        world.write_state_of(id, &x).unwrap();
        let mut last = world.energy().total();
        let first = last;
        for frame in 0..(5.0 / dt) as usize {
            steps(&mut world, 1);
            let now = world.energy().total();
            assert!(now < last + 1e-9, "frame {frame} of {dt}: {last} to {now} J");
            last = now;
        }
        println!("{first:.4} to {last:.4} J at {dt:.4}");
    }
}

#[test]
fn stiff_cloth_stays_stable_at_60_hz() {
    let mut world = world(1.0 / 60.0, G);
    let cloth = Cloth { stiffness: [1e6, 1e6, 1e4], damping: 0.0, ..Cloth::default() };
    let mesh = cloth.mesh().unwrap().with_pins(|x| x.y > 0.4999 && x.x.abs() > 0.4999);
    let springs = mesh.springs().to_vec();
    let id = SpringMesh::add(&mut world, mesh).unwrap();
    let mut longest = 0.0f64;
    let start = Instant::now();
    for frame in 0..600 {
        steps(&mut world, 1);
        let x = SpringMesh::positions(&world, id).unwrap();
        assert!(x.iter().all(|x| x.norm() < 2.0), "frame {frame}");
        let strain = |s: &&MeshSpring| ((x[s.nodes[0]] - x[s.nodes[1]]).norm() - s.length) / s.length;
        if frame > 10 {
            longest = springs.iter().filter(|s| s.stiffness > 1e5).map(|s| strain(&s)).fold(longest, f64::max);
        }
    }
    println!("{:.2} ms a frame, largest strain {longest:.4}", start.elapsed().as_secs_f64() / 0.6);
    assert!(longest < 1e-3, "{longest}");
    // it hangs: a sheet of 1 m held at two corners
    let lowest = SpringMesh::positions(&world, id).unwrap().iter().map(|x| x.z).fold(0.0, f64::min);
    assert!(lowest < -0.7 && lowest > -1.2, "{lowest}");
}

#[test]
fn a_ball_falls_on_a_sheet_and_stays_on_it() {
    for stiffness in [[2e3, 1e3, 10.0], [1e5, 5e4, 100.0]] {
        let mut world = world(1.0 / 120.0, G);
        let cloth = Cloth { nodes: [16; 2], mass: 0.3, stiffness, damping: 0.02, ..Cloth::default() };
        let mesh = cloth.mesh().unwrap().with_radius(0.03).unwrap().with_pins(|x| x.xy().amax() > 0.4999);
        let id = SpringMesh::add(&mut world, mesh).unwrap();
        let ball =
            RigidBody::new(Shape::sphere(0.15).unwrap()).with_mass(1.0).with_pose(Pose::translation(0.05, 0.0, 0.5));
        let ball = world.add(ball).unwrap();
        steps(&mut world, 120 * 3);
        let (mut lift, mut rest) = (0.0, 0.0f64);
        for _ in 0..240 {
            steps(&mut world, 1);
            let up = |c: &ContactPoint| if c.a == ball { c.impulse.z } else { -c.impulse.z };
            lift += world.contacts().iter().map(up).sum::<f64>() / 2.0;
            rest = rest.max(world.body(ball).unwrap().velocity().norm());
        }
        let body = world.body(ball).unwrap();
        println!("ball at {:.4} m, at most {rest:.4} m/s, lifted by {lift:.4} N", body.position().z);
        assert!(rest < 0.1 && body.position().xy().norm() < 0.25 && body.position().z > -0.5, "{}", body.position());
        // in the mean of two seconds the contacts carry its weight, less the change of its velocity
        assert!((lift - G).abs() < 0.01 * G, "{lift} N");
        let depth = world.contacts().iter().map(|c| c.depth).fold(0.0, f64::max);
        assert!(depth < 1e-3 && SpringMesh::positions(&world, id).unwrap().iter().all(|x| x.z < 0.1), "{depth}");
    }
}

/// A sheet that falls on a ball has a hundred events in a frame, and springs that are implicit in time have no motion within a step
/// to locate them in.
#[test]
fn backtracking_takes_the_steps_that_a_mesh_is_made_for() {
    let run = |stepper: &str| {
        let mut settings = Settings::default().with_dt(1.0 / 60.0);
        settings.substeps = 2;
        let mut world = World::new(settings).unwrap();
        world.set_stepper(tumble_core::stepper_by_name(stepper).unwrap());
        world.add(RigidBody::fixed(Shape::sphere(0.3).unwrap())).unwrap();
        let mesh = Cloth { nodes: [9; 2], ..Cloth::default() }.mesh().unwrap().with_radius(0.03).unwrap();
        SpringMesh::add(&mut world, mesh.with_pose(Pose::translation(0.0, 0.0, 0.4))).unwrap();
        steps(&mut world, 30);
        world.state().to_vec()
    };
    assert_eq!(run("backtracking"), run("time_stepping"));
}

#[test]
fn a_sheet_that_drapes_over_a_ball_is_solved() {
    // about 90 contacts with friction on one object: sweeps alone leave 1e-3 m/s after 200 of them
    let mut world = world(1.0 / 120.0, G);
    let material = Material { friction: 0.3, ..Material::default() };
    world.add(RigidBody::fixed(Shape::sphere(0.3).unwrap()).with_material(material)).unwrap();
    let cloth = Cloth { nodes: [17; 2], mass: 0.289, stiffness: [400.0, 40.0, 0.5], ..Cloth::default() };
    let mesh = cloth.mesh().unwrap().with_radius(0.03).unwrap().with_material(material);
    SpringMesh::add(&mut world, mesh.with_pose(Pose::translation(0.0, 0.0, 0.4))).unwrap();
    let mut most = 0;
    for step in 0..150 {
        let report = *world.step().unwrap();
        let [rows, residual] = report.worst_solve.map_or([0.0; 2], |worst| [worst.rows.into(), report.residual]);
        assert!(report.unconverged == 0 && residual < 1e-8, "step {step}: {rows} rows, {residual} m/s");
        most = most.max(report.contacts);
    }
    assert!(most > 80, "{most} contacts");
}

#[test]
fn a_jelly_lands_keeps_its_shape_and_rests() {
    let mut world = world(1.0 / 120.0, G);
    world.add(RigidBody::fixed(Shape::half_space())).unwrap();
    let mesh = Jelly::default().mesh().unwrap().with_radius(0.02).unwrap().with_pose(Pose::translation(0.0, 0.0, 0.4));
    let id = SpringMesh::add(&mut world, mesh).unwrap();
    steps(&mut world, 360);
    let x = SpringMesh::positions(&world, id).unwrap();
    let lowest = x.iter().map(|x| x.z).fold(f64::INFINITY, f64::min);
    let highest = x.iter().map(|x| x.z).fold(f64::NEG_INFINITY, f64::max);
    assert!((lowest - 0.02).abs() < 1e-4, "{lowest}");
    assert!((0.15..0.2).contains(&(highest - lowest)), "{}", highest - lowest);
    let kinetic = world.energy().kinetic;
    assert!(kinetic < 1e-4, "{kinetic} J");
    let lift: f64 = world.contacts().iter().map(|c| c.force.z.abs()).sum();
    assert!((lift - 2.0 * G).abs() < 0.01 * G, "{lift} N");
}

#[test]
fn momentum_of_a_free_mesh_is_kept() {
    // linear momentum with any rule, angular momentum with the midpoint rule, to the tolerance of Newton's method
    for (theta, kept) in [(0.5, 1e-8), (1.0, 1.0)] {
        let mut world = world(1.0 / 60.0, 0.0);
        let jelly = Jelly { damping: 0.0, ..Jelly::default() };
        let mesh = jelly.mesh().unwrap().with_velocity(Vec3::new(0.3, 0.0, 1.0));
        let id = SpringMesh::add(&mut world, mesh.with_implicitness(theta).unwrap()).unwrap();
        let mut x = world.state_of(id).unwrap().to_vec();
        let half = x.len() / 2;
        (0..half / 3).for_each(|node| x[half + 3 * node] += 20.0 * x[3 * node + 1] - 3.0 * x[3 * node]);
        world.write_state_of(id, &x).unwrap();
        let before = world.momentum();
        steps(&mut world, 120);
        let after = world.momentum();
        assert!((after.linear - before.linear).norm() < 1e-10, "{}", after.linear);
        let change = (after.angular - before.angular).norm() / before.angular.norm();
        println!("θ = {theta}: angular momentum changes by {change:.2e} of itself");
        assert!(change < kept, "{change}");
    }
}

#[test]
fn the_same_bits_in_forks_and_on_any_number_of_threads() {
    let run = |threads| {
        let mut world = world(1.0 / 120.0, G);
        world.set_settings(world.settings().with_threads(threads)).unwrap();
        world.add(RigidBody::fixed(Shape::half_space())).unwrap();
        let mesh = Cloth { nodes: [10; 2], ..Cloth::default() }.mesh().unwrap().with_radius(0.03).unwrap();
        SpringMesh::add(&mut world, mesh.with_pose(Pose::translation(0.0, 0.0, 0.2))).unwrap();
        steps(&mut world, 40);
        let mut fork = world.fork();
        steps(&mut world, 40);
        steps(&mut fork, 40);
        assert!(world.save() == fork.save());
        world.save()
    };
    let first = run(1);
    assert!(first == run(2) && first == run(5));
}

#[test]
fn the_laws_of_the_maps() {
    let mesh = Cloth { nodes: [4, 3], ..Cloth::default() }.mesh().unwrap().with_pins(|x| x.x > 0.4999);
    let sizes = mesh.state_sizes();
    let mut x = vec![0.0; sizes.x];
    mesh.write_initial(&mut x);
    x.iter_mut().enumerate().for_each(|(k, x)| *x += 0.03 * (k as f64).sin());
    let (mut cache, mut parts) = (mesh.new_cache(), vec![PartState::default(); sizes.parts]);
    mesh.refresh(&x, &mut cache, &mut parts);
    let v: Vec<f64> = (0..sizes.dof).map(|k| (1.7 * k as f64).cos()).collect();
    let [mut u, mut back, mut j, mut y] = [(); 4].map(|()| vec![0.0; sizes.dof]);
    mesh.mul_l(&mut cache, &v, &mut u);
    mesh.solve_l(&mut cache, &u, &mut back);
    assert!(v.iter().zip(&back).all(|(a, b)| (a - b).abs() < 1e-10), "L⁻¹·L = 1");
    mesh.mul_lt(&mut cache, &u, &mut j);
    mesh.solve_lt(&mut cache, &j, &mut y);
    assert!(u.iter().zip(&y).all(|(a, b)| (a - b).abs() < 1e-10), "L⁻ᵀ·Lᵀ = 1");
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    assert!((dot(&j, &v) - dot(&u, &u)).abs() < 1e-9, "vᵀ·LᵀL·v = |L·v|²");
    // a force on a node that is free accelerates it along the force; a pinned one stays
    let mut wrenches = vec![Wrench::default(); sizes.parts];
    wrenches[0].force = Vec3::new(0.0, 0.0, 1e6);
    let zero = vec![0.0; sizes.dof];
    let mut dp = vec![0.0; sizes.dof];
    mesh.derivative(
        &mut cache,
        &x,
        &ForceSlice { part_states: &parts, wrenches: &wrenches, generalized: &zero },
        &mut dp,
    );
    assert!(dp[2] > 1e5 && dp[9..12] == [0.0; 3], "{:?}", &dp[..12]);
    let axes = [Vec3::z()];
    let at = PartPoint { part: 0, part_state: &parts[0], point: parts[0].position(), axes: &axes };
    let mut row = vec![0.0; sizes.dof];
    mesh.jacobian(&mut cache, &at, &mut row);
    assert_eq!((row[2], row.iter().sum::<f64>()), (1.0, 1.0));
}

#[test]
fn constants_of_meshes_are_refused_by_name() {
    let one = |spring| SpringMesh::new(vec![Vec3::zeros(), Vec3::x()], vec![1.0; 2], vec![spring]).map(drop);
    let named = |result: Result<(), BehaviorError>, name: &str| {
        let error = result.unwrap_err().to_string();
        assert!(error.starts_with(name), "{error}");
    };
    named(one(spring([0, 2], 1.0, 1.0)), "a node of a spring");
    named(one(spring([1, 1], 1.0, 1.0)), "a node of a spring");
    named(one(spring([0, 1], 0.0, 1.0)), "the length of a spring");
    named(one(spring([0, 1], 1.0, f64::NAN)), "the stiffness of a spring");
    named(SpringMesh::new(vec![Vec3::zeros()], vec![0.0], vec![]).map(drop), "the mass of a node");
    named(SpringMesh::new(vec![Vec3::zeros()], vec![], vec![]).map(drop), "the number of masses");
    named(Cloth { nodes: [1, 5], ..Cloth::default() }.mesh().map(drop), "the nodes of a cloth");
    named(Jelly { nodes: [1000; 3], ..Jelly::default() }.mesh().map(drop), "the number of nodes");
}

#[test]
fn a_mesh_whose_factor_needs_too_much_memory_is_refused() {
    // each of 700 nodes with each other: 57 million pairs of blocks
    let nodes: Vec<Vec3> = (0..700).map(|k| Vec3::new(f64::from(k), f64::from(k % 7), f64::from(k % 13))).collect();
    let spring = |nodes| MeshSpring { nodes, length: 1.0, stiffness: 1.0, damping: 0.0 };
    let springs = (0..700).flat_map(|a| (0..a).map(move |b| spring([a, b]))).collect();
    let error = SpringMesh::new(nodes, vec![1.0; 700], springs).err().unwrap().to_string();
    assert!(error.contains("fewer nodes"), "{error}");
    // a block of 46 nodes along each edge: 12 thousand million
    let block = Jelly { nodes: [46; 3], ..Jelly::default() };
    assert!(block.mesh().err().is_some_and(|error| error.to_string().contains("fewer nodes")));
}

#[test]
fn a_changed_step_changes_the_response_at_once() {
    let response = |before: bool| {
        let mut world = World::new(Settings::default().with_gravity(Vec3::zeros())).unwrap();
        let id = SpringMesh::add(&mut world, Cloth::default().mesh().unwrap()).unwrap();
        if before {
            world.apply_impulse(id, 3, Vec3::zeros(), &Vec3::zeros()).unwrap();
        }
        world.get_mut::<SpringMesh>(id).unwrap().set_step(0.05).unwrap();
        world.apply_impulse(id, 3, Vec3::new(1e-3, 2e-3, 3e-3), &Vec3::zeros()).unwrap();
        world.state_of(id).unwrap().to_vec()
    };
    assert!(response(true) == response(false), "the factor of the old step is out of date");
}

//! Rapier in double precision on the problems of `benches/python/work_precision.py`, which knows their answers: `make work-precision`.
//!
//! Prints a line per run: title of the problem, steps per second, CPU seconds of a simulated second, and the values at its end.

use rapier3d_f64::prelude::*;
use tumble_peers::clock::cpu_seconds;

const G: f64 = 9.81;
const RATES: [u32; 7] = [30, 60, 120, 240, 480, 960, 1920];
/// CPU seconds for one measured point, at least.
const LEAST: f64 = 0.1;

/// A problem: title, simulated seconds, its world, and what is asked for.
type Problem = (&'static str, f64, fn() -> (PhysicsWorld, Vec<RigidBodyHandle>), fn(&[&RigidBody]) -> Vec<f64>);

fn main() {
    let along_x = |bodies: &[&RigidBody]| vec![bodies[0].translation().x];
    let problems: [Problem; 6] = [
        ("free body that tumbles", 2.0, tumbling, |bodies| {
            let turn = bodies[0].position().rotation;
            vec![turn.w, turn.x, turn.y, turn.z]
        }),
        ("double pendulum", 3.0, double_pendulum, |bodies| {
            let [a, b] = [0, 1].map(|i| {
                let down = bodies[i].position().rotation * vector([0.0, 0.0, -1.0]);
                (-down.x).atan2(-down.z)
            });
            vec![a, b - a]
        }),
        ("box that slides to rest", 1.0, || on_plane(ColliderBuilder::cuboid(0.1, 0.1, 0.1), 0.5, 2.0, 0.0), along_x),
        ("ball that slides, then rolls", 2.0, || on_plane(ColliderBuilder::ball(0.1), 0.2, 3.0, 0.0), along_x),
        (
            "ball that rolls down a slope",
            2.0,
            || on_plane(ColliderBuilder::ball(0.1), 0.5, 0.0, 20_f64.to_radians()),
            along_x,
        ),
        ("tower of ten cubes", 2.0, tower, |bodies| {
            bodies.iter().flat_map(|body| <[f64; 3]>::from(body.translation())).collect()
        }),
    ];
    for (title, end, start, asked) in problems {
        for rate in RATES {
            let (mut spent, mut times, mut values) = (0.0, 0, Vec::new());
            while spent < LEAST {
                let (mut world, handles) = start();
                world.integration_parameters.dt = 1.0 / f64::from(rate);
                let before = cpu_seconds();
                for _ in 0..(end * f64::from(rate)).round() as u32 {
                    world.step();
                }
                (spent, times) = (spent + cpu_seconds() - before, times + 1);
                let bodies: Vec<&RigidBody> = handles.iter().map(|handle| &world.bodies[*handle]).collect();
                values = asked(&bodies);
            }
            let values: Vec<String> = values.iter().map(|value| format!("{value:e}")).collect();
            println!("{title}\t{rate}\t{:e}\t{}", spent / (f64::from(times) * end), values.join(" "));
        }
    }
}

fn vector(v: [f64; 3]) -> Vector {
    Vector::from(v)
}

fn world(gravity: [f64; 3]) -> PhysicsWorld {
    let mut world = PhysicsWorld::new();
    world.gravity = vector(gravity);
    world
}

fn dynamic(position: [f64; 3]) -> RigidBodyBuilder {
    RigidBodyBuilder::dynamic().translation(vector(position)).can_sleep(false)
}

fn tumbling() -> (PhysicsWorld, Vec<RigidBodyHandle>) {
    let mut world = world([0.0; 3]);
    let mass = MassProperties::new(vector([0.0; 3]), 1.0, vector([0.02, 0.03, 0.045]));
    let body = dynamic([0.0; 3]).additional_mass_properties(mass).angvel(vector([3.0, 4.0, 2.0]));
    let body = world.insert_body(body.gyroscopic_forces_enabled(true));
    (world, vec![body])
}

/// Two rods of 1 m whose joints are impulse joints, Rapier's usual kind.
fn double_pendulum() -> (PhysicsWorld, Vec<RigidBodyHandle>) {
    let mut world = world([0.0, 0.0, -G]);
    let mut before = world.insert_body(RigidBodyBuilder::fixed().translation(vector([0.0, 0.0, 3.0])));
    let (mut end, mut anchor, mut rods) = ([0.0, 3.0], [0.0; 3], Vec::new());
    for angle in [90_f64.to_radians(), 40_f64.to_radians()] {
        let down = [-angle.sin(), -angle.cos()];
        let center = [end[0] + 0.5 * down[0], 0.0, end[1] + 0.5 * down[1]];
        let mass = MassProperties::new(vector([0.0; 3]), 1.0, vector([1.0 / 12.0, 1.0 / 12.0, 0.001]));
        let rod = dynamic(center).rotation(vector([0.0, angle, 0.0])).additional_mass_properties(mass);
        let rod = world.insert_body(rod);
        let joint = RevoluteJointBuilder::new(vector([0.0, 1.0, 0.0]));
        world.insert_impulse_joint(
            before,
            rod,
            joint.local_anchor1(vector(anchor)).local_anchor2(vector([0.0, 0.0, 0.5])),
        );
        (before, end, anchor) = (rod, [end[0] + down[0], end[1] + down[1]], [0.0, 0.0, -0.5]);
        rods.push(rod);
    }
    (world, rods)
}

/// A body of 1 kg on a plane that leans by an angle, which gravity has instead.
fn on_plane(shape: ColliderBuilder, friction: f64, speed: f64, slope: f64) -> (PhysicsWorld, Vec<RigidBodyHandle>) {
    let mut world = world([G * slope.sin(), 0.0, -G * slope.cos()]);
    ground(&mut world, friction);
    let body = dynamic([0.0, 0.0, 0.1]).linvel(vector([speed, 0.0, 0.0]));
    let body = world.insert(body, shape.mass(1.0).friction(friction)).0;
    (world, vec![body])
}

fn tower() -> (PhysicsWorld, Vec<RigidBodyHandle>) {
    let mut world = world([0.0, 0.0, -G]);
    ground(&mut world, 0.5);
    let cubes = (0..10).map(|i| {
        let cube = ColliderBuilder::cuboid(0.1, 0.1, 0.1).mass(1.0).friction(0.5);
        world.insert(dynamic([0.0, 0.0, 0.1 + 0.2 * f64::from(i)]), cube).0
    });
    let cubes = cubes.collect();
    (world, cubes)
}

fn ground(world: &mut PhysicsWorld, friction: f64) {
    let up = nalgebra::Unit::new_unchecked([0.0, 0.0, 1.0].into());
    world.insert(RigidBodyBuilder::fixed(), ColliderBuilder::halfspace(up).friction(friction));
}

//! Particles that cut edges and surfaces at a slant: each is deflected where its path goes into a shape, and only there. The oracle
//! counts the gap at thousands of points of the path.

use crate::Numbers;
use tumble_behaviors::{ParticleSettings, ParticleSystem};
use tumble_core::prelude::*;

const DT: f64 = 1.0 / 60.0;
const RADIUS: f64 = 0.01;
/// Points of a path at which the oracle counts the gap.
const POINTS: u32 = 4000;
/// Least depth of a cut, and least gap of a pass, m: the points of the oracle may miss less.
const CLEAR: f64 = 2e-4;

/// A shape that may move in the frame, and the gap between it and a ball at a point, m, at a share of the frame.
struct Case<'a> {
    name: &'a str,
    shape: Shape,
    velocity: Vec3,
    spin: Vec3,
    gravity: Vec3,
}

impl Case<'_> {
    fn pose(&self, share: f64) -> Pose {
        let turn = Quat::from_scaled_axis(share * DT * self.spin);
        Pose::from_parts((share * DT * self.velocity).into(), turn)
    }

    fn gap(&self, point: &Vec3, share: f64) -> f64 {
        self.shape.closest_point(&self.pose(share), point).distance - RADIUS
    }

    fn least_gap(&self, start: &Vec3, velocity: &Vec3) -> f64 {
        let at = |share: f64| start + share * DT * (velocity + 0.5 * share * DT * self.gravity);
        let gap = |k| f64::from(k) / f64::from(POINTS);
        (0..=POINTS).map(gap).map(|share| self.gap(&at(share), share)).fold(f64::INFINITY, f64::min)
    }

    /// Flies a particle for a frame: its end, and the velocity that a free flight would have there.
    fn fly(&self, start: Vec3, velocity: Vec3) -> (Vec3, Vec3, Vec3) {
        let settings = Settings::default().with_dt(DT).with_gravity(self.gravity);
        let mut world = World::new(settings).unwrap();
        let body = RigidBody::new(self.shape.clone()).with_velocity(self.velocity).with_angular_velocity(self.spin);
        let body = world.add(body).unwrap();
        world.set_mode(body, Mode::Kinematic).unwrap();
        let drops = ParticleSettings { radius: RADIUS, ..ParticleSettings::default() };
        let system = world.add(ParticleSystem::new("drops", drops).unwrap()).unwrap();
        ParticleSystem::spawn(&mut world, system, start, velocity, 1.0).unwrap();
        world.step().unwrap();
        let end = ParticleSystem::particles(&world, system).unwrap().next().unwrap();
        (end.position, end.velocity, velocity + DT * self.gravity)
    }

    /// Lets particles pass near points of the surface, mostly along it, until enough of them cut it and enough do not.
    fn check(&self, each: usize, seed: u64) {
        let mut numbers = Numbers(seed);
        let (mut cut, mut passed) = (0, 0);
        while cut < each || passed < each {
            let direction = numbers.vector(1.0);
            let surface = self.shape.closest_point(&self.pose(0.5), &(3.0 * direction));
            // a velocity across the normal, and a little along it
            let along = surface.normal.cross(&numbers.vector(1.0));
            let velocity = 12.0 * numbers.number() * along + 2.0 * numbers.number() * surface.normal;
            let middle = surface.point + RADIUS * surface.normal + numbers.vector(0.02);
            let start = middle - 0.5 * DT * velocity;
            let least = self.least_gap(&start, &velocity);
            if self.gap(&start, 0.0) < 1e-4 || least.abs() < CLEAR {
                continue; // it begins inside, or grazes
            }
            let (end, fast, free) = self.fly(start, velocity);
            let deflected = (fast - free).norm() > 1e-9;
            assert!(
                deflected == (least < 0.0),
                "{}: from {start:?} at {velocity:?}: the gap falls to {least} m, and deflected is {deflected}",
                self.name
            );
            assert!(self.gap(&end, 1.0) > -1e-9, "{}: {} m", self.name, self.gap(&end, 1.0));
            if deflected { cut += 1 } else { passed += 1 }
        }
    }
}

fn still(name: &str, shape: Shape) -> Case<'_> {
    Case { name, shape, velocity: Vec3::zeros(), spin: Vec3::zeros(), gravity: Vec3::zeros() }
}

fn block() -> Shape {
    Shape::cuboid(Vec3::new(1.0, 0.8, 0.6)).unwrap()
}

#[test]
fn edges_of_a_box_that_are_cut_at_a_slant_are_not_missed() {
    still("box", block()).check(150, 11);
}

#[test]
fn shapes_of_every_kind_are_hit_at_a_slant() {
    // its center of mass is the origin of its parts
    let part = |shape: Shape, x: f64| CompoundPart::new(shape, Pose::translation(x, 0.2 * x, 0.1 * x));
    let ball = Shape::sphere(0.4).unwrap();
    let compound = Shape::compound(vec![part(ball.clone(), -0.5), part(block(), 0.0), part(ball, 0.5)]);
    for (name, shape) in [
        ("sphere", Shape::sphere(0.5).unwrap()),
        ("capsule", Shape::capsule(0.2, 0.8).unwrap()),
        ("cylinder", Shape::cylinder(0.3, 0.9).unwrap()),
        ("ellipsoid", Shape::ellipsoid(Vec3::new(0.6, 0.4, 0.2)).unwrap()),
        ("cone", Shape::cone(0.4, 0.9).unwrap()),
        ("rounded box", Shape::rounded_cuboid(Vec3::new(1.0, 0.8, 0.6), 0.1).unwrap()),
        ("mesh", Shape::mesh(TriMesh::cuboid(Vec3::new(1.0, 0.8, 0.6)), &TreeSettings::octree()).unwrap()),
        ("compound", compound.unwrap()),
    ] {
        still(name, shape).check(60, 5);
    }
}

#[test]
fn moving_and_turning_shapes_are_hit_at_a_slant_on_curved_paths() {
    let gravity = Vec3::new(30.0, -20.0, -200.0);
    for (spin, velocity) in [(Vec3::zeros(), Vec3::new(3.0, -2.0, 1.0)), (Vec3::new(20.0, 9.0, -14.0), Vec3::zeros())] {
        Case { name: "moving box", shape: block(), velocity, spin, gravity }.check(60, 3);
        let capsule = Shape::capsule(0.2, 0.8).unwrap();
        Case { name: "moving capsule", shape: capsule, velocity, spin, gravity: Vec3::zeros() }.check(60, 4);
    }
}

/// Without friction a point slides off a table at its speed, and its fall begins at the edge, wherever in a frame it gets there.
#[test]
fn a_fall_begins_at_the_edge_of_a_table() {
    for rate in [30.0, 60.0, 240.0] {
        for speed in [0.31, 1.7, 6.3] {
            let settings = Settings::default().with_dt(1.0 / rate).with_gravity(Vec3::new(0.0, 0.0, -9.81));
            let mut world = World::new(settings).unwrap();
            let smooth = Material { friction: 0.0, ..Material::default() };
            let table = RigidBody::fixed(Shape::cuboid(Vec3::new(1.0, 1.0, 0.1)).unwrap()).with_material(smooth);
            world.add(table.with_pose(Pose::translation(-0.5, 0.0, -0.05))).unwrap();
            let drops = ParticleSettings { radius: 0.0, material: smooth, ..ParticleSettings::default() };
            let system = world.add(ParticleSystem::new("drops", drops).unwrap()).unwrap();
            let (start, velocity) = (Vec3::new(-0.1, 0.0, 0.0), Vec3::new(speed, 0.0, 0.0));
            ParticleSystem::spawn(&mut world, system, start, velocity, 10.0).unwrap();
            let frames = (rate * (0.1 / speed + 0.3)).ceil();
            crate::steps(&mut world, frames as usize);
            let particle = ParticleSystem::particles(&world, system).unwrap().next().unwrap();
            // it has left 0.01 mm beyond the edge
            let fallen = (frames / rate - (0.1 + 1e-5) / speed).max(0.0);
            let (depth, fall) = (-0.5 * 9.81 * fallen * fallen, -9.81 * fallen);
            let off = (particle.position.z - depth).abs() + (particle.velocity.z - fall).abs();
            assert!(off < 1e-6, "{rate} Hz, {speed} m/s: {particle:?}, {depth} m and {fall} m/s expected");
            assert!((particle.position.x - (speed * frames / rate - 0.1)).abs() < 1e-9);
        }
    }
}

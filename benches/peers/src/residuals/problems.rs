//! Ten contact problems, taken from worlds by a solver that keeps a copy of what it solves.

use crate::Engine;
use crate::scene::Scene;
use crate::scenes;
use crate::tumble::Tumble;
use std::sync::{Arc, Mutex};
use tumble_collide::{Mat3, Pose, Shape, Vec3};
use tumble_core::rows::Rows;
use tumble_core::solver::{GaussSeidel, RowSolver, SolveReport, SolverSettings};
use tumble_core::{
    ArticulatedBody, Collider, DofSettings, Drive, Joint, LinkMass, ModelBuilder, RigidBody, Settings, World,
};

/// The rows of one island.
#[derive(Clone, Debug)]
pub struct Problem {
    /// Title in the picture.
    pub name: &'static str,
    /// All rows of the step.
    pub rows: Rows,
    /// The blocks of the island.
    pub blocks: Vec<u32>,
    /// Free velocities of all rows, m/s.
    pub c: Vec<f64>,
}

/// Returns the problems, in the order of the picture.
pub fn problems() -> Vec<Problem> {
    let piles = scenes::all();
    let pile = |name: &str| piles.iter().find(|s| s.name == name).expect("the scene is there");
    vec![
        first("a box", &scenes::tower(1)),
        first("tower of 10", pile("tower-10")),
        first("tower of 30", pile("tower-30")),
        first("tower of 100", pile("tower-100")),
        first("pyramid of 55", pile("pyramid-55")),
        first("pyramid of 210", pile("pyramid-210")),
        at("200 boxes, settled", pile("boxes-200-e0-240hz"), 6.0),
        at("200 boxes in motion", pile("boxes-200-e0-60hz"), 0.7),
        first("mass ratio 1e6", pile("cubes-1e6")),
        standing_robot(),
    ]
}

/// A solver that keeps the largest problem of a frame.
#[derive(Clone, Default)]
struct Keeper {
    kept: Arc<Mutex<Option<Problem>>>,
}

impl RowSolver for Keeper {
    fn name(&self) -> &'static str {
        "keeper"
    }

    fn solve(
        &self,
        rows: &Rows,
        blocks: &[u32],
        c: &[f64],
        lambda: &mut [f64],
        du: &mut [f64],
        settings: SolverSettings,
    ) -> SolveReport {
        let mut kept = self.kept.lock().expect("no solve has panicked");
        if kept.as_ref().is_none_or(|p| p.blocks.len() < blocks.len()) {
            *kept = Some(Problem { name: "", rows: rows.clone(), blocks: blocks.to_vec(), c: c.to_vec() });
        }
        drop(kept);
        GaussSeidel.solve(rows, blocks, c, lambda, du, settings)
    }

    fn fork(&self) -> Box<dyn RowSolver> {
        Box::new(self.clone())
    }
}

impl Keeper {
    fn take(&self, name: &'static str) -> Problem {
        let kept = self.kept.lock().expect("no solve has panicked").take();
        Problem { name, ..kept.expect("the frame has contacts") }
    }
}

/// Returns the problem of the first frame.
fn first(name: &'static str, scene: &Scene) -> Problem {
    at(name, scene, 0.0)
}

/// Returns the largest problem of the frame after a time, s.
fn at(name: &'static str, scene: &Scene, time: f64) -> Problem {
    let keeper = Keeper::default();
    let mut world = Tumble::new(scene);
    (0..(time * scene.rate as f64) as usize).for_each(|_| world.step());
    world.set_solver(Box::new(keeper.clone()));
    world.step();
    keeper.take(name)
}

/// Returns the problem of a robot of 30 kg on four legs with two driven hinges each, after a second.
fn standing_robot() -> Problem {
    let mass = |mass: f64, center: Vec3, size: Vec3| {
        let square = size.component_mul(&size);
        let moments = Vec3::new(square.y + square.z, square.x + square.z, square.x + square.y);
        LinkMass { mass, center, inertia: Mat3::from_diagonal(&(mass / 12.0 * moments)) }
    };
    let (trunk, bone) = (Vec3::new(0.6, 0.3, 0.15), Vec3::new(0.04, 0.04, 0.3));
    let mut builder = ModelBuilder::new();
    let root = builder.link("trunk", None, Joint::Floating, Pose::identity(), mass(22.0, Vec3::zeros(), trunk));
    let half = Vec3::new(0.0, 0.0, -0.15);
    let mut shanks = Vec::new();
    for (i, [x, y]) in [[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]].into_iter().enumerate() {
        let hip = Pose::translation(0.25 * x, 0.15 * y, 0.0);
        let thigh =
            builder.link(format!("thigh{i}"), Some(root), Joint::revolute(Vec3::y()), hip, mass(1.5, half, bone));
        let knee = Pose::translation(0.0, 0.0, -0.3);
        let name = format!("shank{i}");
        builder.link(name.clone(), Some(thigh), Joint::revolute(Vec3::y()), knee, mass(0.5, half, bone));
        shanks.push(name);
    }
    let bend: f64 = 0.5;
    let foot = 0.03;
    let height = 0.6 * bend.cos() + foot;
    let mut robot = ArticulatedBody::new("robot", builder.build().expect("a valid model"));
    for shank in &shanks {
        let shape = Shape::sphere(foot).expect("a radius above 0");
        let collider = Collider::new(shape, Pose::translation(0.0, 0.0, -0.3));
        robot.add_collider(shank, collider).expect("the link is there");
    }
    let mut q = vec![0.0, 0.0, height, 0.0, 0.0, 0.0, 1.0];
    for dof in 6..14 {
        let target = if dof % 2 == 0 { bend } else { -2.0 * bend };
        let drive = Drive::Position { stiffness: 400.0, damping: 20.0, target, velocity: 0.0, limit: 80.0 };
        robot.set_dof(dof, DofSettings { drive, ..DofSettings::default() }).expect("a hinge");
        q.push(target);
    }
    let keeper = Keeper::default();
    let mut world = World::new(Settings::default()).expect("the default settings are valid");
    world.add_static(RigidBody::fixed(Shape::half_space())).expect("a fixed body is valid");
    world.add(robot.with_positions(&q).expect("as many as the model has")).expect("the name is unique");
    for _ in 0..240 {
        world.step().expect("all numbers are finite");
    }
    world.set_solver(Box::new(keeper.clone()));
    world.step().expect("all numbers are finite");
    keeper.take("a robot standing")
}

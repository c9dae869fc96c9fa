//! Flush shapes of a compound that moves act like one box: bodies slide and roll over the seams of a platform that
//! is driven, that floats or that stands on the ground, and each case is compared with the same one on a single box.

use crate::common::*;
use tumble_core::collide::{CompoundPart, Pose, Quat, Shape, TreeSettings, TriMesh, Vec3};
use tumble_core::*;

/// Size of the platform, m.
const SIZE: Vec3 = Vec3::new(3.0, 2.0, 0.2);
/// Edge of its cells, m.
const CELL: f64 = 0.25;

/// How the cells of a platform are made.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Cells {
    /// One box in the place of all.
    One,
    Box,
    Hull,
    Mesh,
}

impl Cells {
    /// Returns the shapes of a platform, about its center.
    fn shapes(self) -> Vec<(Shape, Pose)> {
        let cell = |size: Vec3| match self {
            Cells::One | Cells::Box => Shape::cuboid(size).unwrap(),
            Cells::Hull => Shape::convex_hull(&TriMesh::cuboid(size).vertices).unwrap(),
            Cells::Mesh => Shape::mesh(TriMesh::cuboid(size), &TreeSettings::octree()).unwrap(),
        };
        if self == Cells::One {
            return vec![(cell(SIZE), Pose::identity())];
        }
        let shape = cell(Vec3::new(CELL, CELL, SIZE.z));
        let counts = [SIZE.x / CELL, SIZE.y / CELL].map(|n| n.round() as usize);
        let at = |k: usize| {
            let along = |n: usize, count: usize| (n as f64 + 0.5 - 0.5 * count as f64) * CELL;
            Pose::translation(along(k % counts[0], counts[0]), along(k / counts[0], counts[1]), 0.0)
        };
        (0..counts[0] * counts[1]).map(|k| (shape.clone(), at(k))).collect()
    }

    fn platform(self) -> Shape {
        let mut shapes = self.shapes();
        match self {
            Cells::One => shapes.remove(0).0,
            _ => Shape::compound(shapes.into_iter().map(|(shape, pose)| CompoundPart::new(shape, pose)).collect())
                .unwrap(),
        }
    }
}

/// How the platform moves.
#[derive(Clone, Copy, Debug)]
enum Motion {
    Still,
    /// Kinematic: velocity, m/s, and angular velocity, rad/s.
    Driven(Vec3, Vec3),
    /// Free, without gravity, with a velocity and an angular velocity.
    Floats(Vec3, Vec3),
    /// Free, on the ground.
    Stands,
    /// A link of 50 kg that slides along x, m/s, and that carries the shapes one by one.
    Link(f64),
}

#[derive(Clone, Copy, Debug)]
enum Mover {
    Ball,
    Capsule,
    Box,
    Cylinder,
    Puck,
    MeshBox,
}

const MOVERS: [Mover; 6] = [Mover::Ball, Mover::Capsule, Mover::Box, Mover::Cylinder, Mover::Puck, Mover::MeshBox];

impl Mover {
    fn shape(self) -> Shape {
        match self {
            Mover::Ball => sphere(0.1),
            Mover::Capsule => Shape::capsule(0.1, 0.3).unwrap(),
            Mover::Box => cube(0.2),
            Mover::Cylinder | Mover::Puck => Shape::cylinder(0.1, 0.2).unwrap(),
            Mover::MeshBox => Shape::mesh(TriMesh::cuboid(Vec3::repeat(0.2)), &TreeSettings::octree()).unwrap(),
        }
    }

    fn turn(self) -> Quat {
        match self {
            Mover::Capsule | Mover::Cylinder => Quat::from_euler_angles(std::f64::consts::FRAC_PI_2, 0.0, 0.0),
            _ => Quat::identity(),
        }
    }

    fn rolls(self) -> bool {
        matches!(self, Mover::Ball | Mover::Capsule | Mover::Cylinder)
    }
}

#[derive(Clone, Copy, Debug)]
struct Case {
    mover: Mover,
    motion: Motion,
    stepper: &'static str,
    rate: f64,
    speed: f64,
    rolls: bool,
    heading: f64,
    /// Attitude of the platform, as a rotation vector; the gravity turns with it.
    attitude: Vec3,
}

/// Positions and velocities of the mover and of the platform after each frame.
type Path = Vec<[(Vec3, Vec3); 2]>;

impl Case {
    fn run(&self, cells: Cells) -> Path {
        let frame = Quat::from_scaled_axis(self.attitude);
        let mut world = world(self.stepper, 1.0 / self.rate);
        let settings = world.settings().with_gravity(frame * Vec3::new(0.0, 0.0, -G));
        world.set_settings(settings).unwrap();
        let friction = if self.rolls { 0.5 } else { 0.0 };
        let material = Material { friction, restitution: 0.0, ..Material::default() };
        let place = |p: Vec3, turn: Quat| Pose::from_parts((frame * p).into(), frame * turn);
        let platform = RigidBody::new(cells.platform()).with_name("platform").with_mass(50.0).with_material(material);
        let platform = platform.with_pose(place(Vec3::new(0.8, 0.0, -0.1), Quat::identity()));
        let moving = |v: Vec3, w: Vec3| platform.clone().with_velocity(frame * v).with_angular_velocity(frame * w);
        let carrier = match self.motion {
            Motion::Still => world.add_static(platform).unwrap(),
            Motion::Driven(v, w) => {
                let id = world.add(moving(v, w)).unwrap();
                world.set_mode(id, Mode::Kinematic).unwrap();
                id
            }
            Motion::Floats(v, w) => world.add(moving(v, w).with_gravity_scale(0.0)).unwrap(),
            Motion::Stands => {
                let ground = RigidBody::fixed(Shape::half_space()).with_material(material);
                world.add_static(ground.with_pose(place(Vec3::new(0.0, 0.0, -0.2), Quat::identity()))).unwrap();
                world.add(platform).unwrap()
            }
            Motion::Link(v) => {
                let mut link = LinkBuilder::new("platform", Joint::prismatic(Vec3::x())).with_mass(50.0);
                for (shape, pose) in cells.shapes() {
                    link = link.with_collider(Collider::new(shape, pose).with_material(material));
                }
                let body = ArticulationBuilder::new("platform").link(link).build().unwrap();
                let body = body.with_velocities(&[v]).unwrap();
                world.add(body.with_pose(place(Vec3::new(0.8, 0.0, -0.1), Quat::identity()))).unwrap()
            }
        };
        let heading = Quat::from_euler_angles(0.0, 0.0, self.heading);
        let rolling = self.rolls && self.mover.rolls();
        let spin = if rolling { heading * Vec3::y() * (self.speed / 0.1) } else { Vec3::zeros() };
        let start = Vec3::new(0.013, 0.007, 0.1);
        let carried = match self.motion {
            Motion::Driven(v, w) | Motion::Floats(v, w) => v + w.cross(&(start - Vec3::new(0.8, 0.0, -0.1))),
            Motion::Link(v) => v * Vec3::x(),
            Motion::Still | Motion::Stands => Vec3::zeros(),
        };
        let body = RigidBody::new(self.mover.shape()).with_name("mover").with_mass(1.0).with_material(material);
        let body = body.with_pose(place(start, heading * self.mover.turn()));
        let body = body.with_velocity(frame * (carried + heading * Vec3::new(self.speed, 0.0, 0.0)));
        let id = world.add(body.with_angular_velocity(frame * spin)).unwrap();
        let steps = (0.25 * self.rate) as usize;
        (0..steps)
            .map(|_| {
                world.step().unwrap();
                [id, carrier].map(|id| (position(&world, id), velocity(&world, id)))
            })
            .collect()
    }
}

impl Case {
    /// Returns the bound on the differences from one box, of the speed and in meters; `None` where they have another cause
    /// than seams: friction at several points of a body that turns against the platform depends on shares of the load that
    /// statics does not determine, and a puck on a box has other contacts than on a plane.
    fn bound(&self) -> Option<f64> {
        let turns = match self.motion {
            Motion::Still | Motion::Stands | Motion::Link(_) => return Some(1e-6),
            Motion::Driven(_, w) if w == Vec3::zeros() => return Some(1e-6),
            Motion::Driven(_, w) | Motion::Floats(_, w) => w != Vec3::zeros(),
        };
        match self.mover {
            Mover::Puck => None,
            Mover::Box | Mover::Cylinder | Mover::MeshBox if self.rolls && turns => None,
            // the contact with the next cell is a new one, which divides the step
            _ if self.stepper == "backtracking" => Some(2e-5),
            Mover::Capsule | Mover::Cylinder => Some(5e-6),
            _ => Some(1e-6),
        }
    }
}

/// Compares a platform of cells with one of a single box.
fn acts_like_one_box(cells: &[Cells], cases: &[Case]) {
    let mut wrong = Vec::new();
    for (case, bound) in cases.iter().filter_map(|case| Some((case, case.bound()?))) {
        let reference = case.run(Cells::One);
        for &cells in cells {
            let path = case.run(cells);
            let mut worst = [0.0f64; 2];
            for (x, y) in path.iter().zip(&reference).flat_map(|(x, y)| x.iter().zip(y)) {
                worst = [worst[0].max((x.1 - y.1).norm() / case.speed), worst[1].max((x.0 - y.0).norm())];
            }
            if !worst.iter().all(|x| *x < bound) {
                wrong.push(format!("{cells:?} {case:?}: {:.1e} of the speed, {:.1e} m", worst[0], worst[1]));
            }
        }
    }
    assert!(wrong.is_empty(), "{} cases:\n{}", wrong.len(), wrong.join("\n"));
}

fn cases(motions: &[Motion], attitude: Vec3) -> Vec<Case> {
    let mut cases = Vec::new();
    for &motion in motions {
        for mover in MOVERS {
            for stepper in STEPPERS {
                for (rate, speed) in [(240.0, 5.0), (60.0, 2.0)] {
                    for (rolls, heading) in [(true, 0.0), (false, 0.0), (true, 0.2), (false, 0.2)] {
                        cases.push(Case { mover, motion, stepper, rate, speed, rolls, heading, attitude });
                    }
                }
            }
        }
    }
    cases
}

fn cells() -> &'static [Cells] {
    if std::env::var_os("TUMBLE_SLOW").is_some() { &[Cells::Box, Cells::Hull, Cells::Mesh] } else { &[Cells::Box] }
}

const OBLIQUE: Vec3 = Vec3::new(0.3, -0.5, 0.7);

#[test]
fn a_compound_that_does_not_move_acts_like_one_box_full_length() {
    acts_like_one_box(cells(), &cases(&[Motion::Still], Vec3::zeros()));
    acts_like_one_box(cells(), &cases(&[Motion::Still], OBLIQUE));
}

#[test]
fn a_driven_compound_acts_like_one_box_full_length() {
    let shifts = Motion::Driven(Vec3::new(-0.4, 0.3, 0.5), Vec3::zeros());
    let turns = Motion::Driven(Vec3::zeros(), Vec3::new(0.0, 0.0, 0.8));
    let tilts = Motion::Driven(Vec3::new(0.1, 0.0, 0.0), Vec3::new(0.4, -0.5, 0.3));
    acts_like_one_box(cells(), &cases(&[shifts, turns, tilts], Vec3::zeros()));
}

#[test]
fn a_free_compound_acts_like_one_box_full_length() {
    let drifts = Motion::Floats(Vec3::new(-0.4, 0.3, 0.1), Vec3::zeros());
    let tumbles = Motion::Floats(Vec3::new(0.1, 0.0, 0.0), Vec3::new(0.1, -0.2, 0.3));
    acts_like_one_box(cells(), &cases(&[drifts, tumbles], Vec3::zeros()));
    acts_like_one_box(cells(), &cases(&[tumbles], OBLIQUE));
}

#[test]
fn a_compound_on_the_ground_acts_like_one_box_full_length() {
    acts_like_one_box(cells(), &cases(&[Motion::Stands], Vec3::zeros()));
}

#[test]
fn a_link_of_many_shapes_acts_like_one_box_full_length() {
    acts_like_one_box(cells(), &cases(&[Motion::Link(-0.4)], Vec3::zeros()));
}

//! Edges inside a flat floor do not exist for bodies on it: a floor of many coplanar faces, or of
//! many flush boxes, acts like one half-space.
//!
//! Each case runs twice, on the floor and on a half-space, and the two runs are compared. A hop or
//! a lost speed of a body that meets an edge inside the floor is a difference.

use crate::common::*;
use tumble_core::collide::{CompoundPart, Pose, Quat, Shape, TreeSettings, TriMesh, Vec3};
use tumble_core::*;

/// Size of the floor in meters; it begins at `FLOOR_START` on x and is centered on y.
const FLOOR: f64 = 4.0;
const FLOOR_START: f64 = -0.5;

/// A floor with its top at z = 0.
#[derive(Clone, Copy, Debug)]
enum Floor {
    HalfSpace,
    /// One mesh: a grid of this many cells a side, turned by an angle about z, with vertices that
    /// are moved by a fraction of a cell.
    Slab {
        cells: usize,
        yaw: f64,
        jitter: f64,
    },
    /// A flat height field of this many heights a side, turned by an angle about z.
    HeightField {
        count: usize,
        yaw: f64,
    },
    /// An open surface of two triangles a cell, extruded.
    Terrain {
        cells: usize,
    },
    /// The same, as an open mesh.
    OpenMesh {
        cells: usize,
    },
    /// Rows of flush boxes: along x, and along y, meters.
    Boxes {
        size: [f64; 2],
        kind: Tile,
    },
    /// The same as one compound.
    Compound {
        size: [f64; 2],
        kind: Tile,
    },
}

/// How a flush box is made.
#[derive(Clone, Copy, Debug)]
enum Tile {
    Box,
    Hull,
    Mesh,
}

impl Tile {
    fn shape(self, size: Vec3) -> Shape {
        match self {
            Tile::Box => Shape::cuboid(size).unwrap(),
            Tile::Hull => Shape::convex_hull(&TriMesh::cuboid(size).vertices).unwrap(),
            Tile::Mesh => Shape::mesh(TriMesh::cuboid(size), &TreeSettings::octree()).unwrap(),
        }
    }
}

/// A body on the floor, moving along x.
#[derive(Clone, Copy, Debug)]
enum Mover {
    Sphere,
    /// Lies across its way.
    Capsule,
    /// Lies along its way.
    LongCapsule,
    Box,
    /// Lies across its way.
    Cylinder,
    /// Stands on its end.
    Puck,
    MeshBox,
    MeshSphere,
    MeshPuck,
}

const MOVERS: [Mover; 9] = [
    Mover::Sphere,
    Mover::Capsule,
    Mover::LongCapsule,
    Mover::Box,
    Mover::Cylinder,
    Mover::Puck,
    Mover::MeshBox,
    Mover::MeshSphere,
    Mover::MeshPuck,
];

#[derive(Clone, Copy, Debug)]
struct Case {
    stepper: &'static str,
    rate: f64,
    speed: f64,
    /// With friction and, if round, with the spin of rolling.
    rolls: bool,
    /// Height from which the body falls, m.
    drop: f64,
    /// Direction of the motion about z, rad.
    heading: f64,
}

/// A closed slab of 0.2 m whose top is a grid of coplanar cells. Up to a jitter of 0.6 no triangle is turned over.
fn slab(cells: usize, jitter: f64) -> TriMesh {
    let mut seed = 1u64;
    let mut random = || {
        seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (seed >> 11) as f64 / (1u64 << 53) as f64 - 0.5
    };
    let (step, row) = (FLOOR / cells as f64, cells + 1);
    let mut mesh = TriMesh { vertices: Vec::new(), triangles: Vec::new() };
    for z in [0.1, -0.1] {
        for j in 0..row {
            for i in 0..row {
                let inside = i > 0 && j > 0 && i < cells && j < cells && z > 0.0;
                let [dx, dy] = [random(), random()].map(|r| if inside { jitter * step * r } else { 0.0 });
                mesh.vertices.push(Vec3::new(
                    i as f64 * step + dx - 0.5 * FLOOR,
                    j as f64 * step + dy - 0.5 * FLOOR,
                    z,
                ));
            }
        }
    }
    let top = |i: usize, j: usize| (j * row + i) as u32;
    let below = (row * row) as u32;
    let mut quad = |a: u32, b: u32, c: u32, d: u32| mesh.triangles.extend([[a, b, c], [a, c, d]]);
    for j in 0..cells {
        for i in 0..cells {
            let [a, b, c, d] = [top(i, j), top(i + 1, j), top(i + 1, j + 1), top(i, j + 1)];
            quad(a, b, c, d);
            quad(below + a, below + d, below + c, below + b);
        }
    }
    for k in 0..cells {
        for (u, v) in [
            (top(k + 1, 0), top(k, 0)),
            (top(k, cells), top(k + 1, cells)),
            (top(0, k), top(0, k + 1)),
            (top(cells, k + 1), top(cells, k)),
        ] {
            quad(u, v, below + v, below + u);
        }
    }
    mesh
}

impl Floor {
    /// Returns the shape of a mesh.
    fn shape(self) -> Option<Shape> {
        match self {
            Floor::Slab { cells, jitter, .. } => {
                Some(Shape::mesh(slab(cells, jitter), &TreeSettings::octree()).unwrap())
            }
            Floor::HeightField { count, .. } => {
                Some(Shape::height_field(&vec![0.0; count * count], count, [FLOOR; 2], Some(0.2)).unwrap())
            }
            Floor::Terrain { cells } | Floor::OpenMesh { cells } => {
                let slab = slab(cells, 0.6);
                let top = |t: &&[u32; 3]| t.iter().all(|v| slab.vertices[*v as usize].z > 0.0);
                let triangles = slab.triangles.iter().filter(top).copied().collect();
                let top = TriMesh { vertices: slab.vertices, triangles };
                Some(match self {
                    Floor::Terrain { .. } => Shape::terrain(&top, Some(0.2)).unwrap(),
                    _ => Shape::open_mesh(&top, Some(0.2), false).unwrap(),
                })
            }
            Floor::HalfSpace | Floor::Boxes { .. } | Floor::Compound { .. } => None,
        }
    }

    /// Adds the floor; `shape` is its own.
    fn add_to(self, world: &mut World, shape: &Option<Shape>, friction: f64) {
        let material = Material { friction, restitution: 0.0, ..Material::default() };
        let mut add_body = |name: &str, shape: Shape, pose: Pose| {
            let body = RigidBody::fixed(shape).with_name(name).with_material(material).with_pose(pose);
            world.add_static(body).unwrap();
        };
        match self {
            Floor::HalfSpace => add_body("floor", Shape::half_space(), Pose::identity()),
            Floor::Slab { .. } | Floor::HeightField { .. } | Floor::Terrain { .. } | Floor::OpenMesh { .. } => {
                let (yaw, z) = match self {
                    Floor::Slab { yaw, .. } => (yaw, -0.1),
                    Floor::HeightField { yaw, .. } => (yaw, 0.0),
                    _ => (0.0, -0.1),
                };
                let middle = Vec3::new(FLOOR_START + 0.5 * FLOOR, 0.0, z);
                let turn = Quat::from_euler_angles(0.0, 0.0, yaw);
                add_body("floor", shape.clone().unwrap(), Pose::from_parts(middle.into(), turn));
            }
            Floor::Compound { size: [length, width], kind } => {
                let tile = kind.shape(Vec3::new(length, width, 0.2));
                let counts = [length, width].map(|size| (FLOOR / size).ceil() as usize);
                let at = |n: usize| {
                    let x = FLOOR_START + ((n / counts[1]) as f64 + 0.5) * length;
                    let y = ((n % counts[1]) as f64 + 0.5) * width - 0.5 * FLOOR;
                    CompoundPart::new(tile.clone(), Pose::translation(x, y, -0.1))
                };
                let tiles = Shape::compound((0..counts[0] * counts[1]).map(at).collect()).unwrap();
                add_body("tiles", tiles, Pose::identity());
            }
            Floor::Boxes { size: [length, width], kind } => {
                let tile = kind.shape(Vec3::new(length, width, 0.2));
                let counts = [length, width].map(|size| (FLOOR / size).ceil() as usize);
                for i in 0..counts[0] {
                    for j in 0..counts[1] {
                        let x = FLOOR_START + (i as f64 + 0.5) * length;
                        let y = (j as f64 + 0.5) * width - 0.5 * FLOOR;
                        add_body(&format!("box {i} {j}"), tile.clone(), Pose::translation(x, y, -0.1));
                    }
                }
            }
        }
    }
}

impl Mover {
    fn shape(self) -> Shape {
        let mesh = |mesh: TriMesh| Shape::mesh(mesh, &TreeSettings::octree()).unwrap();
        match self {
            Mover::Sphere => sphere(0.1),
            Mover::Capsule | Mover::LongCapsule => Shape::capsule(0.1, 0.3).unwrap(),
            Mover::Box => cube(0.2),
            Mover::Cylinder | Mover::Puck => Shape::cylinder(0.1, 0.2).unwrap(),
            Mover::MeshBox => mesh(TriMesh::cuboid(Vec3::repeat(0.2))),
            Mover::MeshSphere => mesh(TriMesh::icosphere(0.1, 3)),
            Mover::MeshPuck => mesh(TriMesh::cylinder(0.1, 0.2, 24)),
        }
    }

    fn turn(self) -> Quat {
        match self {
            Mover::Capsule | Mover::Cylinder => Quat::from_euler_angles(std::f64::consts::FRAC_PI_2, 0.0, 0.0),
            Mover::LongCapsule => Quat::from_euler_angles(0.0, std::f64::consts::FRAC_PI_2, 0.0),
            _ => Quat::identity(),
        }
    }

    fn rolls(self) -> bool {
        matches!(self, Mover::Sphere | Mover::Capsule | Mover::Cylinder | Mover::MeshSphere)
    }

    /// Runs a case for `seconds`. Returns position and velocity after each frame.
    fn run(self, floor: Floor, shape: &Option<Shape>, case: Case, seconds: f64) -> Vec<(Vec3, Vec3)> {
        let mut world = world(case.stepper, 1.0 / case.rate);
        let friction = if case.rolls { 0.5 } else { 0.0 };
        floor.add_to(&mut world, shape, friction);
        let rolling = case.rolls && self.rolls();
        let heading = Quat::from_euler_angles(0.0, 0.0, case.heading);
        let spin = if rolling { heading * Vec3::y() * (case.speed / 0.1) } else { Vec3::zeros() };
        let body = RigidBody::new(self.shape())
            .with_name("mover")
            .with_mass(1.0)
            .with_material(Material { friction, restitution: 0.0, ..Material::default() })
            .with_pose(Pose::from_parts(Vec3::new(0.013, 0.007, 0.1 + case.drop).into(), heading * self.turn()))
            .with_velocity(heading * Vec3::new(case.speed, 0.0, 0.0))
            .with_angular_velocity(spin);
        let id = world.add(body).unwrap();
        (0..(seconds * case.rate) as usize)
            .map(|_| {
                world.step().unwrap();
                (position(&world, id), velocity(&world, id))
            })
            .collect()
    }
}

/// Returns the largest differences from a half-space: of velocity, relative to the speed, and of
/// height, m.
fn differences(mover: Mover, (floor, shape): (Floor, &Option<Shape>), case: Case) -> [f64; 2] {
    let seconds = if slow() { 0.5 } else { 0.2 };
    let on = mover.run(floor, shape, case, seconds);
    let reference = mover.run(Floor::HalfSpace, &None, case, seconds);
    let mut worst = [0.0_f64; 2];
    for ((p, v), (q, w)) in on.into_iter().zip(reference) {
        worst = [worst[0].max((v - w).norm() / case.speed), worst[1].max((p.z - q.z).abs())];
    }
    worst
}

fn slow() -> bool {
    std::env::var_os("TUMBLE_SLOW").is_some()
}

/// Both steppers, two rates, sliding and rolling, straight and at an angle to the edges. A body that
/// slides at an angle also falls onto the floor first.
fn cases(mover: Mover) -> Vec<Case> {
    let mut cases = Vec::new();
    for stepper in STEPPERS {
        for (rate, speed) in [(240.0, 5.0), (60.0, 2.0)] {
            for (rolls, heading) in [(true, 0.0), (false, 0.0), (true, 0.2), (false, 0.2)] {
                let drop = if heading != 0.0 && !rolls { 0.003 } else { 0.0 };
                // a body of many facets rolls in impacts, which magnify rounding
                if !(rolls && matches!(mover, Mover::MeshSphere)) {
                    cases.push(Case { stepper, rate, speed, rolls, drop, heading });
                }
            }
        }
    }
    cases
}

/// Compares movers on floors with a half-space: `bound` of the speed and, in meters, of the height.
fn acts_like_a_half_space(floors: &[Floor], bound: f64, is_tested: impl Fn(Mover, &Case) -> bool) {
    let mut wrong = Vec::new();
    for &floor in floors {
        let shape = floor.shape();
        for mover in MOVERS {
            for case in cases(mover).into_iter().filter(|case| is_tested(mover, case)) {
                let [speed, height] = differences(mover, (floor, &shape), case);
                if !(speed < bound && height < bound) {
                    wrong.push(format!("{floor:?} {mover:?} {case:?}: {speed:.1e} of the speed, {height:.1e} m"));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{} cases:\n{}", wrong.len(), wrong.join("\n"));
}

#[test]
fn a_flat_mesh_acts_like_a_half_space_full_length() {
    let floors = [
        Floor::Slab { cells: 100, yaw: 0.0, jitter: 0.0 },
        Floor::Slab { cells: 100, yaw: 0.3, jitter: 0.6 },
        Floor::Slab { cells: 37, yaw: 1.0, jitter: 0.6 },
    ];
    acts_like_a_half_space(if slow() { &floors } else { &floors[..2] }, 1e-6, |_, _| true);
}

#[test]
fn flat_height_fields_terrain_and_open_meshes_act_like_a_half_space_full_length() {
    let floors = [
        Floor::HeightField { count: 64, yaw: 0.0 },
        Floor::HeightField { count: 101, yaw: 0.4 },
        Floor::Terrain { cells: 50 },
        Floor::OpenMesh { cells: 31 },
    ];
    acts_like_a_half_space(if slow() { &floors } else { &floors[1..] }, 1e-6, |_, _| true);
}

const ROWS: [Floor; 4] = [
    Floor::Boxes { size: [0.25, 4.0], kind: Tile::Box },
    Floor::Boxes { size: [0.25, 0.25], kind: Tile::Box },
    Floor::Boxes { size: [0.25, 0.25], kind: Tile::Hull },
    Floor::Boxes { size: [0.25, 0.25], kind: Tile::Mesh },
];

#[test]
fn flush_boxes_act_like_a_half_space_full_length() {
    acts_like_a_half_space(if slow() { &ROWS } else { &ROWS[..2] }, 1e-6, |_, _| true);
}

/// Balls slide and roll over the seams inside a compound that does not move, with their weight on it.
#[test]
fn a_compound_of_flush_boxes_acts_like_a_half_space_on_balls_full_length() {
    let floors = [Tile::Box, Tile::Hull].map(|kind| Floor::Compound { size: [0.25, 0.25], kind });
    acts_like_a_half_space(if slow() { &floors } else { &floors[..1] }, 1e-6, |mover, _| {
        matches!(mover, Mover::Sphere)
    });
}

/// A wall on the floor is no internal edge: a body that slides to it stops there.
#[test]
fn a_wall_on_a_floor_is_struck() {
    for stepper in STEPPERS {
        for (mover, height) in [(Mover::Box, 1.0), (Mover::Puck, 0.3), (Mover::MeshBox, 0.2)] {
            let mut world = world(stepper, 1.0 / 240.0);
            let floor = Floor::Boxes { size: [0.25, 4.0], kind: Tile::Box };
            floor.add_to(&mut world, &None, 0.0);
            let material = Material { friction: 0.0, restitution: 0.0, ..Material::default() };
            let wall = Shape::cuboid(Vec3::new(0.25, 4.0, height)).unwrap();
            let wall = RigidBody::fixed(wall).with_name("wall").with_material(material);
            world.add_static(wall.with_pose(Pose::translation(1.125, 0.0, 0.5 * height))).unwrap();
            let body = RigidBody::new(mover.shape()).with_name("mover").with_mass(1.0).with_material(material);
            let body = body.with_pose(Pose::translation(0.5, 0.0, 0.1)).with_velocity(Vec3::new(2.0, 0.0, 0.0));
            let id = world.add(body).unwrap();
            (0..120).for_each(|_| {
                world.step().unwrap();
            });
            let x = position(&world, id).x;
            assert!((x - 0.9).abs() < 1e-3, "{stepper} {mover:?} at a wall of {height} m: {x}");
        }
    }
}

/// A track of two plates that meet at the line x = z = 0; the second one rises by `angle`.
fn creased(angle: f64, hulls: bool) -> Shape {
    let size = Vec3::new(2.0, 1.0, 0.2);
    let plate = if hulls {
        Shape::convex_hull(&TriMesh::cuboid(size).vertices).unwrap()
    } else {
        Shape::Box { half_extents: 0.5 * size }
    };
    let turn = Quat::from_axis_angle(&Vec3::y_axis(), -angle);
    let poses = [Pose::translation(-1.0, 0.0, -0.1), Pose::from_parts((turn * Vec3::new(1.0, 0.0, -0.1)).into(), turn)];
    Shape::compound(poses.map(|pose| CompoundPart::new(plate.clone(), pose)).to_vec()).unwrap()
}

/// A ball that slides over the inner edge of a track meets the face behind it, and not the edge: it loses
/// the velocity along that face's normal and goes on with `v·cos(angle)`, whatever the step and the
/// place where it begins.
#[test]
fn a_ball_meets_the_face_behind_an_inner_edge_of_a_compound() {
    let (speed, radius) = (0.75, 0.012);
    for case in 0..8 {
        let (angle, hulls) = ([0.0f64, 2.0, 7.5, 20.0][case / 2].to_radians(), case % 2 == 1);
        for rate in [60.0, 120.0, 240.0, 480.0, 960.0, 4000.0] {
            for phase in 0..10 {
                let mut world = no_gravity(world("time_stepping", 1.0 / rate));
                let smooth = Material { friction: 0.0, restitution: 0.0, ..Material::default() };
                world.add_static(RigidBody::fixed(creased(angle, hulls)).with_material(smooth)).unwrap();
                let start = -0.05 - speed / rate * f64::from(phase) / 10.0;
                let ball = RigidBody::new(sphere(radius)).with_material(smooth);
                let ball = ball.with_pose(Pose::translation(start, 0.0, radius));
                let ball = world.add(ball.with_velocity(Vec3::x() * speed)).unwrap();
                while world.time() < 0.2 {
                    world.step().unwrap();
                }
                let v = velocity(&world, ball);
                let along = Vec3::new(angle.cos(), 0.0, angle.sin()) * (speed * angle.cos());
                let error = (v - along).norm() / speed;
                assert!(error < 1e-12, "hulls: {hulls}, {angle} rad, {rate} Hz, place {phase}: {error} off");
            }
        }
    }
}

/// Four corners on a plane are statically indeterminate: the load and its center are the same on tiles as on a
/// half-space, and the shares of the corners need not be.
#[test]
fn tiles_carry_the_load_of_a_body_that_slides_and_turns_where_a_half_space_does() {
    for mover in [Mover::Box, Mover::MeshBox, Mover::Puck] {
        let run = |floor: Floor| {
            let shape = floor.shape();
            let mut world = world("time_stepping", 1.0 / 240.0);
            floor.add_to(&mut world, &shape, 0.5);
            let pose = Pose::from_parts(Vec3::new(0.013, 0.007, 0.1).into(), Quat::from_euler_angles(0.0, 0.0, 0.2));
            let body = RigidBody::new(mover.shape())
                .with_mass(1.0)
                .with_material(Material { friction: 0.5, restitution: 0.0, ..Material::default() })
                .with_pose(pose)
                .with_velocity(Vec3::new(2.0, 0.0, 0.0))
                .with_angular_velocity(Vec3::new(0.0, 0.0, 5.0));
            world.add(body).unwrap();
            world.step().unwrap();
            let (mut load, mut moment) = (0.0, Vec3::zeros());
            for contact in world.contacts() {
                let normal = contact.impulse.z.abs();
                load += normal;
                moment += normal * contact.point;
                let slip = contact.impulse.xy().norm();
                assert!((slip - 0.5 * normal).abs() < 1e-9, "{mover:?}: friction {slip} of {normal}");
            }
            (load, moment / load)
        };
        let (load, center) = run(Floor::HalfSpace);
        for kind in [Tile::Box, Tile::Hull, Tile::Mesh] {
            let (found, at) = run(Floor::Boxes { size: [0.25, 0.25], kind });
            assert!((found - load).abs() < 1e-9, "{mover:?} {kind:?}: load {found} instead of {load}");
            assert!((at - center).norm() < 2e-4, "{mover:?} {kind:?}: at {at:?} instead of {center:?}");
        }
    }
}

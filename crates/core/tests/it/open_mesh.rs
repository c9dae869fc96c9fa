//! Rooms and tunnels of open surfaces: bodies in them move as between closed solids, and by closed forms.

use crate::common::*;
use tumble_core::collide::{Pose, Quat, Shape, TreeSettings, TriMesh, Vec3};
use tumble_core::*;

const SIZE: Vec3 = Vec3::new(3.0, 2.0, 1.5);

/// A room: a box of cells whose faces look inward.
fn room(cells: usize) -> TriMesh {
    let mut mesh = TriMesh { vertices: Vec::new(), triangles: Vec::new() };
    for axis in 0..3 {
        for side in [-0.5, 0.5] {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            for n in 0..cells * cells {
                let first = mesh.vertices.len() as u32;
                for (i, j) in [(0, 0), (1, 0), (1, 1), (0, 1)] {
                    let mut p = Vec3::zeros();
                    p[axis] = side * SIZE[axis];
                    p[u] = SIZE[u] * ((n % cells + i) as f64 / cells as f64 - 0.5);
                    p[v] = SIZE[v] * ((n / cells + j) as f64 / cells as f64 - 0.5);
                    mesh.vertices.push(p);
                }
                let quad = if side < 0.0 { [0, 1, 2, 3] } else { [0, 3, 2, 1] }.map(|k| first + k);
                mesh.triangles.extend([[quad[0], quad[1], quad[2]], [quad[0], quad[2], quad[3]]]);
            }
        }
    }
    mesh
}

fn bouncy(friction: f64) -> Material {
    Material { friction, restitution: 1.0, ..Material::default() }
}

/// Adds six closed solids around the room.
fn add_walls(world: &mut World, friction: f64) {
    // impacts of a box on a mesh and on a half-space are found by different searches
    let slab = Shape::mesh(TriMesh::cuboid(Vec3::new(4.0, 4.0, 1.0)), &TreeSettings::octree()).unwrap();
    for axis in 0..3 {
        for side in [-1.0, 1.0] {
            let mut inward = Vec3::zeros();
            inward[axis] = -side;
            let turn = Quat::rotation_between(&Vec3::z(), &inward)
                .unwrap_or(Quat::from_axis_angle(&Vec3::x_axis(), std::f64::consts::PI));
            let pose = Pose::from_parts((-(0.5 * SIZE[axis] + 0.5) * inward).into(), turn);
            let wall = RigidBody::fixed(slab.clone()).with_pose(pose).with_material(bouncy(friction));
            world.add_static(wall.with_name(format!("wall {axis} {side}"))).unwrap();
        }
    }
}

/// Runs each body alone, in a room or between six slabs. Returns positions and velocities after each frame.
fn run(stepper: &str, in_mesh: Option<usize>, friction: f64, frames: usize) -> Vec<Vec3> {
    let mut seen = Vec::new();
    for (shape, speed) in [
        (sphere(0.1), Vec3::new(3.1, 1.7, 0.9)),
        (Shape::capsule(0.1, 0.2).unwrap(), Vec3::new(-2.0, 1.1, 2.3)),
        (cube(0.2), Vec3::new(1.3, -2.9, -0.7)),
    ] {
        let mut world = world(stepper, 1.0 / 240.0);
        match in_mesh {
            Some(cells) => {
                let shape = Shape::open_mesh(&room(cells), Some(0.1), false).unwrap();
                world.add_static(RigidBody::fixed(shape).with_material(bouncy(friction))).unwrap();
            }
            None => add_walls(&mut world, friction),
        }
        let body = RigidBody::new(shape).with_mass(1.0).with_material(bouncy(friction)).with_velocity(speed);
        let id = world.add(body.with_angular_velocity(Vec3::new(1.0, -2.0, 0.5))).unwrap();
        for _ in 0..frames {
            world.step().unwrap();
            seen.extend([position(&world, id), velocity(&world, id)]);
        }
    }
    seen
}

#[test]
fn bodies_in_a_room_move_as_between_closed_walls() {
    for stepper in STEPPERS {
        for friction in [0.0, 0.4] {
            let reference = run(stepper, None, friction, 72);
            for cells in [1, 4] {
                let found = run(stepper, Some(cells), friction, 72);
                let worst = found.iter().zip(&reference).map(|(p, q)| (p - q).norm()).fold(0.0, f64::max);
                assert!(worst < 1e-7, "{stepper} friction {friction}, {cells} cells: {worst:e}");
            }
        }
    }
}

#[test]
fn fast_balls_stay_in_a_room_with_thin_walls_and_leave_by_the_door() {
    let mut open = room(6);
    let shape = |mesh: &TriMesh| Shape::open_mesh(mesh, Some(1e-3), false).unwrap();
    for door in [false, true] {
        if door {
            // the middle of the wall at the greatest x
            let corners: Vec<Vec3> =
                (0..open.triangles.len()).map(|t| open.corners(t).iter().sum::<Vec3>() / 3.0).collect();
            let mut kept = corners.iter().map(|c| c.x < 0.5 * SIZE.x - 1e-9 || c.y.abs() > 0.33 || c.z.abs() > 0.25);
            open.triangles.retain(|_| kept.next().unwrap());
        }
        let mut world = world("time_stepping", 1.0 / 240.0);
        world.add_static(RigidBody::fixed(shape(&open)).with_material(bouncy(0.0))).unwrap();
        let ball = RigidBody::new(sphere(0.1)).with_mass(1.0).with_material(bouncy(0.0)).with_gravity_scale(0.0);
        let speed = if door { Vec3::new(50.0, 0.0, 0.0) } else { Vec3::new(70.0, 43.0, 29.0) };
        let id = world.add(ball.with_velocity(speed)).unwrap();
        for _ in 0..240 {
            world.step().unwrap();
            let p = position(&world, id);
            let outside = (0..3).any(|k| p[k].abs() > 0.5 * SIZE[k] - 0.1 + 1e-6);
            assert!(door || !outside, "at {p:?}");
        }
        assert_eq!(position(&world, id).x > SIZE.x, door);
    }
}

#[test]
fn a_box_slides_through_a_tunnel_by_coulomb() {
    // a tunnel of 24 sides along x whose lowest side is level
    let mut tube = TriMesh::cylinder(1.0, 6.0, 24);
    let side = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| tube.vertices[v as usize]);
        (b - a).cross(&(c - a)).normalize().z.abs() < 0.5
    };
    tube.triangles = tube.triangles.iter().filter(|t| side(t)).map(|[a, b, c]| [*a, *c, *b]).collect();
    let shape = Shape::open_mesh(&tube, Some(0.05), false).unwrap();
    let half = std::f64::consts::PI / 24.0;
    let floor = -half.cos();
    // the axis of the cylinder becomes x; its corners at multiples of 15° are turned by half a side
    let turn = Quat::from_euler_angles(half, 0.0, 0.0) * Quat::from_euler_angles(0.0, std::f64::consts::FRAC_PI_2, 0.0);
    for friction in [0.0, 0.3] {
        let material = Material { friction, restitution: 0.0, ..Material::default() };
        let mut world = world("time_stepping", 1.0 / 240.0);
        let tunnel = RigidBody::fixed(shape.clone()).with_material(material);
        world.add_static(tunnel.with_pose(Pose::from_parts(Vec3::zeros().into(), turn))).unwrap();
        let cube = RigidBody::new(cube(0.2)).with_mass(1.0).with_material(material);
        let pose = Pose::translation(-2.5, 0.0, floor + 0.1);
        let id = world.add(cube.with_pose(pose).with_velocity(Vec3::new(2.0, 0.0, 0.0))).unwrap();
        for _ in 0..120 {
            world.step().unwrap();
        }
        let wanted = 2.0 - friction * 9.81 * 0.5;
        let (p, v) = (position(&world, id), velocity(&world, id));
        assert!((v.x - wanted).abs() < 1e-6 && (p.z - floor - 0.1).abs() < 1e-6, "{v:?} instead of {wanted}, {p:?}");
    }
}

//! CPU time of a lidar: 100,000 rays on 1,000 bodies and a mesh of 70,000 triangles, in one run on
//! one thread with tumble and with parry's tree of boxes, as Rapier casts rays.
//!
//! ```text
//! cargo bench --bench rays [-- --write FOLDER]
//! ```
//!
//! `--write` leaves the scene and the distances in a folder, for `benches/python/lidar.py`, which adds MuJoCo.
//!
//! Both build what depends on the poses anew for every scan: tumble's world does so by itself, and
//! parry's tree is built from the boxes. The trees of the mesh are built once. The hits are
//! compared.

use rapier3d_f64::parry::math::{Pose as ParryPose, Rotation, Vector};
use rapier3d_f64::parry::partitioning::{Bvh, BvhBuildStrategy};
use rapier3d_f64::parry::query::Ray as ParryRay;
use rapier3d_f64::parry::shape::{Ball, Capsule, Cuboid, Shape as ParryShape, TriMesh as ParryMesh};
use tumble_collide::{Pose, Quat, Shape, TreeSettings, TriMesh, Vec3};
use tumble_core::{QueryFilter, Ray, RigidBody, World};
use tumble_peers::clock::cpu_seconds;
use tumble_peers::random::Random;

const BODIES: usize = 1000;
const RAYS: usize = 100_000;
/// Number of scans; the median is reported.
const SCANS: usize = 9;

/// A body in both libraries.
struct Both {
    ours: Shape,
    theirs: Box<dyn ParryShape>,
    pose: Pose,
}

fn vector(v: &Vec3) -> Vector {
    Vector::new(v.x, v.y, v.z)
}

fn parry_pose(pose: &Pose) -> ParryPose {
    let (t, q) = (pose.translation.vector, pose.rotation.coords);
    ParryPose::from_parts(vector(&t), Rotation::from_xyzw(q.x, q.y, q.z, q.w))
}

/// A bumpy ball of about 1.5 m: 71,680 triangles.
fn statue() -> TriMesh {
    let mut mesh = TriMesh::uv_sphere(1.5, 256, 141);
    for v in &mut mesh.vertices {
        let n = v.normalize();
        *v *= 1.0 + 0.08 * (9.0 * n.x).sin() * (7.0 * n.y).cos() + 0.05 * (13.0 * n.z).sin();
    }
    mesh
}

fn scene() -> Vec<Both> {
    let mut random = Random(1);
    let mut unit = || 0.5 + random.within(0.5);
    let mut all: Vec<Both> = (0..BODIES)
        .map(|k| {
            let at = Vec3::new(30.0 * unit() - 15.0, 30.0 * unit() - 15.0, 6.0 * unit());
            let turn = Quat::from_euler_angles(6.0 * unit(), 6.0 * unit(), 6.0 * unit());
            let size = 0.15 + 0.2 * unit();
            let (ours, theirs): (Shape, Box<dyn ParryShape>) = match k % 3 {
                0 => (Shape::sphere(size).unwrap(), Box::new(Ball::new(size))),
                1 => {
                    let half = Vec3::new(size, 0.7 * size, 1.2 * size);
                    (Shape::cuboid(2.0 * half).unwrap(), Box::new(Cuboid::new(vector(&half))))
                }
                _ => (Shape::capsule(0.6 * size, size).unwrap(), Box::new(Capsule::new_z(0.5 * size, 0.6 * size))),
            };
            Both { ours, theirs, pose: Pose::from_parts(at.into(), turn) }
        })
        .collect();
    let ours = Shape::mesh(statue(), &TreeSettings::octree()).unwrap();
    let Shape::Mesh(mesh) = &ours else { unreachable!("it is a mesh") };
    println!("{BODIES} bodies and a mesh of {} triangles, {RAYS} rays", mesh.mesh().triangles.len());
    let vertices = mesh.mesh().vertices.iter().map(vector).collect();
    let theirs = Box::new(ParryMesh::new(vertices, mesh.mesh().triangles.clone()).unwrap());
    all.push(Both { ours, theirs, pose: Pose::translation(3.0, 0.0, 2.0) });
    all
}

/// The rays of a lidar at 2 m: 100 rings of 1,000 rays.
fn rays() -> Vec<Ray> {
    let ring = 1000;
    (0..RAYS)
        .map(|k| {
            let (around, up) = (
                (k % ring) as f64 / ring as f64 * std::f64::consts::TAU,
                ((k / ring) as f64 / (RAYS / ring) as f64 - 0.5) * 0.8,
            );
            let direction = Vec3::new(up.cos() * around.cos(), up.cos() * around.sin(), up.sin());
            Ray { origin: Vec3::new(0.0, 0.0, 2.0), direction, max_distance: 100.0 }
        })
        .collect()
}

/// Writes a line of sizes and pose for each body, the mesh, the directions of the rays, and the distances.
fn write(folder: &std::path::Path, scene: &[Both], rays: &[Ray], distances: &[Option<f64>]) {
    let line = |numbers: &[f64]| numbers.iter().map(|x| format!("{x:e}")).collect::<Vec<_>>().join(" ") + "\n";
    let (mut bodies, mut vertices, mut triangles) = (String::new(), String::new(), String::new());
    for Both { ours, pose, .. } in scene {
        let sizes = match ours {
            Shape::Sphere { radius } => [0.0, *radius, 0.0, 0.0],
            Shape::Box { half_extents: h } => [1.0, h.x, h.y, h.z],
            Shape::Capsule { radius, half_length } => [2.0, *radius, *half_length, 0.0],
            Shape::Mesh(mesh) => {
                let (mesh, center) = (mesh.mesh(), mesh.center_of_mass());
                vertices = mesh.vertices.iter().map(|v| line((v + center).as_slice())).collect();
                triangles = mesh.triangles.iter().map(|t| line(&t.map(f64::from))).collect();
                [3.0, 0.0, 0.0, 0.0]
            }
            _ => unreachable!("four kinds of shapes"),
        };
        let (t, q) = (pose.translation.vector, pose.rotation.coords);
        bodies += &line(&[&sizes[..], t.as_slice(), q.as_slice()].concat());
    }
    let directions: String = rays.iter().map(|ray| line(ray.direction.as_slice())).collect();
    let distances: String = distances.iter().map(|d| line(&[d.unwrap_or(-1.0)])).collect();
    let files = [
        ("bodies", bodies),
        ("vertices", vertices),
        ("triangles", triangles),
        ("directions", directions),
        ("distances", distances),
    ];
    for (name, text) in files {
        std::fs::write(folder.join(format!("{name}.txt")), text).unwrap();
    }
}

fn main() {
    let (scene, rays) = (scene(), rays());
    let mut world = World::default();
    for body in &scene {
        world.add_static(RigidBody::fixed(body.ours.clone()).with_pose(body.pose)).unwrap();
    }
    let filter = QueryFilter::default();
    let mut times = [Vec::new(), Vec::new()];
    let (mut ours, mut theirs) = (Vec::new(), Vec::new());
    let poses: Vec<ParryPose> = scene
        .iter()
        .map(|body| {
            // the vertices of a mesh are about its center of mass
            let center = body.ours.center_of_mass();
            parry_pose(&(body.pose * Pose::translation(center.x, center.y, center.z)))
        })
        .collect();
    // the trees of the mesh are built before
    world.cast_rays(&rays[..10], &filter);
    for _ in 0..SCANS {
        let start = cpu_seconds();
        ours = world.cast_rays(&rays, &filter).into_iter().map(|hit| hit.map(|hit| hit.distance)).collect();
        times[0].push(cpu_seconds() - start);
        let start = cpu_seconds();
        let boxes: Vec<_> = scene.iter().zip(&poses).map(|(body, pose)| body.theirs.compute_aabb(pose)).collect();
        let tree = Bvh::from_leaves(BvhBuildStrategy::Binned, &boxes);
        theirs = rays
            .iter()
            .map(|ray| {
                let ray = ParryRay::new(vector(&ray.origin), vector(&ray.direction));
                tree.cast_ray(&ray, 100.0, |k, best| {
                    scene[k as usize].theirs.cast_ray(&poses[k as usize], &ray, best, true)
                })
                .map(|(_, distance)| distance)
            })
            .collect::<Vec<Option<f64>>>();
        times[1].push(cpu_seconds() - start);
    }
    let different = ours.iter().zip(&theirs).filter(|(a, b)| match (a, b) {
        (Some(a), Some(b)) => (*a - *b).abs() > 1e-6,
        (a, b) => a.is_some() != b.is_some(),
    });
    println!("{} rays hit something; {} differ", ours.iter().flatten().count(), different.count());
    let arguments: Vec<String> = std::env::args().collect();
    if let Some(k) = arguments.iter().position(|argument| argument == "--write") {
        write(std::path::Path::new(&arguments[k + 1]), &scene, &rays, &ours);
    }
    for (name, times) in ["tumble", "parry"].iter().zip(&mut times) {
        times.sort_by(f64::total_cmp);
        println!("{name}: {:.1} ms of CPU per scan", 1e3 * times[SCANS / 2]);
    }
}

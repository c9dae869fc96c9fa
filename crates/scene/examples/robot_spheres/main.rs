//! Prints the tables of the documentation about robots of spheres: the spheres of this crate beside
//! a set of others, or beside chains along the axes of capsules, with the same number for each link.
//!
//! ```sh
//! cargo run --release -p tumble-scene --example robot_spheres -- ROBOT.urdf SPHERES.urdf|SPHERES.yml [WEIGHT]
//! cargo run --release -p tumble-scene --example robot_spheres -- ROBOT.urdf COUNT…
//! ```
//!
//! The measure shares nothing with the fit: another reader of URDF, points on the spheres that no
//! other sphere of the link contains, and their distances to the shapes, of which the least counts.

mod sets;

use sets::{Set, capsule_chains, read_spheres};
use std::error::Error;
use std::path::Path;
use tumble_core::collide::{MeshDistance, Pose, RepairSettings, TreeCache, TreeSettings, TriMesh, Vec3};
use tumble_scene::urdf::{PerLink, SphereOptions, UrdfOptions, spherize};
use urdf_rs::{Collision, Geometry, Link};

/// Points on the surface of a link, and on each sphere.
const SURFACE_POINTS: usize = 20_000;
const SPHERE_POINTS: usize = 4_000;
const VOLUME_POINTS: usize = 200_000;
/// Passes that bring the measured coverage closer to that of the other set.
const PASSES: usize = 3;

fn main() -> Result<(), Box<dyn Error>> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [path, rest @ ..] = &words[..] else { return Err("expected a robot".into()) };
    let path = Path::new(path);
    let robot = urdf_rs::read_file(path)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let counts: Vec<usize> = rest.iter().filter_map(|word| word.parse().ok()).collect();
    println!(
        "| link | spheres | covered % | outside max mm | mean mm | volume outside | covered % | max mm | mean mm | volume outside |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|");
    if counts.len() < rest.len() || rest.is_empty() {
        let others = read_spheres(Path::new(rest.first().ok_or("expected spheres, or counts")?))?;
        let weight = rest.get(1).map(|word| word.parse()).transpose()?;
        return compare(path, folder, &robot.links, &others, false, weight);
    }
    for count in counts {
        compare(path, folder, &robot.links, &capsule_chains(&robot.links, count), true, None)?;
    }
    Ok(())
}

/// Prints a row for each link: the other set, then the spheres of this crate at its coverage.
fn compare(
    path: &Path,
    folder: &Path,
    links: &[Link],
    others: &[(String, Set)],
    full: bool,
    weight: Option<f64>,
) -> Result<(), Box<dyn Error>> {
    let bodies: Vec<(&str, &Set, Body)> = others
        .iter()
        .filter_map(|(name, set)| Some((links.iter().find(|l| l.name == *name)?, set)))
        .filter(|(link, _)| !link.collision.is_empty())
        .map(|(link, set)| Ok((link.name.as_str(), set, Body::read(&link.collision, folder)?)))
        .collect::<Result<_, Box<dyn Error>>>()?;
    let theirs: Vec<Figures> = bodies.iter().map(|(_, set, body)| body.measure(set)).collect();
    let mut options = SphereOptions {
        most: PerLink::all(1),
        coverage: PerLink::all(None),
        weight: PerLink::all(weight),
        error: 1e-9,
        tree: TreeSettings { error: 1e-4, even: false, ..TreeSettings::default() },
        cache: TreeCache::of_environment(),
        urdf: UrdfOptions::default(),
    };
    for ((name, set, _), figures) in bodies.iter().zip(&theirs) {
        options.most.links.insert((*name).into(), set.len());
        let coverage = if full { 1.0 } else { figures.covered.clamp(1e-3, 1.0) };
        options.coverage.links.insert((*name).into(), Some(coverage));
    }
    let mut ours = measured(path, &options, &bodies)?;
    for _ in 0..if full { 0 } else { PASSES } {
        // the fit counts pieces that lie in one sphere, the measure all points in any
        for (((name, ..), theirs), ours) in bodies.iter().zip(&theirs).zip(&ours) {
            let coverage = options.coverage.of(name).unwrap_or(1.0);
            let next = (coverage - 0.7 * (ours.covered - theirs.covered)).clamp(1e-3, 1.0);
            options.coverage.links.insert((*name).into(), Some(next));
        }
        for ((ours, next), theirs) in ours.iter_mut().zip(measured(path, &options, &bodies)?).zip(&theirs) {
            if next.covered >= theirs.covered {
                *ours = next;
            }
        }
    }
    let mut sums = [0.0_f64; 6];
    for (((name, set, _), theirs), ours) in bodies.iter().zip(&theirs).zip(&ours) {
        println!("| {name} | {} | {} | {} |", set.len(), theirs.cells(), ours.cells());
        for (sum, value) in
            sums.iter_mut().zip([theirs.worst, theirs.mean, theirs.outside, ours.worst, ours.mean, ours.outside])
        {
            *sum += 1e3 * value;
        }
    }
    let [a, b, c, d, e, f] = sums;
    println!("| sum | | | {a:.2} | {b:.2} | {:.3} | | {d:.2} | {e:.2} | {:.3} |", 1e-3 * c, 1e-3 * f);
    Ok(())
}

/// Fits spheres, and measures them.
fn measured(
    path: &Path,
    options: &SphereOptions,
    bodies: &[(&str, &Set, Body)],
) -> Result<Vec<Figures>, Box<dyn Error>> {
    let start = std::time::Instant::now();
    let robot = spherize(path, options, &())?;
    eprintln!("fitted in {:.1} s", start.elapsed().as_secs_f64());
    let spheres = |name: &str| robot.links.iter().find(|link| link.name == name).map_or(&[][..], |link| &link.spheres);
    Ok(bodies.iter().map(|(name, _, body)| body.measure(spheres(name))).collect())
}

/// A shape in its own frame.
enum Shape {
    Box(Vec3),
    Cylinder(f64, f64),
    Capsule(f64, f64),
    Mesh(Box<MeshDistance>),
}

/// The shapes of a link, and points on the surface of their union, of equal areas.
struct Body {
    shapes: Vec<(Pose, Shape)>,
    surface: Vec<Vec3>,
    volume: f64,
}

/// Lengths in meters, volume outside as a fraction of the volume of the link.
struct Figures {
    covered: f64,
    worst: f64,
    mean: f64,
    outside: f64,
}

impl Figures {
    fn cells(&self) -> String {
        format!("{:.2} | {:.2} | {:.2} | {:.3}", 100.0 * self.covered, 1e3 * self.worst, 1e3 * self.mean, self.outside)
    }
}

impl Body {
    fn read(collisions: &[Collision], folder: &Path) -> Result<Body, Box<dyn Error>> {
        let (mut shapes, mut meshes) = (Vec::new(), Vec::new());
        for collision in collisions {
            let ([x, y, z], [roll, pitch, yaw]) = (collision.origin.xyz.0, collision.origin.rpy.0);
            let turn = nalgebra::UnitQuaternion::from_euler_angles(roll, pitch, yaw);
            let pose = Pose::from_parts(Vec3::new(x, y, z).into(), turn);
            let (shape, mesh) = shape(&collision.geometry, folder)?;
            meshes.push(TriMesh {
                vertices: mesh.vertices.iter().map(|v| (pose * nalgebra::Point3::from(*v)).coords).collect(),
                ..mesh
            });
            shapes.push((pose, shape));
        }
        let mut body = Body { shapes, surface: Vec::new(), volume: 0.0 };
        let area: f64 = meshes.iter().map(TriMesh::area).sum();
        for (n, mesh) in meshes.iter().enumerate() {
            let points = on_surface(mesh, (SURFACE_POINTS as f64 * mesh.area() / area) as usize);
            body.surface.extend(
                points
                    .into_iter()
                    .filter(|p| body.shapes.iter().enumerate().all(|(k, shape)| k == n || distance(shape, p) > -1e-6)),
            );
        }
        let (low, high) = bounds(meshes.iter().flat_map(|mesh| mesh.vertices.iter().map(|v| (*v, 0.0))));
        body.volume = volume(low, high, |p| body.distance(p) <= 0.0);
        Ok(body)
    }

    /// Returns the distance to the union, exact for points outside.
    fn distance(&self, p: &Vec3) -> f64 {
        self.shapes.iter().map(|shape| distance(shape, p)).fold(f64::INFINITY, f64::min)
    }

    fn measure(&self, set: &[(Vec3, f64)]) -> Figures {
        let holds = |p: &Vec3| set.iter().any(|(c, r)| (p - c).norm() <= *r);
        let covered = self.surface.iter().filter(|p| holds(p)).count() as f64 / self.surface.len() as f64;
        let (mut worst, mut sum, mut area) = (0.0_f64, 0.0, 0.0);
        for (k, (center, radius)) in set.iter().enumerate() {
            for n in 0..SPHERE_POINTS {
                let p = center + fibonacci(n, SPHERE_POINTS) * *radius;
                if set.iter().enumerate().any(|(j, (c, r))| j != k && (p - c).norm() < r * (1.0 - 1e-9)) {
                    continue;
                }
                let outside = self.distance(&p).max(0.0);
                worst = worst.max(outside);
                sum += outside * radius * radius;
                area += radius * radius;
            }
        }
        let (low, high) = bounds(set.iter().copied());
        let outside = volume(low, high, |p| holds(p) && self.distance(p) > 0.0) / self.volume;
        Figures { covered, worst, mean: sum / f64::max(area, 1e-300), outside }
    }
}

/// Returns the signed distance to a shape, negative inside.
fn distance((pose, shape): &(Pose, Shape), p: &Vec3) -> f64 {
    let p = pose.inverse_transform_point(&nalgebra::Point3::from(*p)).coords;
    let to_box = |q: Vec3| q.sup(&Vec3::zeros()).norm() + q.max().min(0.0);
    match shape {
        Shape::Box(half) => to_box(p.abs() - half),
        Shape::Cylinder(radius, half) => {
            let q = [p.x.hypot(p.y) - radius, p.z.abs() - half];
            q[0].max(0.0).hypot(q[1].max(0.0)) + q[0].max(q[1]).min(0.0)
        }
        Shape::Capsule(radius, half) => (p - Vec3::z() * p.z.clamp(-half, *half)).norm() - radius,
        Shape::Mesh(mesh) => mesh.closest(&p).signed_distance,
    }
}

fn shape(geometry: &Geometry, folder: &Path) -> Result<(Shape, TriMesh), Box<dyn Error>> {
    Ok(match geometry {
        Geometry::Box { size } => {
            let size = Vec3::from(size.0);
            (Shape::Box(0.5 * size), TriMesh::cuboid(size))
        }
        Geometry::Cylinder { radius, length } => {
            (Shape::Cylinder(*radius, 0.5 * length), TriMesh::cylinder(*radius, *length, 360))
        }
        Geometry::Capsule { radius, length } => {
            (Shape::Capsule(*radius, 0.5 * length), TriMesh::capsule(*radius, *length, 360, 90))
        }
        Geometry::Sphere { radius } => (Shape::Capsule(*radius, 0.0), TriMesh::uv_sphere(*radius, 360, 180)),
        Geometry::Mesh { filename, .. } => {
            let filename = filename.trim_start_matches("package://");
            let bytes = std::fs::read(folder.join(filename)).map_err(|e| format!("{filename}: {e}"))?;
            let mut mesh = match Path::new(filename).extension().and_then(|e| e.to_str()) {
                Some("stl") => TriMesh::from_stl(&bytes)?,
                _ => TriMesh::from_obj(&String::from_utf8_lossy(&bytes))?,
            };
            if mesh.check_closed().is_err() && mesh.repair(&RepairSettings::default()).is_err() {
                mesh = mesh.convex_hull()?;
            }
            (Shape::Mesh(Box::new(MeshDistance::new(&mesh))), mesh)
        }
    })
}

/// Returns points on a mesh, uniform by area.
fn on_surface(mesh: &TriMesh, count: usize) -> Vec<Vec3> {
    let areas: Vec<f64> = (0..mesh.triangles.len())
        .scan(0.0, |sum, t| {
            let [a, b, c] = mesh.corners(t);
            *sum += 0.5 * (b - a).cross(&(c - a)).norm();
            Some(*sum)
        })
        .collect();
    let total = areas.last().copied().unwrap_or(0.0);
    let point = |n: usize| {
        let at = (n as f64 + 0.5) / count as f64 * total;
        let [a, b, c] = mesh.corners(areas.partition_point(|sum| *sum < at).min(areas.len() - 1));
        let (u, v) = (kronecker(n, 2.0), kronecker(n, 3.0));
        let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
        a + (b - a) * u + (c - a) * v
    };
    (0..count).map(point).collect()
}

fn kronecker(n: usize, prime: f64) -> f64 {
    (0.5 + n as f64 * prime.sqrt()).fract()
}

fn fibonacci(n: usize, count: usize) -> Vec3 {
    let z = 1.0 - (2 * n + 1) as f64 / count as f64;
    let (sin, cos) = (n as f64 * std::f64::consts::PI * (3.0 - 5.0_f64.sqrt())).sin_cos();
    Vec3::new((1.0 - z * z).sqrt() * cos, (1.0 - z * z).sqrt() * sin, z)
}

fn bounds(spheres: impl Iterator<Item = (Vec3, f64)>) -> (Vec3, Vec3) {
    spheres.fold((Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY)), |(low, high), (c, r)| {
        (low.inf(&c.add_scalar(-r)), high.sup(&c.add_scalar(r)))
    })
}

fn volume(low: Vec3, high: Vec3, holds: impl Fn(&Vec3) -> bool) -> f64 {
    let size = high - low;
    let point =
        |n: usize| low + size.component_mul(&Vec3::new(kronecker(n, 2.0), kronecker(n, 3.0), kronecker(n, 5.0)));
    let inside = (0..VOLUME_POINTS).filter(|n| holds(&point(*n))).count();
    size.product() * inside as f64 / VOLUME_POINTS as f64
}

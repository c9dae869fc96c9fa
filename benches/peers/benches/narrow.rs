//! CPU time of one query of two touching meshes: tumble's contact modes and parry's queries of
//! triangle meshes, in one run.
//!
//! ```text
//! cargo bench --bench narrow                                the table
//! cargo bench --bench narrow -- --tumble 2000               the surface mode only, with this number of rounds, for a profiler
//! ```
//!
//! Two tori, and two bunnies if the public meshes are available (`TUMBLE_MESHES`, or a
//! `shared/meshes` in a parent folder), each 0.1 m in diagonal. They are turned at random and
//! brought together until they touch, then placed 1 mm apart, or 1 mm (1 % of the diagonal) into
//! each other. Margin 1 mm.
//!
//! In the first rows the same pose is queried repeatedly, so that all data are in near caches and
//! branches are predicted. In the rows `changing` each query has another of 256 poses, turned at
//! random; the figure is the mean.

use rapier3d_f64::parry::math::{Pose as ParryPose, Rotation, Vector};
use rapier3d_f64::parry::query;
use rapier3d_f64::parry::shape::TriMesh as ParryMesh;
use std::f64::consts::TAU;
use std::hint::black_box;
use std::path::PathBuf;
use tumble_collide::{ContactMode, Pose, Quat, Shape, TreeSettings, TriMesh, Vec3, contacts_in_mode};
use tumble_peers::clock::cpu_seconds;

/// Margin, and the gap or overlap of the bodies, meters.
const MARGIN: f64 = 1e-3;
/// Number of poses per row; the median is reported.
const POSES: u64 = 5;
/// Number of poses in a row with changing poses.
const CHANGING: u64 = 256;
/// Step of the approach, meters; the final precision is this times 2^-24.
const STEP: f64 = 2e-3;
const HALVINGS: u32 = 24;
/// Approximate CPU seconds per figure.
const PATIENCE: f64 = 0.6;

struct Body {
    name: String,
    ours: Shape,
    theirs: ParryMesh,
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    let bodies: Vec<Body> =
        [bunny(), Some(body("torus", TriMesh::torus(1.0, 0.35, 96, 34)))].into_iter().flatten().collect();
    if let [flag, rounds] = &arguments[..]
        && flag == "--tumble"
    {
        return alone(&bodies[0], rounds.parse().expect("a number of rounds"));
    }
    println!("\nCPU µs per query, margin 1 mm, medians of {POSES} poses (worst).\n");
    println!("| pair | pose | surface | spheres | parry contact | distance | contact / surface |");
    println!("|---|---|---|---|---|---|---|");
    for body in &bodies {
        for (pose, into) in [("1 mm apart", -MARGIN), ("touching", 0.0), ("1 % overlap", MARGIN)] {
            row(body, pose, into);
        }
        let ways: Vec<(Pose, Vec3)> = (0..CHANGING).map(|n| approached(body, n)).collect();
        for (pose, into) in
            [("1 mm apart, changing", -MARGIN), ("touching, changing", 0.0), ("1 % overlap, changing", MARGIN)]
        {
            changing(body, pose, &ways.iter().map(|(pose, way)| moved(pose, way, into)).collect::<Vec<_>>());
        }
    }
}

fn row(body: &Body, name: &str, into: f64) {
    let mut figures: Vec<[f64; 4]> = (0..POSES).map(|n| measure(body, &touching(body, n, into))).collect();
    let medians: [(f64, f64); 4] = std::array::from_fn(|k| {
        figures.sort_by(|a, b| a[k].total_cmp(&b[k]));
        (figures[figures.len() / 2][k], figures[figures.len() - 1][k])
    });
    let cells: String = medians.iter().map(|(median, worst)| format!(" {median:.0} ({worst:.0}) |")).collect();
    println!("| two of {} | {name} |{cells} {:.1} |", body.name, medians[2].0 / medians[0].0);
}

/// Prints a row of queries in which each pose differs from the one before.
fn changing(body: &Body, name: &str, poses: &[Pose]) {
    let (fixed, theirs): (_, Vec<ParryPose>) = (ParryPose::IDENTITY, poses.iter().map(to_parry).collect());
    let mut found = Vec::new();
    let mut by = |mode| {
        time(|| {
            for pose in poses {
                found.clear();
                contacts_in_mode(mode, &body.ours, pose, &body.ours, &Pose::identity(), MARGIN, &mut found);
                black_box(&found);
            }
        }) / poses.len() as f64
    };
    let (surface, spheres) = (by(ContactMode::Surface), by(ContactMode::Spheres));
    let mesh = &body.theirs;
    let contact = time(|| {
        theirs.iter().for_each(|pose| {
            black_box(query::contact(pose, mesh, &fixed, mesh, MARGIN)).ok();
        })
    }) / poses.len() as f64;
    println!(
        "| two of {} | {name} | {surface:.0} | {spheres:.0} | {contact:.0} | | {:.1} |",
        body.name,
        contact / surface
    );
}

/// Returns the µs of all queries of one pose.
fn measure(body: &Body, pose: &Pose) -> [f64; 4] {
    let (fixed, theirs) = (ParryPose::IDENTITY, to_parry(pose));
    let mut found = Vec::new();
    let mut by = |mode| {
        time(|| {
            found.clear();
            contacts_in_mode(mode, &body.ours, pose, &body.ours, &Pose::identity(), MARGIN, &mut found);
            black_box(&found);
        })
    };
    let (surface, spheres) = (by(ContactMode::Surface), by(ContactMode::Spheres));
    let mesh = &body.theirs;
    let contact = time(|| {
        black_box(query::contact(&theirs, mesh, &fixed, mesh, MARGIN)).ok();
    });
    let distance = time(|| {
        black_box(query::distance(&theirs, mesh, &fixed, mesh)).ok();
    });
    [surface, spheres, contact, distance]
}

/// Returns CPU µs per call, the median of three runs; of one run for a slow call.
fn time(mut call: impl FnMut()) -> f64 {
    let mut run = |times: usize| {
        let before = cpu_seconds();
        (0..times).for_each(|_| call());
        cpu_seconds() - before
    };
    let mut times = 1;
    let mut seconds = run(times);
    while seconds < PATIENCE / 3.0 && times < 1 << 20 {
        times *= 2;
        seconds = run(times);
    }
    if times == 1 {
        return 1e6 * seconds;
    }
    let mut runs = [seconds, run(times), run(times)];
    runs.sort_by(f64::total_cmp);
    1e6 * runs[1] / times as f64
}

/// Returns the `n`th pose of the first body far away, and the displacement from the second to it.
fn far(n: u64) -> (Pose, Vec3) {
    let mut state = n.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x5851_f42d;
    let mut random = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    let turn = Quat::from_scaled_axis(Vec3::new(random() - 0.5, random() - 0.5, random() - 0.5) * TAU);
    let (z, around) = (2.0 * random() - 1.0, TAU * random());
    let way = Vec3::new((1.0 - z * z).sqrt() * around.cos(), (1.0 - z * z).sqrt() * around.sin(), z);
    (Pose::from_parts((way * 0.3).into(), turn), way)
}

fn moved(pose: &Pose, way: &Vec3, into: f64) -> Pose {
    Pose::from_parts((pose.translation.vector - way * into).into(), pose.rotation)
}

/// Returns the `n`th pose at which the first body touches the second, moved `into` it, meters.
fn touching(body: &Body, n: u64, into: f64) -> Pose {
    let (mut pose, way) = far(n);
    // parry's distance is a safe displacement
    for _ in 0..20 {
        let free = query::distance(&to_parry(&pose), &body.theirs, &ParryPose::IDENTITY, &body.theirs)
            .expect("two meshes")
            .distance;
        pose = moved(&pose, &way, free);
        if free < 1e-7 {
            break;
        }
    }
    moved(&pose, &way, into)
}

/// Returns the same by steps and bisection with parry's intersection test, which is much faster;
/// also the direction of approach.
fn approached(body: &Body, n: u64) -> (Pose, Vec3) {
    let (mut pose, way) = far(n);
    let meet = |pose: &Pose| {
        query::intersection_test(&to_parry(pose), &body.theirs, &ParryPose::IDENTITY, &body.theirs)
            .expect("two meshes")
            .intersecting
    };
    let mut step = STEP;
    while pose.translation.vector.dot(&way) > 0.0 && !meet(&moved(&pose, &way, step)) {
        pose = moved(&pose, &way, step);
    }
    for _ in 0..HALVINGS {
        step *= 0.5;
        let next = moved(&pose, &way, step);
        if !meet(&next) {
            pose = next;
        }
    }
    (pose, way)
}

/// Prints the surface mode only: µs per query apart, touching and overlapping, with repeated and
/// with changing poses.
fn alone(body: &Body, rounds: usize) {
    let places = [-MARGIN, 0.0, MARGIN];
    let few = places.map(|into| (0..POSES).map(|n| touching(body, n, into)).collect::<Vec<_>>());
    let ways: Vec<(Pose, Vec3)> = (0..CHANGING).map(|n| approached(body, n)).collect();
    let many = places.map(|into| ways.iter().map(|(pose, way)| moved(pose, way, into)).collect::<Vec<_>>());
    let mut found = Vec::new();
    let mut query = |pose: &Pose| {
        found.clear();
        contacts_in_mode(ContactMode::Surface, &body.ours, pose, &body.ours, &Pose::identity(), MARGIN, &mut found);
        black_box(&found);
    };
    let mut figures = Vec::new();
    for poses in &few {
        let before = cpu_seconds();
        poses.iter().for_each(|pose| (0..rounds).for_each(|_| query(pose)));
        figures.push(1e6 * (cpu_seconds() - before) / (rounds * poses.len()) as f64);
    }
    for poses in &many {
        let before = cpu_seconds();
        let times = rounds / 10 + 1;
        (0..times).for_each(|_| poses.iter().for_each(&mut query));
        figures.push(1e6 * (cpu_seconds() - before) / (times * poses.len()) as f64);
    }
    let figures: Vec<String> = figures.iter().map(|f| format!("{f:.1}")).collect();
    println!("{} µs per query, means: apart, touching, overlap; the same with poses that change", figures.join(" "));
}

fn bunny() -> Option<Body> {
    let here = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    let folder = std::env::var_os("TUMBLE_MESHES")
        .map(PathBuf::from)
        .or_else(|| here.ancestors().map(|a| a.join("shared/meshes")).find(|p| p.is_dir()));
    let Some(folder) = folder else {
        println!("SKIPPED bunny: no shared/meshes above {} and TUMBLE_MESHES is not set", here.display());
        return None;
    };
    let text = std::fs::read_to_string(folder.join("bunny.obj")).expect("bunny.obj in that folder");
    Some(body("bunny", TriMesh::from_obj(&text).expect("a mesh")))
}

fn body(name: &str, mesh: TriMesh) -> Body {
    let scale = 0.1 / mesh.diagonal();
    let mesh = mesh.scaled(scale);
    let before = cpu_seconds();
    let ours = Shape::mesh(mesh, &TreeSettings::octree()).expect("a closed mesh");
    let Shape::Mesh(solid) = &ours else { unreachable!("a mesh was made") };
    let mesh = solid.mesh();
    println!("{name}: {} triangles, shape made in {:.2} s of CPU", mesh.triangles.len(), cpu_seconds() - before);
    let theirs = ParryMesh::new(mesh.vertices.iter().map(vector).collect(), mesh.triangles.clone()).expect("a mesh");
    Body { name: format!("{name} ({} triangles)", mesh.triangles.len()), ours, theirs }
}

fn to_parry(pose: &Pose) -> ParryPose {
    let q = pose.rotation.coords;
    ParryPose::from_parts(vector(&pose.translation.vector), Rotation::from_xyzw(q.x, q.y, q.z, q.w))
}

fn vector(v: &Vec3) -> Vector {
    Vector::new(v.x, v.y, v.z)
}

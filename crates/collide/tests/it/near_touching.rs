//! The normals and gaps of convex shapes that all but touch, at random poses.
//!
//! The direction of the distance of two convex bodies does not change when one is moved along it. So each pair is placed
//! well apart, where [`closest_points`] gives the normal, and is then brought along it to small gaps and overlaps.
//! `TUMBLE_SLOW=1` runs forty times as many poses, of which one in fifty may be wrong: the formulas of boxes prefer a face
//! to edges that overlap little less, and in 2 of 1000 poses a cylinder and a cone that touch have a false depth.

use super::rng::Rng;
use tumble_collide::{ClosestPair, Contact, Pose, Shape, Vec3, closest_points, contacts};

/// Gaps at which the contacts are compared, meters.
const GAPS: [f64; 11] = [1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, -1e-6, -1e-5, -1e-4, -1e-3];
/// Distance at which the normal is found, meters.
const APART: f64 = 0.1;
/// Distance at which the normal must be unique, meters.
const CLEAR: f64 = 0.01;
/// Distance up to which the bodies approach along a random line, meters.
const NEAR: f64 = 1e-4;
/// Motion aside at which a normal that is unique stays the same, meters: that of two corners turns by `ASIDE/CLEAR`.
const ASIDE: f64 = 1e-4;
/// Largest error of the normal of the deepest contact, rad: that of [`closest_points`] of curved bodies.
const NORMAL: f64 = 5e-4;
/// Largest error of its gap, meters: that of the distance of curved bodies.
const GAP: f64 = 5e-8;
/// Additional error of the normal per meter of overlap, rad/m: the deepest point of a curved side is not that of the
/// least translation.
const PER_DEPTH: f64 = 5.0;
/// Largest angle of the normal of another contact within the same gap, rad.
const BESIDE: f64 = 0.02;

fn shapes() -> Vec<(&'static str, Shape)> {
    let octahedron: Vec<Vec3> = (0..3).flat_map(|k| [Vec3::ith(k, 0.3), Vec3::ith(k, -0.3)]).collect();
    let mut random = Rng::new(5);
    let cloud: Vec<Vec3> = (0..30).map(|_| random.direction().component_mul(&Vec3::new(0.3, 0.25, 0.2))).collect();
    vec![
        ("box", Shape::cuboid(Vec3::new(0.5, 0.4, 0.6)).unwrap()),
        ("octahedron", Shape::convex_hull(&octahedron).unwrap()),
        ("hull", Shape::convex_hull(&cloud).unwrap()),
        ("cylinder", Shape::cylinder(0.25, 0.5).unwrap()),
        ("cone", Shape::cone(0.3, 0.6).unwrap()),
        ("sphere", Shape::sphere(0.3).unwrap()),
        ("capsule", Shape::capsule(0.2, 0.5).unwrap()),
        ("ellipsoid", Shape::ellipsoid(Vec3::new(0.35, 0.25, 0.2)).unwrap()),
        ("rounded box", Shape::rounded_cuboid(Vec3::new(0.5, 0.4, 0.6), 0.1).unwrap()),
        ("rounded cylinder", Shape::rounded_cylinder(0.25, 0.5, 0.05).unwrap()),
    ]
}

fn angle(a: &Vec3, b: &Vec3) -> f64 {
    a.cross(b).norm().atan2(a.dot(b))
}

/// Failures of one pair, and the worst of them.
#[derive(Default)]
struct Tally {
    poses: usize,
    wrong: usize,
    worst: f64,
    example: String,
}

impl Tally {
    fn compare(&mut self, label: &str, gap: f64, normal: &Vec3, found: &[Contact]) {
        self.poses += 1;
        let Some(deepest) = found.iter().min_by(|x, y| x.gap.total_cmp(&y.gap)) else {
            self.wrong += 1;
            self.example = format!("{label}, gap {gap:e}: no contact");
            return;
        };
        let near = gap + 1e-7;
        let beside = found.iter().filter(|c| c.gap < near).map(|c| angle(&c.normal, normal)).fold(0.0, f64::max);
        let (off, error) = (angle(&deepest.normal, normal), (deepest.gap - gap).abs());
        let depth = (-gap).max(0.0);
        if off > NORMAL + PER_DEPTH * depth || error > GAP + depth * depth || beside > BESIDE {
            self.wrong += 1;
            if off.max(beside) >= self.worst {
                self.worst = off.max(beside);
                self.example = format!(
                    "{label}, gap {gap:e}: off {off:.1e}, beside {beside:.1e}, gap by {error:.1e}; {found:#?} instead of {normal:?}"
                );
            }
        }
    }
}

/// Returns a pose of A next to B and the pair of closest points there, if the normal of the two is unique where they touch.
fn touching([a, b]: [&Shape; 2], seed: u64) -> Option<(Pose, ClosestPair)> {
    let mut random = Rng::new(seed);
    let (pose_b, mut pose_a, direction) = (random.pose(0.0), random.pose(0.0), random.direction());
    let closest = |pose: &Pose| closest_points(a, pose, b, &pose_b).unwrap();
    pose_a.translation.vector = 2.0 * direction + random.vec(0.1);
    // until they all but touch, then back along the normal
    for _ in 0..200 {
        let way = closest(&pose_a).distance - NEAR;
        if way < 0.1 * NEAR {
            break;
        }
        pose_a.translation.vector -= way * direction;
    }
    let near = closest(&pose_a);
    pose_a.translation.vector += near.normal * (CLEAR - near.distance);
    let pair = closest(&pose_a);
    let is_kept = |aside: Vec3| {
        let mut moved = pose_a;
        moved.translation.vector += aside.cross(&pair.normal).normalize() * ASIDE;
        angle(&closest(&moved).normal, &pair.normal) < 0.2 * ASIDE / CLEAR
    };
    let axis = Vec3::ith(pair.normal.iamin(), 1.0);
    let other = axis.cross(&pair.normal);
    let unique = [axis, -axis, other, -other].into_iter().all(is_kept);
    pose_a.translation.vector += pair.normal * (APART - pair.distance);
    unique.then(|| (pose_a, closest(&pose_a)))
}

#[test]
fn contacts_of_convex_shapes_that_all_but_touch_have_the_normal_of_their_distance() {
    let slow = std::env::var_os("TUMBLE_SLOW").is_some();
    let (seeds, share) = if slow { (800, 0.02) } else { (20, 0.0) };
    let shapes = shapes();
    let (mut failures, mut worst) = (Vec::new(), String::new());
    for (name_a, a) in &shapes {
        for (name_b, b) in &shapes {
            let mut tally = Tally::default();
            for seed in 0..seeds {
                let Some((pose_a, pair)) = touching([a, b], seed) else { continue };
                let pose_b = Rng::new(seed).pose(0.0);
                for gap in GAPS {
                    let mut moved = pose_a;
                    moved.translation.vector += pair.normal * (gap - pair.distance);
                    // another direction may lead out of an overlap earlier
                    let is_least = |least: ClosestPair| least.distance < gap + GAP;
                    if gap < 0.0 && !closest_points(a, &moved, b, &pose_b).is_some_and(is_least) {
                        continue;
                    }
                    let mut found = Vec::new();
                    contacts(a, &moved, b, &pose_b, 0.01, &mut found);
                    tally.compare(&format!("{name_a} on {name_b}, seed {seed}"), gap, &pair.normal, &found);
                }
            }
            if tally.wrong as f64 > share * tally.poses as f64 {
                failures.push(format!("{name_a} on {name_b}: {} of {}, {:.2}", tally.wrong, tally.poses, tally.worst));
                worst = format!("{worst}\n{}", tally.example);
            }
        }
    }
    assert!(failures.is_empty(), "{}\n{worst}", failures.join("\n"));
}

//! The weight between coverage and tightness of robots of spheres, on shapes with a closed form: what it
//! trades, its ends, and the optimum of one sphere around a cube. The measures here are of their own.

use std::f64::consts::PI;
use std::path::PathBuf;
use tumble_core::collide::{TreeCache, TreeSettings, Vec3};
use tumble_scene::urdf::{LinkSpheres, PerLink, SphereOptions, UrdfOptions, spherize};

/// The signed distance to a box.
fn to_box(p: &Vec3, center: [f64; 3], size: [f64; 3]) -> f64 {
    let q = (p - Vec3::from(center)).abs() - 0.5 * Vec3::from(size);
    q.sup(&Vec3::zeros()).norm() + q.max().min(0.0)
}

/// A link, the signed distance to it, its surface as a function of three numbers in 0 to 1, and its volume;
/// in meters.
struct Link {
    name: &'static str,
    collisions: &'static str,
    distance: fn(&Vec3) -> f64,
    surface: fn(f64, f64, f64) -> Vec3,
    volume: f64,
    /// Half of a cube around it and its spheres.
    half: f64,
}

/// A point of the surface of a box, uniform by area.
fn on_box(face: f64, u: f64, v: f64, center: [f64; 3], size: [f64; 3]) -> Vec3 {
    let areas = [size[1] * size[2], size[2] * size[0], size[0] * size[1]];
    let mut at = face * 2.0 * areas.iter().sum::<f64>();
    for k in 0..3 {
        for side in [-0.5, 0.5] {
            if at < areas[k] || (k, side) == (2, 0.5) {
                let mut p = Vec3::zeros();
                p[k] = side * size[k];
                p[(k + 1) % 3] = (u - 0.5) * size[(k + 1) % 3];
                p[(k + 2) % 3] = (v - 0.5) * size[(k + 2) % 3];
                return p + Vec3::from(center);
            }
            at -= areas[k];
        }
    }
    unreachable!()
}

const CUBE: Link = Link {
    name: "cube",
    collisions: r#"<collision><geometry><box size="2 2 2"/></geometry></collision>"#,
    distance: |p| to_box(p, [0.0; 3], [2.0; 3]),
    surface: |a, u, v| on_box(a, u, v, [0.0; 3], [2.0; 3]),
    volume: 8.0,
    half: 1.8,
};

const CAPSULE: Link = Link {
    name: "capsule",
    collisions: r#"<collision><geometry><capsule radius="0.5" length="2"/></geometry></collision>"#,
    distance: |p| (p - Vec3::z() * p.z.clamp(-1.0, 1.0)).norm() - 0.5,
    // of the caps, as of a sphere, as much area as their height on the cylinder around them
    surface: |a, u, _| {
        let z = 3.0 * a - 1.5;
        let height = (z.abs() - 1.0).max(0.0);
        let radius = (0.25 - height * height).max(0.0).sqrt();
        Vec3::new(radius * (2.0 * PI * u).cos(), radius * (2.0 * PI * u).sin(), z)
    },
    volume: PI * 0.25 * 2.0 + PI / 6.0,
    half: 1.8,
};

const L: Link = Link {
    name: "l",
    collisions: r#"<collision><origin xyz="1 0 0"/><geometry><box size="3 1 1"/></geometry></collision>
<collision><origin xyz="0 0 1"/><geometry><box size="1 1 3"/></geometry></collision>"#,
    distance: |p| to_box(p, [1.0, 0.0, 0.0], [3.0, 1.0, 1.0]).min(to_box(p, [0.0, 0.0, 1.0], [1.0, 1.0, 3.0])),
    // both boxes have the same area; points inside the other are left out
    surface: |a, u, v| {
        if a < 0.5 {
            on_box(2.0 * a, u, v, [1.0, 0.0, 0.0], [3.0, 1.0, 1.0])
        } else {
            on_box(2.0 * a - 1.0, u, v, [0.0, 0.0, 1.0], [1.0, 1.0, 3.0])
        }
    },
    volume: 5.0,
    half: 3.3,
};

/// Covers a link with at most `most` spheres.
fn covered(link: &Link, most: usize, weight: Option<f64>, coverage: Option<f64>) -> LinkSpheres {
    let folder = std::env::temp_dir().join(format!("tumble-weigh-{}-{}", link.name, std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let file: PathBuf = folder.join(format!("{most}-{weight:?}-{coverage:?}.urdf"));
    let text = format!("<robot name=\"r\"><link name=\"{}\">{}</link></robot>", link.name, link.collisions);
    std::fs::write(&file, text).unwrap();
    let options = SphereOptions {
        most: PerLink::all(most),
        coverage: PerLink::all(coverage),
        weight: PerLink::all(weight),
        error: 1e-4,
        tree: TreeSettings { depth: 4, ..TreeSettings::octree() },
        cache: TreeCache::off(),
        urdf: UrdfOptions::default(),
    };
    let robot = spherize(&file, &options, &());
    std::fs::remove_file(&file).unwrap();
    robot.unwrap().links.remove(0)
}

/// Returns number `n` of a sequence that fills 0 to 1 evenly, one for each prime.
fn halton(mut n: usize, prime: usize) -> f64 {
    let (mut sum, mut part) = (0.0, 1.0);
    while n > 0 {
        part /= prime as f64;
        sum += part * (n % prime) as f64;
        n /= prime;
    }
    sum
}

/// Returns the share of the surface that is covered, the volume outside over that of the link, and how far
/// the spheres reach outside.
fn measured(link: &Link, spheres: &LinkSpheres) -> [f64; 3] {
    let holds = |p: &Vec3| spheres.spheres.iter().any(|(c, r)| (p - c).norm() <= *r);
    let points = (1..=20_000).map(|n| (link.surface)(halton(n, 2), halton(n, 3), halton(n, 5)));
    let points: Vec<Vec3> = points.filter(|p| (link.distance)(p) > -1e-9).collect();
    let covered = points.iter().filter(|p| holds(p)).count() as f64 / points.len() as f64;
    let count = 200_000;
    let outside = (1..=count)
        .map(|n| link.half * (2.0 * Vec3::new(halton(n, 2), halton(n, 3), halton(n, 5)) - Vec3::repeat(1.0)))
        .filter(|p| (link.distance)(p) > 0.0 && holds(p))
        .count();
    let reach = spheres.spheres.iter().map(|(c, r)| (link.distance)(c) + r).fold(0.0, f64::max);
    [covered, outside as f64 / count as f64 * (2.0 * link.half).powi(3) / link.volume, reach]
}

#[test]
fn more_weight_covers_more_and_reaches_further() {
    for (link, most) in [(&CUBE, 1), (&CUBE, 8), (&CAPSULE, 3), (&L, 6)] {
        let mut last = [0.0; 3];
        let mut steps = 0;
        for weight in [0.0, 0.2, 0.35, 0.5, 0.7, 0.9, 1.0] {
            let spheres = covered(link, most, Some(weight), None);
            let figures = measured(link, &spheres);
            let [share, outside, reach] = figures;
            let stated = spheres.volume_outside / spheres.volume;
            let worst = spheres.outward.iter().copied().fold(0.0, f64::max);
            println!(
                "{} {most}, {weight:.1}: {} spheres, covered {:.4} (measured {share:.4}), outside {stated:.4} ({outside:.4}), at most {worst:.4} ({reach:.4}), mean {:.4}",
                link.name,
                spheres.spheres.len(),
                spheres.coverage,
                spheres.mean_outward
            );
            assert!(spheres.spheres.len() <= most);
            assert!((spheres.volume / link.volume - 1.0).abs() < 5e-3, "{}", spheres.volume);
            // what is stated is so: coverage is a lower bound, the reach an upper one, the volume sampled
            assert!(share >= spheres.coverage - 5e-3 && reach <= worst + 1e-9);
            assert!((stated - outside).abs() < 1e-2);
            // monotone as proved, in the stated figures
            assert!(spheres.coverage >= last[0] - 1e-12 && stated >= last[1] - 1e-3 && outside >= last[2] - 1e-2);
            steps += usize::from(spheres.coverage > last[0] + 1e-3);
            last = [spheres.coverage, stated, outside];
        }
        assert!(steps >= 4, "{}: only {steps} different sets", link.name);
        // the ends
        let full = covered(link, most, None, None);
        let one = covered(link, most, Some(1.0), None);
        assert_eq!((&one.spheres, one.coverage), (&full.spheres, 1.0));
        let none = covered(link, most, Some(0.0), None);
        let [_, outside, reach] = measured(link, &none);
        assert!(outside == 0.0 && reach < 2e-3, "{}: {reach}", link.name);
    }
}

/// One sphere about the middle of the cube with half side 1 has for radii 1 to √2
///
/// ```text
/// U = 1 − 6 π (r² − 1)/24,   V = 6 (π/3)(r − 1)² (2 r + 1)/8,   dJ/dr = 0 at r = 1 + w/(3 (1 − w))
/// ```
#[test]
fn one_sphere_in_a_cube_is_the_best_there_is() {
    let cost = |r: f64, w: f64| {
        w * (1.0 - PI * (r * r - 1.0) / 4.0) + (1.0 - w) * (PI / 4.0) * (r - 1.0).powi(2) * (2.0 * r + 1.0)
    };
    for weight in [0.1, 0.3, 0.37, 0.55] {
        let best = 1.0 + weight / (3.0 * (1.0 - weight));
        let (center, radius) = covered(&CUBE, 1, Some(weight), None).spheres[0];
        println!(
            "weight {weight}: radius {radius:.4}, best {best:.4}, J {:.5}, {:.5}",
            cost(radius, weight),
            cost(best, weight)
        );
        assert!(center.norm() < 1e-2, "{center:?}");
        assert!((radius - best).abs() < 0.04 && cost(radius, weight) < cost(best, weight) + 2e-3);
    }
}

#[test]
fn a_least_coverage_holds_whatever_the_weight() {
    for coverage in [0.5, 0.9] {
        let mut last = 0.0;
        for weight in [0.0, 0.3, 0.9] {
            let spheres = covered(&L, 6, Some(weight), Some(coverage));
            println!("{coverage}, {weight}: covered {:.4}", spheres.coverage);
            assert!(spheres.coverage >= coverage && spheres.coverage >= last);
            last = spheres.coverage;
        }
        let tight = covered(&L, 6, Some(0.0), Some(coverage));
        let tightest = covered(&L, 6, None, Some(coverage));
        assert!(tight.volume_outside <= tightest.volume_outside, "the least volume outside with that coverage");
    }
}

#[test]
fn weights_beyond_the_range_are_refused() {
    for weight in [-0.1, 1.1, f64::NAN] {
        let folder = std::env::temp_dir().join(format!("tumble-weigh-range-{weight}-{}.urdf", std::process::id()));
        std::fs::write(&folder, format!("<robot name=\"r\"><link name=\"c\">{}</link></robot>", CUBE.collisions))
            .unwrap();
        let options = |weight: PerLink<Option<f64>>| SphereOptions {
            most: PerLink::all(1),
            coverage: PerLink::all(None),
            weight,
            error: 1e-3,
            tree: TreeSettings::octree(),
            cache: TreeCache::off(),
            urdf: UrdfOptions::default(),
        };
        let said = spherize(&folder, &options(PerLink::all(Some(weight))), &()).unwrap_err().to_string();
        assert!(said.contains("a weight of") && said.contains("expected 0 (no volume outside) to 1"), "{said}");
        let links = [("hand".to_owned(), Some(0.5))].into();
        let said = spherize(&folder, &options(PerLink { common: None, links }), &()).unwrap_err().to_string();
        assert!(said.contains("there is no link \"hand\""), "{said}");
        std::fs::remove_file(&folder).unwrap();
    }
}

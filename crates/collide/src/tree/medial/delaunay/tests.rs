//! Tests against brute force: empty spheres, the volume of the hull by the divergence theorem,
//! Euler's formula.

use super::predicates::{in_sphere, orient};
use super::{Delaunay, GHOST};
use crate::{TriMesh, Vec3};

/// A linear congruential generator (Knuth's MMIX constants).
struct Dice(u64);

impl Dice {
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn point(&mut self) -> Vec3 {
        Vec3::new(self.unit(), self.unit(), self.unit())
    }
}

fn random(count: usize) -> Vec<Vec3> {
    let mut dice = Dice(1);
    (0..count).map(|_| dice.point()).collect()
}

fn grid(n: usize) -> Vec<Vec3> {
    (0..n * n * n).map(|i| Vec3::new((i % n) as f64, (i / n % n) as f64, (i / n / n) as f64) * 0.1).collect()
}

fn on_surface(mesh: &TriMesh, each: usize) -> Vec<Vec3> {
    let mut dice = Dice(2);
    let mut points = mesh.vertices.clone();
    for t in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.corners(t);
        for _ in 0..each {
            let (u, v) = (dice.unit(), dice.unit());
            let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
            points.push(a + (b - a) * u + (c - a) * v);
        }
    }
    points
}

/// Each cell has positive orientation; each link is mutual and shares the facet.
fn check_links(d: &Delaunay) {
    for c in (0..d.cell_count() as u32).filter(|&c| d.is_in_use(c)) {
        if d.is_finite(c) {
            let [p, q, r, s] = d.corners(c);
            assert!(orient(&p, &q, &r, &s) > 0.0, "cell {c} is flat or turned");
        }
        for k in 0..4 {
            let n = d.across(c)[k];
            let back = d.across(n).iter().position(|&x| x == c).expect("a link goes one way");
            let facet = |cell: u32, k: usize| {
                let mut f: Vec<u32> = (0..4).filter(|&j| j != k).map(|j| d.vertices(cell)[j]).collect();
                f.sort_unstable();
                f
            };
            assert_eq!(facet(c, k), facet(n, back));
        }
    }
}

fn check_empty(d: &Delaunay, points: &[Vec3]) {
    for c in d.finite_cells() {
        let corners = d.corners(c);
        for p in points {
            assert!(in_sphere(corners.each_ref(), p) <= 0.0, "the sphere of cell {c} holds {p}");
        }
    }
}

/// The cells fill the volume that the ghosts' facets enclose (divergence theorem), and no point is
/// beyond any of these facets: their hull is the convex hull of the points.
fn check_hull(d: &Delaunay, points: &[Vec3]) {
    let filled: f64 = d.finite_cells().map(|c| d.corners(c)).map(|[p, q, r, s]| orient(&p, &q, &r, &s) / 6.0).sum();
    let mut enclosed = 0.0;
    for c in (0..d.cell_count() as u32).filter(|&c| d.is_in_use(c)) {
        let Some(k) = d.ghost_corner(c) else { continue };
        for p in points {
            assert!(d.side(c, k, p) <= 0.0, "{p} is beyond a facet of the hull");
        }
        enclosed -= d.side(c, k, &Vec3::new(0.3, 0.2, 0.1)) / 6.0;
    }
    assert!((filled - enclosed).abs() <= 1e-12 * enclosed, "{filled} in {enclosed}");
}

/// With infinity the cells form a three-sphere: `V − E + F − C = 0`; each cell has four facets,
/// each facet two cells.
fn check_euler(d: &Delaunay) {
    let cells: Vec<u32> = (0..d.cell_count() as u32).filter(|&c| d.is_in_use(c)).collect();
    let mut vertices: Vec<u32> = cells.iter().flat_map(|&c| d.vertices(c)).collect();
    let mut edges: Vec<[u32; 2]> = Vec::new();
    for &c in &cells {
        let v = d.vertices(c);
        for (i, j) in [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)] {
            edges.push([v[i].min(v[j]), v[i].max(v[j])]);
        }
    }
    vertices.sort_unstable();
    vertices.dedup();
    edges.sort_unstable();
    edges.dedup();
    assert!(vertices.last() == Some(&GHOST));
    assert_eq!(vertices.len() + 2 * cells.len(), edges.len() + cells.len(), "V + F = E + C");
}

fn check(points: &[Vec3]) -> Delaunay {
    let d = Delaunay::new(points).unwrap();
    check_links(&d);
    check_empty(&d, points);
    check_hull(&d, points);
    check_euler(&d);
    d
}

#[test]
fn random_points() {
    for count in [4, 5, 6, 20, 400] {
        let d = check(&random(count));
        assert_eq!(d.duplicates(), 0);
    }
}

#[test]
fn grids_whose_cells_share_spheres() {
    for n in [2, 3, 6] {
        let d = check(&grid(n));
        let filled: f64 = d.finite_cells().map(|c| d.corners(c)).map(|[p, q, r, s]| orient(&p, &q, &r, &s) / 6.0).sum();
        let side = 0.1 * (n - 1) as f64;
        assert!((filled - side * side * side).abs() < 1e-14, "{n}");
    }
}

#[test]
fn points_of_surfaces() {
    let box_ = TriMesh::cuboid(Vec3::new(1.0, 2.0, 0.2));
    check(&on_surface(&box_, 20));
    check(&on_surface(&TriMesh::icosphere(1.0, 2), 0));
    check(&on_surface(&TriMesh::torus(1.0, 0.3, 16, 8), 1));
    check(&on_surface(&TriMesh::cylinder(0.5, 1.0, 24), 2));
}

#[test]
fn a_plane_and_one_more_point() {
    let mut points: Vec<Vec3> = (0..100).map(|i| Vec3::new(f64::from(i % 10), f64::from(i / 10), 0.0)).collect();
    assert!(Delaunay::new(&points).is_none());
    assert!(Delaunay::new(&points[..10]).is_none());
    assert!(Delaunay::new(&[]).is_none());
    points.push(Vec3::new(3.3, 4.4, 2.0));
    let d = check(&points);
    // one cell on each of the 162 triangles of the plane
    assert_eq!(d.finite_cells().count(), 162);
}

#[test]
fn duplicates_are_skipped_and_counted() {
    let mut points = random(50);
    points.extend_from_within(10..40);
    let mut d = check(&points);
    assert_eq!(d.duplicates(), 30);
    let mut used: Vec<u32> = d.finite_cells().flat_map(|c| d.vertices(c)).collect();
    used.sort_unstable();
    used.dedup();
    assert_eq!(used.len(), 50);
    assert_eq!(d.insert(points[3], 0), None);
    assert_eq!(d.duplicates(), 31);
    assert_eq!(d.points.len(), 80);
}

#[test]
fn points_added_later_keep_all_spheres_empty_and_list_the_changes() {
    let mut points = grid(3);
    let mut d = Delaunay::new(&points).unwrap();
    let mut dice = Dice(5);
    for n in 0..60 {
        // inside, outside, in the middle of faces and edges
        let p = match n % 4 {
            0 => dice.point() * 0.2,
            1 => (dice.point() - Vec3::repeat(0.5)) * 0.8,
            2 => Vec3::new(0.05 * f64::from(n / 4), 0.05, 0.0),
            _ => Vec3::new(0.0, 0.025 * f64::from(n / 4), 0.1),
        };
        let before: Vec<Option<[u32; 4]>> =
            (0..d.cell_count() as u32).map(|c| d.is_in_use(c).then(|| d.vertices(c))).collect();
        if d.insert(p, 0).is_none() {
            assert!(points.contains(&p));
            continue;
        }
        points.push(p);
        for (c, old) in before.iter().enumerate() {
            let same = *old == d.is_in_use(c as u32).then(|| d.vertices(c as u32));
            assert!(same || d.removed().contains(&(c as u32)) || d.created().contains(&(c as u32)));
        }
    }
    check_links(&d);
    check_empty(&d, &points);
    check_hull(&d, &points);
    check_euler(&d);
}

#[test]
fn ten_thousand_points_twice_the_same() {
    let points = random(10_000);
    let d = Delaunay::new(&points).unwrap();
    check_links(&d);
    check_euler(&d);
    let again = Delaunay::new(&points).unwrap();
    assert_eq!(d.cells, again.cells);
    // spheres against a sample of the points; the local Delaunay property extends it to all points
    for c in d.finite_cells().step_by(97) {
        let corners = d.corners(c);
        assert!(points.iter().all(|p| in_sphere(corners.each_ref(), p) <= 0.0));
    }
}

//! Solids whose surface crosses itself, overlaps itself or has cavities.

use crate::rng::Rng;
use crate::shared_meshes::text;
use tumble_collide::{Mat3, MeshDistance, Quat, Shape, TreeSettings, TriMesh, Vec3, WindingNumber};

/// Returns two meshes as one.
pub fn both(a: &TriMesh, b: &TriMesh) -> TriMesh {
    let mut mesh = a.clone();
    let first = mesh.vertices.len() as u32;
    mesh.vertices.extend(&b.vertices);
    mesh.triangles.extend(b.triangles.iter().map(|t| t.map(|v| v + first)));
    mesh
}

/// Returns the mesh with every face reversed.
pub fn inside_out(mut mesh: TriMesh) -> TriMesh {
    mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    mesh
}

fn near(found: f64, expected: f64, tolerance: f64, what: &str) {
    assert!((found - expected).abs() <= tolerance, "{what}: {found} instead of {expected}");
}

/// Returns the winding number by solid angles with the formula of l'Huilier, which shares nothing
/// with the crate.
fn winding_by_excess(mesh: &TriMesh, p: &Vec3) -> f64 {
    let sum: f64 = (0..mesh.triangles.len())
        .map(|t| {
            let [a, b, c] = mesh.corners(t).map(|x| (x - p).normalize());
            let arc = |u: &Vec3, v: &Vec3| u.cross(v).norm().atan2(u.dot(v));
            let (x, y, z) = (arc(&b, &c), arc(&c, &a), arc(&a, &b));
            let s = 0.5 * (x + y + z);
            let product = (0.5 * s).tan() * (0.5 * (s - x)).tan() * (0.5 * (s - y)).tan() * (0.5 * (s - z)).tan();
            4.0 * product.max(0.0).sqrt().atan() * a.dot(&b.cross(&c)).signum()
        })
        .sum();
    sum / (4.0 * std::f64::consts::PI)
}

/// Returns how often a ray from `p` leaves the surface more than it enters.
fn winding_by_ray(mesh: &TriMesh, p: &Vec3, along: &Vec3) -> i32 {
    (0..mesh.triangles.len())
        .map(|t| {
            let [a, b, c] = mesh.corners(t).map(|x| x - p);
            let s = [a.cross(&b), b.cross(&c), c.cross(&a)].map(|n| n.dot(along));
            let through = s.iter().all(|x| *x > 0.0) || s.iter().all(|x| *x < 0.0);
            let n = (b - a).cross(&(c - a));
            if through && a.dot(&n) * n.dot(along) > 0.0 { n.dot(along).signum() as i32 } else { 0 }
        })
        .sum()
}

#[test]
fn winding_number_is_the_sum_of_solid_angles_and_counts_what_a_ray_counts() {
    let mut rng = Rng::new(41);
    let names = [
        "bunny",
        "spot",
        "cow",
        "fandisk",
        "fertility",
        "torus",
        "wingnut",
        "hand",
        "panda_link5",
        "fetch_gripper",
        "armadillo",
    ];
    for name in names {
        let Some(obj) = text(&format!("{name}.obj")) else { return };
        let mesh = TriMesh::from_obj(&obj).unwrap();
        let winding = WindingNumber::new(&mesh);
        let bounds = mesh.aabb();
        for n in 0..1000 {
            let p =
                bounds.min + (bounds.max - bounds.min).component_mul(&Vec3::from_fn(|_, _| rng.between(-0.05, 1.05)));
            let ray = winding_by_ray(&mesh, &p, &rng.direction());
            near(winding.at(&p), f64::from(ray), 0.1, name);
            if n < 20 {
                near(winding.exact(&p), winding_by_excess(&mesh, &p), 1e-6, name);
            }
        }
    }
}

#[test]
fn an_open_surface_has_the_share_of_directions_it_covers() {
    // the top of a cube seen from the cube's center is a sixth of the sphere
    let mut lid = TriMesh::cuboid(Vec3::repeat(2.0));
    let up = |m: &TriMesh, t: usize| m.corners(t).iter().all(|p| p.z == 1.0);
    let kept: Vec<[u32; 3]> = (0..12).filter(|&t| up(&lid, t)).map(|t| lid.triangles[t]).collect();
    lid.triangles = kept;
    near(WindingNumber::new(&lid).exact(&Vec3::zeros()), 1.0 / 6.0, 1e-12, "lid");
}

/// Two boxes that overlap in a corner: their union has a closed form in volume, moments and
/// distance.
#[test]
fn overlapping_boxes_are_their_union_in_mass_and_distance() {
    let (half, shift) = (Vec3::new(1.0, 1.0, 1.0), Vec3::new(0.7, 0.9, 1.1));
    let turn = Quat::from_scaled_axis(Vec3::new(0.3, -0.5, 0.8)).to_rotation_matrix();
    let mut mesh = both(&TriMesh::cuboid(2.0 * half), &TriMesh::cuboid(2.0 * half).translated(&shift));
    mesh.vertices.iter_mut().for_each(|v| *v = turn * *v);
    let report = mesh.check_closed().unwrap();
    let overlap = (2.0 - shift.x) * (2.0 - shift.y) * (2.0 - shift.z);
    near(report.volume, 16.0 - overlap, 1e-9, "volume");
    assert!(report.crossing_faces > 0 && report.doubtful == 0.0 && report.shells == 2, "{report:?}");
    let mass = mesh.union_mass_properties(1.0);
    // by symmetry the center is in the middle of the two
    near((mass.center_of_mass - turn * (0.5 * shift)).norm(), 0.0, 1e-9, "center");
    let block = |half: Vec3, at: Vec3| {
        let mass = 8.0 * half.product();
        let own = Mat3::from_diagonal(&Vec3::new(
            half.y * half.y + half.z * half.z,
            half.z * half.z + half.x * half.x,
            half.x * half.x + half.y * half.y,
        )) * (mass / 3.0);
        let d = at - 0.5 * shift;
        own + mass * (Mat3::identity() * d.norm_squared() - d * d.transpose())
    };
    let both_inertia = block(half, Vec3::zeros()) + block(half, shift) - block(half - 0.5 * shift, 0.5 * shift);
    let expected = turn.matrix() * both_inertia * turn.matrix().transpose();
    near((mass.inertia - expected).norm(), 0.0, 1e-8, "inertia");
    // distance: outside the smaller of the two; inside, the distance to the remaining parts of the
    // faces, sampled
    let distance = MeshDistance::new(&mesh);
    let box_distance = |p: &Vec3| {
        let q = p.abs() - half;
        q.map(|x| x.max(0.0)).norm() + q.max().min(0.0)
    };
    let mut rng = Rng::new(5);
    let mut inside = 0;
    for _ in 0..4000 {
        let p = rng.vec(2.2) + 0.5 * shift;
        let (a, b) = (box_distance(&p), box_distance(&(p - shift)));
        let found = distance.closest(&(turn * p)).signed_distance;
        if a.min(b) > 0.0 {
            near(found, a.min(b), 1e-9, "outside");
        } else {
            inside += 1;
            let depth = depth_in_union(&p, &half, &shift);
            near(found, -depth, 1e-9, "inside");
        }
    }
    assert!(inside > 500);
}

/// Returns the depth of a point in the union of a box about the origin and one about `shift`: the
/// distance to the closest point over each face, clipped to the outside of the other box, over the
/// remaining rectangles.
fn depth_in_union(p: &Vec3, half: &Vec3, shift: &Vec3) -> f64 {
    let mut least = f64::INFINITY;
    for (own, other) in [(Vec3::zeros(), *shift), (*shift, Vec3::zeros())] {
        for k in 0..3 {
            for sign in [-1.0, 1.0] {
                let height = own[k] + sign * half[k];
                let (u, v) = ((k + 1) % 3, (k + 2) % 3);
                let range = |c: &Vec3, k: usize| [c[k] - half[k], c[k] + half[k]];
                let cut = (height - other[k]).abs() < half[k];
                let [u0, u1] = range(&own, u);
                let [v0, v1] = range(&own, v);
                let [a0, a1] = range(&other, u).map(|x| x.clamp(u0, u1));
                let [b0, b1] = range(&other, v).map(|x| x.clamp(v0, v1));
                let rectangles = if cut {
                    vec![[u0, a0, v0, v1], [a1, u1, v0, v1], [u0, u1, v0, b0], [u0, u1, b1, v1]]
                } else {
                    vec![[u0, u1, v0, v1]]
                };
                for [x0, x1, y0, y1] in rectangles.into_iter().filter(|r| r[0] < r[1] && r[2] < r[3]) {
                    let d = Vec3::new(p[k] - height, p[u] - p[u].clamp(x0, x1), p[v] - p[v].clamp(y0, y1));
                    least = least.min(d.norm());
                }
            }
        }
    }
    least
}

/// Coplanar faces that overlap, with equal or opposite normals.
#[test]
fn boxes_with_faces_on_each_other_count_once() {
    let unit = TriMesh::cuboid(Vec3::repeat(1.0));
    for (shift, volume) in [
        (Vec3::new(0.25, 0.25, 0.0), 2.0 - 0.75 * 0.75),
        (Vec3::new(1.0, 0.0, 0.0), 2.0),
        (Vec3::new(1.0, 0.25, 0.5), 2.0),
        (Vec3::new(0.5, 0.0, 0.0), 1.5),
        (Vec3::new(0.0, 0.25, 0.0), 1.25),
    ] {
        let mut mesh = both(&unit, &unit.clone().translated(&shift));
        let report = mesh.check_closed().unwrap();
        near(report.volume, volume, 1e-9, &format!("{shift:?}"));
        assert_eq!(report.doubtful, 0.0);
        let distance = MeshDistance::new(&mesh);
        let mut rng = Rng::new(17);
        for _ in 0..1000 {
            let p = rng.vec(1.6);
            let inside = |c: Vec3| (p - c).amax() - 0.5;
            let expected = inside(Vec3::zeros()).min(inside(shift));
            assert_eq!(distance.closest(&p).signed_distance < 0.0, expected < 0.0, "{p:?} {shift:?}");
        }
    }
}

/// An arrowhead whose bottom is triangulated over the notch, so that it is folded: the fold is not
/// boundary. With a box on the fold three faces coincide, and together count once.
#[test]
fn folded_face_counts_what_it_bounds() {
    let outline = [[2.0, 0.0], [-1.0, 1.0], [0.0, 0.0], [-1.0, -1.0]];
    let vertices = [0.0, 1.0].iter().flat_map(|&z| outline.map(|[x, y]| Vec3::new(x, y, z))).collect();
    let mut triangles: Vec<[u32; 3]> = vec![[6, 4, 5], [6, 7, 4], [1, 3, 2], [1, 0, 3]];
    triangles.extend((0..4).flat_map(|k| [[k, (k + 1) % 4, k + 4], [(k + 1) % 4, (k + 1) % 4 + 4, k + 4]]));
    let arrow = TriMesh { vertices, triangles };
    let report = arrow.clone().check_closed().unwrap();
    near(report.volume, 2.0, 1e-12, "arrow");
    assert!(report.crossing_faces > 0 && report.doubtful == 0.0, "{report:?}");
    let block = TriMesh::cuboid(Vec3::new(1.25, 1.0, 1.0)).translated(&Vec3::new(-0.875, 0.0, 0.5));
    // the arrow has two triangles of 1/32 m² of the box's 1.25 m²
    let mut joined = both(&arrow, &block);
    near(joined.check_closed().unwrap().volume, 2.0 + 1.25 - 0.0625, 1e-12, "with a box");
    let distance = MeshDistance::new(&joined);
    let mut rng = Rng::new(8);
    let winding = WindingNumber::new(&joined);
    for _ in 0..2000 {
        let p = rng.vec(1.5);
        assert_eq!(
            distance.closest(&p).signed_distance < 0.0,
            winding_by_ray(&joined, &p, &rng.direction()) >= 1,
            "{p:?} {}",
            winding.exact(&p)
        );
    }
}

/// A sphere within a sphere: a cavity if it is wound inwards, nothing if outwards.
#[test]
fn shell_in_a_shell_is_a_cavity_or_buried_by_its_winding() {
    let (outer, inner) = (TriMesh::icosphere(1.0, 3), TriMesh::icosphere(0.5, 3).translated(&Vec3::new(0.2, 0.0, 0.0)));
    let (big, small) = (outer.mass_properties(1.0), inner.mass_properties(1.0));
    let mut hollow = both(&outer, &inside_out(inner.clone()));
    let report = hollow.check_closed().unwrap();
    near(report.volume, big.mass - small.mass, 1e-12, "hollow");
    assert_eq!((report.turned, report.inverted_shells, report.shells, report.crossing_faces), (false, 0, 2, 0));
    let distance = MeshDistance::new(&hollow);
    let shape = Shape::mesh(hollow, &TreeSettings { depth: 3, ..TreeSettings::octree() }).unwrap();
    let mass = shape.mass_properties(1.0).unwrap();
    near(mass.mass, big.mass - small.mass, 1e-12, "mass");
    // parallel axes about the common center
    let at = -small.mass * 0.2 / mass.mass;
    let about = |m: &tumble_collide::MassProperties| m.inertia_about(&Vec3::new(at, 0.0, 0.0));
    near((mass.inertia - (about(&big) - about(&small))).norm(), 0.0, 1e-12, "inertia");
    for (x, expected) in [(0.2, 0.5), (0.9, -0.1), (-0.9, -0.1), (1.5, 0.5), (-0.65, -0.35)] {
        near(distance.closest(&Vec3::new(x, 0.0, 0.0)).signed_distance, expected, 0.02, &format!("at x = {x}"));
    }
    let mut full = both(&outer, &inner);
    near(full.check_closed().unwrap().volume, big.mass, 1e-12, "buried");
    near(MeshDistance::new(&full).closest(&Vec3::new(0.2, 0.0, 0.0)).signed_distance, -0.8, 0.02, "buried");
}

/// Shells that are inside out are reversed, with their contents; cavities stay.
#[test]
fn shells_are_reversed_by_their_position() {
    let (outer, inner) = (TriMesh::icosphere(1.0, 2), TriMesh::icosphere(0.5, 2));
    let (big, small) = (outer.signed_volume(), inner.signed_volume());
    let hollow = both(&outer, &inside_out(inner));
    let away = |mesh: &TriMesh, x: f64| mesh.clone().translated(&Vec3::new(x, 0.0, 0.0));
    let cases = [
        ("inside out", inside_out(hollow.clone()), big - small, (true, 0)),
        ("one of two", both(&outer, &inside_out(away(&outer, 3.0))), 2.0 * big, (false, 1)),
        (
            "hollow, inside out, among two good ones",
            both(&both(&outer, &away(&outer, 3.0)), &inside_out(away(&hollow, 6.0))),
            3.0 * big - small,
            (false, 2),
        ),
        ("overlapping", both(&both(&outer, &away(&outer, 9.0)), &inside_out(away(&outer, 7.9))), f64::NAN, (false, 1)),
    ];
    for (name, mut mesh, volume, expected) in cases {
        let report = mesh.check_closed().unwrap();
        assert_eq!((report.turned, report.inverted_shells), expected, "{name}");
        if volume.is_finite() {
            near(report.volume, volume, 1e-12, name);
        }
    }
}

/// Public meshes that cross themselves: the sign is that of the winding number everywhere, and
/// outside the distance is that to the nearest triangle.
#[test]
fn crossing_public_meshes_have_the_sign_of_their_union() {
    let mut rng = Rng::new(77);
    for name in ["cow", "bad/self_intersecting", "fandisk", "wingnut", "fetch_gripper", "bad/nonmanifold_edge"] {
        let Some(obj) = text(&format!("{name}.obj")) else { return };
        let mut mesh = TriMesh::from_obj(&obj).unwrap();
        let raw = mesh.signed_volume();
        let report = mesh.check_closed().unwrap();
        eprintln!(
            "{name}: {} crossing faces, {:.9} m³ of {raw:.9}, {:?}",
            report.crossing_faces,
            report.volume,
            report.notes()
        );
        assert_eq!(report.doubtful, 0.0, "{name}");
        let distance = MeshDistance::new(&mesh);
        let winding = WindingNumber::new(&mesh);
        let bounds = mesh.aabb();
        let size = 1e-2 * mesh.diagonal();
        for n in 0..1000 {
            // half of them close to the surface
            let p = if n % 2 == 0 {
                bounds.min + (bounds.max - bounds.min).component_mul(&Vec3::from_fn(|_, _| rng.unit()))
            } else {
                let [a, b, c] = mesh.corners(rng.below(mesh.triangles.len()));
                (a + b + c) / 3.0 + rng.vec(size)
            };
            let found = distance.closest(&p);
            let inside = winding_by_ray(&mesh, &p, &rng.direction()) >= 1;
            assert_eq!(found.signed_distance < 0.0, inside, "{name}: {p:?} {found:?} {}", winding.exact(&p));
            near((found.point - p).norm(), found.signed_distance.abs(), 1e-12 * size.max(1.0), name);
        }
    }
}

/// The side of a point in a soup that crosses itself is that of the sum of all solid angles, also of points that lie above vertices and edges
/// along the axes of the rays that decide it.
#[test]
fn rays_and_solid_angles_agree_on_what_a_soup_contains() {
    let mut rng = Rng::new(77);
    let (mut inside, mut above) = (0, 0);
    for _ in 0..3 {
        let vertices: Vec<Vec3> =
            (0..90).map(|_| Vec3::from(std::array::from_fn(|_| rng.between(-1.0, 1.0)))).collect();
        let triangles = (0..30).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        let solid = TriMesh { vertices, triangles }.thickened(Some(0.1), false).unwrap();
        let winding = WindingNumber::new(&solid);
        for n in 0..3000 {
            let mut p = Vec3::from(std::array::from_fn(|_| rng.between(-1.0, 1.0)));
            // on the lines through a vertex along one axis, two of them, or all
            let corner = solid.vertices[n % solid.vertices.len()];
            match n % 4 {
                1 => p = Vec3::new(p.x, corner.y, corner.z),
                2 => p = Vec3::new(corner.x, corner.y, p.z),
                3 => p.x = corner.x,
                _ => {}
            }
            let sum = winding.exact(&p);
            if (sum - sum.round()).abs() < 1e-6 {
                assert_eq!(winding.contains(&p), sum > 0.5, "{p:?}: {sum}");
                inside += usize::from(sum > 0.5);
                above += usize::from(n % 4 != 0);
            }
        }
    }
    assert!(inside > 300 && above > 5000, "{inside} {above}");
}

//! The minimum distance of two triangle surfaces by brute force, with the closest features. Shares
//! no code with the crate or with parry.
//!
//! Two separated triangles are closest at a vertex of one and a point inside the other, at points
//! inside an edge of each, or at the boundaries of these. So every pair of features whose closest
//! points lie inside them is a candidate.

use tumble_collide::{MeshDistance, Pose, TriMesh, Vec3};

/// The kind of the closest features.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// A vertex and the inside of a face: the normal is that of the flat face.
    Face,
    /// The insides of two edges.
    Edges,
    /// A vertex and the inside of an edge, or two vertices.
    Corner,
}

/// A pair of features, with the vector from the point on B to the point on A.
#[derive(Clone, Copy, Debug)]
pub struct Closest {
    pub distance: f64,
    pub normal: Vec3,
    pub kind: Kind,
}

/// Returns all candidates that are at most `more` further apart than the closest one, closest
/// first. `distance` is that of B.
pub fn closest(a: &TriMesh, pa: &Pose, b: &TriMesh, pb: &Pose, distance: &MeshDistance, more: f64) -> Vec<Closest> {
    let to = pb.inv_mul(pa);
    let near_of_b: Vec<[Vec3; 3]> = (0..b.triangles.len()).map(|t| b.corners(t)).collect();
    let placed: Vec<[Vec3; 3]> =
        (0..a.triangles.len()).map(|t| a.corners(t).map(|p| (to * nalgebra::Point3::from(p)).coords)).collect();
    let middle = |t: &[Vec3; 3]| (t[0] + t[1] + t[2]) / 3.0;
    let radius = |t: &[Vec3; 3]| t.iter().map(|p| (p - middle(t)).norm()).fold(0.0, f64::max);
    // no vertex of A is closer than the surfaces
    let vertices =
        placed.iter().flatten().map(|p| distance.closest(p).signed_distance.abs()).fold(f64::INFINITY, f64::min);
    let mut all = Vec::new();
    for t in placed.iter().filter(|t| distance.closest(&middle(t)).signed_distance.abs() - radius(t) <= vertices + more)
    {
        for u in near_of_b.iter().filter(|u| (middle(t) - middle(u)).norm() - radius(t) - radius(u) <= vertices + more)
        {
            pairs(t, u, &mut all);
        }
    }
    all.sort_by(|x, y| x.distance.total_cmp(&y.distance).then(x.kind.cmp(&y.kind)));
    let least = all.first().map_or(f64::INFINITY, |c| c.distance);
    all.retain(|c| c.distance <= least + more);
    all.iter_mut().for_each(|c| c.normal = pb.rotation * c.normal);
    all
}

fn pairs(t: &[Vec3; 3], u: &[Vec3; 3], all: &mut Vec<Closest>) {
    let mut found = |from_b: Vec3, to_a: Vec3, kind| {
        let way = to_a - from_b;
        all.push(Closest { distance: way.norm(), normal: way.normalize(), kind });
    };
    for (p, q) in t.iter().flat_map(|p| u.iter().map(move |q| (p, q))) {
        found(*q, *p, Kind::Corner);
    }
    for n in 0..3 {
        if let Some(foot) = inside_face(&t[n], u) {
            found(foot, t[n], Kind::Face);
        }
        if let Some(foot) = inside_face(&u[n], t) {
            found(u[n], foot, Kind::Face);
        }
        for k in 0..3 {
            if let Some(foot) = inside_edge(&t[n], &u[k], &u[(k + 1) % 3]) {
                found(foot, t[n], Kind::Corner);
            }
            if let Some(foot) = inside_edge(&u[n], &t[k], &t[(k + 1) % 3]) {
                found(u[n], foot, Kind::Corner);
            }
            if let Some([x, y]) = inside_edges([&t[n], &t[(n + 1) % 3]], [&u[k], &u[(k + 1) % 3]]) {
                found(y, x, Kind::Edges);
            }
        }
    }
}

/// Returns the projection of `p` on a triangle's plane, if it is inside.
fn inside_face(p: &Vec3, [a, b, c]: &[Vec3; 3]) -> Option<Vec3> {
    let normal = (b - a).cross(&(c - a)).normalize();
    let foot = p - normal * normal.dot(&(p - a));
    let inside = |u: &Vec3, v: &Vec3| (v - u).cross(&(foot - u)).dot(&normal) > 0.0;
    (inside(a, b) && inside(b, c) && inside(c, a)).then_some(foot)
}

fn inside_edge(p: &Vec3, a: &Vec3, b: &Vec3) -> Option<Vec3> {
    let s = (p - a).dot(&(b - a)) / (b - a).norm_squared();
    (s > 0.0 && s < 1.0).then(|| a + (b - a) * s)
}

/// Returns the closest points of two lines, if they are inside both edges.
fn inside_edges([a, b]: [&Vec3; 2], [c, d]: [&Vec3; 2]) -> Option<[Vec3; 2]> {
    let (u, v, w) = (b - a, d - c, a - c);
    // u·(w + s u − r v) = 0 = v·(w + s u − r v)
    let (uu, uv, vv, uw, vw) = (u.dot(&u), u.dot(&v), v.dot(&v), u.dot(&w), v.dot(&w));
    let across = uu * vv - uv * uv;
    let (s, r) = ((uv * vw - vv * uw) / across, (uu * vw - uv * uw) / across);
    let inside = |x: f64| x > 0.0 && x < 1.0;
    (inside(s) && inside(r)).then(|| [a + u * s, c + v * r])
}

#[test]
fn the_reference_is_right_for_cubes() {
    let cube = TriMesh::cuboid(Vec3::repeat(1.0));
    let distance = MeshDistance::new(&cube);
    let find_contacts = |pose: &Pose| closest(&cube, pose, &cube, &Pose::identity(), &distance, 0.0)[0];
    // an edge across an edge: each is √½ from its center
    let turn = |axis: Vec3, angle: f64| tumble_collide::Quat::from_scaled_axis(axis * angle);
    let way = Vec3::new(0.0, 0.5_f64.sqrt(), 0.5_f64.sqrt());
    // the upper cube's lowest edge, across the lower one's edge along x
    let across = nalgebra::Rotation3::from_axis_angle(&nalgebra::Unit::new_normalize(way), 0.7);
    let upper = tumble_collide::Quat::from_rotation_matrix(&across);
    let found = find_contacts(&Pose::from_parts((way * (2.0_f64.sqrt() + 0.1)).into(), upper));
    assert!(
        (found.distance - 0.1).abs() < 1e-12 && found.kind == Kind::Edges && (found.normal - way).norm() < 1e-9,
        "{found:?}"
    );
    // a corner down on a face
    let corner = turn(Vec3::new(1.0, -1.0, 0.0).normalize(), (1.0 / 3.0_f64.sqrt()).acos());
    let found = find_contacts(&Pose::from_parts(Vec3::new(0.1, 0.07, 0.5 + 0.75_f64.sqrt() + 0.1).into(), corner));
    assert!(
        (found.distance - 0.1).abs() < 1e-12 && found.kind == Kind::Face && (found.normal - Vec3::z()).norm() < 1e-9,
        "{found:?}"
    );
}

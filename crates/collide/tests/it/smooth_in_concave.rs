//! Ellipsoids and cylinders whose center is inside a body that is not convex: the contact takes them out, in
//! about the least translation.

use crate::deep_overlaps::{least_translation, mesh, shapes, slow};
use crate::rng::Rng;
use tumble_collide::{Contact, Pose, Shape, TriMesh, Vec3, closest_points, contacts};

const MARGIN: f64 = 0.01;

/// Hills of 0.3 m on a field of 4 m by 4 m.
fn hills() -> Shape {
    let heights: Vec<f64> =
        (0..400).map(|n| 0.3 * (0.9 * f64::from(n % 20)).sin() * (0.7 * f64::from(n / 20)).cos()).collect();
    mesh(&TriMesh::height_field(&heights, 20, [4.0, 4.0], Some(1.5)).unwrap())
}

/// A ball of 0.3 m from a grid of distances.
fn ball() -> Shape {
    let count = 21;
    let at = |k: usize| k as f64 / (count - 1) as f64 - 0.5;
    let values: Vec<f64> = (0..count * count * count)
        .map(|n| Vec3::new(at(n % count), at(n / count % count), at(n / count / count)).norm() - 0.3)
        .collect();
    let grid = TriMesh::isosurface_within(&values, [count; 3], Vec3::repeat(-0.5), Vec3::repeat(0.5)).unwrap();
    mesh(&grid)
}

fn smooth_shapes() -> Vec<(&'static str, Shape)> {
    let mut found: Vec<_> = shapes()
        .into_iter()
        .filter(|s| ["cylinder", "disc", "rod", "ellipsoid", "lens", "rounded cylinder"].contains(&s.0))
        .collect();
    found.push(("small ellipsoid", Shape::ellipsoid(Vec3::new(0.2, 0.2, 0.3)).unwrap()));
    found.push(("small cylinder", Shape::cylinder(0.1, 0.3).unwrap()));
    found
}

fn concave_meshes() -> Vec<(&'static str, Shape)> {
    let mut found: Vec<_> =
        shapes().into_iter().filter(|s| ["torus mesh", "angle mesh", "spool mesh"].contains(&s.0)).collect();
    found.extend([("hills", hills()), ("ball of a grid", ball())]);
    found
}

/// Points on the surface of a smooth shape, in its own frame.
fn surface_points(shape: &Shape, rng: &mut Rng) -> Vec<Vec3> {
    let on_cylinder = |radius: f64, half: f64, rng: &mut Rng| {
        let (phi, z) = (rng.between(0.0, std::f64::consts::TAU), rng.between(-1.0, 1.0) * half);
        let (r, z) = match rng.below(3) {
            0 => (radius * rng.unit().sqrt(), half.copysign(z)),
            1 => (radius, half.copysign(z)),
            _ => (radius, z),
        };
        Vec3::new(r * phi.cos(), r * phi.sin(), z)
    };
    (0..300)
        .map(|_| match shape {
            Shape::Ellipsoid { half_axes } => rng.direction().component_mul(half_axes),
            Shape::Cylinder(c) => on_cylinder(c.radius(), c.half_length(), rng),
            Shape::RoundedCylinder { core, rounding } => {
                let n = rng.direction();
                let corner = Vec3::new(n.x, n.y, 0.0).normalize() * core.radius();
                corner + Vec3::z() * core.half_length().copysign(n.z) + n * *rounding
            }
            _ => unreachable!(),
        })
        .collect()
}

/// A smooth body and a mesh, by points of both surfaces.
struct Pair<'a> {
    smooth: &'a Shape,
    at: Pose,
    points: &'a [Vec3],
    solid: &'a Shape,
    below: Pose,
}

impl Pair<'_> {
    /// Returns whether a point of one is more than `slack` inside the other after the smooth body is moved.
    fn overlaps_after(&self, shift: &Vec3, slack: f64) -> bool {
        let moved = Pose::from_parts((self.at.translation.vector + shift).into(), self.at.rotation);
        let depth = |shape: &Shape, pose: &Pose, p: &Vec3| -shape.closest_point(pose, p).distance;
        let Shape::Mesh(mesh) = self.solid else { unreachable!() };
        let reach = self.smooth.bounding_radius();
        self.points.iter().any(|p| depth(self.solid, &self.below, &(moved * nalgebra::Point3::from(*p)).coords) > slack)
            || mesh.mesh().vertices.iter().any(|v| {
                let v = (self.below * nalgebra::Point3::from(*v)).coords;
                (v - moved.translation.vector).norm() < reach && depth(self.smooth, &moved, &v) > slack
            })
    }
}

/// Returns a pose of the smooth shape with its center inside the solid, which is at the other pose.
fn pose_inside(rng: &mut Rng, solid: &Shape) -> [Pose; 2] {
    loop {
        let below = rng.pose(1.0);
        let (turn, off) = (rng.pose(1.0).rotation, rng.direction() * rng.unit() * solid.bounding_radius());
        let at = Pose::from_parts((below.translation.vector + off).into(), turn);
        if solid.closest_point(&below, &at.translation.vector).distance < -1e-3 {
            return [at, below];
        }
    }
}

fn deepest(found: &[Contact]) -> Option<&Contact> {
    found.iter().min_by(|x, y| x.gap.total_cmp(&y.gap))
}

#[test]
fn the_contact_takes_a_smooth_body_out_of_a_concave_mesh_full_length() {
    let (mut rng, mut wrong, mut count, mut longer) = (Rng::new(5), Vec::new(), 0, 0);
    let each = if slow() { 400 } else { 12 };
    for (smooth_name, smooth) in &smooth_shapes() {
        let points = surface_points(smooth, &mut rng);
        for (solid_name, solid) in &concave_meshes() {
            let size = smooth.bounding_radius().min(solid.bounding_radius());
            for n in 0..each {
                let [at, below] = pose_inside(&mut rng, solid);
                let pair = Pair { smooth, at, points: &points, solid, below };
                let mut found = Vec::new();
                // in both orders
                match n % 2 {
                    0 => contacts(smooth, &at, solid, &below, MARGIN, &mut found),
                    _ => contacts(solid, &below, smooth, &at, MARGIN, &mut found),
                }
                count += 1;
                let Some(deepest) = deepest(&found) else {
                    wrong.push(format!("{smooth_name} in {solid_name}: no contact: {at:?}, {below:?}"));
                    continue;
                };
                let normal = if n % 2 == 0 { deepest.normal } else { -deepest.normal };
                if pair.overlaps_after(&(-deepest.gap * normal), 2e-3 * size) {
                    wrong.push(format!("{smooth_name} in {solid_name}: still inside: {deepest:?}, {at:?}, {below:?}"));
                }
                let is_longer = (0..100).any(|_| !pair.overlaps_after(&(rng.direction() * (-0.8 * deepest.gap)), 0.0));
                longer += usize::from(is_longer);
            }
        }
    }
    println!("{count} overlaps, {} wrong, {longer} translations longer than the least by a quarter", wrong.len());
    assert!(wrong.is_empty(), "{} of {count}:\n{}", wrong.len(), wrong[..wrong.len().min(12)].join("\n"));
    assert!(longer * 20 < count, "{longer} of {count}");
}

/// A ball of cells of 0.05 m is no more than 1 mm from a sphere, of which the least translation has a formula.
#[test]
fn an_ellipsoid_in_the_ball_of_a_grid_is_as_deep_as_in_a_sphere() {
    let (solid, sphere) = (ball(), Shape::sphere(0.3).unwrap());
    let mut rng = Rng::new(8);
    for half_axes in [Vec3::new(0.1, 0.1, 0.15), Vec3::new(0.2, 0.05, 0.1), Vec3::repeat(0.1)] {
        let smooth = Shape::ellipsoid(2.0 * half_axes).unwrap();
        for _ in 0..20 {
            let [at, below] = pose_inside(&mut rng, &solid);
            let least = least_translation(&smooth, &at, &sphere, &below);
            let mut found = Vec::new();
            contacts(&smooth, &at, &solid, &below, MARGIN, &mut found);
            let depth = deepest(&found).map_or(0.0, |c| -c.gap);
            assert!((depth - least).abs() < 2e-3 + 0.01 * least, "{depth} {least}: {at:?}, {below:?}");
        }
    }
}

/// Two surfaces that cross have common points, at distance 0: such points are no touch of bodies that are apart.
#[test]
fn closest_points_of_a_body_through_a_mesh_are_deep() {
    let mut rng = Rng::new(9);
    for (smooth_name, smooth) in &smooth_shapes() {
        for (solid_name, solid) in &concave_meshes() {
            for _ in 0..8 {
                let [at, below] = pose_inside(&mut rng, solid);
                let pair = closest_points(smooth, &at, solid, &below).unwrap();
                assert!(pair.distance < 0.0, "{smooth_name} in {solid_name}: {pair:?}, {at:?}, {below:?}");
            }
        }
    }
}

#[test]
fn a_smooth_body_with_its_center_outside_has_a_contact_where_it_overlaps() {
    let (mut rng, mut count) = (Rng::new(11), 0);
    for (smooth_name, smooth) in &smooth_shapes() {
        let points = surface_points(smooth, &mut rng);
        for (solid_name, solid) in &concave_meshes() {
            let [radius, reach] = [smooth.bounding_radius(), solid.bounding_radius()];
            for _ in 0..if slow() { 1000 } else { 100 } {
                let below = rng.pose(1.0);
                let off = rng.direction() * (rng.unit() * (radius + reach));
                let at = Pose::from_parts((below.translation.vector + off).into(), rng.pose(1.0).rotation);
                let pair = Pair { smooth, at, points: &points, solid, below };
                let is_inside = solid.closest_point(&below, &at.translation.vector).distance < 0.0;
                if is_inside || !pair.overlaps_after(&Vec3::zeros(), 0.02 * radius.min(reach)) {
                    continue;
                }
                let mut found = Vec::new();
                contacts(smooth, &at, solid, &below, 0.0, &mut found);
                count += 1;
                let is_deep = deepest(&found).is_some_and(|c| c.gap < 0.0);
                assert!(is_deep, "{smooth_name} in {solid_name}: {found:?}, {at:?}, {below:?}");
            }
        }
    }
    println!("{count} overlaps");
}

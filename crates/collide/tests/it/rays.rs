//! Rays against shapes: closed forms, and every shape against parry.

use crate::rng::Rng;
use parry3d_f64::math::{Pose as ParryPose, Vector};
use parry3d_f64::query::{Ray, RayCast};
use parry3d_f64::shape::{Ball, Capsule, Cuboid, Cylinder};
use tumble_collide::{Pose, Shape, TreeSettings, TriMesh, Vec3};

#[test]
fn a_ray_enters_where_geometry_says() {
    let at = Pose::translation(0.0, 0.0, 2.0);
    let down = Vec3::new(0.0, 0.0, -3.0);
    let sphere = Shape::sphere(0.5).unwrap();
    assert_eq!(
        sphere.ray(&at, &Vec3::new(0.0, 0.0, 10.0), &down),
        Some(7.5),
        "10 - 2 - 0.5, whatever the length of the direction"
    );
    assert_eq!(sphere.ray(&at, &Vec3::new(0.0, 0.0, 2.1), &down), None, "from inside");
    assert_eq!(sphere.ray(&at, &Vec3::new(0.0, 0.0, 1.0), &down), None, "behind");
    assert_eq!(sphere.ray(&at, &Vec3::new(0.6, 0.0, 10.0), &down), None, "beside");
    let floor = Shape::half_space();
    let slanted = Vec3::new(3.0, 0.0, -4.0);
    assert!(
        (floor.ray(&at, &Vec3::new(0.0, 0.0, 6.0), &slanted).unwrap() - 5.0).abs() < 1e-15,
        "a right triangle of 3, 4 and 5"
    );
    assert_eq!(floor.ray(&at, &Vec3::new(0.0, 0.0, 1.0), &slanted), None, "from below");
    assert_eq!(floor.ray(&at, &Vec3::new(0.0, 0.0, 6.0), &Vec3::zeros()), None, "no direction");
}

#[test]
fn rays_agree_with_parry() {
    let mut rng = Rng::new(5);
    let half = Vec3::new(0.3, 0.5, 0.7);
    let sharp = TriMesh::cuboid(2.0 * half);
    let cases: [(Shape, Box<dyn RayCast>); 5] = [
        (Shape::sphere(0.6).unwrap(), Box::new(Ball::new(0.6))),
        (Shape::cuboid(2.0 * half).unwrap(), Box::new(Cuboid::new(Vector::new(0.3, 0.5, 0.7)))),
        (
            Shape::capsule(0.3, 1.2).unwrap(),
            Box::new(Capsule::new(Vector::new(0.0, 0.0, -0.6), Vector::new(0.0, 0.0, 0.6), 0.3)),
        ),
        // parry's stands on y
        (Shape::cylinder(0.4, 1.0).unwrap(), Box::new(Cylinder::new(0.5, 0.4))),
        (Shape::mesh(sharp, &TreeSettings::octree()).unwrap(), Box::new(Cuboid::new(Vector::new(0.3, 0.5, 0.7)))),
    ];
    for (index, (shape, theirs)) in cases.iter().enumerate() {
        let mut met = 0;
        for _ in 0..2000 {
            let mut vector =
                |size: f64| Vec3::new(rng.between(-size, size), rng.between(-size, size), rng.between(-size, size));
            let (origin, aim) = (vector(3.0), vector(0.8));
            if origin.norm() < 1.0 {
                continue;
            }
            let direction = (aim - origin).normalize();
            let turned = |v: Vec3| if index == 3 { Vector::new(v.x, v.z, -v.y) } else { Vector::new(v.x, v.y, v.z) };
            let wanted =
                theirs.cast_ray(&ParryPose::IDENTITY, &Ray::new(turned(origin), turned(direction)), f64::MAX, true);
            let found = shape.ray(&Pose::identity(), &origin, &direction);
            met += usize::from(found.is_some());
            match (found, wanted) {
                // its cylinders are iterated
                (Some(a), Some(b)) => {
                    assert!((a - b).abs() < if index == 3 { 1e-6 } else { 1e-9 }, "shape {index}: {a} here, {b} there")
                }
                (None, None) => {}
                other => panic!("shape {index} from {origin:?} along {direction:?}: {other:?}"),
            }
        }
        assert!(met > 200, "shape {index} was met {met} times");
    }
}

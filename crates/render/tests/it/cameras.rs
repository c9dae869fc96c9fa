//! Projections against hand-computed numbers.

use nalgebra::{Matrix4, Point3, Vector3};
use tumble_render::{Camera, RenderError};

#[test]
fn pinhole_projects_by_similar_triangles() {
    let camera = Camera::LookAt {
        eye: Point3::new(0.0, -10.0, 0.0),
        target: Point3::origin(),
        up: Vector3::z(),
        vertical_fov_rad: 2.0 * 0.5f32.atan(), // at 10 m the half height of the view is 5 m
        near_m: 1.0,
        far_m: 100.0,
    };
    // 1 m right and 2 m up, at 10 m: 200 pixels per 5 m
    let [x, y, depth] = camera.project(Point3::new(1.0, 0.0, 2.0), 800, 400).expect("in front");
    assert!((x - 440.0).abs() < 1e-3 && (y - 120.0).abs() < 1e-3, "{x} {y}");
    // depth = far (s - near) / (s (far - near))
    assert!((depth - 100.0 * 9.0 / (10.0 * 99.0)).abs() < 1e-5, "{depth}");
    assert!(camera.project(Point3::new(0.0, -11.0, 0.0), 800, 400).is_none(), "behind the eye");
}

#[test]
fn bad_cameras_are_refused_by_name() {
    let good = Camera::look_at(Point3::new(1.0, 0.0, 0.0), Point3::origin());
    assert!(good.matrices(1.0).is_ok());
    let field = |camera: Camera| match camera.matrices(1.0) {
        Err(RenderError::BadValue { field, .. }) => field,
        other => panic!("expected a refusal, got {other:?}"),
    };
    assert_eq!(field(Camera::look_at(Point3::origin(), Point3::origin())), "target");
    assert_eq!(field(Camera::look_at(Point3::new(0.0, 0.0, 3.0), Point3::origin())), "up");
    assert_eq!(field(good.with_fov(3.5)), "vertical_fov_rad");
    assert_eq!(field(good.with_fov(f32::NAN)), "vertical_fov_rad");
    let scaled = Camera::Raw { view: Matrix4::new_scaling(2.0), projection: Matrix4::identity() };
    assert_eq!(field(scaled), "view");
    let mut skewed = Matrix4::identity();
    skewed[(3, 0)] = 0.5;
    assert_eq!(field(Camera::Raw { view: Matrix4::identity(), projection: skewed }), "projection");
}

#[test]
fn framing_shows_the_whole_ball() {
    let (center, radius) = (Point3::new(1.0, 2.0, 3.0), 2.5);
    for direction in [Vector3::new(1.0, 0.2, -0.3), Vector3::new(0.0, 0.0, -1.0), Vector3::new(-0.4, -1.0, 0.1)] {
        let camera = Camera::framing(center, radius, direction, 1.0);
        for i in 0..200 {
            let (z, a) = (1.0 - (2 * i + 1) as f32 / 200.0, i as f32 * 2.4);
            let r = (1.0 - z * z).sqrt();
            let p = center + radius * Vector3::new(r * a.cos(), r * a.sin(), z);
            let [x, y, depth] = camera.project(p, 500, 500).expect("in front");
            assert!(
                (-1.0..=501.0).contains(&x) && (-1.0..=501.0).contains(&y) && (0.0..=1.0).contains(&depth),
                "{direction:?}: {x} {y} {depth}"
            );
        }
    }
}

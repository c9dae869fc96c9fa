//! An object of another crate carries a camera and a lamp: the draw list looks and is lit from
//! where it flies.

use crate::common::*;
use tumble_core::collide::Vec3;
use tumble_extension::Lookout;
use tumble_render::{Camera, DebugDraw, Drawing, Light};
use tumble_scene::SceneFile;

#[test]
fn pictures_are_taken_from_where_an_object_flies_and_its_lamp_flies_with_it() {
    let mut world = world(STEPPERS[0], false);
    // 2 m/s along y for a second; 40 degrees of picture, 0.5 m above the particle
    world
        .add(Lookout::new("bird", particle(1.0, 0.1, Vec3::new(1.0, 0.0, 3.0), Vec3::new(0.0, 2.0, 0.0)), 0.5))
        .unwrap();
    let steps = (1.0 / DT).round() as usize;
    step(&mut world, steps);
    let scene = SceneFile::parse("", "empty.toml").unwrap();
    let mut list = Drawing::new(&scene).list(&world, &DebugDraw::default()).unwrap();
    list.look_from(&world, "bird").unwrap();
    let Camera::LookAt { eye, target, up, vertical_fov_rad, .. } = list.camera else { panic!("a pinhole") };
    assert!((eye.coords - nalgebra_point([1.0, 2.0, 3.5])).norm() < 1e-5, "{eye}");
    assert!(((target - eye) - nalgebra_point([1.0, 0.0, 0.0])).norm() < 1e-5 && up.z > 0.999);
    assert!((vertical_fov_rad - 0.698_131_7).abs() < 1e-6);
    let lamps: Vec<_> = list
        .lights
        .iter()
        .filter_map(|light| match light {
            Light::Point { position, .. } => Some(position.coords),
            _ => None,
        })
        .collect();
    assert!(lamps.len() == 1 && (lamps[0] - nalgebra_point([1.0, 2.0, 3.5])).norm() < 1e-5, "{lamps:?}");
}

fn nalgebra_point(p: [f32; 3]) -> nalgebra::Vector3<f32> {
    p.into()
}

//! Scenes of light bodies under heavy ones.

use super::scene;
use crate::scene::{Body, Joint, Mode, Scene, Shape};

pub(super) fn all() -> Vec<Scene> {
    let faster = |rate: usize, scene: &Scene| Scene { name: format!("{}-{rate}hz", scene.name), rate, ..scene.clone() };
    let (heavy, light) = (rope(20, false, 72.0), rope(20, false, 0.4));
    let ropes = vec![rope(20, true, 72.0), heavy.clone(), faster(960, &heavy), light.clone(), faster(240, &light)];
    ropes.into_iter().chain([cubes(1e3), cubes(1e6)]).collect()
}

/// Returns a rope of links of 0.1 m and 40 g with a cube of `mass` kg at its end: it hangs at rest, or
/// it is held level and falls.
fn rope(links: usize, hangs: bool, mass: f64) -> Scene {
    let (length, width, load): (f64, f64, f64) = (0.1, 0.02, 0.2);
    let along = |t: f64| if hangs { [0.0, 0.0, -t] } else { [t, 0.0, 0.0] };
    let size = if hangs { [width, width, length] } else { [length, width, width] };
    let support = Body { mode: Mode::Fixed, ..Body::new(Shape::Box([width; 3]), [0.0; 3]) };
    let link = |i: usize| Body::new(Shape::Box(size), along(length * (i as f64 + 0.5)));
    let mut bodies: Vec<Body> = [support].into_iter().chain((0..links).map(link)).collect();
    let end = length * links as f64;
    bodies.push(Body { density: mass / load.powi(3), ..Body::new(Shape::Box([load; 3]), along(end + 0.5 * load)) });
    let half = |i: usize| match i {
        0 => 0.0,
        i if i <= links => 0.5 * length,
        _ => 0.5 * load,
    };
    let joint = |i: usize| Joint { bodies: [i, i + 1], anchors: [along(half(i)), along(-half(i + 1))] };
    let joints = (0..=links).map(joint).collect();
    let name = match hangs {
        true => format!("rope-{links}"),
        false => format!("rope-{links}-swing-{mass}kg"),
    };
    Scene { joints, planes: Vec::new(), measured: [0.0, 10.0], stands: hangs, ..scene(name, bodies) }
}

/// Returns a cube of 1 g under one of `mass` kg, edges of 0.2 m, friction 0.9.
fn cubes(mass: f64) -> Scene {
    let edge: f64 = 0.2;
    let cube = |i: usize, mass: f64| {
        let density = mass / edge.powi(3);
        Body { density, ..Body::new(Shape::Box([edge; 3]), [0.0, 0.0, edge * (i as f64 + 0.5)]) }
    };
    let bodies = vec![cube(0, 1e-3), cube(1, mass)];
    Scene { friction: 0.9, measured: [0.0, 10.0], ..scene(format!("cubes-{:.0e}", mass / 1e-3), bodies) }
}

//! Curved screens and colors of projectors in cave files: points against closed forms, errors.

use nalgebra::{Point3, Vector3};
use std::f64::consts::PI;
use tumble_scene::cave::{Cave, Place};

fn text(screen: &str, facet: &str) -> String {
    format!(
        "[[user]]\nname = \"u\"\neye_m = [0, 0, 1.5]\n[[screen]]\nname = \"s\"\n{screen}\n[[facet]]\nname = \"f\"\nscreen = \"s\"\nsize_px = [800, 400]\n{facet}\n"
    )
}

fn read(screen: &str) -> Cave {
    Cave::parse(&text(screen, ""), "walls/my.toml").unwrap_or_else(|e| panic!("{e}"))
}

fn point(screen: &str, uv: [f64; 2]) -> Point3<f64> {
    match read(screen).screens[0].surface.at(uv) {
        Some(Place::Point(p)) => p,
        other => panic!("{other:?}"),
    }
}

fn direction(screen: &str, uv: [f64; 2]) -> Vector3<f64> {
    match read(screen).screens[0].surface.at(uv) {
        Some(Place::Direction(d)) => d,
        other => panic!("{other:?}"),
    }
}

#[test]
fn places_of_pictures_are_where_compass_and_ruler_put_them() {
    let near = |a: Vector3<f64>, b: [f64; 3]| assert!((a - Vector3::from(b)).norm() < 1e-12, "{a} is not {b:?}");
    // a quarter of a cylinder of 2 m: its left edge is 45 degrees to the left
    let wall = "shape = \"cylinder\"\nradius_m = 2\nheight_m = 3\nangle_deg = 90\ncenter_m = [1, 0, 1.5]";
    let half = 2f64.sqrt();
    near(point(wall, [0.0, 0.0]).coords, [1.0 - half, half, 0.0]);
    near(point(wall, [0.5, 1.0]).coords, [1.0, 2.0, 3.0]);
    // longitude and latitude
    let panorama = "shape = \"equirectangular\"";
    near(direction(panorama, [0.5, 0.5]), [0.0, 1.0, 0.0]);
    near(direction(panorama, [0.75, 0.5]), [1.0, 0.0, 0.0]);
    near(direction(panorama, [0.25, 0.5]), [-1.0, 0.0, 0.0]);
    near(direction(panorama, [0.9, 1.0]), [0.0, 0.0, 1.0]);
    // a dome master: zenith in the middle, front at the lower edge, right at the right
    let dome = "shape = \"fisheye\"\nradius_m = 4\ncenter_m = [0, 0, 1.5]";
    near(point(dome, [0.5, 0.5]).coords, [0.0, 0.0, 5.5]);
    near(point(dome, [0.5, 0.0]).coords, [0.0, 4.0, 1.5]);
    near(point(dome, [1.0, 0.5]).coords, [4.0, 0.0, 1.5]);
    // half way out is 45 degrees down
    near(point(dome, [0.5, 0.25]).coords, [0.0, 4.0 / half, 1.5 + 4.0 / half]);
    assert_eq!(read(dome).screens[0].surface.at([0.05, 0.05]), None, "outside of the disk");
    // the cross: front, right, up and down
    let cross = "shape = \"cube_map\"";
    near(direction(cross, [0.375, 0.5]), [0.0, 1.0, 0.0]);
    near(direction(cross, [0.625, 0.5]), [1.0, 0.0, 0.0]);
    near(direction(cross, [0.375, 5.0 / 6.0]), [0.0, 0.0, 1.0]);
    near(direction(cross, [0.375, 1.0 / 6.0]), [0.0, 0.0, -1.0]);
    // the front's upper edge is the lower edge of up
    near(direction(cross, [0.375, 2.0 / 3.0 - 1e-14]), [0.0, 1.0, 1.0]);
    near(direction(cross, [0.375, 2.0 / 3.0 + 1e-14]), [0.0, 1.0, 1.0]);
}

/// Lengths of short steps on the screen, by differences: a cylinder and an equidistant fisheye have
/// the same along each axis everywhere, a latitude shortens with its cosine.
#[test]
fn pixels_have_the_sizes_of_their_projection() {
    let step = |screen: &str, uv: [f64; 2], k: usize| {
        let mut next = uv;
        next[k] += 1e-6;
        (point(screen, next) - point(screen, uv)).norm() / 1e-6
    };
    let wall = "shape = \"cylinder\"\nradius_m = 2\nheight_m = 3\nangle_deg = 90";
    let sphere = "shape = \"equirectangular\"\nradius_m = 2\nangle_deg = 180\nelevation_deg = [-30, 60]";
    for i in 1..10 {
        let u = f64::from(i) / 10.0;
        assert!((step(wall, [u, 0.3], 0) - PI).abs() < 1e-5 && (step(wall, [0.3, u], 1) - 3.0).abs() < 1e-5);
        let elevation = (-30.0 + 90.0 * u).to_radians();
        assert!((step(sphere, [0.3, u], 0) - 2.0 * PI * elevation.cos()).abs() < 1e-5);
        assert!((step(sphere, [0.3, u], 1) - PI).abs() < 1e-5);
    }
    let dome = "shape = \"fisheye\"\nradius_m = 2\nangle_deg = 220\nforward = [0, 1, 0]\nup = [0, 0, 1]";
    for i in 1..5 {
        // along the radius: an angle of 110 degrees over half the picture
        assert!((step(dome, [0.5 + f64::from(i) / 10.0, 0.5], 0) - 4.0 * 110f64.to_radians()).abs() < 1e-5);
    }
}

#[test]
fn what_is_wrong_with_a_curve_or_a_color_is_reported_with_its_place() {
    let cylinder = "shape = \"cylinder\"\nradius_m = 3\nheight_m = 2";
    let cases = [
        (
            "shape = \"sphere\"",
            "",
            6,
            "expected `flat`, `cylinder`, `equirectangular`, `fisheye`, `cube_map` or `mesh`",
        ),
        ("shape = \"cylinder\"\nradius_m = 3", "", 4, "screen \"s\" has no `height_m`"),
        ("shape = \"cylinder\"\nradius_m = 0\nheight_m = 2", "", 7, "a length from 0.001"),
        ("shape = \"fisheye\"\nangle_deg = 400", "", 7, "an angle from 0.001 to 360 degrees"),
        (
            "shape = \"fisheye\"\nforward = [0, 1, 0]\nup = [0, 2, 0]",
            "",
            4,
            "`forward` of screen \"s\" is parallel to its `up`",
        ),
        (
            "shape = \"equirectangular\"\nelevation_deg = [30, -30]",
            "",
            4,
            "expected the lower edge below the upper one",
        ),
        ("shape = \"mesh\"", "", 4, "has no `mesh_file`"),
        ("shape = \"mesh\"\nmesh_file = \"a.stl\"", "", 7, "a file that ends in .obj or .pfm"),
        ("shape = \"mesh\"\nmesh_file = \"a.obj\"", "warp_file = \"b.obj\"", 8, "expected one of them"),
        (
            "shape = \"cylinder\"\nradius_m = 3\nheight_m = 2\ncenter_m = [3.5, 0, 1]",
            "",
            12,
            "the eye of user \"u\" is 0.500 m outside screen \"s\"",
        ),
        ("shape = \"cube_map\"\nradius_m = 3", "", 7, "unknown key `radius_m`"),
        (cylinder, "color = { gamma = 0.5 }", 13, "a number from 1 to 4"),
        (
            cylinder,
            "color = { black = [0.02, 0, 0], floor = [0.01, 0, 0] }",
            13,
            "expected a floor of at least the projector's own black",
        ),
        (cylinder, "color = { lut_file = \"a.png\" }", 13, "a file that ends in .cube"),
        (cylinder, "color = { gama = 2 }", 13, "did you mean `gamma`?"),
        (cylinder, "color = 2.2", 13, "expected a table"),
    ];
    for (screen, facet, line, said) in cases {
        let error = Cave::parse(&text(screen, facet), "my.toml").expect_err(screen);
        let message = error.to_string();
        assert_eq!(error.problems().len(), 1, "{screen}: {message}");
        assert!(error.problems()[0].line == line && message.contains(said), "{screen}: {message}");
    }
}

#[test]
fn colors_have_their_defaults() {
    let of = |facet: &str| {
        let screen = "shape = \"equirectangular\"";
        Cave::parse(&text(screen, facet), "walls/my.toml").unwrap().facets[0].color.clone()
    };
    assert_eq!(of(""), None);
    let color = of("color = { black = [0.01, 0.02, 0.03], lut_file = \"a.cube\" }").unwrap();
    assert_eq!((color.gamma, color.white, color.floor), (None, [1.0; 3], [0.01, 0.02, 0.03]));
    assert_eq!(color.lut_file.as_deref(), Some(std::path::Path::new("walls/a.cube")));
}

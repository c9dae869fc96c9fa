//! Configurations of SGCT as caves.

use nalgebra::Point3;
use tumble_calibrate::sgct_to_cave;
use tumble_scene::cave::{Cave, Flip, Output, Stereo, Surface};

fn config(window: &str, projection: &str) -> String {
    format!(
        "{{\n\"version\": 1, \"masteraddress\": \"localhost\",\n\"nodes\": [{{ \"address\": \"10.0.0.2\", \"port\": 20401, \"windows\": [{{ \"size\": {{ \"x\": 1920, \"y\": 1080 }}, \"pos\": {{ \"x\": 100, \"y\": 50 }}{window}, \"viewports\": [{{ \"pos\": {{ \"x\": 0.5, \"y\": 0.25 }}, \"size\": {{ \"x\": 0.5, \"y\": 0.5 }}, \"projection\": {projection} }}] }}] }}],\n\"users\": [{{ \"eyeseparation\": 0.065, \"pos\": {{ \"x\": 0.1, \"y\": 1.6, \"z\": 4.0 }} }}]\n}}"
    )
}

fn cave(text: &str) -> Cave {
    let files = sgct_to_cave(text).unwrap();
    Cave::parse(&files.cave, "sgct.toml").unwrap_or_else(|e| panic!("{e}\n{}", files.cave))
}

const PLANE: &str = "{ \"type\": \"ProjectionPlane\", \"lowerleft\": { \"x\": -1.5, \"y\": 0.5, \"z\": 0.0 }, \"upperleft\": { \"x\": -1.5, \"y\": 2.5, \"z\": 0.0 }, \"upperright\": { \"x\": 1.5, \"y\": 2.5, \"z\": 0.0 } }";

#[test]
fn a_plane_has_its_corners_and_its_part_of_the_window() {
    let cave = cave(&config(", \"stereo\": \"side_by_side\", \"mirrorx\": true", PLANE));
    // y up and z back become z up and y ahead
    assert_eq!(cave.users[0].eye_m, Point3::new(0.1, -4.0, 1.6));
    assert_eq!(cave.users[0].interpupillary_m, 0.065);
    let screen = &cave.screens[0];
    assert_eq!(screen.lower_left_m, Point3::new(-1.5, 0.0, 0.5));
    assert_eq!(screen.upper_right_m(), Point3::new(1.5, 0.0, 2.5));
    let facet = &cave.facets[0];
    // half of 1920 x 1080, half of that for each eye; a quarter from the bottom is a quarter from the top
    assert_eq!((facet.size_px, facet.stereo, facet.flip), ([480, 540], Stereo::SideBySide, Flip::Horizontal));
    assert_eq!(facet.output, Output::Window { position_px: [100 + 960, 50 + 270] });
}

/// The viewport begins at x = 960, y = 270 from the lower left corner of the window and is 540 high. Shaders of
/// SGCT give the left eye pixels with even `x + y`, or rows with even `y`, counted from that corner.
#[test]
fn interlaced_pictures_begin_with_the_same_eye() {
    let facet = |stereo: &str| cave(&config(&format!(", \"stereo\": \"{stereo}\""), PLANE)).facets[0].clone();
    let left_at_top = |stereo: &str, [x, y]: [i64; 2]| {
        let facet = facet(stereo);
        let ours = match facet.stereo {
            Stereo::Rows => y % 2 == 0,
            Stereo::Checkerboard => (x + y) % 2 == 0,
            other => panic!("{other:?}"),
        };
        ours != facet.swap_eyes
    };
    for [x, y] in [[0, 0], [1, 0], [0, 1], [1, 1], [7, 4]] {
        let (i, j) = (960 + x, 270 + 539 - y);
        assert_eq!(left_at_top("checkerboard", [x, y]), (i + j) % 2 == 0);
        assert_eq!(left_at_top("checkerboard_inverted", [x, y]), (i + j) % 2 != 0);
        assert_eq!(left_at_top("vertical_interlaced", [x, y]), j % 2 == 0);
        assert_eq!(left_at_top("vertical_interlaced_inverted", [x, y]), j % 2 != 0);
    }
}

/// A picture of 90 x 60 degrees, turned to the right by 90: 10 m to the right of the eye.
#[test]
fn angles_cut_a_rectangle_ahead_of_the_user() {
    let planar = "{ \"type\": \"PlanarProjection\", \"fov\": { \"hfov\": 90, \"vfov\": 60 }, \"orientation\": { \"yaw\": 90, \"pitch\": 0, \"roll\": 0 } }";
    let screen = cave(&config("", planar)).screens[0].clone();
    let half = 10.0 * 30f64.to_radians().tan();
    assert!((screen.lower_left_m - Point3::new(10.1, -4.0 + 10.0, 1.6 - half)).norm() < 1e-9, "{screen:?}");
    assert!((screen.lower_right_m - Point3::new(10.1, -4.0 - 10.0, 1.6 - half)).norm() < 1e-9, "{screen:?}");
    let lopsided = "{ \"type\": \"PlanarProjection\", \"distance\": 2, \"fov\": { \"left\": 45, \"right\": 0, \"down\": 0, \"up\": 45 } }";
    let screen = cave(&config("", lopsided)).screens[0].clone();
    assert!((screen.lower_left_m - Point3::new(0.1 - 2.0, -2.0, 1.6)).norm() < 1e-9, "{screen:?}");
    assert!((screen.upper_right_m() - Point3::new(0.1, -2.0, 3.6)).norm() < 1e-9, "{screen:?}");
    let all = cave(&config("", "{ \"type\": \"EquirectangularProjection\" }"));
    assert!(matches!(all.screens[0].surface, Surface::Equirectangular { radius_m: None, .. }));
}

#[test]
fn what_is_left_out_is_noted_and_what_is_wrong_has_its_place() {
    let files = sgct_to_cave(&config(", \"stereo\": \"active\"", PLANE)).unwrap();
    assert!(files.notes.iter().any(|note| note.contains("10.0.0.2")), "{:?}", files.notes);
    assert!(files.notes.iter().any(|note| note.contains("stereo \"active\" is read as mono")));
    let said = |text: &str| sgct_to_cave(text).unwrap_err().to_string();
    assert!(said("{\n\"nodes\": [,]").starts_with("line 2, column "), "{}", said("{\n\"nodes\": [,]"));
    assert_eq!(said("{}"), "the configuration: has no users");
    let odd = said(&config("", "{ \"type\": \"SphericalMirrorProjection\" }"));
    assert!(
        odd.starts_with(
            "the configuration.nodes[0].windows[0].viewports[0].projection: is \"SphericalMirrorProjection\", expected"
        ),
        "{odd}"
    );
    assert!(said(&config("", "{ \"type\": \"PlanarProjection\" }")).contains("projection: has no \"fov\""));
    assert!(said(&config("", PLANE).replace("1920", "\"wide\"")).contains("size.x: is no number"));
}

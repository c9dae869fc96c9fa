//! Couplings of joints, cones of links and color cameras in scene files, saved scenes and models of MuJoCo.

use tumble_core::{JointRef, Mimic, SensorKind, World};
use tumble_scene::mjcf::{MjcfOptions, parse};
use tumble_scene::{SceneFile, SceneWriter};

const SCENE: &str = r#"
[world]
dt_s = 0.005

[[body]]
name = "drum"
shape = { type = "cylinder", radius_m = 0.1, length_m = 0.1 }
mass_kg = 4.0
position_m = [1, 0, 2]
collidable = false
color = [0.9, 0.4, 0.1]

[[articulated]]
name = "robot"

[[articulated.link]]
name = "carriage"
joint = "prismatic"
axis = [0, 0, 1]
mass_kg = 2.0
center_m = [0, 0, 0]
inertia_kg_m2 = [0.1, 0.1, 0.1]

[[articulated.link]]
name = "lamp"
parent = "carriage"
joint = "spherical"
axis = [1, 0, 0]
cone_deg = 20
angular_velocity_rad_per_s = [0, 3, 1]
mass_kg = 1.0
center_m = [0.2, 0, 0]
inertia_kg_m2 = [0.01, 0.01, 0.01]

[[loop_joint]]
name = "hinge"
type = "revolute"
a = "drum"
position_m = [1, 0, 2]
axis = [0, 1, 0]

[[mimic]]
name = "cord"
joint = "robot/carriage"
of = "hinge"
multiplier = 0.05
offset_m = 0.01

[[sensor]]
name = "eye"
type = "color"
position_m = [1, -1, 2]
rotation_deg = [-90, 0, 0]
resolution = [32, 24]
"#;

fn built(text: &str) -> World {
    SceneFile::parse(text, "s.toml").unwrap_or_else(|e| panic!("{}", e.report(false))).build().unwrap().0
}

fn run(world: &mut World) {
    (0..200).for_each(|_| _ = world.step().unwrap());
}

/// The coupling holds, the lamp stays in its cone about x, and the scene that is written goes on with the same bits, and
/// from its text alone.
#[test]
fn a_scene_with_a_coupling_and_a_cone_is_read_and_saved() {
    let scene = SceneFile::parse(SCENE, "s.toml").unwrap_or_else(|e| panic!("{}", e.report(false)));
    let (mut world, _) = scene.build().unwrap();
    let cord = world.find("cord").unwrap();
    assert_eq!(world.get::<Mimic>(cord).unwrap().ratio(), [0.05, 0.01]);
    let robot = world.find("robot").unwrap();
    assert_eq!(world.get::<Mimic>(cord).unwrap().joints()[0], JointRef::Dof(robot, 0));
    let mut swing = 0.0f64;
    for _ in 0..200 {
        world.step().unwrap();
        let lamp = world.part_state(robot, 1).unwrap().pose.rotation * tumble_core::collide::Vec3::x();
        swing = swing.max(lamp.x.acos());
    }
    assert!((swing - 20f64.to_radians()).abs() < 1e-6, "{}", swing.to_degrees());
    assert!(world.get::<Mimic>(cord).unwrap().error(&world.view()).unwrap().abs() < 1e-8);
    let eye = world.find("eye").unwrap();
    let image = world.color_image(eye).unwrap();
    assert_eq!(image.pixels[12 * 32 + 16], [0; 3], "a drum that does not collide is not seen");
    let folder = std::env::temp_dir().join(format!("tumble_mimics_{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join("saved.toml");
    SceneWriter::new(&world).like(&scene).save(&path).unwrap_or_else(|e| panic!("{e}"));
    let text = std::fs::read_to_string(&path).unwrap();
    let mut read = SceneFile::load(&path).unwrap_or_else(|e| panic!("{}", e.report(false))).build().unwrap().0;
    // an edit makes the text count
    std::fs::write(&path, format!("{text}# edited\n")).unwrap();
    let mut again = SceneFile::load(&path).unwrap_or_else(|e| panic!("{}", e.report(false))).build().unwrap().0;
    std::fs::remove_dir_all(&folder).unwrap();
    for lines in [
        "[[mimic]]\nname = \"cord\"\njoint = \"robot/carriage\"\nof = \"hinge\"",
        "cone_rad = 0.349",
        "type = \"color\"",
    ] {
        assert!(text.contains(lines), "{lines} is not in\n{text}");
    }
    [&mut world, &mut read, &mut again].into_iter().for_each(run);
    assert!(world.save() == read.save());
    let height = |world: &World| world.pose(world.find("robot").unwrap(), 0).unwrap().translation.vector.z;
    assert!((height(&world) - height(&again)).abs() < 1e-9);
}

/// A drum that collides has its color in the image.
#[test]
fn a_color_camera_of_a_scene_sees_the_color_of_a_body() {
    let world = built(&SCENE.replace("collidable = false\n", ""));
    let eye = world.find("eye").unwrap();
    assert_eq!(world.get::<tumble_core::Sensor>(eye).unwrap().kind(), SensorKind::Color);
    let pixel = world.color_image(eye).unwrap().pixels[12 * 32 + 16];
    let expected = [0.9, 0.4, 0.1].map(|c: f64| c * 255.0);
    assert!(pixel.iter().zip(expected).all(|(c, e)| (f64::from(*c) - e).abs() < 8.0), "{pixel:?}");
}

#[test]
fn wrong_couplings_and_cones_are_reported() {
    let why = |text: String| {
        let world = SceneFile::parse(&text, "s.toml")
            .map_err(|e| e.report(false))
            .and_then(|scene| scene.build().map_err(|e| e.to_string()));
        world.map(|_| ()).unwrap_err()
    };
    let text = why(SCENE.replace("of = \"hinge\"", "of = \"hing\""));
    assert!(text.contains("`of`") && text.contains("did you mean `hinge`"), "{text}");
    let text = why(SCENE.replace("of = \"hinge\"", "of = \"robot/lamp\""));
    assert!(text.contains("`of`") && text.contains("robot/carriage"), "{text}");
    let text = why(SCENE.replace("of = \"hinge\"", "of = \"robot/carriage\""));
    assert!(text.contains("a joint other than `joint`"), "{text}");
    let text = why(SCENE.replace("multiplier = 0.05", "multiplier = 0"));
    assert!(text.contains("a number other than 0"), "{text}");
    let text = why(SCENE.replace("offset_m = 0.01", "offset_rad = 0.01"));
    assert!(text.contains("offset_rad"), "{text}");
    let text = why(SCENE.replace("axis = [1, 0, 0]\ncone_deg", "axis = [1, 1, 0]\ncone_deg"));
    assert!(text.contains("an axis of the joint's frame"), "{text}");
    let text = why(SCENE.replace("cone_deg = 20", "cone_deg = -20"));
    assert!(text.contains("`cone_deg`") && text.contains("an angle from 0 to 180"), "{text}");
}

/// A coupling of joints of two articulated bodies in a model of MuJoCo.
#[test]
fn a_model_of_mujoco_couples_joints_of_two_bodies() {
    let body = |name: &str, x: f64| {
        format!(
            "<body name=\"{name}\" pos=\"{x} 0 0\"><joint name=\"{name}\" axis=\"0 1 0\"/><geom size=\"0.1\" pos=\"0 0 -0.5\" contype=\"0\" conaffinity=\"0\"/></body>"
        )
    };
    let text = format!(
        "<mujoco><worldbody>{}{}</worldbody><equality><joint joint1=\"left\" joint2=\"right\" polycoef=\"0.2 -2 0 0 0\"/></equality></mujoco>",
        body("left", -1.0),
        body("right", 1.0)
    );
    let scene = parse(&text, "m.xml", &MjcfOptions::default()).unwrap();
    assert_eq!((scene.mimics.len(), scene.mimics[0].multiplier, scene.mimics[0].offset), (1, -2.0, 0.2));
    let mut world = scene.build().unwrap().0;
    run(&mut world);
    let mimic = world.ids().iter().find_map(|id| world.get::<Mimic>(*id)).unwrap();
    assert!(mimic.error(&world.view()).unwrap().abs() < 1e-8);
}

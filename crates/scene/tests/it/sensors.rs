//! Measuring sensors in scene files and in models of MuJoCo.

use std::collections::BTreeMap;
use std::path::Path;

use tumble_core::{Sensor, SensorKind, SensorNoise, World};
use tumble_scene::mjcf::{MjcfOptions, load, parse};
use tumble_scene::{SceneFile, SensorPlaceSpec};

use crate::mujoco::python;

const SCENE: &str = r#"
[world]
dt_s = 0.005

[[body]]
name = "ground"
mode = "static"
shape = { type = "half_space" }

[[body]]
name = "box"
shape = { type = "box", size_m = [0.2, 0.2, 0.2] }
mass_kg = 3.0
position_m = [0, 0, 0.1]

[[body]]
name = "lamp"
shape = { type = "sphere", radius_m = 0.1 }
mass_kg = 2.0
position_m = [2, 0, 1]

[[articulated]]
name = "arm"

[[articulated.link]]
name = "rod"
joint = "revolute"
axis = [0, 1, 0]
angle_rad = 0.3
mass_kg = 1.0
center_m = [0, 0, -0.5]
inertia_kg_m2 = [0.1, 0.1, 0.01]

[[articulated]]
name = "post"
position_m = [5, 0, 0]

[[articulated.link]]
name = "plate"
joint = "fixed"

[[articulated.link]]
name = "lift"
parent = "plate"
joint = "prismatic"
axis = [0, 0, 1]
mass_kg = 1.0

[[articulated.link]]
name = "cap"
parent = "lift"
joint = "fixed"
mass_kg = 1.0

[[loop_joint]]
name = "hook"
type = "fixed"
a = "lamp"
position_m = [2, 0, 1.5]

[[sensor]]
name = "imu"
type = "accelerometer"
on = "box"
position_m = [0.05, 0, 0]
rotation_deg = [90, 0, 0]

[[sensor]]
name = "scale"
type = "touch"
on = "box"

[[sensor]]
name = "half"
type = "touch"
on = "box"
position_m = [0.1, 0, -0.1]
volume = { type = "box", size_m = [0.1, 1, 0.1] }

[[sensor]]
name = "load"
type = "force"
on = "hook"

[[sensor]]
name = "angle"
type = "joint_position"
on = "arm/rod"
quantization = 0.01
delay = 2
cutoff = 0.2
deviation = 0.001
bias_walk = 0.002
seed = 7

[[sensor]]
name = "seen"
type = "position"
on = "lamp"
relative_to = "box"
"#;

fn reading(world: &World, name: &str) -> Vec<f64> {
    world.reading(world.find(name).unwrap()).unwrap().to_vec()
}

fn close(a: &[f64], b: &[f64], error: f64, label: &str) {
    assert_eq!(a.len(), b.len(), "{label}");
    let far = a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(far <= error, "{label}: {a:?} is not {b:?}: {far:e}");
}

#[test]
fn sensors_of_a_scene_read_what_holds_its_bodies() {
    let scene = SceneFile::parse(SCENE, "s.toml").unwrap_or_else(|error| panic!("{error}"));
    let angle = scene.sensors.iter().find(|sensor| sensor.name == "angle").unwrap();
    assert_eq!(angle.kind, SensorKind::JointPosition);
    assert!(matches!(angle.on, SensorPlaceSpec::Part(_)));
    let noise = angle.noise;
    assert_eq!(
        (noise.deviation, noise.bias_walk, noise.quantization, noise.delay, noise.seed),
        (1e-3, 2e-3, 0.01, 2, 7)
    );
    let (mut world, _) = scene.build().unwrap();
    (0..100).for_each(|_| _ = world.step().unwrap());
    close(&reading(&world, "imu"), &[0.0, 9.81, 0.0], 1e-7, "imu");
    close(&reading(&world, "scale"), &[3.0 * 9.81], 1e-6, "scale");
    close(&reading(&world, "half"), &[1.5 * 9.81], 1e-6, "half");
    let load = reading(&world, "load");
    let norm = load.iter().map(|f| f * f).sum::<f64>().sqrt();
    assert!((norm - 2.0 * 9.81).abs() < 1e-7 && (load[2] - 2.0 * 9.81).abs() < 1e-7, "{load:?}");
    close(&reading(&world, "seen"), &[2.0, 0.0, 0.9], 1e-6, "seen");
    assert!(reading(&world, "angle")[0].abs() <= 0.2);
}

/// Cameras of a scene have the errors of other sensors, and a saved scene has them again.
#[test]
fn cameras_have_a_delay_and_a_walk_of_their_bias() {
    let text = "[[body]]\nname = \"ground\"\nmode = \"static\"\nshape = { type = \"half_space\" }\n\
        [[sensor]]\nname = \"eye\"\ntype = \"depth\"\ndelay = 3\nbias_walk = 0.5\nseed = 9\n\
        [[sensor]]\nname = \"red\"\ntype = \"color\"\ndeviation = 2\nquantization = 4\ndelay = 1\n\
        [[sensor]]\nname = \"parts\"\ntype = \"segmentation\"\ndelay = 2\nseed = 1\n";
    let noises = |world: &World| {
        let noise = |name: &str| *world.get::<Sensor>(world.find(name).unwrap()).unwrap().noise();
        ["eye", "red", "parts"].map(noise)
    };
    let (world, _) = SceneFile::parse(text, "s.toml").unwrap().build().unwrap();
    let expected = [
        SensorNoise { delay: 3, bias_walk: 0.5, seed: 9, ..SensorNoise::default() },
        SensorNoise { deviation: 2.0, quantization: 4.0, delay: 1, ..SensorNoise::default() },
        SensorNoise { delay: 2, seed: 1, ..SensorNoise::default() },
    ];
    assert_eq!(noises(&world), expected);
    let folder = std::env::temp_dir().join(format!("tumble-scene-{}-cameras", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    tumble_scene::SceneWriter::new(&world).save(folder.join("scene.toml")).unwrap();
    let text = std::fs::read_to_string(folder.join("scene.toml")).unwrap();
    std::fs::remove_dir_all(&folder).unwrap();
    // the text alone, without the archive beside it
    let text = text.replace("saved_world = \"scene_files/state.world\"\n", "");
    assert_eq!(noises(&SceneFile::parse(&text, "s.toml").unwrap().build().unwrap().0), expected);
}

/// The frame of a body is that of its shape, not the one about its center of mass.
#[test]
fn sites_on_a_body_are_in_the_frame_of_its_shape() {
    let text = "[world]\ngravity_m_per_s2 = [0, 0, 0]\n[[body]]\nname = \"b\"\nmass_kg = 2\nposition_m = [1, 2, 3]\n\
        shape = { type = \"compound\", parts = [{ type = \"sphere\", radius_m = 0.1 }, \
        { type = \"sphere\", radius_m = 0.1, position_m = [1, 0, 0] }] }\n\
        [[sensor]]\nname = \"at\"\ntype = \"position\"\non = \"b\"\nposition_m = [0, 0, 0.5]\n";
    let scene = SceneFile::parse(text, "s.toml").unwrap();
    let (mut world, _) = scene.build().unwrap();
    world.step().unwrap();
    close(&reading(&world, "at"), &[1.0, 2.0, 3.5], 1e-12, "at");
    // and so they are written
    let folder = std::env::temp_dir().join(format!("tumble-scene-{}-sites", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let file = folder.join("scene.toml");
    tumble_scene::SceneWriter::new(&world).save(&file).unwrap();
    let text = std::fs::read_to_string(&file).unwrap();
    std::fs::remove_dir_all(&folder).unwrap();
    assert!(text.contains("position_m = [0.0, 0.0, 0.5]") || text.contains("position_m = [0, 0, 0.5]"), "{text}");
}

#[test]
fn faults_of_sensors_are_reported_with_their_place() {
    let fault = |sensor: &str| {
        let text = format!("{SCENE}\n[[sensor]]\nname = \"bad\"\n{sensor}\n");
        let said = match SceneFile::parse(&text, "s.toml") {
            Err(error) => error.to_string(),
            Ok(scene) => scene.build().err().unwrap().to_string(),
        };
        assert!(said.contains("s.toml:"), "{said}");
        said
    };
    for (sensor, expected) in [
        ("type = \"gyroskope\"\non = \"box\"", "\"gyroskope\"; did you mean `gyroscope`?"),
        ("type = \"gyroscope\"\non = \"bocks\"", "bocks"),
        ("type = \"touch\"", "has no `on`"),
        ("type = \"gyroscope\"\non = \"box\"\ndeviation = -1", "deviation"),
        ("type = \"gyroscope\"\non = \"box\"\nvolume = { type = \"sphere\", radius_m = 1 }", "unknown key `volume`"),
        ("type = \"gyroscope\"\non = \"box\"\nrelative_to = \"lamp\"", "unknown key `relative_to`"),
        ("type = \"force\"\non = \"box\"", "`on` of sensor \"bad\" is \"box\""),
        (
            "type = \"force\"\non = \"box\"",
            "expected a link of an articulated body that a joint moves, or a loop joint",
        ),
        ("type = \"torque\"\non = \"post/plate\"", "expected a link of an articulated body that a joint moves"),
        ("type = \"joint_velocity\"\non = \"post/plate\"", "expected a link with a revolute or prismatic joint"),
        ("type = \"drive_force\"\non = \"post/cap\"", "expected a link with a revolute or prismatic joint"),
        ("type = \"joint_position\"\non = \"box\"", "expected a link with a revolute or prismatic joint"),
        ("type = \"joint_position\"\non = \"hook\"", "expected a loop joint with a position"),
        (
            "type = \"depth\"\nresolution = [1000, 1000]\ndelay = 5",
            "`delay` of sensor \"bad\" is 5; expected steps whose images have at most 4194304 pixels in all",
        ),
        ("type = \"segmentation\"\nbias_walk = 0.1", "unknown key `bias_walk`"),
        ("type = \"gyroscope\"\non = \"hook\"", "expected a body or a link: this type of sensor reads a site"),
    ] {
        let said = fault(sensor);
        assert!(said.contains(expected), "{sensor}: {said}");
    }
    let twice = SCENE.replace("name = \"scale\"", "name = \"box\"");
    assert!(SceneFile::parse(&twice, "s.toml").unwrap_err().to_string().contains("box"));
}

/// The readings of a frame of `dt` seconds from the keyframe of the model.
fn readings(dt: f64) -> BTreeMap<String, Vec<f64>> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/mjcf/sensors.xml");
    let options = MjcfOptions { keyframe: Some("swinging".into()), ..MjcfOptions::default() };
    let mut scene = load(path, &options).unwrap_or_else(|error| panic!("{error}"));
    scene.world.dt_s = dt;
    let (mut world, _) = scene.build().unwrap();
    world.step().unwrap();
    let named = world.sensors().map(|id| (world.name(id).unwrap().to_owned(), world.reading(id).unwrap().to_vec()));
    named.collect()
}

/// MuJoCo reads at the keyframe; ours are means over a frame after it, extrapolated to no length.
#[test]
fn sensors_of_a_model_read_what_those_of_mujoco_read() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/mjcf/sensors.xml");
    let Some(said) = python(&["sensors", &path.display().to_string()]) else { return };
    let (coarse, fine) = (readings(2e-5), readings(1e-5));
    let (mut count, mut worst) = (0, 0.0_f64);
    for line in said.unwrap().lines() {
        let mut words = line.split_whitespace().skip(1);
        let name = words.next().unwrap();
        let mut expected: Vec<f64> = words.map(|word| word.parse().unwrap()).collect();
        if expected.len() == 4 {
            expected.rotate_left(1); // w, x, y, z there
            let sign = if expected[3] < 0.0 { -1.0 } else { 1.0 };
            expected.iter_mut().for_each(|x| *x *= sign);
        }
        let (coarse, fine) = (&coarse[name], &fine[name]);
        let ours: Vec<f64> = fine.iter().zip(coarse).map(|(fine, coarse)| 2.0 * fine - coarse).collect();
        let size = expected.iter().map(|x| x.abs()).fold(1.0, f64::max);
        worst = ours.iter().zip(&expected).map(|(a, b)| (a - b).abs() / size).fold(worst, f64::max);
        close(&ours, &expected, 2e-6 * size, name);
        count += 1;
    }
    println!("{count} sensors; largest difference {worst:e} of the largest number");
    assert_eq!(count, 24);
}

#[test]
fn sensors_that_are_not_read_are_noted() {
    let scene = parse(
        r#"<mujoco><worldbody><body name="b"><freejoint/><geom size="0.1" mass="1"/><site name="s"/>
           <body name="w"><geom size="0.1" mass="1"/><site name="t"/></body></body></worldbody>
           <sensor><magnetometer site="s"/><framelinacc objtype="site" objname="s"/><subtreecom body="b"/>
           <force site="t"/><gyro name="g" site="s" noise="0.1"/></sensor></mujoco>"#,
        "m.xml",
        &MjcfOptions::default(),
    );
    let scene = scene.unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(scene.sensors.iter().map(|sensor| sensor.name.as_str()).collect::<Vec<_>>(), ["g"]);
    for expected in
        ["<magnetometer>", "<framelinacc>", "<subtreecom>", "bodies without a joint", "`noise` of sensors is left out"]
    {
        assert!(scene.notes.iter().any(|note| note.contains(expected)), "{expected}: {:?}", scene.notes);
    }
}

//! Names, masses, actuators and the keyframe of worlds written as MJCF.

use tumble_core::RigidBody;
use tumble_scene::SceneFile;
use tumble_scene::mjcf::{MjcfOptions, MjcfText, MjcfWriter, parse};

fn write(scene: &SceneFile) -> MjcfText {
    let (world, _) = scene.build().unwrap();
    MjcfWriter::new(&world).like(scene).text("files")
}

fn again(written: &MjcfText) -> SceneFile {
    let options = MjcfOptions { keyframe: Some("now".into()), ..MjcfOptions::default() };
    parse(&written.text, "again.xml", &options).unwrap_or_else(|error| panic!("{error}\n{}", written.text))
}

fn scene(text: &str) -> SceneFile {
    SceneFile::parse(&format!("[world]\ncombine_friction = \"max\"\n{text}"), "s.toml").unwrap()
}

fn robot(name: &str, link: &str, y: f64) -> String {
    format!(
        r#"
[[articulated]]
name = "{name}"
position_m = [0, {y}, 3]
[[articulated.link]]
name = "{link}"
joint = "revolute"
axis = [0, 1, 0]
mass_kg = 1
shape = {{ type = "sphere", radius_m = 0.1 }}
"#
    )
}

#[test]
fn names_that_change_are_noted() {
    let two = scene(&(robot("left", "upper", 0.0) + &robot("right", "upper", 3.0)));
    let written = write(&two);
    let names: Vec<String> = again(&written).articulated.iter().map(|spec| spec.name.clone()).collect();
    assert_eq!(names, ["upper", "upper_2"]);
    let notes = written.notes.join("\n");
    for note in [
        "left: a tree of MJCF has the name of its root body: it is read back as upper",
        "right: a tree of MJCF has the name of its root body: it is read back as upper_2",
        "upper: its name is taken by another body of the model: it is read back as upper_2",
        "joint upper of right: its name is taken by another joint of the model: it is read back as upper_2",
    ] {
        assert!(notes.contains(note), "{note} is missing in\n{notes}");
    }
    let same = scene(&(robot("left", "left", 0.0) + &robot("right", "right", 3.0)));
    let written = write(&same);
    let names: Vec<String> = again(&written).articulated.iter().map(|spec| spec.name.clone()).collect();
    assert_eq!((names, written.notes.join("\n")), (vec!["left".to_owned(), "right".to_owned()], String::new()));
}

#[test]
fn masses_of_kinematic_bodies_come_back() {
    let text = r#"
[[body]]
name = "k"
mode = "kinematic"
mass_kg = 2
shape = { type = "box", size_m = [0.1, 0.2, 0.3] }
position_m = [1, 2, 3]
"#;
    let first = scene(text);
    let (before, _) = first.build().unwrap();
    let (after, _) = again(&write(&first)).build().unwrap();
    let [a, b] = [&before, &after].map(|world| world.get::<RigidBody>(world.find("k").unwrap()).unwrap());
    assert_eq!((a.mass(), a.center_of_mass()), (b.mass(), b.center_of_mass()));
    assert!((a.inertia() - b.inertia()).amax() < 1e-12 * a.inertia().amax());
    let [a, b] = [&before, &after].map(|world| world.part_state(world.find("k").unwrap(), 0).unwrap().pose);
    assert!((a.translation.vector - b.translation.vector).amax() < 1e-12);
}

#[test]
fn a_world_without_degrees_of_freedom_has_the_keyframe() {
    let fixed = scene("[[body]]\nname = \"g\"\nmode = \"static\"\nshape = { type = \"sphere\", radius_m = 1 }\n");
    assert_eq!(again(&write(&fixed)).bodies[0].name, "g");
}

#[test]
fn motors_come_back() {
    let text = r#"<mujoco><worldbody><body name="r"><joint name="a" axis="0 1 0"/><geom size=".05" mass="1" pos="1 0 0"/>
        <body name="s" pos="1 0 0"><joint name="b" pos="0 0 .1" axis="0 1 0"/><geom size=".05" mass="1" pos="1 0 0"/></body></body>
        </worldbody><tendon><fixed name="t"><joint joint="a" coef="1"/><joint joint="b" coef="2"/></fixed></tendon><actuator>
        <motor name="m" joint="b" gear="5" ctrlrange="-1 2" forcerange="-3 4"/><motor name="n" joint="a"/>
        <position joint="a" kp="30"/><motor name="both" tendon="t"/></actuator></mujoco>"#;
    let first = parse(text, "m.xml", &MjcfOptions::default()).unwrap();
    let written = write(&first);
    let second = again(&written);
    for name in ["m", "n"] {
        let [a, b] = [&first, &second].map(|scene| {
            let spec = scene.actuators.iter().find(|spec| spec.name == name).unwrap();
            let joints = &scene.articulated[spec.articulated].links;
            let moments: Vec<_> = spec.moments.iter().map(|(link, arm)| (&joints[*link].joint.name, *arm)).collect();
            format!("{moments:?} {} {:?} {:?} {:?}", spec.gain, spec.bias, spec.control_range, spec.force_range)
        });
        assert_eq!(a, b, "{name}");
    }
    assert!(
        written.notes.iter().any(|note| note == "both: actuators of several joints are left out"),
        "{:?}",
        written.notes
    );
}

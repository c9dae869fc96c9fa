//! `<pair>`, `condim` and friction of MJCF as MuJoCo defines them, and parts of a model that act or are noted.

use tumble_core::World;
use tumble_core::collide::Vec3;
use tumble_scene::SceneFile;
use tumble_scene::mjcf::{MjcfOptions, load, parse};

use crate::mjcf_written::Folder;

fn read(text: &str) -> SceneFile {
    parse(text, "m.xml", &MjcfOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

/// A ball of 0.1 m that falls on a plane, and another one beside it.
fn falling(attributes: [&str; 2], contact: &str) -> String {
    let [floor, ball] = attributes;
    format!(
        r#"<mujoco><worldbody><geom name="f" type="plane" size="5 5 .1" {floor}/>
        <body name="b" pos="0 0 .2"><freejoint/><geom name="g" size=".1" {ball}/></body>
        <body name="c" pos="1 0 .2"><freejoint/><geom name="h" size=".1" contype="0" conaffinity="0"/></body>
        </worldbody><contact>{contact}</contact></mujoco>"#
    )
}

fn step(world: &mut World, steps: usize) {
    for _ in 0..steps {
        world.step().unwrap();
    }
}

fn height(world: &World, name: &str) -> f64 {
    world.part_state(world.find(name).unwrap(), 0).unwrap().pose.translation.z
}

#[test]
fn pairs_collide_whatever_their_masks_are() {
    const NONE: &str = "contype='0' conaffinity='0'";
    let pair = "<pair geom1='f' geom2='g'/>";
    for (masks, contact, rests) in [
        ([NONE, NONE], "", false),
        ([NONE, NONE], pair, true),
        (["", NONE], pair, true),
        ([NONE, ""], pair, true),
        (["contype='2' conaffinity='0'", "contype='4' conaffinity='8'"], pair, true),
        (["", ""], "", true),
    ] {
        let scene = read(&falling(masks, contact));
        let (mut world, _) = scene.build().unwrap();
        step(&mut world, 500);
        let z = height(&world, "b");
        assert_eq!((z - 0.1).abs() < 1e-3, rests, "{masks:?} {contact}: height {z}");
        assert!(height(&world, "c") < -1.0, "the other ball falls on through all");
    }
    // a flag that disables contacts disables pairs too
    let text = falling(["", ""], pair).replace("<mujoco>", "<mujoco><option><flag contact='disable'/></option>");
    let (mut world, _) = read(&text).build().unwrap();
    step(&mut world, 500);
    assert!(height(&world, "b") < -1.0);
}

#[test]
fn only_the_geom_of_a_pair_collides_by_it() {
    // a second geom of the body reaches through the plane at the start
    let text = r#"<mujoco><worldbody><geom name="f" type="plane" size="5 5 .1" contype="0" conaffinity="0"/>
        <body name="b" pos="0 0 .2"><freejoint/><geom name="g" size=".1" contype="0" conaffinity="0"/>
        <geom name="low" size=".1" pos="0 0 -.5" mass="0.1" contype="0" conaffinity="0"/></body></worldbody>
        <contact><pair geom1="f" geom2="g"/></contact></mujoco>"#;
    let (mut world, _) = read(text).build().unwrap();
    step(&mut world, 200);
    let z = world.state_of(world.find("b").unwrap()).unwrap()[2];
    assert!((z - 0.1).abs() < 2e-2, "{z}");
}

#[test]
fn pairs_that_cannot_collide_are_noted() {
    let text = r#"<mujoco><worldbody><body name="a" pos="0 0 1"><joint type="slide" axis="0 1 0"/><geom name="x" size=".1"/>
        <body name="b" pos="0 0 .5"><joint type="slide" axis="0 0 1"/><geom name="y" size=".1"/></body></body></worldbody>
        <contact><pair name="p" geom1="x" geom2="y"/></contact></mujoco>"#;
    let notes = read(text).notes;
    assert!(
        notes.iter().any(|n| n.starts_with("m.xml:3:") && n.contains("bodies that a joint connects")),
        "{notes:#?}"
    );
}

/// Returns the sliding friction of a box on a floor, from its deceleration over 0.1 s at 3 m/s.
fn friction(floor: &str, cube: &str, contact: &str) -> f64 {
    let text = format!(
        r#"<mujoco><worldbody><geom name="f" type="plane" size="5 5 .1" {floor}/><body name="b" pos="0 0 .05"><freejoint/>
        <geom name="g" type="box" size=".2 .2 .05" {cube}/></body></worldbody><contact>{contact}</contact></mujoco>"#
    );
    let (mut world, _) = read(&text).build().unwrap();
    let id = world.find("b").unwrap();
    world.set_velocity(id, Vec3::new(3.0, 0.0, 0.0), Vec3::zeros()).unwrap();
    step(&mut world, 50);
    (3.0 - world.center_state(id).unwrap().velocity.x) / 9.81 / world.time()
}

#[test]
fn the_larger_condim_and_friction_of_a_pair_count() {
    let pair = |attributes: &str| format!("<pair geom1='f' geom2='g' {attributes}/>");
    for (floor, cube, contact, mu) in [
        ("condim='3' friction='.3'", "condim='1' friction='.8'", "".to_owned(), 0.8),
        ("condim='1' friction='1'", "condim='3' friction='.5'", "".to_owned(), 1.0),
        ("condim='1' friction='1'", "condim='1' friction='.5'", "".to_owned(), 0.0),
        ("condim='3' friction='.2'", "condim='3' friction='.5'", "".to_owned(), 0.5),
        ("condim='3' friction='.2'", "condim='3' friction='.5'", pair("friction='.3'"), 0.3),
        ("condim='3' friction='.2'", "condim='3' friction='.5'", pair("condim='1'"), 0.0),
        ("condim='1' friction='.2'", "condim='1' friction='.5'", pair("condim='3'"), 0.5),
    ] {
        let measured = friction(floor, cube, &contact);
        assert!((measured - mu).abs() < 1e-6, "{floor}, {cube}, {contact}: {measured}, expected {mu}");
    }
    // two geoms with condim 1 slide past each other, also in a model where another geom has friction
    let floor = "condim='1' friction='1'/><geom type='sphere' size='.01' pos='0 0 9' condim='3'";
    assert!(friction(floor, "condim='1' friction='.5'", "").abs() < 1e-9);
}

#[test]
fn friction_of_pairs_that_is_left_out_is_noted() {
    let notes = |pair: &str| read(&falling(["", ""], &format!("<pair geom1='f' geom2='g' {pair}/>"))).notes.join("\n");
    assert!(notes("friction='.3 .1'").contains("the second sliding friction of a pair"));
    assert!(notes("friction='.3 .3 .05 .01 .02' condim='6'").contains("the second rolling friction of a pair"));
    for silent in [
        "friction='.3 .3'",
        "friction='.3 .3 .05 .01 .01' condim='6'",
        "friction='.3 .3 .05 .01 .01'",
        "friction='.3 .1' condim='1'",
        "",
    ] {
        assert!(!notes(silent).contains("friction of a pair"), "{silent}: {}", notes(silent));
    }
}

/// The turning frictions of a pair are its own where `condim` has them, else none, whatever those of its geoms are.
#[test]
fn a_pair_has_its_own_torsional_and_rolling_friction() {
    let frictions = |geoms: &str, pair: &str| {
        let file = read(&falling([geoms; 2], &format!("<pair geom1='f' geom2='g' {pair}/>")));
        let (world, _) = file.build().unwrap();
        let id = |name| world.find(name).unwrap();
        let found = world.pair_material((id("f"), 0), (id("b"), 0)).unwrap();
        [found.friction, found.torsional_friction, found.rolling_friction]
    };
    let turning = "condim='6' friction='.5 .02 .003'";
    assert_eq!(frictions(turning, "friction='.3 .3 .05 .01 .01' condim='6'"), [0.3, 0.05, 0.01]);
    assert_eq!(frictions(turning, "friction='.3 .3 .05 .01 .01' condim='4'"), [0.3, 0.05, 0.0]);
    assert_eq!(frictions(turning, "friction='.3 .3 .05'"), [0.3, 0.0, 0.0]);
    assert_eq!(frictions("friction='.5 .02 .003'", "condim='6'"), [0.5, 0.02, 0.003]);
    assert_eq!(frictions("friction='.5 .02 .003'", "friction='.3' condim='6'"), [0.3, 0.005, 0.0001]);
}

#[test]
fn a_constant_force_without_feedback_is_noted() {
    let notes = |bias: &str| {
        let text = format!(
            r#"<mujoco><worldbody><body name="b"><joint name="j"/><geom size=".1"/></body></worldbody>
            <actuator><general joint="j" biastype="affine" biasprm="{bias}"/></actuator></mujoco>"#
        );
        read(&text).notes.join("\n")
    };
    assert!(notes("3 0 0").contains("m.xml:2: the general of <actuator>: the constant force of an actuator"));
    assert_eq!((notes("3 -5 0"), notes("0 0 0")), (String::new(), String::new()));
}

#[test]
fn a_missing_mesh_is_an_error_of_its_own() {
    let folder = Folder::new("missing");
    let file = folder.0.join("m.xml");
    let text = "<mujoco><asset>\n<mesh name='t' file='nope.stl'/></asset><worldbody>\n<body name='b'><joint/>
        <body name='c'><geom type='mesh' mesh='t'/></body></body></worldbody></mujoco>";
    std::fs::write(&file, text).unwrap();
    let error = load(&file, &MjcfOptions::default()).unwrap_err().to_string();
    assert!(error.contains("m.xml:2:") && error.contains("nope.stl"), "{error}");
    std::fs::write(folder.0.join("nope.stl"), "solid\nfacet").unwrap();
    let error = load(&file, &MjcfOptions::default()).unwrap_err().to_string();
    assert!(error.contains("m.xml:2:1: mesh \"t\" has no mass") && error.contains("no triangles"), "{error}");
}

#[test]
fn joints_of_the_world_and_missing_keyframes_are_errors() {
    let text =
        "<mujoco><worldbody>\n<joint name='j'/><frame><freejoint/></frame><geom size='.1'/></worldbody></mujoco>";
    let error = parse(text, "m.xml", &MjcfOptions::default()).unwrap_err().to_string();
    assert!(error.contains("m.xml:2:1: joint \"j\" is in the world; expected it in a <body>"), "{error}");
    assert!(error.contains("2 problems") || error.matches("is in the world").count() == 2, "{error}");
    let options = MjcfOptions { keyframe: Some("now".into()), ..MjcfOptions::default() };
    let error = parse("<mujoco><worldbody/></mujoco>", "m.xml", &options).unwrap_err().to_string();
    assert!(error.contains("has no keyframe \"now\"; expected none: the model has no keyframes"), "{error}");
}

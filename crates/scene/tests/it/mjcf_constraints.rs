//! Equality constraints of MJCF: written and read back, and as MuJoCo closes them where it is installed.

use std::collections::BTreeMap;

use tumble_core::collide::Vec3;
use tumble_core::{LoopJoint, Mimic, World};
use tumble_scene::mjcf::{MjcfOptions, MjcfWriter, load, parse};
use tumble_scene::{JointSideSpec, LoopJointSpec, SceneFile};

use crate::mjcf_written::Folder;

/// Two arms that are bent at time 0, joined to each other, to the world and to a rigid body.
const BENT: &str = r#"
[world]
combine_friction = "max"
[[articulated]]
name = "left"
initial_positions = { shoulder = 0.7, elbow = -1.1 }
[[articulated.link]]
name = "upper"
joint = "revolute"
joint_name = "shoulder"
axis = [0, 1, 0]
mass_kg = 1
center_m = [0, 0, -0.2]
inertia_kg_m2 = [0.01, 0.01, 0.01]
[[articulated.link]]
name = "lower"
parent = "upper"
position_m = [0, 0, -0.4]
joint = "revolute"
joint_name = "elbow"
axis = [0, 1, 0]
mass_kg = 1
center_m = [0, 0, -0.2]
inertia_kg_m2 = [0.01, 0.01, 0.01]
[[articulated]]
name = "right"
position_m = [0.6, 0, 0]
initial_positions = { wrist = 0.4 }
[[articulated.link]]
name = "hand"
joint = "revolute"
joint_name = "wrist"
axis = [1, 0, 0]
mass_kg = 1
center_m = [0, 0, -0.2]
inertia_kg_m2 = [0.01, 0.01, 0.01]
[[body]]
name = "ball"
shape = { type = "sphere", radius_m = 0.05 }
mass_kg = 1
position_m = [0.3, 0.5, -0.6]
[[loop_joint]]
name = "hands"
type = "spherical"
a = "left/lower"
b = "right/hand"
position_m = [0.3, 0.1, -0.5]
[[loop_joint]]
name = "anchor"
type = "spherical"
a = "left/upper"
position_m = [-0.2, 0, -0.3]
[[loop_joint]]
name = "tether"
type = "spherical"
a = "ball"
b = "right/hand"
position_m = [0.4, 0.3, -0.5]
[[loop_joint]]
name = "glue"
type = "fixed"
a = "ball"
b = "left/lower"
position_m = [0.3, 0.5, -0.6]
"#;

/// Returns the larger of distance, m, and angle, rad, by which each loop joint is open.
fn errors(world: &World) -> BTreeMap<String, f64> {
    let view = world.view();
    let joint = |id: &_| {
        let error = world.get::<LoopJoint>(*id)?.position_error(&view)?;
        Some((world.name(*id)?.to_owned(), error.distance.max(error.angle)))
    };
    world.ids().iter().filter_map(joint).collect()
}

/// Returns the norm of the residual of each equality constraint in MuJoCo at the first keyframe; `None` without MuJoCo.
fn residuals(file: &std::path::Path) -> Option<BTreeMap<String, f64>> {
    let said = crate::mujoco::python(&["residuals", &file.display().to_string()])?.unwrap();
    let line = |line: &str| {
        let mut words = line.split(' ').skip(1);
        let name = words.next().unwrap().to_owned();
        let numbers: Vec<f64> = words.map(|word| word.parse().unwrap()).collect();
        assert!(!numbers.is_empty(), "{name} has no rows");
        (name, numbers.iter().map(|x| x * x).sum::<f64>().sqrt())
    };
    Some(said.lines().map(line).collect())
}

/// MuJoCo takes the second anchor of a `<connect>` by bodies at zero positions, where these loops are open by 0.1 to 0.5 m.
#[test]
fn mujoco_closes_loop_joints_of_bent_robots_where_they_are() {
    let scene = SceneFile::parse(BENT, "bent.toml").unwrap_or_else(|error| panic!("{error}"));
    let (world, _) = scene.build().unwrap();
    let folder = Folder::new("bent");
    let file = folder.0.join("bent.xml");
    let notes = MjcfWriter::new(&world).like(&scene).save(&file).unwrap();
    let renamed = |name: &str, root: &str| {
        format!("{name}: a tree of MJCF has the name of its root body: it is read back as {root}")
    };
    assert_eq!(notes, [renamed("left", "upper"), renamed("right", "hand")]);
    let Some(residuals) = residuals(&file) else { return };
    assert_eq!(residuals.len(), 4);
    for (name, residual) in residuals {
        assert!(residual < 1e-14, "{name}: {residual:e}");
    }
}

#[test]
fn loop_joints_of_bent_robots_come_back() {
    let scene = SceneFile::parse(BENT, "bent.toml").unwrap_or_else(|error| panic!("{error}"));
    let (mut world, _) = scene.build().unwrap();
    for _ in 0..5 {
        world.step().unwrap();
    }
    let written = MjcfWriter::new(&world).like(&scene).text("files");
    let options = MjcfOptions { keyframe: Some("now".into()), ..MjcfOptions::default() };
    let read = parse(&written.text, "bent.xml", &options).unwrap();
    assert_eq!(read.bodies.len(), 1, "the ball is still a rigid body");
    let links: Vec<usize> = read.articulated.iter().map(|spec| spec.links.len()).collect();
    assert_eq!(links, [2, 1], "sites of joints are no frames: {:#?}", read.articulated);
    let (again, _) = read.build().unwrap();
    let (before, after) = (errors(&world), errors(&again));
    assert_eq!(after.keys().collect::<Vec<_>>(), ["anchor", "glue", "hands", "tether"]);
    for (name, error) in &after {
        assert!((error - before[name]).abs() < 1e-14, "{name}: {error:e} {:e}", before[name]);
    }
}

const PAIR: &str = r#"<mujoco><worldbody>
  <body name="a"><joint name="q" axis="0 1 0" ref="0"/><geom size=".1"/><site name="tip" pos="0 0 -1"/></body>
  <body name="b" pos="1 0 0"><freejoint/><geom size=".1"/><site name="hook" pos="0.5 0 0"/><site name="eye" pos="0 0.5 0"/></body>
</worldbody>
<equality>EQUALITY</equality>
<sensor><framepos objtype="site" objname="eye"/></sensor>
<keyframe><key name="bent" qpos="0.5 1.1 0 0.2 1 0 0 0"/></keyframe></mujoco>"#;

fn joint(equality: &str, keyframe: Option<&str>) -> LoopJointSpec {
    let text = PAIR.replace("EQUALITY", equality);
    let options = MjcfOptions { keyframe: keyframe.map(str::to_owned), ..MjcfOptions::default() };
    let mut read = parse(&text, "pair.xml", &options).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(read.loop_joints.len(), 1, "{equality}");
    read.loop_joints.remove(0)
}

/// The frames of a constraint do not depend on the keyframe. Both sites count, though they are 1.8 m apart.
#[test]
fn frames_of_constraints_are_those_of_mujoco() {
    let points = |spec: &LoopJointSpec| spec.anchors.unwrap().map(|frame| frame.translation.vector);
    for keyframe in [None, Some("bent")] {
        let by_sites = joint(r#"<connect site1="tip" site2="hook"/>"#, keyframe);
        assert_eq!(points(&by_sites), [Vec3::new(0.0, 0.0, -1.0), Vec3::new(0.5, 0.0, 0.0)]);
        let reversed = joint(r#"<connect site1="hook" site2="tip"/>"#, keyframe);
        assert_eq!(points(&reversed), [Vec3::new(0.5, 0.0, 0.0), Vec3::new(0.0, 0.0, -1.0)]);
        let by_bodies = joint(r#"<connect body1="a" body2="b" anchor="0 0 -1"/>"#, keyframe);
        assert_eq!(points(&by_bodies), [Vec3::new(0.0, 0.0, -1.0), Vec3::new(-1.0, 0.0, -1.0)]);
        let to_world = joint(r#"<connect body1="b" anchor="0 0 -1"/>"#, keyframe);
        assert_eq!(points(&to_world), [Vec3::new(0.0, 0.0, -1.0), Vec3::new(1.0, 0.0, -1.0)]);
        let weld = joint(r#"<weld body1="a" body2="b"/>"#, keyframe);
        assert_eq!(points(&weld), [Vec3::new(1.0, 0.0, 0.0), Vec3::zeros()]);
        let weld = joint(r#"<weld body1="a" body2="b" anchor="0 2 0"/>"#, keyframe);
        assert_eq!(points(&weld), [Vec3::new(1.0, 2.0, 0.0), Vec3::new(0.0, 2.0, 0.0)]);
        // the position of `relpose` is the point of the weld in the first body
        let weld = joint(r#"<weld body1="a" body2="b" anchor="0 2 0" relpose="0 0 3 0 0 0 2"/>"#, keyframe);
        assert_eq!(points(&weld), [Vec3::new(0.0, 0.0, 3.0), Vec3::new(0.0, 2.0, 0.0)]);
        assert!((weld.anchors.unwrap()[0].rotation.angle() - std::f64::consts::PI).abs() < 1e-15);
    }
}

/// The same constraints in MuJoCo: its residual is that of the joint that the reader makes.
#[test]
fn errors_of_constraints_are_those_of_mujoco() {
    let folder = Folder::new("pair");
    let file = folder.0.join("pair.xml");
    for equality in [
        r#"<connect name="e" site1="tip" site2="hook"/>"#,
        r#"<connect name="e" body1="a" body2="b" anchor="0 0 -1"/>"#,
        r#"<connect name="e" body1="b" anchor="0 0 -1"/>"#,
    ] {
        std::fs::write(&file, PAIR.replace("EQUALITY", equality)).unwrap();
        let options = MjcfOptions { keyframe: Some("bent".into()), ..MjcfOptions::default() };
        let (world, _) = load(&file, &options).unwrap().build().unwrap();
        let Some(theirs) = residuals(&file) else { return };
        let ours = errors(&world)["e"];
        assert!(ours > 0.1 && (ours - theirs["e"]).abs() < 1e-12, "{equality}: {ours} {}", theirs["e"]);
    }
}

/// `efc_pos` of MuJoCo 4.0 is (0, −0.5, 0) at the start of this model, and `b − a` comes to rest at a length of √1.25 m.
#[test]
fn a_weld_with_a_pose_and_an_anchor_is_open_as_in_mujoco() {
    let text = r#"<mujoco><option gravity="0 0 0"/><worldbody>
        <body name="a"><freejoint/><geom size=".1" contype="0" conaffinity="0"/></body>
        <body name="b" pos="1 0 0"><freejoint/><geom size=".1" contype="0" conaffinity="0"/></body></worldbody>
        <equality><weld name="w" body1="a" body2="b" anchor="0 .5 0" relpose="1 0 0 1 0 0 0"/></equality></mujoco>"#;
    let scene = parse(text, "weld.xml", &MjcfOptions::default()).unwrap();
    let (world, _) = scene.build().unwrap();
    let error = world.get::<LoopJoint>(world.find("w").unwrap()).unwrap().position_error(&world.view()).unwrap();
    assert!((error.distance - 0.5).abs() < 1e-15 && error.angle < 1e-15, "{} {}", error.distance, error.angle);
    let [a, b] = scene.loop_joints[0].anchors.unwrap();
    assert!(((a * b.inverse()).translation.vector.norm() - 1.25f64.sqrt()).abs() < 1e-15);
}

/// Joints of two robots that follow each other, bent at time 0.
const COUPLED: &str = r#"
[world]
combine_friction = "max"
[[articulated]]
name = "left"
initial_positions = { turn = 0.25 }
[[articulated.link]]
name = "upper"
joint = "revolute"
joint_name = "turn"
axis = [0, 1, 0]
mass_kg = 1
center_m = [0, 0, -0.2]
inertia_kg_m2 = [0.01, 0.01, 0.01]
[[articulated]]
name = "right"
position_m = [0.6, 0, 0]
initial_positions = { slide = -0.4 }
[[articulated.link]]
name = "hand"
joint = "prismatic"
joint_name = "slide"
axis = [1, 0, 0]
mass_kg = 1
inertia_kg_m2 = [0.01, 0.01, 0.01]
[[body]]
name = "wheel"
shape = { type = "sphere", radius_m = 0.05 }
mass_kg = 1
position_m = [0, 2, 0]
[[loop_joint]]
name = "axle"
type = "revolute"
a = "wheel"
position_m = [0, 2, 0]
axis = [0, 0, 1]
[[mimic]]
name = "follow"
joint = "right/hand"
of = "left/upper"
multiplier = -2
offset_m = 0.1
[[mimic]]
name = "spin"
joint = "axle"
of = "left/upper"
multiplier = 3
"#;

/// `q = multiplier·q_of + offset`: −0.4 = −2·0.25 + 0.1. MuJoCo's residual is 0 with that, and would be 1.05 with the joints exchanged.
#[test]
fn couplings_of_two_robots_are_written() {
    let scene = SceneFile::parse(COUPLED, "coupled.toml").unwrap_or_else(|error| panic!("{error}"));
    let (world, _) = scene.build().unwrap();
    let folder = Folder::new("coupled");
    let file = folder.0.join("coupled.xml");
    let notes = MjcfWriter::new(&world).like(&scene).save(&file).unwrap();
    let named = |name: &str| notes.iter().filter(|note| note.contains(name)).count();
    assert_eq!([named("spin"), named("axle"), named("follow")], [1, 1, 0], "{notes:?}");
    let read = load(&file, &MjcfOptions { keyframe: Some("now".into()), ..MjcfOptions::default() }).unwrap();
    let [mimic] = &read.mimics[..] else { panic!("{:?}", read.mimics) };
    assert_eq!((mimic.name.as_str(), mimic.multiplier, mimic.offset), ("follow", -2.0, 0.1));
    assert_eq!([mimic.joint, mimic.of], [JointSideSpec::Link(1, 0), JointSideSpec::Link(0, 0)]);
    let (again, _) = read.build().unwrap();
    let mimic = again.get::<Mimic>(again.find("follow").unwrap()).unwrap();
    assert!(mimic.error(&again.view()).unwrap().abs() < 1e-15);
    let Some(residuals) = residuals(&file) else { return };
    assert_eq!(residuals.len(), 1);
    assert!(residuals["follow"] < 1e-15, "{residuals:?}");
}

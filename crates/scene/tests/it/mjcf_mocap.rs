//! Mocap bodies of MJCF: what refers to them moves with their kinematic bodies. Numbers are those of MuJoCo 4.0.

use nalgebra::{Quaternion, Unit};
use tumble_core::collide::{Pose, Vec3};
use tumble_core::{Mode, World};
use tumble_scene::mjcf::{MjcfOptions, parse};
use tumble_scene::{BodySpec, PartSpec, SceneFile, ShapeSpec};

/// A gripper that a mocap body steers, with a body on it, and a ball that is seen from it.
const MODEL: &str = r#"<mujoco><option gravity="0 0 0"/><worldbody>
  <body name="mc" mocap="true" pos="0 0 1" quat="1 0 0 1">GEOM<site name="tip" pos="0.1 0 0.2"/>
    <body name="kid" pos="0 0.3 0"><geom name="kid" size="0.05" contype="0" conaffinity="0"/>
      <site name="toe" pos="0 0 -0.1" quat="1 1 0 0"/></body></body>
  <body name="hand" pos="0 0 1"><freejoint/><geom type="box" size="0.1 0.1 0.1"/></body>
  <body name="eye" pos="0 2 1"><freejoint/><geom size="0.1"/><site name="lens" pos="0 0 0.3"/></body></worldbody>
  <equality>EQUALITY</equality>
  <sensor><framepos name="tip" objtype="site" objname="tip"/><framepos name="toe" objtype="site" objname="toe"/>
    <framequat name="turn" objtype="site" objname="toe"/>
    <framepos name="seen" objtype="site" objname="lens" reftype="xbody" refname="mc"/></sensor></mujoco>"#;
const GEOM: &str = r#"<geom name="own" size="0.05" contype="0" conaffinity="0"/>"#;

fn model(geom: &str, equality: &str) -> SceneFile {
    let text = MODEL.replace("GEOM", geom).replace("EQUALITY", equality);
    parse(&text, "m.xml", &MjcfOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

fn mocap(scene: &SceneFile) -> (usize, &BodySpec) {
    let found: Vec<_> = scene.bodies.iter().enumerate().filter(|(_, body)| body.mode == Mode::Kinematic).collect();
    assert_eq!(found.len(), 1);
    found[0]
}

fn close(world: &World, name: &str, expected: &[f64]) {
    let read = world.reading(world.find(name).unwrap()).unwrap();
    assert_eq!(read.len(), expected.len());
    for (read, expected) in read.iter().zip(expected) {
        assert!((read - expected).abs() < 1e-8, "{name}: {read} {expected}");
    }
}

#[test]
fn sensors_and_bodies_on_a_mocap_body_move_with_it() {
    for geom in [GEOM, ""] {
        let scene = model(geom, "");
        let (_, body) = mocap(&scene);
        let ShapeSpec::Compound { parts } = &body.shape else { panic!("{:?}", body.shape) };
        let kid = parts.iter().find(|part| part.name.as_deref() == Some("kid")).unwrap();
        let to = Pose::from_parts(
            Vec3::new(0.5, 0.2, 1.1).into(),
            Unit::new_normalize(Quaternion::new(f64::cos(0.3), 0.0, f64::sin(0.3), 0.0)),
        );
        // geom_xpos of MuJoCo
        assert!(((to * kid.pose).translation.vector - Vec3::new(0.5, 0.5, 1.1)).norm() < 1e-8);
        let (mut world, _) = scene.build().unwrap();
        let id = world.find("mc").unwrap();
        world.set_pose(id, to).unwrap();
        world.step().unwrap();
        // sensordata of MuJoCo with this mocap_pos and mocap_quat
        close(&world, "tip", &[0.69546206, 0.2, 1.20860288]);
        close(&world, "toe", &[0.44353575, 0.5, 1.01746644]);
        close(&world, "turn", &[0.67552491, 0.20896434, -0.20896434, 0.67552491]);
        close(&world, "seen", &[-0.5255963, 1.8, -0.11725411]);
    }
}

/// MuJoCo keeps the hand at rest relative to the mocap body, up to its soft constraint, which lags.
#[test]
fn a_mocap_body_carries_what_is_welded_or_connected_to_it() {
    for (geom, equality) in [
        (GEOM, r#"<weld body1="mc" body2="hand"/>"#),
        (GEOM, r#"<weld body1="hand" body2="mc"/>"#),
        (GEOM, r#"<weld body1="kid" body2="hand"/>"#),
        ("", r#"<connect body1="mc" body2="hand" anchor="0 0 0"/>"#),
    ] {
        let scene = model(geom, equality);
        let (index, _) = mocap(&scene);
        let [joint] = &scene.loop_joints[..] else { panic!("{:?}", scene.loop_joints) };
        assert!([joint.a, joint.b].contains(&Some(PartSpec::Body(index))), "{equality}: {joint:?}");
        let (mut world, _) = scene.build().unwrap();
        let (mc, hand) = (world.find("mc").unwrap(), world.find("hand").unwrap());
        world.set_velocity(mc, Vec3::new(0.5, 0.0, 0.0), Vec3::zeros()).unwrap();
        (0..500).for_each(|_| _ = world.step().unwrap());
        let at = world.pose(hand, 0).unwrap();
        assert!((at.translation.vector - Vec3::new(0.5, 0.0, 1.0)).norm() < 1e-9, "{equality}: {at}");
        assert!(at.rotation.angle() < 1e-9, "{equality}: {at}");
    }
}

#[test]
fn a_mocap_body_without_geoms_is_there_and_touches_nothing() {
    let text = r#"<mujoco><worldbody><body name="mc" mocap="true" pos="0 0 1"><site name="s"/></body>
        <body name="b"><freejoint/><geom size=".1"/></body></worldbody></mujoco>"#;
    let scene = parse(text, "m.xml", &MjcfOptions::default()).unwrap();
    let (_, body) = mocap(&scene);
    assert_eq!(
        (body.name.as_str(), body.collidable, body.visible, body.position_m),
        ("mc", false, false, [0.0, 0.0, 1.0])
    );
    assert!(scene.build().is_ok());
}

/// The hand collides, the ghost and the drawing do not; the hook has the friction of its geom.
#[test]
fn each_geom_of_a_mocap_body_keeps_its_surface_and_its_groups() {
    let text = r#"<mujoco><worldbody><body name="mc" mocap="true">
        <geom name="drawn" size="1" contype="0" conaffinity="0"/><geom name="grip" size="0.1" friction="0.5"/>
        <geom name="hook" size="0.1" pos="1 0 0" friction="0.9" conaffinity="2" contype="2" group="3"/>
        <camera name="c" pos="0 0 1"/><camera name="d" pos="0 0 2"/></body>
        <body name="b" pos="0 0 3"><freejoint/><geom size=".1"/></body>
        <body name="o" pos="0 0 9"><freejoint/><geom size=".1" contype="2" conaffinity="2"/></body></worldbody></mujoco>"#;
    let scene = parse(text, "m.xml", &MjcfOptions::default()).unwrap();
    let (_, body) = mocap(&scene);
    let ShapeSpec::Compound { parts } = &body.shape else { panic!("{:?}", body.shape) };
    let mask = |k: usize| parts[k].filter.mask.unwrap_or(body.mask);
    let group = |k: usize| parts[k].filter.group.unwrap_or(body.group);
    let friction = |k: usize| parts[k].surface.map_or(body.contact, |surface| surface.contact).friction;
    let of = |name: &str| scene.bodies.iter().find(|body| body.name == name).unwrap();
    let meets = |k: usize, name: &str| mask(k) & of(name).group.bit() != 0 && of(name).mask & group(k).bit() != 0;
    assert!(body.collidable);
    let met = [0, 1, 2].map(|k| (meets(k, "b"), meets(k, "o")));
    assert_eq!(met, [(false, false), (true, false), (false, true)]);
    assert_eq!([friction(1), friction(2)], [0.5, 0.9]);
    let camera = body.mounts.camera.as_ref().unwrap();
    assert_eq!(camera.pose.translation.vector, Vec3::new(0.0, 0.0, 1.0));
    let notes = scene.notes.iter().filter(|note| note.contains("after the first are left out")).count();
    assert_eq!(notes, 1, "{:?}", scene.notes);
    assert!(scene.build().is_ok());
}

#[test]
fn a_joint_below_a_mocap_body_is_noted() {
    let text = r#"<mujoco><worldbody><body name="mc" mocap="true"><geom size="0.1"/>
        <body name="flag"><joint name="j"/><geom size="0.1" pos="1 0 0"/></body></body></worldbody></mujoco>"#;
    let scene = parse(text, "m.xml", &MjcfOptions::default()).unwrap();
    assert!(scene.notes.iter().any(|note| note.contains("they do not follow it")), "{:?}", scene.notes);
}

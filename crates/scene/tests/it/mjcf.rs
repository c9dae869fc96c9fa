//! Models of MuJoCo (MJCF): closed forms, what becomes what, notes and errors. Comparisons with
//! MuJoCo itself are in `mujoco.rs`.

use std::f64::consts::PI;
use std::path::{Path, PathBuf};

use tumble_core::articulated::{Drive, Spring};
use tumble_core::collide::{Pose, Vec3};
use tumble_core::{ArticulatedBody, Combine, Joint, Mode, Object, World};
use tumble_scene::mjcf::{MjcfError, MjcfOptions, articulation, load, parse};
use tumble_scene::{LinkMassSpec, LoadOptions, LoopJointKind, PairSideSpec, SceneFile, ShapeSpec};

fn models() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/mjcf")
}

fn model(name: &str) -> SceneFile {
    load(models().join(name), &MjcfOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

fn read(text: &str) -> Result<SceneFile, MjcfError> {
    parse(text, "m.xml", &MjcfOptions::default())
}

fn worldbody(bodies: &str) -> SceneFile {
    read(&format!("<mujoco><worldbody>{bodies}</worldbody></mujoco>")).unwrap_or_else(|error| panic!("{error}"))
}

/// Returns the messages of a text that is wrong.
fn errors(text: &str) -> Vec<String> {
    let error = read(text).expect_err(text);
    assert!(!error.report(false).is_empty());
    error.to_string().lines().map(str::to_owned).collect()
}

fn state(world: &World, name: &str) -> Vec<f64> {
    world.state_of(world.find(name).unwrap()).unwrap().to_vec()
}

/// A rod of length `l` about its end: the period of a small swing is `2π·√(2l/(3g))`.
#[test]
fn a_pendulum_swings_with_the_period_of_its_closed_form() {
    let (length, g) = (0.6_f64, 9.81);
    let mut scene = worldbody(
        r#"<body name="rod"><joint name="pivot" axis="0 1 0" ref="0.1"/>
           <inertial pos="0 0 -0.3" mass="2" diaginertia="0.06 0.06 0"/></body>"#,
    );
    scene.world.dt_s = 1e-3;
    // The reference position is that of the joint at the pose of the file: it starts at rest there.
    let start = scene.articulated[0].links[0].joint.position[0];
    assert!((start - 0.1_f64.to_radians()).abs() < 1e-15);
    scene.articulated[0].links[0].joint.position[0] = start + 1e-3;
    let (mut world, _) = scene.build().unwrap();
    let half = PI * (2.0 * length / (3.0 * g)).sqrt();
    let steps = (half / 1e-3).round() as usize;
    (0..steps).for_each(|_| _ = world.step().unwrap());
    let end = state(&world, "rod")[0] - start;
    assert!((end + 1e-3).abs() < 2e-6, "{end}");
}

/// A drive of a velocity actuator and a slide without gravity: `v(t) = v*·(1 − e^(−kv·t/m))`.
#[test]
fn a_velocity_actuator_approaches_its_speed_exponentially() {
    let text = r#"<mujoco><option gravity="0 0 0" timestep="0.0005"/><worldbody>
        <body name="sled"><joint name="x" type="slide" axis="1 0 0"/><geom size="0.1" mass="2"/></body></worldbody>
        <actuator><velocity joint="x" kv="4"/></actuator>
        <keyframe><key name="go" ctrl="1.5"/></keyframe></mujoco>"#;
    let options = MjcfOptions { keyframe: Some("go".into()), ..MjcfOptions::default() };
    let (mut world, _) = parse(text, "m.xml", &options).unwrap().build().unwrap();
    (0..1000).for_each(|_| _ = world.step().unwrap());
    let expected = 1.5 * (1.0 - f64::exp(-4.0 * 0.5 / 2.0));
    assert!((state(&world, "sled")[1] - expected).abs() < 1e-3);
}

#[test]
fn units_and_defaults_are_those_of_the_format() {
    let text = r#"<mujoco><default><joint damping="2" range="-90 90"/>
        <default class="a"><joint damping="3"/><default class="b"><joint stiffness="5" springref="30"/></default></default></default>
        <worldbody><body childclass="a"><joint name="p" axis="0 0 2"/><geom size="0.1"/>
        <body childclass="b"><joint name="q" limited="false"/><geom size="0.1"/>
        <body><joint name="r" class="main" type="slide"/><geom size="0.1"/></body></body></body></worldbody></mujoco>"#;
    let scene = read(text).unwrap();
    let joints: Vec<_> = scene.articulated[0].links.iter().map(|link| &link.joint).collect();
    assert_eq!(joints[0].kind, Joint::Revolute { axis: Vec3::z() });
    assert_eq!((joints[0].dof.damping, joints[0].dof.limits), (3.0, Some([-PI / 2.0, PI / 2.0])));
    assert_eq!((joints[1].dof.damping, joints[1].dof.limits), (3.0, None));
    assert_eq!(joints[1].dof.spring, Some(Spring { stiffness: 5.0, rest: PI / 6.0 }));
    // Ranges of slides are lengths.
    assert_eq!((joints[2].dof.damping, joints[2].dof.limits), (2.0, Some([-90.0, 90.0])));
    assert_eq!((scene.world.dt_s, scene.world.combine_friction), (0.002, Combine::Max));
    // A ball of water of radius 0.1 m: 4/3·π·r³·1000 kg.
    let LinkMassSpec::Given(mass) = scene.articulated[0].links[0].mass else { panic!() };
    assert!((mass.mass - 4.0 / 3.0 * PI).abs() < 1e-12);
}

#[test]
fn bodies_become_static_rigid_kinematic_and_articulated_ones() {
    let scene = model("scene.xml");
    let modes =
        |mode: Mode| scene.bodies.iter().filter(|b| b.mode == mode).map(|b| b.name.as_str()).collect::<Vec<_>>();
    assert_eq!(modes(Mode::Static), ["floor", "hill", "board"]);
    assert_eq!(modes(Mode::Dynamic), ["crate", "dumbbell", "ghost"]);
    assert_eq!(modes(Mode::Kinematic), ["hand"]);
    assert_eq!(scene.articulated.iter().map(|a| a.name.as_str()).collect::<Vec<_>>(), ["rope1", "gears"]);
    let body = |name: &str| scene.bodies.iter().find(|b| b.name == name).unwrap();
    assert!(matches!(body("crate").shape, ShapeSpec::Box { size_m: [0.2, 0.4, 0.3] }));
    assert!(matches!(&body("dumbbell").shape, ShapeSpec::Compound { parts } if parts.len() == 3));
    assert_eq!(body("ghost").gravity_scale, 0.0);
    // The ghost meets nothing of the model; groups of others are open.
    let (ghost, crate_) = (body("ghost"), body("crate"));
    assert_eq!((ghost.mask & crate_.group.bit(), crate_.mask & ghost.group.bit()), (0, 0));
    assert_ne!(crate_.mask & body("floor").group.bit(), 0);
    let total: f64 = scene
        .bodies
        .iter()
        .filter_map(|b| b.mass)
        .map(|mass| match mass {
            tumble_scene::MassSpec::Mass(kg) => kg,
            _ => panic!(),
        })
        .sum();
    let links: f64 = scene
        .articulated
        .iter()
        .flat_map(|a| &a.links)
        .map(|link| match link.mass {
            LinkMassSpec::Given(mass) => mass.mass,
            _ => panic!(),
        })
        .sum();
    // The shelf (16 kg) and the hand (a sphere of 5 cm) count too; a crate of 24 kg has the scale.
    let Some(tumble_scene::MassSpec::Mass(crated)) = crate_.mass else { panic!() };
    let fixed = crated / 24.0 * (16.0 + 4000.0 / 3.0 * PI * 0.05_f64.powi(3));
    assert!((total + links + fixed - 12.0).abs() < 1e-9, "{total} {links} {fixed}");
    let kinds: Vec<_> = scene.loop_joints.iter().map(|joint| (joint.name.as_str(), joint.kind)).collect();
    assert_eq!(kinds, [("tied", LoopJointKind::Spherical), ("equality1", LoopJointKind::Fixed)]);
    // q₂ + 0.1 = 0.05 − 2(q₁ − 0.2)
    let mimic = scene.articulated[1].links[1].joint.mimic.unwrap();
    assert_eq!((mimic.link, mimic.multiplier), (0, -2.0));
    assert!((mimic.offset - (-0.1 + 0.05 + 0.4)).abs() < 1e-15, "{}", mimic.offset);
    assert_eq!(scene.pairs.len(), 3);
    assert_eq!((scene.pairs[0].friction, scene.pairs[0].collides), (Some(0.9), Some(true)));
    assert!(scene.pairs[1..].iter().all(|pair| pair.collides == Some(false)));
    assert!(scene.pairs.iter().any(|pair| matches!(pair.sides[1], PairSideSpec::Link(0, _))));
    // It can be built and stepped.
    let (mut world, _) = scene.build().unwrap();
    (0..5).for_each(|_| _ = world.step().unwrap());
}

#[test]
fn several_joints_of_a_body_are_a_chain_with_its_frame_at_the_end() {
    let scene = worldbody(
        r#"<body name="b" pos="0 0 1"><joint name="h" axis="0 0 1" pos="1 0 0"/><joint name="s" type="slide" axis="1 0 0" pos="1 0 0"/>
           <geom size="0.1"/><site name="tip" pos="0 0 0.5"/></body>"#,
    );
    let links = &scene.articulated[0].links;
    let names: Vec<_> = links.iter().map(|l| (l.name.as_str(), l.joint.name.as_str())).collect();
    assert_eq!(names, [("b/h", "h"), ("b/s", "s"), ("b", "b"), ("tip", "tip")]);
    let (world, _) = scene.build().unwrap();
    let body = world.get::<ArticulatedBody>(world.find("b").unwrap()).unwrap();
    assert_eq!(body.model().links().len(), 2);
    // A quarter turn about (1, 0) and then 2 m along the turned x axis: (0, 0) goes to (1, −1) + (0, 2).
    let mut kinematics = tumble_core::articulated::Kinematics::new(body.model());
    kinematics.refresh(body.model(), &[PI / 2.0, 2.0], &[0.0; 2]);
    let pose = kinematics.frame_pose(body.model().frame("tip").unwrap());
    assert!((pose.translation.vector - Vec3::new(1.0, 1.0, 1.5)).norm() < 1e-12, "{pose}");
}

#[test]
fn actuators_with_feedback_on_one_joint_become_one_drive() {
    let text = r#"<mujoco><worldbody><body><joint name="j"/><geom size="0.1"/></body></worldbody><actuator>
        <position name="p" joint="j" kp="10" gear="2" forcerange="-3 3"/><velocity joint="j" kv="0.5" forcerange="-1 1"/>
        <motor name="m" joint="j" gear="7"/></actuator>
        <keyframe><key ctrl="0.4 0 0"/></keyframe></mujoco>"#;
    let scene = parse(text, "m.xml", &MjcfOptions { keyframe: Some("0".into()), ..MjcfOptions::default() }).unwrap();
    let drive = &scene.articulated[0].links[0].joint.dof.drive;
    // τ = 2·10·(0.4 − 2q) − 0.5·q̇: a target of 0.2 rad. The motor has no range, so the sum has none.
    let Drive::Position { stiffness, damping, target, velocity, limit } = *drive else { panic!("{drive:?}") };
    assert_eq!((stiffness, damping, target, velocity, limit), (40.0, 0.5, 0.2, 0.0, f64::INFINITY));
    let motor = &scene.actuators[2];
    assert_eq!((motor.name.as_str(), &motor.moments[..], motor.force(0.3, 1.0, 0.5)), ("m", &[(0, 7.0)][..], 0.5));
    assert_eq!(scene.actuators[0].force(0.0, 0.0, 9.0), 3.0);
}

#[test]
fn a_keyframe_is_the_initial_state() {
    let options = MjcfOptions { keyframe: Some("tilted".into()), ..MjcfOptions::default() };
    let scene = load(models().join("cartpole.xml"), &options).unwrap();
    let (world, _) = scene.build().unwrap();
    assert_eq!(state(&world, "cart"), [0.5, 0.3, -0.1, 0.2]);
    let error =
        load(models().join("cartpole.xml"), &MjcfOptions { keyframe: Some("x".into()), ..options }).unwrap_err();
    assert!(
        error.to_string().contains("cartpole.xml:1:1: <mujoco> has no keyframe \"x\"; expected one of tilted"),
        "{error}"
    );
    // Free bodies: position, quaternion w x y z; velocities linear in world axes, angular in body axes.
    let text = r#"<mujoco><worldbody><body name="b"><freejoint/><geom size="0.1" pos="0.5 0 0"/></body></worldbody>
        <keyframe><key qpos="1 2 3 0.7071067811865476 0 0 0.7071067811865476" qvel="0 0 1 0 2 0"/></keyframe></mujoco>"#;
    let scene = parse(text, "m.xml", &MjcfOptions { keyframe: Some("0".into()), ..MjcfOptions::default() }).unwrap();
    let body = &scene.bodies[0];
    assert_eq!(body.position_m, [1.0, 2.0, 3.0]);
    let near = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12);
    // ω = Rz(90°)·(0, 2, 0) = (−2, 0, 0); the center is at Rz(90°)·(0.5, 0, 0) = (0, 0.5, 0); ω × r = (0, 0, −1).
    assert!(near(body.angular_velocity_rad_per_s, [-2.0, 0.0, 0.0]));
    assert!(near(body.velocity_m_per_s, [0.0, 0.0, 0.0]), "{:?}", body.velocity_m_per_s);
}

#[test]
fn what_is_left_out_is_noted_with_file_line_and_element() {
    let scene = read(
        "<mujoco>\n<visual/>\n<worldbody>\n<geom name=\"g\" size=\"0.1\" solref=\"0.1 1\"/>\n<geom size=\"0.1\" solimp=\"1 1 1\"/>\n\
         <body name=\"b\"><joint name=\"j\" type=\"ball\" range=\"0 30\"/><geom size=\"1\"/></body>\n</worldbody>\n\
         <actuator>\n<muscle joint=\"j\"/>\n</actuator><sensor><jointpos joint=\"j\"/></sensor></mujoco>",
    )
    .unwrap();
    let notes = &scene.notes;
    let has = |text: &str| assert!(notes.iter().any(|note| note.starts_with(text)), "{text}: {notes:#?}");
    has("m.xml:2: <visual>: <visual> is left out");
    has("m.xml:4: geom \"g\" and 1 more: soft contacts");
    has("m.xml:6: joint \"j\": the limit of a ball joint's rotation becomes one of its swing, and one of its twist");
    has("m.xml:9: the muscle of <actuator>: <muscle> actuators are left out");
    has("m.xml:10: the jointpos of <sensor>: couplings, actuators and sensors of ball and free joints are left out");
    assert_eq!(notes.len(), 5, "{notes:#?}");
}

#[test]
fn wrong_files_are_errors_with_line_value_and_what_is_right() {
    let cases: &[(&str, &str)] = &[
        ("<robot/>", "m.xml:1:1: <robot> is the outermost element; expected <mujoco>; a URDF has the extension .urdf"),
        ("<mujoco>", "m.xml:1:9: XML: the root node was opened but never closed; expected MJCF"),
        ("<mujoco><bodyworld/></mujoco>", "<bodyworld> is not a section of <mujoco>; expected a section of MJCF"),
        ("<mujoco><worldbod/></mujoco>", "did you mean <worldbody>?"),
        (
            "<mujoco><compiler angle=\"deg\"/></mujoco>",
            "`angle` of <compiler> is \"deg\"; expected `degree` or `radian`",
        ),
        (
            "<mujoco><compiler eulerseq=\"xyw\"/></mujoco>",
            "`eulerseq` of <compiler> is \"xyw\"; expected three letters",
        ),
        ("<mujoco><compiler coordinate=\"global\"/></mujoco>", "expected local"),
        (
            "<mujoco><option timestep=\"0\"/></mujoco>",
            "`timestep` of <option> is \"0\"; expected a time from 1e-6 to 1 s",
        ),
        ("<mujoco><include file=\"x.xml\"/></mujoco>", "`file` of <include> is \"x.xml\"; expected the path of a file"),
    ];
    for (text, expected) in cases {
        let said = errors(text);
        assert!(said.len() == 1 && said[0].contains(expected), "{text}: {said:#?}");
    }
    let cases: &[(&str, &str)] = &[
        ("<geom/>", "the geom of <worldbody> has no `size`; expected 1 positive number, half sizes in meters"),
        (
            "<geom name=\"g\" type=\"box\" size=\"1 -1 1\"/>",
            "`size` of geom \"g\" is \"1 -1 1\"; expected 3 positive numbers",
        ),
        (
            "<geom type=\"cube\" size=\"1\"/>",
            "`type` of the geom of <worldbody> is \"cube\"; expected `plane`, `sphere`",
        ),
        ("<geom size=\"1\" colr=\"1 0 0\"/>", "unknown attribute `colr` of the geom of <worldbody>"),
        ("<geom size=\"1\" frictoin=\"1\"/>", "did you mean `friction`?"),
        ("<geom size=\"1\" pos=\"0 0\"/>", "`pos` of the geom of <worldbody> is \"0 0\"; expected 3 numbers"),
        ("<geom size=\"1\" pos=\"0 0 nan\"/>", "expected 3 numbers separated by spaces; each a finite number"),
        ("<geom size=\"1\" quat=\"0 0 0 0\"/>", "expected a quaternion w, x, y, z that is not 0"),
        (
            "<geom size=\"1\" euler=\"0 0 0\" zaxis=\"1 0 0\"/>",
            "has both `euler` and `zaxis`; expected one orientation",
        ),
        (
            "<geom size=\"1\" class=\"c\"/>",
            "`class` of the geom of <worldbody> is \"c\"; expected the name of a default class",
        ),
        ("<geom size=\"1\" material=\"m\"/>", "expected the name of a material of <asset>"),
        ("<geom type=\"mesh\" mesh=\"m\"/>", "expected the name of a mesh of <asset>"),
        ("<geom type=\"capsule\" size=\"1\" fromto=\"0 0 0 0 0 0\"/>", "expected two points that differ"),
        ("<geom name=\"a\" size=\"1\"/><geom name=\"a\" size=\"1\"/>", "geom \"a\" has a name that is used before"),
        ("<body name=\"b\"><joint/></body>", "body \"b\" moves no mass"),
        (
            "<body><joint axis=\"0 0 0\"/><geom size=\"1\"/></body>",
            "`axis` of the joint of the body of <worldbody> is \"0 0 0\"",
        ),
        ("<body><joint range=\"2 1\"/><geom size=\"1\"/></body>", "expected two numbers, the lower first"),
        ("<body><joint/><geom type=\"plane\" size=\"1 1 1\"/><geom size=\"1\"/></body>", "is on a body that moves"),
        (
            "<body><inertial mass=\"1\" diaginertia=\"1 1 9\"/><freejoint/></body>",
            "no principal moment greater than the sum",
        ),
        ("<body><freejoint/><joint/><geom size=\"1\"/></body>", "has a free joint; expected it as the only joint"),
        (
            "<replicate count=\"0\"/>",
            "`count` of the replicate of <worldbody> is \"0\"; expected a whole number from 1",
        ),
    ];
    for (body, expected) in cases {
        let said = errors(&format!("<mujoco><worldbody>{body}</worldbody></mujoco>"));
        assert!(said.len() == 1 && said[0].contains(expected) && said[0].starts_with("m.xml:1:"), "{body}: {said:#?}");
    }
}

#[test]
fn all_problems_of_all_files_are_reported_at_once() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("mjcf_includes");
    std::fs::create_dir_all(&folder).unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.join(name), text).unwrap();
    write(
        "main.xml",
        "<mujoco><include file=\"a.xml\"/>\n<worldbody><geom/></worldbody>\n<include file=\"a.xml\"/></mujoco>",
    );
    write(
        "a.xml",
        "<mujoco>\n<worldbody><geom size=\"x\"/></worldbody><include file=\"main.xml\"/><include file=\"none.xml\"/></mujoco>",
    );
    let error = load(folder.join("main.xml"), &MjcfOptions::default()).unwrap_err();
    let said: Vec<String> = error.to_string().lines().map(|l| l.replace(&folder.display().to_string(), "")).collect();
    assert_eq!(error.problems().len(), said.len());
    for part in [
        "/main.xml:3:16: `file` of <include> is \"a.xml\"; expected a file that is not included a second time",
        "/a.xml:2:",
    ] {
        assert!(said.iter().any(|line| line.starts_with(part)), "{part}: {said:#?}");
    }
    assert!(said.iter().any(|line| line.contains("none.xml: cannot read")), "{said:#?}");
    // Without the cycle the numbers are read.
    write("main.xml", "<mujoco><include file=\"a.xml\"/>\n<worldbody><geom/></worldbody></mujoco>");
    write("a.xml", "<mujoco>\n<worldbody><geom size=\"x\"/></worldbody></mujoco>");
    let error = load(folder.join("main.xml"), &MjcfOptions::default()).unwrap_err().to_string();
    assert!(error.contains("main.xml:2:12: the geom of <worldbody> has no `size`"), "{error}");
    assert!(error.contains("a.xml:2:24: `size` of the geom of <worldbody> is \"x\""), "{error}");
}

#[test]
fn scenes_and_single_bodies_are_read_from_the_same_files() {
    let path = models().join("cartpole.xml");
    let scene = SceneFile::load_with(&path, &LoadOptions::default()).unwrap();
    assert_eq!((scene.articulated.len(), scene.world.dt_s), (1, 0.01));
    assert!(scene.camera.is_some());
    let (body, joints, notes) = articulation(&path, &MjcfOptions::default()).unwrap();
    assert_eq!((body.name(), &joints[..]), ("cart", &["slider".to_owned(), "hinge".to_owned()][..]));
    assert!(notes.iter().any(|note| note.contains("static and rigid bodies")), "{notes:?}");
    let error = articulation(models().join("scene.xml"), &MjcfOptions::default()).map(drop).unwrap_err();
    assert!(error.to_string().ends_with(
        "the model has 2 articulated bodies (rope1, gears); expected one, or read the whole model as a scene"
    ));
    let text = "[[articulated]]\nname = \"c\"\nmjcf = \"cartpole.xml\"\nkeyframe = \"tilted\"\nposition_m = [0, 0, 1]\nfriction = 0.1\n\
                [[articulated.joint]]\nname = \"hinge\"\ndamping_n_m_s_per_rad = 0.5\n";
    let scene = SceneFile::parse(text, &models().join("s.toml").display().to_string()).unwrap();
    let spec = &scene.articulated[0];
    assert_eq!((spec.name.as_str(), spec.base), ("c", Pose::translation(0.0, 0.0, 1.0)));
    assert_eq!((spec.links[1].joint.dof.damping, spec.links[1].joint.position[0]), (0.5, 0.3));
    assert!(spec.links.iter().flat_map(|l| &l.shapes).all(|s| s.surface.contact.friction == 0.1));
    let wrong = SceneFile::parse("[[articulated]]\nname = \"c\"\nmjcf = \"none.xml\"\nfloating = true\n", "s.toml");
    let wrong = wrong.unwrap_err().to_string();
    assert!(wrong.contains("s.toml:3:8: `mjcf` of articulated \"c\": none.xml: cannot read the MJCF file"), "{wrong}");
    assert!(wrong.contains("expected no `floating` with `mjcf`"), "{wrong}");
}

#[test]
fn the_floor_of_a_model_holds_its_bodies() {
    let scene = worldbody(
        r#"<geom name="floor" type="plane" size="1 1 1" friction="0.3"/>
           <body name="box" pos="0 0 0.1"><freejoint/><geom type="box" size="0.1 0.1 0.1"/></body>"#,
    );
    assert!(scene.ground.is_some());
    let (mut world, _) = scene.build().unwrap();
    (0..500).for_each(|_| _ = world.step().unwrap());
    assert!((state(&world, "box")[2] - 0.1).abs() < 1e-6, "{:?}", state(&world, "box"));
}

#[test]
fn deep_and_large_files_are_refused() {
    let deep = format!("<mujoco><worldbody>{}{}</worldbody></mujoco>", "<body>".repeat(5000), "</body>".repeat(5000));
    assert!(errors(&deep)[0].contains("is nested too deeply; expected at most 200 levels"));
    let many = "<mujoco><worldbody><replicate count=\"9999\"><replicate count=\"9999\"><geom size=\"1\"/></replicate></replicate></worldbody></mujoco>";
    assert!(errors(many)[0].contains("is one too many; expected at most"));
}

/// Feet with rolling and torsional friction (`condim` 6) that random torques make stick, roll and spin: nearly
/// all solves of all laws converge, and no step fails.
#[test]
fn a_quadruped_on_feet_of_all_laws_of_friction_steps() {
    let scene = SceneFile::load(models().join("quadruped.xml")).unwrap();
    let start = scene.build().unwrap().0;
    let (mut seed, mut unconverged) = (1u64, 0);
    let mut random = || {
        seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (seed >> 11) as f64 / (1u64 << 53) as f64 - 0.5
    };
    for _ in 0..10 {
        let mut world = start.fork();
        let trunk = world.find("trunk").unwrap();
        for _ in 0..100 {
            let mut torque = [0.0; 18];
            torque[6..].iter_mut().for_each(|torque| *torque = 2.0 * random());
            world.apply_generalized(trunk, &torque).unwrap();
            unconverged += world.step().unwrap().unconverged;
        }
    }
    assert!(unconverged <= 30, "{unconverged} of 1000 steps");
}

/// MuJoCo 4.0 compiles this body to 4.1887902 kg and 0.01675516 kg·m², and refuses the inertia where it has no geom.
#[test]
fn an_inertia_that_geoms_replace_is_not_checked() {
    let body = |geom: &str, how: &str| {
        format!(
            r#"<mujoco><compiler inertiafromgeom="{how}"/><worldbody><body name="b"><joint/>
            <inertial pos="0 0 0" mass="1" diaginertia="1 1 9"/>{geom}</body></worldbody></mujoco>"#
        )
    };
    let ball = r#"<geom size=".1"/>"#;
    let scene = read(&body(ball, "true")).unwrap();
    let LinkMassSpec::Given(mass) = scene.articulated[0].links[0].mass else { panic!() };
    assert!((mass.mass - 4.1887902).abs() < 1e-7 && (mass.inertia[(0, 0)] - 0.01675516).abs() < 1e-8);
    assert!(errors(&body("", "true"))[0].contains("has an inertia that no body has"));
    assert!(errors(&body(ball, "auto"))[0].contains("diaginertia"));
    // without a geom the numbers of <inertial> count, as in MuJoCo
    let scene = read(&body("", "true").replace("1 1 9", "1 1 1")).unwrap();
    let LinkMassSpec::Given(mass) = scene.articulated[0].links[0].mass else { panic!() };
    assert_eq!((mass.mass, mass.inertia[(0, 0)]), (1.0, 1.0));
}

/// MuJoCo 4.0 compiles the first number to `jnt_stiffness` and `dof_damping`, the others to `jnt_stiffnesspoly` and
/// `dof_dampingpoly`.
#[test]
fn polynomials_of_stiffness_and_damping_are_noted() {
    let scene = worldbody(
        r#"<body name="b"><joint stiffness="1 2 3" damping=".1 .2"/><geom size="0.1" pos=".3 0 0"/></body>
           <body name="c"><joint stiffness="4 0 0" damping=".5"/><geom size="0.1" pos=".3 0 0"/></body>"#,
    );
    let dof = |tree: usize| &scene.articulated[tree].links[0].joint.dof;
    assert_eq!((dof(0).spring.unwrap().stiffness, dof(0).damping), (1.0, 0.1));
    assert_eq!((dof(1).spring.unwrap().stiffness, dof(1).damping), (4.0, 0.5));
    assert_eq!(scene.notes.len(), 1, "{:?}", scene.notes);
    let note = &scene.notes[0];
    assert!(note.contains("`stiffness` and `damping`"), "{note}");
    let wrong = |joint: &str| {
        format!(r#"<mujoco><worldbody><body><joint {joint}/><geom size=".1"/></body></worldbody></mujoco>"#)
    };
    assert!(errors(&wrong(r#"stiffness="-1 2""#))[0].contains("at least 0 as the first number"));
    assert!(errors(&wrong(r#"damping="1 2 3 4""#))[0].contains("1 to 3 numbers"));
}

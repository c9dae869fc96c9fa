//! Joints of links, shapes of compounds, drives in events and pairs of links in scenes: the world has what the text says, and saves it.

use std::f64::consts::{FRAC_PI_2, PI};

use tumble_core::articulated::{Drive, Spring};
use tumble_core::collide::{Quat, Vec3};
use tumble_core::{ArticulatedBody, CollisionGroup, LoopJoint, PairMaterial, PairSide, RigidBody, ShapeFilter, World};
use tumble_scene::mjcf::{MjcfOptions, MjcfWriter};
use tumble_scene::{SceneFile, SceneWriter};

use crate::bad_input::assert_errors;
use crate::mjcf_written::Folder;

fn build(text: &str) -> World {
    let scene = SceneFile::parse(text, "s.toml").unwrap_or_else(|error| panic!("{}", error.report(false)));
    scene.build().unwrap_or_else(|error| panic!("{error}")).0
}

/// Saves a world as a scene and reads the text alone, without the state beside it.
fn again(name: &str, world: &World) -> World {
    let folder = Folder::new(name);
    let path = folder.0.join("scene.toml");
    let notes = SceneWriter::new(world).save(&path).unwrap_or_else(|error| panic!("{name}: {error}"));
    assert_eq!(notes, Vec::<String>::new(), "{name}");
    let text = std::fs::read_to_string(&path).unwrap();
    std::fs::write(&path, format!("{text}# edited\n")).unwrap();
    let scene = SceneFile::load(&path).unwrap_or_else(|error| panic!("{}\n{text}", error.report(false)));
    scene.build().unwrap_or_else(|error| panic!("{error}\n{text}")).0
}

fn robot(world: &World) -> &ArticulatedBody {
    world.get(world.find("robot").unwrap()).unwrap()
}

const LAMP: &str = r#"
[[articulated]]
name = "robot"
[[articulated.link]]
name = "lamp"
joint = "spherical"
mass_kg = 1
"#;

/// A robot with one link and more lines for its joint, from line 8 on.
fn lamp(lines: &str) -> String {
    format!("{LAMP}{lines}\nshape = {{ type = \"sphere\", radius_m = 0.1 }}\n")
}

#[test]
fn a_spherical_joint_of_a_link_has_the_settings_of_a_loop_joint() {
    let text = lamp(
        "damping_n_m_s_per_rad = 0.2\narmature_kg_m2 = 0.1\ncone_deg = 30\ntwist_limits_deg = [-20, 40]\naxis = [0, 1, 0]\n\
         effort_n_m = 9\nspring = { stiffness_n_m_per_rad = 5 }\ninitial_rotation = { axis = [0, 0, 1], angle_deg = 90 }\n\
         drive = { type = \"position\", stiffness_n_m_per_rad = 50, damping_n_m_s_per_rad = 2 }\n\
         dof = [{ spring = { stiffness_n_m_per_rad = 7, rest_rad = 0.5 } }, { friction_n_m = 0.3 }]",
    );
    let world = build(&text);
    for world in [&world, &again("spherical", &world), &again("spherical-2", &again("spherical-3", &world))] {
        let dofs = robot(world).dofs();
        assert_eq!(dofs[0].spring, Some(Spring { stiffness: 7.0, rest: 0.5 }));
        assert_eq!(dofs[1].spring, Some(Spring { stiffness: 5.0, rest: 0.0 }));
        assert_eq!([0, 1, 2].map(|k| dofs[k].friction), [0.0, 0.3, 0.0]);
        assert_eq!([0, 1, 2].map(|k| dofs[k].damping), [0.2; 3]);
        assert_eq!([0, 2].map(|k| (dofs[k].limits, dofs[k].twist_limits)), [(None, None); 2]);
        assert!((dofs[1].limits.unwrap()[1] - PI / 6.0).abs() < 1e-12);
        let [lower, upper] = dofs[1].twist_limits.unwrap();
        assert!((lower + PI / 9.0).abs() < 1e-12 && (upper - 2.0 * PI / 9.0).abs() < 1e-12);
        // a drive without a target holds the rotation at the start
        for (k, target) in [0.0, 0.0, FRAC_PI_2].into_iter().enumerate() {
            let Drive::Position { stiffness, damping, target: own, limit, .. } = dofs[k].drive else { panic!() };
            assert_eq!((stiffness, damping, limit), (50.0, 2.0, 9.0));
            assert!((own - target).abs() < 1e-12, "{k}: {own}");
        }
        let start = Quat::from_scaled_axis(Vec3::z() * FRAC_PI_2);
        assert!(
            (world.part_state(world.find("robot").unwrap(), 0).unwrap().pose.rotation.inverse() * start).angle() < 1e-7
        );
    }
}

#[test]
fn wrong_settings_of_spherical_joints_name_their_line() {
    let lines = |line: &str| lamp(line);
    let error = |line: &str| SceneFile::parse(&lines(line), "s.toml").unwrap_err().to_string();
    let why = error("twist_limits_deg = [-150, 150]");
    assert!(why.starts_with("s.toml:8:") && why.contains("at most 3π/2"), "{why}");
    let why = error("axis = [1, 1, 0]\ntwist_limits_rad = [0, 1]");
    assert!(why.starts_with("s.toml:8:") && why.contains("an axis of the joint's frame"), "{why}");
    let why = error("limits_rad = [0, 1]");
    assert!(why.starts_with("s.toml:8:"), "{why}");
    let why = error("dof = [{}, {}, {}, {}]");
    assert!(why.contains("expected at most 3"), "{why}");
}

#[test]
fn shapes_of_a_compound_have_groups_masks_and_sensors() {
    let parts = "{ type = \"compound\", parts = [{ type = \"sphere\", radius_m = 0.1, group = 2 }, \
                 { type = \"sphere\", radius_m = 0.1, position_m = [1, 0, 0], mask = [1, 3], name = \"b\" }, \
                 { type = \"sphere\", radius_m = 0.1, position_m = [2, 0, 0], sensor = true }, \
                 { type = \"sphere\", radius_m = 0.1, position_m = [3, 0, 0] }] }";
    let text = format!(
        "[[body]]\nname = \"a\"\nmass_kg = 1\ngroup = 1\nmask = [0, 1, 2]\nshape = {parts}\n\
         [[articulated]]\nname = \"robot\"\n[[articulated.link]]\nname = \"arm\"\njoint = \"revolute\"\naxis = [0, 0, 1]\n\
         mass_kg = 1\nshape = {parts}\n"
    );
    let world = build(&text);
    let group = |n: u8| CollisionGroup::new(n).unwrap();
    for world in [&world, &again("filters", &world)] {
        let body: &RigidBody = world.get(world.find("a").unwrap()).unwrap();
        let expected = [
            (0, ShapeFilter { group: group(2), mask: 0b111, sensor: false }),
            (1, ShapeFilter { group: group(1), mask: 0b1010, sensor: false }),
            (2, ShapeFilter { group: group(1), mask: 0b111, sensor: true }),
        ];
        assert_eq!(body.shape_filters(), expected);
        let expected = expected.map(|(n, own)| {
            let mask = if own.mask == 0b111 { u64::MAX } else { own.mask };
            (n, ShapeFilter { group: if n == 0 { own.group } else { group(0) }, mask, ..own })
        });
        assert_eq!(robot(world).colliders().next().unwrap().1.shape_filters.as_slice(), expected);
    }
    let wrong = text.replacen("group = 2", "group = 64", 1);
    let why = SceneFile::parse(&wrong, "s.toml").unwrap_err().to_string();
    assert!(why.contains("`group` of part 1") && why.starts_with("s.toml:6:"), "{why}");
}

#[test]
fn an_event_names_the_degree_of_freedom_that_it_drives() {
    let drive =
        "drive = { type = \"position\", stiffness_n_m_per_rad = 40, damping_n_m_s_per_rad = 9, target_rad = 0 }";
    let text = format!(
        "[world]\ngravity_m_per_s2 = [0, 0, 0]\n{}\n\
         [[body]]\nname = \"ball\"\nmass_kg = 1\nposition_m = [3, 0, 0]\nshape = {{ type = \"sphere\", radius_m = 0.3 }}\n\
         [[loop_joint]]\nname = \"cardan\"\ntype = \"universal\"\na = \"ball\"\nposition_m = [3, 0, 0]\naxis = [0, 0, 1]\n\
         second_axis = [1, 0, 0]\ndof = [{{}}, {{ {drive} }}]\n\
         [[event]]\nname = \"turn\"\nwhen = {{ time_s = 0.1 }}\n\
         do = [{{ drive = \"cardan\", dof = 1, target_deg = 30 }}, {{ drive = \"robot/lamp\", dof = 2, target = 0.4 }}]\n",
        lamp(drive)
    );
    let world = build(&text);
    for mut world in [again("events", &world), world] {
        while world.time() < 4.0 {
            world.step().unwrap();
        }
        let joint: &LoopJoint = world.get(world.find("cardan").unwrap()).unwrap();
        let angles = [0, 1].map(|k| joint.position_at(k, &world.view()).unwrap()[0]);
        assert!(angles[0].abs() < 1e-3 && (angles[1] - PI / 6.0).abs() < 1e-3, "{angles:?}");
        let rotation = world.part_state(world.find("robot").unwrap(), 0).unwrap().pose.rotation.scaled_axis();
        assert!((rotation - Vec3::z() * 0.4).norm() < 1e-3, "{rotation:?}");
    }
    let why = SceneFile::parse(&text.replace("\"cardan\", dof = 1", "\"cardan\", dof = 0"), "s.toml").unwrap_err();
    assert!(why.to_string().contains("`dof`, by default 0") || why.to_string().contains("for a `target_deg`"), "{why}");
}

const WHEEL: &str = r#"
[[body]]
name = "wheel"
mass_kg = 1
shape = { type = "sphere", radius_m = 0.1 }
[[loop_joint]]
name = "axle"
type = "TYPE"
a = "wheel"
position_m = [0, 0, 0]
axis = [0, 0, 1]
LIMITS
"#;

#[test]
fn limits_may_be_on_one_side() {
    let text = |kind: &str, limits: &str| WHEEL.replace("TYPE", kind).replace("LIMITS", limits);
    for (limits, expected) in
        [("limits_rad = [-inf, 1]", [f64::NEG_INFINITY, 1.0]), ("limits_deg = [-180, inf]", [-PI, f64::INFINITY])]
    {
        let robot_text = format!(
            "[[articulated]]\nname = \"robot\"\n[[articulated.link]]\nname = \"arm\"\njoint = \"revolute\"\naxis = [0, 0, 1]\n\
             mass_kg = 1\nshape = {{ type = \"sphere\", radius_m = 0.1 }}\n{limits}\n"
        );
        let world = build(&(robot_text + &text("revolute", limits)));
        for world in [&world, &again("one-sided", &world)] {
            let joint: &LoopJoint = world.get(world.find("axle").unwrap()).unwrap();
            assert_eq!(joint.dof().limits, Some(expected));
            assert_eq!(robot(world).dofs()[0].limits, Some(expected));
        }
    }
    assert_errors(
        &text("revolute", "limits_rad = [-4, 4]"),
        &[
            "s.toml:12:14: `limits_rad` of loop_joint \"axle\" is [-4, 4]; expected limits at most 2π (360°) apart, or -inf or inf on one \
           side: a revolute joint counts turns only there",
        ],
    );
    assert_errors(
        &text("cylindrical", "dof = [{}, { limits_rad = [-inf, 1] }]"),
        &[
            "s.toml:12:27: `limits_rad` of dof 2 is [-inf, 1]; expected limits at most 3π/2 (270°) apart: only a revolute joint \
           follows its angle",
        ],
    );
}

/// The text of a scene has the turn of a joint that counts its turns.
#[test]
fn a_joint_begins_in_the_turn_of_its_angle() {
    let text = |limits: &str| WHEEL.replace("TYPE", "revolute").replace("LIMITS", limits);
    let world = build(&text("limits_rad = [-inf, 1]\nangle_deg = -1800"));
    for world in [&world, &again("turned", &world)] {
        let joint: &LoopJoint = world.get(world.find("axle").unwrap()).unwrap();
        let [angle, _] = joint.position(&world.view()).unwrap();
        assert!((angle + 10.0 * PI).abs() < 1e-9, "{angle}");
    }
    assert_errors(
        &text("limits_rad = [-1, 1]\nangle_rad = 7"),
        &[
            "s.toml:13:13: `angle_rad` of loop_joint \"axle\" is 7; expected none: a joint counts turns if its limits are more than 3π/2 apart, \
           or on one side",
        ],
    );
}

#[test]
fn a_cone_is_from_0_to_half_a_turn() {
    let joint = |line: &str| WHEEL.replace("TYPE", "spherical").replace("LIMITS", line);
    for (given, expected) in [
        ("cone_deg = -1", "`cone_deg` of loop_joint \"axle\" is -1; expected an angle from 0 to 180"),
        ("cone_deg = 181", "`cone_deg` of loop_joint \"axle\" is 181; expected an angle from 0 to 180"),
        ("cone_rad = -1", "`cone_rad` of loop_joint \"axle\" is -1; expected an angle from 0 to π"),
        ("cone_rad = 3.15", "`cone_rad` of loop_joint \"axle\" is 3.15; expected an angle from 0 to π"),
    ] {
        assert_errors(&joint(given), &[&format!("s.toml:12:12: {expected}")]);
        let of_link = expected.replace("loop_joint \"axle\"", "link \"lamp\"");
        let why = SceneFile::parse(&lamp(given), "s.toml").unwrap_err().to_string();
        assert!(why.starts_with("s.toml:8:12:") && why.contains(&of_link), "{why}");
    }
    assert!(SceneFile::parse(&joint("cone_deg = 180"), "s.toml").is_ok());
    assert_errors(
        &joint("second_axis = [0, 0, 0]"),
        &[
            "s.toml:12:15: `second_axis` of loop_joint \"axle\" is [0, 0, 0]; expected a direction: a vector that is not zero",
        ],
    );
    let why = SceneFile::parse(&lamp("axis = [0, 0, 0]"), "s.toml").unwrap_err().to_string();
    assert!(
        why.starts_with("s.toml:8:8:") && why.contains("without a cone and limits of the twist has no axis"),
        "{why}"
    );
}

#[test]
fn rest_positions_and_targets_of_a_spherical_joint_may_be_vectors() {
    let text = lamp(
        "spring = { stiffness_n_m_per_rad = 5, rest_deg = [90, 0, -90] }\n\
         drive = { type = \"position\", stiffness_n_m_per_rad = 50, target_rad = [0.1, 0.2, 0.3], target_rad_per_s = [0, 0, 2] }\n\
         dof = [{ friction_n_m = 0.3 }]",
    );
    let plain = text.replace("dof = [{ friction_n_m = 0.3 }]", "friction_n_m = 0.3");
    for (text, dry) in [(text, [0.3, 0.0, 0.0]), (plain, [0.3; 3])] {
        let world = build(&text);
        for world in [&world, &again("vectors", &world), &again("vectors-2", &again("vectors-3", &world))] {
            let dofs = robot(world).dofs();
            let rest = [FRAC_PI_2, 0.0, -FRAC_PI_2];
            for k in 0..3 {
                assert_eq!(dofs[k].spring, Some(Spring { stiffness: 5.0, rest: rest[k] }));
                assert_eq!(dofs[k].friction, dry[k]);
                let Drive::Position { stiffness, target, velocity, .. } = dofs[k].drive else { panic!() };
                assert_eq!((stiffness, target, velocity), (50.0, [0.1, 0.2, 0.3][k], [0.0, 0.0, 2.0][k]));
            }
        }
    }
    // the joint whose axes differ in vectors alone is saved in their form
    let turned = "drive = { type = \"velocity\", target_rad_per_s = [1, 2, 3], max_torque_n_m = 4 }";
    for (text, written) in [
        (lamp(turned), "target_rad_per_s = [1.0, 2.0, 3.0]"),
        (WHEEL.replace("TYPE", "spherical").replace("LIMITS", turned), "target_rad_per_s = [1.0, 2.0, 3.0]"),
    ] {
        let world = build(&text);
        let folder = Folder::new("vectors-text");
        SceneWriter::new(&world).save(folder.0.join("scene.toml")).unwrap();
        let saved = std::fs::read_to_string(folder.0.join("scene.toml")).unwrap();
        assert!(saved.contains(written) && !saved.contains("dof = "), "{saved}");
        let of = |world: &World| match world.find("axle") {
            Some(id) => (0..3).map(|k| world.get::<LoopJoint>(id).unwrap().dof_at(k).unwrap().clone()).collect(),
            None => robot(world).dofs().to_vec(),
        };
        let expected = [1.0, 2.0, 3.0].map(|target| Drive::Velocity { target, limit: 4.0 });
        for world in [&world, &again("vectors-4", &world)] {
            assert_eq!(of(world).into_iter().map(|dof| dof.drive).collect::<Vec<_>>(), expected);
        }
    }
    let why = |line: &str| SceneFile::parse(&lamp(line), "s.toml").unwrap_err().to_string();
    let short = why("spring = { stiffness_n_m_per_rad = 5, rest_rad = [1, 2] }");
    assert!(short.starts_with("s.toml:8:") && short.contains("3 numbers"), "{short}");
    let own = why("dof = [{ spring = { stiffness_n_m_per_rad = 5, rest_rad = [1, 2, 3] } }]");
    assert!(own.starts_with("s.toml:8:") && own.contains("`rest_rad` of the `spring` of dof 1 is an array"), "{own}");
}

/// A link may have a cone and limits of the twist about each of its axes, in the table of that degree of freedom.
#[test]
fn cones_about_several_axes_are_saved_as_a_scene() {
    let text = lamp(
        "dof = [{ cone_deg = 90, friction_n_m = 1 }, { twist_limits_rad = [-0.5, 0.25] }, { cone_rad = 1, twist_limits_rad = [-1, 2] }]",
    );
    let world = build(&text);
    for world in [&world, &again("cones", &world), &again("cones-2", &again("cones-3", &world))] {
        let dofs = robot(world).dofs();
        assert_eq!([0, 1, 2].map(|k| dofs[k].limits), [Some([0.0, FRAC_PI_2]), None, Some([0.0, 1.0])]);
        assert_eq!([0, 1, 2].map(|k| dofs[k].twist_limits), [None, Some([-0.5, 0.25]), Some([-1.0, 2.0])]);
        assert_eq!([0, 1, 2].map(|k| dofs[k].friction), [1.0, 0.0, 0.0]);
    }
    let why = SceneFile::parse(&lamp("dof = [{}, { cone_rad = 4 }]"), "s.toml").unwrap_err().to_string();
    assert!(
        why.starts_with("s.toml:8:") && why.contains("`cone_rad` of dof 2 is 4; expected an angle from 0 to π"),
        "{why}"
    );
}

const TOOL: &str = r#"
[[articulated]]
name = "robot"
[[articulated.link]]
name = "arm"
joint = "revolute"
axis = [0, 0, 1]
mass_kg = 2
shape = { type = "sphere", radius_m = 0.1 }
[[articulated.link]]
name = "tool"
parent = "arm"
joint = "fixed"
position_m = [1, 0, 0]
mass_kg = 0.5
shape = { type = "box", size_m = [0.1, 0.2, 0.3] }
[[body]]
name = "ball"
mass_kg = 1
position_m = [5, 0, 0]
shape = { type = "sphere", radius_m = 0.1 }
"#;

#[test]
fn a_pair_of_a_fixed_link_holds_for_its_own_shapes() {
    let world = build(&format!("{TOOL}[[pair]]\na = \"robot/tool\"\nb = \"ball\"\ncollides = false\n"));
    for world in [&world, &again("pair", &world)] {
        let tool = robot(world).parts_of_link("tool").unwrap()[0];
        let pairs: Vec<_> = world.pair_materials().map(|(sides, material)| (*sides, *material)).collect();
        let [id, ball] = ["robot", "ball"].map(|name| world.find(name).unwrap());
        let never = PairMaterial { collides: Some(false), ..PairMaterial::default() };
        let (sides, material) = pairs[0];
        assert_eq!((pairs.len(), material), (1, never));
        assert!(sides.contains(&PairSide::Part(id, tool)) && sides.contains(&PairSide::Object(ball)), "{sides:?}");
    }
}

/// A fixed link is a body without a joint, with its name, its mass and its shapes; what it was together with its carrier is the same.
#[test]
fn mjcf_has_fixed_links_as_bodies() {
    let world = build(&format!(
        "[world]\ncombine_friction = \"max\"\n{TOOL}[[pair]]\na = \"robot/tool\"\nb = \"ball\"\ncollides = false\n"
    ));
    let written = MjcfWriter::new(&world).text("files");
    assert_eq!(written.notes, ["robot: a tree of MJCF has the name of its root body: it is read back as arm"]);
    assert!(written.text.contains("<body name=\"tool\" pos=\"1 0 0\">"), "{}", written.text);
    assert!(
        written.text.contains("body1=\"tool\" body2=\"ball\"")
            || written.text.contains("body1=\"ball\" body2=\"tool\"")
    );
    let read = tumble_scene::mjcf::parse(&written.text, "tool.xml", &MjcfOptions::default()).unwrap();
    let (again, _) = read.build().unwrap();
    let body = |world: &World| -> ArticulatedBody {
        let found = world.ids().iter().find_map(|id| world.get::<ArticulatedBody>(*id));
        found.unwrap().clone()
    };
    let (ours, theirs) = (body(&world), body(&again));
    for link in ["arm", "tool"] {
        let (own, read) = (ours.link_mass(link).unwrap(), theirs.link_mass(link).unwrap());
        assert!(
            (own.mass - read.mass).abs() < 1e-12 && (own.inertia - read.inertia).amax() < 1e-12,
            "{link}: {read:?}"
        );
        assert_eq!(theirs.parts_of_link(link).unwrap().len(), 1, "{link}");
        let pose = |body: &ArticulatedBody| body.part_pose(body.parts_of_link(link).unwrap()[0]).translation.vector;
        assert!((pose(&ours) - pose(&theirs)).norm() < 1e-12, "{link}");
    }
    let (own, read) = (&ours.model().links()[0].mass, &theirs.model().links()[0].mass);
    assert!((own.inertia - read.inertia).amax() < 1e-12 && (own.center - read.center).norm() < 1e-12);
}

#[test]
fn mjcf_reads_and_writes_springs_and_ranges_of_ball_joints() {
    let text = "<mujoco><compiler autolimits=\"true\"/><worldbody><body name=\"b\"><joint name=\"j\" type=\"ball\" range=\"0 60\" \
                stiffness=\"3\" damping=\"0.5\"/><geom size=\"0.1\" pos=\"0 0 -0.5\"/></body></worldbody></mujoco>";
    let read =
        |text: &str| tumble_scene::mjcf::parse(text, "ball.xml", &MjcfOptions::default()).unwrap().build().unwrap().0;
    let world = read(text);
    let written = MjcfWriter::new(&world).text("files");
    for world in [&world, &read(&written.text)] {
        let body = world.ids().iter().find_map(|id| world.get::<ArticulatedBody>(*id)).unwrap();
        for (k, dof) in body.dofs().iter().enumerate() {
            assert_eq!((dof.spring, dof.damping), (Some(Spring { stiffness: 3.0, rest: 0.0 }), 0.5));
            let close = |x: f64| (x.abs() - PI / 3.0).abs() < 1e-12;
            assert_eq!(
                (dof.limits.is_some_and(|[lo, hi]| lo == 0.0 && close(hi)), dof.limits.is_some()),
                (k == 2, k == 2)
            );
            assert_eq!(dof.twist_limits.is_some_and(|[lo, hi]| close(lo) && close(hi)), k == 2);
        }
    }
}

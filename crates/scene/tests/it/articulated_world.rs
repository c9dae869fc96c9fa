//! Articulated bodies and loop joints of scenes as worlds.

use tumble_core::articulated::{ArticulatedBody, Drive};
use tumble_core::collide::Vec3;
use tumble_core::{LoopJoint, World};
use tumble_scene::SceneFile;

fn world(text: &str) -> (World, Vec<String>) {
    let scene = SceneFile::parse(text, "s.toml").unwrap_or_else(|error| panic!("{error}"));
    scene.build().unwrap_or_else(|error| panic!("{error}"))
}

fn body<'w>(world: &'w World, name: &str) -> &'w ArticulatedBody {
    world.get(world.find(name).unwrap()).unwrap()
}

#[test]
fn the_example_of_every_key_becomes_a_world_that_steps() {
    let reference = include_str!("../../../../scenes/README.md");
    let example = reference.split("```toml\n").nth(1).unwrap().split("```").next().unwrap();
    let (mut world, notes) = world(example);
    assert_eq!(notes, Vec::<String>::new());
    let crane = body(&world, "crane");
    // jib 1, trolley 1, rope 20·3, wheel 1, lamp 1; the hook is fixed
    assert_eq!((crane.model().links().len(), crane.model().dof()), (24, 64));
    // jib 40 + 0.4·0.3·0.3·2000, trolley 5, hook 2, wheel 0.3, lamp 0.5, rope 20·1200·π(0.01²·0.04
    // + 4/3·0.01³)
    let rope = 20.0 * 1200.0 * std::f64::consts::PI * (4e-6 + 4.0 / 3.0 * 1e-6);
    assert!((crane.model().mass() - (40.0 + 72.0 + 5.0 + 2.0 + 0.3 + 0.5 + rope)).abs() < 1e-9);
    // base turned by 90° about z, jib by 0.3, trolley 1 m out
    let at = world.part_state(world.find("crane").unwrap(), 1).unwrap().position();
    let out = Vec3::new(-0.3_f64.sin(), 0.3_f64.cos(), 0.0);
    assert!((at - (out + Vec3::new(0.0, 0.0, 2.0))).norm() < 1e-12, "{at:?}");
    let sling = world.find("sling").unwrap();
    assert!(world.get::<LoopJoint>(sling).unwrap().position_error(&world.view()).unwrap().distance < 1e-12);
    for _ in 0..20 {
        world.step().unwrap();
    }
    assert!(world.get::<LoopJoint>(sling).unwrap().position_error(&world.view()).unwrap().distance < 1e-4);
}

#[test]
fn mass_is_spread_over_the_shapes_of_a_link() {
    let link = |mass: &str| {
        format!(
            "[[articulated]]\nname = \"a\"\n[[articulated.link]]\nname = \"l\"\njoint = \"spherical\"\n{mass}\nshapes = [\n\
             {{ type = \"sphere\", radius_m = 0.1, position_m = [0.5, 0, 0] }},\n{{ type = \"sphere\", radius_m = 0.1, position_m = [-0.5, 0, 0] }}]\n"
        )
    };
    let volume = 4.0 / 3.0 * std::f64::consts::PI * 1e-3;
    for keys in ["mass_kg = 2".to_owned(), format!("density_kg_per_m3 = {}", 1.0 / volume)] {
        let (world, _) = world(&link(&keys));
        let mass = body(&world, "a").model().links()[0].mass;
        assert!((mass.mass - 2.0).abs() < 1e-12 && mass.center.norm() < 1e-15);
        // two balls of 1 kg: 2/5·0.1² each, and 0.5² across
        let expected = Vec3::new(0.008, 0.508, 0.508);
        assert!((mass.inertia.diagonal() - expected).amax() < 1e-12, "{:?}", mass.inertia);
    }
    let each = link("").replace("0.1, p", "0.1, mass_kg = 1, p");
    assert!((body(&world(&each).0, "a").model().links()[0].mass.inertia[(1, 1)] - 0.508).abs() < 1e-12);
}

#[test]
fn a_mesh_on_a_link_is_drawn_and_collides_where_its_vertices_stand() {
    let (world, _) = world(
        "[meshes.cone]\ntype = \"lathe\"\nprofile_m = [[0, 0], [0.3, 0], [0, 0.4]]\n[[articulated]]\nname = \"a\"\n[[articulated.link]]\nname = \"l\"\n\
         joint = \"revolute\"\naxis = [1, 0, 0]\nmass_kg = 1\nshape = { type = \"mesh\", mesh = \"cone\", position_m = [0, 0, 1] }\n",
    );
    let cone = body(&world, "a");
    // the center of a cone is a quarter of its height above its base
    assert!((cone.part_pose(2).translation.vector - Vec3::new(0.0, 0.0, 1.1)).norm() < 1e-9);
    assert!((cone.model().links()[0].mass.center - Vec3::new(0.0, 0.0, 1.1)).norm() < 1e-9);
}

#[test]
fn a_pendulum_of_a_scene_swings_with_the_period_of_the_formula() {
    let (mut world, _) = world(
        "[world]\ndt_s = 0.001\n[[articulated]]\nname = \"p\"\n[[articulated.link]]\nname = \"l\"\njoint = \"revolute\"\naxis = [0, 1, 0]\n\
         angle_rad = 0.01\nmass_kg = 2\ncenter_m = [0, 0, -0.7]\n",
    );
    let id = world.find("p").unwrap();
    let mut last = 0.01;
    let mut crossing = 0.0;
    while crossing == 0.0 {
        world.step().unwrap();
        let angle = world.state_of(id).unwrap()[0];
        if angle <= 0.0 {
            crossing = world.time() - 1e-3 * angle / (angle - last);
        }
        last = angle;
        assert!(world.time() < 2.0);
    }
    // a quarter of 2π√(l/g)·(1 + a²/16)
    let quarter = 0.5 * std::f64::consts::PI * (0.7_f64 / 9.81).sqrt() * (1.0 + 0.01 * 0.01 / 16.0);
    assert!((crossing - quarter).abs() < 1e-6, "{crossing} {quarter}");
}

#[test]
fn loop_joints_of_every_kind_join_links_bodies_and_the_world() {
    let links = "[world]\ngravity_m_per_s2 = [0, 0, 0]\n[[articulated]]\nname = \"o\"\n[[articulated.link]]\nname = \"l\"\njoint = \"spherical\"\nmass_kg = 1\ninertia_kg_m2 = [1, 1, 1]\n\
                 [[articulated.link]]\nname = \"m\"\nparent = \"l\"\nposition_m = [1, 0, 0]\njoint = \"fixed\"\n\
                 [[body]]\nname = \"b\"\nshape = { type = \"sphere\", radius_m = 0.1 }\nmass_kg = 1\nposition_m = [2, 0, 0]\nvelocity_m_per_s = [0, 0.1, 0]\n";
    for (kind, rows) in [("spherical", 3), ("revolute", 5), ("fixed", 6), ("prismatic", 5)] {
        let axis = if rows == 5 { "axis = [1, 0, 0]" } else { "" };
        let text = format!(
            "{links}[[loop_joint]]\nname = \"c\"\ntype = \"{kind}\"\na = \"o/m\"\nb = \"b\"\nposition_m = [1.5, 0, 0]\n{axis}\n[[loop_joint]]\nname = \"w\"\ntype = \"spherical\"\na = \"b\"\nposition_m = [2, 0, 1]\n"
        );
        let (mut world, _) = world(&text);
        for _ in 0..240 {
            world.step().unwrap();
        }
        for name in ["c", "w"] {
            let position_error =
                world.get::<LoopJoint>(world.find(name).unwrap()).unwrap().position_error(&world.view()).unwrap();
            assert!(position_error.distance < 1e-4 && position_error.angle < 1e-4, "{kind} {name}: {position_error:?}");
        }
    }
}

#[test]
fn a_urdf_in_a_scene_takes_its_start_and_drives_from_the_scene() {
    let folder = std::env::temp_dir().join(format!("tumble-scene-urdf-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let robot = "<robot name=\"r\"><link name=\"a\"/><link name=\"b\"><inertial><mass value=\"1\"/><inertia ixx=\"1\" iyy=\"1\" izz=\"1\"/></inertial></link>\
                 <joint name=\"shoulder\" type=\"revolute\"><parent link=\"a\"/><child link=\"b\"/><limit lower=\"-1\" upper=\"1\" effort=\"7\" velocity=\"1\"/></joint></robot>";
    std::fs::write(folder.join("robot.urdf"), robot).unwrap();
    let keys = "initial_positions = { shoulder = 0.5 }\n[[articulated.joint]]\nname = \"shoulder\"\ndrive = { type = \"position\", stiffness_n_m_per_rad = 20 }\n";
    let text =
        |keys: &str| format!("[[articulated]]\nname = \"arm\"\nurdf = \"robot.urdf\"\nposition_m = [0, 0, 3]\n{keys}");
    let name = folder.join("scene.toml").display().to_string();
    let (world, _) = SceneFile::parse(&text(keys), &name).unwrap().build().unwrap();
    let arm = body(&world, "arm");
    assert_eq!(
        arm.dofs()[0].drive,
        Drive::Position { stiffness: 20.0, damping: 0.0, target: 0.5, velocity: 0.0, limit: 7.0 }
    );
    assert_eq!(arm.dofs()[0].limits, Some([-1.0, 1.0]));
    assert_eq!(world.state_of(world.find("arm").unwrap()).unwrap(), [0.5, 0.0]);
    assert_eq!(world.part_state(world.find("arm").unwrap(), 0).unwrap().position(), Vec3::new(0.0, 0.0, 3.0));

    let lines = |keys: &str| SceneFile::parse(&text(keys), &name).unwrap_err().to_string().replace(&name, "s");
    assert_eq!(
        lines("initial_positions = { sholder = 1 }\n"),
        "s:5:23: articulated \"arm\" has no joint \"sholder\" with one degree of freedom; did you mean `shoulder`?"
    );
    assert_eq!(
        lines("[[articulated.joint]]\nname = \"elbow\"\n"),
        "s:6:8: `name` of joint 1 is \"elbow\"; expected `shoulder`"
    );
    std::fs::write(folder.join("robot.urdf"), robot.replace("value=\"1\"", "value=\"-1\"")).unwrap();
    let error = lines("");
    assert!(error.starts_with("s:3:8: `urdf` of articulated \"arm\": ") && error.contains("robot.urdf:1:"), "{error}");
    assert!(
        error.contains("`value` of the mass of the inertial of link \"b\" is \"-1\"; expected a number of at least 0"),
        "{error}"
    );
    std::fs::remove_dir_all(&folder).unwrap();
}

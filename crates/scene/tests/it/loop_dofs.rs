//! `[[loop_joint]]` with settings of several degrees of freedom: their meaning, saving, and errors for wrong ones.

use tumble_core::articulated::Spring;
use tumble_core::collide::{Quat, Vec3};
use tumble_core::{DofSettings, Drive, LoopJoint, World};
use tumble_scene::{SceneFile, SceneWriter};

fn text(joint: &str) -> String {
    format!(
        "[world]\ngravity_m_per_s2 = [0, 0, 0]\n[[body]]\nname = \"b\"\nshape = {{ type = \"sphere\", radius_m = 0.5 }}\nmass_kg = 10\n\
         position_m = [1, 0, 0]\n[[loop_joint]]\nname = \"c\"\na = \"b\"\nposition_m = [1, 0, 0]\n{joint}"
    )
}

fn build(text: &str) -> World {
    SceneFile::parse(text, "s.toml").unwrap_or_else(|error| panic!("{error}")).build().unwrap().0
}

fn joint(world: &World) -> &LoopJoint {
    world.get(world.find("c").unwrap()).unwrap()
}

/// Returns the world of the text that a world is saved as.
fn saved(world: &World) -> World {
    let folder =
        std::env::temp_dir().join(format!("tumble_loop_dofs_{}_{:?}", std::process::id(), std::thread::current().id()));
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join("saved.toml");
    SceneWriter::new(world).save(&path).unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    // an edit, so that the text counts and no archive beside it
    std::fs::write(&path, format!("{text}# edited\n")).unwrap();
    let read = SceneFile::load(&path).unwrap_or_else(|error| panic!("{error}\n{text}")).build().unwrap().0;
    std::fs::remove_dir_all(&folder).unwrap();
    read
}

#[test]
fn every_degree_of_freedom_has_keys_of_its_own() {
    let planar = "type = \"planar\"\naxis = [0, 0, 1]\nfriction_n = 2\n\
        [[loop_joint.dof]]\nlimits_m = [-0.5, 0.75]\narmature_kg = 3\n\
        [[loop_joint.dof]]\nspring = { stiffness_n_per_m = 40, rest_m = 0.25 }\n\
        [[loop_joint.dof]]\neffort_n_m = 6\ndrive = { type = \"velocity\", target_rad_per_s = 2 }\nmax_velocity_rad_per_s = 1.5\n";
    let world = build(&text(planar));
    let expected = [
        (DofSettings { limits: Some([-0.5, 0.75]), friction: 2.0, ..DofSettings::default() }, 3.0),
        (DofSettings { spring: Some(Spring { stiffness: 40.0, rest: 0.25 }), ..DofSettings::default() }, 0.0),
        (
            DofSettings {
                effort: 6.0,
                drive: Drive::Velocity { target: 2.0, limit: 6.0 },
                max_velocity: 1.5,
                ..DofSettings::default()
            },
            0.0,
        ),
    ];
    for world in [&world, &saved(&world)] {
        for (k, (dof, armature)) in expected.iter().enumerate() {
            assert_eq!(joint(world).dof_at(k), Some(dof), "{k}");
            assert_eq!(joint(world).armature_at(k), Some(*armature), "{k}");
        }
    }
    // its x and y are those of the world
    let axes = joint(&world).sides()[0].frame.rotation;
    assert!(axes.angle_to(&Quat::identity()) < 1e-12);
}

#[test]
fn keys_of_a_spherical_joint_are_those_of_all_its_axes() {
    let keys = "type = \"spherical\"\ncone_deg = 90\ntwist_limits_deg = [-90, 45]\narmature_kg_m2 = 0.5\ndamping_n_m_s_per_rad = 4\n\
        drive = { type = \"position\", stiffness_n_m_per_rad = 4 }\n[[loop_joint.dof]]\n[[loop_joint.dof]]\nfriction_n_m = 1\n";
    let mut world = build(&text(keys));
    let quarter = std::f64::consts::FRAC_PI_2;
    for world in [&world, &saved(&world)] {
        let joint = joint(world);
        assert_eq!(joint.cone(), Some(quarter));
        assert_eq!(joint.twist_limits(), Some([-quarter, 0.5 * quarter]));
        let friction: Vec<f64> = (0..3).map(|k| joint.dof_at(k).unwrap().friction).collect();
        assert_eq!(friction, [0.0, 1.0, 0.0]);
        let alike = |k: usize| joint.dof_at(k).unwrap().damping == 4.0 && joint.armature_at(k) == Some(0.5);
        assert!((0..3).all(alike));
    }
    let id = world.find("c").unwrap();
    world.apply_impulse(world.find("b").unwrap(), 0, Vec3::new(0.0, 0.3, 0.0), &Vec3::new(1.0, 0.0, 0.5)).unwrap();
    for _ in 0..240 {
        world.step().unwrap();
    }
    let [x, _] = world.get::<LoopJoint>(id).unwrap().position_at(0, &world.view()).unwrap();
    // (I + a)·θ̈ + 4·θ̇ + 4·θ = 0 with I = 1, from the velocity −0.5·0.3/I of the blow, which the rotor takes over
    let (decay, rate) = (4.0 / 3.0f64, (4.0f64 / 1.5 - 16.0 / 9.0).sqrt());
    let expected = -0.15 / rate * (-decay).exp() * rate.sin();
    // damping and drives are implicit: first order
    assert!((x - expected).abs() < 1e-2 * expected.abs(), "{x} {expected}");
}

#[test]
fn a_pulley_keeps_the_length_by_default_when_it_is_saved() {
    let pulley = |length: &str| {
        format!(
            "[[body]]\nname = \"a\"\nshape = {{ type = \"sphere\", radius_m = 0.1 }}\nmass_kg = 1\n[[body]]\nname = \"b\"\nshape = {{ type = \"sphere\", radius_m = 0.1 }}\nmass_kg = 2\nposition_m = [2, 0, 0]\n\
             [[loop_joint]]\nname = \"c\"\ntype = \"pulley\"\na = \"a\"\nb = \"b\"\nposition_m = [0, 0, 0]\nsecond_position_m = [2, 0, 0]\n\
             ground_position_m = [0, 0, 3]\nsecond_ground_position_m = [2, 0, 2]\nratio = 2\n{length}"
        )
    };
    // 3 + 2·2, also where it is given
    for (given, length) in [("", None), ("length_m = 7\n", Some(7.0))] {
        let mut world = build(&pulley(given));
        for world in [&mut world.fork(), &mut saved(&world)] {
            assert_eq!((joint(world).length(), joint(world).given_length()), (7.0, length));
            let id = world.find("c").unwrap();
            let change = |joint: &mut LoopJoint| {
                let transmission = tumble_core::Transmission { ratio: 3.0, ..*joint.transmission() };
                joint.set_transmission(transmission)
            };
            world
                .change_joint(id, |joint| {
                    change(joint).map_err(|e| panic!("{e}")).or(Err(tumble_core::WorldError::Stale))
                })
                .unwrap();
            assert_eq!(joint(world).length(), if length.is_some() { 7.0 } else { 9.0 });
        }
        world.step().unwrap();
    }
}

#[test]
fn wrong_settings_name_their_line() {
    let report = |keys: &str| SceneFile::parse(&text(keys), "s.toml").unwrap_err().to_string();
    let message = report(
        "type = \"universal\"\naxis = [0, 0, 1]\nsecond_axis = [1, 0, 0]\n[[loop_joint.dof]]\n[[loop_joint.dof]]\nlimits_m = [0, 1]\n",
    );
    assert!(message.contains("s.toml:17") && message.contains("limits_m"), "{message}");
    let message = report("type = \"revolute\"\naxis = [0, 0, 1]\n[[loop_joint.dof]]\nlimits_rad = [0, 1]\n");
    assert!(message.contains("unknown key `dof`"), "{message}");
    let message = report("type = \"spherical\"\nlimits_rad = [0, 1]\n");
    assert!(
        message.contains("s.toml:13") && message.contains("expected `cone_rad` and `twist_limits_rad`"),
        "{message}"
    );
    let message = report("type = \"planar\"\naxis = [0, 0, 1]\narmature_kg = -1\n");
    assert!(message.contains("`armature_kg`") && message.contains("-1"), "{message}");
}

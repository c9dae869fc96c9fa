//! `[[articulated]]` and `[[loop_joint]]`: the meaning of their keys, and errors for wrong ones.

use crate::bad_input::assert_errors;
use tumble_core::Joint;
use tumble_core::articulated::Drive;
use tumble_core::collide::Vec3;
use tumble_scene::{LinkMassSpec, LoopJointKind, PartSpec, SceneFile};

fn read(text: &str) -> SceneFile {
    SceneFile::parse(text, "s.toml").unwrap_or_else(|error| panic!("{error}"))
}

/// Returns the blocks of TOML in the reference of all keys.
fn examples() -> Vec<&'static str> {
    let reference = include_str!("../../../../scenes/README.md");
    reference.split("```toml\n").skip(1).map(|rest| rest.split("```").next().unwrap()).collect()
}

/// Returns a body with one revolute link, whose further keys begin at line 7.
fn link_with(keys: &str) -> String {
    format!(
        "[[articulated]]\nname = \"a\"\n[[articulated.link]]\nname = \"l\"\njoint = \"revolute\"\naxis = [0, 0, 2]\n{keys}\n"
    )
}

/// Letters of axes mean the unit vectors, in every table that has a direction.
#[test]
fn axes_have_letters() {
    let with = |x: &str, y: &str, minus_z: &str| {
        format!(
            "[[body]]\nname = \"b\"\nshape = {{ type = \"box\", size_m = [1, 1, 1] }}\nmass_kg = 1\none_way = {x}\nrotation = {{ axis = {y}, angle_deg = 30 }}\n\
             [[articulated]]\nname = \"a\"\n[[articulated.link]]\nname = \"l\"\njoint = \"revolute\"\naxis = {minus_z}\nmass_kg = 1\n\
             inertia_kg_m2 = [1, 1, 1]\n[[articulated.link]]\nname = \"m\"\nparent = \"l\"\njoint = \"spherical\"\naxis = {y}\ncone_deg = 20\n\
             mass_kg = 1\ninertia_kg_m2 = [1, 1, 1]\n[[loop_joint]]\nname = \"j\"\ntype = \"universal\"\na = \"b\"\nposition_m = [0, 0, 0]\n\
             axis = {x}\nsecond_axis = {y}\n[[light]]\ntype = \"directional\"\ndirection = {minus_z}\n[camera]\neye_m = [3, 0, 1]\ntarget_m = [0, 0, 0]\nup = {y}\n"
        )
    };
    let letters = read(&with("\"x\"", "\"y\"", "\"-z\""));
    let numbers = read(&with("[1, 0, 0]", "[0, 1, 0]", "[0, 0, -1]"));
    assert_eq!(format!("{:?}", letters.articulated), format!("{:?}", numbers.articulated));
    assert_eq!(format!("{:?}", letters.loop_joints), format!("{:?}", numbers.loop_joints));
    assert_eq!(format!("{:?}", letters.bodies), format!("{:?}", numbers.bodies));
    let states = [&letters, &numbers].map(|scene| scene.build().unwrap().0.state().to_vec());
    assert_eq!(states[0], states[1]);
    let Joint::Revolute { axis } = letters.articulated[0].links[0].joint.kind else { panic!("a hinge") };
    assert_eq!(axis, Vec3::new(0.0, 0.0, -1.0));
    assert_errors(
        &link_with("").replace("[0, 0, 2]", "\"w\""),
        &[
            "s.toml:6:8: `axis` of link \"l\" is \"w\"; expected a list of 3 numbers, or \"x\", \"y\", \"z\", \"-x\", \"-y\" or \"-z\"",
        ],
    );
}

#[test]
fn the_example_of_every_key_means_what_it_says() {
    let scene = read(examples()[0]);
    let [crane, ragdoll] = &scene.articulated[..] else { panic!("two bodies") };
    assert_eq!(crane.links.len(), 2 + 20 + 3);
    let link = |name: &str| &crane.links[crane.link(name).unwrap()];

    let jib = link("jib");
    assert_eq!(jib.joint.kind, Joint::Revolute { axis: Vec3::z() });
    assert_eq!(jib.joint.position, [0.3], "`initial_positions` goes over the link's own");
    let limits = jib.joint.dof.limits.unwrap();
    assert!((limits[1] - 2.9670597283903604).abs() < 1e-15 && limits[0] == -limits[1], "170 degrees");
    assert_eq!((jib.joint.dof.damping, jib.joint.dof.friction), (2.0, 0.5));
    let Drive::Position { stiffness, damping, target, velocity, limit } = jib.joint.dof.drive else {
        panic!("a position drive")
    };
    assert_eq!((stiffness, damping, velocity, limit), (4000.0, 800.0, 0.0, 900.0));
    assert!((target - std::f64::consts::FRAC_PI_4).abs() < 1e-15);
    assert_eq!(jib.shapes.len(), 2);
    assert_eq!(jib.shapes[0].surface.contact.friction, 0.4, "the material of the body");

    let trolley = link("trolley");
    assert_eq!((trolley.joint.position[0], trolley.joint.velocity[0]), (1.0, 0.1));
    assert_eq!(trolley.joint.dof.drive, Drive::Velocity { target: 0.2, limit: 50.0 });
    assert_eq!(trolley.parent, crane.link("jib"));

    let (first, last) = (crane.link("rope_1").unwrap(), crane.link("rope_20").unwrap());
    assert_eq!(crane.links[first].parent, crane.link("trolley"));
    assert_eq!(crane.links[first].placement.translation.vector, Vec3::new(0.0, 0.0, -0.15));
    assert!((first + 1..=last).all(|k| crane.links[k].parent == Some(k - 1)));
    assert!((first + 1..=last).all(|k| crane.links[k].placement.translation.vector == Vec3::new(0.0, 0.0, -0.06)));
    assert_eq!(crane.exclude_collisions, [[0, last]]);
    assert_ne!(
        crane.links[first].shapes[0].surface.appearance.color,
        crane.links[first + 1].shapes[0].surface.appearance.color
    );

    let LinkMassSpec::Given(hook) = link("hook").mass else { panic!("the hook's mass is given") };
    assert_eq!((hook.mass, hook.center.z, hook.inertia.trace()), (2.0, -0.06, 0.012));

    let mimic = link("wheel").joint.mimic.unwrap();
    assert_eq!((Some(mimic.link), mimic.multiplier), (crane.link("trolley"), 20.0));
    assert!((mimic.offset - 0.17453292519943295).abs() < 1e-16);
    assert!(!link("wheel").shapes[0].collidable);

    let Drive::Playback { motion, limit } = &link("lamp").joint.dof.drive else { panic!("a playback") };
    assert_eq!(*limit, 20.0);
    assert!(
        (motion.at(1.0).0 - 1.0471975511965976).abs() < 1e-15 && (motion.at(5.0).0 - motion.at(1.0).0).abs() < 1e-12
    );

    assert_eq!(ragdoll.links[0].joint.kind, Joint::Floating);
    assert_eq!(ragdoll.links[0].joint.velocity, [0.0, 0.0, 2.0, 1.0, 0.0, 0.0]);
    let half = 10f64.to_radians();
    assert!(
        (ragdoll.links[1].joint.position[1] - half.sin()).abs() < 1e-15
            && (ragdoll.links[1].joint.position[3] - half.cos()).abs() < 1e-15
    );

    let sling = &scene.loop_joints[0];
    assert_eq!(
        (sling.kind, sling.a, sling.b),
        (LoopJointKind::Spherical, Some(PartSpec::Link(0, crane.link("hook").unwrap())), Some(PartSpec::Body(0)))
    );
}

#[test]
fn a_position_drive_without_a_target_holds_the_start() {
    let scene = read(&link_with("angle_deg = 90\ndrive = { type = \"position\", stiffness_n_m_per_rad = 1 }"));
    let joint = &scene.articulated[0].links[0].joint;
    assert!(
        matches!(joint.dof.drive, Drive::Position { target, limit: f64::INFINITY, .. } if target == std::f64::consts::FRAC_PI_2)
    );
}

#[test]
fn wrong_links_are_reported() {
    assert_errors(
        "[[articulated]]\nname = \"a\"\n",
        &[
            "s.toml:1:1: articulated \"a\" has no `link`; expected links, each under a line [[articulated.link]], or `urdf`, `mjcf` or `sdformat`",
        ],
    );
    assert_errors(
        &link_with("parent = \"x\""),
        &[
            "s.toml:7:10: `parent` of link \"l\" is \"x\"; expected no parent for the first link, which is attached to the base",
        ],
    );
    assert_errors(
        &link_with("[[articulated.link]]\nname = \"l\"\nparent = \"m\"\njoint = \"fixed\""),
        &[
            "s.toml:8:8: there is a second link \"l\"; the first is at line 4; expected a unique name",
            "s.toml:9:10: `parent` of link \"l\" is \"m\"; did you mean `l`?",
        ],
    );
    assert_errors(
        &link_with("").replace("[0, 0, 2]", "[0, 0, 0]"),
        &["s.toml:6:8: `axis` of link \"l\" is [0, 0, 0]; expected a direction: a vector that is not zero"],
    );
    assert_errors(
        &link_with("").replace("revolute", "hinge"),
        &["s.toml:5:9: `joint` of link \"l\" is \"hinge\"; expected `revolute`, `prismatic`, `spherical` or `fixed`"],
    );
    assert_errors(
        &link_with("").replace("[[articulated.link]]", "floating = true\n[[articulated.link]]"),
        &[
            "s.toml:6:9: `joint` of link \"l\" is \"revolute\"; expected no joint, since the root of a floating body has none; or floating = false",
        ],
    );
}

#[test]
fn wrong_joints_are_reported() {
    assert_errors(
        &link_with("limits_deg = [30, -30]"),
        &[
            "s.toml:7:14: `limits_deg` of link \"l\" is [30, -30]; expected [lower, upper], the lower first, -inf and inf for none on a side; or false for none",
        ],
    );
    assert_errors(
        &link_with("limits_rad = [-1, 1]\nlimits_deg = [-1, 1]"),
        &["s.toml:3:1: link \"l\" has both `limits_rad` and `limits_deg`; expected one of them"],
    );
    assert_errors(
        &link_with("limits_m = [-1, 1]"),
        &["s.toml:7:1: unknown key `limits_m` in link \"l\"; did you mean `limits_deg`?"],
    );
    assert_errors(
        &link_with("damping_n_m_s_per_rad = -1"),
        &["s.toml:7:25: `damping_n_m_s_per_rad` of link \"l\" is -1; expected a number of at least 0"],
    );
    assert_errors(
        &link_with("armature_kg_m2 = -0.1"),
        &["s.toml:7:18: `armature_kg_m2` of link \"l\" is -0.1; expected a number of at least 0"],
    );
    assert_errors(
        &link_with("drive = { type = \"position\" }"),
        &[
            "s.toml:7:9: the `drive` of link \"l\" has no stiffness and no damping; expected `stiffness_n_m_per_rad` or `damping_n_m_s_per_rad` greater than 0",
        ],
    );
    assert_errors(
        &link_with("drive = { type = \"playback\", times_s = [0, 0], values_rad = [1, 2] }"),
        &[
            "s.toml:7:9: the `drive` of link \"l\": sample 1 of a recorded motion: time 0 s, value 2; both must be finite and times must rise",
        ],
    );
    assert_errors(
        &link_with("mimic = { joint = \"l\" }"),
        &["s.toml:7:19: `mimic` of articulated \"a\" is \"l\"; expected a joint other than its own"],
    );
    assert_errors(
        &link_with("[articulated.initial_positions]\nk = 1"),
        &["s.toml:8:1: articulated \"a\" has no joint \"k\" with one degree of freedom; did you mean `l`?"],
    );
}

#[test]
fn wrong_masses_are_reported() {
    assert_errors(
        &link_with("shape = { type = \"sphere\", radius_m = 1, mass_kg = 1 }\nmass_kg = 1"),
        &[
            "s.toml:3:1: link \"l\" has a mass, and its shapes have masses; expected the mass of the link, or that of each shape",
        ],
    );
    assert_errors(
        &link_with("mass_kg = 1\ninertia_kg_m2 = [1, 1, 3]"),
        &[
            "s.toml:8:17: `inertia_kg_m2` of link \"l\" is [1, 1, 3]; expected no principal moment greater than the sum of the others; they are 1.000000e0, 1.000000e0 and 3.000000e0 kg·m²",
        ],
    );
    assert_errors(
        &link_with("inertia_kg_m2 = [1, 1, 1]"),
        &["s.toml:3:1: link \"l\" has `center_m` or `inertia_kg_m2` but no `mass_kg`; expected `mass_kg` with them"],
    );
    assert_errors(
        &link_with("mass_kg = nan"),
        &["s.toml:7:11: `mass_kg` of link \"l\" is nan; expected a number of at least 0"],
    );
    assert_errors(
        &link_with("mass_kg = 1\nshape = { type = \"half_space\" }"),
        &[
            "s.toml:8:9: the shape of link \"l\" is a half-space, which is unbounded; expected a shape of finite size; make the half-space a static [[body]]",
        ],
    );
}

#[test]
fn wrong_pairs_and_loop_joints_are_reported() {
    assert_errors(
        &link_with("mass_kg = 1")
            .replace("[[articulated.link]]", "exclude_collisions = [[\"l\", \"k\"]]\n[[articulated.link]]"),
        &["s.toml:3:29: `exclude_collisions` of articulated \"a\" is \"k\"; did you mean `l`?"],
    );
    let joint = |keys: &str| {
        link_with(&format!(
            "mass_kg = 1\n[[loop_joint]]\nname = \"c\"\ntype = \"revolute\"\nposition_m = [0, 0, 0]\n{keys}"
        ))
    };
    assert_errors(
        &joint("a = \"a/l\""),
        &["s.toml:8:1: loop_joint \"c\" has no `axis`; expected a direction, such as [0, 0, -1]"],
    );
    assert_errors(
        &joint("a = \"a/k\"\naxis = [0, 0, 1]"),
        &["s.toml:12:5: `a` of loop_joint \"c\" is \"a/k\"; did you mean `a/l`?"],
    );
    assert_errors(
        &joint("a = \"a/l\"\nb = \"a/l\"\naxis = [0, 0, 1]"),
        &[
            "s.toml:13:5: `b` of loop_joint \"c\" is \"a/l\"; expected a part other than `a`; or no `b`, which is the world",
        ],
    );
}

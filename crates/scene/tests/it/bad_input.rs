//! One expected text per kind of bad input: all reported errors, with file, line and column.

use tumble_scene::SceneFile;

/// Reads `text` as `s.toml` and compares all reported problems with `expected`, one line per
/// problem.
pub fn assert_errors(text: &str, expected: &[&str]) {
    let error = SceneFile::parse(text, "s.toml").expect_err("the scene is wrong");
    let lines: Vec<String> = error.to_string().lines().map(str::to_owned).collect();
    assert_eq!(lines, expected, "for:\n{text}");
    let report = error.report(false);
    assert!(!report.contains('\u{1b}'), "no color unless asked");
    for problem in error.problems() {
        assert!(report.contains(&problem.message) && report.contains(&problem.expected), "{report}");
        assert!(report.contains(&format!("s.toml:{}:{}", problem.line, problem.column)), "{report}");
    }
}

/// Returns a valid body with one line added, which is line 5.
fn body_with(line: &str) -> String {
    format!("[[body]]\nname = \"b\"\nshape = {{ type = \"sphere\", radius_m = 1 }}\nmass_kg = 1\n{line}\n")
}

/// Returns a body with the given shape, on line 2.
fn shape(shape: &str) -> String {
    format!("[[body]]\nshape = {shape}\nname = \"b\"\nmass_kg = 1\n")
}

#[test]
fn the_frames_used_here_are_right() {
    SceneFile::parse(&body_with(""), "s.toml").unwrap();
    SceneFile::parse(&shape("{ type = \"box\", size_m = [1, 2, 3] }"), "s.toml").unwrap();
    SceneFile::parse("", "s.toml").unwrap();
}

#[test]
fn toml_that_is_not() {
    assert_errors(
        "[world]\ndt_s = = 1\n",
        &[
            "s.toml:2:8: TOML: extra `=`; expected nothing here",
            "s.toml:2:10: TOML: unexpected key or value; expected newline, `#`",
        ],
    );
    assert_errors(
        "[world]\nduration_s = 1\nduration_s = 2\n",
        &["s.toml:3:1: TOML: duplicate key; expected each key once in its table"],
    );
    assert_errors(
        "[materials.a]\n[materials.a]\n",
        &["s.toml:2:12: TOML: duplicate key; expected each key once in its table"],
    );
}

#[test]
fn compounds() {
    let sphere = "{ type = \"sphere\", radius_m = 1 }";
    let with = |parts: &str| shape(&format!("{{ type = \"compound\", parts = {parts} }}"));
    SceneFile::parse(&with(&format!("[{sphere}]")), "s.toml").unwrap();
    let what = "the shape of body \"b\"";
    let expected = "expected a list of shapes, such as [{ type = \"sphere\", radius_m = 0.5, position_m = [1, 0, 0] }]";
    assert_errors(&shape("{ type = \"compound\" }"), &[&format!("s.toml:2:9: {what} has no `parts`; {expected}")]);
    assert_errors(&with("[]"), &[&format!("s.toml:2:38: `parts` of {what} is []; {expected}")]);
    assert_errors(&with("3"), &[&format!("s.toml:2:38: `parts` of {what} is 3; {expected}")]);
    assert_errors(
        &with("[{ type = \"half_space\" }]"),
        &[&format!(
            "s.toml:2:39: part 1 of {what} is a half-space, which is unbounded; expected a shape of finite size; make the half-space a static [[body]]"
        )],
    );
    assert_errors(
        &with(&format!("[{sphere}, {{ type = \"sphere\", radius_m = 1, density_kg_per_m3 = 7 }}]")),
        &[&format!(
            "s.toml:2:9: part 2 of {what} has a density, unlike part 1; expected a density for all parts, or for none"
        )],
    );
    assert_errors(
        &with("[{ type = \"sphere\", radius_m = -1 }]"),
        &[&format!(
            "s.toml:2:69: `radius_m` of part 1 of {what} is -1; expected a number greater than 0 (from 1e-9 to 1e12)"
        )],
    );
}

/// Parts of a compound have the constants of their own keys, else of the material that they name, else of the body.
#[test]
fn parts_of_a_compound_have_materials() {
    let ball = |keys: &str| format!("{{ type = \"sphere\", radius_m = 0.1{keys} }}");
    let text = |parts: &[String]| {
        format!(
            "[materials.ice]\nfriction = 0.02\nrestitution = 0.1\n[[body]]\nname = \"b\"\nmass_kg = 1\nfriction = 0.7\n\
             adhesion_n = 3\nshape = {{ type = \"compound\", parts = [{}] }}\n",
            parts.join(", ")
        )
    };
    let inner =
        format!("{{ type = \"compound\", parts = [{}, {}], friction = 0.4 }}", ball(""), ball(", friction = 0.5"));
    let parts = [ball(""), ball(", restitution = 0.9"), ball(", material = \"ice\", friction = 0.03"), inner];
    let (world, _) = SceneFile::parse(&text(&parts), "s.toml").unwrap().build().unwrap();
    let body = world.get::<tumble_core::RigidBody>(world.ids()[0]).unwrap();
    let constants = |shape: usize| {
        let m = body.shape_material(shape);
        (m.friction, m.restitution, m.adhesion, m.id)
    };
    let wanted = [(0.7, 0.0, 3.0, 0), (0.7, 0.9, 3.0, 0), (0.03, 0.1, 0.0, 1), (0.4, 0.0, 3.0, 0), (0.5, 0.0, 3.0, 0)];
    assert_eq!([0, 1, 2, 3, 4].map(constants), wanted);
    let own: Vec<usize> = body.shape_materials().iter().map(|(shape, _)| *shape).collect();
    assert_eq!(own, [1, 2, 3, 4]);
    let error = |part: &str| SceneFile::parse(&text(&[ball(part)]), "s.toml").unwrap_err().report(false);
    assert!(error(", friction = -1").contains("`friction` of part 1 of the shape of body \"b\" is -1"));
    assert!(error(", material = \"iec\"").contains("did you mean `ice`"), "{}", error(", material = \"iec\""));
    let link = "[[articulated]]\nname = \"a\"\n[[articulated.link]]\nname = \"l\"\nshape = { type = \"compound\", parts = \
                [{ type = \"sphere\", radius_m = 1, friction = -1 }], density_kg_per_m3 = 1 }\njoint = { type = \"fixed\" }\n";
    let error = SceneFile::parse(link, "s.toml").unwrap_err().report(false);
    assert!(error.contains("`friction` of part 1 of the shape of link \"l\" is -1"), "{error}");
}

/// A compound whose parts have densities needs no mass.
#[test]
fn a_compound_has_the_densities_of_its_parts() {
    let ball = |x: f64, density: f64| {
        format!("{{ type = \"sphere\", radius_m = 0.1, position_m = [{x}, 0, 0], density_kg_per_m3 = {density} }}")
    };
    let text = format!(
        "[[body]]\nname = \"b\"\nposition_m = [0, 0, 5]\nshape = {{ type = \"compound\", parts = [{}, {}] }}\n",
        ball(0.0, 1000.0),
        ball(0.4, 3000.0)
    );
    let (world, _) = SceneFile::parse(&text, "s.toml").unwrap().build().unwrap();
    let object: &dyn std::any::Any = world.object(world.ids()[0]).unwrap();
    let body = object.downcast_ref::<tumble_core::RigidBody>().unwrap();
    let volume = 4.0 / 3.0 * std::f64::consts::PI * 1e-3;
    assert!((body.mass() - 4000.0 * volume).abs() < 1e-9);
    assert!((body.center_of_mass().x - 0.3).abs() < 1e-12 && body.initial_pose.translation.vector.z == 5.0);
}

#[test]
fn old_names_are_reported_with_the_new_ones() {
    assert_errors(
        "[world]\nseconds = 1\n",
        &["s.toml:2:1: unknown key `seconds` in [world]; this is now `duration_s`"],
    );
    assert_errors(
        "[[closure]]\nname = \"c\"\n",
        &["s.toml:1:3: unknown key `closure` in the scene; this is now `loop_joint`"],
    );
    assert_errors(
        "[[loop_joint]]\nname = \"c\"\ntype = \"weld\"\n",
        &["s.toml:3:8: `type` of loop_joint \"c\" is \"weld\"; this is now `fixed`"],
    );
    // an old name in another context is treated like any unknown word
    assert_errors(
        "[sky]\nseconds = 1\n",
        &[
            "s.toml:2:1: unknown key `seconds` in [sky]; known keys: `horizon_color`, `intensity`, `nadir_color` and `zenith_color`",
        ],
    );
}

#[test]
fn unknown_keys() {
    assert_errors("[wrold]\n", &["s.toml:1:2: unknown key `wrold` in the scene; did you mean `world`?"]);
    assert_errors("[world]\ndt = 0.1\n", &["s.toml:2:1: unknown key `dt` in [world]; did you mean `dt_s`?"]);
    assert_errors(
        &body_with("frction = 0.1"),
        &["s.toml:5:1: unknown key `frction` in body \"b\"; did you mean `friction`?"],
    );
    assert_errors(
        &shape("{ type = \"sphere\", radius_m = 1, colour = 3 }"),
        &["s.toml:2:42: unknown key `colour` in the shape of body \"b\"; known keys: `name`"],
    );
    assert_errors(
        "[sky]\nbanana = 1\nintensity = 1\n",
        &["s.toml:2:1: unknown key `banana` in [sky]; known keys: `horizon_color`, `nadir_color` and `zenith_color`"],
    );
}

#[test]
fn wrong_types() {
    assert_errors(
        "description = 3\n",
        &["s.toml:1:15: `description` of the scene is an integer: 3; expected a string in quotes"],
    );
    assert_errors(
        "[world]\nduration_s = \"ten\"\n",
        &["s.toml:2:14: `duration_s` of [world] is a string: \"ten\"; expected a time from 0 to 1e6 s"],
    );
    assert_errors(
        "[world]\nsubsteps = 1.5\n",
        &["s.toml:2:12: `substeps` of [world] is a float: 1.5; expected an integer from 1 to 1000"],
    );
    assert_errors(
        "[world]\ngravity_m_per_s2 = -9.81\n",
        &["s.toml:2:20: `gravity_m_per_s2` of [world] is a float: -9.81; expected a list of 3 numbers"],
    );
    assert_errors(
        "[world]\ngravity_m_per_s2 = [0, -9.81]\n",
        &["s.toml:2:20: `gravity_m_per_s2` of [world] has 2 entries: [0, -9.81]; expected a list of 3 numbers"],
    );
    assert_errors(
        &body_with("collidable = 1"),
        &["s.toml:5:14: `collidable` of body \"b\" is an integer: 1; expected true or false"],
    );
    assert_errors("world = 1\n", &["s.toml:1:9: [world] is an integer 1; expected a table, such as [world]"]);
    assert_errors(
        "[body]\n",
        &["s.toml:1:1: `body` of the scene is a table: [body]; expected tables, each under a line [[body]]"],
    );
    assert_errors(
        "materials = { a = 2 }\n",
        &["s.toml:1:19: [materials.a] is an integer 2; expected a table, such as [materials.NAME]"],
    );
    assert_errors(
        &shape("\"sphere\""),
        &[
            "s.toml:2:9: the shape of body \"b\" is a string \"sphere\"; expected a table, such as { type = \"sphere\", radius_m = 0.5 }",
        ],
    );
}

#[test]
fn missing_keys() {
    assert_errors(
        "[[body]]\nname = \"b\"\nmass_kg = 1\n",
        &["s.toml:1:1: body \"b\" has no `shape`; expected a shape, such as { type = \"sphere\", radius_m = 0.5 }"],
    );
    assert_errors(
        "[[body]]\nmass_kg = 1\nshape = { type = \"sphere\", radius_m = 1 }\n",
        &["s.toml:1:1: body 1 has no `name`; expected a unique name"],
    );
    assert_errors(
        &shape("{ radius_m = 1 }"),
        &[
            "s.toml:2:9: the shape of body \"b\" has no `type`; expected `sphere`, `box`, `capsule`, `cylinder`, `ellipsoid`, `cone`, `half_space`, `plane`, `mesh` or `compound`",
        ],
    );
    assert_errors(
        "[camera]\neye_m = [1, 1, 1]\n",
        &["s.toml:1:1: [camera] has no `target_m`; expected a list of 3 numbers"],
    );
    assert_errors(
        "[[light]]\ntype = \"directional\"\n",
        &["s.toml:1:1: light 1 has no `direction`; expected a direction, such as [0, 0, -1]"],
    );
    // a required key that is misspelled is reported once, at its place
    assert_errors(
        &shape("{ type = \"sphere\", raduis_m = 1 }"),
        &["s.toml:2:28: unknown key `raduis_m` in the shape of body \"b\"; did you mean `radius_m`?"],
    );
    assert_errors(
        &shape("{ tpye = \"sphere\", radius_m = 1 }"),
        &["s.toml:2:11: unknown key `tpye` in the shape of body \"b\"; did you mean `type`?"],
    );
}

#[test]
fn numbers_that_are_not_finite() {
    assert_errors(
        "[world]\nduration_s = nan\n",
        &["s.toml:2:14: `duration_s` of [world] is nan; expected a time from 0 to 1e6 s"],
    );
    assert_errors(
        &body_with("position_m = [0, inf, 0]"),
        &["s.toml:5:18: `position_m` of body \"b\" is inf; expected a finite number from -1e12 to 1e12"],
    );
    assert_errors(
        &body_with("position_m = [0, 0, -1e400]"),
        &["s.toml:5:21: `position_m` of body \"b\" is -1e400; expected a finite number from -1e12 to 1e12"],
    );
}

#[test]
fn numbers_out_of_range() {
    let positive = "expected a number greater than 0 (from 1e-9 to 1e12)";
    for (mass, name) in [("0", "0"), ("-2.5", "-2.5"), ("1e-320", "1e-320")] {
        let text = body_with("").replace("mass_kg = 1", &format!("mass_kg = {mass}"));
        assert_errors(&text, &[&format!("s.toml:4:11: `mass_kg` of body \"b\" is {name}; {positive}")]);
    }
    assert_errors(
        &body_with("friction = -0.1"),
        &["s.toml:5:12: `friction` of body \"b\" is -0.1; expected a friction coefficient from 0 to 100"],
    );
    assert_errors(
        "[materials.m]\nrestitution = 1.2\n",
        &[
            "s.toml:2:15: `restitution` of [materials.m] is 1.2; expected a restitution from 0 (no bounce) to 1 (no loss)",
        ],
    );
    assert_errors(
        &shape("{ type = \"sphere\", radius_m = 0 }"),
        &[&format!("s.toml:2:39: `radius_m` of the shape of body \"b\" is 0; {positive}")],
    );
    assert_errors(
        &shape("{ type = \"box\", size_m = [1, -2, 3] }"),
        &[&format!("s.toml:2:38: `size_m` of the shape of body \"b\" is -2; {positive}")],
    );
    assert_errors("[world]\ndt_s = 0\n", &["s.toml:2:8: `dt_s` of [world] is 0; expected a time from 1e-6 to 1 s"]);
    assert_errors(
        "[world]\niterations = -4\n",
        &["s.toml:2:14: `iterations` of [world] is -4; expected an integer from 1 to 1000000"],
    );
    assert_errors(
        "[world]\niterations = 99999999999999999999\n",
        &["s.toml:2:14: `iterations` of [world] is 99999999999999999999; expected an integer from 1 to 1000000"],
    );
    assert_errors(
        "[world]\nbudget = 0\n",
        &["s.toml:2:10: `budget` of [world] is 0; expected an integer from 1 to 4000000000"],
    );
    assert_errors(
        "[world]\nthreads = 1000\n",
        &["s.toml:2:11: `threads` of [world] is 1000; expected an integer from 0 to 256"],
    );
    assert_errors(
        "[sky]\nzenith_color = \"blue\"\n",
        &[
            "s.toml:2:16: `zenith_color` of [sky] is \"blue\"; expected a color: \"#rrggbb\", or [r, g, b] with numbers from 0 to 1",
        ],
    );
    assert_errors(
        "[sky]\nzenith_color = [0, 0, 255]\n",
        &["s.toml:2:23: `zenith_color` of [sky] is 255; expected a number from 0 to 1"],
    );
}

#[test]
fn words_that_are_not_among_the_known() {
    assert_errors(
        "[world]\nstepper = \"backtrack\"\n",
        &["s.toml:2:11: `stepper` of [world] is \"backtrack\"; did you mean `backtracking`?"],
    );
    assert_errors(
        "[world]\nsolver = \"magic\"\n",
        &["s.toml:2:10: `solver` of [world] is \"magic\"; expected `gauss_seidel`, `lcp_pyramid` or `lcp_sliding`"],
    );
    assert_errors(
        &body_with("mode = \"fixed\""),
        &["s.toml:5:8: `mode` of body \"b\" is \"fixed\"; expected `dynamic`, `static` or `kinematic`"],
    );
    assert_errors(
        &shape("{ type = \"shpere\", radius_m = 1 }"),
        &["s.toml:2:18: `type` of the shape of body \"b\" is \"shpere\"; did you mean `sphere`?"],
    );
}

#[test]
fn names_used_twice() {
    let again = body_with("") + "\n" + &body_with("");
    assert_errors(
        &again,
        &["s.toml:8:8: `name`: there is a second body \"b\"; the first is at line 2; expected a unique name"],
    );
    let grid = body_with("").replace("\"b\"", "\"g_2\"")
        + "[[grid]]\nname = \"g\"\nshape = { type = \"sphere\", radius_m = 1 }\nmass_kg = 1\ncount = [1, 1, 3]\nspacing_m = [0, 0, 2]\n";
    assert_errors(
        &grid,
        &["s.toml:7:8: `name`: there is a second grid \"g_2\"; the first is at line 2; expected a unique name"],
    );
}

#[test]
fn names_that_do_not_fit() {
    let expected = "expected a name that is not empty and has no control characters";
    assert_errors(
        &body_with("").replace("\"b\"", "\"\""),
        &[&format!("s.toml:2:8: `name` of body \"\" is \"\"; {expected}")],
    );
    let bell = SceneFile::parse(&body_with("").replace("\"b\"", "\"\\u0007\""), "s.toml").unwrap_err();
    assert!(bell.to_string().contains(expected), "{bell}");
}

#[test]
fn a_name_may_have_any_length() {
    let long = "x".repeat(200);
    let grid = body_with("").replace("[[body]]", "[[grid]]").replace("\"b\"", &format!("{long:?}"))
        + "count = [1, 1, 2]\nspacing_m = [0, 0, 2]\n";
    let world = SceneFile::parse(&grid, "s.toml").unwrap().build().unwrap().0;
    assert_eq!(
        world.ids().iter().map(|&id| world.name(id).unwrap()).collect::<Vec<_>>(),
        [format!("{long}_1"), format!("{long}_2")]
    );
}

#[test]
fn references_to_nothing() {
    assert_errors(
        &body_with("material = \"felt\""),
        &[
            "s.toml:5:12: `material` of body \"b\" is \"felt\"; expected the NAME of a table [materials.NAME]; the scene has none",
        ],
    );
    assert_errors(
        &("[materials.rubber]\n".to_owned() + &body_with("material = \"ruber\"")),
        &["s.toml:6:12: `material` of body \"b\" is \"ruber\"; did you mean `rubber`?"],
    );
    assert_errors(
        &shape("{ type = \"mesh\", mesh = \"pin\" }"),
        &[
            "s.toml:2:33: `mesh` of the shape of body \"b\" is \"pin\"; expected the NAME of a table [meshes.NAME]; the scene has none",
        ],
    );
    let two = "[meshes.vase]\ntype = \"icosphere\"\nradius_m = 1\n[meshes.bowl]\ntype = \"icosphere\"\nradius_m = 1\n";
    assert_errors(
        &(two.to_owned() + &shape("{ type = \"mesh\", mesh = \"pin\" }")),
        &["s.toml:8:33: `mesh` of the shape of body \"b\" is \"pin\"; expected `bowl` or `vase`"],
    );
    // an invalid mesh is reported once, and not again where it is used
    let wrong = "[meshes.vase]\ntype = \"icosphere\"\nradius_m = 0\n".to_owned()
        + &shape("{ type = \"mesh\", mesh = \"vase\" }");
    assert_eq!(SceneFile::parse(&wrong, "s.toml").unwrap_err().problems().len(), 1);
}

#[test]
fn mesh_files() {
    let mesh = |file: &str| format!("[meshes.m]\ntype = \"file\"\nfile = \"{file}\"\n");
    assert_errors(
        &mesh("no/bunny.obj"),
        &[
            "s.toml:3:8: `file` of [meshes.m]: there is no file no/bunny.obj; expected a path relative to the folder of the scene",
        ],
    );
    assert_errors(
        &mesh("bunny.off"),
        &["s.toml:3:8: `file` of [meshes.m] is \"bunny.off\"; expected the path of an .obj, .stl, .ply or .dae file"],
    );
}

#[test]
fn meshes_that_bound_no_solid() {
    let lathe = |points: &str| format!("[meshes.m]\ntype = \"lathe\"\nprofile_m = {points}\n");
    assert_errors(
        &lathe("[[0, 0], [1, 1], [0.5, 2]]"),
        &[
            "s.toml:3:30: `profile_m` of [meshes.m] is [0.5, 2]; expected r = 0 at both ends, so that the solid is closed",
        ],
    );
    assert_errors(
        &lathe("[[0, 0], [-1, 1], [0, 2]]"),
        &["s.toml:3:22: `profile_m` of [meshes.m] is [-1, 1]; expected r greater than 0 between the ends"],
    );
    assert_errors(
        &lathe("[[0, 2], [1, 1], [0, 0]]"),
        &[
            "s.toml:3:14: `profile_m` of [meshes.m] is [0, 2]; expected the points from the bottom of the axis to its top: these run the other way",
        ],
    );
    assert_errors(
        &lathe("[[0, 0]]"),
        &[
            "s.toml:3:13: `profile_m` of [meshes.m] is [[0, 0]]; expected a list of 3 to 1000 points [r, z] in meters, from the bottom of the axis (r = 0) to its top (r = 0)",
        ],
    );
    assert_errors(
        "[meshes.m]\ntype = \"torus\"\nradius_m = 1\ntube_radius_m = 1\n",
        &[
            "s.toml:4:17: `tube_radius_m` of [meshes.m] is 1; expected less than radius_m, 1, so that the ring has a hole",
        ],
    );
    assert_errors(
        "[meshes.m]\ntype = \"icosphere\"\nradius_m = 1\nsubdivisions = 12\n",
        &["s.toml:4:16: `subdivisions` of [meshes.m] is 12; expected an integer from 0 to 7"],
    );
}

#[test]
fn things_that_contradict_each_other() {
    assert_errors(
        &body_with("density_kg_per_m3 = 1"),
        &["s.toml:1:1: body \"b\" has both `mass_kg` and `density_kg_per_m3`; expected one of them"],
    );
    assert_errors(
        &shape("{ type = \"half_space\" }"),
        &[
            "s.toml:1:1: body \"b\" is a dynamic half-space, which has no finite mass; expected mode = \"static\" or \"kinematic\"",
        ],
    );
    assert_errors(
        &body_with("mode = \"static\"\nvelocity_m_per_s = [1, 0, 0]"),
        &[
            "s.toml:6:20: `velocity_m_per_s` of body \"b\" is [1, 0, 0]; expected no velocity for a static body; a body with mode = \"kinematic\" moves at a prescribed velocity",
        ],
    );
    assert_errors(
        &body_with("rotation_deg = [0, 0, 9]\norientation_xyzw = [0, 0, 0, 1]"),
        &[
            "s.toml:1:1: body \"b\" has more than one orientation; expected one of `orientation_xyzw`, `rotation_deg` and `rotation`",
        ],
    );
    assert_errors(
        &body_with("orientation_xyzw = [1, 0, 0, 1]"),
        &[
            "s.toml:5:20: `orientation_xyzw` of body \"b\" is [1, 0, 0, 1]; expected a quaternion [x, y, z, w] of length 1; this one has 1.414214",
        ],
    );
    assert_errors(
        &body_with("rotation = { axis = [0, 0, 0], angle_deg = 3 }"),
        &[
            "s.toml:5:21: `axis` of the rotation of body \"b\" is [0, 0, 0]; expected a direction: a vector that is not zero",
        ],
    );
    assert_errors(
        "[camera]\neye_m = [0, 0, 5]\ntarget_m = [0, 0, 1]\n",
        &[
            "s.toml:1:1: [camera] looks along its `up`, or its `target_m` equals its `eye_m`; expected a `target_m` that differs from `eye_m` in a direction other than `up`",
        ],
    );
}

#[test]
fn too_many_bodies() {
    let grid = |count: &str| {
        shape("{ type = \"sphere\", radius_m = 1 }").replace("[[body]]", "[[grid]]")
            + &format!("count = {count}\nspacing_m = [2, 2, 2]\n")
    };
    assert_errors(
        &grid("[1000, 1000, 2]"),
        &["s.toml:5:9: grid \"b\" makes 2000000 bodies; expected at most 1000000 bodies in the whole scene"],
    );
    assert_errors(
        &grid("[1000000, 1000000, 1000000]"),
        &[
            "s.toml:5:9: grid \"b\" makes 1000000000000000000 bodies; expected at most 1000000 bodies in the whole scene",
        ],
    );
    assert_errors(
        &grid("[0, 1, 1]"),
        &["s.toml:5:10: `count` of grid \"b\" is 0; expected an integer from 1 to 1000000"],
    );
    let triangle = grid("[1, 1, 1]")
        .replace("count = [1, 1, 1]\nspacing_m = [2, 2, 2]", "arrangement = \"triangle\"\nrows = 5000\nspacing_m = 2");
    assert_errors(
        &triangle,
        &["s.toml:6:8: grid \"b\" makes 12502500 bodies; expected at most 1000000 bodies in the whole scene"],
    );
}

#[test]
fn all_problems_of_a_file_in_its_order_with_columns_in_characters() {
    assert_errors(
        "description = \"é\" \n[world]\ndt_s = 3\nstepper = 1\n[materials.\"é\"]\nfriction = [1]\n",
        &[
            "s.toml:3:8: `dt_s` of [world] is 3; expected a time from 1e-6 to 1 s",
            "s.toml:4:11: `stepper` of [world] is an integer: 1; expected a string in quotes",
            "s.toml:6:12: `friction` of [materials.é] is an array: [1]; expected a friction coefficient from 0 to 100",
        ],
    );
    assert_errors(
        "materials = { \"é\" = { friction = -1 } }\n",
        &["s.toml:1:34: `friction` of [materials.é] is -1; expected a friction coefficient from 0 to 100"],
    );
}

#[test]
fn many_problems_are_counted_not_all_shown() {
    let text = "[world]\n".to_owned() + &(0..100).map(|k| format!("bad_key_{k} = 1\n")).collect::<String>();
    let error = SceneFile::parse(&text, "s.toml").unwrap_err();
    assert_eq!(error.problems().len(), 100);
    assert!(error.to_string().ends_with("s.toml: and 60 more"), "{error}");
    assert!(error.report(false).ends_with("s.toml: 100 errors, the first 40 shown\n"));
}

#[test]
fn a_text_that_is_no_toml_is_reported_once() {
    let slips = |count: usize| SceneFile::parse(&"no toml\n".repeat(count), "s.toml").unwrap_err();
    let (few, many) = (slips(2), slips(50));
    assert!((2..=5).contains(&few.problems().len()), "{few}");
    assert_eq!(many.problems().len(), 1, "{many}");
    let error = many.to_string();
    assert!(
        error.starts_with("s.toml:1:") && error.ends_with("more syntax errors follow, so this may not be TOML"),
        "{error}"
    );
}

#[test]
fn a_report_draws_the_line_and_marks_the_place() {
    let error = SceneFile::parse(&body_with("frction = 0.1"), "s.toml").unwrap_err();
    let expected = "\
error: unknown key `frction` in body \"b\"
   ,-[ s.toml:5:1 ]
   |
 5 | frction = 0.1
   | ^^^|^^^
   |    `----- did you mean `friction`?
---'
s.toml: 1 error
";
    assert_eq!(error.report(false), expected);
    assert!(error.report(true).contains('\u{1b}'), "color when asked");
}

#[test]
fn a_line_too_long_to_draw_is_only_named() {
    let text = format!("[world]\ndt_s = -1 # {}\n", "x".repeat(1000));
    let report = SceneFile::parse(&text, "s.toml").unwrap_err().report(false);
    let expected = "error: `dt_s` of [world] is -1\n  s.toml:2:8: expected a time from 1e-6 to 1 s\ns.toml: 1 error\n";
    assert_eq!(report, expected);
}

#[test]
fn pairs() {
    let balls = "[[body]]\nname = \"ball\"\nmode = \"static\"\nshape = { type = \"half_space\" }\n[materials.ice]\n";
    let pair = |lines: &str| format!("{balls}[[pair]]\n{lines}");
    assert_errors(
        &pair("a = \"ball\"\nb = \"bal\"\nfriction = 0.1\n"),
        &["s.toml:8:5: `b` of pair 1 is \"bal\"; did you mean `ball`?"],
    );
    assert_errors(
        &pair("a = \"ball\"\nb = \"ball\"\nfriction = 0.1\n"),
        &["s.toml:8:5: `b` of pair 1 is \"ball\"; expected a body other than `a`"],
    );
    assert_errors(
        &pair("materials = [\"ice\", \"icy\"]\nrestitution = 2\n"),
        &[
            "s.toml:7:21: `materials` of pair 1 is \"icy\"; did you mean `ice`?",
            "s.toml:8:15: `restitution` of pair 1 is 2; expected a restitution from 0 (no bounce) to 1 (no loss)",
        ],
    );
    assert_errors(
        &pair("materials = [\"ice\"]\nfriction = 0.1\n"),
        &[
            "s.toml:7:13: `materials` of pair 1 is [\"ice\"]; expected the names of two materials, such as [\"rubber\", \"ice\"]",
        ],
    );
    assert_errors(
        &pair("materials = [\"ice\", \"ice\"]\n"),
        &[
            "s.toml:6:1: pair 1 has no `friction`; expected `restitution`, `friction`, `rolling_friction_m`, `torsional_friction_m`, `collides` or several of them",
        ],
    );
    let twice = "materials = [\"ice\", \"ice\"]\nfriction = 0.1\n";
    assert_errors(
        &format!("{}[[pair]]\n{twice}", pair(twice)),
        &["s.toml:9:1: pair 2 names the same two as the pair at line 6; expected each pair once"],
    );
}

/// Returns two balls, and a loop joint with the given keys from line 14 on.
fn joint_with(keys: &str) -> String {
    let ball = |name: &str, x: f64| {
        format!(
            "[[body]]\nname = \"{name}\"\nshape = {{ type = \"sphere\", radius_m = 0.1 }}\nmass_kg = 1\nposition_m = [{x}, 0, 1]\n"
        )
    };
    format!("{}{}[[loop_joint]]\nname = \"j\"\na = \"x\"\n{keys}\nb = \"y\"\n", ball("x", 0.0), ball("y", 1.0))
}

#[test]
fn limits_that_exclude_the_length_of_a_joint() {
    let ends = "position_m = [0, 0, 1]\nsecond_position_m = [1, 0, 1]";
    let with = |kind: &str, more: &str| joint_with(&format!("type = \"{kind}\"\n{ends}\n{more}"));
    let expected = |limits: &str, keeps: &str| {
        format!(
            "s.toml:17:12: `limits_m` of loop_joint \"j\" is {limits}; expected limits from 0 that allow the length which the \
             joint {keeps} m"
        )
    };
    for (kind, limits, more, keeps) in [
        ("distance", "[2, 3]", "", "keeps, 1"),
        ("distance", "[0, 0.5]", "", "keeps, 1"),
        ("distance", "[0, 1]", "length_m = 1.5", "keeps, 1.5"),
        ("distance", "[-2, -1]", "", "keeps, 1"),
        ("rope", "[2, 3]", "", "allows at most, 1"),
    ] {
        let text = with(kind, &format!("limits_m = {limits}\n{more}"));
        assert_errors(&text, &[&expected(limits, keeps)]);
    }
    for (kind, limits, more) in [
        ("distance", "[1, 1]", ""),
        ("distance", "[2, 3]", "length_m = 2.5"),
        ("rope", "[0.5, 3]", ""),
        ("spring", "[2, 3]", "stiffness_n_per_m = 10"),
    ] {
        let text = with(kind, &format!("limits_m = {limits}\n{more}"));
        let scene = SceneFile::parse(&text, "s.toml").unwrap_or_else(|e| panic!("{e}"));
        assert!(scene.build().is_ok(), "{text}");
    }
}

#[test]
fn settings_of_joints_without_a_position() {
    let gear = "type = \"gear\"\nposition_m = [0, 0, 1]\naxis = [0, 0, 1]\nteeth = [2, 3]\n";
    let types = "revolute, prismatic, spherical, cylindrical, universal, planar, distance, rope, spring, screw, pulley";
    assert_errors(
        &joint_with(&format!("{gear}drive = {{ type = \"velocity\", target_rad_per_s = 1 }}")),
        &[&format!(
            "s.toml:18:9: `drive` of loop_joint \"j\" is {{ type = \"velocity\", target_rad_per_s = 1 }}; expected no `drive` of \
             type \"gear\"; types with it: {types}"
        )],
    );
    // each key that a type does not have, in turn: the types that have it
    for (kind, key, value, types) in [
        ("revolute", "pitch_m", "0.1", "screw"),
        ("revolute", "teeth", "[1, 2]", "gear"),
        ("revolute", "radius_m", "0.1", "rack"),
        ("revolute", "ratio", "2", "pulley"),
        ("revolute", "second_ground_position_m", "[1, 0, 0]", "pulley"),
        ("revolute", "second_position_m", "[1, 0, 0]", "distance, rope, spring, pulley"),
        ("revolute", "second_axis", "[1, 0, 0]", "spherical, universal, planar, gear, rack"),
        ("revolute", "length_m", "1", "distance, rope, spring, pulley"),
        ("revolute", "cone_rad", "1", "spherical"),
        ("prismatic", "angle_rad", "1", "revolute"),
        ("gear", "damping_n_m_s_per_rad", "1", types),
        ("gear", "friction_n", "1", types),
        ("gear", "effort_n_m", "1", types),
        ("gear", "armature_kg_m2", "1", "revolute, prismatic, spherical, cylindrical, universal, planar, screw"),
    ] {
        let teeth = if kind == "gear" { "teeth = [2, 3]\n" } else { "" };
        let joint = format!("type = \"{kind}\"\nposition_m = [0, 0, 1]\naxis = [0, 0, 1]\n{teeth}{key} = {value}");
        let error = SceneFile::parse(&joint_with(&joint), "s.toml").unwrap_err().to_string();
        let expected = format!(
            "`{key}` of loop_joint \"j\" is {value}; expected no `{key}` of type \"{kind}\"; types with it: {types}"
        );
        assert!(error.contains(&expected), "{error}");
    }
}

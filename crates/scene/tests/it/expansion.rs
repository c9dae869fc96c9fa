//! The result of a valid file: defaults, materials, orientations and grids.

use tumble_core::collide::Vec3;
use tumble_scene::{
    BodySpec, Combine, Integrator, LightKind, MassSpec, MeshSource, Mode, Pattern, SceneFile, ShapeSpec, Solver,
    Stepper,
};

fn read(text: &str) -> SceneFile {
    SceneFile::parse(text, "s.toml").unwrap_or_else(|error| panic!("{}", error.report(false)))
}

/// Returns the only body of a scene with these lines in its `[[body]]`.
fn body(lines: &str) -> BodySpec {
    let text = format!("[[body]]\nname = \"b\"\nshape = {{ type = \"sphere\", radius_m = 1 }}\nmass_kg = 2\n{lines}\n");
    read(&text).bodies.remove(0)
}

fn close<const N: usize>(a: [f64; N], b: [f64; N]) {
    assert!((0..N).all(|k| (a[k] - b[k]).abs() < 1e-15), "{a:?} is not {b:?}");
}

#[test]
fn the_empty_scene_has_the_defaults_of_the_documentation() {
    let scene = read("");
    assert_eq!(scene.world.gravity_m_per_s2, [0.0, 0.0, -9.81]);
    assert_eq!(scene.world.dt_s, 1.0 / 240.0);
    assert_eq!((scene.world.substeps, scene.world.iterations, scene.world.threads), (1, 200, 1));
    assert_eq!((scene.world.duration_s, scene.world.contact_tolerance_m), (5.0, 1e-7));
    assert_eq!((scene.world.sleep_after_s, scene.world.sleep_within_m), (None, 1e-5));
    assert_eq!(scene.world.stepper, Stepper::TimeStepping);
    assert_eq!(scene.world.integrator, Integrator::Verlet);
    assert_eq!(scene.world.solver, Solver::GaussSeidel);
    assert_eq!(scene.world.combine_restitution, Combine::Max);
    assert_eq!(scene.world.combine_friction, Combine::GeometricMean);
    assert!(scene.bodies.is_empty() && scene.camera.is_none() && scene.ground.is_none());
    // one sun, with a unit vector as direction
    let LightKind::Directional { direction: [x, y, z] } = scene.lights[0].kind else { panic!("a sun") };
    assert!(scene.lights.len() == 1 && (x * x + y * y + z * z - 1.0).abs() < 1e-15 && z < 0.0);
}

#[test]
fn every_word_of_the_world() {
    let scene = read(
        "[world]\nstepper = \"backtracking\"\nintegrator = \"dormand_prince\"\nintegrator_tolerance = 1e-9\nsolver = \"lcp_sliding\"\nsubsteps = 4\niterations = 7\n\
         duration_s = 2\ncontact_tolerance_m = 1e-5\ncombine_restitution = \"average\"\ncombine_friction = \"product\"\ngravity_m_per_s2 = [1, 2, 3]\nsleep_after_s = 0.25\nsleep_within_m = 1e-6\nthreads = 3\nbudget = 5000\nevent_impulse_n_s = 0.5\nmax_turn_rad = 0.25\n",
    );
    assert_eq!(scene.build().unwrap().0.settings().threads, 3);
    assert_eq!(scene.build().unwrap().0.settings().solver_settings.budget, Some(5000));
    assert_eq!(scene.build().unwrap().0.settings().event_impulse, 0.5);
    assert_eq!(scene.build().unwrap().0.settings().max_turn, 0.25);
    let world = scene.world;
    assert_eq!(
        (world.stepper, world.integrator, world.solver),
        (Stepper::Backtracking, Integrator::DormandPrince, Solver::LcpSliding)
    );
    assert_eq!((world.substeps, world.iterations, world.duration_s), (4, 7, 2.0));
    assert_eq!(world.integrator_tolerance, 1e-9);
    assert_eq!((world.sleep_after_s, world.sleep_within_m), (Some(0.25), 1e-6));
    assert_eq!((world.contact_tolerance_m, world.gravity_m_per_s2), (1e-5, [1.0, 2.0, 3.0]));
    assert_eq!((world.combine_restitution, world.combine_friction), (Combine::Average, Combine::Product));
}

#[test]
fn words_outside_of_files() {
    assert_eq!("backtracking".parse(), Ok(Stepper::Backtracking));
    for integrator in ["verlet", "symplectic_euler", "explicit_euler", "rk4", "dormand_prince"] {
        assert_eq!(integrator.parse::<Integrator>().unwrap().to_string(), integrator);
    }
    for solver in ["gauss_seidel", "lcp_pyramid", "lcp_sliding"] {
        assert_eq!(solver.parse::<Solver>().unwrap().to_string(), solver);
    }
    let error = "rk5".parse::<Integrator>().unwrap_err();
    assert_eq!(error.to_string(), "`rk5` is not known; did you mean `rk4`?");
}

#[test]
fn combine_rules_by_hand() {
    let rules = [Combine::Min, Combine::Max, Combine::Average, Combine::Product, Combine::GeometricMean];
    assert_eq!(rules.map(|rule| rule.of(0.25, 1.0)), [0.25, 1.0, 0.625, 0.25, 0.5]);
}

/// Returns restitution and friction between two bodies in the world of a scene.
fn between(scene: &SceneFile, a: &str, b: &str) -> (f64, f64) {
    let (world, _) = scene.build().unwrap();
    let id = |name: &str| (world.find(name).unwrap(), 0);
    let found = world.pair_material(id(a), id(b)).unwrap();
    (found.restitution, found.friction)
}

#[test]
fn pairs_of_bodies_and_of_materials_have_constants_of_their_own() {
    let ball = |name: &str, material: &str| {
        format!(
            "[[body]]\nname = \"{name}\"\nshape = {{ type = \"sphere\", radius_m = 1 }}\nmass_kg = 1\nmaterial = \"{material}\"\n"
        )
    };
    let pairs = "[[pair]]\nmaterials = [\"ice\", \"rubber\"]\nrestitution = 0.3\nfriction = 0.05\n\
                 [[pair]]\na = \"b\"\nb = \"a\"\nfriction = 0.6\nrolling_friction_m = 0.02\ntorsional_friction_m = 0\n\
                 [[pair]]\nmaterials = [\"ice\", \"ice\"]\nrestitution = 0.7\n";
    let materials = "[materials.ice]\nfriction = 0.01\n[materials.rubber]\nfriction = 1\nrestitution = 0.8\n";
    let text = format!("{materials}{}{}{}{pairs}", ball("a", "ice"), ball("b", "rubber"), ball("c", "ice"));
    let scene = read(&text);
    assert_eq!(between(&scene, "b", "c"), (0.3, 0.05));
    assert_eq!(between(&scene, "a", "b"), (0.3, 0.6), "bodies go before materials");
    assert_eq!(between(&scene, "a", "c"), (0.7, 0.01));
    let spec = scene.pairs.iter().find(|pair| pair.friction == Some(0.6)).unwrap();
    assert_eq!((spec.rolling_friction, spec.torsional_friction), (Some(0.02), Some(0.0)));
}

#[test]
fn a_pair_may_name_an_articulated_body_or_one_of_its_links() {
    let link = |name: &str, parent: &str| {
        format!(
            "[[articulated.link]]\nname = \"{name}\"\n{parent}joint = \"revolute\"\naxis = [0, 0, 1]\nmass_kg = 1\nshape = {{ type = \"sphere\", radius_m = 1 }}\n"
        )
    };
    let text = format!(
        "[[articulated]]\nname = \"arm\"\n{}{}[[body]]\nname = \"floor\"\nmode = \"static\"\nshape = {{ type = \"half_space\" }}\n\
         [[pair]]\na = \"arm\"\nb = \"floor\"\nrestitution = 0.2\n[[pair]]\na = \"floor\"\nb = \"arm/lower\"\nrestitution = 0.6\n",
        link("upper", ""),
        link("lower", "parent = \"upper\"\n")
    );
    let (world, _) = read(&text).build().unwrap();
    let (arm, floor) = (world.find("arm").unwrap(), world.find("floor").unwrap());
    let body = world.get::<tumble_core::ArticulatedBody>(arm).unwrap();
    let restitution = |link: usize| {
        let part = body.colliders_of(Some(link)).next().unwrap();
        world.pair_material((arm, part), (floor, 0)).unwrap().restitution
    };
    assert_eq!((restitution(0), restitution(1)), (0.2, 0.6));
}

#[test]
fn a_body_takes_what_its_material_says_unless_it_says_otherwise() {
    let text = "[materials.m]\nfriction = 0.9\nrestitution = 0.4\ncolor = \"#ff0000\"\nroughness = 0.1\n".to_owned();
    let one = |lines: &str| {
        let body = format!(
            "[[body]]\nname = \"b\"\nshape = {{ type = \"sphere\", radius_m = 1 }}\nmass_kg = 1\nmaterial = \"m\"\n{lines}\n"
        );
        read(&(text.clone() + &body)).bodies.remove(0)
    };
    let plain = one("");
    assert_eq!((plain.contact.friction, plain.contact.restitution, plain.material), (0.9, 0.4, Some(0)));
    assert_eq!((plain.appearance.color, plain.appearance.roughness), ([1.0, 0.0, 0.0], 0.1));
    let other = one("friction = 0.2\ncolor = [0, 0.5, 1]\npattern = \"wood\"");
    assert_eq!((other.contact.friction, other.contact.restitution), (0.2, 0.4));
    assert_eq!(
        (other.appearance.color, other.appearance.roughness, other.appearance.pattern),
        ([0.0, 0.5, 1.0], 0.1, Pattern::Wood)
    );
    let ringed = one("pattern = \"rings\"\npattern_offset_m = -0.2");
    assert_eq!((ringed.appearance.pattern, ringed.appearance.pattern_offset_m), (Pattern::Rings, -0.2));
    let bare = body("");
    assert_eq!(
        (bare.appearance.pattern, bare.appearance.pattern_scale_m, bare.appearance.pattern_offset_m),
        (Pattern::Plain, 0.1, 0.0)
    );
    assert_eq!((bare.contact.friction, bare.contact.restitution, bare.material), (0.5, 0.0, None));
}

#[test]
fn contact_constants_come_from_the_material_and_the_body() {
    let text = "[materials.m]\nrolling_friction_m = 0.01\nstatic_friction = 0.8\nadhesion_n = 3\n\
                [[body]]\nname = \"b\"\nshape = { type = \"sphere\", radius_m = 1 }\nmass_kg = 1\nmaterial = \"m\"\n\
                torsional_friction_m = 0.02\nstribeck_speed_m_per_s = 0.1\nfriction_scale = [1, 0.5, 2]\n\
                tangential_restitution = 0.3\nadhesion_n = 4\n";
    let contact = read(text).bodies[0].contact;
    assert_eq!((contact.rolling_friction, contact.torsional_friction), (0.01, 0.02));
    assert_eq!((contact.friction, contact.static_friction, contact.stribeck_speed), (0.5, 0.8, 0.1));
    assert_eq!((contact.friction_scale, contact.tangential_restitution), (Vec3::new(1.0, 0.5, 2.0), 0.3));
    assert_eq!(contact.adhesion, 4.0);
}

#[test]
fn a_body_with_every_key() {
    let it = body(
        "mode = \"kinematic\"\nposition_m = [1, 2, 3]\nvelocity_m_per_s = [4, 5, 6]\nangular_velocity_rad_per_s = [7, 8, 9]\n\
         linear_damping_per_s = 0.1\nangular_damping_per_s = 0.2\ncollidable = false\nenabled = false\nvisible = false\nclearcoat = 1\nglow = true\nmetallic = 0.5\n\
         group = 5\nmask = [0, 63]\nsensor = true\ncenter_m = [0, 0, 0.5]\n\
         inertia_kg_m2 = [1, 2, 2.5, 0, 0, 0.1]\ngravity_scale = -0.5\nlocked = [\"x\", \"rotation_z\"]",
    );
    assert_eq!((it.mode, it.mass), (Mode::Kinematic, Some(MassSpec::Mass(2.0))));
    assert_eq!((it.position_m, it.velocity_m_per_s), ([1.0, 2.0, 3.0], [4.0, 5.0, 6.0]));
    assert_eq!(it.angular_velocity_rad_per_s, [7.0, 8.0, 9.0]);
    assert_eq!((it.linear_damping_per_s, it.angular_damping_per_s), (0.1, 0.2));
    assert!(!it.collidable && !it.enabled && !it.visible);
    assert_eq!((it.center_m, it.gravity_scale), (Some([0.0, 0.0, 0.5]), -0.5));
    let inertia = it.inertia_kg_m2.unwrap();
    assert_eq!((inertia.m11, inertia.m22, inertia.m33, inertia.m23, inertia.m12), (1.0, 2.0, 2.5, 0.1, 0.0));
    assert_eq!((it.locked.translation, it.locked.rotation), ([true, false, false], [false, false, true]));
    assert_eq!((it.group.bit(), it.mask, it.sensor), (1 << 5, 1 | 1 << 63, true));
    assert_eq!((it.appearance.clearcoat, it.appearance.metallic, it.appearance.glow), (1.0, 0.5, true));
}

#[test]
fn shapes_and_meshes() {
    let scene = read(
        "[meshes.c]\ntype = \"cylinder\"\nradius_m = 1\nlength_m = 2\nsphere_tree_depth = 4\nsphere_tree_max_error = 0.02\n[meshes.b]\ntype = \"box\"\nsize_m = [1, 2, 3]\n\
         [meshes.p]\ntype = \"capsule\"\nradius_m = 1\nlength_m = 2\nsegments = 12\n\
         [[body]]\nname = \"1\"\ndensity_kg_per_m3 = 7800\nshape = { type = \"mesh\", mesh = \"c\" }\n\
         [[body]]\nname = \"2\"\nmass_kg = 1\nshape = { type = \"capsule\", radius_m = 1, length_m = 2 }\n\
         [[body]]\nname = \"3\"\nmass_kg = 1\nshape = { type = \"cylinder\", radius_m = 1, length_m = 2 }\n\
         [[body]]\nname = \"4\"\nmode = \"static\"\nshape = { type = \"half_space\" }\n",
    );
    let ShapeSpec::Mesh { mesh } = scene.bodies[0].shape else { panic!("a mesh") };
    assert_eq!((scene.meshes[mesh].name.as_str(), scene.meshes[mesh].sphere_tree_depth), ("c", Some(4)));
    assert_eq!(scene.meshes[mesh].sphere_tree_max_error, Some(0.02));
    assert_eq!(scene.meshes[mesh].source, MeshSource::Cylinder { radius_m: 1.0, length_m: 2.0, segments: 48 });
    assert_eq!(scene.meshes[2].source, MeshSource::Capsule { radius_m: 1.0, length_m: 2.0, segments: 12 });
    assert_eq!(scene.bodies[0].mass, Some(MassSpec::Density(7800.0)));
    assert_eq!(scene.bodies[1].shape, ShapeSpec::Capsule { radius_m: 1.0, length_m: 2.0 });
    assert_eq!(scene.bodies[2].shape, ShapeSpec::Cylinder { radius_m: 1.0, length_m: 2.0 });
    assert_eq!((&scene.bodies[3].shape, scene.bodies[3].mass), (&ShapeSpec::HalfSpace, None));
}

#[test]
fn orientations() {
    let half = 0.5f64.sqrt();
    close(body("").orientation_xyzw, [0.0, 0.0, 0.0, 1.0]);
    close(body("orientation_xyzw = [0.0, 0.6, 0.0, 0.8]").orientation_xyzw, [0.0, 0.6, 0.0, 0.8]);
    // 90 degrees about z; the length of the axis does not matter
    close(body("rotation = { axis = [0, 0, 2], angle_deg = 90 }").orientation_xyzw, [0.0, 0.0, half, half]);
    close(body("rotation_deg = [90, 0, 0]").orientation_xyzw, [half, 0.0, 0.0, half]);
    // Roll first, then yaw, about fixed axes: a turn about x by 90, then about z by 90, takes y to
    // z to z, and x to y. That is the third of a turn about (1, 1, 1): x to y, y to z, z to x.
    close(body("rotation_deg = [90, 0, 90]").orientation_xyzw, [0.5, 0.5, 0.5, 0.5]);
    // a quaternion with rounding errors is normalized
    let q = body("orientation_xyzw = [0.0, 0.6004, 0.0, 0.8]").orientation_xyzw;
    assert!((q.iter().map(|x| x * x).sum::<f64>() - 1.0).abs() < 1e-15);
}

fn grid(lines: &str) -> Vec<BodySpec> {
    read(&format!("[[grid]]\nname = \"g\"\nshape = {{ type = \"sphere\", radius_m = 1 }}\nmass_kg = 1\n{lines}\n"))
        .bodies
}

#[test]
fn a_box_of_bodies_counts_along_x_then_y_then_z() {
    let bodies = grid("position_m = [10, 0, 0]\ncount = [2, 3, 2]\nspacing_m = [1, 10, 100]");
    assert_eq!(bodies.len(), 12);
    assert_eq!((bodies[0].name.as_str(), bodies[0].position_m), ("g_1", [10.0, 0.0, 0.0]));
    assert_eq!((bodies[1].name.as_str(), bodies[1].position_m), ("g_2", [11.0, 0.0, 0.0]));
    assert_eq!(bodies[2].position_m, [10.0, 10.0, 0.0]);
    assert_eq!((bodies[11].name.as_str(), bodies[11].position_m), ("g_12", [11.0, 20.0, 100.0]));
    let centered = grid("count = [2, 3, 1]\nspacing_m = [1, 10, 100]\ncentered = true");
    assert_eq!((centered[0].position_m, centered[5].position_m), ([-0.5, -10.0, 0.0], [0.5, 10.0, 0.0]));
}

#[test]
fn a_triangle_is_numbered_from_its_apex_left_to_right() {
    let bodies = grid("arrangement = \"triangle\"\nrows = 3\nspacing_m = 2\ntoward = [0, 1, 0]");
    let root = 3f64.sqrt();
    let expected = [[0.0, 0.0], [-1.0, root], [1.0, root], [-2.0, 2.0 * root], [0.0, 2.0 * root], [2.0, 2.0 * root]];
    assert_eq!(bodies.len(), expected.len());
    for (body, [x, y]) in bodies.iter().zip(expected) {
        assert!(
            (body.position_m[0] - x).abs() < 1e-14 && (body.position_m[1] - y).abs() < 1e-14,
            "{:?}",
            body.position_m
        );
    }
}

#[test]
fn copies_take_colors_in_turn() {
    let bodies =
        grid("count = [3, 1, 1]\nspacing_m = [2, 2, 2]\ncolors = [\"#000000\", \"#ffffff\"]\npatterns = [\"felt\"]");
    let colors: Vec<f64> = bodies.iter().map(|body| body.appearance.color[0]).collect();
    assert_eq!(colors, [0.0, 1.0, 0.0]);
    assert!(bodies.iter().all(|body| body.appearance.pattern == Pattern::Felt));
}

#[test]
fn the_most_bodies_there_may_be() {
    let bodies = grid("count = [100, 100, 100]\nspacing_m = [2, 2, 2]");
    assert_eq!((bodies.len(), bodies[999_999].name.as_str()), (1_000_000, "g_1000000"));
}

//! The shipped scenes: each one reads, and has the properties that its description states, by
//! numbers computed here.

use tumble_core::collide::ContactMode;
use tumble_scene::{BodySpec, Combine, MassSpec, MeshSource, Mode, SceneFile, ShapeSpec, Stepper, shipped};

fn scene(name: &str) -> SceneFile {
    let found = shipped().iter().find(|scene| scene.name == name).expect("the scene is shipped");
    found.read().unwrap_or_else(|error| panic!("{}", error.report(false)))
}

fn body<'s>(scene: &'s SceneFile, name: &str) -> &'s BodySpec {
    scene.bodies.iter().find(|body| body.name == name).unwrap_or_else(|| panic!("no body {name}"))
}

fn dynamic(scene: &SceneFile) -> Vec<&BodySpec> {
    scene.bodies.iter().filter(|body| body.mode == Mode::Dynamic).collect()
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt()
}

/// Returns `v` rotated by the unit quaternion `q`, by the textbook's matrix, row by row.
fn turned([x, y, z, w]: [f64; 4], v: [f64; 3]) -> [f64; 3] {
    let rows = [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
    ];
    rows.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

/// Returns volume and height of the center of mass of a lathe profile: sums of cone frusta.
fn frusta(profile: &[[f64; 2]]) -> (f64, f64) {
    let (mut volume, mut moment) = (0.0, 0.0);
    for pair in profile.windows(2) {
        let ([a, z0], [b, z1]) = (pair[0], pair[1]);
        let h = z1 - z0;
        volume += std::f64::consts::PI * h * (a * a + a * b + b * b) / 3.0;
        let first = a * a + 2.0 * a * b + 3.0 * b * b;
        moment += std::f64::consts::PI * h * (z0 * (a * a + a * b + b * b) / 3.0 + h * first / 12.0);
    }
    (volume, moment / volume)
}

#[test]
fn all_read_and_describe_themselves() {
    assert_eq!(shipped().len(), 26);
    for one in shipped() {
        let scene = scene(one.name);
        assert_eq!(scene.description, one.description());
        assert!(scene.description.len() > 20, "{}: {:?}", one.name, scene.description);
        assert!(scene.camera.is_some() && scene.ground.is_some());
        assert!(dynamic(&scene).iter().all(|body| body.mass.is_some()));
        assert_eq!(scene.world.gravity_m_per_s2, [0.0, 0.0, -9.81]);
    }
}

#[test]
fn falling_has_a_dozen_solids_apart_from_each_other_above_a_box_of_five() {
    let scene = scene("falling");
    let solids = dynamic(&scene);
    assert!(solids.len() >= 12, "{}", solids.len());
    assert!(solids.iter().filter(|body| matches!(body.shape, ShapeSpec::Mesh { .. })).count() >= 8);
    let walls = scene.bodies.iter().filter(|b| b.mode == Mode::Static && matches!(b.shape, ShapeSpec::Box { .. }));
    assert_eq!(walls.count(), 5);
    for (i, a) in solids.iter().enumerate() {
        // clear of the floor and the walls: inside 1.2 m of the middle by its own size
        assert!(
            a.position_m[2] > reach(&scene, a)
                && a.position_m[0].abs().max(a.position_m[1].abs()) + reach(&scene, a) < 1.2
        );
        for b in &solids[i + 1..] {
            let apart = distance(a.position_m, b.position_m) - reach(&scene, a) - reach(&scene, b);
            assert!(apart > 0.0, "{} and {} may overlap by {} m", a.name, b.name, -apart);
        }
    }
}

/// Returns the radius of a sphere about the shape's origin that contains the shape.
fn reach(scene: &SceneFile, body: &BodySpec) -> f64 {
    match &body.shape {
        ShapeSpec::Sphere { radius_m } => *radius_m,
        ShapeSpec::Box { size_m: [x, y, z] } => 0.5 * (x * x + y * y + z * z).sqrt(),
        ShapeSpec::Capsule { radius_m, length_m } => radius_m + 0.5 * length_m,
        ShapeSpec::Cylinder { radius_m, length_m } => radius_m.hypot(0.5 * length_m),
        ShapeSpec::HalfSpace => f64::INFINITY,
        ShapeSpec::Compound { .. }
        | ShapeSpec::RoundedBox { .. }
        | ShapeSpec::RoundedCylinder { .. }
        | ShapeSpec::Ellipsoid { .. }
        | ShapeSpec::Cone { .. } => panic!("{} has another shape than these scenes", body.name),
        ShapeSpec::Mesh { mesh } => match &scene.meshes[*mesh].source {
            MeshSource::Lathe { profile_m, .. } => profile_m.iter().map(|[r, z]| r.hypot(*z)).fold(0.0, f64::max),
            MeshSource::Torus { radius_m, tube_radius_m, .. } => radius_m + tube_radius_m,
            MeshSource::Icosphere { radius_m, .. } => *radius_m,
            MeshSource::Cylinder { radius_m, length_m, .. } => radius_m.hypot(0.5 * length_m),
            other => panic!("no such mesh in this scene: {other:?}"),
        },
    }
}

#[test]
fn stack_is_ten_half_meter_cubes_each_on_the_next() {
    let scene = scene("stack");
    let crates = dynamic(&scene);
    assert_eq!(crates.len(), 10);
    for (k, one) in crates.iter().enumerate() {
        assert_eq!(one.shape, ShapeSpec::Box { size_m: [0.5; 3] });
        assert_eq!(one.position_m, [0.0, 0.0, 0.25 + 0.5 * k as f64]);
        assert_eq!(one.name, format!("crate_{}", k + 1));
    }
}

#[test]
fn incline_lies_flat_on_the_ramp_and_stops_on_it() {
    let scene = scene("incline");
    let (ramp, block) = (body(&scene, "ramp"), body(&scene, "block"));
    let angle = 20f64.to_radians();
    let up = turned(ramp.orientation_xyzw, [0.0, 0.0, 1.0]);
    assert!(distance(up, [angle.sin(), 0.0, angle.cos()]) < 1e-15);
    assert_eq!(ramp.orientation_xyzw, block.orientation_xyzw);
    // half of each thickness between the centers along the normal: the faces touch
    let between: f64 = (0..3).map(|k| (block.position_m[k] - ramp.position_m[k]) * up[k]).sum();
    assert!((between - 0.1).abs() < 1e-12, "{between}");
    let v = block.velocity_m_per_s;
    assert!((distance(v, [0.0; 3]) - 2.0).abs() < 1e-12);
    assert!((0..3).map(|k| v[k] * up[k]).sum::<f64>().abs() < 1e-12 && v[0] > 0.0);
    let mu = scene.world.combine_friction.of(ramp.contact.friction, block.contact.friction);
    assert!(mu > angle.tan());
    assert!(scene.world.combine_restitution.of(ramp.contact.restitution, block.contact.restitution) > 0.0);
    // The block starts 1 m above the middle and needs v^2 / 2a = 0.9192 m.
    let stop = 4.0 / (2.0 * 9.81 * (mu * angle.cos() - angle.sin()));
    assert!((stop - 0.9192).abs() < 1e-4);
}

#[test]
fn billiards_is_regulation() {
    let scene = scene("billiards");
    let balls = dynamic(&scene);
    assert_eq!(balls.len(), 16);
    for ball in &balls {
        assert_eq!(ball.shape, ShapeSpec::Sphere { radius_m: 0.028575 });
        assert_eq!(ball.mass, Some(MassSpec::Mass(0.17)));
        assert_eq!(ball.position_m[2], 0.028575);
    }
    // A full triangle of 15 balls has 30 touching pairs; the cue ball touches none.
    let mut touching = 0;
    for (i, a) in balls.iter().enumerate() {
        for b in &balls[i + 1..] {
            let gap = distance(a.position_m, b.position_m) - 0.05715;
            assert!(gap > -1e-12, "{} and {} overlap", a.name, b.name);
            touching += usize::from(gap < 1e-12);
        }
    }
    assert_eq!(touching, 30);
    let (cue, first) = (body(&scene, "cue_ball"), body(&scene, "ball_1"));
    assert!((distance(cue.velocity_m_per_s, [0.0; 3]) - 9.0).abs() < 1e-12);
    assert_eq!(first.position_m[0], 2.54 / 4.0);
    // it is aimed at the first ball: the cross product of displacement and velocity vanishes
    let way = [first.position_m[0] - cue.position_m[0], first.position_m[1] - cue.position_m[1]];
    assert!((way[0] * cue.velocity_m_per_s[1] - way[1] * cue.velocity_m_per_s[0]).abs() < 1e-12);
    let pair = |combine: Combine, a: f64, b: f64| combine.of(a, b);
    let (friction, restitution) = (scene.world.combine_friction, scene.world.combine_restitution);
    let (bed, cushion) = (body(&scene, "bed"), body(&scene, "cushion_long_1"));
    assert_eq!(bed.shape, ShapeSpec::Box { size_m: [2.54, 1.27, 0.04] });
    assert!((pair(friction, cue.contact.friction, bed.contact.friction) - 0.2).abs() < 1e-12);
    assert!((pair(friction, cue.contact.friction, cushion.contact.friction) - 0.14).abs() < 1e-12);
    assert_eq!(pair(restitution, cue.contact.restitution, cushion.contact.restitution), 0.8);
    assert_eq!(pair(restitution, cue.contact.restitution, first.contact.restitution), 0.95);
    check_cushions(&scene);
}

/// Checks that the six cushions are on the edges of the playing surface, 36.5 mm high, and leave
/// six mouths.
fn check_cushions(scene: &SceneFile) {
    let cushions: Vec<&BodySpec> = scene.bodies.iter().filter(|b| b.name.starts_with("cushion_")).collect();
    assert_eq!(cushions.len(), 6);
    for one in cushions {
        let ShapeSpec::Box { size_m } = one.shape else { panic!("{} is no box", one.name) };
        assert!((one.position_m[2] + 0.5 * size_m[2] - 0.0365).abs() < 1e-12);
        let inner = |axis: usize| one.position_m[axis].abs() - 0.5 * size_m[axis];
        match size_m[0] > size_m[1] {
            true => {
                // Mouths: 130 mm at the side, and 117 mm across the corner's cut of 82.7 mm.
                assert!((inner(1) - 0.635).abs() < 1e-12 && (inner(0) - 0.065).abs() < 1e-12);
                let corner = 1.27 - (one.position_m[0].abs() + 0.5 * size_m[0]);
                assert!((corner * 2f64.sqrt() - 0.117).abs() < 1e-4, "{corner}");
            }
            false => assert!((inner(0) - 1.27).abs() < 1e-12),
        }
    }
}

#[test]
fn bowling_is_regulation() {
    let scene = scene("bowling");
    let pins: Vec<&BodySpec> =
        scene.bodies.iter().filter(|body| body.name.starts_with("pin_") && body.mode == Mode::Dynamic).collect();
    assert_eq!(pins.len(), 10);
    assert_eq!(pins[0].position_m, [18.288, 0.0, 0.0]);
    // pin 2 is on the left (+y), 3 on the right; 7 and 10 are the ends of the last row, 3 x 12 in
    // apart
    assert!(pins[1].position_m[1] > 0.0 && pins[2].position_m[1] < 0.0);
    assert!((distance(pins[6].position_m, pins[9].position_m) - 3.0 * 0.3048).abs() < 1e-12);
    assert!((distance(pins[0].position_m, pins[6].position_m) - 3.0 * 0.3048).abs() < 1e-12);
    let MeshSource::Lathe { profile_m, .. } = &scene.meshes[0].source else { panic!("a lathe") };
    let widest = profile_m.iter().map(|p| p[0]).fold(0.0, f64::max);
    assert!((2.0 * widest - 0.12106).abs() < 1e-5 && profile_m.last().unwrap()[1] == 0.381);
    // the rules require 3 lb 6 oz to 3 lb 10 oz, and a center of mass 5 5/8 to 5 15/16 in high
    let Some(MassSpec::Mass(mass)) = pins[0].mass else { panic!("a mass") };
    assert!((1.531..=1.645).contains(&mass));
    let (volume, height) = frusta(profile_m);
    assert!((0.1429..=0.1509).contains(&height), "{height}");
    assert!((volume - 0.002077).abs() < 2e-6, "{volume}");
    check_hook(&scene);
}

/// While a uniform ball slips, its slip keeps its direction and decreases at 7/2 mu g, so its path
/// is a parabola; then it rolls straight on. It must reach pin 1 from the right, in the pocket.
fn check_hook(scene: &SceneFile) {
    let (ball, lane) = (body(scene, "ball"), body(scene, "lane"));
    let (mu, g, r) = (scene.world.combine_friction.of(ball.contact.friction, lane.contact.friction), 9.81, 0.1085);
    assert!((mu - 0.08).abs() < 1e-12);
    let ([vx, vy, _], [wx, wy, _]) = (ball.velocity_m_per_s, ball.angular_velocity_rad_per_s);
    let slip = [vx - r * wy, vy + r * wx];
    let speed = slip[0].hypot(slip[1]);
    let push = slip.map(|s| -mu * g * s / speed);
    let rolls_at = 2.0 * speed / (7.0 * mu * g);
    let at = |t: f64| {
        let (slipping, rolling) = (t.min(rolls_at), (t - rolls_at).max(0.0));
        let path =
            |x0: f64, v: f64, a: f64| x0 + v * slipping + 0.5 * a * slipping * slipping + (v + a * slipping) * rolling;
        [path(ball.position_m[0], vx, push[0]), path(ball.position_m[1], vy, push[1])]
    };
    // Ball and pin touch 0.1085 m above the lane, where the pin's radius is 0.0600 m.
    let touch = (0..400_000).map(|k| at(k as f64 * 1e-5)).find(|p| (18.288 - p[0]).hypot(p[1]) < r + 0.0600);
    let [x, y] = touch.expect("the ball reaches pin 1");
    assert!(x > 18.0 && (-0.085..-0.05).contains(&y), "{x} {y}");
    // it never leaves the lane on its way
    assert!((0..2600).map(|k| at(k as f64 * 1e-3)).all(|p| p[1].abs() < 0.527));
    assert_eq!((scene.world.stepper, scene.world.contacts), (Stepper::TimeStepping, ContactMode::Surface));
}

/// Gives each table an unknown key, reads the known keys from the error message, and searches the
/// README for them.
#[test]
fn the_reference_names_every_key() {
    let readme = include_str!("../../../../scenes/README.md");
    let sphere = "name = \"b\"\nshape = { type = \"sphere\", radius_m = 1 }\nmass_kg = 1\n";
    let mesh = |kind: &str| format!("[meshes.m]\ntype = \"{kind}\"\n");
    let shape = |kind: &str| {
        format!("[[body]]\nname = \"b\"\nmode = \"static\"\nshape = {{ type = \"{kind}\", qqqqqqqqqqqq = 1 }}\n")
    };
    let mut texts = vec![
        "qqqqqqqqqqqq = 1\n".to_owned(),
        "[world]\n".to_owned(),
        "[materials.m]\n".to_owned(),
        "[camera]\neye_m = [1, 1, 1]\ntarget_m = [0, 0, 0]\n".to_owned(),
        "[[light]]\ntype = \"point\"\n".to_owned(),
        "[[light]]\ntype = \"directional\"\n".to_owned(),
        "[[pair]]\n".to_owned(),
        "[sky]\n".to_owned(),
        "[ground]\n".to_owned(),
        format!("[[body]]\n{sphere}"),
        format!("[[grid]]\n{sphere}count = [1, 1, 1]\nspacing_m = [1, 1, 1]\n"),
        format!("[[grid]]\n{sphere}arrangement = \"triangle\"\nrows = 1\nspacing_m = 1\n"),
    ];
    texts.extend(["file", "lathe", "torus", "icosphere", "cylinder", "capsule", "box"].map(mesh));
    texts.extend(["sphere", "box", "capsule", "cylinder", "half_space", "mesh"].map(shape));
    let mut seen = 0;
    for mut text in texts {
        if !text.contains("qqqqqqqqqqqq") {
            text += "qqqqqqqqqqqq = 1\n";
        }
        let error = SceneFile::parse(&text, "s.toml").unwrap_err();
        let answer =
            error.problems().iter().find(|problem| problem.message.contains("qqqqqqqqqqqq")).expect("it is unknown");
        for key in answer.expected.split('`').skip(1).step_by(2) {
            assert!(readme.contains(key), "scenes/README.md does not name `{key}`");
            seen += 1;
        }
    }
    assert!(seen > 80, "{seen}");
}

//! Soft bodies, particles, flocks and fields of scene files: claims of the pages of the shipped ones against closed forms,
//! the defaults, and bad input.

use crate::bad_input::assert_errors;
use tumble_behaviors::{Cloth, Emitter, Flock, Helm, Jelly, ParticleSettings, ParticleSystem, SpringMesh, Steering};
use tumble_core::collide::Vec3;
use tumble_core::{ObjectId, RigidBody, World};
use tumble_scene::{Grid, SceneFile, shipped};

const G: f64 = 9.81;

fn load(name: &str) -> World {
    shipped().iter().find(|scene| scene.name == name).expect("the scene is shipped").read().unwrap().build().unwrap().0
}

fn parsed(text: &str) -> World {
    SceneFile::parse(text, "s.toml").unwrap_or_else(|error| panic!("{error}")).build().unwrap().0
}

fn run(world: &mut World, end: f64) {
    while world.time() < end - 1e-9 {
        world.step().unwrap();
    }
}

fn nodes(world: &World, name: &str) -> Vec<Vec3> {
    SpringMesh::positions(world, world.find(name).unwrap()).unwrap()
}

fn center(points: &[Vec3]) -> Vec3 {
    points.iter().sum::<Vec3>() / points.len() as f64
}

fn living(world: &World, name: &str) -> Vec<Vec3> {
    ParticleSystem::particles(world, world.find(name).unwrap()).unwrap().map(|particle| particle.position).collect()
}

fn place(world: &World, id: ObjectId) -> Vec3 {
    world.part_state(id, 0).unwrap().position()
}

#[test]
fn the_banner_hangs_along_the_sum_of_wind_and_weight() {
    let mut scene = shipped().iter().find(|scene| scene.name == "cloth").unwrap().read().unwrap();
    scene.behaviors.soft.retain(|soft| soft.name == "banner"); // the sheet takes most of the time
    let (mut world, rod) = (scene.build().unwrap().0, 1.25 + 0.6);
    run(&mut world, 12.0);
    let hanging = nodes(&world, "banner");
    // the rod bears no moment about itself, and every free node bears the same force: the moments cancel
    let (slope, middle) = (0.002 * 4.0 / (0.001 * G), center(&hanging));
    assert!((middle.x - slope * (rod - middle.z)).abs() < 1e-5, "{middle:?} is off the plane of slope {slope}");
    // it wrinkles a little: its springs across are pressed together
    for node in &hanging {
        assert!((node.x - slope * (rod - node.z)).abs() < 5e-3, "{node:?} is off the plane of slope {slope}");
    }
    let lowest = hanging.iter().map(|node| node.z).fold(f64::INFINITY, f64::min);
    assert!((rod - lowest) > 1.2 * (1.0 / (1.0 + slope * slope)).sqrt(), "the springs give, they do not shrink");
}

#[test]
fn the_sheet_falls_flat_and_then_lies_on_the_ball() {
    let mut world = load("cloth");
    // its lowest points have 0.93 − 0.4 − 0.3 − 0.03 = 0.2 m to fall: √(0.4/g) = 0.2019 s
    run(&mut world, 0.19);
    let (t, sheet) = (world.time(), nodes(&world, "sheet"));
    for node in &sheet {
        assert!((node.z - (0.93 - 0.5 * G * t * t)).abs() < 1e-9, "{node:?}");
    }
    let ball = Vec3::new(0.0, -0.7, 0.4);
    while world.time() < 1.5 {
        world.step().unwrap();
        for node in nodes(&world, "sheet") {
            assert!((node - ball).norm() > 0.33 - 2e-3, "{node:?} is within the ball at {} s", world.time());
            assert!(node.z > 0.03 - 2e-3, "{node:?} is below the floor at {} s", world.time());
        }
    }
    let sheet = nodes(&world, "sheet");
    let on_ball = sheet.iter().filter(|node| (*node - ball).norm() < 0.335).count();
    assert!(on_ball > 20, "{on_ball} of 289 nodes touch the ball");
}

#[test]
fn jelly_falls_as_a_point_and_the_plate_bears_its_weight() {
    let mut world = load("jelly");
    let [lower, upper] = ["lower", "upper"].map(|name| center(&nodes(&world, name)));
    // the lowest node of `lower` is above the plate until at least 0.15 s
    run(&mut world, 0.15);
    let drop = 0.5 * G * world.time() * world.time();
    for (name, start) in [("lower", lower), ("upper", upper)] {
        let now = center(&nodes(&world, name));
        assert!((now - (start - Vec3::new(0.0, 0.0, drop))).norm() < 1e-9, "{name}: {now:?}");
    }
    run(&mut world, 2.5);
    // 3 + 1.5 + 4 + 2 kg, over half a second
    let plate = world.find("plate").unwrap();
    let (mut sum, frames) = (0.0, 120);
    for _ in 0..frames {
        world.step().unwrap();
        sum += world
            .contacts()
            .iter()
            .map(|c| {
                if c.b == plate {
                    c.force.z
                } else if c.a == plate {
                    -c.force.z
                } else {
                    0.0
                }
            })
            .sum::<f64>();
    }
    let weight = 10.5 * G;
    assert!((sum / f64::from(frames) - weight).abs() < 0.01 * weight, "{} N, not {weight} N", sum / f64::from(frames));
}

#[test]
fn sparks_are_as_many_as_their_rate_and_their_life_give() {
    let mut world = load("sparks");
    let highest = 0.76 + 0.02 + 25.0 / (2.0 * G);
    while world.time() < 2.0 - 1e-9 {
        world.step().unwrap();
        let sparks = living(&world, "sparks");
        let expected = 900.0 * world.time().min(1.2);
        assert!((sparks.len() as f64 - expected).abs() <= 4.0, "{} at {} s", sparks.len(), world.time());
        for spark in &sparks {
            assert!(spark.z < highest && spark.z > 0.006 - 1e-6, "{spark:?}");
        }
    }
}

#[test]
fn smoke_takes_the_velocity_of_the_wind_and_of_its_lift() {
    let mut world = load("campfire");
    let wanted = Vec3::new(0.3, 0.0, 0.11 * G / 0.9);
    run(&mut world, 5.0);
    let smoke: Vec<_> = ParticleSystem::particles(&world, world.find("smoke").unwrap()).unwrap().collect();
    assert!(smoke.len().abs_diff(280) <= 1, "{} puffs", smoke.len());
    for puff in smoke {
        let age = puff.lifetime - puff.life;
        // it began within the cone, with w + (v − w)·e^(0.9·τ)
        let born = wanted + (puff.velocity - wanted) * (0.9 * age).exp();
        assert!((0.5 - 1e-9..0.9 + 1e-9).contains(&born.norm()), "{} m/s", born.norm());
        assert!(born.z / born.norm() > 25f64.to_radians().cos() - 1e-9);
    }
}

#[test]
fn drops_of_the_fountain_rise_as_high_as_their_speed_gives() {
    let mut world = load("campfire");
    let mut highest = 0.0f64;
    while world.time() < 2.0 - 1e-9 {
        world.step().unwrap();
        for drop in living(&world, "drops") {
            highest = highest.max(drop.z);
            assert!(drop.z > 0.006 - 1e-6, "{drop:?}");
        }
    }
    assert!(living(&world, "drops").len().abs_diff(900) <= 1);
    let most = 0.56 + 0.01 + 2.5 * 2.5 / (2.0 * G);
    assert!(highest < most && highest > most - 0.02, "{highest} of {most} m");
}

#[test]
fn looks_of_particles_are_read() {
    let text = "[[particle_system]]\nname = \"p\"\nopacity = 0.4\nscale = [1, 3]\ncolor = \"#ff0000\"\nend_color = [0, 0, 1]\n\
        [[particle_system]]\nname = \"q\"\nopacity = [0.5, 0]\nscale = 2\n[[particle_system]]\nname = \"r\"\n";
    let world = parsed(text);
    let look = |name: &str| world.get::<ParticleSystem>(world.find(name).unwrap()).unwrap().look().clone();
    let [p, q, r] = ["p", "q", "r"].map(look);
    assert_eq!((p.opacity, p.scale, p.end_color), (Some([0.4; 2]), [1.0, 3.0], Some([0.0, 0.0, 1.0])));
    assert_eq!((q.opacity, q.scale, q.end_color), (Some([0.5, 0.0]), [2.0; 2], None));
    assert_eq!((r.opacity, r.scale, r.end_color), (None, [1.0; 2], None));
}

#[test]
fn the_middle_of_the_rocket_falls_with_drag() {
    let mut world = load("sparks");
    run(&mut world, 0.5 - 1e-6);
    assert!(living(&world, "rocket").is_empty());
    run(&mut world, 1.5);
    let (rocket, t, k) = (living(&world, "rocket"), world.time() - 0.5, 1.5);
    assert_eq!(rocket.len(), 1000);
    let fallen = G / k * (t - (1.0 - (-k * t).exp()) / k);
    let middle = center(&rocket);
    assert!((middle - Vec3::new(0.3, 1.2, 2.4 - fallen)).norm() < 1e-6, "{middle:?}, fallen {fallen}");
    // and the shell has the radius of a single one
    let radius = 3.0 / k * (1.0 - (-k * t).exp());
    assert!(rocket.iter().all(|spark| ((spark - middle).norm() - radius).abs() < 1e-6), "a sphere of {radius} m");
}

#[test]
fn the_scout_approaches_its_speed_and_the_swarm_stays_within_its_bound() {
    let mut world = load("flock");
    let scout = world.find("scout").unwrap();
    let swarm: Vec<ObjectId> = world.get::<Flock>(world.find("swarm").unwrap()).unwrap().boids().to_vec();
    assert_eq!(swarm.len(), 150);
    run(&mut world, 2.0);
    let (t, h) = (world.time(), 1.0 / 120.0);
    let x = place(&world, scout) - Vec3::new(-12.0, -6.0, 5.0);
    // a step takes the force of its start: v' = v + h·(6 − v), and the mean of both velocities
    let (mut gone, mut v) = (0.0, 2.0);
    for _ in 0..240 {
        let next = v + h * (6.0 - v);
        (gone, v) = (gone + 0.5 * h * (v + next), next);
    }
    assert!((x - Vec3::new(gone, 0.0, 0.0)).norm() < 1e-9, "{x:?}, not {gone}");
    // which is the exact motion to first order in h
    let exact = 6.0 * t - 4.0 * (1.0 - (-t).exp());
    assert!((gone - exact).abs() < 2.0 * h, "{gone} m, exactly {exact} m");
    // speed: V + F_max/(m·Ks) = 6 + 8/2 = 10 m/s; outside, at most 8 + 2·6 = 20 N push outward against 1 N/m:
    // ½·d² − 20·d ≤ ½·10²  gives d ≤ 20 + √(400 + 100) = 42.4 m, and far less in flight
    while world.time() < 6.0 {
        world.step().unwrap();
        for id in &swarm {
            let state = world.part_state(*id, 0).unwrap();
            assert!((state.position() - Vec3::new(0.0, 0.0, 9.0)).norm() < 8.0 + 42.4);
            assert!(state.velocity.norm() < 10.0 + 20.0, "{:?}", state.velocity);
        }
    }
    let speeds: f64 = swarm.iter().map(|id| world.part_state(*id, 0).unwrap().velocity.norm()).sum();
    assert!((3.0..10.0).contains(&(speeds / 150.0)), "mean speed {}", speeds / 150.0);
}

#[test]
fn defaults_are_those_of_the_crate() {
    let text = "[[cloth]]\nname = \"c\"\n[[jelly]]\nname = \"j\"\n[[particle_system]]\nname = \"p\"\n\
        [[particle_system.emitter]]\n[[flock]]\nname = \"f\"\n[[flock.group]]\n[[body_flock]]\nname = \"b\"\n";
    let scene = SceneFile::parse(text, "s.toml").unwrap();
    let specs = &scene.behaviors;
    assert_eq!(specs.soft[0].grid, Grid::Cloth(Cloth::default()));
    assert_eq!(specs.soft[1].grid, Grid::Jelly(Jelly::default()));
    assert_eq!(specs.particle_systems[0].settings, ParticleSettings::default());
    assert_eq!(specs.particle_systems[0].emitters[0].emitter, Emitter::default());
    assert_eq!(specs.flocks[0].steering, Steering::default());
    assert_eq!((specs.body_flocks[0].steering, specs.body_flocks[0].helm), (Steering::default(), Helm::default()));
    let (world, _) = scene.build().unwrap();
    assert!(["c", "j", "p", "f", "f_boid"].iter().all(|name| world.find(name).is_some()));
}

#[test]
fn pins_are_sides_corners_and_numbers() {
    let text = |pins: &str| format!("[[cloth]]\nname = \"c\"\nnodes = [3, 2]\npins = {pins}\n");
    let pins = |pins: &str| SceneFile::parse(&text(pins), "s.toml").unwrap().behaviors.soft[0].pins.clone();
    assert_eq!(pins("[\"y_max\"]"), [3, 4, 5]);
    assert_eq!(pins("[\"x_min\", 1]"), [0, 1, 3]);
    assert_eq!(pins("[\"corners\"]"), [0, 2, 3, 5]);
    let expected = "expected a list of sides (\"x_min\", \"x_max\", \"y_min\", \"y_max\" or \"corners\") and of numbers of nodes from 0 to 5";
    for bad in ["[6]", "[\"z_min\"]", "[-1]", "[1.5]"] {
        let value = bad.trim_matches(['[', ']']);
        assert_errors(&text(bad), &[&format!("s.toml:4:9: `pins` of cloth \"c\" is {value}; {expected}")]);
    }
}

#[test]
fn fields_act_on_their_targets() {
    let ball = |name: &str, x: f64| {
        format!(
            "[[body]]\nname = \"{name}\"\nshape = {{ type = \"sphere\", radius_m = 0.1 }}\nmass_kg = 2\nposition_m = [{x}, 0, 0]\n"
        )
    };
    let text = format!(
        "[world]\ngravity_m_per_s2 = [0, 0, 0]\n{}{}\
        [[field]]\nname = \"planet\"\ntype = \"attractor\"\nposition_m = [0, 0, -10]\nstrength_m3_per_s2 = 200\ntargets = [\"a\"]\n",
        ball("a", 0.0),
        ball("b", 5.0),
    );
    let mut world = parsed(&text);
    world.step().unwrap();
    let (a, b) = (world.find("a").unwrap(), world.find("b").unwrap());
    let v = |id| world.part_state(id, 0).unwrap().velocity;
    // 200/10² = 2 m/s² for one step
    assert!((v(a) - Vec3::new(0.0, 0.0, -2.0 / 240.0)).norm() < 1e-6, "{:?}", v(a));
    assert_eq!(v(b), Vec3::zeros());
}

#[test]
fn a_body_that_does_not_spin_keeps_its_locked_translations() {
    let text = "[[body]]\nname = \"b\"\nshape = { type = \"sphere\", radius_m = 0.1 }\nmass_kg = 2\n\
        non_spinning = true\nlocked = [\"x\"]\n";
    let world = parsed(text);
    let locked = world.get::<RigidBody>(world.find("b").unwrap()).unwrap().locked;
    assert_eq!((locked.rotation, locked.translation), ([true; 3], [true, false, false]));
}

#[test]
fn errors_name_what_is_wrong() {
    assert_errors(
        "[[field]]\nname = \"f\"\ntype = \"windy\"\n",
        &["s.toml:3:8: `type` of field \"f\" is \"windy\"; did you mean `wind`?"],
    );
    assert_errors(
        "[[particle_system]]\nname = \"p\"\n[[particle_system.emitter]]\nspeed_m_per_s = [2, 1]\n",
        &[
            "s.toml:4:17: `speed_m_per_s` of emitter 1 is [2, 1]; expected one number, or the least and the greatest one, in this order",
        ],
    );
    assert_errors(
        "[[particle_system]]\nname = \"p\"\n[[particle_system.emitter]]\nbody = \"b\"\n[[body]]\nname = \"bb\"\nmode = \"static\"\nshape = { type = \"half_space\" }\n",
        &["s.toml:4:8: `body` of emitter 1 is \"b\"; did you mean `bb`?"],
    );
    assert_errors(
        "[[particle_system]]\nname = \"p\"\nopacity = [0.5, 1.5]\nscale = -1\nend_color = \"reddish\"\n",
        &[
            "s.toml:3:17: `opacity` of particle_system \"p\" is 1.5; expected a number from 0 to 1",
            "s.toml:4:9: `scale` of particle_system \"p\" is -1; expected a number of at least 0",
            "s.toml:5:13: `end_color` of particle_system \"p\" is \"reddish\"; expected a color: \"#rrggbb\", or [r, g, b] with numbers from 0 to 1",
        ],
    );
    assert_errors(
        "[[cloth]]\nname = \"c\"\nnodes = [1, 20]\n[[jelly]]\nname = \"c\"\n",
        &[
            "s.toml:3:10: `nodes` of cloth \"c\" is 1; expected an integer from 2 to 1000",
            "s.toml:4:1: `name`: there is a second object \"c\"; the first is at line 1; expected a unique name",
        ],
    );
    assert_errors(
        "[[flock]]\nname = \"f\"\n[[flock.group]]\ncount = 3\n",
        &[
            "s.toml:3:1: group 1 has no `spread_m`; expected `spread_m` above 0, so that the boids of the group do not start in one place",
        ],
    );
    let floor = "[[body]]\nname = \"floor\"\nmode = \"static\"\nshape = { type = \"half_space\" }\n";
    assert_errors(
        &format!("[[body_flock]]\nname = \"f\"\nup = [0, 0, 0]\nbodies = [\"flor\"]\n{floor}"),
        &[
            "s.toml:3:6: `up` of body_flock \"f\" is [0, 0, 0]; expected a direction",
            "s.toml:4:11: `bodies` of body_flock \"f\" is \"flor\"; did you mean `floor`?",
        ],
    );
    assert_errors(
        &format!("{floor}[[body_flock]]\nname = \"f\"\nbodies = [\"floor\", \"floor\"]\n"),
        &["s.toml:7:20: `bodies` of body_flock \"f\" is \"floor\"; expected each body once"],
    );
    let arm = "[[articulated]]\nname = \"arm\"\n[[articulated.link]]\nname = \"base\"\nmass_kg = 1\n\
        shapes = [{ type = \"sphere\", radius_m = 0.1 }]\njoint = \"revolute\"\naxis = [0, 0, 1]\n";
    assert_errors(
        &format!("{arm}[[body_flock]]\nname = \"f\"\nbodies = [\"arm\"]\n"),
        &["s.toml:11:11: `bodies` of body_flock \"f\" is \"arm\"; expected an articulated body with `floating = true`"],
    );
    assert_errors(
        "[[field]]\nname = \"w\"\ntype = \"wind\"\ndrag_n_s_per_m = 1\ndrag_coefficient = 1\n",
        &[
            "s.toml:1:1: field \"w\" has both `drag_n_s_per_m` and constants of the quadratic law; expected `drag_n_s_per_m`, or `density_kg_per_m3` and `drag_coefficient`",
        ],
    );
}

//! Claims of the pages of the articulated scenes, checked against independent numbers.

use tumble::collide::Vec3;
use tumble::dynamics::articulated::{InverseDynamics, Kinematics, inverse_dynamics};
use tumble::dynamics::{ArticulatedBody, Drive, World};
use tumble::scene::{SceneFile, resolve_scene};

const G: f64 = 9.81;

fn load(name: &str) -> SceneFile {
    resolve_scene(name, &[]).unwrap().load().unwrap()
}

/// The articulated body of that name, its positions and its velocities.
fn body<'w>(world: &'w World, name: &str) -> (&'w ArticulatedBody, &'w [f64], &'w [f64]) {
    let id = world.find(name).unwrap();
    let body: &ArticulatedBody = world.get(id).unwrap();
    let (q, v) = world.state_of(id).unwrap().split_at(body.model().positions());
    (body, q, v)
}

fn height(world: &World, name: &str) -> f64 {
    place(world, name).z
}

fn place(world: &World, name: &str) -> Vec3 {
    world.part_state(world.find(name).unwrap(), 0).unwrap().position()
}

/// The angle by which the joints of a body exceed their limits, rad.
fn past_limits(world: &World, name: &str) -> f64 {
    let (body, q, _) = body(world, name);
    let links = body.model().links().iter().filter(|link| link.joint.dof() == 1);
    links
        .filter_map(|link| body.dofs()[link.v].limits.map(|[lo, hi]| (lo - q[link.q]).max(q[link.q] - hi)))
        .fold(f64::MIN, f64::max)
}

/// Position of a link's joint, world axes.
fn joint(world: &World, name: &str, link: &str) -> Vec3 {
    let (body, q, v) = body(world, name);
    let mut kin = Kinematics::new(body.model());
    kin.refresh(body.model(), q, v);
    kin.links()[body.model().link(link).unwrap()].pose.translation.vector
}

#[test]
fn skeleton_has_the_lengths_and_masses_of_its_page() {
    let world = load("skeleton").build().unwrap().0;
    let (body, ..) = body(&world, "skeleton");
    assert!((body.model().mass() - 75.0).abs() < 1e-3, "{} kg", body.model().mass());
    assert_eq!(body.model().dof(), 33);
    let apart = |a: &str, b: &str| (joint(&world, "skeleton", a) - joint(&world, "skeleton", b)).norm();
    for side in ["left", "right"] {
        let of = |link: &str| format!("{side}_{link}");
        for (from, to, share) in [
            ("thigh", "shank", 0.245),
            ("shank", "foot", 0.246),
            ("upper_arm", "forearm", 0.186),
            ("forearm", "hand", 0.146),
        ] {
            let length = apart(&of(from), &of(to));
            assert!((length - share * 1.75).abs() < 1e-5, "{side} {from}: {length} m");
        }
    }
}

/// It falls from the landing to the floor, within its limits, and never has more energy than
/// before.
#[test]
fn skeleton_falls_down_the_stairs_and_lies_still() {
    let scene = load("skeleton");
    let mut world = scene.build().unwrap().0;
    let start = world.energy();
    let (mut past, mut deepest, mut gain, mut energy) = (f64::MIN, 0.0f64, 0.0f64, start.total());
    for _ in 0..(scene.world.duration_s / scene.world.dt_s).round() as usize {
        deepest = deepest.max(world.step().unwrap().max_penetration);
        past = past.max(past_limits(&world, "skeleton"));
        let now = world.energy().total();
        (gain, energy) = (gain.max(now - energy), now);
    }
    let (end, drop) = (world.energy(), start.potential - world.energy().potential);
    println!(
        "past a limit by {past:.1e} rad, penetration {deepest:.1e} m, gain {gain:.1e} J in a step, drop {drop:.0} J, motion left {:.1e} J",
        end.kinetic
    );
    assert!(past < 1e-6, "past a limit by {past} rad");
    assert!(deepest < 5e-3, "penetration {deepest} m");
    assert!(gain < 1e-6 * start.total(), "energy grows by {gain} J in a step");
    // 75 kg that fall by the height of the stairs alone lose 1457 J
    assert!(drop > 75.0 * G * 11.0 * 0.18, "it lost {drop} J");
    assert!(end.kinetic < 1e-3 * drop, "{} J of motion are left", end.kinetic);
    let head = joint(&world, "skeleton", "head");
    assert!(head.x > 11.0 * 0.28 - 0.5 && head.z < 1.0 && head.y.abs() < 1.0, "the head is at {head}");
}

/// Spun at 20 rad/s about an oblique axis, limits and contacts feed it nothing.
#[test]
fn skeleton_that_tumbles_fast_gains_no_energy() {
    for rate in [60.0, 240.0] {
        let mut scene = load("skeleton");
        scene.world.dt_s = 1.0 / rate;
        let mut world = scene.build().unwrap().0;
        let id = world.find("skeleton").unwrap();
        let mut x = world.state_of(id).unwrap().to_vec();
        let v = body(&world, "skeleton").0.model().positions();
        x[v..v + 3].copy_from_slice(&[12.0, 12.8, 9.6]);
        world.write_state_of(id, &x).unwrap();
        let (start, mut gain, mut past) = (world.energy().total(), 0.0f64, f64::MIN);
        for _ in 0..(2.0 * rate) as usize {
            let before = world.energy().total();
            world.step().unwrap();
            gain = gain.max(world.energy().total() - before);
            past = past.max(past_limits(&world, "skeleton"));
        }
        println!("at {rate} Hz: {start:.0} J, gain {gain:.1e} J in a step, past a limit by {past:.1e} rad");
        assert!(gain < 1e-6 * start, "at {rate} Hz energy grows by {gain} J in a step");
        assert!(past < 1e-6, "at {rate} Hz past a limit by {past} rad");
    }
}

/// The middle of the paddle's lower edge by plane trigonometry, for a tool that points down.
fn paddle(q: &[f64]) -> Vec3 {
    let reach = 0.27 * q[1].sin() + 0.30 * (q[1] + q[2]).cos() + 0.07 * (q[1] + q[2]).sin();
    let wrist = 0.29 + 0.27 * q[1].cos() - 0.30 * (q[1] + q[2]).sin() + 0.07 * (q[1] + q[2]).cos();
    Vec3::new(reach * q[0].cos(), reach * q[0].sin(), wrist - 0.22)
}

#[test]
fn robot_follows_its_recording_within_its_torques_and_moves_the_blocks_as_its_page_says() {
    let scene = load("robot");
    let (h, mut world) = (scene.world.dt_s, scene.build().unwrap().0);
    let efforts = [60.0, 90.0, 50.0, 20.0, 20.0, 10.0];
    let tower: Vec<Vec3> = (1..=4).map(|k| place(&world, &format!("tower_{k}"))).collect();
    let (mut off, mut deepest, mut used, mut past) = (0.0f64, 0.0f64, [0.0f64; 6], f64::MIN);
    for frame in 1..=(12.0 / h).round() as usize {
        let before = body(&world, "arm").2.to_vec();
        deepest = deepest.max(world.step().unwrap().max_penetration);
        past = past.max(past_limits(&world, "arm"));
        let (arm, q, v) = body(&world, "arm");
        for (i, freedom) in arm.dofs().iter().enumerate() {
            let Drive::Playback { motion, limit } = &freedom.drive else { panic!("joint {i} has no recording") };
            assert_eq!(*limit, efforts[i]);
            off = off.max((q[i] - motion.at(world.time()).0).abs());
        }
        let (mut kin, mut work, mut torque) =
            (Kinematics::new(arm.model()), InverseDynamics::new(arm.model()), [0.0; 6]);
        let qdd: Vec<f64> = v.iter().zip(&before).map(|(a, b)| (a - b) / h).collect();
        inverse_dynamics(arm.model(), (&mut kin, &mut work), &Vec3::new(0.0, 0.0, -G), q, v, &qdd, &[], &mut torque);
        for i in 0..6 {
            used[i] = used[i].max((torque[i] + arm.dofs()[i].damping * v[i]).abs() / efforts[i]);
        }
        for (seconds, wanted) in [(3.75, Vec3::new(0.445, -0.33, 0.012)), (9.25, Vec3::new(0.37, 0.064, 0.012))] {
            if frame == (seconds / h).round() as usize {
                assert!((paddle(q) - wanted).norm() < 5e-4, "at {seconds} s the paddle is at {}", paddle(q));
            }
        }
    }
    println!("off by {off:.1e} rad, torques at most {used:.2?} of the efforts, penetration {deepest:.1e} m");
    // the impact of the boxes deflects it for a few frames: the tool's drive has 10 N m/240 Hz =
    // 0.04 N m s per frame against it
    assert!(off < 2e-3, "it is {off} rad off its recording");
    assert!(past <= 0.0, "past a limit by {past} rad");
    assert!(used.iter().all(|share| *share < 0.9), "torques as parts of the efforts: {used:?}");
    assert!(deepest < 1e-4, "penetration {deepest} m");
    for k in 0..3 {
        let at = place(&world, &format!("train_{}", k + 1));
        let wanted = Vec3::new(0.37, 0.10 + 0.06 * k as f64, 0.03);
        assert!((at - wanted).norm() < 1e-3, "train_{} is at {at}, by hand {wanted}", k + 1);
    }
    for (k, from) in tower.iter().enumerate() {
        assert!((place(&world, &format!("tower_{}", k + 1)) - from).norm() < 1e-5, "block {k} of the tower moved");
    }
    let loner = place(&world, "loner");
    assert!((height(&world, "loner") + 0.42).abs() < 1e-4 && loner.x > 0.44, "the loner is at {loner}");
}

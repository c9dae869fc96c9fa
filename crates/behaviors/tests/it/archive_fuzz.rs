//! The fuzz target of archives, run without a fuzzer: on archives of small worlds, and on these with a few changes behind
//! their checksum. `TUMBLE_KEEP_SEEDS=1` writes the archives to `fuzz/seeds/archive`.

use crate::Numbers;
use std::path::Path;
use tumble_behaviors::{
    Attractor, Boid, Buoyancy, Cloth, DragLaw, Emitter, Flock, ParticleSettings, ParticleSystem, SpringMesh, Steering,
    Wind, read_object,
};
use tumble_core::collide::{CompoundPart, Mat3, TreeSettings, TriMesh};
use tumble_core::prelude::*;
use tumble_core::{
    Action, Anchor, ArticulationBuilder, Collider, Drive, Joint, JointRef, LinkBuilder, LinkMass, LoopJoint, Mimic,
    PairMaterial, ScriptedEvent, Sensor, SensorKind, SensorNoise, Template, Trigger,
};

#[allow(unused_attributes)] // of the target
#[path = "../../../../fuzz/fuzz_targets/archive.rs"]
mod target;

fn at(x: f64, y: f64, z: f64) -> Pose {
    Pose::translation(x, y, z)
}

fn ball(name: &str, pose: Pose) -> RigidBody {
    RigidBody::new(Shape::sphere(0.1).unwrap()).with_name(name).with_mass(1.0).with_pose(pose)
}

fn floor() -> World {
    let mut world = World::default();
    world.add_static(RigidBody::fixed(Shape::half_space()).with_name("floor")).unwrap();
    world
}

/// Bodies with all kinds of shapes, a joint and a pair of materials.
fn bodies() -> World {
    let mut world = floor();
    let part = |x: f64| CompoundPart::new(Shape::sphere(0.05).unwrap(), at(x, 0.0, 0.0)).with_name(format!("at {x}"));
    let mesh = Shape::mesh(TriMesh::cuboid(Vec3::repeat(0.2)), &TreeSettings::octree()).unwrap();
    let shapes = [
        Shape::compound(vec![part(0.0), part(0.1)]).unwrap(),
        Shape::cuboid(Vec3::repeat(0.2)).unwrap(),
        Shape::capsule(0.1, 0.2).unwrap(),
        Shape::cylinder(0.1, 0.2).unwrap(),
        mesh,
    ];
    let ids: Vec<ObjectId> = (0..)
        .zip(shapes)
        .map(|(k, shape)| {
            world.add(RigidBody::new(shape).with_mass(1.0).with_pose(at(0.3 * k as f64, 0.0, 0.2))).unwrap()
        })
        .collect();
    let joint = LoopJoint::revolute_at("hinge", &world, Some((ids[0], 0)), Some((ids[1], 0)), Vec3::z(), Vec3::x());
    world.add(joint.unwrap()).unwrap();
    let pair = PairMaterial { friction: Some(0.1), ..PairMaterial::default() };
    world.set_pair_material(ids[2], ids[3], pair).unwrap();
    world
}

/// A leg with a drive, a fixed foot, sensors and a mimic.
fn robot() -> World {
    let mut world = floor();
    let mass = LinkMass { mass: 1.0, center: Vec3::zeros(), inertia: 0.1 * Mat3::identity() };
    let sole = Collider::new(Shape::sphere(0.1).unwrap(), Pose::identity()).with_name("sole");
    let drive = Drive::Position { stiffness: 100.0, damping: 5.0, target: 0.2, velocity: 0.0, limit: 50.0 };
    let hip = LinkBuilder::new("hip", Joint::revolute(Vec3::y())).with_pose(at(0.0, 0.0, 0.6));
    let knee = LinkBuilder::new("knee", Joint::revolute(Vec3::y())).with_parent("hip").with_pose(at(0.0, 0.0, -0.2));
    let foot = LinkBuilder::new("foot", Joint::Fixed).with_parent("knee").with_pose(at(0.0, 0.0, -0.3));
    let leg = ArticulationBuilder::new("leg")
        .link(hip.with_mass_properties(mass).with_drive(drive))
        .link(knee.with_mass_properties(mass).with_limits([-1.0, 1.0]))
        .link(foot.with_mass_properties(mass).with_collider(sole));
    let leg = world.add(leg.build().unwrap()).unwrap();
    let foot = world.get::<tumble_core::ArticulatedBody>(leg).unwrap().anchor(leg, "foot", &Pose::identity()).unwrap();
    let noise = SensorNoise { deviation: 0.1, delay: 2, ..SensorNoise::default() };
    world.add(Sensor::new("felt", SensorKind::Touch, foot).unwrap().with_noise(noise).unwrap()).unwrap();
    world.add(Sensor::new("imu", SensorKind::Accelerometer, foot).unwrap()).unwrap();
    let joints = [1, 0].map(|dof| JointRef::Dof(leg, dof));
    let mimic = Mimic::between("mimic", &world, joints, 0.5, 0.1).unwrap();
    world.add(mimic).unwrap();
    world.add(Sensor::new("scan", SensorKind::RangeFinder, Anchor::world(at(0.0, 0.0, 3.0))).unwrap()).unwrap();
    world
}

/// Events, a template and a sensor volume.
fn scripted() -> World {
    let mut world = floor();
    let gate = RigidBody::fixed(Shape::cuboid(Vec3::repeat(0.5)).unwrap()).with_sensor(true).with_name("gate");
    let gate = world.add_static(gate.with_pose(at(0.0, 0.0, 0.5))).unwrap();
    let first = world.add(ball("first", at(0.0, 0.0, 0.2))).unwrap();
    let store = Template::add(&mut world, "store", &ball("", Pose::identity()), 2, true).unwrap();
    let every = ScriptedEvent::new("drop", Trigger::Every { period: 0.004, first: 0.004 });
    world.add(every.with_action(Action::spawn(store, at(1.0, 1.0, 2.0), Vec3::zeros()))).unwrap();
    let enters = ScriptedEvent::new("enters", Trigger::Enters { sensor: gate, bodies: vec![first] });
    let enters = world.add(enters.with_action(Action::push(first, Vec3::x())).with_times(3)).unwrap();
    world.add(ScriptedEvent::new("then", Trigger::Fired { event: enters }).with_delay(0.1)).unwrap();
    world.add(ScriptedEvent::new("sleeps", Trigger::Asleep { bodies: vec![first] })).unwrap();
    world
}

/// A flock, forces, cloth and particles.
fn behaviors() -> World {
    let mut world = floor();
    let first = world.add(ball("first", at(0.0, 0.0, 1.0))).unwrap();
    let flock = world.add(Flock::new("flock", Steering::default()).unwrap()).unwrap();
    for k in 0..2 {
        let boid = Boid::new(Shape::sphere(0.1).unwrap(), 0.5).unwrap().with_position(Vec3::new(k as f64, 5.0, 4.0));
        Flock::add(&mut world, flock, boid.with_velocity(Vec3::x())).unwrap();
    }
    let cloth = Cloth { nodes: [3, 3], ..Cloth::default() }.mesh().unwrap().with_radius(0.02).unwrap();
    SpringMesh::add(&mut world, cloth.with_name("cloth").with_pose(at(0.0, -3.0, 1.0))).unwrap();
    let law = DragLaw::Quadratic { density: 1.2, coefficient: 0.5 };
    world.add(Wind::new("wind", Vec3::x(), law).unwrap()).unwrap();
    world.add(Attractor::new("planet", Vec3::z(), 3.0, 0.1).unwrap()).unwrap();
    world.add(Buoyancy::new("sea", Vec3::zeros(), 900.0).unwrap()).unwrap();
    let settings = ParticleSettings { capacity: 8, two_way: true, seed: 3, ..ParticleSettings::default() };
    let emitter = Emitter { mount: Some((first, 0)), ..Emitter::stream(Pose::identity(), 200.0) };
    world.add(ParticleSystem::new("sparks", settings).unwrap().with_emitter(emitter).unwrap()).unwrap();
    world
}

/// Archives of the worlds, at the start and a few frames later.
fn seeds() -> Vec<(String, Vec<u8>)> {
    type Maker = fn() -> World;
    let worlds: [(&str, Maker); 4] =
        [("bodies", bodies), ("robot", robot), ("scripted", scripted), ("behaviors", behaviors)];
    let mut seeds = Vec::new();
    for (name, made) in worlds {
        let mut world = made();
        for when in ["start", "later"] {
            seeds.push((format!("{name}_{when}"), world.archive(&[]).unwrap()));
            crate::steps(&mut world, 5);
        }
    }
    seeds
}

/// A random sequence of whole numbers.
struct Random(Numbers);

impl Random {
    fn below(&mut self, count: usize) -> usize {
        ((0.5 * (self.0.number() + 1.0)) * count as f64) as usize % count.max(1)
    }
}

/// Numbers that replace eight bytes.
const NUMBERS: [f64; 10] = [f64::NAN, f64::INFINITY, -f64::INFINITY, 0.0, -0.0, -1.0, 1e300, -1e300, 1e-300, 1e9];

/// Returns a seed with a few changes behind its checksum: bits flipped, bytes set to extreme values, numbers replaced, a
/// piece of another seed inserted, or the end cut off.
fn changed(seeds: &[(String, Vec<u8>)], random: &mut Random) -> Vec<u8> {
    let mut bytes = seeds[random.below(seeds.len())].1.clone();
    for _ in 0..1 + random.below(3) {
        let at = 16 + random.below(bytes.len() - 16);
        match random.below(12) {
            0 => bytes.truncate(at),
            1 => {
                let other = &seeds[random.below(seeds.len())].1;
                let from = random.below(other.len());
                bytes.splice(at..at, other[from..].iter().take(64).copied());
            }
            2..5 => bytes[at] = [0, 1, 0x7f, 0x80, 0xff][random.below(5)],
            5..9 if at + 8 <= bytes.len() => {
                bytes[at..at + 8].copy_from_slice(&NUMBERS[random.below(NUMBERS.len())].to_le_bytes())
            }
            _ => bytes[at] ^= 1 << random.below(8),
        }
        if bytes.len() < 24 {
            break;
        }
    }
    bytes
}

#[test]
fn no_changed_archive_panics_full_length() {
    let seeds = seeds();
    if std::env::var_os("TUMBLE_KEEP_SEEDS").is_some() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/seeds/archive");
        std::fs::create_dir_all(&folder).unwrap();
        seeds.iter().for_each(|(name, bytes)| std::fs::write(folder.join(name), bytes).unwrap());
    }
    // none is skipped for its length
    seeds.iter().for_each(|(name, bytes)| assert!(bytes.len() <= target::MAX_BYTES, "{name}: {}", bytes.len()));
    seeds.iter().for_each(|(_, bytes)| target::target(bytes));
    let slow = std::env::var_os("TUMBLE_SLOW").is_some_and(|value| value == "1");
    let mut random = Random(Numbers(7));
    let mut read = 0;
    for k in 0..if slow { 3_000_000 } else { 100_000 } {
        let bytes = changed(&seeds, &mut random);
        target::target(&bytes);
        if k < 1000 {
            read += u32::from(World::from_archive(&target::sealed(&bytes), &mut read_object).is_ok());
        }
    }
    assert!(read > 100, "only {read} of 1000 changed archives are read");
}

//! Archives of worlds with every behavior.

use tumble_behaviors::{
    Attractor, BodyFlock, Boid, Buoyancy, Cloth, DragLaw, Emitter, Explosion, Flock, Helm, Jelly, Panel, Panels,
    ParticleSettings, ParticleSystem, SpringMesh, Steering, Targets, Wind, read_object,
};
use tumble_collide::{Pose, Shape, Vec3};
use tumble_core::{Action, Appearance, RigidBody, ScriptedEvent, Template, Trigger, World};

fn ball(name: &str, at: Vec3) -> RigidBody {
    RigidBody::new(Shape::sphere(0.2).unwrap())
        .with_name(name)
        .with_mass(1.0)
        .with_pose(Pose::from_parts(at.into(), Default::default()))
}

/// Each behavior, some of which name objects that were added after them.
fn everything() -> World {
    let mut world = World::default();
    world.add(RigidBody::fixed(Shape::HalfSpace)).unwrap();
    let gone = world.add(ball("gone", Vec3::new(9.0, 9.0, 1.0))).unwrap();
    let first = world.add(ball("first", Vec3::new(0.0, 0.0, 1.0))).unwrap();
    let second = world.add(ball("second", Vec3::new(3.0, 0.0, 1.0)).with_gravity_scale(0.0)).unwrap();
    let flock = world.add(Flock::new("flock", Steering { max_force: 7.0, ..Steering::default() }).unwrap()).unwrap();
    for k in 0..5 {
        let boid = Boid::new(Shape::sphere(0.1).unwrap(), 0.5).unwrap().with_bank(0.7, 0.3).unwrap();
        let boid = boid.with_visuals(Boid::dart(0.4, Appearance::default()));
        let (x, v) = (Vec3::new(k as f64, 5.0, 4.0), Vec3::new(1.0, 0.1 * k as f64, 0.0));
        Flock::add(&mut world, flock, boid.with_position(x).with_velocity(v)).unwrap();
    }
    let mut school = BodyFlock::new("school", Steering::default(), Helm { agility: 3.0, ..Helm::default() }).unwrap();
    school.push(second);
    world.add(school).unwrap();
    let cloth =
        Cloth { nodes: [6, 5], ..Cloth::default() }.mesh().unwrap().with_radius(0.02).unwrap().with_name("cloth");
    let cloth = cloth.with_pins(|x| x.y > 0.4).with_pose(Pose::translation(0.0, -3.0, 1.0));
    let cloth = SpringMesh::add(&mut world, cloth).unwrap();
    let jelly = Jelly { nodes: [3, 3, 3], ..Jelly::default() }.mesh().unwrap().with_radius(0.05).unwrap();
    SpringMesh::add(&mut world, jelly.with_name("jelly").with_pose(Pose::translation(5.0, 5.0, 1.0))).unwrap();
    let only = || Targets::Only(vec![first, gone, cloth]);
    let law = DragLaw::Quadratic { density: 1.2, coefficient: 0.5 };
    world.add(Wind::new("wind", Vec3::new(2.0, 1.0, 0.0), law).unwrap().with_targets(only())).unwrap();
    world.add(Attractor::new("planet", Vec3::new(0.0, 0.0, 9.0), 3.0, 0.1).unwrap()).unwrap();
    world.add(Explosion::new("bang", Vec3::new(1.0, 0.0, 0.5), 2.0, 0.1, 0.05).unwrap()).unwrap();
    world
        .add(Buoyancy::new("sea", Vec3::new(0.0, 0.0, 0.3), 900.0).unwrap().with_drag(1.0, Vec3::x()).unwrap())
        .unwrap();
    let panel =
        Panel { id: first, part: 0, point: Vec3::x(), normal: Vec3::z(), area: 0.2, lift_slope: 6.0, drag: 0.1 };
    world.add(Panels::new("wing", 1.2, Vec3::y(), [panel]).unwrap()).unwrap();
    let settings = ParticleSettings { capacity: 400, two_way: true, seed: 3, ..ParticleSettings::default() };
    let system = ParticleSystem::new("sparks", settings).unwrap();
    let stream = Emitter {
        mount: Some((first, 0)),
        speed: [1.0, 3.0],
        ..Emitter::stream(Pose::translation(0.0, 0.0, 0.3), 200.0)
    };
    world.add(system.with_emitter(Emitter::burst(Vec3::z(), 50, 0.0)).unwrap().with_emitter(stream).unwrap()).unwrap();
    let store = Template::add(&mut world, "store", &ball("", Vec3::zeros()), 3, true).unwrap();
    let event = ScriptedEvent::new("drop", Trigger::Every { period: 0.1, first: 0.1 });
    world.add(event.with_action(Action::spawn(store, Pose::translation(1.0, 1.0, 2.0), Vec3::zeros()))).unwrap();
    world.remove(gone).unwrap();
    world
}

#[test]
fn archives_of_all_behaviors_go_on_with_the_same_bits() {
    let mut world = everything();
    for _ in 0..40 {
        world.step().unwrap();
    }
    let bytes = world.archive(&[]).unwrap();
    let mut copy = World::from_archive(&bytes, &mut read_object).unwrap();
    assert!(copy.archive(&[]).unwrap() == bytes, "the archive of the copy is another");
    for _ in 0..60 {
        world.step().unwrap();
        copy.step().unwrap();
    }
    for (ours, theirs) in world.ids().iter().zip(copy.ids()) {
        assert_eq!(world.state_of(*ours), copy.state_of(*theirs), "{}", world.name(*ours).unwrap());
    }
    assert!(world.save() == copy.save());
    let flock = copy.find("flock").unwrap();
    assert_eq!(copy.get::<Flock>(flock).unwrap().boids().len(), 5);
    assert!(copy.get::<Flock>(flock).unwrap().boids().iter().all(|id| copy.get::<Boid>(*id).is_some()));
}

#[test]
fn an_archive_of_behaviors_needs_their_reader() {
    let bytes = everything().archive(&[]).unwrap();
    let refused = World::from_archive(&bytes, &mut |_| None).map(drop).unwrap_err();
    assert!(refused.to_string().contains("'flock'"), "{refused}");
}

//! Cloth, jelly, particles and boids look the same on a server and on a facet that gets its messages.

use tumble::behaviors::{
    Boid, Cloth, Emitter, Flock, ParticleLook, ParticleSettings, ParticleSystem, SpringMesh, Steering,
};
use tumble::collide::{Pose, Vec3};
use tumble::dynamics::World;
use tumble::net::sync::{Mirror, Publisher, Viewer};
use tumble::render::{DebugDraw, DrawList, Drawing};
use tumble::scene::{SceneFile, resolve_scene};

fn load(name: &str) -> SceneFile {
    resolve_scene(name, &[]).unwrap().load().unwrap()
}

fn list(scene: &SceneFile, world: &World) -> DrawList {
    Drawing::new(scene).list(world, &DebugDraw::default()).unwrap()
}

/// Returns all vertices of all instances, and all spheres, in the order of the list.
fn points(list: &DrawList) -> Vec<[f32; 3]> {
    let placed = list.instances.iter().flat_map(|instance| {
        let mesh = &list.meshes[instance.mesh.0].positions;
        mesh.iter().map(|p| instance.pose.transform_point(&(*p).into()).coords.into())
    });
    placed.chain(all_spheres(list).map(|[x, y, z, _]| [x, y, z])).collect()
}

/// Center and radius of all spheres, then of those of all clouds, then of the transparent ones.
fn all_spheres(list: &DrawList) -> impl Iterator<Item = [f32; 4]> + '_ {
    let clouds = list.clouds.iter().flat_map(|cloud| &cloud.spheres).copied();
    let spheres = list.spheres.iter().map(|sphere| (sphere.center, sphere.radius)).chain(clouds);
    let spheres = spheres.chain(list.soft_spheres.iter().map(|sphere| (sphere.center, sphere.radius)));
    spheres.map(|(center, radius)| [center.x, center.y, center.z, radius])
}

fn assert_alike(ours: &DrawList, theirs: &DrawList, what: &str) {
    let (ours, theirs) = (points(ours), points(theirs));
    assert_eq!(ours.len(), theirs.len(), "{what}");
    for (a, b) in ours.iter().zip(&theirs) {
        let far = (0..3).map(|k| (a[k] - b[k]).abs()).fold(0.0, f32::max);
        assert!(far < 3e-4, "{what}: {a:?} and {b:?}"); // half-spaces are wide, and rotations have 5e-6 rad
    }
}

/// Compares opacities, colors and light of all transparent spheres, and colors of particles.
fn assert_looks_alike(ours: &DrawList, theirs: &DrawList, most: f32) {
    for (a, b) in ours.soft_spheres.iter().zip(&theirs.soft_spheres) {
        assert!((a.opacity - b.opacity).abs() < most && a.shader == b.shader, "{a:?} and {b:?}");
        assert!((0..3).all(|k| (a.color[k] - b.color[k]).abs() < most), "{a:?} and {b:?}");
    }
    for (a, b) in ours.clouds.iter().zip(&theirs.clouds) {
        assert_eq!(a.colors.len(), b.colors.len());
        let apart =
            a.colors.iter().zip(&b.colors).map(|(a, b)| (0..3).map(|k| (a[k] - b[k]).abs()).fold(0.0, f32::max));
        assert!(apart.fold(0.0, f32::max) < most);
    }
}

/// Without the scene's description colors and opacities have a byte each.
#[test]
fn smoke_and_cooling_sparks_that_the_scene_does_not_have_look_the_same() {
    let scene = load("falling");
    let (mut world, base) = (scene.build().unwrap().0, scene.build_drawn().unwrap().0);
    let (mut publisher, mut mirror) = (Publisher::new(&world, false, 0), Mirror::new(base));
    let usual = ParticleLook::default();
    for (name, look) in [
        ("smoke", ParticleLook { opacity: Some([0.7, 0.1]), scale: [1.0, 4.0], ..usual.clone() }),
        ("flames", ParticleLook { opacity: Some([0.5, 0.0]), end_color: Some([0.8, 0.1, 0.0]), ..usual.clone() }),
        ("sparks", ParticleLook { end_color: Some([0.3, 0.0, 0.0]), ..usual }),
    ] {
        let source = Emitter { lifetime: [1.0, 2.0], ..Emitter::burst(Vec3::new(0.0, 0.0, 9.0), 60, 0.0) };
        let system = ParticleSystem::new(name, ParticleSettings::default()).unwrap().with_emitter(source).unwrap();
        world.add(system.with_look(look).unwrap()).unwrap();
    }
    (0..30).for_each(|_| {
        world.step().unwrap();
    });
    let published = publisher.publish(&world, &Viewer::default(), 1).unwrap();
    mirror.apply_snapshot(&publisher.snapshot()).unwrap();
    mirror.apply_state(1, world.time(), &published.state).unwrap();
    assert_eq!(mirror.hash(), published.hash);
    let (ours, theirs) = (list(&scene, &world), list(&scene, mirror.world()));
    assert_eq!((ours.soft_spheres.len(), ours.clouds.len()), (120, 1));
    assert_alike(&ours, &theirs, "late");
    assert_looks_alike(&ours, &theirs, 0.51 / 255.0);
    assert_eq!(ours.clouds[0].colors.len(), 60);
}

#[test]
fn a_facet_shows_what_the_server_has() {
    for name in ["cloth", "jelly", "sparks", "flock", "campfire"] {
        let scene = load(name);
        let (mut world, base) = (scene.build().unwrap().0, scene.build_drawn().unwrap().0);
        let (mut publisher, mut mirror) = (Publisher::new(&world, false, 0), Mirror::new(base));
        for frame in 1..=4 {
            for _ in 0..if name == "sparks" { 40 } else { 8 } {
                world.step().unwrap();
            }
            let published = publisher.publish(&world, &Viewer::default(), frame).unwrap();
            if published.fresh {
                mirror.apply_snapshot(&publisher.snapshot()).unwrap();
            }
            mirror.apply_state(frame, world.time(), &published.state).unwrap();
            assert_eq!(mirror.hash(), published.hash, "{name}");
            let ours = list(&scene, &world);
            assert!(ours.instances.len() + ours.sphere_count() > 1);
            let theirs = list(&scene, mirror.world());
            assert_alike(&ours, &theirs, name);
            assert_looks_alike(&ours, &theirs, 1e-5);
            assert_eq!(ours.soft_spheres.len() > 40, name == "campfire");
        }
        if name == "sparks" {
            let sparks = list(&scene, mirror.world()).sphere_count();
            assert!(sparks > 1000 + 500, "{sparks} particles are drawn");
        }
    }
}

#[test]
fn a_cloth_that_the_scene_does_not_have_is_shown_too() {
    let scene = load("falling");
    let (mut world, base) = (scene.build().unwrap().0, scene.build_drawn().unwrap().0);
    let (mut publisher, mut mirror) = (Publisher::new(&world, false, 0), Mirror::new(base));
    let before = list(&scene, &world).instances.len();
    let cloth = Cloth { nodes: [6, 5], ..Cloth::default() }.mesh().unwrap();
    SpringMesh::add(&mut world, cloth.with_name("late").with_pose(Pose::translation(0.0, 0.0, 9.0))).unwrap();
    for _ in 0..10 {
        world.step().unwrap();
    }
    let published = publisher.publish(&world, &Viewer::default(), 1).unwrap();
    mirror.apply_snapshot(&publisher.snapshot()).unwrap();
    mirror.apply_state(1, world.time(), &published.state).unwrap();
    assert_eq!(mirror.hash(), published.hash);
    let ours = list(&scene, &world);
    assert_eq!(ours.instances.len(), before + 1);
    assert_alike(&ours, &list(&scene, mirror.world()), "late");
}

#[test]
fn a_surface_is_lit_from_the_side_that_it_turns_to_the_light() {
    let scene =
        SceneFile::parse("[[cloth]]\nname = \"c\"\nnodes = [4, 3]\nrotation_deg = [0, 90, 0]\n", "s.toml").unwrap();
    let (world, _) = scene.build().unwrap();
    let list = list(&scene, &world);
    let mesh = &list.meshes[list.instances[0].mesh.0];
    assert_eq!((mesh.positions.len(), mesh.indices.len()), (12, 3 * 2 * 3 * 2));
    assert!(mesh.normals.iter().all(|n| (Vec3::new(n[0].into(), n[1].into(), n[2].into()) - Vec3::x()).norm() < 1e-6));
}

#[test]
fn saved_particles_and_cloth_look_as_before() {
    for name in ["cloth", "sparks", "campfire"] {
        let scene = load(name);
        let (mut world, mut copy) = (scene.build().unwrap().0, scene.build().unwrap().0);
        (0..30).for_each(|_| {
            world.step().unwrap();
        });
        copy.restore(&world.save()).unwrap();
        assert_eq!(points(&list(&scene, &world)), points(&list(&scene, &copy)), "{name}");
    }
}

/// Spheres that are drawn of a world.
fn spheres(scene: &SceneFile, world: &World) -> Vec<[f32; 4]> {
    let mut spheres: Vec<[f32; 4]> = all_spheres(&list(scene, world)).collect();
    spheres.sort_by(|a, b| a.partial_cmp(b).unwrap());
    spheres
}

#[test]
fn particles_and_a_flock_that_the_scene_does_not_have_are_shown_too() {
    let scene = load("falling");
    for exact in [false, true] {
        let (mut world, base) = (scene.build().unwrap().0, scene.build_drawn().unwrap().0);
        let (mut publisher, mut mirror) = (Publisher::new(&world, exact, 0), Mirror::new(base));
        let before = spheres(&scene, &world).len();
        let mut send = |world: &World, frame: u64| {
            let published = publisher.publish(world, &Viewer::default(), frame).unwrap();
            if published.fresh {
                mirror.apply_snapshot(&publisher.snapshot()).unwrap();
            }
            mirror.apply_state(frame, world.time(), &published.state).unwrap();
            assert_eq!(mirror.hash(), published.hash, "frame {frame}");
            (spheres(&scene, world), spheres(&scene, mirror.world()), published.fresh)
        };
        send(&world, 1);
        let burst = Emitter { lifetime: [0.05, 0.4], ..Emitter::burst(Vec3::new(0.0, 0.0, 3.0), 700, 0.0) };
        let system = ParticleSystem::new("late", ParticleSettings::default()).unwrap().with_emitter(burst).unwrap();
        let system = world.add(system).unwrap();
        let flock = world.add(Flock::new("flock", Steering::default()).unwrap()).unwrap();
        for k in 0..5 {
            let boid = Boid::new(tumble::collide::Shape::sphere(0.2).unwrap(), 1.0).unwrap();
            let boid = boid.with_name(format!("boid {k}")).with_position(Vec3::new(f64::from(k), 0.0, 8.0));
            Flock::add(&mut world, flock, boid).unwrap();
        }
        let mut alive = Vec::new();
        for frame in 2..=40 {
            world.step().unwrap();
            if frame == 20 {
                world.set_enabled(system, false).unwrap();
            }
            if frame == 22 {
                world.set_enabled(system, true).unwrap();
            }
            let (ours, theirs, fresh) = send(&world, frame);
            assert_eq!(fresh, frame == 2, "a table for each new particle");
            assert_eq!(ours.len(), theirs.len(), "frame {frame}");
            for (a, b) in ours.iter().zip(&theirs) {
                assert!((0..4).all(|k| (a[k] - b[k]).abs() < 3e-4), "{a:?} and {b:?}");
            }
            alive.push(ours.len() - before);
        }
        // they die one by one, and none is seen in the two frames in which the system is off
        let (before_off, off, after_off) = (alive[17], &alive[18..20], alive[20]);
        assert!(alive[0] == 700 && before_off > 600 && off == [0, 0] && after_off > 600, "{alive:?}");
        assert!(alive[38] < 600, "{alive:?}");
        world.remove(system).unwrap();
        let (ours, theirs, fresh) = send(&world, 41);
        assert!(fresh && ours.len() == theirs.len());
        for k in 0..5 {
            let place = |world: &World| {
                let id = world.find(&format!("boid {k}")).unwrap();
                world.part_state(id, 0).unwrap().position()
            };
            assert!((place(&world) - place(mirror.world())).norm() < 1e-4, "boid {k}");
        }
    }
}

#[test]
fn a_recording_has_particles_that_were_added_late() {
    let scene = load("falling");
    let mut world = scene.build().unwrap().0;
    assert!(tumble::net::world::deforming(&world).points.is_empty());
    let burst = Emitter::burst(Vec3::new(0.0, 0.0, 3.0), 300, 0.0);
    let system = ParticleSystem::new("late", ParticleSettings::default()).unwrap().with_emitter(burst).unwrap();
    world.add(system).unwrap();
    world.step().unwrap();
    assert_eq!(tumble::net::world::deforming(&world).points.len(), 300);
}

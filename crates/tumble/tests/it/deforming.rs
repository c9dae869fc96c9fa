//! Cloth, jelly, particles and boids look the same on a server and on a facet that gets its messages.

use tumble::behaviors::{Cloth, SpringMesh};
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
    placed.chain(list.spheres.iter().map(|sphere| sphere.center.coords.into())).collect()
}

fn assert_alike(ours: &DrawList, theirs: &DrawList, what: &str) {
    let (ours, theirs) = (points(ours), points(theirs));
    assert_eq!(ours.len(), theirs.len(), "{what}");
    for (a, b) in ours.iter().zip(&theirs) {
        let far = (0..3).map(|k| (a[k] - b[k]).abs()).fold(0.0, f32::max);
        assert!(far < 3e-4, "{what}: {a:?} and {b:?}"); // half-spaces are wide, and rotations have 5e-6 rad
    }
}

#[test]
fn a_facet_shows_what_the_server_has() {
    for name in ["cloth", "jelly", "sparks", "flock"] {
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
            assert!(ours.instances.len() + ours.spheres.len() > 1);
            assert_alike(&ours, &list(&scene, mirror.world()), name);
        }
        if name == "sparks" {
            let sparks = list(&scene, mirror.world()).spheres.len();
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
    for name in ["cloth", "sparks"] {
        let scene = load(name);
        let (mut world, mut copy) = (scene.build().unwrap().0, scene.build().unwrap().0);
        (0..30).for_each(|_| {
            world.step().unwrap();
        });
        copy.restore(&world.save()).unwrap();
        assert_eq!(points(&list(&scene, &world)), points(&list(&scene, &copy)), "{name}");
    }
}

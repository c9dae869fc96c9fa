//! A world and its copy look the same after objects are added, removed, disabled or moved.

use super::simulated_session::{scene, viewer};
use std::sync::Arc;
use tumble_core::collide::{CompoundPart, TriMesh};
use tumble_core::collide::{Pose, Quat, Shape, Vec3};
use tumble_core::{Appearance, ContactPoint, Drawn, Mode, Object, RigidBody, Visual, VisualMesh, World};
use tumble_net::sync::quantize::{POSITION_ERROR_M, ROTATION_ERROR_RAD};
use tumble_net::sync::wire::MessageError;
use tumble_net::sync::{Mirror, Publisher, VIEWER_NAME};

/// The worlds of a server and of a client, with the publisher and the mirror between them.
struct Pair {
    world: World,
    publisher: Publisher,
    mirror: Mirror,
    frame: u64,
}

impl Pair {
    fn new(exact: bool) -> Pair {
        let world = scene();
        Pair { publisher: Publisher::new(&world, exact, u32::MAX - 2), world, mirror: Mirror::new(scene()), frame: 0 }
    }

    /// Sends a frame. Returns whether the list of objects was new.
    fn send(&mut self) -> bool {
        self.frame += 1;
        let published = self.publisher.publish(&self.world, &viewer(self.frame), self.frame).unwrap();
        if published.fresh {
            self.mirror.apply_snapshot(&self.publisher.snapshot()).unwrap();
        }
        self.mirror.apply_state(self.frame, self.world.time(), &published.state).unwrap();
        assert_eq!(self.mirror.hash(), published.hash);
        assert_eq!((self.mirror.world().time(), self.mirror.frame()), (self.world.time(), self.frame));
        assert_eq!(self.mirror.viewer(), &viewer(self.frame));
        self.compare();
        published.fresh
    }

    /// Compares the worlds object by object, by name: existence, whether enabled, and pose.
    fn compare(&self) {
        let names = |w: &World| {
            let mut names: Vec<String> = w.ids().iter().map(|&id| w.name(id).unwrap().to_string()).collect();
            names.sort();
            names
        };
        assert_eq!(names(&self.world), names(self.mirror.world()));
        for name in names(&self.world) {
            let (here, there) = (self.mirror.world(), &self.world);
            let (a, b) = (here.find(&name).unwrap(), there.find(&name).unwrap());
            assert_eq!(here.status(a).unwrap().enabled, there.status(b).unwrap().enabled, "{name}");
            if there.status(b).unwrap().enabled {
                let (a, b) = (here.part_state(a, 0).unwrap().pose, there.part_state(b, 0).unwrap().pose);
                assert!((a.translation.vector - b.translation.vector).amax() <= POSITION_ERROR_M, "{name}");
                assert!(a.rotation.angle_to(&b.rotation) <= ROTATION_ERROR_RAD + 3e-8, "{name}"); // an arc cosine loses 2e-8 near 0
            }
        }
    }
}

#[test]
fn a_copy_follows_frame_by_frame() {
    for exact in [false, true] {
        let mut pair = Pair::new(exact);
        assert!(pair.send(), "the first frame brings the list");
        for _ in 0..100 {
            pair.world.step().unwrap();
            assert!(!pair.send());
        }
    }
}

/// Names of 200 and 70,000 bytes, of objects in the scene file and of objects added later, with
/// characters of several bytes.
#[test]
fn names_of_any_length_are_sent_whole() {
    let scene = || {
        let mut world = scene();
        for name in ["é".repeat(100), "x".repeat(199) + "1", "x".repeat(199) + "2", "y".repeat(70_000)] {
            let body = RigidBody::new(Shape::sphere(0.1).unwrap()).with_name(name).with_mass(1.0);
            world.add(body.with_pose(Pose::translation(0.0, 0.0, 40.0))).unwrap();
        }
        world
    };
    for exact in [false, true] {
        let publisher = Publisher::new(&scene(), exact, 0);
        let mut pair = Pair { world: scene(), publisher, mirror: Mirror::new(scene()), frame: 0 };
        assert!(pair.send());
        for name in ["ü".repeat(100), String::new()] {
            let body = RigidBody::new(Shape::sphere(0.1).unwrap()).with_name(name).with_mass(1.0);
            pair.world.add(body.with_pose(Pose::translation(1.0, 0.0, 40.0))).unwrap();
            pair.world.step().unwrap();
            assert!(pair.send());
        }
        let removed = pair.world.find(&"é".repeat(100)).unwrap();
        pair.world.remove(removed).unwrap();
        assert!(pair.send());
    }
}

/// A replica has the exact bits of the state.
#[test]
fn a_replica_is_exact() {
    let mut pair = Pair::new(true);
    for _ in 0..100 {
        pair.world.step().unwrap();
        pair.send();
    }
    assert_eq!(pair.mirror.world().state(), pair.world.state());
    // in free flight the replica also steps to the same bits; only the memory of contacts is
    // missing
    let ball = pair.world.find("ball 4").unwrap();
    pair.world.set_pose(ball, Pose::translation(0.0, 0.0, 50.0)).unwrap();
    pair.send();
    let mut copy = pair.mirror.world().fork();
    copy.step().unwrap();
    pair.world.step().unwrap();
    let (a, b) = (copy.find("ball 4").unwrap(), ball);
    assert_eq!(copy.state_of(a), pair.world.state_of(b));
}

#[test]
fn objects_come_and_go() {
    let mut pair = Pair::new(false);
    pair.send();
    let appearance = Appearance {
        color: [0.1, 0.2, 0.3],
        shader: "checker".into(),
        properties: vec![("squares".into(), 8.0)],
        ..Appearance::default()
    };
    let spun = Pose::from_parts(Vec3::new(1.0, 2.0, 3.0).into(), Quat::from_scaled_axis(Vec3::new(0.3, -0.2, 0.9)));
    for (k, shape) in [
        Shape::sphere(0.2),
        Shape::cuboid(Vec3::new(0.2, 0.4, 0.6)),
        Shape::capsule(0.1, 0.4),
        Shape::cylinder(0.1, 0.6),
    ]
    .into_iter()
    .enumerate()
    {
        let visual = Visual::shape(0, spun, shape.clone().unwrap(), appearance.clone());
        let body = RigidBody::new(shape.unwrap()).with_name(format!("new {k}")).with_mass(1.0);
        pair.world.add(body.with_pose(spun).with_visuals(vec![visual])).unwrap();
        assert!(pair.send(), "an object more");
        pair.world.step().unwrap();
        assert!(!pair.send());
        let here = pair.mirror.world();
        let (a, b) = (here.find(&format!("new {k}")).unwrap(), pair.world.find(&format!("new {k}")).unwrap());
        let visuals = |w: &World, id| format!("{:?}", w.object(id).unwrap().renderable().unwrap().visuals());
        assert_eq!(visuals(here, a), visuals(&pair.world, b), "it looks the same");
    }
    let part = |x: f64| CompoundPart::new(Shape::sphere(0.1).unwrap(), Pose::translation(x, 0.0, 0.0));
    let bell = Shape::compound(vec![part(0.0), part(0.4)]).unwrap();
    let Shape::Compound(parts) = &bell else { panic!("a compound") };
    let surface = parts.mesh();
    pair.world.add(RigidBody::new(bell).with_name("bell")).unwrap();
    assert!(pair.send(), "a compound more");
    let copy = pair.mirror.world();
    let visual = &copy.object(copy.find("bell").unwrap()).unwrap().renderable().unwrap().visuals()[0];
    let Some(Drawn::Mesh(mesh)) = visual.drawn() else { panic!("triangles") };
    assert_eq!(mesh.triangles, surface.triangles);
    for name in ["new 1", "ball 2", "post"] {
        let id = pair.world.find(name).unwrap();
        pair.world.remove(id).unwrap();
        assert!(pair.send(), "{name} is gone");
    }
    // another object with a former name
    pair.world.add(RigidBody::new(Shape::sphere(0.5).unwrap()).with_name("ball 2").with_mass(1.0)).unwrap();
    assert!(pair.send());
    let ball = pair.mirror.world().find("ball 2").unwrap();
    let radius = |o: &dyn Object| {
        let visual = &o.renderable().unwrap().visuals()[0];
        if let Some(Drawn::Shape(Shape::Sphere { radius })) = visual.drawn() { *radius } else { 0.0 }
    };
    assert_eq!(radius(pair.mirror.world().object(ball).unwrap()), 0.5);
}

#[test]
fn what_is_switched_off_or_moved_by_hand_is_seen_so() {
    let mut pair = Pair::new(false);
    pair.send();
    let [ball, post] = ["ball 1", "post"].map(|name| pair.world.find(name).unwrap());
    pair.world.set_enabled(ball, false).unwrap();
    assert!(!pair.send(), "what moves may die without a new list");
    pair.world.set_enabled(ball, true).unwrap();
    pair.send();
    pair.world.set_pose(post, Pose::translation(-3.0, 0.0, 1.0)).unwrap();
    assert!(pair.send(), "what is still has moved");
    pair.world.set_enabled(post, false).unwrap();
    assert!(pair.send());
    pair.world.set_mode(ball, Mode::Static).unwrap();
    assert!(pair.send());
}

#[test]
fn a_mesh_of_the_scene_is_not_sent_again() {
    use tumble_core::collide::TreeSettings;
    let tetrahedron = TriMesh {
        vertices: [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(Vec3::from).to_vec(),
        triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
    };
    let shape = Shape::mesh(tetrahedron, &TreeSettings::octree()).unwrap();
    let body = |name: &str, shape: &Shape| RigidBody::new(shape.clone()).with_name(name).with_mass(1.0);
    let build = || {
        let mut world = scene();
        world.add(body("rock", &shape)).unwrap();
        world
    };
    let mut world = build();
    let (mut publisher, mut mirror) = (Publisher::new(&world, false, 0), Mirror::new(build()));
    publisher.publish(&world, &viewer(0), 0).unwrap();
    let before = publisher.snapshot().len();
    world.add(body("second rock", &shape)).unwrap();
    let published = publisher.publish(&world, &viewer(0), 1).unwrap();
    assert!(publisher.snapshot().len() - before < 300, "{} bytes more", publisher.snapshot().len() - before);
    mirror.apply_snapshot(&publisher.snapshot()).unwrap();
    mirror.apply_state(1, 0.0, &published.state).unwrap();
    assert_eq!(mirror.hash(), published.hash);
    // a mesh that is not in the scene is sent whole
    let mut other = tumble_core::collide::TriMesh { vertices: vec![], triangles: vec![] };
    if let Shape::Mesh(mesh) = &shape {
        other = mesh.mesh().clone();
        other.vertices.iter_mut().for_each(|v| *v *= 2.0);
    }
    let other = Shape::mesh(other, &TreeSettings::octree()).unwrap();
    world.add(body("boulder", &other)).unwrap();
    publisher.publish(&world, &viewer(0), 2).unwrap();
    mirror.apply_snapshot(&publisher.snapshot()).unwrap();
    let boulder = mirror.world().object(mirror.world().find("boulder").unwrap()).unwrap();
    let Some(Drawn::Mesh(mesh)) = boulder.renderable().unwrap().visuals()[0].drawn() else { panic!("a mesh") };
    assert_eq!(mesh.triangles.len(), 4);
    assert!((mesh.diagonal() - 12.0f64.sqrt()).abs() < 1e-12, "{}", mesh.diagonal());
    // an open mesh, which is only drawn
    let sheet = TriMesh { vertices: [Vec3::zeros(), Vec3::x(), Vec3::y()].to_vec(), triangles: vec![[0, 1, 2]] };
    let open = Arc::new(VisualMesh::new("sheet", sheet.clone()).unwrap());
    let drawn =
        [0.0, 1.0].map(|z| Visual::mesh(0, Pose::translation(0.0, 0.0, z), open.clone(), Appearance::default()));
    let lost = Visual::mesh(
        0,
        Pose::identity(),
        Arc::new(VisualMesh::read_by("lost", || Err("gone".into()))),
        Appearance::default(),
    );
    world.add(body("tent", &shape).with_visuals(drawn.into_iter().chain([lost]).collect())).unwrap();
    publisher.publish(&world, &viewer(0), 3).unwrap();
    mirror.apply_snapshot(&publisher.snapshot()).unwrap();
    let tent = mirror.world().object(mirror.world().find("tent").unwrap()).unwrap();
    let seen: Vec<_> = tent.renderable().unwrap().visuals().iter().map(Visual::drawn).collect();
    assert_eq!(seen.len(), 2, "what cannot be read is not sent");
    assert!(seen.iter().all(|drawn| matches!(drawn, Some(Drawn::Mesh(mesh)) if ***mesh == sheet)));
}

#[test]
fn what_cannot_be_sent_is_said() {
    let mut pair = Pair::new(false);
    pair.world.add(RigidBody::new(Shape::sphere(1.0).unwrap()).with_name(VIEWER_NAME).with_mass(1.0)).unwrap();
    let error = pair.publisher.publish(&pair.world, &viewer(0), 0).unwrap_err();
    assert!(error.to_string().contains("SidData"), "{error}");
    let id = pair.world.find(VIEWER_NAME).unwrap();
    pair.world.remove(id).unwrap();
    assert!(pair.send(), "and all is well again");
}

/// A list of another scene is refused with the name of a missing object, and the copy stays as it
/// was.
#[test]
fn a_list_that_does_not_fit_changes_nothing() {
    let mut pair = Pair::new(false);
    pair.send();
    let mut smaller = scene();
    let ball = smaller.find("ball 3").unwrap();
    smaller.remove(ball).unwrap();
    let mut mirror = Mirror::new(smaller);
    let fault = mirror.apply_snapshot(&pair.publisher.snapshot()).unwrap_err();
    assert!(matches!(&fault, MessageError::Unfit(why) if why.contains("'ball 3'")), "{fault}");
    assert_eq!(mirror.revision(), None);
}

/// The hash is computed from the world that is shown, not from the message, so it detects a change
/// in between.
#[test]
fn the_hash_is_read_from_the_world() {
    let mut pair = Pair::new(false);
    pair.send();
    let hash = pair.mirror.hash();
    pair.world.step().unwrap();
    pair.frame -= 1; // the same number and another world
    let published = pair.publisher.publish(&pair.world, &viewer(1), 1).unwrap();
    pair.mirror.apply_state(1, 0.0, &published.state).unwrap();
    assert_ne!(pair.mirror.hash(), hash);
    assert_ne!(pair.mirror.hash(), published.hash, "the time differs: 0 here, a step there");
}

/// A visible change of one bit changes the hash of the scene; an invisible one does not.
#[test]
fn the_hash_of_a_scene_sees_what_can_be_seen() {
    use tumble_net::sync::scene_hash;
    let hash = |change: &dyn Fn(&mut World)| {
        let mut world = scene();
        change(&mut world);
        scene_hash("text", &world)
    };
    let same = hash(&|_| {});
    assert_eq!(same, scene_hash("text", &scene()));
    assert_ne!(same, scene_hash("text ", &scene()));
    let find = |w: &World, name: &str| w.find(name).unwrap();
    let up = |w: &mut World| w.set_pose(find(w, "ball 0"), Pose::translation(0.0, 0.0, 1.0 + f64::EPSILON)).unwrap();
    let gone = |w: &mut World| drop(w.remove(find(w, "post")).unwrap());
    let dead = |w: &mut World| w.set_enabled(find(w, "post"), false).unwrap();
    let wider = |w: &mut World| {
        let id = find(w, "ball 4");
        w.remove(id).unwrap();
        let pose = Pose::translation(1.2, 0.0, 1.8);
        w.add(RigidBody::new(Shape::sphere(0.1000001).unwrap()).with_name("ball 4").with_mass(1.0).with_pose(pose))
            .unwrap();
    };
    let changes: [&dyn Fn(&mut World); 4] = [&up, &gone, &dead, &wider];
    let hashes: Vec<_> = changes.iter().map(|change| hash(*change)).collect();
    assert!(hashes.iter().all(|h| *h != same) && (0..4).all(|k| !hashes[..k].contains(&hashes[k])));
    let faster = |w: &mut World| w.set_velocity(find(w, "ball 0"), Vec3::x(), Vec3::zeros()).unwrap();
    assert_eq!(hash(&faster), same);
}

/// The scene may lie in another folder on another machine: only the file name of a texture enters
/// the hash.
#[test]
fn the_hash_of_a_scene_does_not_see_folders() {
    let hash = |texture: &str| {
        let mut world = scene();
        let shape = Shape::sphere(0.1).unwrap();
        let appearance = Appearance { texture: Some(std::path::Path::new(texture).into()), ..Appearance::default() };
        let visual = Visual::shape(0, Pose::identity(), shape.clone(), appearance);
        world.add(RigidBody::new(shape).with_name("textured").with_mass(1.0).with_visuals(vec![visual])).unwrap();
        tumble_net::sync::scene_hash("text", &world)
    };
    assert_eq!(hash("one/scenes/wood.png"), hash("elsewhere/wood.png"));
    assert_ne!(hash("one/scenes/wood.png"), hash("one/scenes/felt.png"));
}

/// A heavy and a light ball rest on the ground: their contacts are sent in single precision, or
/// only the one with the larger force.
#[test]
fn contacts_are_sent_up_to_a_number() {
    let scene = || {
        let mut world = World::default();
        world.add(RigidBody::fixed(Shape::half_space()).with_name("ground")).unwrap();
        for (name, mass) in [("light", 1.0), ("heavy", 2.0)] {
            // the ball that rests on the ground is the second shape of its body
            let above = CompoundPart::new(Shape::sphere(1e-4).unwrap(), Pose::translation(0.0, 0.0, 0.2));
            let ball = CompoundPart::new(Shape::sphere(0.1).unwrap(), Pose::identity());
            let shape = Shape::compound(vec![above, ball]).unwrap();
            let body = RigidBody::new(shape).with_name(name).with_mass(mass);
            world.add(body.with_pose(Pose::translation(mass, 0.0, 0.1))).unwrap();
        }
        world
    };
    for (max, wanted) in [(0, &[][..]), (1, &["heavy"]), (usize::MAX, &["light", "heavy"])] {
        let publisher = Publisher::new(&scene(), false, 0).with_contacts(max);
        let mut pair = Pair { world: scene(), publisher, mirror: Mirror::new(scene()), frame: 0 };
        for _ in 0..240 {
            pair.world.step().unwrap();
        }
        pair.send();
        let (here, there) = (&pair.world, pair.mirror.world());
        let of = |world: &World, name: &str| *world.contacts_of(world.find(name).unwrap()).next().unwrap();
        let name = |c: &ContactPoint| [c.a, c.b].map(|id| there.name(id).unwrap().to_string());
        assert_eq!(there.contacts().len(), wanted.len());
        for (contact, wanted) in there.contacts().iter().zip(wanted) {
            assert!(name(contact).contains(&wanted.to_string()) && name(contact).contains(&"ground".to_string()));
            let sent = of(here, wanted);
            assert_eq!([contact.shape_a, contact.shape_b], [sent.shape_a, sent.shape_b]);
            assert_eq!(contact.shape_a + contact.shape_b, 1);
            assert!((contact.force - sent.force).amax() < 2e-6 * sent.force.amax() && sent.force.norm() > 9.0);
            assert!((contact.point - sent.point).amax() < 1e-6 && (contact.normal - sent.normal).amax() < 1e-6);
            assert!((contact.depth - sent.depth).abs() < 1e-6);
        }
        // the next frame has none
        let heavy = pair.world.find("heavy").unwrap();
        let light = pair.world.find("light").unwrap();
        for id in [heavy, light] {
            pair.world.set_pose(id, Pose::translation(0.0, 0.0, if id == heavy { 50.0 } else { 70.0 })).unwrap();
        }
        pair.world.step().unwrap();
        pair.send();
        assert!(pair.mirror.world().contacts().is_empty());
    }
}

/// A contact of an unknown object or part, a number that is not finite, or a wrong count: nothing
/// is applied.
#[test]
fn wrong_contacts_are_refused_with_their_frame() {
    let mut pair = Pair::new(false);
    pair.send();
    pair.world.step().unwrap();
    let mut good = pair.publisher.publish(&pair.world, &viewer(1), 2).unwrap().state;
    let before = pair.mirror.hash();
    good.truncate(good.len() - 12); // the counts of contacts and events, 0, and the mark of unknown pairs
    let entry = |object: u32, part: u32, x: f32| {
        let indices = [object, part, 3, 0, 0, 0].map(u32::to_le_bytes).concat();
        [&1u32.to_le_bytes()[..], &indices, &[x; 10].map(f32::to_le_bytes).concat()].concat()
    };
    let whole = |object, part, x| [entry(object, part, x), vec![0; 4], vec![255; 4]].concat();
    let cut = entry(0, 0, 1.0)[..67].to_vec();
    let many = 257u32.to_le_bytes().to_vec();
    for bad in [whole(99, 0, 1.0), whole(0, 7, 1.0), whole(0, 0, f32::NAN), cut, many, vec![], vec![0; 13]] {
        assert!(pair.mirror.apply_state(2, 0.5, &[&good[..], &bad].concat()).is_err());
        assert!(pair.mirror.hash() == before && pair.mirror.frame() == 1);
    }
    pair.mirror.apply_state(2, 0.5, &[&good[..], &whole(0, 0, 1.0)].concat()).unwrap();
    assert_eq!(pair.mirror.world().contacts().len(), 1);
    assert_eq!(pair.mirror.world().contacts()[0].shape_a, 3);
}

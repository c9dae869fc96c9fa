//! Worlds that are written as scenes and read back.

use std::path::{Path, PathBuf};

use tumble_behaviors::{Boid, SpringMesh};
use tumble_core::articulated::{DofSettings, Drive, LinkMass, ModelBuilder, Playback, Spring};
use tumble_core::collide::{CompoundPart, Mat3, Pose, Shape, TreeSettings, TriMesh, Vec3};
use tumble_core::{
    Anchor, ArticulatedBody, Collider, CollisionGroup, Coupling, ForceGenerator, Forces, Joint, JointPlace, LockedAxes,
    LoopJoint, LoopJointKind, Material, Mode, Object, PairMaterial, PairSide, RigidBody, Settings, StateRange, Visual,
    VisualMesh, World, WorldView,
};
use tumble_scene::{SaveError, SceneFile, SceneWriter, shipped};

/// A folder that is removed at the end of a test.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Folder {
        let path = std::env::temp_dir().join(format!("tumble_saving_{name}_{}", std::process::id()));
        let _ = std::fs::remove_dir_all(&path);
        std::fs::create_dir_all(&path).unwrap();
        Folder(path)
    }

    fn scene(&self) -> PathBuf {
        self.0.join("saved.toml")
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn run(world: &mut World, seconds: f64) {
    let end = world.time() + seconds;
    while world.time() < end - 1e-9 {
        world.step().unwrap();
    }
}

fn load(path: &Path) -> (World, Vec<String>) {
    SceneFile::load(path).unwrap_or_else(|e| panic!("{}", e.report(false))).build().unwrap_or_else(|e| panic!("{e}"))
}

/// Makes the text count: a comment is an edit.
fn edit(path: &Path) {
    let text = std::fs::read_to_string(path).unwrap();
    std::fs::write(path, format!("{text}# edited\n")).unwrap();
}

/// Returns the largest distance of a part of one world from the same part of the other, m.
fn apart(a: &World, b: &World) -> f64 {
    let mut most = 0.0_f64;
    for &id in a.ids() {
        let other = b.find(a.name(id).unwrap()).unwrap_or_else(|| panic!("{:?} is lost", a.name(id)));
        for part in 0.. {
            let (Some(ours), Some(theirs)) = (a.pose(id, part), b.pose(other, part)) else { break };
            most = most.max((ours.translation.vector - theirs.translation.vector).norm());
            most = most.max(ours.rotation.angle_to(&theirs.rotation));
        }
    }
    most
}

/// Saves a world at the start and after 3 s and reads it: it goes on with the same bits. Returns the world after 3 s.
fn goes_on(name: &str, scene: &SceneFile) -> (Folder, World) {
    let folder = Folder::new(name);
    let (mut world, _) = scene.build().unwrap();
    for seconds in [0.0, 3.0] {
        run(&mut world, seconds);
        let notes = SceneWriter::new(&world).like(scene).save(folder.scene()).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert_eq!(notes, Vec::<String>::new(), "{name}");
        same_bits(name, &world, &folder, 0.3);
    }
    (folder, world)
}

/// Reads a world that was saved in a folder, and steps it and the one that was saved.
fn same_bits(name: &str, world: &World, folder: &Folder, seconds: f64) {
    let (mut read, _) = load(&folder.scene());
    assert!(world.save() == read.save(), "{name}: the state that is read is another");
    let mut world = world.fork();
    run(&mut world, seconds);
    run(&mut read, seconds);
    assert!(world.save() == read.save(), "{name}: the worlds part after {seconds} s");
    assert_eq!(world.contacts(), read.contacts(), "{name}");
}

/// The text of such a scene alone gives the same poses up to rounding, too.
fn check(name: &str, scene: &SceneFile) {
    let (folder, there) = goes_on(name, scene);
    edit(&folder.scene());
    let (edited, notes) = load(&folder.scene());
    assert!(notes.iter().any(|note| note.contains("edited after it was saved")), "{name}: {notes:?}");
    let gap = apart(&there, &edited);
    assert!(gap < 1e-9, "{name}: the text places a part {gap:e} m or rad off");
}

/// Scenes with behaviors or spawned bodies, whose text says how they began.
const BEGINNINGS: [&str; 7] = ["cloth", "jelly", "sparks", "campfire", "flock", "ball_machine", "bird"];

/// The text of a scene with behaviors builds the world of its beginning: two texts in a row are the same.
#[test]
fn scenes_with_behaviors_are_saved() {
    for name in BEGINNINGS {
        let scene = shipped().iter().find(|s| s.name == name).unwrap().read().unwrap();
        let (folder, _) = goes_on(name, &scene);
        edit(&folder.scene());
        let (edited, notes) = load(&folder.scene());
        assert!(notes.iter().any(|note| note.contains("edited after it was saved")), "{name}: {notes:?}");
        let (fresh, _) = scene.build().unwrap();
        assert_eq!(edited.ids().len(), fresh.ids().len(), "{name}");
        for &id in fresh.ids().iter().filter(|id| fresh.object(**id).unwrap().frame_state().is_none()) {
            let (theirs, object) = (edited.find(fresh.name(id).unwrap()).unwrap(), fresh.object(id).unwrap());
            let any: &dyn std::any::Any = object;
            if any.is::<SpringMesh>() || any.is::<Boid>() {
                let (ours, theirs) = (fresh.state_of(id).unwrap(), edited.state_of(theirs).unwrap());
                let gap = ours.iter().zip(theirs).fold(0.0, |most: f64, (a, b)| most.max((a - b).abs()));
                assert!(gap < 1e-9, "{name}: {gap:e}");
            }
        }
    }
}

macro_rules! shipped_scenes {
    ($($name:ident),*) => {
        $(#[test]
        fn $name() {
            let name = stringify!($name);
            let scene = shipped().iter().find(|s| s.name == name).unwrap().read().unwrap();
            check(name, &scene);
        })*

        #[test]
        fn every_shipped_scene_is_saved() {
            let names: Vec<&str> = shipped().iter().map(|s| s.name).filter(|name| !BEGINNINGS.contains(name)).collect();
            let mut tested = vec![$(stringify!($name)),*];
            tested.sort_unstable_by_key(|name| names.iter().position(|n| n == name));
            assert_eq!(tested, names);
        }
    };
}

shipped_scenes!(
    falling,
    stack,
    billiards,
    bowling,
    incline,
    pendulum,
    chain,
    piston,
    skeleton,
    robot,
    marble_run,
    newtons_cradle,
    dominoes,
    steam_engine,
    walker,
    arch,
    card_house,
    wrecking_ball,
    mechanism
);

#[test]
fn the_example_of_every_key_is_saved() {
    let reference = include_str!("../../../../scenes/README.md");
    let example = reference.split("```toml\n").nth(1).unwrap().split("```").next().unwrap();
    check("every_key", &SceneFile::parse(example, "s.toml").unwrap());
}

/// A world with every shape, joint and setting that scenes know, made in code.
fn made_in_code() -> World {
    let settings = Settings::default().with_substeps(2).with_event_impulse(0.25).with_max_turn(0.5);
    let mut world = World::new(settings.with_gravity(Vec3::new(0.1, 0.0, -3.7))).unwrap();
    let tilted = |x: f64| {
        let turn = nalgebra::UnitQuaternion::from_euler_angles(0.1, 0.2 + x, -0.3);
        Pose::from_parts(Vec3::new(x, 0.3, 5.0).into(), turn)
    };
    let mesh = TriMesh::torus(0.4, 0.1, 16, 8).translated(&Vec3::new(0.7, -0.2, 0.1));
    let mesh = Shape::mesh(mesh, &TreeSettings::octree()).unwrap();
    let parts = vec![
        CompoundPart::new(Shape::sphere(0.2).unwrap(), tilted(0.3)).with_density(700.0),
        CompoundPart::new(Shape::cuboid(Vec3::new(0.3, 0.2, 0.1)).unwrap(), tilted(-0.4)).with_density(1900.0),
    ];
    let shapes = [
        Shape::sphere(0.3).unwrap(),
        Shape::cuboid(Vec3::new(0.3, 0.5, 0.7)).unwrap(),
        Shape::capsule(0.1, 0.4).unwrap(),
        Shape::cylinder(0.2, 0.3).unwrap(),
        mesh.clone(),
        Shape::compound(parts).unwrap(),
        mesh.clone(),
        Shape::ellipsoid(Vec3::new(0.3, 0.4, 0.6)).unwrap(),
        Shape::cone(0.2, 0.5).unwrap(),
        Shape::rounded_cuboid(Vec3::new(0.3, 0.4, 0.5), 0.05).unwrap(),
        Shape::rounded_cylinder(0.2, 0.5, 0.04).unwrap(),
    ];
    world
        .add_static(RigidBody::fixed(Shape::half_space()).with_name("floor").with_pose(tilted(0.0).inverse()))
        .unwrap();
    for (k, shape) in shapes.into_iter().enumerate() {
        let x = 3.0 * k as f64;
        let body = RigidBody::new(shape).with_name(format!("body \"{k}\"")).with_pose(tilted(x));
        world.add(body.with_velocity(Vec3::new(0.1, x, 0.2)).with_angular_velocity(Vec3::new(0.5, 0.1, x))).unwrap();
    }
    let odd = Material {
        restitution: 0.3,
        friction: 0.7,
        static_friction: 0.9,
        stribeck_speed: 0.02,
        friction_scale: Vec3::new(1.0, 0.5, 2.0),
        rolling_friction: 0.01,
        torsional_friction: 0.02,
        tangential_restitution: 0.4,
        adhesion: 3.0,
        surface_velocity: Vec3::new(0.1, 0.2, 0.0),
        id: 3,
    };
    let inertia = Mat3::new(0.5, 0.01, 0.02, 0.01, 0.6, 0.03, 0.02, 0.03, 0.7);
    let mut body = RigidBody::new(mesh.clone())
        .with_name("own inertia")
        .with_mass_and_inertia(3.0, inertia)
        .with_center_of_mass(Vec3::new(0.1, 0.2, 0.3))
        .with_pose(tilted(-3.0))
        .with_material(odd)
        .with_groups(CollisionGroup::new(5).unwrap(), 0b100_0010)
        .with_gravity_scale(0.5)
        .with_damping(0.1, 0.2)
        .with_locked(LockedAxes::of_names(["y", "rotation_x"]).unwrap());
    body.contact_mode = tumble_core::collide::ContactMode::Spheres;
    world.add(body).unwrap();
    world.add(RigidBody::new(Shape::sphere(1.0).unwrap()).with_name("trigger").with_sensor(true)).unwrap();
    let pusher = RigidBody::fixed(Shape::sphere(0.2).unwrap()).with_name("pusher").with_velocity(Vec3::x());
    world.add_boxed(Box::new(pusher.with_pose(tilted(40.0))), Mode::Kinematic).unwrap();
    let parts =
        [0.0, 0.4, 0.8, 1.2].map(|x| CompoundPart::new(Shape::sphere(0.1).unwrap(), Pose::translation(x, 0.0, 0.0)));
    let sled = RigidBody::new(Shape::compound(parts.into()).unwrap()).with_name("sled").with_pose(tilted(-9.0));
    let plain = Material { friction: 0.3, ..Material::default() };
    let sled = sled.with_material(plain).with_shape_material(0, odd).with_shape_material(2, plain);
    let sled = sled.with_one_way(Vec3::new(0.1, 0.2, 2.0));
    world.add(sled.with_shape_material(3, Material { friction: 0.01, ..plain })).unwrap();
    add_crane(&mut world, mesh);
    add_joints(&mut world);
    let [a, b] = ["body \"0\"", "crane"].map(|name| world.find(name).unwrap());
    let turning = PairMaterial { restitution: Some(0.5), rolling_friction: Some(0.01), ..PairMaterial::default() };
    world.set_pair_material(a, b, PairMaterial { torsional_friction: Some(0.0), ..turning }).unwrap();
    let ignored = PairMaterial { friction: Some(0.2), collides: Some(false), ..PairMaterial::default() };
    world.set_pair_material(PairSide::Material(3), PairSide::Material(3), ignored).unwrap();
    world
}

/// Adds an articulated body with all joints, a folded link, a coupling and a visual mesh.
fn add_crane(world: &mut World, mesh: Shape) {
    let mass = LinkMass { mass: 2.0, center: Vec3::new(0.1, 0.0, -0.2), inertia: 0.1 * Mat3::identity() };
    let turned = Pose::new(Vec3::new(0.1, 0.2, 0.3), Vec3::new(0.3, -0.2, 0.5));
    let mut builder = ModelBuilder::new();
    let foot = builder.link("foot", None, Joint::Fixed, turned, mass);
    let tower = builder.link("tower", Some(foot), Joint::revolute(Vec3::new(1.0, 2.0, 3.0)), turned, mass);
    let arm = builder.link("arm", Some(tower), Joint::prismatic(Vec3::new(1.0, 0.3, 0.0)), turned, mass);
    builder.set_armature(arm, 0.3);
    let hook = builder.link("hook", Some(arm), Joint::Fixed, turned, mass);
    let ball = builder.link("ball", Some(hook), Joint::Spherical, turned, mass);
    builder.link("tail", Some(ball), Joint::revolute(Vec3::z()), turned, mass);
    let mut crane = ArticulatedBody::new("crane", builder.build().unwrap())
        .with_pose(Pose::new(Vec3::new(-8.0, 1.0, 2.0), Vec3::new(0.1, 0.2, 0.3)))
        .with_velocities(&[0.1, 0.2, 0.3, 0.4, 0.5, 0.6])
        .unwrap();
    for link in ["foot", "hook", "tail"] {
        let collider =
            Collider { group: CollisionGroup::new(2).unwrap(), mask: 6, ..Collider::new(mesh.clone(), turned) };
        crane.add_collider(link, collider).unwrap();
    }
    let flag = TriMesh { vertices: vec![Vec3::x(), Vec3::y(), Vec3::z()], triangles: vec![[0, 1, 2]] };
    let flag = std::sync::Arc::new(VisualMesh::new("flag", flag).unwrap());
    crane.add_visual("arm", Visual::mesh(0, turned, flag, Default::default())).unwrap();
    let motion = Playback::new(vec![0.0, 0.1, 2.0], vec![0.0, 0.2, -0.1]).unwrap();
    let drives = [
        Drive::Position { stiffness: 30.0, damping: 2.0, target: 0.3, velocity: 0.1, limit: 40.0 },
        Drive::Playback { motion: motion.into(), limit: f64::INFINITY },
    ];
    for (dof, drive) in drives.into_iter().enumerate() {
        let spring = Some(Spring { stiffness: 3.0, rest: 0.1 });
        let (limits, max_velocity, effort) = (Some([-1.0, 2.0]), 7.5, 40.0);
        let settings = DofSettings {
            limits,
            damping: 0.2,
            friction: 0.1,
            spring,
            drive,
            max_velocity,
            effort,
            ..Default::default()
        };
        crane.set_dof(dof, settings).unwrap();
    }
    for dof in 2..5 {
        crane.set_dof(dof, DofSettings { damping: 0.4, friction: 0.01, ..Default::default() }).unwrap();
    }
    crane.couple(Coupling { dof: 5, of: 0, multiplier: -0.5, offset: 0.2 }).unwrap();
    crane.exclude_collisions("foot", "tail").unwrap();
    crane.self_collision = false;
    world.add(crane).unwrap();
    let mut builder = ModelBuilder::new();
    let root = builder.link("root", None, Joint::Floating, turned, mass);
    builder.link("limb", Some(root), Joint::revolute(Vec3::y()), turned, mass);
    let mut robot =
        ArticulatedBody::new("robot", builder.build().unwrap()).with_pose(Pose::translation(-12.0, 0.0, 3.0));
    for dof in 0..6 {
        robot.set_dof(dof, DofSettings { damping: 0.3, ..Default::default() }).unwrap();
    }
    robot.set_dof(6, DofSettings { drive: Drive::Velocity { target: 1.5, limit: 2.0 }, ..Default::default() }).unwrap();
    world.add(robot).unwrap();
}

/// Adds a loop joint of every kind, most of them between bodies of their own.
fn add_joints(world: &mut World) {
    for (k, (name, kind)) in LoopJointKind::NAMES.iter().enumerate() {
        let at = Vec3::new(0.0, 10.0 + 4.0 * k as f64, 3.0);
        let body = |side: &str, x: f64| {
            let shape = Shape::cuboid(Vec3::new(0.4, 0.5, 0.6)).unwrap();
            let pose = Pose::from_parts((at + Vec3::new(x, 0.0, 0.0)).into(), nalgebra::one());
            RigidBody::new(shape).with_name(format!("{name} {side}")).with_mass(1.0).with_pose(pose)
        };
        let a = world.add(body("a", -0.6)).unwrap();
        let b = world.add(body("b", 0.6)).unwrap();
        let second = at + Vec3::new(0.5, 0.1, 0.0);
        let second_point = kind.has("second_point").then_some(second);
        let place = JointPlace { second_point, axis: Vec3::new(0.0, 0.6, 0.8), ..JointPlace::at(at) };
        let ground = if kind.has("ground") { [at + Vec3::z(), second + Vec3::z()] } else { place.ground };
        let place = JointPlace { second_axis: Some(Vec3::x()), ground, ..place };
        let joint =
            LoopJoint::joining(format!("joint {name}"), *kind, world, Some((a, 0)), Some((b, 0)), place).unwrap();
        let constants = joint.with_transmission(|t| match kind {
            LoopJointKind::Gear => t.teeth = [3, -7],
            LoopJointKind::Rack => t.radius = 0.2,
            LoopJointKind::Screw => t.pitch = 0.05,
            LoopJointKind::Pulley => t.ratio = 2.0,
            _ => {}
        });
        let mut joint = constants.unwrap().with_breaking_force(5e3).unwrap();
        if kind.has_position() {
            let mut dof = DofSettings { damping: 0.3, friction: 0.02, max_velocity: 9.0, ..joint.dof().clone() };
            if *kind == LoopJointKind::Spring {
                dof.spring = Some(Spring { stiffness: 20.0, rest: 0.4 });
            }
            joint.set_dof(dof).unwrap();
        }
        if *kind == LoopJointKind::Spherical {
            joint.set_cone(Some(2.5)).unwrap();
            joint.set_twist_limits(Some([-1.5, 2.0])).unwrap();
        }
        for dof in 1..kind.dofs() {
            let spring = Some(Spring { stiffness: 3.0, rest: 0.1 });
            joint.set_dof_at(dof, DofSettings { spring, effort: 4.0, ..DofSettings::default() }).unwrap();
            joint.set_armature_at(dof, 0.2 * dof as f64).unwrap();
        }
        let id = world.add(joint).unwrap();
        world.set_enabled(id, k != 2).unwrap();
    }
    let (crane, body) = (world.find("crane").unwrap(), world.find("body \"5\"").unwrap());
    let spring = LoopJoint::joining(
        "line",
        LoopJointKind::Rope,
        world,
        Some((crane, 1)),
        Some((body, 0)),
        JointPlace::between(Vec3::z(), Vec3::x()),
    );
    world.add(spring.unwrap()).unwrap();
    // the world may be the first side
    let at = Pose::new(Vec3::new(0.1, 0.2, 0.3), Vec3::new(0.3, -0.2, 0.5));
    let here = world.pose(body, 0).unwrap() * at;
    let hung = LoopJoint::new("hung", LoopJointKind::Spherical, Anchor::world(here), Anchor::on(body, 0, at));
    world.add(hung.unwrap()).unwrap();
}

#[test]
fn a_world_made_in_code_is_saved_with_everything_in_it() {
    let folder = Folder::new("code");
    let mut world = made_in_code();
    for _ in 0..20 {
        world.step().unwrap();
    }
    let notes = SceneWriter::new(&world).save(folder.scene()).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(notes, Vec::<String>::new());
    let (mut read, _) = load(&folder.scene());
    assert!(world.save() == read.save());
    for _ in 0..60 {
        world.step().unwrap();
        read.step().unwrap();
    }
    assert!(world.save() == read.save());
    assert_eq!((world.frame(), world.time()), (read.frame(), read.time()));
}

/// The text alone says all constants: its world moves as the saved one does while nothing touches.
#[test]
fn the_text_alone_gives_the_same_motion() {
    let folder = Folder::new("text");
    let mut world = made_in_code();
    SceneWriter::new(&world).save(folder.scene()).unwrap();
    edit(&folder.scene());
    let (mut read, _) = load(&folder.scene());
    assert!(apart(&world, &read) < 1e-12, "{:e}", apart(&world, &read));
    for _ in 0..20 {
        world.step().unwrap();
        read.step().unwrap();
    }
    assert!(apart(&world, &read) < 1e-7, "{:e}", apart(&world, &read));
}

#[test]
fn edits_of_the_text_count() {
    let folder = Folder::new("edits");
    let mut world = World::default();
    world.add(RigidBody::new(Shape::sphere(0.5).unwrap()).with_name("a").with_velocity(Vec3::x())).unwrap();
    SceneWriter::new(&world).save(folder.scene()).unwrap();
    let text = std::fs::read_to_string(folder.scene()).unwrap();
    std::fs::write(folder.scene(), text.replace("radius_m = 0.5", "radius_m = 0.25")).unwrap();
    let (read, _) = load(&folder.scene());
    let body: &RigidBody = read.get(read.find("a").unwrap()).unwrap();
    assert!(matches!(body.shape(), Shape::Sphere { radius } if *radius == 0.25));
    // a change by the program counts as well
    std::fs::write(folder.scene(), &text).unwrap();
    let mut scene = SceneFile::load(folder.scene()).unwrap();
    scene.world.dt_s = 0.125;
    assert_eq!(scene.build().unwrap().0.settings().dt, 0.125);
    scene.bodies[0].position_m = [0.0, 7.0, 0.0];
    let (moved, notes) = scene.build().unwrap();
    assert!(notes[0].contains("objects were changed"), "{notes:?}");
    assert_eq!(moved.body(moved.find("a").unwrap()).unwrap().position().y, 7.0);
}

#[derive(Clone)]
struct Lift;

impl ForceGenerator for Lift {
    fn apply(&self, _: &StateRange, _: &WorldView, _: &mut Forces) {}
}

impl Object for Lift {
    fn name(&self) -> &str {
        "lift"
    }
    fn force(&self) -> Option<&dyn ForceGenerator> {
        Some(self)
    }
}

fn fault(world: &World) -> String {
    let folder = Folder::new("fault");
    let error = SceneWriter::new(world).save(folder.scene()).unwrap_err();
    assert!(matches!(error, SaveError::Unsayable(_)), "{error}");
    assert_eq!(std::fs::read_dir(&folder.0).unwrap().count(), 0, "nothing is written");
    error.to_string()
}

#[test]
fn what_a_scene_cannot_say_is_an_error_that_names_it() {
    let mut world = World::default();
    world.add(Lift).unwrap();
    assert!(fault(&world).contains("\"lift\", an object of a type of its own"));
    let mut world = World::default();
    let material = Material { id: 70_000, ..Material::default() };
    world.add(RigidBody::new(Shape::sphere(1.0).unwrap()).with_material(material)).unwrap();
    assert!(fault(&world).contains("the material 70000"));
}

#[test]
fn a_lost_or_damaged_state_is_an_error() {
    let folder = Folder::new("damage");
    let mut world = World::default();
    world.add(RigidBody::new(Shape::sphere(0.5).unwrap()).with_name("a")).unwrap();
    assert!(matches!(SceneWriter::new(&world).save(folder.0.join("saved.txt")), Err(SaveError::Name(_))));
    SceneWriter::new(&world).save(folder.scene()).unwrap();
    let state = folder.0.join("saved_files/state.world");
    let mut bytes = std::fs::read(&state).unwrap();
    let last = bytes.len() - 1;
    bytes[last] ^= 1;
    std::fs::write(&state, &bytes).unwrap();
    let error = SceneFile::load(folder.scene()).unwrap_err().to_string();
    assert!(error.contains("saved_world") && error.contains("checksum"), "{error}");
    std::fs::remove_file(&state).unwrap();
    let error = SceneFile::load(folder.scene()).unwrap_err().to_string();
    assert!(error.contains("without the line, the text counts"), "{error}");
    // saving again replaces all of it
    SceneWriter::new(&world).save(folder.scene()).unwrap();
    SceneFile::load(folder.scene()).unwrap().build().unwrap();
}

/// The name of the scene is taken by a folder: the files of an earlier scene stay.
#[test]
fn a_failure_leaves_the_files_of_an_earlier_scene() {
    let world = made_in_code();
    let folder = Folder::new("in_the_way");
    let (scene, state) = (folder.scene(), folder.0.join("saved_files/state.world"));
    SceneWriter::new(&world).save(&scene).unwrap();
    let earlier = std::fs::read(&state).unwrap();
    std::fs::remove_file(&scene).unwrap();
    std::fs::create_dir_all(scene.join("in the way")).unwrap();
    let mut later = world.fork();
    later.step().unwrap();
    let error = SceneWriter::new(&later).save(&scene).unwrap_err().to_string();
    assert!(error.starts_with(&format!("writing {}: ", scene.display())), "{error}");
    assert_eq!(std::fs::read(&state).unwrap(), earlier);
}

#[test]
fn the_armature_of_a_spherical_joint_is_read_and_saved() {
    let text = "[[articulated]]\nname = \"a\"\n[[articulated.link]]\nname = \"l\"\njoint = \"spherical\"\narmature_kg_m2 = 0.125\nmass_kg = 1\ninertia_kg_m2 = [1, 1, 1]\n";
    let scene = SceneFile::parse(text, "s.toml").unwrap_or_else(|error| panic!("{error}"));
    let (world, _) = scene.build().unwrap();
    let folder = Folder::new("armature");
    SceneWriter::new(&world).like(&scene).save(folder.scene()).unwrap();
    edit(&folder.scene());
    let (read, _) = load(&folder.scene());
    for world in [&world, &read] {
        let body: &ArticulatedBody = world.get(world.find("a").unwrap()).unwrap();
        assert_eq!(body.model().links()[0].armature, 0.125);
    }
}

/// Saves a world, reads its text alone, and checks the status of all objects.
fn with_its_text(name: &str, world: &World) -> World {
    let folder = Folder::new(name);
    SceneWriter::new(world).save(folder.scene()).unwrap_or_else(|e| panic!("{name}: {e}"));
    same_bits(name, world, &folder, 0.2);
    edit(&folder.scene());
    let (read, _) = load(&folder.scene());
    for &id in world.ids() {
        let other = read.find(world.name(id).unwrap()).unwrap();
        assert_eq!(world.status(id), read.status(other), "{:?}", world.name(id));
    }
    read
}

fn ball() -> RigidBody {
    RigidBody::new(Shape::sphere(0.1).unwrap())
}

/// Every kind of object that is disabled, and articulated bodies in other modes.
#[test]
fn objects_that_are_off_are_saved() {
    let text = r#"
[[body]]
name = "ball"
shape = { type = "sphere", radius_m = 0.1 }
mass_kg = 1

[[articulated]]
name = "arm"
mode = "kinematic"
collidable = false
[[articulated.link]]
name = "link"
joint = "revolute"
axis = [0, 1, 0]
rate_rad_per_s = 0.5
shapes = [
    { type = "sphere", radius_m = 0.1, position_m = [0, 0, -1] },
    { type = "sphere", radius_m = 0.2, position_m = [0, 0, -2], name = "feeler", sensor = true, group = 3, mask = [0] },
]
mass_kg = 1

[[sensor]]
name = "imu"
type = "accelerometer"
on = "ball"
seed = 12345678901234567890
enabled = false

[[cloth]]
name = "flag"
nodes = [3, 3]
node_radius_m = 0.01
position_m = [0, 0, 5]
collidable = false
enabled = false

[[particle_system]]
name = "sparks"
seed = 12345678901234567890
enabled = false
[[particle_system.emitter]]
rate_per_s = 100

[[flock]]
name = "birds"
enabled = false
[[flock.group]]
name = "bird"
position_m = [0, 9, 0]
collidable = false
enabled = false

[[body_flock]]
name = "school"
bodies = ["ball"]
enabled = false

[[field]]
name = "wind"
type = "wind"
velocity_m_per_s = [5, 0, 0]
drag_n_s_per_m = 1
enabled = false

[[event]]
name = "gust"
when = { time_s = 0.1 }
do = [{ enable = "wind" }, { enable = "imu" }, { enable = "birds" }, { disable = "flag" }]
enabled = false

[[event]]
name = "start"
when = { time_s = 0.05 }
do = [{ enable = "gust" }]

[[event]]
name = "felt"
when = { enters = "arm", bodies = ["ball"] }
do = [{ disable = "ball" }]
"#;
    let scene = SceneFile::parse(text, "s.toml").unwrap_or_else(|e| panic!("{}", e.report(false)));
    let (mut world, _) = scene.build().unwrap();
    let enabled = |world: &World, name: &str| world.status(world.find(name).unwrap()).unwrap().enabled;
    let off = ["imu", "flag", "sparks", "birds", "bird", "school", "wind", "gust"];
    assert_eq!(off.map(|name| enabled(&world, name)), [false; 8]);
    let arm = world.status(world.find("arm").unwrap()).unwrap();
    assert_eq!((arm.mode, arm.collidable, arm.enabled), (Mode::Kinematic, false, true));
    with_its_text("off", &world);
    run(&mut world, 0.3);
    assert!((world.state_of(world.find("arm").unwrap()).unwrap()[0] - 0.15).abs() < 1e-9, "a kinematic body swings on");
    assert_eq!(["imu", "birds", "wind"].map(|name| enabled(&world, name)), [true; 3]);
    // a drag of 1 N·s/m on 1 kg in a wind of 5 m/s, which the event lets blow at 0.1 s
    let ball = world.body(world.find("ball").unwrap()).unwrap().velocity().x;
    assert!((ball - 5.0 * (1.0 - (-0.2_f64).exp())).abs() < 0.03, "{ball}");
    with_its_text("on", &world);
}

/// A drive whose target an event has set: the text has that target.
#[test]
fn a_world_after_an_event_drove_a_joint_is_saved() {
    let text = r#"
[[articulated]]
name = "arm"
[[articulated.link]]
name = "upper"
joint = "revolute"
axis = [0, 1, 0]
drive = { type = "position", stiffness_n_m_per_rad = 50, damping_n_m_s_per_rad = 5, target_rad = 0.1 }
shape = { type = "capsule", radius_m = 0.02, length_m = 0.4, position_m = [0, 0, -0.2] }
mass_kg = 1

[[event]]
name = "lift"
when = { time_s = 0.2 }
do = [{ push = "arm/upper", impulse_n_s = [0, 0, 0] }, { drive = "arm/upper", target = 0.7 }]
"#;
    let (mut world, _) = SceneFile::parse(text, "s.toml").unwrap().build().unwrap();
    for (seconds, target) in [(0.1, 0.1), (1.0, 0.7)] {
        run(&mut world, seconds);
        let read = with_its_text("drive", &world);
        let body: &ArticulatedBody = read.get(read.find("arm").unwrap()).unwrap();
        assert!(matches!(body.dofs()[0].drive, Drive::Position { target: t, .. } if t == target), "{target}");
    }
    assert_eq!(tumble_core::ScriptedEvent::fired(&world, world.find("lift").unwrap()), Some(1));
}

#[test]
fn limits_of_one_side_are_read_and_saved() {
    let scene = |limits: &str| {
        let link = "[[articulated.link]]\nname = \"l\"\njoint = \"revolute\"\naxis = [0, 1, 0]\nmass_kg = 1\ncenter_m = [0, 0, -1]";
        SceneFile::parse(&format!("[[articulated]]\nname = \"a\"\n{link}\n{limits}\n"), "s.toml")
    };
    for (text, [lower, upper]) in [
        ("limits_rad = [0, inf]", [0.0, f64::INFINITY]),
        ("limits_deg = [-inf, 90]", [f64::NEG_INFINITY, std::f64::consts::FRAC_PI_2]),
        ("limits_rad = [-inf, inf]", [f64::NEG_INFINITY, f64::INFINITY]),
    ] {
        let (mut world, _) = scene(text).unwrap().build().unwrap();
        for _ in 0..2 {
            let body: &ArticulatedBody = world.get(world.find("a").unwrap()).unwrap();
            assert_eq!(body.dofs()[0].limits, Some([lower, upper]), "{text}");
            world = with_its_text("limits", &world);
        }
    }
    for text in ["limits_rad = [inf, inf]", "limits_rad = [-inf, -inf]", "limits_rad = [1, 0]", "limits_rad = [nan, 1]"]
    {
        let error = scene(text).unwrap_err().to_string();
        assert!(error.contains("limits_rad") && error.contains("inf"), "{text}: {error}");
    }
}

#[test]
fn every_setting_is_saved() {
    let mut settings = Settings::default()
        .with_contact_tolerance(1e-6)
        .with_drift_tolerance(2e-4)
        .with_recovery_speed(1.5)
        .with_projection_sweeps(7)
        .with_stabilize_positions(false);
    settings.solver_settings.tolerance = 1e-7;
    settings.solver_settings.max_relaxations = 500;
    settings.solver_settings.max_sweeps = 500_000;
    let mut world = World::new(settings).unwrap();
    world.add(ball()).unwrap();
    assert_eq!(*with_its_text("settings", &world).settings(), settings);
    let error = SceneFile::parse("[world]\ndrift_tolerance_m = 1e-8\n", "s.toml").unwrap_err().to_string();
    assert!(error.contains("at least the contact tolerance, 0.0000001 m"), "{error}");
}

#[test]
fn a_touch_sensor_may_have_a_mesh_as_its_volume() {
    let mut world = World::default();
    let ball = world.add(ball().with_name("ball")).unwrap();
    let mesh = Shape::mesh(TriMesh::icosphere(0.2, 1), &TreeSettings::octree()).unwrap();
    let site = Anchor::on(ball, 0, Pose::translation(0.1, 0.0, 0.0));
    let sensor = tumble_core::Sensor::new("skin", tumble_core::SensorKind::Touch, site).unwrap();
    world.add(sensor.with_volume(mesh).unwrap()).unwrap();
    with_its_text("volume", &world);
}

/// Bodies and links without a mass have the density of water, or those of the parts of a compound, as in Rust and Python.
#[test]
fn the_density_is_that_of_water_without_one() {
    let cube = "{ type = \"box\", size_m = [0.1, 0.1, 0.1] }";
    let parts =
        "{ type = \"compound\", parts = [{ type = \"box\", size_m = [0.1, 0.1, 0.1], density_kg_per_m3 = 3000 }] }";
    let body = |name: &str, shape: &str| format!("[[body]]\nname = \"{name}\"\nshape = {shape}\n");
    let link = |name: &str, rest: &str| {
        format!("[[articulated.link]]\nname = \"{name}\"\njoint = \"revolute\"\naxis = [1, 0, 0]\n{rest}\n")
    };
    let text = body("cube", cube)
        + &body("parts", parts)
        + "[[articulated]]\nname = \"arm\"\n"
        + &link("cube", &format!("shape = {cube}"))
        + &link("parts", &format!("shape = {parts}"))
        + &link("mixed", &format!("shapes = [{cube}, {{ type = \"sphere\", radius_m = 0.1, mass_kg = 4 }}]"))
        + &link("none", &format!("shape = {cube}\nmass_kg = 0\narmature_kg_m2 = 1"))
        + "[[articulated.link]]\nname = \"fixed\"\nparent = \"none\"\njoint = \"fixed\"\n"
        + &format!("shape = {cube}\n");
    let scene = SceneFile::parse(&text, "s.toml").unwrap_or_else(|e| panic!("{}", e.report(false)));
    let (world, _) = scene.build().unwrap();
    let read = with_its_text("density", &world);
    for world in [&world, &read] {
        for (name, mass) in [("cube", 1.0), ("parts", 3.0)] {
            let own = world.get::<RigidBody>(world.find(name).unwrap()).unwrap().mass();
            assert!((own - mass).abs() < 1e-12, "{name}: {own}");
        }
        let arm: &ArticulatedBody = world.get(world.find("arm").unwrap()).unwrap();
        for (name, mass) in [("cube", 1.0), ("parts", 3.0), ("mixed", 5.0), ("none", 0.0), ("fixed", 1.0)] {
            let own = arm.link_mass(name).unwrap().mass;
            assert!((own - mass).abs() < 1e-12, "{name}: {own}");
        }
        assert!((arm.model().links()[3].mass.mass - 1.0).abs() < 1e-12);
    }
}

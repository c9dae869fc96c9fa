//! A world that is written to an archive and read again continues with the same bits.

use crate::common::*;
use tumble_core::collide::{CompoundPart, Mat3, Pose, Shape, TreeSettings, TriMesh, Vec3};
use tumble_core::rows::Rows;
use tumble_core::solver::{NAMES, RowSolver, SolveReport, SolverSettings, by_name};
use tumble_core::*;

/// A world with every shape, a chain of links with limits, drives and a coupling, loops and
/// cameras; one body was removed, one sleeps.
fn everything(stepper: &str) -> World {
    let mut world = world(stepper, 1.0 / 240.0);
    let settings = world.settings().with_combine_restitution(Combine::Min);
    world.set_settings(settings).unwrap();
    ground(&mut world, 0.3, 0.4);
    let gone = world.add(RigidBody::new(sphere(0.1)).with_name("gone").with_mass(1.0)).unwrap();
    let mesh = Shape::mesh(TriMesh::torus(0.3, 0.1, 24, 12), &TreeSettings::octree()).unwrap();
    let compound = Shape::compound(vec![
        CompoundPart::new(cube(0.1), Pose::translation(0.1, 0.0, 0.0)).with_density(900.0),
        CompoundPart::new(mesh.clone(), Pose::translation(0.0, 0.1, 0.0)).with_density(700.0),
        CompoundPart::new(Shape::cylinder(0.05, 0.2).unwrap(), Pose::identity()).with_density(800.0),
    ])
    .unwrap();
    let (capsule, cylinder) = (Shape::capsule(0.1, 0.2).unwrap(), Shape::cylinder(0.1, 0.2).unwrap());
    let shapes = [sphere(0.1), cube(0.2), capsule, cylinder, mesh, compound];
    let ids: Vec<ObjectId> = (0..10)
        .map(|i| {
            let body =
                RigidBody::new(shapes[i % 6].clone()).with_name(format!("body{i}")).with_density(500.0 + i as f64);
            let pose = Pose::translation(0.3 * (i % 3) as f64, 0.0, 0.3 + 0.4 * i as f64);
            let mut body = body
                .with_pose(pose)
                .with_angular_velocity(Vec3::new(i as f64, 1.0, 0.0))
                .with_material(Material { restitution: 0.1 * i as f64, friction: 0.5, ..Material::default() });
            body.linear_damping = 0.01;
            world.add(body.with_camera(CameraMount::new("eye", 0, Pose::identity()))).unwrap()
        })
        .collect();
    let at = Vec3::new(0.0, 0.0, 0.5);
    world.add(LoopJoint::spherical_at("joint", &world, Some((ids[0], 0)), Some((ids[1], 0)), at).unwrap()).unwrap();
    world.add(LoopJoint::revolute_at("loose", &world, Some((gone, 0)), None, at, Vec3::z()).unwrap()).unwrap();
    world.remove(gone).unwrap();
    let mut links = ModelBuilder::new();
    let mut last = None;
    for i in 0..4 {
        let joint = if i == 2 { Joint::Spherical } else { Joint::revolute(Vec3::new(0.0, 1.0, 0.1)) };
        let mass = LinkMass { mass: 1.0, center: Vec3::new(0.0, 0.0, -0.2), inertia: 0.02 * Mat3::identity() };
        last = Some(links.link(format!("link{i}"), last, joint, Pose::translation(0.0, 0.0, -0.4), mass));
    }
    let mut chain = ArticulatedBody::new("chain", links.build().unwrap()).with_pose(Pose::translation(2.0, 0.0, 2.0));
    chain.add_collider("link1", Collider::new(shapes[3].clone(), Pose::translation(0.0, 0.0, -0.2))).unwrap();
    chain.exclude_collisions("link0", "link3").unwrap();
    let motion = Playback::new(vec![0.0, 0.3, 1.0], vec![0.0, 0.4, -0.2]).unwrap();
    let drive = Drive::Playback { motion: motion.into(), limit: 20.0 };
    chain.set_dof(0, DofSettings { drive, damping: 0.1, ..DofSettings::default() }).unwrap();
    chain.set_dof(1, DofSettings { limits: Some([-0.3, 0.2]), friction: 0.05, ..DofSettings::default() }).unwrap();
    chain.couple(Coupling { dof: 5, of: 1, multiplier: 0.5, offset: 0.1 }).unwrap();
    world.add(chain).unwrap();
    world
        .set_pair_material(
            ids[2],
            ids[0],
            PairMaterial { restitution: Some(0.7), friction: Some(0.1), ..PairMaterial::default() },
        )
        .unwrap();
    world
        .set_pair_material(
            PairSide::Material(3),
            (ids[4], 0),
            PairMaterial { friction: Some(0.9), ..PairMaterial::default() },
        )
        .unwrap();
    world.set_mode(ids[9], Mode::Kinematic).unwrap();
    world.set_enabled(ids[8], false).unwrap();
    world
}

fn again(world: &World) -> World {
    World::from_archive(&world.archive(&[]).unwrap(), &mut |_| None).unwrap()
}

#[test]
fn an_archived_world_goes_the_same_way() {
    for stepper in STEPPERS {
        let mut world = everything(stepper);
        for frame in 0..60 {
            if frame % 20 == 0 {
                let mut other = again(&world);
                assert_eq!(other.save(), world.save(), "{stepper}: frame {frame}");
                assert_eq!(other.archive(&[]).unwrap(), world.archive(&[]).unwrap());
                assert_eq!(other.contacts().len(), world.contacts().len());
                assert_eq!(
                    ((other.stepper_name(), other.solver_name()), other.settings()),
                    ((world.stepper_name(), world.solver_name()), world.settings())
                );
                let mut ours = world.fork();
                for _ in 0..100 {
                    ours.step().unwrap();
                    other.step().unwrap();
                    assert_eq!(other.save(), ours.save(), "{stepper}: written at frame {frame}");
                }
            }
            world.step().unwrap();
        }
        assert!(!world.contacts().is_empty());
    }
}

#[test]
fn shared_shapes_are_written_once_and_shared_again() {
    let mesh = Shape::mesh(TriMesh::torus(0.3, 0.1, 48, 24), &TreeSettings::octree()).unwrap();
    let of = |count: usize| {
        let mut world = world(STEPPERS[0], 1.0 / 240.0);
        (0..count).for_each(|i| {
            world.add(RigidBody::new(mesh.clone()).with_name(format!("body{i}")).with_mass(1.0)).unwrap();
        });
        world
    };
    let [one, ten] = [1, 10].map(|count| of(count).archive(&[]).unwrap().len());
    assert!(ten < one + 10 * 1000, "{one} {ten}");
    let ten = again(&of(10));
    let meshes: Vec<_> = ten.ids().iter().map(|&id| ten.get::<RigidBody>(id).unwrap().shape().clone()).collect();
    let [Shape::Mesh(a), Shape::Mesh(b)] = [&meshes[0], &meshes[9]] else { panic!("meshes") };
    assert!(std::sync::Arc::ptr_eq(a, b));
}

/// A force upwards.
#[derive(Clone)]
struct Lift;

impl Object for Lift {
    fn name(&self) -> &str {
        "lift"
    }
    fn force(&self) -> Option<&dyn ForceGenerator> {
        Some(self)
    }
}

impl ForceGenerator for Lift {
    fn apply(&self, _me: &StateRange, _view: &WorldView, out: &mut Forces) {
        out.wrenches.iter_mut().for_each(|w| w.force.z += 1.0);
    }
}

#[test]
fn objects_of_other_kinds_are_made_by_the_caller() {
    let mut world = everything(STEPPERS[0]);
    let lift = world.add(Lift).unwrap();
    world
        .add(RigidBody::new(sphere(0.1)).with_name("last").with_mass(1.0).with_pose(Pose::translation(9.0, 0.0, 1.0)))
        .unwrap();
    assert_eq!(world.archive(&[]), Err(ArchiveError::Foreign("lift".into())));
    let bytes = world.archive(&[lift]).unwrap();
    let refused = World::from_archive(&bytes, &mut |_| None).map(|_| ());
    assert_eq!(refused, Err(ArchiveError::Foreign("lift".into())));
    let mut other =
        World::from_archive(&bytes, &mut |read| (read.name == "lift").then(|| Box::new(Lift) as _)).unwrap();
    for _ in 0..50 {
        world.step().unwrap();
        other.step().unwrap();
    }
    assert_eq!(other.save(), world.save());
}

/// A solver and a stepper of another crate.
#[derive(Clone)]
struct Idle;

impl RowSolver for Idle {
    fn name(&self) -> &'static str {
        "idle"
    }
    fn solve(&self, _: &Rows, _: &[u32], _: &[f64], _: &mut [f64], _: &mut [f64], _: SolverSettings) -> SolveReport {
        SolveReport { iterations: 0, converged: true, ray: false, relaxations: 0 }
    }
    fn fork(&self) -> Box<dyn RowSolver> {
        Box::new(Idle)
    }
}

impl Stepper for Idle {
    fn name(&self) -> &'static str {
        "idle"
    }
    fn step(&mut self, _: StepContext) -> Result<(), StepError> {
        Ok(())
    }
    fn fork(&self) -> Box<dyn Stepper> {
        Box::new(Idle)
    }
}

/// The bytes could not be read again, so they are not written.
#[test]
fn a_world_with_a_foreign_solver_or_stepper_is_not_written() {
    let mut world = everything(STEPPERS[0]);
    world.set_solver(Box::new(Idle));
    assert_eq!(world.archive(&[]), Err(ArchiveError::Solver("idle".into())));
    world.set_solver(by_name(NAMES[0]).unwrap());
    world.set_stepper(Box::new(Idle));
    assert_eq!(world.archive(&[]), Err(ArchiveError::Stepper("idle".into())));
    world.set_stepper(stepper_by_name(STEPPERS[0]).unwrap());
    assert!(World::from_archive(&world.archive(&[]).unwrap(), &mut |_| None).is_ok());
}

#[test]
fn damage_is_found() {
    let bytes = everything(STEPPERS[0]).archive(&[]).unwrap();
    let refused = |bytes: &[u8]| World::from_archive(bytes, &mut |_| None).map(|_| ()).unwrap_err();
    assert!(matches!(refused(b"other bytes"), ArchiveError::NotOne(_)));
    assert!(matches!(refused(&bytes[..7]), ArchiveError::NotOne(_)));
    let mut newer = bytes.clone();
    newer[7] += 1;
    assert!(matches!(refused(&newer), ArchiveError::Format { .. }));
    for place in (8..bytes.len()).step_by(997) {
        let mut changed = bytes.clone();
        changed[place] ^= 0x10;
        assert!(matches!(refused(&changed), ArchiveError::Damaged(_)), "byte {place}");
        assert!(matches!(refused(&bytes[..place]), ArchiveError::Damaged(_)), "cut at {place}");
    }
}

/// A mesh that is only drawn is read for the archive, and shared again afterwards; an unreadable
/// one stays unreadable, with the same reason.
#[test]
fn visual_meshes_need_no_file_any_more() {
    let sheet = TriMesh { vertices: vec![Vec3::zeros(), Vec3::x(), Vec3::y()], triangles: vec![[0, 1, 2]] };
    let read = sheet.clone();
    let there = std::sync::Arc::new(VisualMesh::read_by("sheet", move || Ok(read.clone().into())));
    let gone = std::sync::Arc::new(VisualMesh::read_by("gone", || Err("no file".into())));
    let mesh =
        |mesh: &std::sync::Arc<VisualMesh>| Visual::mesh(0, Pose::identity(), mesh.clone(), Appearance::default());
    let instead = |of: &std::sync::Arc<VisualMesh>| Visual {
        stands_in_for: vec![of.clone()],
        ..Visual::shape(0, Pose::identity(), sphere(0.1), Appearance::default())
    };
    let visuals = vec![mesh(&there), mesh(&there), mesh(&gone), instead(&there), instead(&gone)];
    let mut world = world("time_stepping", 1.0 / 240.0);
    world.add(RigidBody::new(sphere(0.1)).with_name("b").with_mass(1.0).with_visuals(visuals)).unwrap();
    let bytes = world.archive(&[]).unwrap();
    let copy = World::from_archive(&bytes, &mut |_| None).unwrap();
    assert_eq!(copy.archive(&[]).unwrap(), bytes);
    let drawn: Vec<Option<Drawn<'_>>> = copy.visuals().map(Visual::drawn).collect();
    let [Some(Drawn::Mesh(a)), Some(Drawn::Mesh(b)), None, None, Some(Drawn::Shape(_))] = drawn[..] else {
        panic!("{drawn:?}")
    };
    assert!(std::sync::Arc::ptr_eq(a, b) && **a == sheet);
    let VisualGeometry::Mesh(lost) = &copy.visuals().nth(2).unwrap().geometry else { panic!() };
    assert_eq!((lost.name(), lost.fault()), ("gone", Some("no file")));
}

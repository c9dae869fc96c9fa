//! A scene in tumble: `time_stepping`, `gauss_seidel`, default settings.

use crate::scene::{self, Body, Joint, Mode, Plane, Scene};
use crate::{Engine, Motion, Solves};
use tumble_collide::{Pose, Quat, Shape, TreeSettings, TriMesh, Vec3};
use tumble_core::solver::RowSolver;
use tumble_core::{
    Anchor, LoopJoint, LoopJointKind, Material, Mode as WorldMode, ObjectId, RigidBody, Settings, World,
};

/// A tumble world with a scene in it.
pub struct Tumble {
    world: World,
    ids: Vec<ObjectId>,
    /// Kinematic bodies.
    turning: Vec<(ObjectId, Body)>,
}

impl Tumble {
    /// Builds the scene, to be stepped on one thread.
    pub fn new(scene: &Scene) -> Tumble {
        Tumble::on(scene, 1)
    }

    /// Builds the scene, to be stepped on a number of threads.
    pub fn on(scene: &Scene, threads: u32) -> Tumble {
        let mut world = World::new(Settings::default().with_dt(scene.dt()).with_threads(threads))
            .expect("the default settings are valid");
        let material = Material { restitution: scene.restitution, friction: scene.friction, ..Material::default() };
        for (i, plane) in scene.planes.iter().enumerate() {
            let fixed = RigidBody::fixed(Shape::half_space()).with_name(format!("plane{i}"));
            let fixed = fixed.with_material(material).with_pose(pose(plane));
            world.add_static(fixed).expect("a fixed body is valid");
        }
        let hulls: Vec<Shape> = scene.hulls.iter().map(hull).collect();
        let mut turning = Vec::new();
        let mut add = |(i, body): (usize, &Body)| {
            let (shape, name) = (shape(body.shape, &hulls), format!("body{i}"));
            let (object, mode) = match body.mode {
                Mode::Dynamic => (RigidBody::new(shape).with_density(body.density), WorldMode::Dynamic),
                Mode::Fixed => (RigidBody::fixed(shape), WorldMode::Static),
                Mode::Turning(_) => (RigidBody::fixed(shape), WorldMode::Kinematic),
            };
            let object = object.with_name(name).with_material(material).with_pose(placed(body, 0.0));
            let id = world.add_boxed(Box::new(object), mode).expect("names are unique");
            if mode == WorldMode::Kinematic {
                turning.push((id, *body));
            }
            if !scene.joints.is_empty() {
                world.set_collidable(id, false).expect("the body is there");
            }
            id
        };
        let ids: Vec<ObjectId> = scene.bodies.iter().enumerate().map(&mut add).collect();
        for (i, joint) in scene.joints.iter().enumerate() {
            world.add(spherical(i, joint, &ids)).expect("names are unique");
        }
        Tumble { world, ids, turning }
    }

    /// Replaces the limit of sweeps, and lifts that of relaxations.
    pub fn set_max_sweeps(&mut self, sweeps: u32) {
        let mut settings = *self.world.settings();
        settings.solver_settings.max_sweeps = sweeps;
        settings.solver_settings.max_relaxations = u32::MAX;
        self.world.set_settings(settings).expect("at least one sweep");
    }

    /// Replaces the solver.
    pub fn set_solver(&mut self, solver: Box<dyn RowSolver>) {
        self.world.set_solver(solver);
    }
}

impl Engine for Tumble {
    fn step(&mut self) {
        let next = self.world.time() + self.world.settings().dt;
        for (id, body) in &self.turning {
            self.world.move_to(*id, placed(body, next)).expect("the body is there");
        }
        self.world.step().expect("all numbers are finite");
    }

    fn motion(&self, i: usize) -> Motion {
        let part = self.world.part_state(self.ids[i], 0).expect("the body is there");
        let rotation = part.pose.rotation.to_rotation_matrix();
        Motion {
            center: part.position().into(),
            rotation: [0, 1, 2].map(|r| [0, 1, 2].map(|c| rotation[(r, c)])),
            speed: part.velocity.norm(),
        }
    }

    fn solves(&self) -> Option<Solves> {
        let report = self.world.report();
        Some(Solves { residual: report.residual, unconverged: report.unconverged })
    }
}

fn shape(shape: scene::Shape, hulls: &[Shape]) -> Shape {
    match shape {
        scene::Shape::Sphere(radius) => Shape::sphere(radius).expect("the radius is valid"),
        scene::Shape::Box(size) => Shape::cuboid(size.into()).expect("the sizes are valid"),
        scene::Shape::Hull(i) => hulls[i].clone(),
    }
}

/// Returns a closed mesh. Its sphere tree is coarse, since contacts of surfaces make no use of it.
fn hull(mesh: &TriMesh) -> Shape {
    let coarse = TreeSettings { depth: 2, error: 0.1, ..TreeSettings::octree() };
    Shape::mesh(mesh.clone(), &coarse).expect("a hull is closed")
}

fn spherical(i: usize, joint: &Joint, ids: &[ObjectId]) -> LoopJoint {
    let side = |k: usize| {
        let [x, y, z] = joint.anchors[k];
        Anchor::on(ids[joint.bodies[k]], 0, Pose::translation(x, y, z))
    };
    LoopJoint::new(format!("joint{i}"), LoopJointKind::Spherical, side(0), side(1)).expect("two finite frames")
}

/// Returns the pose of a body that no force has moved, at a time.
fn placed(body: &Body, time: f64) -> Pose {
    let (center, turn) = body.place(time);
    Pose::from_parts(Vec3::from(center).into(), Quat::from_axis_angle(&Vec3::y_axis(), turn))
}

/// The pose whose local z axis is the plane's normal.
fn pose(plane: &Plane) -> Pose {
    let normal = Vec3::from(plane.normal);
    let turn = Quat::rotation_between(&Vec3::z(), &normal).unwrap_or_else(Quat::identity);
    Pose::from_parts(Vec3::from(plane.point).into(), turn)
}

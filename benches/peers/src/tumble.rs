//! A scene in tumble: `time_stepping`, `gauss_seidel`, default settings.

use crate::scene::{self, DENSITY, FRICTION, Plane, Scene};
use crate::{Engine, Motion, Solves};
use tumble_collide::{Pose, Quat, Shape, Vec3};
use tumble_core::{Material, ObjectId, RigidBody, Settings, World};

/// A tumble world with a scene in it.
pub struct Tumble {
    world: World,
    ids: Vec<ObjectId>,
}

impl Tumble {
    /// Builds the scene, to be stepped on one thread.
    pub fn new(scene: &Scene) -> Tumble {
        Tumble::on(scene, 1)
    }

    /// Builds the scene, to be stepped on a number of threads.
    pub fn on(scene: &Scene, threads: u32) -> Tumble {
        let mut world = World::new(Settings::default().with_dt(scene.dt()).with_threads(threads)).expect("the default settings are valid");
        let material = Material { restitution: scene.restitution, friction: FRICTION, ..Material::default() };
        for (i, plane) in scene.planes.iter().enumerate() {
            let fixed = RigidBody::fixed(Shape::half_space()).with_name(format!("plane{i}"));
            let fixed = fixed.with_material(material).with_pose(pose(plane));
            world.add_static(fixed).expect("a fixed body is valid");
        }
        let mut add = |(i, body): (usize, &scene::Body)| {
            let [x, y, z] = body.center;
            let body = RigidBody::new(shape(body.shape)).with_name(format!("body{i}")).with_density(DENSITY);
            let body = body.with_material(material).with_pose(Pose::translation(x, y, z));
            world.add(body).expect("names are unique")
        };
        let ids = scene.bodies.iter().enumerate().map(&mut add).collect();
        Tumble { world, ids }
    }
}

impl Engine for Tumble {
    fn step(&mut self) {
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

fn shape(shape: scene::Shape) -> Shape {
    match shape {
        scene::Shape::Sphere(radius) => Shape::sphere(radius),
        scene::Shape::Box(size) => Shape::cuboid(size.into()),
    }
    .expect("the sizes are valid")
}

/// The pose whose local z axis is the plane's normal.
fn pose(plane: &Plane) -> Pose {
    let normal = Vec3::from(plane.normal);
    let turn = Quat::rotation_between(&Vec3::z(), &normal).unwrap_or_else(Quat::identity);
    Pose::from_parts(Vec3::from(plane.point).into(), turn)
}

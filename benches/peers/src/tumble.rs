//! A scene in tumble: `time_stepping`, `gauss_seidel`, default settings.

use crate::scene::{Body, EDGE, Plane, RADIUS, Scene};
use crate::{DENSITY, DT, Engine, FRICTION, RESTITUTION};
use tumble_collide::{Pose, Quat, Shape, Vec3};
use tumble_core::{Material, ObjectId, RigidBody, Settings, World};

/// A tumble world with a scene in it.
pub struct Tumble {
    world: World,
    ids: Vec<ObjectId>,
}

impl Tumble {
    /// Builds the scene.
    pub fn new(scene: &Scene) -> Tumble {
        let mut world = World::new(Settings::default().with_dt(DT)).expect("the default settings are valid");
        for (i, plane) in scene.planes.iter().enumerate() {
            let fixed = RigidBody::fixed(Shape::half_space())
                .with_name(format!("plane{i}"))
                .with_material(Material { restitution: RESTITUTION, friction: FRICTION, ..Material::default() })
                .with_pose(pose(plane));
            world.add_static(fixed).expect("a fixed body is valid");
        }
        let shape = match scene.body {
            Body::Sphere => Shape::sphere(RADIUS),
            Body::Box => Shape::cuboid(Vec3::repeat(EDGE)),
        };
        let shape = shape.expect("the sizes are valid");
        let mut add = |(i, c): (usize, &[f64; 3])| {
            let body = RigidBody::new(shape.clone()).with_name(format!("body{i}")).with_density(DENSITY);
            let body = body
                .with_material(Material { restitution: RESTITUTION, friction: FRICTION, ..Material::default() })
                .with_pose(Pose::translation(c[0], c[1], c[2]));
            world.add(body).expect("names are unique")
        };
        let ids = scene.centers.iter().enumerate().map(&mut add).collect();
        Tumble { world, ids }
    }
}

impl Engine for Tumble {
    fn step(&mut self) {
        self.world.step().expect("all numbers are finite");
    }

    fn center(&self, i: usize) -> [f64; 3] {
        self.world.part_state(self.ids[i], 0).expect("the body is there").position().into()
    }

    fn residual(&self) -> Option<f64> {
        Some(self.world.report().residual)
    }
}

/// The pose whose local z axis is the plane's normal.
fn pose(plane: &Plane) -> Pose {
    let normal = Vec3::from(plane.normal);
    let turn = Quat::rotation_between(&Vec3::z(), &normal).unwrap_or_else(Quat::identity);
    Pose::from_parts(Vec3::from(plane.point).into(), turn)
}

//! A scene in Rapier, in double and in single precision: 4 solver iterations (its default), no
//! sleep, the same density, friction and restitution on both sides of every pair, so that all of its
//! combine rules agree.

/// Returns the pose of a body that no force has moved, at a time.
macro_rules! pose {
    ($body:expr, $time:expr, $real:ty) => {{
        let (center, turn) = $body.place($time);
        let axis = Vector::from([0.0, turn as $real, 0.0]);
        Pose::new(Vector::from(center.map(|x| x as $real)), axis)
    }};
}

/// Defines a Rapier world from one of its crates and its kind of number.
macro_rules! engine {
    ($name:ident, $rapier:ident, $real:ty, $doc:literal) => {
        #[doc = $doc]
        pub struct $name {
            world: $rapier::prelude::PhysicsWorld,
            handles: Vec<$rapier::prelude::RigidBodyHandle>,
            /// Kinematic bodies.
            turning: Vec<($rapier::prelude::RigidBodyHandle, $crate::scene::Body)>,
            dt: f64,
            frames: u32,
        }

        impl $name {
            /// Builds the scene.
            pub fn new(scene: &$crate::scene::Scene) -> $name {
                use $crate::scene::{Mode, Shape};
                use $rapier::prelude::*;
                let vector = |v: [f64; 3]| Vector::from(v.map(|x| x as $real));
                let surface = |collider: ColliderBuilder| {
                    let collider = collider.friction_combine_rule(CoefficientCombineRule::GeometricMean);
                    collider.friction(scene.friction as $real).restitution(scene.restitution as $real)
                };
                let mut world = PhysicsWorld::new();
                world.gravity = vector([0.0, 0.0, -9.81]);
                world.integration_parameters.dt = scene.dt() as $real;
                world.integration_parameters.num_solver_iterations = 4;
                for plane in &scene.planes {
                    let normal = nalgebra::Unit::new_unchecked(plane.normal.map(|x| x as $real).into());
                    let body = RigidBodyBuilder::fixed().translation(vector(plane.point));
                    world.insert(body, surface(ColliderBuilder::halfspace(normal)));
                }
                let hull = |i: usize| {
                    let points: Vec<Vector> = scene.hulls[i].vertices.iter().map(|v| vector((*v).into())).collect();
                    ColliderBuilder::convex_hull(&points).expect("the points span a solid")
                };
                let mut turning = Vec::new();
                let mut add = |body: &$crate::scene::Body| {
                    let collider = match body.shape {
                        Shape::Sphere(radius) => ColliderBuilder::ball(radius as $real),
                        Shape::Box(size) => {
                            let [x, y, z] = size.map(|x| 0.5 * x as $real);
                            ColliderBuilder::cuboid(x, y, z)
                        }
                        Shape::Hull(i) => hull(i),
                    };
                    let collider = match scene.joints.is_empty() {
                        true => collider,
                        false => collider.collision_groups(InteractionGroups::none()),
                    };
                    let builder = match body.mode {
                        Mode::Dynamic => RigidBodyBuilder::dynamic(),
                        Mode::Fixed => RigidBodyBuilder::fixed(),
                        Mode::Turning(_) => RigidBodyBuilder::kinematic_position_based(),
                    };
                    let builder = builder.pose(pose!(body, 0.0, $real)).can_sleep(false);
                    let handle = world.insert(builder, surface(collider).density(body.density as $real)).0;
                    if let Mode::Turning(_) = body.mode {
                        turning.push((handle, *body));
                    }
                    handle
                };
                let handles: Vec<_> = scene.bodies.iter().map(&mut add).collect();
                for joint in &scene.joints {
                    let [a, b] = joint.anchors.map(&vector);
                    let spherical = SphericalJointBuilder::new().local_anchor1(a).local_anchor2(b);
                    let [a, b] = joint.bodies.map(|i| handles[i]);
                    world.insert_impulse_joint(a, b, spherical);
                }
                $name { world, handles, turning, dt: scene.dt(), frames: 0 }
            }
        }

        impl $crate::Engine for $name {
            fn step(&mut self) {
                use $rapier::prelude::*;
                self.frames += 1;
                for (handle, body) in &self.turning {
                    let next = pose!(body, f64::from(self.frames) * self.dt, $real);
                    self.world.bodies[*handle].set_next_kinematic_position(next);
                }
                self.world.step();
            }

            fn motion(&self, i: usize) -> $crate::Motion {
                let body = &self.world.bodies[self.handles[i]];
                let position = body.position();
                let axis = |k: usize| {
                    let unit = [0, 1, 2].map(|j| if j == k { 1.0 } else { 0.0 });
                    <[$real; 3]>::from(position.rotation * $rapier::math::Vector::from(unit)).map(f64::from)
                };
                let axes = [axis(0), axis(1), axis(2)];
                $crate::Motion {
                    center: <[$real; 3]>::from(body.translation()).map(f64::from),
                    rotation: [0, 1, 2].map(|row| axes.map(|axis| axis[row])),
                    speed: f64::from(body.linvel().length()),
                }
            }
        }
    };
}

engine!(Rapier64, rapier3d_f64, f64, "A Rapier world in double precision.");
engine!(Rapier32, rapier3d, f32, "A Rapier world in single precision, four SIMD lanes wide.");

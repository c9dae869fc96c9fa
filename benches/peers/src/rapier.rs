//! A scene in Rapier, in double and in single precision: 4 solver iterations (its default), no
//! sleep, the same density, friction and restitution on both sides of every pair, so that all of its
//! combine rules agree.

/// Defines a Rapier world from one of its crates and its kind of number.
macro_rules! engine {
    ($name:ident, $rapier:ident, $real:ty, $doc:literal) => {
        #[doc = $doc]
        pub struct $name {
            world: $rapier::prelude::PhysicsWorld,
            handles: Vec<$rapier::prelude::RigidBodyHandle>,
        }

        impl $name {
            /// Builds the scene.
            pub fn new(scene: &$crate::scene::Scene) -> $name {
                use $crate::scene::{DENSITY, FRICTION, Shape};
                use $rapier::prelude::*;
                let vector = |v: [f64; 3]| Vector::from(v.map(|x| x as $real));
                let surface = |collider: ColliderBuilder| {
                    let collider = collider.friction_combine_rule(CoefficientCombineRule::GeometricMean);
                    collider.friction(FRICTION as $real).restitution(scene.restitution as $real)
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
                let mut add = |body: &$crate::scene::Body| {
                    let collider = match body.shape {
                        Shape::Sphere(radius) => ColliderBuilder::ball(radius as $real),
                        Shape::Box(size) => {
                            let [x, y, z] = size.map(|x| 0.5 * x as $real);
                            ColliderBuilder::cuboid(x, y, z)
                        }
                    };
                    let body = RigidBodyBuilder::dynamic().translation(vector(body.center)).can_sleep(false);
                    world.insert(body, surface(collider).density(DENSITY as $real)).0
                };
                let handles = scene.bodies.iter().map(&mut add).collect();
                $name { world, handles }
            }
        }

        impl $crate::Engine for $name {
            fn step(&mut self) {
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

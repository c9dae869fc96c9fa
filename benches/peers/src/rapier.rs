//! A scene in Rapier: 4 solver iterations (its default), no sleep, the same density, friction and
//! restitution on both sides of every pair, so that all of its combine rules agree.

use crate::scene::{Body, EDGE, RADIUS, Scene};
use crate::{DENSITY, DT, Engine, FRICTION, RESTITUTION};
use rapier3d_f64::prelude::*;

/// A Rapier world with a scene in it.
pub struct Rapier {
    world: PhysicsWorld,
    handles: Vec<RigidBodyHandle>,
}

impl Rapier {
    /// Builds the scene.
    pub fn new(scene: &Scene) -> Rapier {
        let mut world = PhysicsWorld::new();
        world.gravity = Vector::new(0.0, 0.0, -9.81);
        world.integration_parameters.dt = DT;
        world.integration_parameters.num_solver_iterations = 4;
        for plane in &scene.planes {
            let collider = surface(ColliderBuilder::halfspace(nalgebra::Unit::new_unchecked(plane.normal.into())));
            world.insert(RigidBodyBuilder::fixed().translation(plane.point.into()), collider);
        }
        let shape = match scene.body {
            Body::Sphere => ColliderBuilder::ball(RADIUS),
            Body::Box => ColliderBuilder::cuboid(0.5 * EDGE, 0.5 * EDGE, 0.5 * EDGE),
        };
        let mut add = |c: &[f64; 3]| {
            let body = RigidBodyBuilder::dynamic().translation((*c).into()).can_sleep(false);
            world.insert(body, surface(shape.clone()).density(DENSITY)).0
        };
        let handles = scene.centers.iter().map(&mut add).collect();
        Rapier { world, handles }
    }
}

fn surface(collider: ColliderBuilder) -> ColliderBuilder {
    let rule = CoefficientCombineRule::GeometricMean;
    collider.friction(FRICTION).restitution(RESTITUTION).friction_combine_rule(rule)
}

impl Engine for Rapier {
    fn step(&mut self) {
        self.world.step();
    }

    fn center(&self, i: usize) -> [f64; 3] {
        self.world.bodies[self.handles[i]].translation().into()
    }
}

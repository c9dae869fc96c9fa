//! When particles leave their sources, and what becomes of those that leave at the end of a frame.

use crate::steps;
use std::collections::BTreeSet;
use tumble_behaviors::{Emitter, ParticleSettings, ParticleSystem};
use tumble_core::WorldError;
use tumble_core::prelude::*;

fn world(dt: f64) -> World {
    World::new(Settings::default().with_dt(dt).with_gravity(Vec3::zeros())).unwrap()
}

fn settings() -> ParticleSettings {
    ParticleSettings { capacity: 300, ..ParticleSettings::default() }
}

fn system(emitter: Emitter) -> ParticleSystem {
    ParticleSystem::new("particles", settings()).unwrap().with_emitter(emitter).unwrap()
}

#[test]
fn a_particle_born_in_contact_at_the_end_of_a_frame_is_finite() {
    for dt in [1.0 / 64.0, 1.0 / 60.0, 0.01] {
        let mut world = world(dt);
        let mount = world.add(RigidBody::fixed(Shape::sphere(0.2).unwrap())).unwrap();
        // below the middle and upwards: into the nearest surface
        let emitter = Emitter {
            mount: Some((mount, 0)),
            half_angle: 0.1,
            ..Emitter::stream(Pose::translation(0.0, 0.0, -0.1), 1.0 / dt)
        };
        let id = world.add(system(emitter)).unwrap();
        steps(&mut world, 40);
        let particles: Vec<_> = ParticleSystem::particles(&world, id).unwrap().collect();
        assert!(particles.len() >= 38, "{}", particles.len());
        assert!(particles.iter().all(|p| p.position.iter().chain(p.velocity.iter()).all(|x| x.is_finite())));
    }
}

#[test]
fn an_impact_at_the_end_of_a_frame_is_found_there() {
    for rate in 30..300 {
        let dt = 1.0 / f64::from(rate);
        let mut world = world(dt);
        world.add(RigidBody::fixed(Shape::half_space())).unwrap();
        let id = world.add(ParticleSystem::new("", settings()).unwrap()).unwrap();
        for speed in [0.7, 1.0, 3.0] {
            let height = 0.01 + speed * dt;
            ParticleSystem::spawn(&mut world, id, height * Vec3::z(), Vec3::new(0.3, 0.0, -speed), 9.0).unwrap();
        }
        steps(&mut world, 3);
        for p in ParticleSystem::particles(&world, id).unwrap() {
            assert!((p.position.z - 0.01).abs() < 1e-9 && p.velocity.z.abs() < 1e-9, "{p:?}");
        }
    }
}

/// Steps a world and returns the serial numbers of all particles ever seen, each of which must appear once.
fn births(dt: f64, emitter: Emitter, frames: usize) -> BTreeSet<u64> {
    let mut world = world(dt);
    let id = world.add(system(emitter)).unwrap();
    let (mut seen, mut last) = (BTreeSet::new(), 0);
    for _ in 0..frames {
        steps(&mut world, 1);
        let now: Vec<u64> = ParticleSystem::particles(&world, id).unwrap().map(|p| p.serial).collect();
        assert_eq!(now.iter().collect::<BTreeSet<_>>().len(), now.len());
        seen.extend(now);
        last = last.max(seen.last().map_or(0, |serial| serial + 1));
    }
    assert_eq!(seen.len() as u64, last, "no number is left out");
    seen
}

#[test]
fn a_burst_at_the_end_of_a_frame_leaves_once() {
    for rate in [60, 100, 240] {
        let dt = 1.0 / f64::from(rate);
        for frame in 0..80 {
            let emitter = Emitter { lifetime: [9.0; 2], ..Emitter::burst(Vec3::zeros(), 10, f64::from(frame) * dt) };
            let seen = births(dt, emitter, frame as usize + 2);
            assert_eq!(seen.len(), 10, "at frame {frame} of {rate} Hz");
        }
    }
    for (dt, start) in [(0.01, 0.02), (1.0 / 60.0, 0.25)] {
        let emitter = Emitter { lifetime: [9.0; 2], ..Emitter::burst(Vec3::zeros(), 10, start) };
        assert_eq!(births(dt, emitter, 60).len(), 10);
    }
}

#[test]
fn a_stream_in_step_with_the_frames_leaves_each_particle_once() {
    for rate in [60.0, 100.0, 240.0] {
        for share in [0.5, 1.0, 2.0, 3.0] {
            let frames = 1000;
            // in step, and half a particle later
            for late in [0.0, 0.5] {
                let (start, expected) = (late / (share * rate), share * frames as f64 - late);
                let lifetime = [0.2; 2];
                let emitter = Emitter { start, lifetime, ..Emitter::stream(Pose::identity(), share * rate) };
                let seen = births(1.0 / rate, emitter, frames).len() as f64;
                // the last one may be due a rounding after the last frame
                assert!(seen <= expected && seen >= expected - 1.0, "{seen} of {expected}, {rate} Hz, {share}");
            }
        }
    }
}

#[test]
fn lifetimes_and_axes_are_checked() {
    let mut world = world(0.01);
    let id = world.add(ParticleSystem::new("sparks", settings()).unwrap()).unwrap();
    for life in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let refused = ParticleSystem::spawn(&mut world, id, Vec3::zeros(), Vec3::zeros(), life);
        assert_eq!(refused, Err(WorldError::BadState("sparks".into())), "{life}");
    }
    assert_eq!(ParticleSystem::spawn(&mut world, id, Vec3::zeros(), Vec3::zeros(), 1.0), Ok(Some(0)));
    let rotation = Quat::new_unchecked(nalgebra::Quaternion::new(f64::NAN, 0.0, 0.0, 0.0));
    let emitter = Emitter { pose: Pose::from_parts(Vec3::zeros().into(), rotation), ..Emitter::default() };
    let error = ParticleSystem::new("", settings()).unwrap().with_emitter(emitter).unwrap_err().to_string();
    assert!(error.starts_with("the axis of an emitter"), "{error}");
}

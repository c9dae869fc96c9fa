//! The makings of pictures and messages: surfaces of meshes, clouds and messages of particles.

use crate::steps;
use std::collections::BTreeMap;
use tumble_behaviors::{Cloth, Emitter, Jelly, ParticleLook, ParticleSettings, ParticleSystem, SpringMesh};
use tumble_core::prelude::*;
use tumble_core::{Appearance, CloudSphere, NetSync, Renderable, SyncError};

fn triangles(mesh: &SpringMesh) -> Vec<[usize; 3]> {
    mesh.surface().unwrap().triangles.iter().map(|corners| corners.map(|k| k as usize)).collect()
}

/// Returns how often each directed edge occurs.
fn edges(triangles: &[[usize; 3]]) -> BTreeMap<[usize; 2], usize> {
    let mut edges = BTreeMap::new();
    for [a, b, c] in triangles {
        [[*a, *b], [*b, *c], [*c, *a]].into_iter().for_each(|edge| *edges.entry(edge).or_default() += 1);
    }
    edges
}

#[test]
fn a_jelly_has_the_closed_surface_of_its_block() {
    let jelly = Jelly { nodes: [3, 4, 2], size: [0.2, 0.3, 0.5], ..Jelly::default() }.mesh().unwrap();
    let (triangles, nodes) = (triangles(&jelly), jelly.nodes());
    assert_eq!(triangles.len(), 2 * 2 * (6 + 3 + 2), "two for each cell of six faces");
    let edges = edges(&triangles);
    assert!(edges.iter().all(|([a, b], n)| *n == 1 && edges.contains_key(&[*b, *a])), "closed, and turned one way");
    let volume: f64 = triangles.iter().map(|[a, b, c]| nodes[*a].dot(&nodes[*b].cross(&nodes[*c])) / 6.0).sum();
    assert!((volume - 0.2 * 0.3 * 0.5).abs() < 1e-15, "outward: {volume}");
}

#[test]
fn a_cloth_has_the_area_of_its_sheet_and_four_sides() {
    let cloth = Cloth { nodes: [5, 4], size: [0.8, 0.6], ..Cloth::default() };
    let mesh = cloth.mesh().unwrap();
    let (triangles, nodes) = (triangles(&mesh), mesh.nodes());
    let area: Vec3 =
        triangles.iter().map(|[a, b, c]| 0.5 * (nodes[*b] - nodes[*a]).cross(&(nodes[*c] - nodes[*a]))).sum();
    assert!((area - Vec3::new(0.0, 0.0, 0.48)).norm() < 1e-15, "{area:?}");
    let edges = edges(&triangles);
    let border = edges.iter().filter(|([a, b], _)| !edges.contains_key(&[*b, *a])).count();
    assert_eq!(border, 2 * (4 + 3));
    for (side, axis, end) in [("x_min", 0, -0.4), ("x_max", 0, 0.4), ("y_min", 1, -0.3), ("y_max", 1, 0.3)] {
        let found: Vec<usize> = (0..nodes.len()).filter(|k| (nodes[*k][axis] - end).abs() < 1e-12).collect();
        assert_eq!(cloth.side(side), Some(found), "{side}");
    }
    assert_eq!(cloth.side("corners"), Some(vec![0, 4, 15, 19]));
    assert_eq!(cloth.side("z_max"), None);
    assert!(mesh.with_pinned_nodes(&[20]).is_err());
}

/// Returns a world with a burst of particles of lifetimes from 1 to 2 s, flown for 10 steps.
fn burst(count: u32, look: ParticleLook) -> (World, tumble_core::ObjectId) {
    let mut world = World::default();
    let settings = ParticleSettings { capacity: count as usize + 100, ..ParticleSettings::default() };
    let source = Emitter { lifetime: [1.0, 2.0], ..Emitter::burst(Vec3::new(1.0, 2.0, 3.0), count, 0.0) };
    let system = ParticleSystem::new("p", settings).unwrap().with_emitter(source).unwrap().with_look(look).unwrap();
    let id = world.add(system).unwrap();
    steps(&mut world, 10);
    (world, id)
}

#[test]
fn a_cloud_has_the_living_particles_and_shrinks_them_at_their_end() {
    let (world, id) = burst(500, ParticleLook { radius: Some(0.05), fade: 1.5, ..ParticleLook::default() });
    let system = world.get::<ParticleSystem>(id).unwrap();
    let spheres: Vec<CloudSphere> = system.cloud(world.state_of(id).unwrap()).unwrap().spheres.collect();
    let particles: Vec<_> = ParticleSystem::particles(&world, id).unwrap().collect();
    assert_eq!(spheres.len(), 500);
    for (sphere, particle) in spheres.iter().zip(&particles) {
        assert_eq!((sphere.center, sphere.opacity, sphere.color), (particle.position, 1.0, None));
        assert!((sphere.radius - 0.05 * (particle.life / 1.5).min(1.0)).abs() < 1e-15);
    }
    assert!(particles.iter().any(|particle| particle.life < 1.5) && particles.iter().any(|p| p.life > 1.5));
}

/// Look with all changes over life.
fn smoke() -> ParticleLook {
    let appearance = Appearance { color: [1.0, 0.5, 0.25], ..Appearance::default() };
    let end_color = Some([0.0, 0.25, 0.5]);
    ParticleLook { appearance, opacity: Some([0.8, 0.2]), scale: [0.5, 4.0], end_color, ..ParticleLook::default() }
}

#[test]
fn opacity_size_and_color_change_linearly_from_birth_to_end() {
    let (mut world, id) = burst(300, smoke());
    let lifetimes: Vec<f64> = ParticleSystem::particles(&world, id).unwrap().map(|p| p.lifetime).collect();
    assert!(lifetimes.iter().all(|life| (1.0..2.0).contains(life)));
    assert!(lifetimes.iter().any(|life| *life < 1.1) && lifetimes.iter().any(|life| *life > 1.9));
    steps(&mut world, 30);
    let system = world.get::<ParticleSystem>(id).unwrap();
    let cloud = system.cloud(world.state_of(id).unwrap()).unwrap();
    assert!(cloud.transparent);
    let (spheres, time) = (cloud.spheres.collect::<Vec<_>>(), world.time());
    let particles: Vec<_> = ParticleSystem::particles(&world, id).unwrap().collect();
    assert_eq!(spheres.len(), 300);
    for ((sphere, particle), lifetime) in spheres.iter().zip(particles).zip(lifetimes) {
        assert_eq!(particle.lifetime, lifetime, "it stays");
        let age = time / lifetime; // all were born at time 0
        assert!((particle.life - (lifetime - time)).abs() < 1e-12);
        assert!((sphere.opacity - (0.8 - 0.6 * age)).abs() < 1e-12);
        assert!((sphere.radius - 0.01 * (0.5 + 3.5 * age)).abs() < 1e-14);
        let color = sphere.color.unwrap().map(f64::from);
        for (have, want) in color.into_iter().zip([1.0 - age, 0.5 - 0.25 * age, 0.25 + 0.25 * age]) {
            assert!((have - want).abs() < 1e-6, "{have} for {want}");
        }
    }
}

#[test]
fn a_copy_made_of_a_message_looks_the_same() {
    let (world, id) = burst(50, smoke());
    let mut copy = world.fork();
    copy.replica().read_data(id, &message(&world, id)).unwrap();
    let spheres = |world: &World| -> Vec<CloudSphere> {
        world.get::<ParticleSystem>(id).unwrap().cloud(world.state_of(id).unwrap()).unwrap().spheres.collect()
    };
    for (ours, theirs) in spheres(&world).iter().zip(spheres(&copy)) {
        assert!((ours.opacity - theirs.opacity).abs() < 1e-6 && (ours.radius - theirs.radius).abs() < 1e-8);
    }
}

#[test]
fn looks_out_of_range_are_refused_by_name() {
    let refused = |look: ParticleLook| {
        let system = ParticleSystem::new("p", ParticleSettings::default()).unwrap();
        system.with_look(look).unwrap_err().to_string()
    };
    let usual = ParticleLook::default;
    for (look, words) in [
        (ParticleLook { opacity: Some([0.5, 1.5]), ..usual() }, "the opacity of a particle is 1.5"),
        (ParticleLook { opacity: Some([f64::NAN, 0.0]), ..usual() }, "the opacity of a particle is NaN"),
        (ParticleLook { scale: [-1.0, 1.0], ..usual() }, "the scale of a particle is -1"),
        (ParticleLook { end_color: Some([0.0, 2.0, 0.0]), ..usual() }, "the end color of a particle is 2"),
    ] {
        let message = refused(look);
        assert!(message.contains(words), "{message}");
    }
}

fn message(world: &World, id: tumble_core::ObjectId) -> Vec<u8> {
    let (view, mut out) = (world.view(), Vec::new());
    world.get::<ParticleSystem>(id).unwrap().get_data(view.state_range(id).unwrap(), &view, &mut out);
    out
}

#[test]
fn a_message_has_all_particles_and_a_copy_repeats_it() {
    let (world, id) = burst(700, ParticleLook::default());
    let sent = message(&world, id);
    assert_eq!(sent.len(), 4 + 20 * 700);
    let mut copy = world.fork();
    copy.replica().read_data(id, &sent).unwrap();
    assert_eq!(message(&copy, id), sent, "the copy sends the same bytes");
    let (ours, theirs) =
        (ParticleSystem::particles(&world, id).unwrap(), ParticleSystem::particles(&copy, id).unwrap());
    let mut count = 0;
    for (a, b) in ours.zip(theirs) {
        assert!((a.position - b.position).amax() < 4.0 * f64::from(f32::EPSILON), "single precision");
        assert!((a.life - b.life).abs() < 2.0 * f64::from(f32::EPSILON));
        assert!((a.lifetime - b.lifetime).abs() < 2.0 * f64::from(f32::EPSILON));
        count += 1;
    }
    assert_eq!(count, 700);
}

#[test]
fn a_message_of_many_particles_is_bounded_and_thinned_by_serial_number() {
    let (world, id) = burst(100_000, ParticleLook::default());
    let sent = message(&world, id);
    // of 100,000 each fourth: ⌈100,000/32,768⌉ = 4
    assert_eq!(sent.len(), 4 + 20 * 25_000);
    let mut copy = world.fork();
    copy.replica().read_data(id, &sent).unwrap();
    assert_eq!(message(&copy, id), sent);
    let fourth = ParticleSystem::particles(&world, id).unwrap().filter(|particle| particle.serial % 4 == 0);
    let shown = ParticleSystem::particles(&copy, id).unwrap();
    assert!(fourth.zip(shown).all(|(a, b)| (a.position - b.position).amax() < 1e-6));
}

#[test]
fn bad_messages_are_refused_and_change_nothing() {
    let (mut world, id) = burst(10, ParticleLook::default());
    let (good, before) = (message(&world, id), world.state().to_vec());
    let system = world.get::<ParticleSystem>(id).unwrap().clone();
    let read = |data: &[u8]| {
        let mut x = before.clone();
        let outcome = system.read_data(data, &mut x);
        assert!(outcome.is_ok() || x == before, "unchanged on an error");
        outcome
    };
    assert!(read(&good).is_ok());
    for cut in 0..good.len() {
        assert!(matches!(read(&good[..cut]), Err(SyncError::Length { .. })), "cut at {cut}");
    }
    let with = |at: usize, bytes: [u8; 4]| {
        let mut bad = good.clone();
        bad[at..at + 4].copy_from_slice(&bytes);
        bad
    };
    assert!(matches!(read(&with(0, 111u32.to_le_bytes())), Err(SyncError::Length { .. })), "above the capacity");
    assert!(matches!(read(&with(0, u32::MAX.to_le_bytes())), Err(SyncError::Length { .. })));
    assert_eq!(read(&with(4, f32::NAN.to_le_bytes())), Err(SyncError::Value));
    assert_eq!(read(&with(16, 0f32.to_le_bytes())), Err(SyncError::Value), "no time left");
    assert_eq!(read(&with(20, (-1f32).to_le_bytes())), Err(SyncError::Value), "a lifetime below 0");
    world.step().unwrap();
}

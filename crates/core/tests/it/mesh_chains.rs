//! Chains of tori that hang in each other, as meshes: at rest they stay at rest.

use crate::common::*;
use std::f64::consts::FRAC_PI_2;
use std::sync::LazyLock;
use tumble_core::collide::{Pose, Shape, TreeSettings, TriMesh, Vec3};
use tumble_core::*;

const RADIUS: f64 = 0.05;
const TUBE: f64 = 0.01;
const MASS: f64 = 0.1;

static LINK: LazyLock<Shape> =
    LazyLock::new(|| Shape::mesh(TriMesh::torus(RADIUS, TUBE, 48, 24), &TreeSettings::default()).unwrap());

/// A chain of `count` tori that hangs in a fixed one.
fn chain(stepper: &str, count: usize) -> (World, Vec<ObjectId>) {
    let (mut world, mut ids) = (world(stepper, 1.0 / 240.0), Vec::new());
    let upright = Pose::rotation(Vec3::new(FRAC_PI_2, 0.0, 0.0));
    for i in 0..=count {
        let below = Vec3::new(0.0, 0.0, -2.0 * (RADIUS - TUBE) * i as f64);
        let place = Pose::new(below, Vec3::new(0.0, 0.0, FRAC_PI_2 * (i % 2) as f64));
        let link = RigidBody::new(LINK.clone()).with_name(format!("link {i}")).with_mass(MASS);
        let link = link.with_pose(place * upright).with_material(Material { friction: 0.5, ..Material::default() });
        ids.push(if i == 0 { world.add_static(link).unwrap() } else { world.add(link).unwrap() });
    }
    (world, ids)
}

/// Energy is judged by that of the chain's height: five hanging links once rose by 7 mJ and moved at 50 mm/s.
#[test]
fn hanging_chains_of_meshes_stay_at_rest_full_length() {
    let runs: &[(&str, usize, f64)] = if std::env::var_os("TUMBLE_SLOW").is_some_and(|v| v == "1") {
        &[("time_stepping", 5, 60.0), ("time_stepping", 20, 60.0), ("backtracking", 5, 60.0)]
    } else {
        &[("time_stepping", 5, 2.0), ("backtracking", 5, 0.5)]
    };
    for &(stepper, count, seconds) in runs {
        let (mut world, ids) = chain(stepper, count);
        let height = 2.0 * (RADIUS - TUBE) * count as f64;
        let scale = MASS * count as f64 * G * height;
        let (mut least, mut rise, mut fastest) = (world.energy().total(), 0.0f64, 0.0f64);
        for _ in 0..(seconds * 240.0) as usize {
            world.step().unwrap();
            let energy = world.energy().total();
            least = least.min(energy);
            rise = rise.max(energy - least);
            let speeds = ids.iter().map(|id| world.part_state(*id, 0).unwrap());
            fastest = speeds.map(|s| s.velocity.norm()).fold(fastest, f64::max);
        }
        println!(
            "{stepper}, {count} links, {seconds} s: energy rises by {rise:.1e} J of {scale:.2} J, at most {fastest:.1e} m/s"
        );
        assert!(rise < 1e-9 * scale, "{stepper}, {count} links: energy rises by {rise:e} J of {scale} J");
        assert!(fastest < 1e-6, "{stepper}, {count} links: {fastest:e} m/s");
        assert!((position(&world, ids[count]).z + height).abs() < 1e-4, "{stepper}: the chain hangs");
    }
}

/// Contacts of meshes that are kept from the end of a frame to the start of the next change nothing: a world that is restored has
/// none, and goes the same way as one that has them.
#[test]
fn a_swinging_chain_does_not_depend_on_contacts_that_are_kept() {
    let swinging = || {
        let (mut world, ids) = chain("time_stepping", 3);
        world.set_velocity(ids[3], Vec3::new(0.3, 0.2, 0.0), Vec3::new(0.0, 0.0, 4.0)).unwrap();
        world
    };
    let (mut whole, mut again) = (swinging(), swinging());
    for frame in 0..60 {
        whole.step().unwrap();
        again.step().unwrap();
        assert!(whole.save() == again.save(), "frame {frame}");
        if frame % 3 == 2 {
            let saved = again.save();
            again = swinging();
            again.restore(&saved).unwrap();
        }
    }
    assert!(whole.contacts().len() > 3);
}

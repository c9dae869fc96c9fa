//! Closed meshes at rest: on their surface and on their sphere trees, through both steppers.

use crate::common::*;
use std::path::PathBuf;
use tumble_core::collide::{ContactMode, Pose, Shape, TreeSettings, TriMesh, Vec3};
use tumble_core::*;

/// The folder of the public test meshes: `TUMBLE_MESHES`, else the nearest `shared/meshes` above
/// this crate.
fn folder() -> Option<PathBuf> {
    let named = std::env::var_os("TUMBLE_MESHES").map(PathBuf::from);
    let here = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    named.or_else(|| here.ancestors().map(|a| a.join("shared/meshes")).find(|p| p.is_dir()))
}

/// Speed of the fastest point of a resting body in the `spheres` mode, m/s. A mesh is supported by
/// spheres within a few micrometers of the plane, which change from frame to frame. A contact made
/// or lost within a frame changes speeds by up to `g·h` = 41 mm/s; half of that is allowed.
const REST_ON_SPHERES: f64 = 0.5 * G / 240.0;
/// The same in the `surface` mode: vertices support it, and they do not change.
const REST: f64 = 1e-4;

/// Drops a mesh of 1000 kg/m³ over a half-space and runs. In the last second every point of it is
/// slower than `REST` and stays within 0.5 mm of its place, and it was never deeper than the stated
/// outward error of its tree.
fn comes_to_rest(name: &str, mesh: &TriMesh, turn: Vec3, height: f64, seconds: f64) {
    falls(ContactMode::Surface, REST, name, mesh, turn, height, seconds);
    falls(ContactMode::Spheres, REST_ON_SPHERES, name, mesh, turn, height, seconds);
}

fn falls(mode: ContactMode, rest: f64, name: &str, mesh: &TriMesh, turn: Vec3, height: f64, seconds: f64) {
    for stepper in STEPPERS {
        let mut fastest = 0.0f64;
        let shape = Shape::mesh(mesh.clone(), &TreeSettings::octree()).unwrap();
        let (error, Shape::Mesh(solid)) = (shape.tree().unwrap().outward_error(), &shape) else {
            unreachable!("made as a mesh")
        };
        let corners = solid.mesh().vertices.clone();
        let mut world = world(stepper, 1.0 / 240.0);
        ground(&mut world, 0.2, 0.6);
        let body = RigidBody::new(shape)
            .with_name(name)
            .with_density(1000.0)
            .with_material(Material { restitution: 0.2, friction: 0.6, ..Material::default() })
            .with_contact_mode(mode);
        let id = world.add(body.with_pose(Pose::new(Vec3::new(0.0, 0.0, height), turn))).unwrap();
        let (mut deepest, mut touched, mut there) = (0.0f64, 0, Vec3::zeros());
        let frames = (seconds * 240.0) as usize;
        for frame in 0..frames {
            let report = world.step().unwrap();
            deepest = deepest.max(report.max_penetration);
            touched += (report.contacts > 0) as usize;
            let part_state = world.part_state(id, 0).unwrap();
            if frame + 240 < frames {
                there = part_state.position();
                continue;
            }
            let speed = corners
                .iter()
                .map(|c| part_state.velocity_at(&(part_state.position() + part_state.pose.rotation * c)).norm())
                .fold(0.0, f64::max);
            fastest = fastest.max(speed);
            assert!(speed < rest, "{stepper}, {mode:?}: '{name}' moves at {speed} m/s after {} s", world.time());
            assert!(
                (part_state.position() - there).norm() < 5e-4,
                "{stepper}: '{name}' wandered by {} m",
                (part_state.position() - there).norm()
            );
        }
        println!("{stepper}, {mode:?}: '{name}' at rest moves at {fastest:.1e} m/s; deepest {deepest:.1e} m");
        assert!(
            touched > frames / 2 && position(&world, id).z > 0.0,
            "{stepper}: '{name}' is at {}",
            position(&world, id)
        );
        assert!(deepest < error, "{stepper}: '{name}' was {deepest} m deep, its tree's error is {error} m");
        assert!(world.energy().kinetic < 1e-5 * world.get::<RigidBody>(id).unwrap().mass() * G * height);
    }
}

const ASKEW: Vec3 = Vec3::new(0.3, 0.2, 0.1);

/// Returns a public test mesh; `None`, with a note, if there is no folder.
fn public(file: &str) -> Option<TriMesh> {
    let Some(folder) = folder() else {
        // directly to the terminal: the harness hides the output of passing tests
        let _ = std::io::Write::write_fmt(
            &mut std::io::stderr(),
            format_args!(
                "\nSKIPPED: no shared/meshes above {} and TUMBLE_MESHES is not set\n",
                env!("CARGO_MANIFEST_DIR")
            ),
        );
        return None;
    };
    let path = folder.join(file);
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    Some(TriMesh::from_obj(&text).unwrap())
}

#[test]
fn the_bunny_comes_to_rest_on_a_plane() {
    if let Some(bunny) = public("bunny.obj") {
        comes_to_rest("bunny", &bunny.scaled(0.1), ASKEW, 0.4, 10.0);
    }
}

/// Its base is flat to a micrometer, with many vertices: all supporting vertices must be among the
/// few contacts that are kept.
#[test]
fn the_fandisk_comes_to_rest_on_a_plane() {
    if let Some(fandisk) = public("fandisk.obj") {
        let scale = 1.0 / fandisk.diagonal();
        falls(ContactMode::Surface, 1e-6, "fandisk", &fandisk.scaled(scale), ASKEW, 0.6, 5.0);
    }
}

#[test]
fn a_torus_that_falls_askew_comes_to_lie_flat() {
    let mesh = TriMesh::torus(0.1, 0.04, 32, 16);
    comes_to_rest("torus", &mesh, ASKEW, 0.4, 4.0);
}

/// A turned pin lands on its foot and stands.
#[test]
fn a_turned_pin_stands() {
    let profile = [(0.0, 0.0), (0.026, 0.0), (0.06, 0.11), (0.023, 0.25), (0.03, 0.34), (0.0, 0.38)];
    let mesh = TriMesh::lathe(&profile, 24).unwrap();
    falls(ContactMode::Surface, 1e-6, "pin", &mesh, Vec3::zeros(), 0.2, 3.0);
    falls(ContactMode::Spheres, REST_ON_SPHERES, "pin", &mesh, Vec3::zeros(), 0.2, 3.0);
}

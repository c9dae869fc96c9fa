//! The key `contacts`: the default, precedence, errors for wrong values, and its effect in the
//! world.

use crate::bad_input::assert_errors;
use tumble_core::World;
use tumble_core::collide::ContactMode::{self, Spheres, Surface};
use tumble_scene::SceneFile;

/// Returns a scene with a triangle mesh of a sphere of 0.1 m just above the ground, and these lines
/// in `[world]` and in its `[[body]]`.
fn ball(world: &str, body: &str) -> String {
    format!(
        "[world]\n{world}\n[meshes.ball]\ntype = \"icosphere\"\nradius_m = 0.1\nsubdivisions = 1\n[[body]]\nname = \"ground\"\nmode = \"static\"\n\
         shape = {{ type = \"half_space\" }}\n[[body]]\nname = \"ball\"\nshape = {{ type = \"mesh\", mesh = \"ball\" }}\nmass_kg = 1.0\nposition_m = [0, 0, 0.12]\n{body}\n"
    )
}

fn built(world: &str, body: &str) -> (SceneFile, World) {
    let scene =
        SceneFile::parse(&ball(world, body), "s.toml").unwrap_or_else(|error| panic!("{}", error.report(false)));
    let world = scene.build().unwrap().0;
    (scene, world)
}

fn mode(world: &str, body: &str) -> ContactMode {
    let (_, world) = built(world, body);
    let id = world.find("ball").unwrap();
    world.object(id).unwrap().collidable().unwrap().contact_mode(0)
}

#[test]
fn contacts_are_those_of_the_surface_unless_the_world_or_the_body_says_otherwise() {
    let (surface, spheres) = ("contacts = \"surface\"", "contacts = \"spheres\"");
    assert_eq!(mode("", ""), Surface);
    assert_eq!(mode(spheres, ""), Spheres);
    assert_eq!(mode("", spheres), Spheres);
    assert_eq!(mode(spheres, surface), Surface);
    assert_eq!(built(spheres, surface).0.world.contacts, Spheres);
}

/// In the mode `surface` a body rests at its own height; on its leaf spheres, which extend beyond
/// the surface, it rests higher.
#[test]
fn the_contact_mode_sets_the_resting_height() {
    let rests = |lines: &str| {
        let (_, mut world) = built(lines, "");
        (0..480).for_each(|_| {
            world.step().unwrap();
        });
        let id = world.find("ball").unwrap();
        world.part_state(id, 0).unwrap().position().z
    };
    let (surface, spheres) = (rests("contacts = \"surface\""), rests("contacts = \"spheres\""));
    // between the sphere through the vertices and the one through the centers of the faces
    assert!((0.085..=0.1 + 1e-6).contains(&surface), "by its surface it rests {surface} m above the ground");
    assert!(spheres > surface + 1e-4, "{spheres} m by its spheres, {surface} m by its surface");
}

#[test]
fn a_wrong_word_is_reported_with_its_place_and_the_nearest_one() {
    assert_errors(
        &ball("contacts = \"sphere\"", ""),
        &["s.toml:2:12: `contacts` of [world] is \"sphere\"; did you mean `spheres`?"],
    );
}

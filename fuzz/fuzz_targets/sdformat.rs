//! The text of a model or world of Gazebo. No file is opened but those that it names as meshes, which are looked for in the present folder.
#![no_main]

use libfuzzer_sys::fuzz_target;
use tumble_scene::sdformat::parse;
use tumble_scene::urdf::{MissingMeshes, UrdfOptions};

fuzz_target!(|text: &str| {
    for missing_meshes in [MissingMeshes::Error, MissingMeshes::Skip] {
        match parse(text, "fuzz.sdf", &UrdfOptions { missing_meshes, ..UrdfOptions::default() }) {
            Err(error) => assert!(!error.report(false).is_empty()),
            Ok(scene) => {
                assert!(scene.articulated.iter().all(|body| !body.links.is_empty()));
                let earlier = |(k, parent): (usize, Option<usize>)| parent.is_none_or(|parent| parent < k);
                assert!(scene.articulated.iter().all(|body| body.links.iter().map(|link| link.parent).enumerate().all(earlier)));
            }
        }
    }
});

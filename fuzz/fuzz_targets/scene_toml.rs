//! The text of a scene file: parsed; if it is valid and small, built and stepped once.
#![no_main]

use libfuzzer_sys::fuzz_target;
use tumble_scene::SceneFile;

fuzz_target!(|text: &str| {
    match SceneFile::parse(text, "fuzz.toml") {
        Err(error) => assert!(!error.report(false).is_empty()),
        // files named in the text are not opened, and building stays cheap
        Ok(scene)
            if scene.bodies.len() <= 50
                && scene.meshes.iter().all(|m| m.source.file().is_none())
                && scene.meshes.is_empty() =>
        {
            if let Ok((mut world, _)) = scene.build() {
                let _ = world.step();
            }
        }
        Ok(_) => {}
    }
});

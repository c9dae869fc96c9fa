//! The pictures of docs/pictures.md: one of each overlay, `cargo run --release -p tumble-render
//! --example overlays -- FOLDER`.

use tumble_render::{DebugDraw, Drawing, Renderer};
use tumble_scene::shipped;

/// Overlay, scene, frames of the scene.
const PICTURES: [(&str, &str, u32); 8] = [
    ("contacts", "stack", 30),
    ("normals", "stack", 30),
    ("forces", "stack", 60),
    ("velocities", "billiards", 120),
    ("joints", "skeleton", 300),
    ("frames", "piston", 10),
    ("islands", "falling", 240),
    ("tree=3", "falling", 60),
];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = std::path::PathBuf::from(std::env::args().nth(1).ok_or("expected a folder for the pictures")?);
    let mut renderer = Renderer::new()?;
    for (overlay, name, frames) in PICTURES {
        let scene = shipped().iter().find(|s| s.name == name).ok_or(name)?.read()?;
        let (mut world, _) = scene.build()?;
        for _ in 0..frames {
            world.step()?;
        }
        let draw: DebugDraw = overlay.parse()?;
        let list = Drawing::new(&scene).list(&world, &draw)?;
        let path = folder.join(format!("overlay-{}.png", overlay.trim_end_matches("=3")));
        renderer.render(&list, 480, 300)?.write_png(&path)?;
        println!("{}", path.display());
    }
    Ok(())
}

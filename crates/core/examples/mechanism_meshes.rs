//! Writes the meshes of the scene `mechanism` as OBJ files in millimeters, rounded to 0.1 µm.
//!
//! `cargo run --release -p tumble-core --example mechanism_meshes -- scenes/mechanism`
//!
//! A worm of module 4 mm and its wheel of 30 teeth, a pinion of 20 teeth with a wheel and a rack, a screw of pitch 8 mm
//! and its nut. The tests of assemblies use the same generators.

#![allow(clippy::disallowed_methods, dead_code)] // the generators are those of the tests

#[path = "../tests/it/assemblies/gear.rs"]
pub(crate) mod gear;
#[path = "../tests/it/assemblies/thread.rs"]
pub(crate) mod thread;

use gear::Gear;
use std::error::Error;
use std::f64::consts::PI;
use std::fmt::Write;
use thread::Thread;
use tumble_core::collide::TriMesh;

const MODULE: f64 = 0.004;
/// Pitch radius of the worm, m.
const WORM: f64 = 5.0 * MODULE;

/// Returns names and meshes, m.
pub fn meshes() -> [(&'static str, TriMesh); 7] {
    let pinion = Gear { module: MODULE, teeth: 20, play: 0.0002, width: 0.016, points: 6 };
    let wheel = Gear { teeth: 30, width: 0.014, ..pinion };
    let worm_wheel = Gear { play: 0.0003, width: 0.012, ..wheel };
    // flanks of a quarter of the pitch at 20°, as those of a rack
    let depth = 0.25 * PI * MODULE / 20.0_f64.to_radians().tan();
    let (root, crest) = (WORM - 0.5 * depth, WORM + 0.5 * depth);
    let worm = Thread { pitch: PI * MODULE, root, crest, facets: 30, turns: 5 };
    let screw = Thread { pitch: 0.008, root: 0.010, crest: 0.013, facets: 36, turns: 14 };
    [
        ("worm", worm.bolt(0.8 * root)),
        ("worm_wheel", worm_wheel.twisted(MODULE / (2.0 * WORM) / worm_wheel.pitch_radius(), 2)),
        ("pinion", pinion.mesh()),
        ("wheel", wheel.mesh()),
        ("rack", gear::rack(&wheel, 14, 10)),
        ("screw", screw.bolt(0.9 * screw.root)),
        ("nut", Thread { turns: 1, ..screw }.nut(0.0002, 0.024)),
    ]
}

/// Returns a mesh as the text of an OBJ file, mm.
pub fn obj(mesh: &TriMesh) -> String {
    let mut text = String::new();
    for v in &mesh.vertices {
        // + 0.0: no negative zero
        let [x, y, z] = [v.x, v.y, v.z].map(|x| (x * 1e7).round() / 1e4 + 0.0);
        let _ = writeln!(text, "v {x} {y} {z}");
    }
    for [a, b, c] in &mesh.triangles {
        let _ = writeln!(text, "f {} {} {}", a + 1, b + 1, c + 1);
    }
    text
}

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args().nth(1).ok_or("the folder of the files is missing")?;
    for (name, mesh) in meshes() {
        let text = obj(&mesh);
        println!("{name}: {} triangles, {} kB", mesh.triangles.len(), text.len() / 1000);
        std::fs::write(std::path::Path::new(&folder).join(format!("{name}.obj")), text)?;
    }
    Ok(())
}

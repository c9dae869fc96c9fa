//! Pictures of all shipped scenes, and of one cave, against golden pictures that were inspected.
//! There is one set per interface (Vulkan, OpenGL), because they differ at edges.
//! `TUMBLE_KEEP_PICTURES=1` writes them again (`make goldens`, and `VK_ICD_FILENAMES=/none make
//! goldens` for OpenGL); they are inspected before they are committed.
//!
//! The measure: pictures are reduced 4 times in linear light, which tolerates a pixel's edge. They
//! may then differ by [`MEAN_LEVELS`] on average and by [`MAX_LEVELS`] anywhere.

use crate::support::renderer;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};
use tumble_render::{CaveView, DebugDraw, Drawing, Image, Renderer};
use tumble_scene::cave::resolve_cave;

const SIZE: [u32; 2] = [192, 108];
const MEAN_LEVELS: f64 = 1.0;
const MAX_LEVELS: f64 = 24.0;
/// The frame of a scene that is compared.
const FRAMES: u64 = 24;

fn pictures(renderer: &mut Renderer, only: Option<&str>) -> Vec<(String, Image)> {
    let mut out = Vec::new();
    for shipped in tumble_scene::shipped().iter().filter(|s| only.is_none_or(|name| s.name == name)) {
        let scene = shipped.read().unwrap();
        let (mut world, _) = scene.build().unwrap();
        (0..FRAMES).for_each(|_| {
            world.step().unwrap();
        });
        let list = Drawing::new(&scene).list(&world, &DebugDraw::default()).unwrap();
        out.push((shipped.name.to_owned(), renderer.render(&list, SIZE[0], SIZE[1]).unwrap()));
        if shipped.name == "billiards" {
            let cave = CaveView::new(resolve_cave("cube4").unwrap().load().unwrap(), &scene).unwrap();
            out.push(("billiards-cube4".to_owned(), cave.draw_unfolded(renderer, &list, SIZE).unwrap()));
        }
    }
    out
}

/// Mean light of blocks of 4 x 4 pixels, as levels of 0 to 255 in the curve of sRGB.
fn small(image: &Image) -> Vec<f64> {
    let linear = |c: u8| (f64::from(c) / 255.0).powf(2.2);
    let block = |x: u32, y: u32, k: usize| {
        (0..16).filter_map(|i| image.pixel(4 * x + i % 4, 4 * y + i / 4)).map(|p| linear(p[k])).sum::<f64>() / 16.0
    };
    let blocks = (0..image.height / 4).flat_map(|y| (0..image.width / 4).map(move |x| (x, y)));
    blocks.flat_map(|(x, y)| [0, 1, 2].map(|k| 255.0 * block(x, y, k).powf(1.0 / 2.2))).collect()
}

#[test]
fn pictures_of_shipped_scenes_are_those_that_were_looked_at() {
    compare(None);
}

/// Draws one scene if the environment variable names it; the test below starts it as a process.
#[test]
#[ignore = "a child of the test below"]
fn child_draws_one_scene() {
    if let Some(renderer) = renderer() {
        println!("drawn by {}", renderer.adapter());
        compare(Some("stack"));
    }
}

/// Without a Vulkan driver OpenGL draws, and the result looks the same.
#[test]
fn without_vulkan_opengl_draws() {
    if renderer().is_none() {
        return;
    }
    let none = std::env::temp_dir().join("there-is-no-driver-here.json");
    let mut child = Command::new(std::env::current_exe().unwrap());
    child
        .args(["--exact", "--ignored", "--nocapture", "goldens::child_draws_one_scene"])
        .env("VK_DRIVER_FILES", &none)
        .env("VK_ICD_FILENAMES", &none);
    let mut child =
        child.env_remove("TUMBLE_KEEP_PICTURES").stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let begin = Instant::now();
    while child.try_wait().unwrap().is_none() && begin.elapsed() < Duration::from_secs(300) {
        std::thread::sleep(Duration::from_millis(50));
    }
    let _ = child.kill(); // it has ended, or hangs
    let output = child.wait_with_output().unwrap();
    let said = [output.stdout, output.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).concat();
    if said.contains("SKIPPED: no graphics adapter") {
        // past the harness, which keeps what passing tests print
        let _ = std::io::Write::write_fmt(&mut std::io::stderr(), format_args!("\nSKIPPED: no OpenGL\n"));
        return;
    }
    assert!(output.status.success() && said.contains("Gl)"), "{said}");
}

/// Compares pictures of all scenes, or of one, with the golden ones.
fn compare(only: Option<&str>) {
    let Some(mut renderer) = renderer() else { return };
    let interface = if renderer.adapter().contains("Gl)") { "opengl" } else { "vulkan" };
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/goldens").join(interface);
    let keep = std::env::var_os("TUMBLE_KEEP_PICTURES").is_some();
    if !keep && !folder.is_dir() {
        // past the harness, which keeps what passing tests print
        let _ = std::io::Write::write_fmt(
            &mut std::io::stderr(),
            format_args!("\nSKIPPED: no pictures are kept for {interface}\n"),
        );
        return;
    }
    let mut wrong = Vec::new();
    for (name, image) in pictures(&mut renderer, only) {
        let path = folder.join(format!("{name}.png"));
        if keep {
            std::fs::create_dir_all(&folder).unwrap();
            image.write_png(&path).unwrap();
            continue;
        }
        let kept = Image::read_png(&path).unwrap_or_else(|e| panic!("{e}; `make goldens` writes it"));
        assert_eq!((image.width, image.height), (kept.width, kept.height), "{name}");
        let (a, b) = (small(&image), small(&kept));
        let off: Vec<f64> = a.iter().zip(&b).map(|(a, b)| (a - b).abs()).collect();
        let (mean, most) = (off.iter().sum::<f64>() / off.len() as f64, off.iter().copied().fold(0.0, f64::max));
        if mean > MEAN_LEVELS || most > MAX_LEVELS {
            let seen = std::env::temp_dir().join(format!("tumble-{name}.png"));
            image.write_png(&seen).unwrap();
            wrong.push(format!(
                "{name}: {mean:.2} levels off on the average, {most:.1} at most; it is in {}",
                seen.display()
            ));
        }
    }
    assert!(wrong.is_empty(), "{}\nif that is meant: `make goldens`", wrong.join("\n"));
}

#[test]
fn the_measure_sees_what_moved() {
    let square = |from: u32| Image {
        width: 64,
        height: 64,
        rgba: (0..64 * 64u32)
            .flat_map(|i| {
                if (from..from + 16).contains(&(i % 64)) && i / 64 < 16 {
                    [200, 200, 200, 255]
                } else {
                    [60, 60, 60, 255]
                }
            })
            .collect(),
    };
    let most = |a: &Image, b: &Image| small(a).iter().zip(small(b)).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(most(&square(8), &square(8)) == 0.0 && most(&square(8), &square(12)) > MAX_LEVELS);
}

//! `tumble calibrate`: files in and out. The accuracy is tested in `tumble-calibrate`.

use crate::common::*;
use std::path::Path;

const CAVE: &str = "[[user]]\nname = \"viewer\"\neye_m = [0, 0, 1]\n[[screen]]\nname = \"wall\"\nlower_left_m = [-0.8, 2, 0]\nlower_right_m = [0.8, 2, 0]\nupper_left_m = [-0.8, 2, 1.2]\n[[facet]]\nname = \"wall\"\nscreen = \"wall\"\nsize_px = [160, 120]\n";

fn marks(pixels: [[f64; 2]; 4]) -> String {
    let points = [[-0.8, 2.0, 0.0], [0.8, 2.0, 0.0], [-0.8, 2.0, 1.2], [0.8, 2.0, 1.2]];
    let mark = |(point, pixel): ([f64; 3], [f64; 2])| {
        format!("[[mark]]\nview = \"seat\"\npoint_m = {point:?}\npixel = {pixel:?}\nsigma_px = 0.1\n")
    };
    points.into_iter().zip(pixels).map(mark).collect()
}

/// Photographs with 0.8 of the light of the pictures; a camera's white must not be clipped.
fn photograph(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).unwrap();
    for file in std::fs::read_dir(from).unwrap() {
        let file = file.unwrap();
        let mut image = tumble::render::Image::read_png(file.path()).unwrap();
        image.rgba.chunks_exact_mut(4).for_each(|p| (0..3).for_each(|k| p[k] = (0.8 * f64::from(p[k])) as u8));
        image.write_png(to.join(file.file_name())).unwrap();
    }
}

/// A camera that sees exactly the projector's picture takes photographs that are the patterns.
#[test]
fn patterns_as_photographs_give_a_warp_that_changes_nothing() {
    let folder = Folder::new("calibrate");
    let cave = folder.write("wall.toml", CAVE);
    let patterns = text(&folder.path("patterns"));
    let said = succeed(&["calibrate", "patterns", &cave, "--output", &patterns]);
    // 20 and 15 stripes of 8 pixels: 5 and 4 bits with their inverses, 6 shifts each, white and black
    assert!(said.contains("photograph 32 pictures"), "{said}");
    photograph(&folder.path("patterns/wall"), &folder.path("photos/seat/wall"));
    let wanted = marks([[0.0, 120.0], [160.0, 120.0], [0.0, 0.0], [160.0, 0.0]]);
    let file = folder.write("marks.toml", &wanted);
    let (photos, out) = (text(&folder.path("photos")), text(&folder.path("new")));
    let solve = |marks: &str, out: &str| {
        ["calibrate", "solve", &cave, "--photos", &photos, "--marks", marks, "--output", out, "--eye", "seat"]
            .map(str::to_owned)
    };
    let run = |args: &[String], code: i32| match code {
        0 => succeed(&args.iter().map(String::as_str).collect::<Vec<_>>()),
        code => fail(&args.iter().map(String::as_str).collect::<Vec<_>>(), code),
    };
    let said = run(&solve(&file, &out), 0);
    assert!(said.contains("\"wall\" lights ") && said.contains("view \"seat\": camera at"), "{said}");
    let checked = succeed(&["check", &text(&folder.path("new/cave.toml"))]);
    assert!(checked.contains("a cave of 1 facet on 1 screen"), "{checked}");
    let warp = tumble::render::Pfm::parse(&std::fs::read(folder.path("new/wall_warp.pfm")).unwrap()).unwrap();
    let [w, h] = warp.size;
    for (i, [u, v, _]) in warp.values.iter().enumerate() {
        let (x, y) = ((i % w) as f32 / (w - 1) as f32, (i / w) as f32 / (h - 1) as f32);
        let off = (160.0 * (u - x)).hypot(120.0 * (v - y));
        assert!(off < 0.3, "{i}: {u} {v}, {x} {y}");
    }
    // errors with their place
    assert!(run(&solve(&file, &out), 2).contains("cave.toml: exists already; --overwrite replaces it"));
    let again = ["calibrate", "patterns", &cave, "--output", &patterns];
    assert!(fail(&again, 2).contains(".png: exists already; --overwrite replaces it"));
    succeed(&[&again[..], &["--overwrite"]].concat());
    run(&[&solve(&file, &out)[..], &["--overwrite".into()]].concat(), 0);
    let three = folder.write("three.toml", &wanted[..wanted.len() * 3 / 4 - 10]);
    let said = run(&solve(&three, &text(&folder.path("b"))), 2);
    assert!(said.contains("three.toml:"), "{said}");
    std::fs::remove_file(folder.path("photos/seat/wall/07_x_bit2_inverse.png")).unwrap();
    let said = run(&solve(&file, &text(&folder.path("b"))), 2);
    assert!(said.contains("has 31 photographs, expected 32"), "{said}");
    std::fs::write(folder.path("photos/seat/wall/07_x_bit2_inverse.png"), b"no picture").unwrap();
    let said = run(&solve(&file, &text(&folder.path("b"))), 2);
    assert!(said.contains("07_x_bit2_inverse.png: is no PNG and no JPEG file"), "{said}");
    photograph(&folder.path("patterns/wall"), &folder.path("bright/seat/wall"));
    std::fs::copy(folder.path("patterns/wall/00_white.png"), folder.path("bright/seat/wall/00_white.png")).unwrap();
    let said = fail(
        &[
            "calibrate",
            "solve",
            &cave,
            "--photos",
            &text(&folder.path("bright")),
            "--marks",
            &file,
            "--output",
            &text(&folder.path("b")),
        ],
        2,
    );
    assert!(said.contains("none of its photographs shows a projector: too dark, clipped"), "{said}");
    assert!(!folder.path("b").exists());
}

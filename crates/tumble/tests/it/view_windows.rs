//! Pictures in the windows of `tumble view` against those of `tumble run`, and the end of windows.

use crate::common::*;
use crate::desktop::{Desktop, Session};
use std::process::Command;
use tumble::render::Image;

#[test]
fn a_window_shows_the_picture_that_run_takes() {
    let Some(desktop) = Desktop::open() else { return };
    let Some(mut view) = Session::open(
        &desktop,
        "view-picture",
        &["bowling", "--size", "160x90", "--quality", "default", "--no-hud", "--paused"],
    ) else {
        return;
    };
    for n in 1..=12 {
        view.key("period");
        view.until("a step", |s| s["frame"] == n);
    }
    let picture = view.folder.path("run.png");
    succeed(&["run", "bowling", "--quiet", "--duration", "0.05", "--size", "160x90", "--screenshot", &text(&picture)]);
    let image = tumble::render::Image::read_png(&picture).unwrap();
    view.comes_to_show(&image);
    let bright = image.rgba.chunks_exact(4).map(|p| u64::from(p[1])).collect::<Vec<_>>();
    assert!(bright.iter().max() > bright.iter().min().map(|m| m + 60).as_ref(), "the picture shows nothing");
}

/// A facet whose projector is at an angle: a grid that warps and leaves a corner black, a mask that
/// darkens one side.
fn bent(folder: &Folder) -> String {
    let at = |k: u32| f64::from(k) / 4.0;
    let mut grid = String::new();
    for (x, y) in (0..5).flat_map(|y| (0..5).map(move |x| (at(x), at(y)))) {
        grid += &format!("v {x} {y}\nvt {} {}\n", 0.1 + 0.8 * x + 0.05 * y, 0.05 + 0.9 * y * (1.0 - 0.1 * x));
    }
    for first in (0..4).flat_map(|y| (0..4).map(move |x| 5 * y + x + 1)).skip(1) {
        grid += &[first, first + 1, first + 6, first + 5]
            .map(|i| format!(" {i}/{i}"))
            .iter()
            .fold("f".to_string(), |face, corner| face + corner);
        grid += "\n";
    }
    folder.write("warp.obj", grid);
    let mask = Image {
        width: 120,
        height: 90,
        rgba: (0..120 * 90u32)
            .flat_map(|i| [(255 - i % 120) as u8, 255, (140 + i % 120).min(255) as u8, 255])
            .collect(),
    };
    mask.write_png(folder.path("mask.png")).unwrap();
    "warp_file = \"warp.obj\"\nblend_file = \"mask.png\"\n".to_string()
}

/// Stereo, mirroring, warp and blend appear in the window as in the file, and so do all facets
/// unfolded.
#[test]
fn facets_and_unfolded_caves_show_what_run_takes() {
    let Some(desktop) = Desktop::open() else { return };
    let folder = Folder::new("view-cave");
    let facet = |name: &str, size: &str, keys: &str| folder.write(name, cave(&format!("size_px = {size}\n{keys}")));
    let mirrored = facet("a.toml", "[120, 90]", "stereo = \"anaglyph\"\nflip = \"horizontal\"\n");
    let beside = facet("b.toml", "[120, 90]", "stereo = \"side_by_side\"\nflip = \"vertical\"\n");
    let warped = facet("c.toml", "[120, 90]", &bent(&folder));
    let both = facet("d.toml", "[120, 90]", &format!("stereo = \"top_bottom\"\nflip = \"both\"\n{}", bent(&folder)));
    let cases: [(&str, &[&str], [u32; 2]); 6] = [
        (&mirrored, &["--facet", "f"], [120, 90]),
        (&beside, &["--facet", "f"], [240, 90]),
        (&warped, &["--facet", "f"], [120, 90]),
        (&both, &["--facet", "f"], [120, 180]),
        ("cube4", &["--size", "150x100"], [150, 100]),
        ("wall3", &["--size", "150x100", "--preview"], [150, 38]),
    ];
    let mut pictures = Vec::new();
    for (cave, more, size) in cases {
        let args = [&["stack", "--cave", cave], more].concat();
        let Some(view) = Session::open(
            &desktop,
            "view-cave-status",
            &[&args[..], &["--quality", "default", "--no-hud", "--paused"]].concat(),
        ) else {
            return;
        };
        let picture = view.folder.path("run.png");
        let run: Vec<&str> = args.into_iter().filter(|word| *word != "--preview").collect();
        succeed(&[&["run"], &run[..], &["--quiet", "--duration", "0", "--screenshot", &text(&picture)]].concat());
        let image = Image::read_png(&picture).unwrap();
        assert_eq!([image.width, image.height], size, "{cave}");
        view.comes_to_show(&image);
        pictures.push(image);
    }
    // the grid leaves its first corner black, and the mask takes red on the right and blue on the
    // left; a plain facet has neither
    let sum = |image: &Image, channel: usize, from: u32, to: u32| {
        (0..90)
            .flat_map(|y| (from..to).map(move |x| (x, y)))
            .map(|(x, y)| u64::from(image.pixel(x, y).unwrap()[channel]))
            .sum::<u64>()
    };
    let plain = &pictures[1];
    let share = |channel: usize, from: u32, to: u32| {
        sum(&pictures[2], channel, from, to) as f64 / sum(plain, channel, from, to) as f64
    };
    assert!(
        pictures[2].pixel(2, 87) == Some([0, 0, 0, 255]) && plain.pixel(2, 2) != Some([0, 0, 0, 255]),
        "{:?}",
        pictures[2].pixel(2, 87)
    );
    // the mask leaves 155/255 of the red light there and 205/255 here: in sRGB bytes
    // (155/205)^(1/2.4) = 0.89 of it on gray parts of the picture
    assert!((share(0, 90, 110) / share(0, 40, 60) - 0.89).abs() < 0.04, "{} {}", share(0, 90, 110), share(0, 40, 60));
}

#[test]
fn windows_that_end_end_well() {
    let Some(desktop) = Desktop::open() else { return };
    let args = ["stack", "--size", "64x48"];
    let Some(mut view) = Session::open(&desktop, "view-close", &args) else { return };
    view.ask_to_close();
    assert_eq!(view.end(), (Some(0), String::new()), "closed");
    let mut view =
        Session::spawn(&desktop, Folder::new("view-frames"), &[&args[..], &["--frames", "3", "--paused"]].concat());
    assert_eq!(view.end(), (Some(0), String::new()));
    assert_eq!(view.status().unwrap()["shown"], 3);
    // without its X server a window ends too, with a message of the X library
    let Some(mut view) = Session::open(&desktop, "view-lost", &args) else { return };
    assert!(Command::new("kill").arg(desktop.server.0.id().to_string()).status().unwrap().success());
    let (code, said) = view.end();
    assert!(code == Some(1) && said.contains("X "), "{code:?}: {said}");
}

#[test]
fn a_display_that_does_not_answer_is_named() {
    for (variable, value) in [("DISPLAY", ":987"), ("DISPLAY", "nonsense"), ("WAYLAND_DISPLAY", "wayland-987")] {
        let mut command = command(&["view", "stack"]);
        let out = command
            .env_remove("DISPLAY")
            .env_remove("WAYLAND_DISPLAY")
            .env_remove("WAYLAND_SOCKET")
            .env(variable, value)
            .output()
            .unwrap();
        let said = String::from_utf8(out.stderr).unwrap();
        assert_eq!((out.status.code(), said.lines().count()), (Some(1), 1), "{said}");
        assert!(
            said.starts_with("error: ")
                && said.contains(&format!("{variable}={value}"))
                && said.contains("--screenshot"),
            "{said}"
        );
    }
}

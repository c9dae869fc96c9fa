//! Caves on the command line: lists, checks, facets, frames, videos, and errors.

use crate::common::*;
use std::process::Command;

fn small() -> String {
    cave("size_px = [80, 60]")
}

/// Returns whether there is an adapter; without one the test prints that it is skipped.
fn pictured(said: &str) -> bool {
    if said.contains("no picture:") {
        // directly to the terminal: the harness hides the output of passing tests
        let _ = std::io::Write::write_fmt(
            &mut std::io::stderr(),
            format_args!("\nSKIPPED: this machine has no graphics adapter; {said}\n"),
        );
        return false;
    }
    true
}

/// Width and height of a PNG.
fn png_size(path: &std::path::Path) -> [u32; 2] {
    let bytes = std::fs::read(path).unwrap();
    assert_eq!(bytes[..8], *b"\x89PNG\r\n\x1a\n");
    [16, 20].map(|at| u32::from_be_bytes(bytes[at..at + 4].try_into().unwrap()))
}

#[test]
fn shipped_caves_are_listed_and_checked() {
    let said = succeed(&["caves"]);
    for name in ["wall3", "cube4", "cube6", "cylinder5", "sphere5"] {
        assert!(said.lines().any(|line| line.starts_with(name)), "{said}");
    }
    let said = succeed(&["check", "cube4", "caves/sphere5.toml", "billiards"]);
    assert!(said.contains("cube4: a cave of 4 facets on 4 screens, 1 user, all on this machine"), "{said}");
    assert!(said.contains("right edge of \"front\" and left edge of \"right\": 0.000 mm apart"), "{said}");
    assert!(
        said.contains("caves/sphere5.toml: a cave of 5 facets") && said.contains("billiards: a scene of"),
        "{said}"
    );
}

#[test]
fn a_file_is_checked_as_what_it_is() {
    let folder = Folder::new("cave-check");
    let cave = folder.write("wall.toml", small());
    assert!(succeed(&["check", &cave]).contains("a cave of 1 facet on 1 screen"));
    let wrong = folder.write("wrong.toml", small().replace("eye_m", "eye"));
    let said = fail(&["check", &wrong], 2);
    assert!(said.contains("wrong.toml:3:1") && said.contains("did you mean `eye_m`?"), "{said}");
}

/// The check reports faults that would stop facets and server, with the facet's name.
#[test]
fn a_check_reads_the_files_that_caves_and_scenes_name() {
    let folder = Folder::new("cave-files");
    let with = |lines: &str| folder.write("wall.toml", cave(&format!("size_px = [80, 60]\n{lines}")));
    for (lines, word) in [
        ("warp_file = \"none.obj\"", "facet \"f\""),
        ("blend_file = \"none.png\"", "none.png: the blend mask cannot be read"),
        ("[security]\nkey_file = \"none.key\"", "none.key"),
    ] {
        let said = fail(&["check", &with(lines)], 2);
        assert!(said.contains(word) && said.contains("wall.toml"), "{lines}: {said}");
    }
    folder.write("pixels.obj", "v 0 0\nv 480 320\n");
    assert!(fail(&["check", &with("warp_file = \"pixels.obj\"")], 2).contains("line 2: expected `v x y`"));
    folder.write("damaged.png", b"\x89PNG\r\n\x1a\nand no more");
    let look = "[[body]]\nname = \"b\"\nshape = { type = \"sphere\", radius_m = 0.5 }\nmass_kg = 1\ntexture = \"damaged.png\"\n";
    let said = fail(&["check", &folder.write("textured.toml", look)], 2);
    assert!(said.contains("textured.toml") && said.contains("damaged.png: the texture is no PNG"), "{said}");
    // no scene and no cave has the name: the message names both
    let said = fail(&["check", "cube5"], 2);
    assert!(said.contains("no scene `cube5`") && said.contains("did you mean `cube4`?"), "{said}");
}

#[test]
fn a_picture_with_another_ending_is_refused() {
    for args in [
        &["run", "stack", "--screenshot", "q.jpg"][..],
        &["view", "stack", "--screenshot", "q.jpg"],
        &["caves", "--pattern", "grid", "--cave", "cube4", "--facet", "front", "--screenshot", "q.jpg"],
    ] {
        assert!(fail_often(args, 2).contains("expected a file that ends in .png"), "{args:?}");
    }
}

#[test]
fn what_is_wrong_with_a_cave_ends_with_code_2_before_anything_runs() {
    let folder = Folder::new("cave-wrong");
    let picture = text(&folder.path("out.png"));
    let run = |more: &[&str]| fail(&[&["run", "stack", "--quiet", "--duration", "1000"], more].concat(), 2);
    assert!(run(&["--cave", "cube4", "--facet", "fronts", "--screenshot", &picture]).contains("did you mean `front`?"));
    assert!(run(&["--cave", "cube5", "--screenshot", &picture]).contains("no cave `cube5`"));
    assert!(run(&["--cave", "/nowhere/a.toml", "--screenshot", &picture]).contains("cannot read the cave"));
    assert!(run(&["--facet", "front", "--screenshot", &picture]).contains("--cave FILE"));
    assert!(run(&["--cave", "cube4"]).contains("--screenshot FILE"));
    assert!(
        run(&["--cave", "cube4", "--facet", "front", "--size", "80x60", "--screenshot", &picture]).contains("size_px")
    );
    let with = |line: &str| folder.write("a.toml", cave(&format!("size_px = [80, 60]\n{line}")));
    assert!(
        run(&["--cave", &with("warp_file = \"none.obj\""), "--screenshot", &picture])
            .contains("none.obj: the warp grid cannot be read")
    );
    assert!(
        run(&["--cave", &with("blend_file = \"none.png\""), "--screenshot", &picture])
            .contains("none.png: the blend mask cannot be read")
    );
    folder.write("bad.obj", "v 0 0\nv 1 x\n");
    assert!(run(&["--cave", &with("warp_file = \"bad.obj\""), "--screenshot", &picture]).contains("bad.obj: line 2"));
    let empty = folder.write("b.toml", cave("size_px = [80, 0]"));
    assert!(run(&["--cave", &empty, "--screenshot", &picture]).contains("from 1 to 16384"));
    assert!(!folder.path("out.png").exists());
    assert!(
        fail(&["caves", "--pattern", "grid", "--cave", "cube4", "--facet", "fron", "--screenshot", &picture], 2)
            .contains("did you mean `front`?")
    );
    assert!(fail(&["caves", "--pattern", "grid"], 2).contains("--cave"));
}

/// Facets have poses and contacts; overlays that need the simulation are refused.
#[test]
fn an_overlay_that_a_facet_cannot_draw_is_refused() {
    for word in ["velocities", "contacts,islands", "sleep"] {
        let said = fail(&["cave", "stack", "--cave", "cube4", "--debug-draw", word], 2);
        assert!(said.contains("a facet of a cave cannot draw") && said.contains("frames"), "{said}");
    }
    let said = fail(&["cave", "stack", "--cave", "cube4", "--debug-draw", "smoke"], 2);
    assert!(said.contains("no overlay 'smoke'"), "{said}");
}

#[test]
fn facets_have_their_size_and_unfolded_caves_fit() {
    let folder = Folder::new("cave-pictures");
    let picture = folder.path("out.png");
    let stereo = folder.write("a.toml", cave("stereo = \"side_by_side\"\nsize_px = [80, 60]"));
    for (cave, more, size) in
        [(stereo.as_str(), vec!["--facet", "f"], [160, 60]), ("cube6", vec!["--size", "200x200"], [200, 150])]
    {
        let out = tumble(
            &[
                &["run", "stack", "--quiet", "--duration", "0", "--cave", cave, "--screenshot", &text(&picture)],
                &more[..],
            ]
            .concat(),
        );
        let said = String::from_utf8(out.stderr).unwrap();
        assert!(out.status.success(), "{said}");
        if !pictured(&said) {
            return;
        }
        assert_eq!(png_size(&picture), size, "{cave}");
    }
    succeed(&["caves", "--pattern", "name", "--cave", &stereo, "--facet", "f", "--screenshot", &text(&picture)]);
    assert_eq!(png_size(&picture), [160, 60]);
}

#[test]
fn frames_come_at_an_even_pace_of_simulated_time() {
    let folder = Folder::new("frames");
    let out = tumble(&[
        "run",
        "incline",
        "--quiet",
        "--duration",
        "0.25",
        "--size",
        "32x24",
        "--fps",
        "20",
        "--frames-dir",
        &text(&folder.path("frames")),
    ]);
    let said = String::from_utf8(out.stderr).unwrap();
    assert!(out.status.success(), "{said}");
    if pictured(&said) {
        // at 0, 0.05, … 0.25 s
        let mut names: Vec<String> = std::fs::read_dir(folder.path("frames"))
            .unwrap()
            .map(|e| e.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        assert_eq!(names, (0..6).map(|k| format!("frame_{k:06}.png")).collect::<Vec<_>>());
        assert!(names.iter().all(|name| png_size(&folder.path("frames").join(name)) == [32, 24]));
    }
}

/// Runs the command with a script as `ffmpeg`.
#[cfg(unix)]
fn with_ffmpeg(folder: &Folder, script: Option<&str>) -> (Option<i32>, String) {
    use std::os::unix::fs::PermissionsExt;
    let bin = folder.path("bin");
    std::fs::create_dir_all(&bin).unwrap();
    let path = match script {
        Some(script) => {
            let program = bin.join("ffmpeg");
            std::fs::write(&program, script).unwrap();
            std::fs::set_permissions(&program, std::fs::Permissions::from_mode(0o755)).unwrap();
            format!("{}:/usr/bin:/bin", bin.display())
        }
        None => text(&bin),
    };
    let mut command: Command = command(&[
        "run",
        "incline",
        "--quiet",
        "--duration",
        "0.2",
        "--size",
        "31x24",
        "--fps",
        "20",
        "--video",
        &text(&folder.path("out.mp4")),
    ]);
    let out = command.env("PATH", path).output().unwrap();
    (out.status.code(), String::from_utf8(out.stderr).unwrap())
}

#[cfg(unix)]
#[test]
fn a_video_gets_every_frame_and_its_failures_are_reported() {
    let folder = Folder::new("video");
    let (code, said) = with_ffmpeg(&folder, None);
    assert!(
        code == Some(1) && said.contains("there is no ffmpeg") && said.contains("apt-get install ffmpeg"),
        "{said}"
    );
    // a script that keeps the raw frames; the path is its last argument
    let keeps = "#!/bin/sh\n[ \"$1\" = -version ] && exit 0\nfor last; do :; done\nexec cat > \"$last\"\n";
    let (code, said) = with_ffmpeg(&folder, Some(keeps));
    assert_eq!(code, Some(0), "{said}");
    if !pictured(&said) {
        return;
    }
    assert_eq!(std::fs::read(folder.path("out.mp4")).unwrap().len(), 5 * 31 * 24 * 4);
    // a script that reads a little and fails with a message
    let fails = "#!/bin/sh\n[ \"$1\" = -version ] && exit 0\nhead -c 100 > /dev/null\necho 'Unknown encoder quux' >&2\nexit 3\n";
    let (code, said) = with_ffmpeg(&folder, Some(fails));
    assert!(code == Some(1) && said.contains("Unknown encoder quux"), "{said}");
}

/// With the real program: the video has as many frames as were sent, and its last frame matches the
/// screenshot, as far as compression allows.
#[test]
fn a_video_plays_the_run() {
    let out = Command::new("ffmpeg").arg("-version").output();
    if !out.is_ok_and(|out| out.status.success()) {
        let _ = std::io::Write::write_fmt(
            &mut std::io::stderr(),
            format_args!("\nSKIPPED: there is no ffmpeg; on Debian: apt-get install ffmpeg\n"),
        );
        return;
    }
    let folder = Folder::new("video-real");
    let (video, picture) = (text(&folder.path("out.mp4")), folder.path("out.png"));
    let args = [
        "run",
        "incline",
        "--quiet",
        "--duration",
        "0.2",
        "--size",
        "161x120",
        "--fps",
        "20",
        "--video",
        &video,
        "--screenshot",
        &text(&picture),
    ];
    let out = tumble(&args);
    let said = String::from_utf8(out.stderr).unwrap();
    assert!(out.status.success(), "{said}");
    if !pictured(&said) {
        return;
    }
    let raw = Command::new("ffmpeg")
        .args(["-v", "error", "-i", &video, "-f", "rawvideo", "-pix_fmt", "rgb24", "-"])
        .output()
        .unwrap();
    // sides are rounded up to even numbers
    let (width, height) = (162, 120);
    assert_eq!(raw.stdout.len(), 5 * width * height * 3, "{}", String::from_utf8_lossy(&raw.stderr));
    let last = &raw.stdout[4 * width * height * 3..];
    let image = tumble::render::Image::read_png(&picture).unwrap();
    let pixels = (0..120u32).flat_map(|y| (0..161u32).map(move |x| (x, y)));
    let off: u64 = pixels
        .map(|(x, y)| {
            let (seen, sent) = (&last[3 * (y as usize * width + x as usize)..], image.pixel(x, y).unwrap());
            (0..3).map(|k| u64::from(seen[k].abs_diff(sent[k]))).sum::<u64>()
        })
        .sum();
    let mean = off as f64 / (161.0 * 120.0 * 3.0);
    let first = &raw.stdout[..width * height * 3];
    let moved: u64 = first.iter().zip(last).map(|(a, b)| u64::from(a.abs_diff(*b))).sum();
    assert!(mean < 6.0, "off by {mean} levels on average");
    assert!(moved as f64 / last.len() as f64 > 0.2, "nothing moves in it");
}

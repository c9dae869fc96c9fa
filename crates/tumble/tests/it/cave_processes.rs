//! `tumble cave`, `tumble serve` and `tumble facet` as processes: frames, locks, refusals, ends.

use crate::cave_place::*;
use crate::common::*;
use rustix::process::Signal;

/// The number in a stamped picture: 64 squares in two rows of 32, the highest bit first.
fn stamped(image: &tumble::render::Image) -> u64 {
    let side = (image.width / 64).max(2);
    (0..64).fold(0, |number, k| {
        let [r, g, b, _] = image.pixel(k % 32 * side + side / 2, k / 32 * side + side / 2).unwrap();
        assert!([r, g, b] == [255; 3] || [r, g, b] == [0; 3], "bit {k} is {r} {g} {b}");
        number << 1 | u64::from(r == 255)
    })
}

/// Five processes in lockstep: each facet shows each frame once and in order, with the same states,
/// and the pictures are those of the frames that they name.
fn all_facets_show_the_same_frames(test: &str, frames: u64) {
    let place = Place::new(test, &cube());
    let seconds = (frames as f64 * 0.01).to_string();
    let (code, _, wrong) = place
        .start(
            "cave",
            &[
                "--duration",
                &seconds,
                "--no-realtime",
                "--quality",
                "default",
                "--burn-in",
                "--frames-dir",
                &place.path("out"),
                "--summary",
                &place.path("summary.json"),
            ],
        )
        .end();
    if wrong.contains("no graphics adapter") || wrong.contains("no Vulkan driver") {
        let _ = std::io::Write::write_fmt(
            &mut std::io::stderr(),
            format_args!("\nSKIPPED: this machine has no graphics adapter; {wrong}\n"),
        );
        return;
    }
    assert_eq!(code, Some(0), "{wrong}");
    let front = place.log("out", "front");
    for facet in ["front", "left", "right", "floor"] {
        let log = place.log("out", facet);
        assert_eq!(numbers(&log), (0..=frames).collect::<Vec<_>>(), "{facet}");
        assert_eq!(states(&log), states(&front), "{facet}");
        for line in &log {
            let frame = line["frame"].as_u64().unwrap();
            let image = tumble::render::Image::read_png(
                place.folder.path("out").join(facet).join(format!("frame_{frame:06}.png")),
            )
            .unwrap();
            assert_eq!(stamped(&image), frame, "{facet}");
            assert_eq!(&blake3::hash(&image.rgba).to_hex()[..32], line["image"].as_str().unwrap(), "{facet} {frame}");
        }
    }
    // a world that moves has another state in each frame
    let mut different = states(&front);
    different.dedup();
    assert_eq!(different.len() as u64, frames + 1);
    let summary = json(&place.folder.path("summary.json"));
    for facet in summary["facets"].as_array().unwrap() {
        for zero in ["late", "missing", "torn", "mismatched", "dropped", "refused"] {
            assert_eq!(facet[zero], 0, "{zero} of {facet}");
        }
        assert_eq!(facet["presented"], frames + 1);
    }
    // the same picture as without a cave, below the stamp
    let alone = place.path("alone.png");
    succeed(&[
        "run",
        &place.scene,
        "--cave",
        &place.cave,
        "--facet",
        "left",
        "--duration",
        &seconds,
        "--screenshot",
        &alone,
        "--quiet",
    ]);
    let alone = tumble::render::Image::read_png(&alone).unwrap();
    let ours =
        tumble::render::Image::read_png(place.folder.path("out").join("left").join(format!("frame_{frames:06}.png")))
            .unwrap();
    let below = 4 * 80 * 24;
    let worst = alone.rgba[below..].iter().zip(&ours.rgba[below..]).map(|(a, b)| a.abs_diff(*b)).max();
    // poses are sent in steps of 1/65536 m
    let differing = alone.rgba[below..].iter().zip(&ours.rgba[below..]).filter(|(a, b)| a.abs_diff(**b) > 2).count();
    assert!(differing < 60, "{differing} of {} values differ, at most by {worst:?}", ours.rgba.len() - below);
    place.assert_clean();
}

#[test]
fn thirty_frames_are_the_same_on_four_facets() {
    all_facets_show_the_same_frames("cave-frames", 30);
}

#[test]
fn full_length_600_frames_are_the_same_on_four_facets() {
    if std::env::var_os("TUMBLE_SLOW").is_some() {
        all_facets_show_the_same_frames("cave-600", 600);
    }
}

#[test]
fn datagrams_carry_the_same_states_as_shared_memory() {
    let place = Place::new("cave-udp", &cube());
    for (transport, folder) in [("udp", "a"), ("shared_memory", "b")] {
        let summary = place.succeed(
            "cave",
            &[
                "--duration",
                "0.4",
                "--no-realtime",
                "--no-pictures",
                "--log-dir",
                &place.path(folder),
                "--transport",
                transport,
            ],
        );
        assert_eq!(summary["frames"], 41);
        assert_eq!(summary["transport"].as_str().unwrap().replace(' ', "_"), transport);
        assert_eq!(
            summary["unknown_peers"],
            serde_json::json!({}),
            "late packets of facets that left are no strangers'"
        );
        place.assert_clean();
    }
    for facet in ["front", "left", "right", "floor"] {
        let (a, b) = (place.log("a", facet), place.log("b", facet));
        assert_eq!(numbers(&a), (0..=40).collect::<Vec<_>>());
        assert_eq!((numbers(&a), states(&a)), (numbers(&b), states(&b)), "{facet}");
    }
}

#[test]
fn ctrl_c_ends_all_and_leaves_nothing() {
    let place = Place::new("cave-ctrl-c", &wall());
    let run = place.start("cave", &["--no-pictures", "--log-dir", &place.path("out")]);
    place.wait_for("out", "r", 5);
    let facets = run.facets();
    assert_eq!(facets.len(), 2);
    signal(run.pid(), Signal::INT);
    let (code, said, wrong) = run.end();
    assert_eq!(code, Some(0), "{wrong}");
    assert!(said.contains("facet l: ") && said.contains("facet r: "), "{said}");
    assert!(!wrong.contains("rror"), "{wrong}");
    facets.iter().for_each(|(name, pid)| assert!(!alive(*pid), "facet {name} lives on"));
    place.assert_clean();
}

#[test]
fn a_run_that_goes_on_is_refused_by_name_or_replaced() {
    let place = Place::new("cave-lock", &wall());
    let first = place.start("cave", &["--no-pictures", "--log-dir", &place.path("out")]);
    place.wait_for("out", "r", 5);
    let (code, _, wrong) = place.start("cave", &["--no-pictures", "--duration", "0.1"]).end();
    assert_eq!(code, Some(1), "{wrong}");
    for word in [format!("process {}", first.pid()), place.scene.clone(), "since 20".into(), "--replace".into()] {
        assert!(wrong.contains(&word), "'{word}' is not said: {wrong}");
    }
    // another cave has another lock
    let elsewhere = place.folder.write("elsewhere.toml", wall());
    let mut other =
        command(&["cave", &place.scene, "--cave", &elsewhere, "--no-pictures", "--duration", "0.1", "--quiet"]);
    assert!(other.env("XDG_RUNTIME_DIR", place.folder.path("run")).status().unwrap().success());
    let facets = first.facets();
    let summary = place.succeed("cave", &["--no-pictures", "--duration", "0.1", "--replace"]);
    assert_eq!(summary["frames"], 11);
    let (code, _, wrong) = first.end();
    assert_eq!(code, Some(0), "{wrong}");
    facets.iter().for_each(|(name, pid)| assert!(!alive(*pid), "facet {name} lives on"));
    place.assert_clean();
}

#[test]
fn a_facet_of_another_scene_is_refused_with_both_hashes() {
    let place = Place::new("cave-refused", &wall());
    let server = place.start("serve", &["--connect-timeout", "60"]);
    let other = place.folder.write("other.toml", SCENE.replace("radius_m = 0.3", "radius_m = 0.31"));
    let mut facet =
        command(&["facet", &other, "--cave", &place.cave, "--facet", "l", "--no-pictures", "--connect-timeout", "60"]);
    let out = facet.env("XDG_RUNTIME_DIR", place.folder.path("run")).output().unwrap();
    let wrong = String::from_utf8_lossy(&out.stderr);
    assert_eq!(out.status.code(), Some(2), "{wrong}");
    let hashes = wrong.split(|c: char| !c.is_ascii_hexdigit()).filter(|word| word.len() >= 16).count();
    assert!(wrong.contains("refuses it") && hashes == 2, "{wrong}");
    signal(server.pid(), Signal::TERM);
    let (_, _, wrong) = server.end();
    assert!(wrong.contains("facet l was refused"), "{wrong}");
}

#[test]
fn facets_that_are_missing_at_the_start_are_named() {
    let place = Place::new("cave-missing", &wall());
    let (code, _, wrong) = place.start("serve", &["--connect-timeout", "0.3"]).end();
    assert_eq!(code, Some(1), "{wrong}");
    assert!(wrong.contains("tumble facet") && wrong.contains("l, r did not join within 0.3 s"), "{wrong}");
    let (code, _, wrong) = place.start("facet", &["--facet", "l", "--no-pictures", "--connect-timeout", "0.3"]).end();
    assert_eq!(code, Some(1), "{wrong}");
    assert!(wrong.contains("no run was in progress"), "{wrong}");
    // a facet that cannot start ends the start before the timeout
    let (code, _, wrong) = place.start("cave", &["--frames-dir", "/proc/nowhere", "--no-pictures"]).end();
    assert_eq!(code, Some(2), "{wrong}");
    std::fs::create_dir(place.folder.path("out")).unwrap();
    std::fs::write(place.folder.path("out/l"), "no folder").unwrap();
    let (code, _, wrong) = place.start("cave", &["--log-dir", &place.path("out"), "--no-pictures"]).end();
    assert_eq!(code, Some(1), "{wrong}");
    assert!(wrong.contains("out/l") && wrong.contains("ended before the start"), "{wrong}");
    place.assert_clean();
}

#[test]
fn an_environment_brings_lights_camera_and_what_stands_still() {
    let place = Place::new("cave-environment", &wall());
    let hall = "[[body]]\nname = \"column\"\nmode = \"static\"\nshape = { type = \"box\", size_m = [1, 1, 3] }\nposition_m = [0.3, 0.6, 1.5]\n[[body]]\nname = \"loose\"\nshape = { type = \"sphere\", radius_m = 0.1 }\nmass_kg = 1.0\n[camera]\neye_m = [0, -3, 2]\ntarget_m = [0, 0, 1]\n";
    let environment = place.folder.write("hall.toml", hall);
    let args = ["--no-pictures", "--duration", "0.2", "--no-realtime", "--environment", &environment, "--log-dir"];
    let (code, _, wrong) = place.start("cave", &[&args[..], &[&place.path("with")]].concat()).end();
    assert_eq!(code, Some(0), "{wrong}");
    assert!(
        wrong.contains("1 bodies that do not move; camera and lights of") && wrong.contains("are ignored"),
        "{wrong}"
    );
    assert!(wrong.contains("1 objects that move are left out"), "{wrong}");
    assert_eq!(place.log("with", "l").len(), 21);
    // two bodies with the same name: the names clash
    let clash = place.folder.write("clash.toml", hall.replace("column", "ball"));
    let (code, _, wrong) = place.start("cave", &["--environment", &clash]).end();
    assert_eq!(code, Some(2), "{wrong}");
    assert!(wrong.contains("\"ball\"") && wrong.contains("rename one"), "{wrong}");
}

/// Processes that compile pipelines and draw need longer than this timeout in any case.
#[test]
fn facets_that_prepare_are_waited_for_beyond_the_timeout() {
    if tumble::render::Renderer::new().is_err() {
        return crate::desktop::skip("this machine has no graphics adapter");
    }
    let place = Place::new("cave-slow-start", &wall());
    let args = ["--offscreen", "--no-realtime", "--duration", "0.02", "--quality", "fastest", "--wait", "0.05"];
    let summary = place.succeed("cave", &args);
    assert_eq!(summary["frames"], 3);
    // nobody says that the facets of this server prepare
    let (code, _, wrong) = place.start("serve", &["--wait", "0.05"]).end();
    assert_eq!(code, Some(1), "{wrong}");
    assert!(wrong.contains("did not join within 0.1 s") && wrong.contains("--wait SECONDS"), "{wrong}");
}

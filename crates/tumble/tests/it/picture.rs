//! `--screenshot` with and without a graphics adapter.

use crate::common::*;
use std::path::Path;

/// Hides every graphics driver: no Vulkan ICD, no EGL vendor, no Mesa driver.
fn without_adapter(args: &[&str]) -> std::process::Output {
    let mut command = command(args);
    for key in ["VK_DRIVER_FILES", "VK_ICD_FILENAMES", "VK_ADD_DRIVER_FILES"] {
        command.env(key, "/nonexistent/icd.json");
    }
    for key in ["__EGL_VENDOR_LIBRARY_FILENAMES", "__EGL_VENDOR_LIBRARY_DIRS", "__EGL_EXTERNAL_PLATFORM_CONFIG_DIRS"] {
        command.env(key, "/nonexistent");
    }
    command
        .env("LIBGL_DRIVERS_PATH", "/nonexistent")
        .env("GBM_BACKENDS_PATH", "/nonexistent")
        .env("LIBGL_ALWAYS_SOFTWARE", "0");
    command.env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY");
    command.output().unwrap()
}

#[test]
fn without_an_adapter_everything_but_the_picture_succeeds_and_the_message_names_the_package() {
    let folder = Folder::new("no-adapter");
    let file = |name: &str| text(&folder.path(name));
    let (picture, recording, summary) = (file("out.png"), file("out.mcap"), file("out.json"));
    let out = without_adapter(&[
        "run",
        "incline",
        "--duration",
        "0.1",
        "--screenshot",
        &picture,
        "--record",
        &recording,
        "--summary",
        &summary,
    ]);
    let said = String::from_utf8(out.stderr).unwrap();
    assert_eq!(out.status.code(), Some(0), "{said}");
    assert!(!said.contains("panicked"), "{said}");
    assert_eq!(tumble::net::record::read(&recording).unwrap().count(), 25);
    assert_eq!(json(summary.as_ref())["steps"], 24);
    if Path::new(&picture).exists() {
        // directly to the terminal: the harness hides the output of passing tests
        let _ = std::io::Write::write_fmt(
            &mut std::io::stderr(),
            format_args!("\nSKIPPED: a driver was found all the same, so there is no message to check\n"),
        );
        return;
    }
    assert!(said.contains("mesa-vulkan-drivers"), "{said}");
}

#[test]
fn with_an_adapter_every_scene_gets_a_picture() {
    let folder = Folder::new("pictures");
    for scene in SCENES {
        let path = folder.path("out.png");
        let _ = std::fs::remove_file(&path);
        let out = tumble(&[
            "run",
            scene,
            "--duration",
            "0.05",
            "--quiet",
            "--size",
            "64x48",
            "--debug-draw",
            "all",
            "--screenshot",
            &text(&path),
        ]);
        let said = String::from_utf8(out.stderr).unwrap();
        assert!(out.status.success(), "{scene}: {said}");
        if said.contains("no picture:") {
            // directly to the terminal: the harness hides the output of passing tests
            let _ = std::io::Write::write_fmt(
                &mut std::io::stderr(),
                format_args!("\nSKIPPED: this machine has no graphics adapter; {said}\n"),
            );
            return;
        }
        let bytes = std::fs::read(&path).unwrap();
        assert_eq!(bytes[..8], *b"\x89PNG\r\n\x1a\n", "{scene}");
        assert_eq!(bytes[16..24], [0, 0, 0, 64, 0, 0, 0, 48], "{scene}: width and height in the header");
    }
}

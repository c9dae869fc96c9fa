//! Windows on each driver and desktop: X with Vulkan and with OpenGL alone, Wayland; and crashes of
//! the driver.

use crate::common::*;
use crate::desktop::{Desktop, PATIENCE, Running, Session, is_installed, skip};
use std::process::Stdio;
use std::time::{Duration, Instant};

/// A machine without Vulkan.
const NO_VULKAN: [(&str, &str); 2] = [("VK_DRIVER_FILES", "/none"), ("VK_ICD_FILENAMES", "/none")];

/// The exit code, and the messages without those of the driver's loader.
fn outcome(session: &mut Session) -> (Option<i32>, String) {
    let (code, said) = session.end();
    (code, said.lines().filter(|line| !line.starts_with("libEGL")).collect::<Vec<_>>().join("\n"))
}

/// A driver that crashes loses its device, in the middle of a run.
fn loses_its_device(desktop: &Desktop, name: &str, interface: &str, environment: &[(&str, &str)]) {
    let args = ["stack", "--size", "64x48", "--lose-device", "3"];
    let mut view = Session::spawn_with(desktop, Folder::new(name), &args, environment);
    let (code, said) = outcome(&mut view);
    if said.contains("no graphics adapter") {
        return skip(&said);
    }
    assert!(
        code == Some(1) && said.starts_with("error: the window: the graphics device ") && said.contains("lost"),
        "{code:?}: {said}"
    );
    assert!(said.contains(interface) && said.lines().count() == 1, "{said}");
}

#[test]
fn a_device_that_is_lost_ends_the_window_with_a_message() {
    let Some(desktop) = Desktop::open() else { return };
    loses_its_device(&desktop, "view-device-vulkan", "Vulkan", &[]);
    loses_its_device(&desktop, "view-device-gl", "Gl", &NO_VULKAN);
}

#[test]
fn a_machine_without_vulkan_shows_the_same() {
    let Some(desktop) = Desktop::open() else { return };
    let status = |name: &str, environment: &[(&str, &str)]| {
        let mut view = Session::spawn_with(
            &desktop,
            Folder::new(name),
            &["stack", "--size", "64x48", "--frames", "3", "--paused"],
            environment,
        );
        let (code, said) = outcome(&mut view);
        if said.contains("no graphics adapter") {
            skip(&said);
            return None;
        }
        assert_eq!((code, said.as_str()), (Some(0), ""));
        view.status()
    };
    let (Some(vulkan), Some(gl)) = (status("view-vulkan", &[]), status("view-gl", &NO_VULKAN)) else { return };
    assert_eq!(vulkan, gl);
    assert_eq!(gl["shown"], 3);
}

/// A Wayland desktop without a screen; its sockets are in a folder of its own.
fn compositor(folder: &Folder) -> Option<Running> {
    if !is_installed("weston") {
        skip("Wayland is not tested: there is no weston; on Debian: apt-get install weston");
        return None;
    }
    let mut command = tied("weston");
    command.args([
        "--backend=headless-backend.so",
        "--use-pixman",
        "--idle-time=0",
        "--socket=wayland-test",
        "--width=800",
        "--height=600",
    ]);
    command
        .env("XDG_RUNTIME_DIR", folder.path(""))
        .env_remove("WAYLAND_DISPLAY")
        .env_remove("DISPLAY")
        .stdout(Stdio::null())
        .stderr(Stdio::null());
    let mut weston = Running(command.spawn().unwrap());
    let start = Instant::now();
    while !folder.path("wayland-test").exists() {
        assert!(weston.0.try_wait().unwrap().is_none() && start.elapsed() < PATIENCE, "weston did not start");
        std::thread::sleep(Duration::from_millis(20));
    }
    Some(weston)
}

#[test]
fn windows_open_on_wayland() {
    if !cfg!(feature = "wayland") {
        skip("Wayland is not tested: the command is built without the feature `wayland`");
        return;
    }
    let Some(desktop) = Desktop::open() else { return };
    let folder = Folder::new("wayland");
    let Some(weston) = compositor(&folder) else { return };
    let runtime = text(&folder.path(""));
    let wayland = [("WAYLAND_DISPLAY", "wayland-test"), ("XDG_RUNTIME_DIR", runtime.as_str()), ("DISPLAY", "")];
    let args = ["stack", "--size", "64x48", "--frames", "3", "--paused"];
    let mut view = Session::spawn_with(&desktop, Folder::new("view-wayland"), &args, &wayland);
    let (code, said) = outcome(&mut view);
    if said.contains("no graphics adapter") {
        return skip(&said);
    }
    assert_eq!((code, said.as_str()), (Some(0), ""));
    let status = view.status().unwrap();
    assert!(status["shown"] == 3 && status["size_px"] == serde_json::json!([64, 48]), "{status}");
    loses_its_device(&desktop, "view-device-wayland", "Vulkan", &wayland);
    // the desktop ends in mid-run
    let mut view =
        Session::spawn_with(&desktop, Folder::new("view-wayland-lost"), &["stack", "--size", "64x48"], &wayland);
    let start = Instant::now();
    while view.status().is_none_or(|s| s["shown"].as_u64() < Some(3)) {
        assert!(start.elapsed() < PATIENCE, "no picture came");
        std::thread::sleep(Duration::from_millis(20));
    }
    drop(weston);
    let (code, said) = view.end();
    assert!(code == Some(1) && said.contains("error: the window: "), "{code:?}: {said}");
}

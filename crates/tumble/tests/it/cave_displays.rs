//! The monitor and the graphics card of a facet, on the one monitor of a test's X server.

use crate::cave_place::*;
use crate::desktop::{Desktop, skip};
use x11rb::connection::Connection;
use x11rb::protocol::randr::ConnectionExt as _;
use x11rb::protocol::xproto::ConnectionExt as _;

/// Returns a cave of one facet with these keys.
fn cave(keys: &str) -> String {
    let screens = [("f", ["[-1, 2, 0.5]", "[1, 2, 0.5]", "[-1, 2, 2.0]"])];
    cave_of(
        &screens,
        |_| format!("output = \"window\"\n{keys}"),
        "ready_timeout_ms = 2000\ndrop_timeout_ms = 4000\nconnect_timeout_ms = 90000",
    )
}

/// Runs the cave for half a second; returns exit code and stderr.
fn run(desktop: &Desktop, name: &str, keys: &str) -> (Option<i32>, String) {
    let place = Place::new(name, &cave(keys));
    let args = ["cave", &place.scene, "--cave", &place.cave, "--quality", "fastest", "--duration", "0.5"];
    let out = in_place(&place.folder, &args).env("DISPLAY", &desktop.display).output().unwrap();
    (out.status.code(), String::from_utf8_lossy(&out.stderr).into_owned())
}

#[test]
fn a_facet_covers_its_monitor_or_says_why_it_cannot() {
    let Some(desktop) = Desktop::open() else { return };
    if tumble::render::Renderer::new().is_err() {
        return skip("this machine has no graphics adapter");
    }
    // the name and size of the monitor by the protocol itself
    let (server, screen) = x11rb::connect(Some(&desktop.display)).unwrap();
    let root = server.setup().roots[screen].root;
    let monitors = server.randr_get_monitors(root, true).unwrap().reply().unwrap().monitors;
    let monitor = &monitors[0];
    let name = server.get_atom_name(monitor.name).unwrap().reply().unwrap().name;
    let name = String::from_utf8(name).unwrap();
    let size = [monitor.width, monitor.height];
    assert_eq!((monitors.len(), size), (1, [1000, 700]));

    let (code, wrong) = run(&desktop, "displays-none", "size_px = [1000, 700]\nmonitor = \"HDMI-7\"");
    assert!(
        wrong.contains(&format!("error: facet f: the window: there is no monitor \"HDMI-7\"; there are: {name}")),
        "{wrong}"
    );
    assert_eq!(code, Some(1), "{wrong}");
    let (code, wrong) = run(&desktop, "displays-size", "size_px = [640, 480]\nfull_screen = true");
    let expected = format!("monitor \"{name}\" has 1000 x 700 pixels and the full-screen picture 640 x 480");
    assert!(code == Some(1) && wrong.contains(&expected), "{wrong}");
    let (code, wrong) = run(&desktop, "displays-rate", "size_px = [640, 480]\nrefresh_hz = 119.88");
    assert!(code == Some(1) && wrong.contains(", expected 119.88 Hz"), "{wrong}");
    let (code, wrong) = run(&desktop, "displays-gpu", "size_px = [640, 480]\ngpu = \"a card of 2040\"");
    assert!(
        code == Some(1)
            && wrong.contains(": no graphics adapter has \"a card of 2040\" in its name; there are: ")
            && wrong.contains("error: facet f: "),
        "{wrong}"
    );

    let (code, wrong) =
        run(&desktop, "displays-mode", "size_px = [1000, 700]\nfull_screen = true\nrefresh_hz = 119.88");
    let expected = format!("monitor \"{name}\" has no mode of 1000 x 700 at 119.88 Hz; it has 1000 x 700 at ");
    assert!(code == Some(1) && wrong.contains(&expected), "{wrong}");

    // the whole monitor, though the position says otherwise
    let adapter = tumble::render::Renderer::new().unwrap().adapter().to_owned();
    let gpu = adapter.split(' ').next().unwrap().to_uppercase();
    let keys = format!(
        "size_px = [1000, 700]\nposition_px = [30, 40]\nmonitor = \"{name}\"\nfull_screen = true\ngpu = \"{gpu}\""
    );
    let place = Place::new("displays-whole", &cave(&keys));
    let (out, summary) = (place.path("out"), place.path("summary.json"));
    let args =
        ["cave", &place.scene, "--cave", &place.cave, "--quality", "fastest", "--log-dir", &out, "--summary", &summary];
    let mut run =
        crate::desktop::Running(in_place(&place.folder, &args).env("DISPLAY", &desktop.display).spawn().unwrap());
    place.wait_for("out", "f", 3);
    let children = server.query_tree(root).unwrap().reply().unwrap().children;
    let geometry = |window: u32| server.get_geometry(window).unwrap().reply().unwrap();
    let places: Vec<_> = children.into_iter().map(geometry).map(|at| ([at.x, at.y], [at.width, at.height])).collect();
    assert!(places.contains(&([0, 0], size)), "{places:?}");
    signal(run.0.id() as i32, rustix::process::Signal::INT);
    wait("the end", || run.0.try_wait().unwrap().is_some());
    assert_eq!(run.0.wait().unwrap().code(), Some(0));
    let facets = crate::common::json(&place.folder.path("summary.json"))["facets"].clone();
    assert!(facets[0]["adapter"].as_str().unwrap().to_uppercase().contains(&gpu), "{facets}");
}

/// A full screen sets the mode of the size and the rate that the cave file gives, and the end restores that of
/// the desktop. The X server gets the mode by the protocol itself.
#[test]
fn a_facet_sets_the_refresh_rate_and_restores_the_mode() {
    let Some(desktop) = Desktop::open() else { return };
    if tumble::render::Renderer::new().is_err() {
        return skip("this machine has no graphics adapter");
    }
    let (server, screen) = x11rb::connect(Some(&desktop.display)).unwrap();
    let root = server.setup().roots[screen].root;
    let resources = || server.randr_get_screen_resources(root).unwrap().reply().unwrap();
    let (output, crtc) = (resources().outputs[0], resources().crtcs[0]);
    let mode_of = || server.randr_get_crtc_info(crtc, x11rb::CURRENT_TIME).unwrap().reply().unwrap().mode;
    let before = mode_of();
    // 48 MHz / (800 x 500) = 120 Hz
    let (width, height, htotal, vtotal, dot_clock) = (640, 480, 800, 500, 48_000_000);
    let name = "640x480_120";
    let mode = x11rb::protocol::randr::ModeInfo {
        width,
        height,
        dot_clock,
        hsync_start: 656,
        hsync_end: 752,
        htotal,
        vsync_start: 490,
        vsync_end: 492,
        vtotal,
        name_len: name.len() as u16,
        ..Default::default()
    };
    let made = server.randr_create_mode(root, mode, name.as_bytes()).unwrap().reply();
    let added = made.map(|made| made.mode).and_then(|mode| {
        server.randr_add_output_mode(output, mode).unwrap().check()?;
        Ok(mode)
    });
    let mode = match added {
        Ok(mode) => mode,
        Err(why) => return skip(&format!("this X server takes no further video mode: {why}")),
    };
    let keys = "size_px = [640, 480]\nfull_screen = true\nrefresh_hz = 120";
    let place = Place::new("displays-set", &cave(keys));
    let out = place.path("out");
    let args = ["cave", &place.scene, "--cave", &place.cave, "--quality", "fastest", "--log-dir", &out];
    let mut run =
        crate::desktop::Running(in_place(&place.folder, &args).env("DISPLAY", &desktop.display).spawn().unwrap());
    place.wait_for("out", "f", 3);
    assert_eq!(mode_of(), mode, "before: {before}");
    signal(run.0.id() as i32, rustix::process::Signal::INT);
    wait("the end", || run.0.try_wait().unwrap().is_some());
    assert_eq!(run.0.wait().unwrap().code(), Some(0));
    assert_eq!(mode_of(), before);
}

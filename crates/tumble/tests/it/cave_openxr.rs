//! A headset moves a user: the OpenXR runtime of `tests/openxr_runtime`, whose head moves on a circle, loaded by itself
//! and by the loader of the machine.

use crate::cave_place::{Place, Process, in_place};
use crate::cave_users::{Server, one_screen, place};
use crate::common::{Folder, text};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};
use tumble::collide::{Pose, Quat, Vec3};
use tumble::net::sync::SessionReader;
use tumble_openxr_runtime::FOLDER;

/// The library of the runtime, which lies beside the tests.
fn library() -> PathBuf {
    let library = std::env::current_exe().unwrap().with_file_name("libtumble_openxr_runtime.so");
    assert!(library.exists(), "{} is not built", library.display());
    library
}

/// Lets a command find the runtime instead of the loader.
fn with_headset<'a>(command: &'a mut Command, folder: &Folder) -> &'a mut Command {
    let loaders = folder.path("loader");
    std::fs::create_dir_all(&loaders).unwrap();
    let link = loaders.join("libopenxr_loader.so.1");
    if !link.exists() {
        std::os::unix::fs::symlink(library(), link).unwrap();
    }
    command.env("LD_LIBRARY_PATH", loaders).env(FOLDER, folder.path("headset"))
}

/// Creates a file of the runtime, or removes it.
fn set(folder: &Folder, file: &str, content: Option<&str>) {
    let path = folder.path("headset").join(file);
    std::fs::create_dir_all(path.parent().unwrap()).unwrap();
    match content {
        Some(content) => std::fs::write(path, content).unwrap(),
        None => std::fs::remove_file(path).unwrap(),
    }
}

/// The angle of the circle of 20 s at this time, rad.
fn angle_now() -> f64 {
    let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap().as_nanos();
    std::f64::consts::TAU * (now % 20_000_000_000) as f64 / 20e9
}

/// Returns the angle of a head on the circle of 0.5 m at the height of 1.625 m, whose rotation is that of its place.
fn angle_of(head: &Pose) -> f64 {
    let at = head.translation.vector;
    let angle = at.y.atan2(at.x);
    let (sin, cos) = angle.sin_cos();
    assert!((at - Vec3::new(0.5 * cos, 0.5 * sin, 1.625)).norm() < 1e-6, "{at:?}");
    let turned = Quat::from_axis_angle(&Vec3::z_axis(), angle);
    assert!(head.rotation.angle_to(&turned) < 1e-6, "{head:?} at {angle}");
    angle
}

fn hand(server: &Server, side: &str) -> Vec3 {
    let world = server.facet.world();
    world.part_state(world.find(&format!("user 0 {side} hand")).unwrap(), 0).unwrap().position()
}

/// Whether both hands are where the runtime has them, in the cave's axes.
fn has_hands(server: &Server) -> bool {
    let near = |side: &str, x, y, z| (hand(server, side) - Vec3::new(x, y, z)).norm() < 1e-4;
    near("left", -0.25, 1.5, 1.0) && near("right", 0.5, 0.75, 1.25)
}

/// Asserts that the head follows the circle: not ahead of the time, and at most 4 s behind it on a busy machine.
fn assert_follows(server: &Server) {
    let behind = (angle_now() - angle_of(&server.facet.viewer().users[0].head)).rem_euclid(std::f64::consts::TAU);
    assert!(behind < 4.0 / 20.0 * std::f64::consts::TAU, "{behind} rad behind");
}

#[test]
fn a_headset_moves_head_hands_and_wand_and_is_found_again() {
    let (folder, scene, cave) = place("cave-openxr");
    let record = text(&folder.path("run.mcap"));
    let args = ["--openxr", "u", "--user-colliders", "--no-realtime", "--record", &record];
    let mut command = in_place(&folder, &[&["serve", &scene, "--cave", &cave], &args[..]].concat());
    with_headset(&mut command, &folder);
    let mut server = Server::of(&folder, &scene, &cave, command);
    server.show_until(5, |_| {});
    server.show_while("the hands", || {}, has_hands);
    for _ in 0..20 {
        let next = server.facet.session().shown().unwrap().0 + 1;
        server.show_until(next, |_| {});
        assert_follows(&server);
    }
    // select of the right hand, menu of the left one
    set(&folder, "held", Some("6"));
    let (start, mut frames) = (Instant::now(), 0);
    server.show_while(
        "half a second",
        || {},
        |_| {
            frames += 1;
            start.elapsed() > Duration::from_millis(500) && frames > 50
        },
    );
    // invalid poses: hands and buttons are free, the head stays
    set(&folder, "invalid", Some(""));
    server.show_while("free hands", || {}, |s| !has_hands(s));
    let stays = server.facet.viewer().users[0].head;
    let start = Instant::now();
    server.show_while("half a second", || {}, |_| start.elapsed() > Duration::from_millis(500));
    assert_eq!(server.facet.viewer().users[0].head, stays);
    set(&folder, "invalid", None);
    server.show_while("the hands", || {}, has_hands);
    assert_follows(&server);
    // a lost session
    set(&folder, "lost", Some(""));
    server.show_while("free hands", || {}, |s| !has_hands(s));
    set(&folder, "lost", None);
    server.show_while("the hands", || {}, has_hands);
    assert_follows(&server);
    let said = server.end();
    let times = |text: &str| said.lines().filter(|line| line.starts_with(text)).count();
    assert_eq!(times("OpenXR: circle is connected; its origin is on the floor (STAGE)"), 2, "{said}");
    assert_eq!(times("OpenXR: the session is lost ("), 1, "{said}");
    let mut recorded = SessionReader::open(record).unwrap();
    let inputs: Vec<_> = std::iter::from_fn(|| recorded.next_frame().unwrap()).flat_map(|f| f.inputs).collect();
    // bit 0 is select of the right hand, bit 3 menu of the left one
    assert!(inputs.iter().any(|(_, input)| input.buttons == 0b1001), "no button");
    let wand = inputs.iter().find_map(|(_, input)| input.wand).unwrap();
    assert!((wand.translation.vector - Vec3::new(0.0, 0.0, 1.0)).norm() < 1e-12, "{wand:?}");
    // straight ahead
    assert!((wand.rotation * Vec3::y() - Vec3::y()).norm() < 1e-12, "{wand:?}");
    assert!(inputs.iter().all(|(_, input)| input.buttons == 0 || input.buttons == 0b1001));
}

/// The key of the cave file, and a runtime without a floor: the origin of `[tracker]` is where the head began.
#[test]
fn a_cave_file_names_the_headset_and_its_origin() {
    let (folder, scene, _) = place("cave-openxr-file");
    let tracker = "[tracker]\nusers = [\"glasses\"]\nopenxr = \"glasses\"\norigin_m = [0, 0, 1.625]\n";
    let cave = folder.write("tracked.toml", one_screen() + tracker);
    set(&folder, "no_stage", Some(""));
    let mut command = in_place(&folder, &["serve", &scene, "--cave", &cave, "--no-realtime"]);
    with_headset(&mut command, &folder);
    let mut server = Server::of(&folder, &scene, &cave, command);
    server.show_until(5, |_| {});
    server.show_while("the head", || {}, |s| s.facet.viewer().users[0].head.translation.vector.z > 1.6);
    assert_follows(&server);
    let said = server.end();
    assert!(said.contains("its origin is at the head's first place (LOCAL)"), "{said}");
}

fn ends(place: &Place, args: &[&str]) -> (Option<i32>, String) {
    let fixed = ["--no-pictures", "--no-realtime", "--duration", "0.05", "--summary", "/dev/null"];
    let mut command = place.command("cave", &[&fixed[..], args].concat());
    let (code, _, wrong) = Process::start(with_headset(&mut command, &place.folder)).end();
    (code, wrong)
}

#[test]
fn a_runtime_that_cannot_serve_is_named_and_one_that_hangs_is_not_awaited() {
    let place = Place::new("openxr-refused", &crate::cave_place::wall());
    let (code, wrong) = ends(&place, &["--openxr", "nobody"]);
    assert!(code == Some(2) && wrong.contains("--openxr nobody: there is no such user; there are u"), "{wrong}");
    let (code, wrong) = ends(&place, &["--openxr", "u", "--tracker", "127.0.0.1:47200"]);
    assert!(code == Some(2) && wrong.contains("cannot be used with"), "{wrong}");
    set(&place.folder, "no_headless", Some(""));
    let (code, wrong) = ends(&place, &["--openxr", "u"]);
    assert!(code == Some(1) && wrong.contains("OpenXR: the runtime has no XR_MND_headless"), "{wrong}");
    set(&place.folder, "no_headless", None);
    set(&place.folder, "no_headset", Some(""));
    let start = Instant::now();
    let (code, wrong) = ends(&place, &["--openxr", "u"]);
    // tried every two seconds, and said every ten
    let said = wrong.matches("OpenXR: there is no headset (").count();
    assert!(code == Some(0) && (1..=1 + start.elapsed().as_secs() / 10).contains(&(said as u64)), "{said}: {wrong}");
    set(&place.folder, "hang", Some(""));
    let (code, wrong) = ends(&place, &["--openxr", "u"]);
    assert!(code == Some(0), "{wrong}");
}

/// The loader of the system, if there is one, or of a folder in `LD_LIBRARY_PATH`.
fn system_loader() -> Option<PathBuf> {
    let named = std::env::var_os("LD_LIBRARY_PATH").unwrap_or_default();
    let machine = format!("/usr/lib/{}-linux-gnu", std::env::consts::ARCH);
    let folders = std::env::split_paths(&named).chain([machine.into(), "/usr/lib64".into(), "/usr/lib".into()]);
    folders.map(|folder: PathBuf| folder.join("libopenxr_loader.so.1")).find(|file| file.exists())
}

#[test]
fn the_loader_finds_the_active_runtime() {
    let Some(loader) = system_loader() else {
        let _ = std::io::Write::write_fmt(
            &mut std::io::stderr(),
            format_args!("\nSKIPPED: this machine has no OpenXR loader (libopenxr-loader1 on Debian)\n"),
        );
        return;
    };
    let (folder, scene, cave) = place("cave-openxr-loader");
    let runtime = serde_json::json!({
        "file_format_version": "1.0.0", "runtime": { "name": "circle", "library_path": library() }
    });
    let manifest = folder.write("runtime.json", runtime.to_string());
    let start = |manifest: &Path| {
        let mut command = in_place(&folder, &["serve", &scene, "--cave", &cave, "--no-realtime", "--openxr", "u"]);
        command.env("LD_LIBRARY_PATH", loader.parent().unwrap()).env("XR_RUNTIME_JSON", manifest);
        command.env(FOLDER, folder.path("headset"));
        command
    };
    let mut server = Server::of(&folder, &scene, &cave, start(Path::new(&manifest)));
    server.show_until(5, |_| {});
    server.show_while("the head", || {}, |s| s.facet.viewer().users[0].head.translation.vector.z > 1.6);
    assert_follows(&server);
    assert!(server.end().contains("OpenXR: circle is connected"));
    // no runtime at all
    let (code, _, wrong) = Process::start(&mut start(&folder.path("missing.json"))).end();
    assert!(code == Some(1) && wrong.contains("OpenXR: there is no runtime ("), "{wrong}");
}

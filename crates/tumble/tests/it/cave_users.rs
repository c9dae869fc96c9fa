//! Actions of users in a cave, by a facet of the test's own: keys walk, the wand pulls, user
//! colliders push; and replays of recordings.

use crate::cave_place::{cave_of, in_place, make_runtime, run_key};
use crate::common::{Folder, json, succeed, text};
use std::io::{BufRead, BufReader, Read};
use std::net::SocketAddr;
use std::process::{Child, ChildStderr, Command, Stdio};
use std::time::{Duration, Instant};
use tumble::collide::{Pose, Vec3};
use tumble::net::sync::udp::{SharedKey, Timing, UdpFacet};
use tumble::net::sync::{EndReason, Facet, FacetOptions, Input, Task};

/// Maximum time that a test waits for anything.
const PATIENCE: Duration = Duration::from_secs(60);

/// A ball of 2 kg that floats at 1 m height, 2 m in front of the user; the cave's frame is the
/// world's. No force acts on it.
pub const SCENE: &str = "description = \"A ball that floats\"
[world]
dt_s = 0.01
gravity_m_per_s2 = [0, 0, 0]
[[body]]
name = \"ball\"
shape = { type = \"sphere\", radius_m = 0.2 }
mass_kg = 2.0
position_m = [0, 2, 1]
[cave]
origin_m = [0, 0, 0]
";

/// A cave of one screen, over UDP.
pub fn one_screen() -> String {
    let sync = "transport = \"udp\"\nready_timeout_ms = 2000\ndrop_timeout_ms = 4000\nconnect_timeout_ms = 60000";
    let screen = ("f", ["[-1, 3, 0.5]", "[1, 3, 0.5]", "[-1, 3, 2.0]"]);
    cave_of(&[screen], |_| "size_px = [80, 60]".into(), sync)
}

pub struct Server {
    child: Child,
    pub facet: Facet<UdpFacet>,
    pub address: SocketAddr,
    key: [u8; 32],
    hash: [u8; 32],
    // keeps the pipe open, so that the server can go on writing
    stderr: BufReader<ChildStderr>,
    sequence: u64,
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

pub fn place(test: &str) -> (Folder, String, String) {
    let folder = Folder::new(test);
    let (scene, cave) = (folder.write("scene.toml", SCENE), folder.write("cave.toml", one_screen()));
    make_runtime(&folder);
    (folder, scene, cave)
}

/// Starts a server by its command; returns its address too.
fn listening(command: &mut Command) -> (Child, SocketAddr, BufReader<ChildStderr>) {
    let mut child = command.stderr(Stdio::piped()).stdout(Stdio::null()).spawn().unwrap();
    let mut stderr = BufReader::new(child.stderr.take().unwrap());
    let address = loop {
        let mut line = String::new();
        assert!(stderr.read_line(&mut line).unwrap() > 0, "the server ended");
        if let Some(rest) = line.strip_prefix("server: udp ") {
            break rest.split(',').next().unwrap().parse().unwrap();
        }
    };
    (child, address, stderr)
}

/// Returns the server's hash of scene and cave, from its refusal of a facet with another hash. `like` is the command of
/// the server.
fn joined_hash(folder: &Folder, scene: &str, cave: &str, like: &Command) -> [u8; 32] {
    let mut command = in_place(folder, &["serve", scene, "--cave", cave, "--transport", "udp"]);
    command.envs(like.get_envs().filter_map(|(name, value)| Some((name, value?))));
    let (mut child, address, _stderr) = listening(&mut command);
    let mut stranger = connect(address, run_key(folder), "f", 0, [0; 32], scene);
    let start = Instant::now();
    let why = loop {
        assert!(start.elapsed() < PATIENCE, "no answer came");
        if let Task::Ended(EndReason::Refused(why)) = stranger.next(Duration::from_millis(20)).unwrap() {
            break why;
        }
    };
    let _ = child.kill();
    let _ = child.wait();
    let hash = why.split_whitespace().map(|word| word.trim_end_matches(',')).find(|word| word.len() == 64).unwrap();
    std::array::from_fn(|k| u8::from_str_radix(&hash[2 * k..2 * k + 2], 16).unwrap())
}

fn connect(
    address: SocketAddr,
    key: [u8; 32],
    name: &str,
    number: u16,
    hash: [u8; 32],
    scene: &str,
) -> Facet<UdpFacet> {
    let link = UdpFacet::connect(address, number, Some(SharedKey::new(key)), Timing::default()).unwrap();
    let (world, _) = tumble::scene::SceneFile::load(scene).unwrap().build().unwrap();
    Facet::new(link, FacetOptions::new(name, hash, 1), world)
}

impl Server {
    /// Starts a server that waits for its facet with each frame, and its facet.
    pub fn start(folder: &Folder, scene: &str, cave: &str, args: &[&str]) -> Server {
        Server::start_in_real_time(folder, scene, cave, &[&["--no-realtime"], args].concat())
    }

    pub fn start_in_real_time(folder: &Folder, scene: &str, cave: &str, args: &[&str]) -> Server {
        let command = in_place(folder, &[&["serve", scene, "--cave", cave], args].concat());
        Server::of(folder, scene, cave, command)
    }

    /// Starts a server by its command, and its facet.
    pub fn of(folder: &Folder, scene: &str, cave: &str, mut command: Command) -> Server {
        let hash = joined_hash(folder, scene, cave, &command);
        let (child, address, stderr) = listening(&mut command);
        let key = run_key(folder);
        let facet = connect(address, key, "f", 0, hash, scene);
        Server { child, facet, address, key, hash, stderr, sequence: 0 }
    }

    /// Connects one more facet.
    pub fn another(&self, name: &str, number: u16, scene: &str) -> Facet<UdpFacet> {
        connect(self.address, self.key, name, number, self.hash, scene)
    }

    /// Shows frames until one has the number `frame` or more, and calls `doing` before each.
    pub fn show_until(&mut self, frame: u64, mut doing: impl FnMut(&mut Input)) {
        let start = Instant::now();
        loop {
            assert!(start.elapsed() < PATIENCE, "frame {frame} did not come");
            match self.facet.next(Duration::from_millis(20)).unwrap() {
                Task::Draw => {
                    if self.facet.begin().is_some() {
                        self.facet.drawn([0; 16]).unwrap();
                    }
                }
                Task::Present(number) => {
                    self.sequence += 1;
                    let mut input = Input {
                        sequence: self.sequence,
                        user: 0,
                        head: None,
                        wand: None,
                        hands: [None; 2],
                        buttons: 0,
                        keys: Vec::new(),
                    };
                    doing(&mut input);
                    self.facet.send_input(&input).unwrap();
                    self.facet.presented().unwrap();
                    if number >= frame {
                        return;
                    }
                }
                Task::Wait(_) => {}
                Task::Ended(why) => panic!("{why:?}"),
            }
        }
    }

    /// Shows frames until a condition holds that depends on other input than frames, such as a
    /// tracker's.
    pub fn show_while(&mut self, what: &str, doing: impl Fn(), mut until: impl FnMut(&Server) -> bool) {
        let start = Instant::now();
        while !until(self) {
            assert!(start.elapsed() < PATIENCE, "{what} did not come");
            doing();
            // the server reads at most some thousand datagrams per second
            std::thread::sleep(Duration::from_millis(2));
            let next = self.facet.session().shown().map_or(0, |(frame, _)| frame + 1);
            self.show_until(next, |_| {});
        }
    }

    /// Ends the session in order; no error may have occurred. Returns the last lines of the server.
    pub fn end(mut self) -> String {
        rustix::process::kill_process(
            rustix::process::Pid::from_raw(self.child.id() as i32).unwrap(),
            rustix::process::Signal::TERM,
        )
        .unwrap();
        let start = Instant::now();
        // the server gets the good-bye, and ends
        self.facet.leave().unwrap();
        let status = loop {
            if let Some(status) = self.child.try_wait().unwrap() {
                break status;
            }
            assert!(start.elapsed() < PATIENCE, "the server does not end");
            std::thread::sleep(Duration::from_millis(10));
        };
        assert!(status.success(), "{status}");
        let mut said = String::new();
        let _ = self.stderr.read_to_string(&mut said);
        said
    }

    pub fn ball(&self) -> Vec3 {
        let world = self.facet.world();
        world.part_state(world.find("ball").unwrap(), 0).unwrap().position()
    }

    pub fn cave(&self) -> Vec3 {
        self.facet.viewer().cave.translation.vector
    }
}

#[test]
fn a_key_walks_the_cave_ahead_at_its_pace() {
    let (folder, scene, cave) = place("cave-walk");
    let mut server = Server::start(&folder, &scene, &cave, &[]);
    server.show_until(20, |_| {});
    assert_eq!((server.cave(), server.ball()), (Vec3::zeros(), Vec3::new(0.0, 2.0, 1.0)));
    // 100 frames of 0.01 s at 1.5 m/s, along y; the first may be one frame late
    server.show_until(120, |input| input.keys = vec![0x1A]);
    let walked = server.cave();
    assert!((walked.y - 1.5).abs() < 0.06 && walked.x == 0.0 && walked.z == 0.0, "{walked:?}");
    // without a key the user stands
    server.show_until(130, |_| {});
    let stands = server.cave();
    server.show_until(150, |_| {});
    assert_eq!(server.cave(), stands);
    // without `--user-colliders`, no collider pushes
    assert_eq!(server.ball(), Vec3::new(0.0, 2.0, 1.0));
    assert!(server.facet.viewer().users[0].input > 100);
}

#[test]
fn a_wand_pulls_what_it_points_at() {
    let (folder, scene, cave) = place("cave-pull");
    let mut server = Server::start(&folder, &scene, &cave, &[]);
    let from = |x: f64| Pose::from_parts(Vec3::new(x, 0.0, 1.0).into(), tumble::collide::Quat::identity());
    // the wand points along y at the ball, then moves sideways with it by half a meter
    server.show_until(20, |input| (input.wand, input.buttons) = (Some(from(0.0)), 1));
    server.show_until(300, |input| (input.wand, input.buttons) = (Some(from(0.5)), 1));
    // the grabbed point is the one nearest to the user, on the ball's surface; the ball is free to
    // turn about it
    let ball = server.ball();
    let from_hand = (ball - Vec3::new(0.5, 1.8, 1.0)).norm();
    assert!((from_hand - 0.2).abs() < 0.005 && ball.x > 0.25, "{ball:?}, {from_hand} m from the hand");
    // a wand that points past the ball pulls nothing
    let (folder, scene, cave) = place("cave-miss");
    let mut server = Server::start(&folder, &scene, &cave, &[]);
    server.show_until(20, |input| (input.wand, input.buttons) = (Some(from(0.3)), 1));
    server.show_until(60, |input| (input.wand, input.buttons) = (Some(from(0.6)), 1));
    assert_eq!(server.ball(), Vec3::new(0.0, 2.0, 1.0));
}

#[test]
fn a_body_pushes_what_it_walks_into() {
    let (folder, scene, cave) = place("cave-push");
    let mut server = Server::start(&folder, &scene, &cave, &["--user-colliders"]);
    // the capsule of 0.25 m touches the ball of 0.2 m when the cave has moved 1.55 m: at 1.5 m/s
    // after 1.03 s
    server.show_until(90, |input| input.keys = vec![0x1A]);
    assert_eq!(server.ball(), Vec3::new(0.0, 2.0, 1.0));
    server.show_until(220, |input| input.keys = vec![0x1A]);
    let (ball, cave) = (server.ball(), server.cave());
    assert!(ball.y > 2.3 && ball.y - cave.y > 0.44, "the ball is at {ball:?}, the cave at {cave:?}");
    assert!(ball.x.abs() < 1e-3 && (ball.z - 1.0).abs() < 1e-3);
}

#[test]
fn a_recording_is_shown_again_bit_by_bit_also_when_it_was_cut() {
    let (folder, _, cave) = place("cave-replay");
    let file = text(&folder.path("run.mcap"));
    let run = |args: &[&str]| {
        let out = in_place(&folder, &[args, &["--cave", &cave, "--no-realtime", "--quiet", "--offscreen"]].concat())
            .output()
            .unwrap();
        let wrong = String::from_utf8_lossy(&out.stderr).into_owned();
        assert!(out.status.success(), "{wrong}");
    };
    let lines = |folder_name: &str| -> Vec<serde_json::Value> {
        let text = std::fs::read_to_string(folder.path(folder_name).join("f").join("frames.jsonl")).unwrap();
        text.lines()
            .map(|line| serde_json::from_str::<serde_json::Value>(line).unwrap())
            .map(|l| serde_json::json!([l["frame"], l["state"], l["image"]]))
            .collect()
    };
    let long = format!("name = \"{}\"", "ball ".repeat(40)); // 200 bytes
    let motion = "mass_kg = 2.0\nvelocity_m_per_s = [0.3, 0, 0.2]";
    let moving = folder.write("moving.toml", SCENE.replace("name = \"ball\"", &long).replace("mass_kg = 2.0", motion));
    let path = |name: &str| text(&folder.path(name));
    if tumble::render::Renderer::new().is_err() {
        let _ = std::io::Write::write_fmt(
            &mut std::io::stderr(),
            format_args!("\nSKIPPED: this machine has no graphics adapter\n"),
        );
        return;
    }
    run(&["cave", &moving, "--duration", "0.6", "--record", &file, "--log-dir", &path("a")]);
    let recorded = lines("a");
    assert_eq!(recorded.len(), 61);
    run(&["replay", &file, &moving, "--log-dir", &path("b"), "--summary", &path("b.json")]);
    run(&["replay", &file, &moving, "--log-dir", &path("c")]);
    assert_eq!((lines("b"), lines("c")), (recorded.clone(), recorded.clone()));
    assert_eq!(
        json(&folder.path("b.json"))["replay"],
        serde_json::json!({ "same": 61, "different": 0, "not_compared": 0 })
    );
    // half of it, recovered
    let bytes = std::fs::read(&file).unwrap();
    let cut = folder.write("cut.mcap", &bytes[..bytes.len() / 2]);
    let said = succeed(&["recover", &cut, "-o", &path("mended.mcap")]);
    assert!(said.contains("frames in") && said.contains("what was wrong: cut at byte"), "{said}");
    run(&["replay", &path("mended.mcap"), &moving, "--log-dir", &path("d")]);
    let saved = lines("d");
    assert!(!saved.is_empty() && saved.len() < 61 && saved[..] == recorded[..saved.len()], "{} frames", saved.len());
    // a recording is refused for another scene
    let larger = folder.write("larger.toml", SCENE.replace("radius_m = 0.2", "radius_m = 0.21"));
    let out = in_place(&folder, &["replay", &file, &larger, "--cave", &cave]).output().unwrap();
    let wrong = String::from_utf8_lossy(&out.stderr);
    assert!(out.status.code() == Some(2) && wrong.contains("the recording is of a scene with the hash"), "{wrong}");
}

/// Gravity presses a ball against a wall: facets draw the contact, and so does the replay.
#[test]
fn contacts_are_drawn_in_a_cave_and_in_its_replay() {
    let (folder, _, cave) = place("cave-contacts");
    if tumble::render::Renderer::new().is_err() {
        let _ = std::io::Write::write_fmt(
            &mut std::io::stderr(),
            format_args!("\nSKIPPED: this machine has no graphics adapter\n"),
        );
        return;
    }
    let wall = "[[body]]\nname = \"wall\"\nmode = \"static\"\nshape = { type = \"box\", size_m = [1, 0.2, 1] }\nposition_m = [0, 2.299, 1]\n[cave]";
    let scene = folder
        .write("wall.toml", SCENE.replace("[cave]", wall).replace("= [0, 0, 0]\n[[body]]", "= [0, 9.81, 0]\n[[body]]"));
    let path = |name: &str| text(&folder.path(name));
    let run = |args: &[&str]| {
        let common = [&scene[..], "--cave", &cave, "--duration", "0.05", "--no-realtime", "--quiet", "--offscreen"];
        let out = in_place(&folder, &[args, &common].concat()).output().unwrap();
        assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    };
    let images = |name: &str| -> Vec<serde_json::Value> {
        let text = std::fs::read_to_string(folder.path(name).join("f").join("frames.jsonl")).unwrap();
        text.lines().map(|line| serde_json::from_str::<serde_json::Value>(line).unwrap()["image"].clone()).collect()
    };
    run(&["cave", "--log-dir", &path("plain")]);
    run(&["cave", "--log-dir", &path("drawn"), "--debug-draw", "contacts,forces", "--record", &path("run.mcap")]);
    run(&["replay", &path("run.mcap"), "--log-dir", &path("again"), "--debug-draw", "contacts,forces"]);
    let (plain, drawn, again) = (images("plain"), images("drawn"), images("again"));
    assert_eq!(plain.len(), drawn.len());
    assert!(plain.last() != drawn.last() && plain.len() > 3, "the contact is in the picture");
    assert_eq!(drawn, again);
}

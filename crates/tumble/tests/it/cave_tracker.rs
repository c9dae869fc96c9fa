//! A tracker moves users: real datagrams, built byte by byte from the specification (Open Sound
//! Control 1.0). Also replays of recorded user input.

use crate::cave_place::in_place;
use crate::cave_place::{Place, signal, states, wait, wall};
use crate::cave_users::{SCENE, Server, one_screen, place};
use crate::common::{json, text};
use serde_json::{Value, json as value};
use std::net::{SocketAddr, UdpSocket};
use std::time::{Duration, Instant};
use tumble::collide::Vec3;
use tumble::net::sync::{SessionReader, Task};

const PATIENCE: Duration = Duration::from_secs(60);

/// Returns a text, ended by a zero and padded with zeros to a multiple of four bytes.
fn padded(text: &str) -> Vec<u8> {
    let mut bytes = text.as_bytes().to_vec();
    bytes.resize(text.len() / 4 * 4 + 4, 0);
    bytes
}

/// A message of single-precision numbers.
fn floats(address: &str, numbers: &[f32]) -> Vec<u8> {
    let tags = format!(",{}", "f".repeat(numbers.len()));
    [padded(address), padded(&tags), numbers.iter().flat_map(|x| x.to_be_bytes()).collect()].concat()
}

fn ints(address: &str, numbers: &[i32]) -> Vec<u8> {
    let tags = format!(",{}", "i".repeat(numbers.len()));
    [padded(address), padded(&tags), numbers.iter().flat_map(|x| x.to_be_bytes()).collect()].concat()
}

/// Returns a bundle of messages.
fn bundle(messages: &[Vec<u8>]) -> Vec<u8> {
    let element = |m: &Vec<u8>| [&(m.len() as u32).to_be_bytes()[..], m].concat();
    [padded("#bundle"), vec![0, 0, 0, 0, 0, 0, 0, 1], messages.iter().flat_map(element).collect()].concat()
}

struct Sender {
    socket: UdpSocket,
    to: SocketAddr,
}

impl Sender {
    /// Makes a sender to a port that is free now.
    fn new() -> Sender {
        let free = UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
        Sender { socket: UdpSocket::bind("127.0.0.1:0").unwrap(), to: free }
    }

    fn send(&self, bytes: &[u8]) {
        self.socket.send_to(bytes, self.to).unwrap();
    }
}

#[test]
fn a_tracker_moves_heads_and_hands_and_what_is_wrong_is_counted() {
    let (folder, scene, cave) = place("cave-tracker");
    let (sender, summary) = (Sender::new(), folder.path("summary.json"));
    let mut server = Server::start(
        &folder,
        &scene,
        &cave,
        &["--user-colliders", "--tracker", &sender.to.to_string(), "--summary", &text(&summary)],
    );
    server.show_until(5, |_| {});
    assert_eq!(server.facet.viewer().users[0].head.translation.vector, Vec3::new(0.0, 0.0, 1.5));
    let hand = |server: &Server, side: &str| {
        let world = server.facet.world();
        world.part_state(world.find(&format!("user 0 {side} hand")).unwrap(), 0).unwrap().position()
    };
    // a quarter turn to the left about z, half a meter to the right; both hands beside the ball, in
    // one bundle
    let half = std::f32::consts::FRAC_1_SQRT_2;
    let head = floats("/tumble/user/u/head", &[0.5, 0.25, 1.75, 0.0, 0.0, half, half]);
    let left = floats("/tumble/user/u/hand/left", &[-0.25, 1.5, 1.0, 0.0, 0.0, 0.0, 1.0]);
    let near = |a: Vec3, x: f64, y: f64, z: f64| (a - Vec3::new(x, y, z)).norm() < 1e-4;
    // the other hand is inside the body: 0.15 m to the user's right, which is now y, and 0.7 m
    // below the eyes; poses are sent in steps of 1/65536 m
    let both = bundle(&[head, left]);
    server.show_while(
        "the hand",
        || sender.send(&both),
        |s| near(hand(s, "left"), -0.25, 1.5, 1.0) && near(hand(s, "right"), 0.5, 0.4, 1.05),
    );
    let viewer = server.facet.viewer();
    assert_eq!(viewer.users[0].head.translation.vector, Vec3::new(0.5, 0.25, 1.75));
    // forward was y, and is now −x
    assert!((viewer.users[0].head.rotation * Vec3::y() + Vec3::x()).norm() < 1e-6);
    assert_eq!(server.ball(), Vec3::new(0.0, 2.0, 1.0));
    // a hand of 6 cm passes through the former place of the ball of 20 cm, which is pushed to at
    // least 26 cm from the hand
    let before = server.facet.viewer().users[0].input;
    for step in 1..=40 {
        let y = 1.5 + 0.0125 * f64::from(step);
        let message = floats("/tumble/user/u/hand/left", &[0.0, y as f32, 1.0, 0.0, 0.0, 0.0, 1.0]);
        server.show_while("the hand", || sender.send(&message), |s| near(hand(s, "left"), 0.0, y, 1.0));
    }
    let (ball, left) = (server.ball(), hand(&server, "left"));
    assert!(
        (left - Vec3::new(0.0, 2.0, 1.0)).norm() < 1e-4 && ball.y > 2.255,
        "the ball is at {ball:?}, the hand at {left:?}"
    );
    assert!(server.facet.viewer().users[0].input > before);
    // one of each kind of invalid message
    let unit = [0.0, 0.0, 1.5, 0.0, 0.0, 0.0, 1.0];
    let with = |k: usize, x: f32| {
        let mut numbers = unit;
        numbers[k] = x;
        floats("/tumble/user/u/head", &numbers)
    };
    let wrong = [
        with(0, f32::NAN),
        with(1, f32::INFINITY),
        with(2, 101.0),                            // out of range
        with(6, 0.5),                              // no rotation
        floats("/tumble/user/nobody/head", &unit), // unknown user
        floats("/tumble/user/u/foot", &unit),
        floats("/tumble/u/head", &unit),
        floats("/", &[]), // unknown address
        floats("/tumble/user/u/head", &unit[..6]),
        floats("/tumble/user/u/head", &[]),
        ints("/tumble/user/u/buttons", &[-1]),
        ints("/tumble/user/u/keys", &[4; 33]), // arguments
        vec![0; 1537],                         // too long
        vec![0; 8],
        b"forged".to_vec(),
        floats("/tumble/user/u/head", &unit)[..40].to_vec(),
        Vec::new(),                           // malformed
        bundle(&vec![floats("/a", &[]); 65]), // 64 of an unknown address, and too many
        with(1, 3.5),                         // behind the screen: taken, and not followed
    ];
    wrong.iter().for_each(|bytes| sender.send(bytes));
    // datagrams are read in order: the valid one comes last
    let last = floats("/tumble/user/u/wand", &unit);
    let seen = server.facet.viewer().users[0].input;
    sender.send(&last);
    server.show_while("the last message", || {}, |s| s.facet.viewer().users[0].input > seen);
    for _ in 0..5 {
        let next = server.facet.session().shown().unwrap().0 + 1;
        server.show_until(next, |_| {});
    }
    assert_eq!(
        server.facet.viewer().users[0].head.translation.vector,
        Vec3::new(0.5, 0.25, 1.75),
        "nothing of it moved the head"
    );
    server.end();
    let summary = json(&summary);
    let expected = value!({
        "out_of_range": 3, "invalid_rotation": 1, "unknown_user": 1, "unknown_address": 3 + 64, "arguments": 4, "too_long": 1, "malformed": 4, "too_many": 1,
    });
    assert_eq!(summary["tracker"]["dropped"], expected);
    assert!(summary["heads_rejected"].as_u64() >= Some(1), "{summary}");
}

#[test]
fn keys_stretch_out_a_hand() {
    let (folder, scene, cave) = place("cave-hands");
    let mut server = Server::start(&folder, &scene, &cave, &["--user-colliders"]);
    let right = |server: &Server| {
        let world = server.facet.world();
        world.part_state(world.find("user 0 right hand").unwrap(), 0).unwrap().position()
    };
    server.show_until(5, |_| {});
    assert!((right(&server) - Vec3::new(0.15, 0.0, 0.8)).norm() < 1e-4);
    // sqrt(0.7² + 0.45²) = 0.83 m at 3 m/s take 0.28 s, or 28 frames
    server.show_until(60, |input| input.keys = vec![0x05]);
    assert!((right(&server) - Vec3::new(0.15, 0.7, 1.25)).norm() < 1e-4, "{:?}", right(&server));
    server.show_until(200, |_| {});
    assert!((right(&server) - Vec3::new(0.15, 0.0, 0.8)).norm() < 1e-4, "{:?}", right(&server));
}

#[test]
fn the_picture_follows_the_tracked_eye() {
    if tumble::render::Renderer::new().is_err() {
        let _ = std::io::Write::write_fmt(
            &mut std::io::stderr(),
            format_args!("\nSKIPPED: this machine has no graphics adapter\n"),
        );
        return;
    }
    let (folder, scene, cave) = place("cave-eye");
    let lines = |name: &str| -> Vec<Value> {
        let text = std::fs::read_to_string(folder.path(name).join("f").join("frames.jsonl")).unwrap_or_default();
        text.lines().filter_map(|line| serde_json::from_str(line).ok()).collect()
    };
    // the same view by the cave file
    let moved = folder.write("moved.toml", one_screen().replace("eye_m = [0, 0, 1.5]", "eye_m = [0.5, -0.25, 1.25]"));
    let args = |cave: &str, log: &str| {
        ["cave", &scene, "--cave", cave, "--offscreen", "--quiet", "--log-dir", &text(&folder.path(log))]
            .map(str::to_owned)
    };
    for (cave, log) in [(&cave, "before"), (&moved, "after")] {
        let args = [&args(cave, log)[..], &["--duration".into(), "0.02".into(), "--no-realtime".into()]].concat();
        assert!(in_place(&folder, &args.iter().map(String::as_str).collect::<Vec<_>>()).status().unwrap().success());
    }
    let (before, after) = (lines("before")[0]["image"].clone(), lines("after")[0]["image"].clone());
    assert_ne!(before, after);
    // and by the tracker, in a space with y up: [x, z up, −y forward]
    let tracked =
        folder.write("tracked.toml", format!("{}[tracker]\nusers = [\"glasses\"]\naxes = \"y_up\"\n", one_screen()));
    let sender = Sender::new();
    let args = [&args(&tracked, "tracked")[..], &["--tracker".into(), sender.to.to_string()]].concat();
    let mut run = in_place(&folder, &args.iter().map(String::as_str).collect::<Vec<_>>()).spawn().unwrap();
    let start = Instant::now();
    let seen = loop {
        let lines = lines("tracked");
        if lines.len() > 5 {
            assert_eq!(lines[0]["image"], before);
            sender.send(&floats("/tumble/user/glasses/head", &[0.5, 1.25, 0.25, 0.0, 0.0, 0.0, 1.0]));
        }
        if lines.last().is_some_and(|line| line["image"] == after) {
            break true;
        }
        if start.elapsed() > PATIENCE {
            break false;
        }
        std::thread::sleep(Duration::from_millis(20));
    };
    let _ = run.kill();
    let _ = run.wait();
    assert!(seen, "the picture from the tracked eye did not come");
}

/// A head that sways by 0.3 m, once in 2 s, and a facet that presents a frame 40 ms after its order. The session
/// measures the lead, and the head of the frame is where the head is when the frame is presented; without a lead it is
/// behind. A constant of the size that is measured does the same. Times are those that this test really took.
#[test]
fn a_head_is_predicted_to_the_measured_time_of_the_picture() {
    const LATER: Duration = Duration::from_millis(40);
    let start = Instant::now();
    let sway = move |at: Instant| 0.3 * (std::f64::consts::PI * (at - start).as_secs_f64()).sin();
    // median error of the head at the presentation, m, which frames that wait for a core do not move, and the summary
    let run = |name: &str, lead: &[&str]| -> (f64, Value) {
        let (folder, scene, cave) = place(name);
        let (sender, summary) = (Sender::new(), text(&folder.path("summary.json")));
        let to = sender.to.to_string();
        let args = [&["--tracker", &to, "--summary", &summary][..], lead].concat();
        let mut server = Server::start_in_real_time(&folder, &scene, &cave, &args);
        let ended = std::sync::atomic::AtomicBool::new(false);
        let mut errors = Vec::new();
        std::thread::scope(|scope| {
            scope.spawn(|| {
                while !ended.load(std::sync::atomic::Ordering::Relaxed) {
                    let head = [sway(Instant::now()) as f32, 0.0, 1.5, 0.0, 0.0, 0.0, 1.0];
                    sender.send(&floats("/tumble/user/u/head", &head));
                    std::thread::sleep(Duration::from_millis(8));
                }
            });
            let (began, mut frames) = (Instant::now(), 0);
            while frames < 120 {
                match server.facet.next(Duration::from_millis(20)).unwrap() {
                    Task::Draw => {
                        if server.facet.begin().is_some() {
                            server.facet.drawn([0; 16]).unwrap();
                        }
                    }
                    Task::Present(_) => {
                        std::thread::sleep(LATER);
                        let head = server.facet.viewer().users[0].head.translation.x;
                        server.facet.presented().unwrap();
                        frames += 1;
                        if frames > 30 {
                            errors.push((head - sway(Instant::now())).abs());
                        }
                    }
                    Task::Wait(_) => {}
                    Task::Ended(why) => panic!("{why:?}"),
                }
                assert!(began.elapsed() < PATIENCE, "{frames} frames came");
            }
            ended.store(true, std::sync::atomic::Ordering::Relaxed);
        });
        server.end();
        errors.sort_by(f64::total_cmp);
        (errors[errors.len() / 2], json(summary.as_ref()))
    };
    let (behind, _) = run("cave-lead-none", &[]);
    let (measured, figures) = run("cave-lead-auto", &["--tracker-lead", "auto"]);
    let ms = |what: &str| figures[what]["p50_ms"].as_f64().unwrap();
    let (picture, lead) = (ms("frame_to_picture"), ms("tracker_lead"));
    assert!(picture > 40.0 && lead > picture && lead < picture + 20.0, "{figures}");
    let (stated, _) = run("cave-lead-stated", &["--tracker-lead", &format!("{lead:.1}")]);
    println!("mm: {behind} {measured} {stated}, lead {lead} ms");
    assert!(measured < 0.4 * behind && measured < 1.5 * stated, "{behind} {measured} {stated}");
}

/// Heads are predicted once, by the server: nodes that step the world get them as inputs, and a recording has them.
#[test]
fn nodes_that_compute_and_replays_get_the_predicted_heads() {
    let (place, sender) = (Place::new("tracker-everywhere", &wall()), Sender::new());
    let path = |name: &str| place.path(name);
    let common = ["--no-pictures", "--compute", "everywhere", "--user-colliders", "--record"];
    let live = [&path("a.mcap"), "--log-dir", &path("out"), "--summary", &path("a.json"), "--duration", "2"];
    let heads = ["--tracker", &sender.to.to_string(), "--tracker-lead", "auto+10", "--tracker-smooth", "2"];
    let run = place.start("cave", &[&common[..], &live, &heads].concat());
    let start = Instant::now();
    while !place.folder.path("a.json").exists() {
        assert!(start.elapsed() < PATIENCE, "the run does not end");
        let x = (3.0 * start.elapsed().as_secs_f32()).sin() * 0.2;
        sender.send(&floats("/tumble/user/u/head", &[x, 0.0, 1.5, 0.0, 0.0, 0.0, 1.0]));
        std::thread::sleep(Duration::from_millis(8));
    }
    assert_eq!(run.end().0, Some(0));
    let summary = json(&place.folder.path("a.json"));
    assert!(summary["tracker_lead"]["count"].as_u64() > Some(60), "{summary}");
    let (left, right) = (place.log("out", "l"), place.log("out", "r"));
    assert!(states(&left) == states(&right) && left.len() > 100);
    for facet in summary["facets"].as_array().unwrap() {
        assert_eq!((&facet["mismatched"], &facet["first_difference"]), (&0.into(), &Value::Null));
    }
    let again = [&path("b.mcap"), "--replay-input", &path("a.mcap"), "--no-realtime"];
    let replayed = place.succeed("cave", &[&common[..], &again].concat())["replay_input"].clone();
    assert!(replayed["different"] == 0 && replayed["same"].as_u64() > Some(100), "{replayed}");
}

/// The output of DTrack as its manual shows it: a body is the head, another one a hand.
#[test]
fn bodies_of_dtrack_move_heads_and_hands() {
    let (folder, scene, cave) = place("cave-dtrack");
    let (sender, summary) = (Sender::new(), folder.path("summary.json"));
    let (to, map) = (sender.to.to_string(), "body:2=u/head,body:0=u/hand/left");
    let args = ["--user-colliders", "--tracker", &to, "--dtrack-map", map, "--summary", &text(&summary)];
    let mut server = Server::start(&folder, &scene, &cave, &args);
    server.show_until(5, |_| {});
    // millimeters; the columns of a quarter turn to the left about z
    let quarter = "[0.000000 1.000000 0.000000 -1.000000 0.000000 0.000000 0.000000 0.000000 1.000000]";
    let unit = "[1.000000 0.000000 0.000000 0.000000 1.000000 0.000000 0.000000 0.000000 1.000000]";
    let text = format!(
        "fr 7\r\nts 39596.024831\r\n6dcal 3\r\n6d 2 [0 1.000][-250.000 1500.000 1000.000 0.0000 0.0000 0.0000]{unit} \
         [2 1.000][500.000 250.000 1750.000 0.0000 0.0000 90.0000]{quarter} \r\n"
    );
    let hand = |server: &Server| {
        let world = server.facet.world();
        world.part_state(world.find("user 0 left hand").unwrap(), 0).unwrap().position()
    };
    server.show_while(
        "the hand",
        || sender.send(text.as_bytes()),
        |s| (hand(s) - Vec3::new(-0.25, 1.5, 1.0)).norm() < 1e-4,
    );
    let head = server.facet.viewer().users[0].head;
    assert_eq!(head.translation.vector, Vec3::new(0.5, 0.25, 1.75));
    assert!((head.rotation * Vec3::y() + Vec3::x()).norm() < 1e-6);
    // other text is counted
    sender.send(b"/tumble/user/u/head\0,\0\0\0");
    server.show_until(5, |_| {});
}

#[test]
fn what_users_did_is_done_again_bit_by_bit() {
    let (folder, scene, cave) = place("cave-again");
    let path = |name: &str| text(&folder.path(name));
    let sender = Sender::new();
    // keys from a window, a wand from a tracker
    let mut server = Server::start(
        &folder,
        &scene,
        &cave,
        &[
            "--user-colliders",
            "--tracker",
            &sender.to.to_string(),
            "--tracker-lead",
            "auto+10",
            "--record",
            &path("first.mcap"),
        ],
    );
    server.show_until(150, |input| {
        input.keys = vec![if input.sequence % 40 < 30 { 0x1A } else { 0x04 }];
        let x = 0.01 * (input.sequence % 20) as f32;
        sender.send(&bundle(&[
            floats("/tumble/user/u/wand", &[x, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]),
            floats("/tumble/user/u/head", &[x, 0.0, 1.5, 0.0, 0.0, 0.0, 1.0]),
            ints("/tumble/user/u/buttons", &[1]),
        ]));
    });
    let ball = server.ball();
    assert!((ball - Vec3::new(0.0, 2.0, 1.0)).norm() > 0.05, "it was not moved: {ball:?}");
    server.end();
    let again = |name: &str, args: &[&str]| -> (Value, Option<i32>, String) {
        let (file, summary) = (path(&format!("{name}.mcap")), folder.path(&format!("{name}.json")));
        let fixed = [
            "cave",
            &scene,
            "--cave",
            &cave,
            "--no-realtime",
            "--no-pictures",
            "--replay-input",
            &path("first.mcap"),
            "--record",
            &file,
            "--summary",
            &text(&summary),
        ];
        let out = in_place(&folder, &[&fixed[..], args].concat()).output().unwrap();
        (json(&summary)["replay_input"].clone(), out.status.code(), String::from_utf8_lossy(&out.stderr).into_owned())
    };
    let frames = |name: &str| {
        let mut replay = SessionReader::open(path(name)).unwrap();
        std::iter::from_fn(|| replay.next_frame().unwrap())
            .map(|f| (f.recorded.frame, f.recorded.state, f.inputs))
            .collect::<Vec<_>>()
    };
    let (counts, code, wrong) = again("second", &["--user-colliders"]);
    assert_eq!(code, Some(0), "{wrong}");
    let (first, second) = (frames("first.mcap"), frames("second.mcap"));
    assert!(first.len() > 150);
    assert_eq!((&counts["same"], &counts["different"]), (&first.len().into(), &0.into()));
    assert_eq!(counts["inputs"], first.iter().map(|(_, _, inputs)| inputs.len()).sum::<usize>());
    // the recordings are the same too, except input that came after the end of the first run
    let both = first.len() - 1;
    assert!(first[..both] == second[..both] && second.len() == first.len());
    // with another number of bodies the result differs, which is a failure
    let (counts, code, wrong) = again("third", &[]);
    assert_eq!((&counts["first_different"], code), (&0.into(), Some(1)), "{counts}");
    assert!(
        wrong.contains(&format!("{} of {} frames differ from the recording", counts["different"], first.len())),
        "{wrong}"
    );
    // another step length is refused
    let out = in_place(
        &folder,
        &[
            "cave",
            &scene,
            "--cave",
            &cave,
            "--no-realtime",
            "--no-pictures",
            "--replay-input",
            &path("first.mcap"),
            "--dt",
            "0.02",
        ],
    )
    .output()
    .unwrap();
    let wrong = String::from_utf8_lossy(&out.stderr);
    assert!(out.status.code() == Some(2) && wrong.contains("--dt and --fps must be those of the recording"), "{wrong}");
    assert!(SCENE.contains("dt_s = 0.01"));
}

/// The server of `[tracker]` is called instead of listening for datagrams.
#[test]
fn a_cave_file_names_a_vrpn_server() {
    let server = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    server.set_nonblocking(true).unwrap();
    let at = server.local_addr().unwrap();
    let tracker = format!("[tracker]\nvrpn = \"{at}\"\nvrpn_map = [\"Glasses=u/head\"]\n");
    let place = Place::new("tracker-vrpn", &(wall() + &tracker));
    let run = place.start("cave", &["--no-pictures"]);
    let mut client = None;
    wait("the client", || {
        client = server.accept().ok();
        client.is_some()
    });
    let (mut socket, _) = client.unwrap();
    socket.set_nonblocking(false).unwrap();
    let mut greeting = [0; 24];
    std::io::Read::read_exact(&mut socket, &mut greeting).unwrap();
    assert!(greeting.starts_with(b"vrpn: ver. 07."), "{greeting:?}");
    signal(run.pid(), rustix::process::Signal::INT);
    assert_eq!(run.end().0, Some(0));
}

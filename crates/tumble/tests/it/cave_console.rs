//! The operator's console of a run: by a plain HTTP client, by the command, and under fire.

use crate::cave_place::*;
use crate::common::json;
use rustix::process::Signal;
use serde_json::Value;
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::process::Stdio;
use std::time::{Duration, Instant};

/// Returns address and token of the run's console; waits for them.
pub fn link(place: &Place) -> (SocketAddr, String) {
    wait("the console", || run_info(&place.folder)["console"].is_object());
    let console = run_info(&place.folder)["console"].clone();
    (console["address"].as_str().unwrap().parse().unwrap(), console["token"].as_str().unwrap().to_owned())
}

/// Sends bytes and returns the answer, which may be empty.
fn exchange(at: SocketAddr, bytes: &[u8]) -> String {
    let mut stream = TcpStream::connect(at).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
    let _ = stream.write_all(bytes);
    let mut answer = Vec::new();
    let _ = stream.read_to_end(&mut answer);
    String::from_utf8_lossy(&answer).into_owned()
}

/// Asks with a token; returns the status code and the body.
pub fn ask(at: SocketAddr, token: &str, method: &str, path: &str) -> (u16, String) {
    let request = format!("{method} {path} HTTP/1.1\r\nHost: {at}\r\nAuthorization: Bearer {token}\r\n\r\n");
    let answer = exchange(at, request.as_bytes());
    let (head, body) = answer.split_once("\r\n\r\n").unwrap_or((&answer, ""));
    (head.get(9..12).and_then(|code| code.parse().ok()).unwrap_or(0), body.to_owned())
}

pub fn status(at: SocketAddr, token: &str) -> Value {
    let (code, body) = ask(at, token, "GET", "/api/status");
    assert_eq!(code, 200, "{body}");
    serde_json::from_str(&body).unwrap()
}

/// Runs `tumble console ADDR WORDS`; returns exit code, stdout and stderr.
pub fn console(place: &Place, at: SocketAddr, words: &[&str]) -> (Option<i32>, String, String) {
    let at = at.to_string();
    let mut command = in_place(&place.folder, &[&["console", &at], words].concat());
    let out = command.stdin(Stdio::null()).output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    (out.status.code(), text(out.stdout), text(out.stderr))
}

const RUN: [&str; 4] = ["--no-pictures", "--console", "127.0.0.1:0", "--summary"];

#[test]
fn a_run_is_watched_and_directed_by_the_command() {
    let place = Place::new("console-command", &wall());
    let (summary, out) = (place.path("summary.json"), place.path("out"));
    let run = place.start("cave", &[&RUN[..], &[&summary, "--log-dir", &out, "--compute", "everywhere"]].concat());
    let (at, token) = link(&place);
    place.wait_for("out", "r", 10);
    wait("a well status", || {
        let status = status(at, &token);
        status["alarms"].as_array().is_some_and(Vec::is_empty) && status["simulated_s"].as_f64() > Some(0.1)
    });
    let (code, said, wrong) = console(&place, at, &["status"]);
    assert!(code == Some(0) && said.contains("frames/s") && said.contains("in step"), "{said}{wrong}");
    let (code, said, _) = console(&place, at, &["status", "--json"]);
    let shown: Value = serde_json::from_str(&said).unwrap();
    assert!(code == Some(0) && shown["facets"][1]["name"] == "r" && shown["facets"][1]["frame"].as_u64() > Some(5));
    // time stands, and frames go on
    assert_eq!(console(&place, at, &["pause"]).0, Some(0));
    wait("the pause", || status(at, &token)["paused"] == true);
    let before = status(at, &token);
    wait("frames", || status(at, &token)["frame"].as_u64().unwrap() > before["frame"].as_u64().unwrap() + 20);
    assert_eq!(status(at, &token)["simulated_s"], before["simulated_s"]);
    assert_eq!(console(&place, at, &["reset"]).0, Some(0));
    wait("the reset", || status(at, &token)["simulated_s"] == 0.0);
    assert_eq!(console(&place, at, &["resume"]).0, Some(0));
    wait("time", || status(at, &token)["simulated_s"].as_f64() > Some(0.05));
    // no scene follows
    let (code, said, wrong) = console(&place, at, &["next"]);
    assert!(code == Some(1) && wrong.contains("no scene follows"), "{said}{wrong}");
    let (code, said, _) = console(&place, at, &["next", "--json"]);
    assert!(code == Some(1) && serde_json::from_str::<Value>(&said).unwrap()["error"].is_string(), "{said}");
    let (code, said, _) = console(&place, at, &["log"]);
    assert!(
        code == Some(0)
            && said.contains("facet r joined")
            && said.contains("console: reset: the world is as before the first step"),
        "{said}"
    );
    assert_eq!(console(&place, at, &["stop"]).0, Some(0));
    let (code, _, wrong) = run.end();
    assert_eq!(code, Some(0), "{wrong}");
    // what the operator did acted on all nodes alike
    let (left, right) = (place.log("out", "l"), place.log("out", "r"));
    assert!(states(&left) == states(&right) && left.len() > 40);
    let facets = json(&place.folder.path("summary.json"))["facets"].clone();
    assert_eq!((&facets[0]["mismatched"], &facets[1]["mismatched"]), (&0.into(), &0.into()));
    let (code, _, wrong) = console(&place, at, &["status"]);
    assert!(code == Some(1) && wrong.contains("no run of this user"), "{wrong}");
    place.assert_clean();
}

/// A VRPN server that is not there, and comes and goes while the run goes on.
#[test]
fn a_tracker_that_does_not_answer_is_an_alarm_until_it_does() {
    let closed = std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    let tracker = format!("[tracker]\nvrpn = \"{closed}\"\nvrpn_map = [\"Glasses=u/head\"]\n");
    let place = Place::new("console-vrpn", &(wall() + &tracker));
    let run = place.start("cave", &["--no-pictures", "--console", "127.0.0.1:0"]);
    let (at, token) = link(&place);
    let alarm = || status(at, &token)["alarms"].to_string();
    wait("the alarm", || alarm().contains(&format!("VRPN {closed}: Connection refused")));
    let (code, _, wrong) = console(&place, at, &["status"]);
    assert!(code == Some(1) && wrong.contains("VRPN"), "{wrong}");
    let server = std::net::TcpListener::bind(closed).unwrap();
    let (mut socket, _) = server.accept().unwrap();
    socket.write_all(&tumble::net::vrpn::GREETING).unwrap();
    wait("the end of the alarm", || alarm() == "[]");
    drop((server, socket));
    wait("the alarm", || alarm().contains("VRPN"));
    let log = ask(at, &token, "GET", "/api/log").1;
    let lost = log.matches("VRPN").count();
    assert!(log.contains(&format!("VRPN {closed}: is connected")) && lost >= 3, "{log}");
    assert_eq!(ask(at, &token, "POST", "/api/stop").0, 200);
    assert_eq!(run.end().0, Some(0));
}

/// Pause and reset are inputs, so a recording that has them is run again to the same states.
#[test]
fn a_recording_with_pause_and_reset_is_run_again_to_the_same_states() {
    let place = Place::new("console-record", &wall());
    let record = place.path("run.mcap");
    let run = place.start("cave", &["--no-pictures", "--console", "127.0.0.1:0", "--record", &record]);
    let (at, token) = link(&place);
    for (what, then) in [("pause", 0.2), ("resume", 0.0), ("reset", 0.3)] {
        wait("time", || status(at, &token)["simulated_s"].as_f64() >= Some(then));
        assert_eq!(ask(at, &token, "POST", &format!("/api/{what}")).0, 200, "{what}");
    }
    wait("time", || status(at, &token)["simulated_s"].as_f64() > Some(0.1));
    // a second recording waits for the end of the first, and foreign files stay
    assert_eq!(ask(at, &token, "POST", "/api/record/second.mcap").0, 409);
    assert_eq!(ask(at, &token, "POST", "/api/record/..%2Fout.mcap").0, 400);
    assert_eq!(ask(at, &token, "POST", "/api/stop").0, 200);
    assert_eq!(run.end().0, Some(0));
    let summary = place.succeed("cave", &["--no-pictures", "--no-realtime", "--replay-input", &record]);
    let replayed = &summary["replay_input"];
    assert!(replayed["different"] == 0 && replayed["same"].as_u64() > Some(30), "{replayed}");
}

#[test]
fn a_console_records_and_goes_to_the_next_scene() {
    let place = Place::new("console-next", &wall());
    let second = place.folder.write("second.toml", SCENE.replace("Things that fall", "Another"));
    let mut command = place.command("cave", &["--no-pictures", "--console", "127.0.0.1:0", "--then", &second]);
    let mut child =
        command.current_dir(place.folder.path(".")).stderr(Stdio::null()).stdout(Stdio::null()).spawn().unwrap();
    let (at, token) = link(&place);
    wait("a frame", || status(at, &token)["frame"].as_u64() > Some(5));
    assert_eq!(ask(at, &token, "POST", "/api/record/a%20show.mcap").0, 200);
    let begun = status(at, &token)["frame"].as_u64().unwrap_or(0);
    wait("frames", || status(at, &token)["frame"].as_u64() > Some(begun + 20));
    assert!(status(at, &token)["recording"].as_str().unwrap().ends_with("a show.mcap"));
    assert_eq!(ask(at, &token, "POST", "/api/unrecord").0, 200);
    assert_eq!(ask(at, &token, "POST", "/api/unrecord").0, 409);
    let recorded = tumble::net::record::read(place.folder.path("a show.mcap")).unwrap().next_frame().unwrap();
    assert!(recorded.is_some());
    assert_eq!(ask(at, &token, "POST", "/api/record/a%20show.mcap").0, 409, "nothing is overwritten");
    assert!(status(at, &token)["scene"].as_str().unwrap().ends_with("scene.toml"));
    assert_eq!(ask(at, &token, "POST", "/api/next").0, 200);
    wait("the next scene", || status(at, &token)["scene"].as_str().is_some_and(|scene| scene.ends_with("second.toml")));
    assert_eq!(ask(at, &token, "POST", "/api/next").0, 409);
    assert_eq!(ask(at, &token, "POST", "/api/stop").0, 200);
    wait("the end", || child.try_wait().unwrap().is_some());
    assert!(child.wait().unwrap().success());
    place.assert_clean();
}

/// Garbage, half requests, wrong tokens and too many clients cost the run nothing, and no request without
/// the token has an effect.
#[test]
fn a_console_under_fire_does_not_obey_and_delays_no_frame() {
    let place = Place::new("console-fire", &wall());
    let (summary, out) = (place.path("summary.json"), place.path("out"));
    let run = place.start("cave", &[&RUN[..], &[&summary, "--log-dir", &out]].concat());
    let (at, token) = link(&place);
    place.wait_for("out", "r", 10);
    let page = exchange(at, b"GET / HTTP/1.1\r\nHost: a\r\n\r\n");
    assert!(page.starts_with("HTTP/1.1 200") && page.contains("tumble console") && !page.contains(&token));
    assert!(page.contains("Content-Security-Policy: default-src 'none'"));
    for (wrong, code) in [
        ("POST /api/stop HTTP/1.1\r\n\r\n".to_owned(), "401"),
        (format!("POST /api/stop HTTP/1.1\r\nAuthorization: Bearer {}\r\n\r\n", "0".repeat(64)), "401"),
        (format!("POST /api/stop?token={token} HTTP/1.1\r\n\r\n"), "401"),
        ("OPTIONS /api/stop HTTP/1.1\r\nOrigin: http://evil\r\n\r\n".to_owned(), "405"),
        (format!("POST /api/stop HTTP/1.1\r\nAuthorization: Bearer {token}\r\nContent-Length: 9\r\n\r\n"), "413"),
        (format!("GET /{} HTTP/1.1\r\n\r\n", "x".repeat(9000)), "431"),
        ("\u{16}\u{3}\u{1}garbage\r\n\r\n".to_owned(), "400"),
    ] {
        let answer = exchange(at, wrong.as_bytes());
        // a long request may be cut off before its answer is read
        assert!(
            answer.starts_with(&format!("HTTP/1.1 {code}")) || code == "431" && answer.is_empty(),
            "{wrong:.60}: {answer}"
        );
        assert!(!answer.contains("Access-Control-Allow"));
    }
    // silent clients take all places; they are closed by the time-out, and then one is free again
    let before = *numbers(&place.log("out", "l")).last().unwrap();
    let silent: Vec<TcpStream> = (0..40).map(|_| TcpStream::connect(at).unwrap()).collect();
    let begun = Instant::now();
    wait("a free place", || ask(at, &token, "GET", "/api/status").0 == 200);
    assert!(begun.elapsed() < Duration::from_secs(20));
    drop(silent);
    let mut random = 1u64;
    for _ in 0..300 {
        let bytes: Vec<u8> = (0..200)
            .map(|_| {
                random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                (random >> 56) as u8
            })
            .collect();
        if let Ok(mut stream) = TcpStream::connect(at) {
            let _ = stream.write_all(&bytes);
        }
    }
    place.wait_for("out", "l", before + 60);
    signal(run.pid(), Signal::TERM);
    let (code, _, wrong) = run.end();
    assert_eq!(code, Some(0), "{wrong}");
    let left = numbers(&place.log("out", "l"));
    assert_eq!(left, (0..left.len() as u64).collect::<Vec<_>>(), "no frame was lost");
}

/// Starts a cave that draws and returns its console when its first facet has looked at some pictures.
/// Without a graphics adapter, returns `None`.
fn drawing(place: &Place) -> Option<(Process, SocketAddr, String)> {
    let args = ["--offscreen", "--quality", "fastest", "--console", "127.0.0.1:0"];
    let run = place.start("cave", &args);
    let (at, token) = link(place);
    let begun = Instant::now();
    loop {
        let status = TcpStream::connect(at).is_ok().then(|| status(at, &token))?;
        if status["facets"][0]["pictures"].as_u64() > Some(35) {
            return Some((run, at, token));
        }
        assert!(begun.elapsed() < PATIENCE);
        std::thread::sleep(Duration::from_millis(100));
    }
}

#[test]
fn pictures_of_all_facets_are_shown_and_a_black_screen_is_an_alarm() {
    let place = Place::new("console-pictures", &wall());
    let Some((run, at, token)) = drawing(&place) else {
        return; // no graphics adapter
    };
    let facet = status(at, &token)["facets"][0].clone();
    assert_eq!((&facet["black"], facet["image"].as_str().map(str::len)), (&0.into(), Some(32)), "a lit scene");
    for name in ["l", "r"] {
        wait("a picture", || ask(at, &token, "GET", &format!("/api/picture/{name}")).0 == 200);
    }
    let answer =
        exchange(at, format!("GET /api/picture/l HTTP/1.1\r\nAuthorization: Bearer {token}\r\n\r\n").as_bytes());
    assert!(answer.contains("image/png") && answer.contains("PNG"));
    assert_eq!(ask(at, &token, "GET", "/api/picture/none").0, 404);
    signal(run.pid(), Signal::TERM);
    assert_eq!(run.end().0, Some(0));
    // no sun and no sky
    let black = "color = \"#000000\"\nintensity = 0\n[sky]\nintensity = 0\nzenith_color = \"#000000\"\nhorizon_color = \"#000000\"\nnadir_color = \"#000000\"\n";
    place.folder.write("scene.toml", format!("{SCENE}{black}"));
    let Some((run, at, token)) = drawing(&place) else { return };
    wait("the alarm", || status(at, &token)["facets"][0]["black_now"].as_u64() >= Some(30));
    let alarms = status(at, &token)["alarms"].to_string();
    assert!(alarms.contains("facet l shows black"), "{alarms}");
    let (code, _, wrong) = console(&place, at, &["status"]);
    assert!(code == Some(1) && wrong.contains("shows black"), "{wrong}");
    signal(run.pid(), Signal::TERM);
    assert_eq!(run.end().0, Some(0));
}

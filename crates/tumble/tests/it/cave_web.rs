//! Facets on the screens of web browsers: the protocol by a client of this test, and Chromium, whose
//! picture is compared with the renderer's.

use crate::cave_place::*;
use crate::chromium::{Chromium, keep};
use crate::common::json;
use crate::desktop::skip;
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::time::{Duration, Instant};
use tumble::render::Image;
use tungstenite::handshake::client::generate_key;
use tungstenite::http::Request;
use tungstenite::{Message, WebSocket};

const KEY: &str = "a-key-of-the-test-0123456789";

/// Returns a cave with the facets `l` and `w` on one screen, of which `w` is for browsers.
fn twins(size_px: &str) -> String {
    let corners = ["[-2, 2, 0.3]", "[2, 2, 0.3]", "[-2, 2, 3.3]"];
    cave_of(
        &[("l", corners), ("w", corners)],
        |_| format!("size_px = {size_px}"),
        "ready_timeout_ms = 5000\ndrop_timeout_ms = 5000\nconnect_timeout_ms = 90000",
    )
}

fn free_address() -> SocketAddr {
    TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap()
}

/// Starts a run whose facet `w` is served to browsers; waits until it is.
fn start(place: &Place, more: &[&str]) -> (Process, SocketAddr) {
    let (at, key) = (free_address(), place.folder.write("key", KEY));
    let web = ["--web", &at.to_string(), "--web-key", &key, "--web-facets", "w"];
    let run = place.start("cave", &[&["--offscreen"], &web[..], more].concat());
    wait("the page", || TcpStream::connect(at).is_ok());
    (run, at)
}

/// Sends bytes and returns the answer.
fn exchange(at: SocketAddr, bytes: &str) -> String {
    let mut stream = TcpStream::connect(at).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
    stream.write_all(bytes.as_bytes()).unwrap();
    let mut answer = Vec::new();
    let _ = stream.read_to_end(&mut answer);
    String::from_utf8_lossy(&answer).into_owned()
}

fn request(at: SocketAddr, key: &str, origin: &str) -> Request<()> {
    Request::get(format!("ws://{at}/{key}/socket"))
        .header("Host", at.to_string())
        .header("Origin", origin)
        .header("Connection", "Upgrade")
        .header("Upgrade", "websocket")
        .header("Sec-WebSocket-Version", "13")
        .header("Sec-WebSocket-Key", generate_key())
        .body(())
        .unwrap()
}

fn connect(at: SocketAddr, key: &str, origin: &str) -> Result<WebSocket<TcpStream>, String> {
    let stream = TcpStream::connect(at).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(30))).unwrap();
    tungstenite::client::client(request(at, key, origin), stream).map(|(socket, _)| socket).map_err(|e| e.to_string())
}

/// Kinds of records with a frame's number.
const FRAME: u32 = 10;
const SHOW: u32 = 11;

/// Returns kind and first word of each record of the next message.
fn records(socket: &mut WebSocket<TcpStream>) -> Vec<(u32, u32)> {
    let Message::Binary(bytes) = socket.read().unwrap() else { panic!("a message of another kind") };
    let words: Vec<u32> = bytes.as_chunks::<4>().0.iter().map(|&word| u32::from_le_bytes(word)).collect();
    let (mut rest, mut out) = (&words[..], Vec::new());
    while let [kind, length, more @ ..] = rest {
        out.push((*kind, more[0]));
        rest = &more[*length as usize..];
    }
    out
}

fn say(socket: &mut WebSocket<TcpStream>, text: &str) {
    socket.send(Message::text(text)).unwrap();
}

/// Both facets of one process have a page, and both pages take part in the barrier.
#[test]
fn frames_of_browsers_alone_are_refused() {
    let place = Place::new("web-frames", &wall());
    let (out, at) = (place.path("out"), free_address().to_string());
    let (code, _, wrong) = place.start("cave", &["--web", &at, "--frames-dir", &out]).end();
    assert_eq!(code, Some(2), "{wrong}");
    assert!(wrong.contains(&format!("--web {at} with --frames-dir: browsers show all facets")), "{wrong}");
    place.assert_clean();
}

#[test]
fn facets_of_one_process_are_served_at_successive_ports() {
    let place = Place::new("web-group", &twins("[64, 48]"));
    let (out, summary) = (place.path("out"), place.path("summary.json"));
    let (at, key) = (free_address(), place.folder.write("key", KEY));
    let web = ["--web", &at.to_string(), "--web-key", &key, "--web-timeout", "5000", "--one-process"];
    let run = place.start("cave", &[&web[..], &["--log-dir", &out, "--summary", &summary]].concat());
    let addresses = [at, SocketAddr::new(at.ip(), at.port() + 1)];
    addresses.iter().for_each(|at| wait("the page", || TcpStream::connect(at).is_ok()));
    assert_eq!(run.facets().into_iter().map(|(names, _)| names).collect::<Vec<_>>(), ["l,w"]);
    let show = |at: SocketAddr| {
        let mut socket = connect(at, KEY, &format!("http://{at}")).unwrap();
        say(&mut socket, "hello webgl2");
        let mut next = records(&mut socket);
        for _ in 0..40 {
            let frame = next.iter().find(|(kind, _)| *kind == FRAME).unwrap().1;
            say(&mut socket, &format!("drawn {frame}"));
            assert_eq!(records(&mut socket), [(SHOW, frame)]);
            say(&mut socket, &format!("shown {frame}"));
            next = records(&mut socket);
        }
    };
    std::thread::scope(|scope| addresses.iter().for_each(|at| _ = scope.spawn(move || show(*at))));
    signal(run.pid(), rustix::process::Signal::INT);
    let (code, _, wrong) = run.end();
    assert_eq!(code, Some(0), "{wrong}");
    let facets = json(&place.folder.path("summary.json"))["facets"].clone();
    for facet in facets.as_array().unwrap() {
        assert!(facet["browsers"]["shown"].as_u64() >= Some(39) && facet["browsers"]["late"] == 0, "{facet}");
        assert_eq!((&facet["torn"], &facet["mismatched"], &facet["dropped"]), (&0.into(), &0.into(), &0.into()));
    }
    let (left, wide) = (place.log("out", "l"), place.log("out", "w"));
    assert!(left.len() > 40 && numbers(&left) == numbers(&wide));
    place.assert_clean();
}

#[test]
fn a_wrong_key_or_page_gets_403_and_nothing_else() {
    let place = Place::new("web-key", &twins("[64, 48]"));
    let (run, at) = start(&place, &[]);
    let home = format!("http://{at}");
    let page = exchange(at, &format!("GET /{KEY}/ HTTP/1.1\r\nHost: {at}\r\n\r\n"));
    assert!(page.starts_with("HTTP/1.1 200 OK\r\n") && page.contains("Content-Security-Policy"), "{page:.300}");
    assert!(page.ends_with("</html>\n") && !page.contains(KEY));
    let forbidden = "HTTP/1.1 403 Forbidden\r\nConnection: close\r\nContent-Length: 0\r\n\r\n";
    for path in ["/".to_owned(), "/a-key-of-the-test-0123456788/".into(), format!("/{KEY}/console"), format!("/{KEY}")]
    {
        assert_eq!(exchange(at, &format!("GET {path} HTTP/1.1\r\nHost: {at}\r\n\r\n")), forbidden, "{path}");
    }
    let malformed = "HTTP/1.1 400 Bad Request\r\nConnection: close\r\nContent-Length: 0\r\n\r\n";
    assert_eq!(exchange(at, "\x16\x03\x01\x02\r\n\r\n"), malformed);
    for (key, origin) in [("a-key-of-the-test-0123456788", home.as_str()), (KEY, "http://elsewhere"), (KEY, "null")] {
        let refused = connect(at, key, origin).unwrap_err();
        assert!(refused.contains("403"), "{refused}");
    }
    assert!(connect(at, KEY, &home).is_ok());
    signal(run.pid(), rustix::process::Signal::INT);
    assert_eq!(run.end().0, Some(0));
}

/// A browser of the test: it draws and shows in time, then breaks the protocol and is removed; another
/// one is slow, and the run goes on.
#[test]
fn a_browser_takes_part_in_the_barrier_and_never_stalls_it() {
    let place = Place::new("web-barrier", &twins("[64, 48]"));
    let summary = place.path("summary.json");
    let (run, at) = start(&place, &["--fps", "50", "--summary", &summary, "--web-timeout", "1000"]);
    let mut socket = connect(at, KEY, &format!("http://{at}")).unwrap();
    say(&mut socket, "hello webgl2");
    let first = records(&mut socket);
    let kinds: Vec<u32> = first.iter().map(|(kind, _)| *kind).collect();
    assert!([1, 3, 4, 6, 7, 10].iter().all(|kind| kinds.contains(kind)), "{kinds:?}");
    let mut frame = first.last().unwrap().1;
    // the barrier shows a frame only after it was drawn, and no frame is left out
    for _ in 0..60 {
        say(&mut socket, &format!("drawn {frame}"));
        assert_eq!(records(&mut socket), [(SHOW, frame)]);
        say(&mut socket, &format!("shown {frame}"));
        let next = records(&mut socket);
        assert!(next.iter().all(|(kind, _)| [6, FRAME].contains(kind)), "{next:?}");
        let newer = next.last().unwrap().1;
        assert!(newer == frame + 1 || frame < first.last().unwrap().1 + 6, "{frame} {newer}");
        frame = newer;
    }
    // it answers no more: the run waits 1 s once and goes on
    let begin = Instant::now();
    std::thread::sleep(Duration::from_millis(4000));
    say(&mut socket, &format!("drawn {frame}"));
    assert_eq!(records(&mut socket), [(SHOW, frame)]);
    let next = records(&mut socket).last().unwrap().1;
    let (passed, frames) = (begin.elapsed().as_secs_f64(), f64::from(next - frame));
    assert!(frames > 0.3 * 50.0 * (passed - 1.2), "{frames} frames in {passed} s");
    // what no page sends ends the connection
    say(&mut socket, "drawn 4000000000");
    let mut end = loop {
        match socket.read() {
            Ok(_) => {}
            Err(end) => break end.to_string(),
        }
    };
    end.truncate(80);
    // too many browsers are turned away
    let mut sockets: Vec<_> = (0..9).map(|_| connect(at, KEY, &format!("http://{at}")).unwrap()).collect();
    sockets.iter_mut().for_each(|socket| say(socket, "hello webgl2"));
    let served = sockets.iter_mut().filter_map(|socket| socket.read().ok()).filter(Message::is_binary).count();
    assert_eq!(served, 8);
    drop(sockets);
    signal(run.pid(), rustix::process::Signal::INT);
    let (code, _, wrong) = run.end();
    assert_eq!(code, Some(0), "{wrong}");
    let facets = json(&place.folder.path("summary.json"))["facets"].clone();
    let browsers = &facets[1]["browsers"];
    assert!(browsers["late"].as_u64() == Some(1) && browsers["behind_max"].as_u64() <= Some(1), "{browsers}");
    assert!(browsers["shown"].as_u64() >= Some(60) && facets[0]["browsers"].is_null(), "{browsers}");
    assert_eq!((&facets[0]["missing"], &facets[1]["missing"]), (&0.into(), &0.into()));
    assert!(wrong.contains("joins and draws by webgl2") && wrong.contains("there are too many"), "{wrong}");
}

/// A browser shows what the renderer draws of the same frame and facet, and frames within one of the
/// other facet's. Both are software drivers here, so rounding differs: by a level or two within
/// surfaces, and by pixels at edges of bodies and of shadows.
#[test]
fn chromium_shows_by_webgl_what_the_renderer_draws() {
    compare("webgl2", "billiards", "fast", &["--use-angle=swiftshader"]);
}

/// Soft shadows, and four samples: the renderer smooths edges of spheres too, a browser whole pixels.
#[test]
fn chromium_shows_soft_shadows_by_webgl() {
    compare("webgl2", "robot", "default,occlusion=off", &["--use-angle=swiftshader"]);
}

/// The picture is read back: Chromium without a display and a GPU has WebGPU, but no canvas for it.
#[test]
fn chromium_shows_by_webgpu_what_the_renderer_draws() {
    compare("webgpu-read", "billiards", "fast", &["--enable-unsafe-webgpu", "--use-webgpu-adapter=swiftshader"]);
}

/// The page finds the next scene by the same link, without a click; a device that is lost comes back.
#[test]
fn a_page_follows_the_run_to_the_next_scene() {
    let place = Place::new("web-next", &twins("[480, 360]"));
    let Some(mut page) = Chromium::start("next", [390, 844], &["--use-angle=swiftshader"]) else { return };
    let console = free_address().to_string();
    let (run, at) = start(&place, &["--quality", "fastest", "--console", &console, "--then", "billiards"]);
    page.open(&format!("http://{at}/{KEY}/"));
    page.wait_for("tumble.frames > 3");
    page.screenshot("web_phone");
    assert_eq!((page.run("tumble.backend"), page.errors.clone()), ("webgl2".into(), Vec::new()));
    let next = in_place(&place.folder, &["console", &console, "next"]).output().unwrap();
    assert!(next.status.success(), "{next:?}");
    page.wait_for("document.body.innerText.includes('trying again')");
    let before = page.run("tumble.frames").as_u64().unwrap();
    page.wait_for(&format!("tumble.frames > {before} + 3"));
    page.screenshot("web_phone_next");
    page.run("document.getElementById('screen').getContext('webgl2').getExtension('WEBGL_lose_context').loseContext()");
    page.wait_for("tumble.error.includes('the device was lost')");
    page.wait_for("window.tumble && tumble.error === '' && tumble.frames > 3");
    signal(run.pid(), rustix::process::Signal::INT);
    assert_eq!(run.end().0, Some(0));
}

/// A dome around the cave, in stereo: two pictures of up to six faces each, put together pixel by pixel.
const DOME: &str =
    "shape = \"fisheye\"\nradius_m = 4\ncenter_m = [0, 0, 1.7]\nforward = [0, 0.7, 0.7]\nup = [0, -0.7, 0.7]";
/// A wall with a projector that bends, blends, mirrors and corrects colors.
const WALL: &str = "lower_left_m = [-2, 2, 0.3]\nlower_right_m = [2, 2, 0.3]\nupper_left_m = [-2, 2, 3.3]";
const PROJECTOR: &str = "warp_file = \"warp.obj\"\nblend_file = \"blend.png\"\nflip = \"horizontal\"\ncolor = { gamma = 2.2, white = [1, 0.9, 0.8], black = [0.01, 0.01, 0.02], floor = [0.02, 0.02, 0.04] }";

/// Returns a cave with the facets `l` and `w` on one screen with these keys.
fn twins_on(screen: &str, facet: &str) -> String {
    let facet = |name: &str| format!("[[facet]]\nname = \"{name}\"\nscreen = \"s\"\n{facet}\n");
    format!(
        "[[user]]\nname = \"u\"\neye_m = [0, 0, 1.5]\n[[screen]]\nname = \"s\"\n{screen}\n{}{}[sync]\n\
         ready_timeout_ms = 5000\ndrop_timeout_ms = 5000\nconnect_timeout_ms = 90000\n",
        facet("l"),
        facet("w")
    )
}

/// A browser finishes pictures by the passes of the renderer, in the same shaders.
#[test]
fn chromium_shows_domes_warps_and_stereo_by_webgl() {
    let more = ["--use-angle=swiftshader"];
    let dome = twins_on(DOME, "size_px = [200, 200]\nstereo = \"checkerboard\"");
    compare_in("dome", &dome, [200, 200], "webgl2", "billiards", "fast", &more);
    let wall = twins_on(WALL, &format!("size_px = [240, 180]\nstereo = \"top_bottom\"\n{PROJECTOR}"));
    compare_in("wall", &wall, [240, 360], "webgl2", "billiards", "fast", &more);
}

#[test]
fn chromium_shows_domes_warps_and_stereo_by_webgpu() {
    let more = ["--enable-unsafe-webgpu", "--use-webgpu-adapter=swiftshader"];
    let dome = twins_on(DOME, "size_px = [160, 160]\nstereo = \"anaglyph\"");
    compare_in("dome", &dome, [160, 160], "webgpu-read", "billiards", "fast", &more);
    let wall = twins_on(WALL, &format!("size_px = [200, 150]\nstereo = \"rows\"\nswap_eyes = true\n{PROJECTOR}"));
    compare_in("wall", &wall, [200, 150], "webgpu-read", "billiards", "fast", &more);
}

#[test]
fn a_facet_that_alternates_eyes_is_not_served() {
    let place = Place::new("web-alternating", &twins_on(WALL, "size_px = [64, 48]\nstereo = \"frame_sequential\""));
    let args = ["--offscreen", "--web", "127.0.0.1:0", "--duration", "1"];
    let (code, _, wrong) = place.start("cave", &args).end();
    assert!(code != Some(0) && wrong.contains("facet l: is frame_sequential, and a browser does not"), "{wrong}");
}

/// The facet's process steps the world by itself, and the browser draws what it has computed.
#[test]
fn a_browser_shows_a_facet_that_computes_by_itself() {
    let place = Place::new("web-everywhere", &twins("[64, 48]"));
    let summary = place.path("summary.json");
    let (run, at) = start(&place, &["--compute", "everywhere", "--fps", "50", "--summary", &summary]);
    let mut socket = connect(at, KEY, &format!("http://{at}")).unwrap();
    say(&mut socket, "hello webgl2");
    let mut frame = records(&mut socket).last().unwrap().1;
    let (mut arrays, first) = (0, frame);
    for _ in 0..30 {
        say(&mut socket, &format!("drawn {frame}"));
        assert_eq!(records(&mut socket), [(SHOW, frame)]);
        say(&mut socket, &format!("shown {frame}"));
        let next = records(&mut socket);
        arrays += usize::from(next.iter().any(|(kind, _)| *kind == 6));
        frame = next.last().unwrap().1;
    }
    // bodies fall, so nearly every frame has other numbers
    assert!(arrays > 20 && frame >= first + 30, "{arrays} {first} {frame}");
    signal(run.pid(), rustix::process::Signal::INT);
    let (code, _, wrong) = run.end();
    assert_eq!(code, Some(0), "{wrong}");
    let facets = json(&place.folder.path("summary.json"))["facets"].clone();
    assert!(facets[1]["browsers"]["shown"].as_u64() >= Some(25), "{facets}");
    assert!(facets.as_array().unwrap().iter().all(|facet| facet["first_difference"].is_null()), "{facets}");
}

fn compare(backend: &str, scene: &str, quality: &str, more: &[&str]) {
    compare_in("flat", &twins("[480, 360]"), [480, 360], backend, scene, quality, more);
}

/// Compares the pictures of the facets `l` and `w` of a cave, which are `size_px` with both eyes in them.
fn compare_in(kind: &str, cave: &str, size_px: [u32; 2], backend: &str, scene: &str, quality: &str, more: &[&str]) {
    let mut place = Place::new(&format!("web-{kind}-{backend}-{scene}"), cave);
    place.scene = scene.into();
    write_projector(&place, cave);
    let Some(mut page) = Chromium::start(&format!("{kind}-{backend}-{scene}"), size_px, more) else { return };
    let (out, console) = (place.path("out"), free_address().to_string());
    let (run, at) = start(
        &place,
        &["--frames-dir", &out, "--quality", quality, "--console", &console, "--web-timeout", "4500", "--fps", "10"],
    );
    page.open(&format!("http://{at}/{KEY}/#draw={backend}"));
    page.wait_for("tumble.frames > 8 || tumble.error !== ''");
    if page.run("tumble.error").as_str() == Some("there is no WebGPU") {
        return skip("a page that draws by WebGPU: this Chromium has no adapter");
    }
    let name = backend.trim_end_matches("-read");
    assert_eq!((page.run("tumble.error"), page.run("tumble.backend")), ("".into(), name.into()));
    // frames within one: while the page shows frame n, the other facet has shown n - 1, and its log, which is written after that,
    // does not have n + 2 before
    let last = || place.log("out", "l").last().map_or(0, |line| line["frame"].as_u64().unwrap());
    let now_us = || std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap().as_micros() as u64;
    let mut asked = Vec::new();
    for _ in 0..20 {
        let before = last();
        let shown = page.run("tumble.shown").as_u64().unwrap();
        asked.push((before, shown, now_us()));
        std::thread::sleep(Duration::from_millis(37));
    }
    // written after they are shown, and on a busy machine much later
    place.wait_for("out", "l", asked.last().unwrap().1);
    let log = place.log("out", "l");
    let shown_at =
        |frame: u64| log.iter().find(|line| line["frame"] == frame).unwrap()["shown_unix_us"].as_u64().unwrap();
    for &(before, shown, after) in &asked {
        assert!(before <= shown + 1 && shown_at(shown - 1) <= after, "{shown} of {asked:?}");
    }
    // time stands, so that the newest frames are the same picture
    let paused = in_place(&place.folder, &["console", &console, "pause"]).output().unwrap();
    assert!(paused.status.success(), "{paused:?}");
    let shown = page.run("tumble.shown").as_u64().unwrap();
    page.wait_for(&format!("tumble.shown > {}", shown + 5));
    page.run("document.getElementById('full').style.display = 'none'");
    let seen = page.screenshot(&format!("web_{kind}_{backend}_{scene}"));
    let frame = page.run("tumble.shown").as_u64().unwrap();
    place.wait_for("out", "l", frame);
    let file = place.folder.path("out").join("l").join(format!("frame_{frame:06}.png"));
    let drawn = Image::read_png(&file).unwrap();
    keep(&file, &format!("web_{kind}_{backend}_{scene}_native"));
    assert_eq!(page.errors, Vec::<String>::new());
    signal(run.pid(), rustix::process::Signal::INT);
    assert_eq!(run.end().0, Some(0));
    let difference = Difference::of(&seen, &drawn);
    println!("{kind} {backend} {scene} {quality}: {difference:?}");
    // pictures that are finished are rounded twice, and a level of the first is more in dark colors of a gamma
    let mean = if kind == "flat" { 0.25 } else { 0.5 };
    assert!(difference.is_within(mean), "{difference:?}");
}

/// Writes the files of [`PROJECTOR`] beside the cave: a keystone, and a ramp to the right.
fn write_projector(place: &Place, cave: &str) {
    let size = cave.split("size_px = [").nth(1).unwrap().split(']').next().unwrap();
    let [width, height] = size.split(", ").map(|side| side.parse::<u32>().unwrap()).collect::<Vec<_>>()[..] else {
        panic!("{size}")
    };
    place.folder.write(
        "warp.obj",
        "v 0.1 0.05\nv 0.95 0\nv 0.9 0.9\nv 0 1\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n",
    );
    let shares: Vec<[f32; 3]> = (0..height).flat_map(|_| 0..width).map(|x| [x as f32 / width as f32; 3]).collect();
    place.folder.write("blend.png", tumble::render::Blend::png(&shares, [width, height]).unwrap());
}

/// How far two pictures are apart, in levels of 8 bits.
#[derive(Debug)]
struct Difference {
    /// Mean over all pixels and colors.
    mean: f64,
    /// Share of the pixels with a color more than 2 levels off.
    off: f64,
    /// Largest: whole pixels at edges.
    max: u8,
}

impl Difference {
    fn of(a: &Image, b: &Image) -> Difference {
        assert_eq!((a.width, a.height), (b.width, b.height));
        let pixels = a.rgba.as_chunks::<4>().0.iter().zip(b.rgba.as_chunks::<4>().0);
        let each: Vec<[u8; 3]> = pixels.map(|(a, b)| [0, 1, 2].map(|k| a[k].abs_diff(b[k]))).collect();
        let count = each.len() as f64;
        Difference {
            mean: each.iter().flatten().map(|&d| f64::from(d)).sum::<f64>() / (3.0 * count),
            off: each.iter().filter(|d| d.iter().any(|&x| x > 2)).count() as f64 / count,
            max: each.iter().flatten().copied().max().unwrap_or(0),
        }
    }

    /// A light or a shadow that is missing would be several levels in the mean.
    fn is_within(&self, mean: f64) -> bool {
        self.mean < mean && self.off < 0.01 && self.max < 255
    }
}

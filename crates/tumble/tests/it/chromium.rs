//! Chromium without a window, directed by its DevTools protocol: pages, scripts, clicks, screenshots.

use crate::common::{Folder, tied};
use crate::desktop::{Running, is_installed, skip};
use serde_json::{Value, json};
use std::io::{BufRead, BufReader};
use std::net::TcpStream;
use std::path::Path;
use std::process::Stdio;
use std::time::{Duration, Instant};
use tumble::render::Image;
use tungstenite::{Message, WebSocket};

/// Maximum time that a test waits for a browser.
const PATIENCE: Duration = Duration::from_secs(240);

/// A browser with one page.
pub struct Chromium {
    _process: Running,
    folder: Folder,
    socket: WebSocket<TcpStream>,
    next: u64,
    session: Option<String>,
    /// Exceptions and errors of the page.
    pub errors: Vec<String>,
}

impl Chromium {
    /// Starts the browser with an empty page of this size. Returns `None` if there is none, which is
    /// printed.
    pub fn start(test: &str, size_px: [u32; 2], more: &[&str]) -> Option<Chromium> {
        let folder = Folder::new(&format!("chromium-{test}"));
        if !is_installed("chromium") {
            skip("no page is tested: there is no chromium; on Debian: apt-get install chromium");
            return None;
        }
        let mut command = tied("chromium");
        command.args(["--headless=new", "--no-sandbox", "--no-first-run", "--remote-debugging-port=0"]);
        command.args(["--enable-unsafe-swiftshader", "--disable-background-timer-throttling"]);
        command.arg(format!("--user-data-dir={}", folder.path("profile").display())).args(more).arg("about:blank");
        command.env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY").env("HOME", folder.path(""));
        let child = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
        let mut process = Running(child);
        let mut lines = BufReader::new(process.0.stderr.take().unwrap()).lines().map_while(Result::ok);
        let link = lines.find_map(|line| line.strip_prefix("DevTools listening on ").map(str::to_owned));
        // the pipe must not fill up
        std::thread::spawn(move || lines.for_each(drop));
        let link = link.expect("Chromium listens");
        let at = link.strip_prefix("ws://").and_then(|rest| rest.split('/').next()).unwrap();
        let stream = TcpStream::connect(at).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        let (socket, _) = tungstenite::client::client(&link, stream).unwrap();
        let (next, session, errors) = (0, None, Vec::new());
        let mut browser = Chromium { _process: process, folder, socket, next, session, errors };
        let target = browser.ask("Target.createTarget", json!({ "url": "about:blank" }))["targetId"].clone();
        let attached = browser.ask("Target.attachToTarget", json!({ "targetId": target, "flatten": true }));
        browser.session = attached["sessionId"].as_str().map(str::to_owned);
        browser.ask("Runtime.enable", json!({}));
        browser.ask("Log.enable", json!({}));
        let [width, height] = size_px;
        let size = json!({ "width": width, "height": height, "deviceScaleFactor": 1, "mobile": false });
        browser.ask("Emulation.setDeviceMetricsOverride", size);
        Some(browser)
    }

    /// Asks by the protocol; returns the result.
    pub fn ask(&mut self, method: &str, parameters: Value) -> Value {
        self.next += 1;
        let mut question = json!({ "id": self.next, "method": method, "params": parameters });
        if let Some(session) = &self.session {
            question["sessionId"] = session.as_str().into();
        }
        self.socket.send(Message::text(question.to_string())).unwrap();
        loop {
            let Message::Text(text) = self.socket.read().unwrap() else { continue };
            let answer: Value = serde_json::from_str(&text).unwrap();
            if answer["id"] == self.next {
                assert!(answer["error"].is_null(), "{method}: {}", answer["error"]);
                return answer["result"].clone();
            }
            match answer["method"].as_str() {
                Some("Runtime.exceptionThrown") => self.errors.push(answer["params"]["exceptionDetails"].to_string()),
                Some("Log.entryAdded") if answer["params"]["entry"]["level"] == "error" => {
                    self.errors.push(answer["params"]["entry"].to_string());
                }
                Some("Page.javascriptDialogOpening") => {
                    self.errors.push(format!("dialog: {}", answer["params"]["message"]));
                }
                _ => {}
            }
        }
    }

    /// Opens a page and waits until it has loaded.
    pub fn open(&mut self, url: &str) {
        self.ask("Page.enable", json!({}));
        let answer = self.ask("Page.navigate", json!({ "url": url }));
        assert!(answer["errorText"].is_null(), "{url}: {answer}");
        self.wait_for("document.readyState === 'complete'");
    }

    /// Runs a script and returns its value; waits for promises.
    pub fn run(&mut self, script: &str) -> Value {
        let answer =
            self.ask("Runtime.evaluate", json!({ "expression": script, "returnByValue": true, "awaitPromise": true }));
        assert!(answer["exceptionDetails"].is_null(), "{script}: {answer}");
        answer["result"]["value"].clone()
    }

    /// Waits until an expression is true.
    pub fn wait_for(&mut self, expression: &str) {
        let begin = Instant::now();
        while self.run(expression) != true {
            let page = self.run("document.body && document.body.innerText");
            assert!(begin.elapsed() < PATIENCE, "{expression} did not come; errors {:?}; {page}", self.errors);
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    /// Returns the page as it is seen. With `TUMBLE_KEEP_PICTURES` it is kept under this name.
    pub fn screenshot(&mut self, name: &str) -> Image {
        let answer = self.ask("Page.captureScreenshot", json!({ "format": "png" }));
        let png = bytes_of_base64(answer["data"].as_str().unwrap());
        let file = self.folder.path("page.png");
        std::fs::write(&file, png).unwrap();
        keep(&file, name);
        Image::load_png(&file).unwrap()
    }
}

/// Keeps a picture under a name if `TUMBLE_KEEP_PICTURES` is set.
pub fn keep(file: &Path, name: &str) {
    if std::env::var_os("TUMBLE_KEEP_PICTURES").is_some() {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("pages");
        std::fs::create_dir_all(&folder).unwrap();
        std::fs::copy(file, folder.join(format!("{name}.png"))).unwrap();
    }
}

fn bytes_of_base64(text: &str) -> Vec<u8> {
    let digits = text.bytes().filter_map(|b| match b {
        b'A'..=b'Z' => Some(b - b'A'),
        b'a'..=b'z' => Some(b - b'a' + 26),
        b'0'..=b'9' => Some(b - b'0' + 52),
        b'+' => Some(62),
        b'/' => Some(63),
        _ => None,
    });
    let (mut bits, mut count, mut out) = (0u32, 0, Vec::new());
    for digit in digits {
        (bits, count) = (bits << 6 | u32::from(digit), count + 6);
        if count >= 8 {
            count -= 8;
            out.push((bits >> count) as u8);
        }
    }
    out
}

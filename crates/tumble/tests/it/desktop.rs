//! A desktop for one test (Xvfb), real keys and mouse (xdotool), pictures of a window (import), and
//! `tumble view` on it.

use crate::common::*;
use serde_json::Value;
use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// Maximum time that a test waits for anything.
pub const PATIENCE: Duration = Duration::from_secs(60);

/// Ends a process when the test ends in any way.
pub struct Running(pub Child);

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// An X server without a screen, on a free display.
pub struct Desktop {
    pub server: Running,
    pub display: String,
}

/// Returns whether there is a program of this name.
pub fn is_installed(program: &str) -> bool {
    std::env::split_paths(&std::env::var_os("PATH").unwrap_or_default()).any(|folder| folder.join(program).is_file())
}

pub fn skip(why: &str) {
    // directly to the terminal: the harness hides the output of passing tests
    let _ = std::io::Write::write_fmt(&mut std::io::stderr(), format_args!("\nSKIPPED: {why}\n"));
}

impl Desktop {
    /// Returns `None` if a program is missing, which is printed.
    pub fn open() -> Option<Desktop> {
        // without -noreset the server restarts when the last window closes, and refuses connections
        // in that moment
        Desktop::start(&["-noreset"])
    }

    /// The same as servers are without further options: it resets when its last client leaves.
    pub fn that_resets() -> Option<Desktop> {
        Desktop::start(&[])
    }

    fn start(more: &[&str]) -> Option<Desktop> {
        if let Some(missing) = ["Xvfb", "xdotool", "import"].into_iter().find(|p| !is_installed(p)) {
            skip(&format!(
                "windows are not tested: there is no {missing}; on Debian: apt-get install xvfb xdotool imagemagick"
            ));
            return None;
        }
        let mut command = tied("Xvfb");
        command
            .args(["-displayfd", "1", "-screen", "0", "1000x700x24", "-nolisten", "tcp"])
            .args(more)
            .stdout(Stdio::piped())
            .stderr(Stdio::null());
        let mut server = Running(command.spawn().unwrap());
        let mut number = String::new();
        // the server closes its end when it fails, so this ends
        BufReader::new(server.0.stdout.take().unwrap()).read_line(&mut number).unwrap();
        assert!(!number.trim().is_empty(), "Xvfb did not start");
        Some(Desktop { server, display: format!(":{}", number.trim()) })
    }

    pub fn run(&self, program: &str, args: &[&str]) -> Vec<u8> {
        let out = Command::new(program).args(args).env("DISPLAY", &self.display).output().unwrap();
        assert!(out.status.success(), "{program} {args:?}: {}", String::from_utf8_lossy(&out.stderr));
        out.stdout
    }
}

/// `tumble view` on a desktop, with its status lines.
pub struct Session<'a> {
    desktop: &'a Desktop,
    pub folder: Folder,
    process: Running,
    /// Its X11 id.
    pub window: String,
}

impl<'a> Session<'a> {
    /// Opens a window and waits for its first picture. Returns `None` without a graphics adapter.
    pub fn open(desktop: &'a Desktop, name: &str, args: &[&str]) -> Option<Session<'a>> {
        let folder = Folder::new(name);
        let mut session = Session::spawn(desktop, folder, args);
        let start = Instant::now();
        while session.status().is_none_or(|s| s["shown"] == 0) {
            if let Some(ended) = session.process.0.try_wait().unwrap() {
                let said = std::fs::read_to_string(session.folder.path("stderr")).unwrap();
                assert!(said.contains("no graphics adapter"), "ended with {ended}: {said}");
                skip(&format!("this machine has no graphics adapter; {said}"));
                return None;
            }
            assert!(start.elapsed() < PATIENCE, "no picture came");
            std::thread::sleep(Duration::from_millis(20));
        }
        let windows = String::from_utf8(desktop.run("xdotool", &["search", "--name", "^tumble: "])).unwrap();
        session.window = windows.lines().next().unwrap().to_string();
        desktop.run("xdotool", &["windowfocus", &session.window]);
        session.until("the keyboard", |s| s["focused"] == true);
        Some(session)
    }

    pub fn spawn(desktop: &'a Desktop, folder: Folder, args: &[&str]) -> Session<'a> {
        Session::spawn_with(desktop, folder, args, &[])
    }

    /// With additional environment variables.
    pub fn spawn_with(
        desktop: &'a Desktop,
        folder: Folder,
        args: &[&str],
        environment: &[(&str, &str)],
    ) -> Session<'a> {
        let (status, log) = (text(&folder.path("status")), std::fs::File::create(folder.path("stderr")).unwrap());
        let mut command = command(&[&["view"], args, &["--status", &status]].concat());
        command.env("DISPLAY", &desktop.display).env_remove("WAYLAND_DISPLAY").env_remove("WAYLAND_SOCKET").stderr(log);
        command.envs(environment.iter().copied());
        let process = Running(command.spawn().unwrap());
        Session { desktop, folder, process, window: String::new() }
    }

    /// The last complete line of the status.
    pub fn status(&self) -> Option<Value> {
        let text = std::fs::read_to_string(self.folder.path("status")).ok()?;
        let whole = &text[..text.rfind('\n')?];
        Some(serde_json::from_str(whole.lines().last()?).unwrap())
    }

    /// Waits until the status meets the condition.
    pub fn until(&mut self, what: &str, wanted: impl Fn(&Value) -> bool) -> Value {
        let start = Instant::now();
        loop {
            let status = self.status().unwrap();
            if wanted(&status) {
                return status;
            }
            assert!(self.process.0.try_wait().unwrap().is_none(), "the window closed before {what}");
            assert!(start.elapsed() < PATIENCE, "waited in vain for {what}; the status is {status}");
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    pub fn key(&self, key: &str) {
        self.desktop.run("xdotool", &["key", key]);
    }

    pub fn mouse(&self, [x, y]: [u32; 2]) {
        self.desktop.run("xdotool", &["mousemove", "--window", &self.window, &x.to_string(), &y.to_string()]);
    }

    pub fn button(&self, what: &str, button: &str) {
        self.desktop.run("xdotool", &[what, button]);
    }

    /// The content of the window: rows of red, green, blue.
    pub fn shot(&self) -> Vec<u8> {
        self.desktop.run("import", &["-window", &self.window, "-depth", "8", "rgb:-"])
    }

    /// Waits until the window shows a picture, to within a level of each channel: presenting takes
    /// time.
    pub fn comes_to_show(&self, image: &tumble::render::Image) {
        let start = Instant::now();
        loop {
            let window = self.shot();
            assert_eq!(window.len(), image.rgba.len() / 4 * 3, "the window has another size");
            let off = window
                .chunks_exact(3)
                .zip(image.rgba.chunks_exact(4))
                .filter(|(a, b)| (0..3).any(|k| a[k].abs_diff(b[k]) > 1))
                .count();
            if off == 0 {
                return;
            }
            assert!(start.elapsed() < PATIENCE, "{off} pixels differ by more than a level");
            std::thread::sleep(Duration::from_millis(50));
        }
    }

    /// Closes the window as a desktop does for the cross in the title bar.
    pub fn ask_to_close(&self) {
        use x11rb::connection::Connection;
        use x11rb::protocol::xproto::{ClientMessageEvent, ConnectionExt, EventMask};
        let (server, _) = x11rb::connect(Some(&self.desktop.display)).unwrap();
        let atom = |name: &[u8]| server.intern_atom(false, name).unwrap().reply().unwrap().atom;
        let window = self.window.parse().unwrap();
        let message =
            ClientMessageEvent::new(32, window, atom(b"WM_PROTOCOLS"), [atom(b"WM_DELETE_WINDOW"), 0, 0, 0, 0]);
        server.send_event(false, window, EventMask::NO_EVENT, message).unwrap().check().unwrap();
        server.flush().unwrap();
    }

    /// The exit code, and the messages.
    pub fn end(&mut self) -> (Option<i32>, String) {
        let start = Instant::now();
        loop {
            if let Some(status) = self.process.0.try_wait().unwrap() {
                return (status.code(), std::fs::read_to_string(self.folder.path("stderr")).unwrap());
            }
            assert!(start.elapsed() < PATIENCE, "the window does not close");
            std::thread::sleep(Duration::from_millis(20));
        }
    }
}

//! The picture of a facet as browsers draw it: the counterpart of the render thread.

use super::crowd::Crowd;
use super::frame_list::{FrameList, ListedFrame};
use super::link::{Shared, serve};
use crate::cave::address::address_towards;
use crate::cave::args::WebOptions;
use crate::cave::console::read_token;
use crate::cave::facet::ListMaker;
use crate::cave::facet_report::{BrowserReport, Reporter};
use crate::cave::listener::Listener;
use crate::cave::run_setup::{RunSetup, apply_viewer};
use crate::failure::Failure;
use std::net::SocketAddr;
use std::path::Path;
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::{Duration, Instant};
use tumble::dynamics::World;
use tumble::net::browser::MIN_KEY_BYTES;
use tumble::net::sync::Viewer;
use tumble::net::sync::udp::Entropy;
use tumble::render::{CaveView, GlslTranslator, Quality};
use tumble::scene::cave::{Facet, Stereo};

/// Environment variable with the key of a run, by which a launcher keeps links when it starts a facet
/// again. Other users of the machine cannot read it, as they can arguments.
pub const KEY_VARIABLE: &str = "TUMBLE_WEB_KEY";
/// Maximum number of connections of a facet at a time.
const MAX_CONNECTIONS: usize = 24;
/// Address of documentation (RFC 5737) towards which the route goes that other machines take too.
const ELSEWHERE: &str = "192.0.2.1";

/// The picture of a facet on browsers.
pub struct WebScreen {
    /// The lists of the process's frames.
    lists: Arc<FrameList>,
    /// Maker of the lists and connections of all facets: of the first facet alone, which has the world.
    leads: Option<(ListMaker, Vec<Arc<Shared>>)>,
    /// The frame whose list the first facet has not made yet.
    wanted: Option<u64>,
    view: CaveView,
    facet: Facet,
    glsl: GlslTranslator,
    shared: Arc<Shared>,
    _listener: Listener,
    reported: BrowserReport,
}

impl WebScreen {
    /// Serves a facet at an address, and says by which link browsers join.
    ///
    /// # Errors
    /// A facet that a browser cannot show, an address that cannot be used, a key file that cannot be
    /// read.
    pub fn open(
        setup: &RunSetup,
        facet: &Facet,
        at: SocketAddr,
        options: &WebOptions,
        lists: Arc<FrameList>,
        reporter: &Reporter,
    ) -> Result<WebScreen, Failure> {
        check(setup, facet)?;
        let key = key(options.web_key.as_deref())?;
        let timeout = Duration::from_secs_f64(1e-3 * options.web_timeout);
        let title = format!("facet {}", facet.name);
        let shared = Arc::new(Shared {
            key: key.clone(),
            crowd: Mutex::new(Crowd::new(timeout)),
            changed: Condvar::new(),
            reporter: reporter.clone(),
            title: title.clone(),
        });
        let theirs = shared.clone();
        let listener = Listener::start(at, "web", MAX_CONNECTIONS, move |stream| serve(stream, &theirs))
            .map_err(|e| Failure::run(&title, format!("--web {at}: {e}")))?;
        let key = if options.web_key.is_some() { "KEY" } else { &key };
        let link = format!("http://{}/{key}/", reachable(listener.address()));
        eprintln!("{title}: open {link} in a browser");
        reporter.line(&format!("serves browsers at {}", listener.address()));
        reporter.update(|report| report.browsers = Some(BrowserReport::default()));
        Ok(WebScreen {
            lists,
            leads: None,
            wanted: None,
            view: setup.view()?,
            facet: facet.clone(),
            glsl: GlslTranslator::new().map_err(|e| Failure::run(&title, e))?,
            shared,
            _listener: listener,
            reported: BrowserReport::default(),
        })
    }

    /// Returns what it shares with its connections.
    pub fn shared(&self) -> Arc<Shared> {
        self.shared.clone()
    }

    /// Makes this the first facet of its process, which makes the draw lists for the browsers of all.
    pub fn lead(&mut self, mut maker: ListMaker, all: Vec<Arc<Shared>>) {
        // unknown devices: hard shadows, smooth edges
        maker.quality.get_or_insert(Quality { samples: 4, ..Quality::fast() });
        self.leads = Some((maker, all));
    }

    /// Sends a frame to the browsers that have drawn their last, as soon as its draw list is there.
    pub fn begin(&mut self, world: &World, viewer: &Viewer, frame: u64) -> Result<(), Failure> {
        let Some((maker, all)) = &mut self.leads else {
            self.wanted = Some(frame);
            return Ok(());
        };
        let ready = all.iter().any(|shared| shared.crowd().is_idle());
        let list = ready.then(|| maker.list(world)).transpose()?;
        let listed = self.lists.put(ListedFrame { frame, viewer: viewer.clone(), list });
        self.send(&listed)
    }

    fn send(&mut self, listed: &ListedFrame) -> Result<(), Failure> {
        let frame = listed.frame;
        let Some(list) = listed.list.as_ref().filter(|_| self.shared.crowd().is_idle()) else { return Ok(()) };
        apply_viewer(&mut self.view, &listed.viewer, frame);
        let picture = self.view.portable(list, &self.facet).map_err(|e| Failure::run("drawing", e))?;
        let glsl = &self.glsl;
        let refused = self.shared.crowd().begin(frame, Instant::now(), |encoder| encoder.frame(frame, &picture, glsl));
        if let Some(why) = refused {
            self.shared.say(why.report().trim());
        }
        Ok(())
    }

    /// Waits at most `timeout` until no browser is awaited for the frame. Returns whether that is so.
    pub fn is_finished(&mut self, timeout: Duration) -> Result<bool, Failure> {
        let until = Instant::now() + timeout;
        if let Some(wanted) = self.wanted {
            let Some(listed) = self.lists.wait(wanted, until) else { return Ok(false) };
            self.wanted = None;
            // the first facet may have gone on, with the next frame
            if listed.frame == wanted {
                self.send(&listed)?;
            }
        }
        let mut crowd = self.shared.crowd();
        loop {
            let now = Instant::now();
            if crowd.is_drawn(now) {
                return Ok(true);
            }
            let left = until.saturating_duration_since(now);
            if left.is_zero() {
                return Ok(false);
            }
            // browsers that say nothing are late by the clock
            let wait = left.min(Duration::from_millis(10));
            crowd = self.shared.changed.wait_timeout(crowd, wait).unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    /// Has the browsers show the frame.
    pub fn present(&mut self, frame: u64) {
        let mut crowd = self.shared.crowd();
        crowd.present(frame);
        let counts = crowd.counts();
        drop(crowd);
        if counts != self.reported {
            self.shared.reporter.update(|report| report.browsers = Some(counts));
            self.reported = counts;
        }
    }
}

/// Returns the address of the facet with this index: each is at the port after the one before, or at any that
/// is free.
///
/// # Errors
/// A port beyond the last.
pub fn port_after(first: SocketAddr, index: u16, facet: &str) -> Result<SocketAddr, Failure> {
    // a free port for each
    let port = if first.port() == 0 { Some(0) } else { first.port().checked_add(index) };
    let port = port.ok_or_else(|| Failure::input(format!("--web {first}: no port is left for the facet {facet}")))?;
    Ok(SocketAddr::new(first.ip(), port))
}

/// Checks that a browser can show a facet.
fn check(setup: &RunSetup, facet: &Facet) -> Result<(), Failure> {
    if facet.stereo != Stereo::FrameSequential {
        return Ok(());
    }
    let why = "is frame_sequential, and a browser does not show each frame for one refresh of its display; --web-facets \
               names the facets to serve";
    Err(Failure::input(format!("{}: facet {}: {why}", setup.cave.file, facet.name)))
}

/// Returns the key of the link: of a file, of the launcher, or a new one.
fn key(file: Option<&Path>) -> Result<String, Failure> {
    if let Some(file) = file {
        return read_key(file);
    }
    match std::env::var(KEY_VARIABLE) {
        Ok(key) if key.len() >= MIN_KEY_BYTES && key.bytes().all(|b| b.is_ascii_alphanumeric()) => Ok(key),
        _ => new_key(),
    }
}

/// Reads the key of the links from a file.
///
/// # Errors
/// The file cannot be read, or has no key that fits into a link.
pub fn read_key(file: &Path) -> Result<String, Failure> {
    let key = read_token(file)?;
    match key.bytes().all(|b| b.is_ascii_alphanumeric() || b"-_.~".contains(&b)) {
        true => Ok(key),
        false => Err(Failure::input(format!(
            "key file {}: expected letters, digits and -_.~ alone, because the key is part of a link",
            file.display()
        ))),
    }
}

/// Draws a key.
pub fn new_key() -> Result<String, Failure> {
    let mut entropy = Entropy::system().map_err(|e| Failure::run("the key of --web", e))?;
    let bytes: [u8; 32] = entropy.next_bytes();
    Ok(bytes[..16].iter().map(|byte| format!("{byte:02x}")).collect())
}

/// Returns the address as another machine reaches it, if it is one of all interfaces.
fn reachable(at: SocketAddr) -> SocketAddr {
    match address_towards(ELSEWHERE, at.port()) {
        Some(ip) if at.ip().is_unspecified() => (ip, at.port()).into(),
        _ => at,
    }
}

//! A scene in a web browser: the world is stepped in WebAssembly, and the page around it draws what
//! this library writes into its buffers.
//!
//! `scripts/page.sh` compiles it for `wasm32-unknown-unknown` and puts it, the scripts and the page into one file. The module
//! imports nothing: no clock, no file, no random number. Scenes are the shipped ones, or texts without files.
//!
//! ```text
//! input(length) ◄── bytes of a name or a scene
//! open(length)  ──► Text: description as JSON, or the error      Geometry: triangles of all meshes
//! scenes()      ──► Text: names of the shipped scenes as JSON
//! step(frames)  ──► Text: the error of a step
//! picture()     ──► Instances: placed meshes                     Surfaces: triangles that deform
//! hash()        ──► Text: BLAKE3 of the state
//! buffer(kind), length(kind): where a buffer is, and its length in bytes; valid until the next call
//! ```
//!
//! Functions that can fail return whether they have succeeded. Numbers in buffers are `f32`, little-endian.

#![allow(unsafe_code)] // the attribute `no_mangle` of the exports; there is no unsafe block

mod session;
mod triangles;

pub use session::Session;

use std::cell::RefCell;

/// Largest input, bytes: that of scene files.
const MAX_INPUT: usize = tumble_scene::MAX_BYTES as usize;

/// Input, text and scene of the page.
#[derive(Default)]
struct Page {
    input: Vec<u8>,
    text: String,
    session: Option<Session>,
}

thread_local! {
    static PAGE: RefCell<Page> = RefCell::default();
}

fn with<T>(act: impl FnOnce(&mut Page) -> T) -> T {
    PAGE.with_borrow_mut(act)
}

impl Page {
    /// Keeps the message of an error as the text. Returns whether there was none.
    fn succeed(&mut self, outcome: Result<String, String>) -> bool {
        let success = outcome.is_ok();
        self.text = outcome.unwrap_or_else(|error| error);
        success
    }

    fn open(&mut self, length: usize) -> Result<String, String> {
        let text =
            std::str::from_utf8(&self.input[..length.min(self.input.len())]).map_err(|error| error.to_string())?;
        self.session = None;
        let (session, description) = Session::open(text)?;
        self.session = Some(session);
        Ok(description)
    }

    fn session(&mut self) -> Result<&mut Session, String> {
        self.session.as_mut().ok_or_else(|| "no scene is open".to_owned())
    }
}

/// Makes room for an input of `length` bytes and returns its address; null if it is larger than 16 MiB.
#[unsafe(no_mangle)]
pub extern "C" fn input(length: usize) -> *mut u8 {
    with(|page| {
        if length > MAX_INPUT {
            return std::ptr::null_mut();
        }
        page.input.resize(length, 0);
        page.input.as_mut_ptr()
    })
}

/// Opens the shipped scene whose name is the input, or else the input as the text of a scene.
#[unsafe(no_mangle)]
pub extern "C" fn open(length: usize) -> bool {
    with(|page| {
        let outcome = page.open(length);
        page.succeed(outcome)
    })
}

/// Writes the names of the shipped scenes as the text, a list of JSON.
#[unsafe(no_mangle)]
pub extern "C" fn scenes() {
    with(|page| page.text = session::scenes().to_string());
}

/// Advances the world by a number of frames; stops at the first error.
#[unsafe(no_mangle)]
pub extern "C" fn step(frames: u32) -> bool {
    with(|page| {
        let outcome = page.session().and_then(|session| session.step(frames));
        page.succeed(outcome.map(|()| String::new()))
    })
}

/// Writes the picture of the present state.
#[unsafe(no_mangle)]
pub extern "C" fn picture() -> bool {
    with(|page| {
        let outcome = page.session().map(Session::picture);
        page.succeed(outcome.map(|()| String::new()))
    })
}

/// Writes 64 hexadecimal digits of BLAKE3 over the bytes of the state as the text.
#[unsafe(no_mangle)]
pub extern "C" fn hash() -> bool {
    with(|page| {
        let outcome = page.session().map(|session| session.hash());
        page.succeed(outcome)
    })
}

/// Simulated time, s; NaN without a scene.
#[unsafe(no_mangle)]
pub extern "C" fn time() -> f64 {
    with(|page| page.session.as_ref().map_or(f64::NAN, |session| session.world.time()))
}

/// Number of frames since the start.
#[unsafe(no_mangle)]
pub extern "C" fn frame() -> f64 {
    with(|page| page.session.as_ref().map_or(0.0, |session| session.world.frame() as f64))
}

/// Returns the bytes of a buffer: 0 for the text, 1 to 3 for geometry, instances and surfaces.
fn bytes(page: &Page, kind: u32) -> (*const u8, usize) {
    let numbers = |numbers: &[f32]| (numbers.as_ptr().cast::<u8>(), size_of_val(numbers));
    match (kind, &page.session) {
        (0, _) => (page.text.as_ptr(), page.text.len()),
        (1, Some(session)) => numbers(&session.geometry),
        (2, Some(session)) => numbers(&session.instances),
        (3, Some(session)) => numbers(&session.surfaces),
        _ => numbers(&[]),
    }
}

/// Address of a buffer.
#[unsafe(no_mangle)]
pub extern "C" fn buffer(kind: u32) -> *const u8 {
    with(|page| bytes(page, kind).0)
}

/// Length of a buffer, bytes.
#[unsafe(no_mangle)]
pub extern "C" fn length(kind: u32) -> usize {
    with(|page| bytes(page, kind).1)
}
